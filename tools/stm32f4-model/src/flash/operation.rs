//! Erase and program operations of the flash: their duration, their effect on the memory, and what is left of one that was cut (RM0090 3.6).
//!
//! No manual says what a cut operation leaves. Here each bit that it was to change has changed with the probability of the time that has passed. Cells
//! that read differently each time are not modelled.

/// Start address of the flash.
pub(super) const FLASH: u32 = 0x0800_0000;
/// Duration of the program of one item, s (data sheet, table "flash memory programming", typical).
const PROGRAM_S: f64 = 16e-6;
/// Duration of the erase of a sector of 16, 64 and 128 KiB by PSIZE: by bytes, by half-words, by words, s (the same table, typical).
const ERASE_S: [[f64; 3]; 3] = [[0.4, 0.3, 0.25], [1.2, 0.7, 0.55], [2.0, 1.3, 1.0]];
/// Duration of a mass erase of 1 MiB by PSIZE, s (the same table, typical); of the 512 KiB of the F411 half of it (its data sheet).
const MASS_ERASE_S: [f64; 3] = [16.0, 11.0, 8.0];
/// Duration of a change of the option bytes, s: their sector is erased and programmed (3.7.2). No data sheet has a number; taken is the erase of a
/// sector of 16 KiB by bytes.
const OPTION_BYTES_S: f64 = 0.4;

/// Address and length in bytes of a sector, 0 to 11 (3.3, table 5); the F411 has 0 to 7 (RM0383 3.3).
pub(crate) fn sector(number: u32) -> Option<(u32, u32)> {
    const KIB: u32 = 1024;
    match number {
        0..=3 => Some((FLASH + 16 * KIB * number, 16 * KIB)),
        4 => Some((FLASH + 64 * KIB, 64 * KIB)),
        5..=11 => Some((FLASH + 128 * KIB * (number - 4), 128 * KIB)),
        _ => None,
    }
}

/// Address and length in bytes of the sector that holds an address; `None`: it is not in flash.
///
/// ```
/// assert_eq!(stm32f4_model::flash_sector_at(0x0800_5000), Some((0x0800_4000, 0x4000)));
/// assert_eq!(stm32f4_model::flash_sector_at(0x2000_0000), None);
/// ```
#[must_use]
pub fn flash_sector_at(address: u32) -> Option<(u32, u32)> {
    (0..).map_while(sector).find(|(first, bytes)| (*first..first + bytes).contains(&address))
}

/// What an operation does to the memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlashChange {
    /// Bits become 1 in so many bytes.
    Erase {
        /// Number of bytes.
        bytes: u32,
    },
    /// Bits that are 0 here become 0.
    Program {
        /// The item.
        value: u32,
        /// Its length in bytes: 1, 2 or 4.
        bytes: u32,
    },
    /// The option bytes, which are not in the flash memory: no byte of it changes.
    OptionBytes,
}

/// An operation that has ended, or was cut by a reset or by the loss of power.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlashOperation {
    /// Its first address.
    pub address: u32,
    /// What it does.
    pub change: FlashChange,
    /// The part of its time that has passed, 0 to 1; 1: it ended.
    pub done: f64,
}

impl FlashOperation {
    /// Number of bytes from [`FlashOperation::address`] on that it changes.
    #[must_use]
    pub fn bytes(&self) -> u32 {
        match self.change {
            FlashChange::Erase { bytes } | FlashChange::Program { bytes, .. } => bytes,
            FlashChange::OptionBytes => 0,
        }
    }

    /// Applies it to the bytes from [`FlashOperation::address`] on. `draw` gives random numbers from 0 to 1, for the bits that a cut operation has
    /// changed.
    ///
    /// ```
    /// use stm32f4_model::{FlashChange, FlashOperation};
    /// let mut bytes = [0xF0, 0x00];
    /// let program = FlashOperation { address: 0x0800_4000, change: FlashChange::Program { value: 0x20, bytes: 1 }, done: 1.0 };
    /// program.apply(&mut bytes, || 0.5);
    /// assert_eq!(bytes, [0x20, 0x00]); // only from 1 to 0
    /// ```
    pub fn apply(&self, bytes: &mut [u8], mut draw: impl FnMut() -> f64) {
        for (n, byte) in bytes.iter_mut().enumerate().take(self.bytes() as usize) {
            let after = match self.change {
                FlashChange::Erase { .. } => 0xFF,
                FlashChange::Program { value, .. } => *byte & value.to_le_bytes()[n],
                FlashChange::OptionBytes => *byte,
            };
            let mut changed = *byte ^ after;
            if self.done < 1.0 {
                for bit in 0..8 {
                    if draw() >= self.done {
                        changed &= !(1 << bit);
                    }
                }
            }
            *byte ^= changed;
        }
    }
}

/// An operation that runs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RunningOperation {
    pub(crate) address: u32,
    pub(crate) change: FlashChange,
    /// Time of its start and of its end, s.
    pub(crate) from: f64,
    pub(crate) until: f64,
}

impl RunningOperation {
    /// The erase of a sector from a time on. `psize`: the width of its steps by FLASH_CR.PSIZE.
    pub(crate) fn erase(number: u32, psize: u32, from: f64) -> Option<Self> {
        let (address, bytes) = sector(number)?;
        let row = match number {
            0..=3 => 0,
            4 => 1,
            _ => 2,
        };
        // Double words need an external voltage; they are as fast as words here.
        let seconds = ERASE_S[row][psize.min(2) as usize];
        Some(RunningOperation { address, change: FlashChange::Erase { bytes }, from, until: from + seconds })
    }

    /// The erase of the whole flash from a time on.
    pub(crate) fn mass_erase(flash_bytes: u32, psize: u32, from: f64) -> Self {
        let seconds = MASS_ERASE_S[psize.min(2) as usize] * f64::from(flash_bytes) / f64::from(1024 * 1024);
        RunningOperation {
            address: FLASH,
            change: FlashChange::Erase { bytes: flash_bytes },
            from,
            until: from + seconds,
        }
    }

    /// The change of the option bytes from a time on.
    pub(crate) fn option_bytes(from: f64) -> Self {
        RunningOperation { address: FLASH, change: FlashChange::OptionBytes, from, until: from + OPTION_BYTES_S }
    }

    /// The program of an item from a time on.
    pub(crate) fn program(address: u32, value: u32, bytes: u32, from: f64) -> Self {
        RunningOperation { address, change: FlashChange::Program { value, bytes }, from, until: from + PROGRAM_S }
    }

    /// The operation as it is at a time.
    pub(crate) fn at(&self, seconds: f64) -> FlashOperation {
        let done = ((seconds - self.from) / (self.until - self.from)).clamp(0.0, 1.0);
        FlashOperation { address: self.address, change: self.change, done }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A linear congruential generator (Knuth, MMIX).
    fn uniform(mut state: u64) -> impl FnMut() -> f64 {
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        }
    }

    #[test]
    fn sectors_cover_the_flash() {
        // 3.3, table 5: 4 of 16, 1 of 64, 7 of 128 KiB.
        let mut next = FLASH;
        for number in 0..12 {
            let (address, bytes) = sector(number).unwrap();
            assert_eq!(address, next);
            next += bytes;
        }
        assert_eq!((next, sector(12)), (FLASH + 0x10_0000, None));
    }

    #[test]
    fn an_erase_sets_bits_and_a_program_clears_them() {
        let mut bytes = [0x12, 0x34, 0x56, 0x78];
        let erase = RunningOperation::erase(1, 2, 0.0).unwrap();
        assert_eq!((erase.address, erase.until), (0x0800_4000, 0.25));
        erase.at(0.25).apply(&mut bytes, || 0.5);
        assert_eq!(bytes, [0xFF; 4]);
        let program = RunningOperation::program(0x0800_4000, 0xA5A5_F00F, 4, 0.0);
        program.at(1.0).apply(&mut bytes, || 0.5);
        assert_eq!(u32::from_le_bytes(bytes), 0xA5A5_F00F);
        RunningOperation::program(0x0800_4000, 0xFFFF_FF00, 4, 0.0).at(1.0).apply(&mut bytes, || 0.5);
        assert_eq!(u32::from_le_bytes(bytes), 0xA5A5_F000, "no bit becomes 1");
    }

    #[test]
    fn a_cut_changes_part_of_the_bits() {
        let cut = |done, seed| {
            let mut bytes = [0_u8; 1000];
            let erase = FlashOperation { address: FLASH, change: FlashChange::Erase { bytes: 1000 }, done };
            erase.apply(&mut bytes, uniform(seed));
            bytes
        };
        let ones = |bytes: &[u8]| bytes.iter().map(|byte| byte.count_ones()).sum::<u32>();
        assert_eq!(ones(&cut(0.0, 1)), 0);
        assert!((1800..2200).contains(&ones(&cut(0.25, 1))));
        assert!(cut(0.5, 1) == cut(0.5, 1) && cut(0.5, 1) != cut(0.5, 2));
        // What a program leaves is between the old and the new item.
        let mut bytes = [0xFF; 4];
        RunningOperation::program(FLASH, 0x0000_FFFF, 4, 0.0).at(8e-6).apply(&mut bytes, uniform(3));
        let left = u32::from_le_bytes(bytes);
        assert!(left & 0xFFFF == 0xFFFF && left != 0xFFFF_FFFF && left != 0x0000_FFFF);
    }
}
