//! Semihosting: writes a line of text, and ends the program with a status (Arm, Semihosting for AArch32 and AArch64).

use core::arch::asm;
use core::fmt;

const SYS_WRITE0: u32 = 0x04;
const SYS_EXIT_EXTENDED: u32 = 0x20;
/// Exit reason of a program that ended by itself.
const APPLICATION_EXIT: u32 = 0x2_0026;

/// A text of up to 159 bytes with a closing zero; a longer one is cut.
pub(crate) struct TextLine {
    bytes: [u8; 160],
    length: usize,
}

impl TextLine {
    pub(crate) const fn new() -> Self {
        Self { bytes: [0; 160], length: 0 }
    }

    /// Writes the text to the debugger.
    pub(crate) fn print(&self) {
        // SAFETY: the debugger, here an emulator, reads up to the zero; the last byte is never written.
        unsafe {
            asm!("bkpt 0xAB", inout("r0") SYS_WRITE0 => _, in("r1") self.bytes.as_ptr());
        }
    }
}

impl fmt::Write for TextLine {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for &byte in text.as_bytes() {
            if self.length + 1 >= self.bytes.len() {
                return Err(fmt::Error);
            }
            self.bytes[self.length] = byte;
            self.length += 1;
        }
        Ok(())
    }
}

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
