//! The seal of an image: by it the program in flash is proven to be the one that was built.
//!
//! `cargo xtask` writes it into the ELF file after the link, over three words that the linker leaves erased (`seal.x`):
//!
//! | address | word |
//! |---|---|
//! | 0x0800_3FF4 | [`MARK`] |
//! | 0x0800_3FF8 | the address after the last byte of the program |
//! | 0x0800_3FFC | CRC-32 (ISO-HDLC) of the bytes before this word, from the beginning of the flash, and of those from 0x0801_0000 to that address |
//!
//! Between the two lie the parameter sectors, whose records have check sums of their own. Bytes that the image does not have are erased, 0xFF.
//! CRC-32 finds each change of one, two or three bits in a program of this length, and each burst of up to 32 bits; of any other change it misses
//! one in 4 * 10^9.

use core::fmt;
use core::ops::Range;

use crc::{CRC_32_ISO_HDLC, Crc, Digest};

use crate::board::{GENERATOR_SECTOR, ROBOT_SECTOR, SECTOR_BYTES};

/// The flash that all boards have (`memory.x`).
pub const FLASH: Range<u32> = 0x0800_0000..0x0808_0000;
/// Where the program goes on, after the parameter sectors.
pub const TEXT: u32 = ROBOT_SECTOR + SECTOR_BYTES as u32;
/// Words of the seal.
pub const WORDS: usize = 3;
/// Address of its first word.
pub const SEAL: u32 = GENERATOR_SECTOR - 4 * WORDS as u32;
/// The first word of an image that was sealed.
pub const MARK: u32 = u32::from_le_bytes(*b"SEAL");
/// Address of the check sum, which does not contain itself.
const SUM: u32 = SEAL + 8;

static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// Why a program is not the one that was built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unproven {
    /// The image was not sealed: its words are as the linker leaves them.
    NotSealed,
    /// The first word of the seal was changed.
    Mark(u32),
    /// The seal names an end that no program has.
    End(u32),
    /// The program has another check sum.
    Sum {
        /// That of the flash.
        found: u32,
        /// That of the seal.
        sealed: u32,
    },
}

impl fmt::Display for Unproven {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotSealed => f.write_str(
                "the program has no check sum, and this build demands one: `cargo xtask flash` and the runner of `cargo run` write it",
            ),
            Self::Mark(found) => {
                write!(f, "the program in flash was changed: its seal begins with {found:#010x}; flash it again with `cargo xtask flash`")
            }
            Self::End(end) => {
                write!(f, "the program in flash was changed: it would end at {end:#010x}; flash it again with `cargo xtask flash`")
            }
            Self::Sum { found, sealed } => write!(
                f,
                "the program in flash was changed: check sum {found:08x}, built with {sealed:08x}; flash it again with `cargo xtask flash`; replace the \
                 board if this remains"
            ),
        }
    }
}

impl Unproven {
    /// Whether the board does not arm because of it: a program that was changed never does; one without a seal does unless the build demands one.
    #[must_use]
    pub const fn refuses(self, is_demanded: bool) -> bool {
        is_demanded || !matches!(self, Self::NotSealed)
    }
}

/// Whether these are the words of an image that nobody sealed. A single changed bit does not make them so.
#[must_use]
pub const fn is_unsealed(words: [u32; WORDS]) -> bool {
    matches!(words, [u32::MAX, u32::MAX, u32::MAX])
}

/// One pass over the program, in pieces.
#[derive(Clone)]
pub struct Check {
    end: u32,
    sealed: u32,
    at: u32,
    digest: Digest<'static, u32>,
}

impl Check {
    /// The beginning of a pass, with the words of the seal.
    ///
    /// # Errors
    /// The program was not sealed, or the seal was changed.
    pub fn begin(words: [u32; WORDS]) -> Result<Self, Unproven> {
        let [mark, end, sealed] = words;
        if is_unsealed(words) {
            return Err(Unproven::NotSealed);
        }
        if mark != MARK {
            return Err(Unproven::Mark(mark));
        }
        if end <= TEXT || end > FLASH.end {
            return Err(Unproven::End(end));
        }
        Ok(Self { end, sealed, at: FLASH.start, digest: CRC.digest() })
    }

    /// Adds the next piece, of at most `most` bytes, which `read` takes from the flash. At the end of the pass, whether the program is right.
    pub fn step<'a>(&mut self, most: u32, read: impl FnOnce(Range<u32>) -> &'a [u8]) -> Option<Result<(), Unproven>> {
        let part_end = if self.at < SUM { SUM } else { self.end };
        let piece_end = self.at.saturating_add(most).min(part_end);
        self.digest.update(read(self.at..piece_end));
        self.at = if piece_end == SUM { TEXT } else { piece_end };
        if self.at < self.end {
            return None;
        }
        let found = self.digest.clone().finalize();
        Some(if found == self.sealed { Ok(()) } else { Err(Unproven::Sum { found, sealed: self.sealed }) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A flash with a program that ends there, sealed.
    fn sealed(end: u32) -> Vec<u8> {
        let mut flash: Vec<u8> = (0..FLASH.len() as u32).map(|n| (n.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        put(&mut flash, SEAL, MARK);
        put(&mut flash, SEAL + 4, end);
        let mut sum = CRC.digest();
        sum.update(bytes(&flash, FLASH.start..SUM));
        sum.update(bytes(&flash, TEXT..end));
        put(&mut flash, SUM, sum.finalize());
        flash
    }

    fn place(address: u32) -> usize {
        (address - FLASH.start) as usize
    }

    fn put(flash: &mut [u8], address: u32, word: u32) {
        flash[place(address)..][..4].copy_from_slice(&word.to_le_bytes());
    }

    fn bytes(flash: &[u8], range: Range<u32>) -> &[u8] {
        &flash[place(range.start)..place(range.end)]
    }

    /// The result of a pass in pieces of so many bytes, and the number of pieces.
    fn pass(flash: &[u8], most: u32) -> (Result<(), Unproven>, u32) {
        let word = |n: u32| u32::from_le_bytes(bytes(flash, SEAL + 4 * n..SEAL + 4 * n + 4).try_into().expect("four"));
        let mut check = match Check::begin([word(0), word(1), word(2)]) {
            Ok(check) => check,
            Err(unproven) => return (Err(unproven), 0),
        };
        let mut pieces = 0;
        loop {
            pieces += 1;
            assert!(pieces < 1_000_000, "the pass does not end");
            if let Some(result) = check.step(most, |range| {
                assert!(range.len() <= most as usize && !range.is_empty(), "{range:x?}");
                bytes(flash, range)
            }) {
                return (result, pieces);
            }
        }
    }

    #[test]
    fn the_size_of_the_pieces_changes_nothing() {
        for end in [TEXT + 1, TEXT + 1_001, FLASH.end] {
            let flash = sealed(end);
            for most in [100, 128, 8_192, u32::MAX] {
                let (result, pieces) = pass(&flash, most);
                assert_eq!(result, Ok(()), "{end:#x} {most}");
                let parts = [SUM - FLASH.start, end - TEXT];
                assert_eq!(pieces, parts.map(|part| part.div_ceil(most)).iter().sum::<u32>());
            }
        }
    }

    /// Each bit of the vector table, the seal and the ends of the program, and many others; none of the parameter sectors.
    #[test]
    fn every_flipped_bit_is_found() {
        let end = TEXT + 4_001;
        let mut flash = sealed(end);
        let of_the_program = (FLASH.start..GENERATOR_SECTOR).chain(TEXT..end).step_by(97);
        let edges = [SEAL - 16..GENERATOR_SECTOR, TEXT..TEXT + 32, end - 32..end].into_iter().flatten();
        for address in of_the_program.chain(edges).chain(FLASH.start..FLASH.start + 64) {
            for bit in 0..8 {
                flash[place(address)] ^= 1 << bit;
                assert!(pass(&flash, u32::MAX).0.is_err(), "bit {bit} of {address:#x}");
                flash[place(address)] ^= 1 << bit;
            }
        }
        for address in [GENERATOR_SECTOR, TEXT - 1, end, FLASH.end - 1] {
            flash[place(address)] ^= 1;
            assert_eq!(pass(&flash, 4_096).0, Ok(()), "{address:#x} is none of the program");
        }
    }

    #[test]
    fn an_image_without_a_seal_and_a_wrong_end_are_named() {
        let mut flash = sealed(TEXT + 100);
        for end in [0, FLASH.start, TEXT, FLASH.end + 1, u32::MAX] {
            put(&mut flash, SEAL + 4, end);
            assert_eq!(pass(&flash, 1).0, Err(Unproven::End(end)));
        }
        // As the linker leaves it: each word erased. One that is not makes it a changed one.
        for erased in 0..WORDS as u32 {
            let mut flash = sealed(TEXT + 100);
            (0..WORDS as u32).filter(|n| *n != erased).for_each(|n| put(&mut flash, SEAL + 4 * n, u32::MAX));
            let unproven = pass(&flash, 1).0.expect_err("changed");
            assert!(unproven != Unproven::NotSealed && unproven.refuses(false), "{unproven:?}");
        }
        (0..WORDS as u32).for_each(|n| put(&mut flash, SEAL + 4 * n, u32::MAX));
        assert_eq!(pass(&flash, 1).0, Err(Unproven::NotSealed));
        for unproven in [
            Unproven::NotSealed,
            Unproven::Mark(0x1234_5678),
            Unproven::End(0x0804_0000),
            Unproven::Sum { found: 0x1234, sealed: 0xABCD_0123 },
        ] {
            // Only an image without a seal arms, and only where none is demanded.
            assert_eq!(
                [false, true].map(|is_demanded| unproven.refuses(is_demanded)),
                [unproven != Unproven::NotSealed, true]
            );
            let words = unproven.to_string();
            assert!(words.contains("cargo xtask flash"), "{words}");
            let refused = wire::Refused::new(wire::Subject::Arming, unproven);
            assert_eq!(refused.reason.as_str(), words, "it fits into the record");
        }
        let words = Unproven::Sum { found: 0x1234, sealed: 0xABCD_0123 }.to_string();
        assert!(words.contains("00001234") && words.contains("abcd0123"), "{words}");
    }

    /// The linker leaves the words of the seal at its address, and the map has the flash and the beginning of the text.
    #[test]
    fn the_linker_scripts_have_these_addresses() {
        let script = include_str!("../seal.x");
        assert!(script.contains(&format!(".seal {SEAL:#010X} : {{ LONG").replace("0X", "0x")), "{script}");
        assert_eq!(script.matches("LONG(0xFFFFFFFF)").count(), WORDS);
        let map = include_str!("../../memory.x");
        let length = format!("FLASH : ORIGIN = {:#010x}, LENGTH = {}K", FLASH.start, FLASH.len() / 1024);
        assert!(map.contains(&length) && map.contains("_stext = ORIGIN(FLASH) + 0x10000;"), "{map}");
        assert_eq!(TEXT - FLASH.start, 0x1_0000);
    }
}
