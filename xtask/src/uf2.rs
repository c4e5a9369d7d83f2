//! Writes UF2, the file format of boot loaders that show a chip's flash as a USB drive (<https://github.com/microsoft/uf2>): blocks of 512 bytes,
//! each with 256 bytes for one page of flash.
//!
//! The RP2040's boot ROM erases by the *numbers* of the blocks (erratum RP2040-E14; `bootrom/virtual_disk.c`, `_write_uf2_page`): when it first sees a
//! number of a group of 16, it erases the flash sector of that block's *address*. Where a group has pages of two sectors, the second sector is not
//! erased before its pages are written, and is erased after it by the next group. So a file of this module has every sector that it touches as a
//! whole: each group of 16 numbers is one sector.

use std::collections::{BTreeMap, BTreeSet};

use crate::image::Part;

/// Bytes of a page, which a block carries.
const PAGE: usize = 256;
/// Bytes of a sector, which the boot ROM erases at a time.
const SECTOR: u32 = 4096;
/// Bytes of a block.
pub(crate) const BLOCK: usize = 512;

const FIRST_MAGIC: u32 = 0x0A32_4655;
const SECOND_MAGIC: u32 = 0x9E5D_5157;
const LAST_MAGIC: u32 = 0x0AB1_6F30;
/// The last word of the header names the family of chips.
const FAMILY_PRESENT: u32 = 0x2000;
/// The family of the RP2040 (`utils/uf2families.json` of the format's repository).
const RP2040: u32 = 0xE48B_FF56;

/// The blocks of these parts, with the whole of every sector that they touch: bytes that are in no part are 0xFF. Where parts overlap, the later one
/// counts.
pub(crate) fn blocks(parts: &[Part]) -> Vec<u8> {
    let mut pages: BTreeMap<u32, [u8; PAGE]> = BTreeMap::new();
    for part in parts {
        let mut left = (part.address, &part.bytes[..]);
        while let (address, [_, ..]) = left {
            let offset = address as usize % PAGE;
            let (now, later) = left.1.split_at(left.1.len().min(PAGE - offset));
            let page = pages.entry(address - offset as u32).or_insert([0xFF; PAGE]);
            page[offset..offset + now.len()].copy_from_slice(now);
            left = (address + now.len() as u32, later);
        }
    }
    let sectors: BTreeSet<u32> = pages.keys().map(|page| page - page % SECTOR).collect();
    for page in sectors.iter().flat_map(|sector| (*sector..sector + SECTOR).step_by(PAGE)) {
        pages.entry(page).or_insert([0xFF; PAGE]);
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
    use std::collections::HashMap;

    /// Little-endian word of a block.
    fn word(block: &[u8], at: usize) -> u32 {
        u32::from_le_bytes(block[at..at + 4].try_into().unwrap())
    }

    /// Fields at their places in the format's specification. The test program `pico` reads whole files with a decoder by others.
    #[test]
    fn a_block_has_its_page_number_and_family() {
        let file = blocks(&[
            Part { address: 0x1000_01FE, bytes: vec![1, 2, 3, 4] },
            Part { address: 0x1010_0000, bytes: vec![5; PAGE] },
        ]);
        assert_eq!(file.len(), 32 * BLOCK);
        for (number, block) in file.chunks(BLOCK).enumerate() {
            assert_eq!([word(block, 0), word(block, 4), word(block, 508)], [0x0A32_4655, 0x9E5D_5157, 0x0AB1_6F30]);
            let address = if number < 16 { 0x1000_0000 } else { 0x1010_0000 } + number as u32 % 16 * 256;
            assert_eq!([12, 16, 20, 24].map(|at| word(block, at)), [address, 256, number as u32, 32]);
            assert_eq!((word(block, 8), word(block, 28)), (0x2000, 0xE48B_FF56));
        }
        // The two bytes on each side of the border of two pages, and 0xFF around them.
        assert_eq!(file[BLOCK + 32 + 253..BLOCK + 32 + 256], [0xFF, 1, 2]);
        assert_eq!(file[2 * BLOCK + 32..2 * BLOCK + 35], [3, 4, 0xFF]);
        // The rest of the sectors.
        let page = |number: usize| &file[number * BLOCK + 32..][..PAGE];
        assert_eq!((page(16), page(17), page(31)), (&[5; PAGE][..], &[0xFF; PAGE][..], &[0xFF; PAGE][..]));
    }

    /// A page of flash, which had something in it before.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    enum Page {
        Erased,
        /// Number of the block that was written to it.
        Written(u32),
        /// Written without an erasure before: old and new bits together.
        Damaged,
    }

    /// The flash after the boot ROM has taken these blocks: what `_write_uf2_page` and its task do (pico-bootrom-rp2040, versions B0 to B2).
    fn taken<'a>(blocks: impl Iterator<Item = &'a [u8]>) -> HashMap<u32, Page> {
        let mut flash = HashMap::new();
        let mut cleared = BTreeSet::new();
        for block in blocks {
            let (address, number) = (word(block, 12), word(block, 20));
            if cleared.insert(number * 256 / 4096) {
                let sector = address & !(4096 - 1);
                flash.extend((sector..sector + 4096).step_by(256).map(|page| (page, Page::Erased)));
            }
            let page = flash.entry(address).or_insert(Page::Damaged);
            *page = if *page == Page::Erased { Page::Written(number) } else { Page::Damaged };
        }
        flash
    }

    /// A program of each size up to 250 KiB, with the sectors of the records behind it. An operating system may write the blocks in another order.
    #[test]
    fn the_boot_rom_leaves_every_page_as_it_is_in_the_file() {
        let records = [0x1010_0000, 0x1010_4000, 0x1010_8000].map(|address| (address, vec![0x52; 16 * 1024]));
        for pages in 1..=1_000 {
            let mut parts = vec![Part { address: 0x1000_0000, bytes: vec![0x11; pages * PAGE] }];
            parts.extend(records.iter().map(|(address, bytes)| Part { address: *address, bytes: bytes.clone() }));
            let file = blocks(&parts);
            let in_order = taken(file.chunks(BLOCK));
            let numbers = file.chunks(BLOCK).map(|block| (word(block, 12), Page::Written(word(block, 20))));
            assert_eq!(in_order, numbers.collect(), "{pages} pages");
            assert_eq!(in_order, taken(file.chunks(BLOCK).rev()), "{pages} pages, from the last block on");
            let is_there = |address| in_order.contains_key(&address);
            assert!(
                parts
                    .iter()
                    .all(|part| is_there(part.address) && is_there(part.address + part.bytes.len() as u32 - 256))
            );
        }
    }
}
