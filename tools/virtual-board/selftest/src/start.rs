//! Vector table and start-up code.

use core::arch::global_asm;

use crate::core_registers::fail;

// Vector table: one word for each exception number.
global_asm!(
    ".section .vectors, \"a\"",
    ".word __stack_top",
    ".word reset",
    ".word unexpected", // NMI
    ".word hard_fault",
    ".word unexpected", // MemManage
    ".word bus_fault",
    ".word usage_fault",
    ".word 0, 0, 0, 0",
    ".word sv_call",
    ".word unexpected", // DebugMonitor
    ".word 0",
    ".word pend_sv",
    ".word sys_tick",
    ".word line0, line1, line2, line3, line4, line5",
    ".rept 76",
    ".word unexpected",
    ".endr",
);

global_asm!(include_str!("reset.s"), options(raw));

/// Handler of all exceptions that no check uses: the running check fails.
#[unsafe(no_mangle)]
extern "C" fn unexpected() -> ! {
    fail()
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    fail()
}
