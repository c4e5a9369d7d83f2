//! Semihosting: writes a line of text (Arm, Semihosting for AArch32 and AArch64).

use core::arch::asm;
use core::fmt;

const SYS_WRITE0: u32 = 0x04;

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
