//! Vector table and the way from reset to the counting.

use core::arch::global_asm;

use crate::semihosting::exit;

// A plain table of words: what the core reads, in the order in which it reads it.
global_asm!(".section .vectors, \"a\"", ".word __stack_top", ".word reset", ".rept 14", ".word unexpected", ".endr",);

global_asm!(include_str!("../../../tools/virtual-board/selftest/src/reset.s"), options(raw));

/// Any exception: nothing here asks for one.
#[unsafe(no_mangle)]
extern "C" fn unexpected() -> ! {
    exit(3)
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    exit(2)
}
