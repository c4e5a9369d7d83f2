//! Trace of what the core executes, for a program that counts cycles: `tools/board-cost` reads it.
//!
//! A sequence of 32-bit little-endian words. Bits 31 to 29 are the kind, the others what stands in the table; an address in flash is that of a
//! half-word, counted from the start of flash.
//!
//! | kind | event | bits 28 to 19 | bits 18 to 0 |
//! |---|---|---|---|
//! | 0 | a block of instructions begins | its length in half-words | its address |
//! | 1 | an exception is taken | 1: with a floating-point frame, 2: without stacking, after another handler | its number |
//! | 2 | a handler returned to what it interrupted | | |
//! | 3 | a division, in the block that began last | bits of the dividend's magnitude | bits of the divisor's magnitude |
//! | 4 | the control register of the flash interface, FLASH_ACR, has this value | | its value |
//! | 5 | a virtual millisecond has passed | | |
//! | 6 | the core starts after a reset | | |
//!
//! An instruction whose condition does not hold is in its block all the same.

use std::cell::RefCell;
use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::Path;

use anyhow::{Context as _, Result};

use crate::addresses::{FLASH, FLASH_SIZE};

/// Bytes that are written to the file at a time.
const BUFFER: usize = 1 << 20;
const LENGTH_SHIFT: u32 = 19;

/// An event of the core.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Event {
    /// A block of this many bytes begins at this address.
    Block(u32, u32),
    /// Exception number; whether the frame has floating-point registers; whether it follows another handler without stacking.
    Exception { number: u8, floating: bool, chained: bool },
    /// A handler returned to what it interrupted.
    Return,
    /// Bits of the magnitudes of dividend and divisor.
    Division(u32, u32),
    /// FLASH_ACR has this value.
    FlashControl(u32),
    /// A virtual millisecond has passed.
    Millisecond,
    /// The core starts.
    Boot,
}

impl Event {
    /// The word of the file.
    fn word(self) -> u32 {
        let half = |addr: u32| (addr & (FLASH_SIZE - 1)) / 2;
        let word = |kind: u32, upper: u32, lower: u32| kind << 29 | upper << LENGTH_SHIFT | lower;
        match self {
            Event::Block(addr, size) => word(0, size / 2, half(addr)),
            Event::Exception { number, floating, chained } => {
                word(1, u32::from(floating) | u32::from(chained) << 1, number.into())
            }
            Event::Return => word(2, 0, 0),
            Event::Division(dividend, divisor) => word(3, dividend, divisor),
            Event::FlashControl(value) => word(4, 0, value),
            Event::Millisecond => word(5, 0, 0),
            Event::Boot => word(6, 0, 0),
        }
    }
}

/// The file that the events go to.
pub(crate) struct ExecutionTrace {
    file: BufWriter<File>,
    flash_control: Option<u32>,
    /// The first error of a write, for the end of the run: a hook cannot report it.
    failed: Option<std::io::Error>,
}

impl ExecutionTrace {
    /// Creates the file.
    ///
    /// # Errors
    /// It cannot be written.
    pub(crate) fn create(path: &Path) -> Result<RefCell<Self>> {
        let file = File::create(path).with_context(|| format!("cannot write {}", path.display()))?;
        Ok(RefCell::new(Self { file: BufWriter::with_capacity(BUFFER, file), flash_control: None, failed: None }))
    }

    /// Writes an event.
    pub(crate) fn note(&mut self, event: Event) {
        if self.failed.is_none() {
            self.failed = self.file.write_all(&event.word().to_le_bytes()).err();
        }
    }

    /// Writes the value of FLASH_ACR if it is another one than before.
    pub(crate) fn note_flash_control(&mut self, value: u32) {
        if self.flash_control.replace(value) != Some(value) {
            self.note(Event::FlashControl(value));
        }
    }

    /// Writes what is left.
    ///
    /// # Errors
    /// A write failed, this one or an earlier one.
    pub(crate) fn finish(&mut self) -> Result<()> {
        let result = self.failed.take().map_or_else(|| self.file.flush(), Err);
        result.context("cannot write the execution trace")
    }
}

/// Addresses of SDIV and UDIV in the image with the numbers of their registers, dividend and divisor, and whether they are signed (ARMv7-M
/// ARM, A7.7.127 and A7.7.195). Data may look like one: the core never executes them.
pub(crate) fn divisions(image: &[u8]) -> impl Iterator<Item = (u32, [u8; 2], bool)> + '_ {
    let halves = image.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]]));
    let seconds = halves.clone().skip(1);
    halves.zip(seconds).enumerate().filter_map(|(n, (first, second))| {
        let is_division = matches!(first & 0xFFF0, 0xFB90 | 0xFBB0) && second & 0xF0F0 == 0xF0F0;
        let registers = [first & 0xF, second & 0xF].map(|number| number as u8);
        is_division.then_some((FLASH + 2 * n as u32, registers, first & 0xFFF0 == 0xFB90))
    })
}

/// Bits of the magnitude of a number.
pub(crate) fn magnitude_bits(value: u32, signed: bool) -> u32 {
    let magnitude = if signed { (value as i32).unsigned_abs() } else { value };
    32 - magnitude.leading_zeros()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_is_one_word() {
        assert_eq!(Event::Block(FLASH + 0x20, 6).word(), 3 << 19 | 0x10);
        assert_eq!(Event::Block(0x20, 6).word(), 3 << 19 | 0x10);
        assert_eq!(Event::Exception { number: 72, floating: true, chained: false }.word(), 1 << 29 | 1 << 19 | 72);
        assert_eq!(Event::Exception { number: 35, floating: false, chained: true }.word(), 1 << 29 | 2 << 19 | 35);
        assert_eq!(Event::Division(32, 5).word(), 3 << 29 | 32 << 19 | 5);
        assert_eq!(Event::FlashControl(0x705).word(), 4 << 29 | 0x705);
        assert_eq!([Event::Return, Event::Millisecond, Event::Boot].map(Event::word), [2 << 29, 5 << 29, 6 << 29]);
    }

    #[test]
    fn divisions_are_found_with_their_registers() {
        // nop; udiv r0, r1, r2; sdiv r3, r4, r5; smull r0, r1, r2, r3
        let code: [u16; 7] = [0xBF00, 0xFBB1, 0xF0F2, 0xFB94, 0xF3F5, 0xFB82, 0x0103];
        let bytes: Vec<u8> = code.iter().flat_map(|half| half.to_le_bytes()).collect();
        let found: Vec<_> = divisions(&bytes).collect();
        assert_eq!(found, [(FLASH + 2, [1, 2], false), (FLASH + 6, [4, 5], true)]);
    }

    #[test]
    fn the_magnitude_of_a_signed_number_has_no_sign() {
        assert_eq!([magnitude_bits(0, false), magnitude_bits(1, true), magnitude_bits(255, false)], [0, 1, 8]);
        assert_eq!([magnitude_bits(u32::MAX, true), magnitude_bits(u32::MAX, false)], [1, 32]);
        assert_eq!(magnitude_bits(0x8000_0000, true), 32);
    }
}
