//! Semihosting: ends the program with a status (Arm, Semihosting for AArch32 and AArch64).

use core::arch::asm;

const SYS_EXIT_EXTENDED: u32 = 0x20;
/// Exit reason of a program that ended by itself.
const APPLICATION_EXIT: u32 = 0x2_0026;

/// Ends the program with a status.
pub(crate) fn exit(status: u32) -> ! {
    let block = [APPLICATION_EXIT, status];
    loop {
        // SAFETY: the debugger, here an emulator, reads the block and does not return.
        unsafe {
            asm!("bkpt 0xAB", in("r0") SYS_EXIT_EXTENDED, in("r1") block.as_ptr());
        }
    }
}
