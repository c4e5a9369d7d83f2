//! Vector table, start-up code and handlers of unexpected exceptions and panics.

use core::arch::global_asm;

use crate::exit::exit;

// Vector table: one word for each exception number.
global_asm!(".section .vectors, \"a\"", ".word __stack_top", ".word reset", ".rept 14", ".word unexpected", ".endr",);

global_asm!(include_str!("reset.s"), options(raw));

/// Handler of all exceptions: none is expected, so it ends the program with status 3.
#[unsafe(no_mangle)]
extern "C" fn unexpected() -> ! {
    exit(3)
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    exit(2)
}
