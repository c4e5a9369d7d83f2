//! Vector table and the way from reset to the checks.

use core::arch::global_asm;

use crate::core_registers::fail;

// A plain table of words: what the core reads, in the order in which it reads it.
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

// Enables the FPU before any compiled function can use it, then fills RAM.
global_asm!(
    ".section .text.reset, \"ax\"",
    ".global reset",
    ".type reset, %function",
    ".thumb_func",
    "reset:",
    "movw r0, #0xED88",
    "movt r0, #0xE000",
    "ldr r1, [r0]",
    "orr r1, r1, #0xF00000",
    "str r1, [r0]",
    "dsb",
    "isb",
    "ldr r0, =__bss_start",
    "ldr r1, =__bss_end",
    "movs r2, #0",
    "1:",
    "cmp r0, r1",
    "beq 2f",
    "stmia r0!, {{r2}}",
    "b 1b",
    "2:",
    "ldr r0, =__data_start",
    "ldr r1, =__data_end",
    "ldr r2, =__data_load",
    "3:",
    "cmp r0, r1",
    "beq 4f",
    "ldmia r2!, {{r3}}",
    "stmia r0!, {{r3}}",
    "b 3b",
    "4:",
    "bl run_checks",
    "b .",
    ".pool",
);

/// Any exception that no check asks for.
#[unsafe(no_mangle)]
extern "C" fn unexpected() -> ! {
    fail()
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    fail()
}
