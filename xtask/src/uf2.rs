//! Writes UF2, the file format of boot loaders that show a chip's flash as a USB drive (<https://github.com/microsoft/uf2>): blocks of 512 bytes,
//! each with 256 bytes for one page of flash.

use std::collections::BTreeMap;

use crate::image::Part;

/// Bytes of a page, which a block carries.
const PAGE: usize = 256;
/// Bytes of a block.
pub(crate) const BLOCK: usize = 512;

const FIRST_MAGIC: u32 = 0x0A32_4655;
const SECOND_MAGIC: u32 = 0x9E5D_5157;
const LAST_MAGIC: u32 = 0x0AB1_6F30;
/// The last word of the header names the family of chips.
const FAMILY_PRESENT: u32 = 0x2000;
/// The family of the RP2040 (`utils/uf2families.json` of the format's repository).
const RP2040: u32 = 0xE48B_FF56;

/// The blocks of these parts; bytes of a page that are in no part are 0xFF. Where parts overlap, the later one counts.
pub(crate) fn blocks(parts: &[Part]) -> Vec<u8> {
    let mut pages: BTreeMap<u32, [u8; PAGE]> = BTreeMap::new();
    for part in parts {
        for (address, byte) in (part.address..).zip(&part.bytes) {
            let first = address - address % PAGE as u32;
            pages.entry(first).or_insert([0xFF; PAGE])[(address - first) as usize] = *byte;
        }
    }
    let count = pages.len() as u32;
    let mut file = Vec::with_capacity(pages.len() * BLOCK);
    for (number, (address, page)) in (0..).zip(&pages) {
        let header = [FIRST_MAGIC, SECOND_MAGIC, FAMILY_PRESENT, *address, PAGE as u32, number, count, RP2040];
        let start = file.len();
        file.extend(header.iter().flat_map(|word| word.to_le_bytes()));
        file.extend_from_slice(page);
        file.resize(start + BLOCK - 4, 0);
        file.extend_from_slice(&LAST_MAGIC.to_le_bytes());
    }
    file
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fields at their places in the format's specification. The test program `pico` reads whole files with a decoder by others.
    #[test]
    fn a_block_has_its_page_number_and_family() {
        let file = blocks(&[
            Part { address: 0x1000_01FE, bytes: vec![1, 2, 3, 4] },
            Part { address: 0x1010_0000, bytes: vec![5; PAGE] },
        ]);
        let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap());
        assert_eq!(file.len(), 3 * BLOCK);
        for (number, address) in [0x1000_0100, 0x1000_0200, 0x1010_0000].into_iter().enumerate() {
            let at = number * BLOCK;
            assert_eq!([word(at), word(at + 4), word(at + 508)], [0x0A32_4655, 0x9E5D_5157, 0x0AB1_6F30]);
            assert_eq!([word(at + 12), word(at + 16), word(at + 20), word(at + 24)], [address, 256, number as u32, 3]);
            assert_eq!((word(at + 8), word(at + 28)), (0x2000, 0xE48B_FF56));
        }
        // The two bytes on each side of the border of two pages, and 0xFF around them.
        assert_eq!(file[32 + 253..32 + 256], [0xFF, 1, 2]);
        assert_eq!(file[BLOCK + 32..BLOCK + 35], [3, 4, 0xFF]);
    }
}
