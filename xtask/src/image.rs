//! What an image's ELF file says: its size in flash and RAM, its bytes in flash, its compiler, and whether it computes in
//! double precision.

use std::fmt;
use std::ops::Range;

use anyhow::{Context, Result, ensure};
use object::elf::{PT_LOAD, SHF_ALLOC, SHT_NOBITS};
use object::read::elf::{ElfFile32, ProgramHeader as _, SectionHeader as _};
use object::{LittleEndian, Object as _, ObjectSymbol as _, ObjectSymbolTable as _};

use crate::probe::{SECTOR_BYTES, Sector};

/// Bytes in flash and in RAM.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Footprint {
    /// Code, constants, vector table and the first values of variables.
    pub(crate) flash: u32,
    /// Variables and buffers, without the stack.
    pub(crate) ram: u32,
}

impl fmt::Display for Footprint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kibi = |bytes: u32| f64::from(bytes) / 1024.0;
        write!(f, "flash {:.1} KiB, static RAM {:.1} KiB", kibi(self.flash), kibi(self.ram))
    }
}

/// Where an STM32's RAM starts; flash lies below (RM0090, memory map).
const RAM_START: u32 = 0x2000_0000;

fn parse(elf: &[u8]) -> Result<ElfFile32<'_, LittleEndian>> {
    ElfFile32::parse(elf).context("not a 32 bit little-endian ELF file, or one that is cut short")
}

/// The compiler, as it writes itself into the section `.comment`: lines that end with a zero byte, after one of another section.
pub(crate) fn compiler(elf: &[u8]) -> Option<&str> {
    const BEGIN: &[u8] = b"\0rustc version ";
    let at = elf.windows(BEGIN.len()).position(|bytes| bytes == BEGIN)? + 1;
    let line = elf[at..].split(|byte| *byte == 0).next()?;
    std::str::from_utf8(line).ok()
}

/// Adds the loaded sections up.
///
/// # Errors
/// What is wrong with the file.
pub(crate) fn footprint(elf: &[u8]) -> Result<Footprint> {
    let mut footprint = Footprint { flash: 0, ram: 0 };
    for section in parse(elf)?.elf_section_table().iter() {
        let [flags, address, size] =
            [section.sh_flags(LittleEndian), section.sh_addr(LittleEndian), section.sh_size(LittleEndian)];
        if flags & SHF_ALLOC == 0 {
            continue;
        }
        if address >= RAM_START {
            footprint.ram = footprint.ram.saturating_add(size);
        }
        // A variable with a first value is in both: the first value is stored in flash.
        if section.sh_type(LittleEndian) != SHT_NOBITS {
            footprint.flash = footprint.flash.saturating_add(size);
        }
    }
    // What a build leaves when the linker script was not applied: it links, and is empty.
    ensure!(footprint.flash > 0, "the image is empty: no section is loaded");
    Ok(footprint)
}

/// Bytes of an image that lie together in flash.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Part {
    /// Address of the first.
    pub(crate) address: u32,
    pub(crate) bytes: Vec<u8>,
}

/// What an image has in flash: the part before the parameter sectors and the part after them, gaps filled with 0xFF.
///
/// No part touches a parameter sector, and the two have no sector in common: writing a part erases its sectors.
pub(crate) fn flash_parts(elf: &[u8]) -> Result<Vec<Part>> {
    let sectors = Sector::ALL.map(Sector::address);
    let parameters = sectors[0]..sectors[2] + SECTOR_BYTES as u32;
    let mut loaded = loaded(elf)?;
    loaded.sort_by_key(|part| part.address);
    let mut parts: Vec<Part> = Vec::new();
    for part in loaded {
        let end = part.address.checked_add(part.bytes.len() as u32);
        let end = end.context("a segment ends beyond the address space")?;
        ensure!(part.address >= parameters.end || end <= parameters.start, "a segment lies in a parameter sector");
        match parts.last_mut() {
            // Both before the parameter sectors, or both after them.
            Some(last) if (last.address < parameters.start) == (part.address < parameters.start) => {
                let offset = (part.address - last.address) as usize;
                ensure!(offset >= last.bytes.len(), "two segments overlap");
                last.bytes.resize(offset, 0xFF);
                last.bytes.extend(part.bytes);
            }
            _ => parts.push(part),
        }
    }
    ensure!(!parts.is_empty(), "the image is empty: no segment is loaded");
    Ok(parts)
}

/// The segments with content, at the addresses where they are stored (`p_paddr`).
pub(crate) fn loaded(elf: &[u8]) -> Result<Vec<Part>> {
    let part = |(address, file): (u32, Range<usize>)| Part { address, bytes: elf[file].to_vec() };
    Ok(segments(elf)?.into_iter().map(part).collect())
}

/// Where in the file so many bytes are that are stored at this address; `None` if no segment has them all.
pub(crate) fn place(elf: &[u8], address: u32, bytes: usize) -> Result<Option<Range<usize>>> {
    let in_segment = |(start, file): (u32, Range<usize>)| {
        let start = file.start.checked_add(address.checked_sub(start)? as usize)?;
        let end = start.checked_add(bytes)?;
        (end <= file.end).then_some(start..end)
    };
    Ok(segments(elf)?.into_iter().find_map(in_segment))
}

/// The segments with content: where each is stored on the chip, and where it is in the file.
fn segments(elf: &[u8]) -> Result<Vec<(u32, Range<usize>)>> {
    let mut segments = Vec::new();
    for header in parse(elf)?.elf_program_headers() {
        let (start, size) = header.file_range(LittleEndian);
        if header.p_type(LittleEndian) == PT_LOAD && size > 0 {
            let (start, end) = (start as usize, (start + size) as usize);
            ensure!(end <= elf.len(), "the ELF file is cut short");
            segments.push((header.p_paddr(LittleEndian), start..end));
        }
    }
    Ok(segments)
}

/// Names and addresses of the symbols that `wanted` takes.
fn symbols(elf: &[u8], wanted: fn(&str) -> bool) -> Result<Vec<(String, u32)>> {
    let file = parse(elf)?;
    let table = file.symbol_table().context("the ELF file has no symbol table")?;
    let mut found = Vec::new();
    for symbol in table.symbols() {
        let name = symbol.name().context("a symbol has no name in the ELF file")?;
        if wanted(name) {
            found.push((name.to_owned(), symbol.address() as u32));
        }
    }
    Ok(found)
}

/// The boards that the image is for, by the symbols that `firmware/build.rs` makes: names of Cargo's features with `_` in place of `-`.
pub(crate) fn board_symbols(elf: &[u8]) -> Result<Vec<String>> {
    let found = symbols(elf, |name| name.starts_with(BOARD_SYMBOL))?;
    Ok(found.into_iter().filter_map(|(name, _)| name.strip_prefix(BOARD_SYMBOL).map(str::to_owned)).collect())
}

/// How such a symbol begins.
const BOARD_SYMBOL: &str = "__board_";

/// Routines that compute in double precision: the Cortex-M4F does that in software, fifty times slower than in single precision.
pub(crate) fn double_precision(elf: &[u8]) -> Result<Vec<String>> {
    let found = symbols(elf, is_double_precision)?;
    let mut names: Vec<String> = found.into_iter().map(|(name, _)| name).collect();
    names.sort();
    names.dedup();
    Ok(names)
}

/// By the names of the run-time ABI for the Arm architecture (`__aeabi_dmul`) and of the compiler's library (`__muldf3`).
fn is_double_precision(symbol: &str) -> bool {
    let arm = [
        "dadd", "dsub", "drsub", "dmul", "ddiv", "f2d", "d2f", "i2d", "ui2d", "l2d", "ul2d", "d2iz", "d2uiz", "d2lz",
        "d2ulz",
    ];
    let compiler =
        ["adddf3", "subdf3", "muldf3", "divdf3", "extendsfdf2", "truncdfsf2", "floatsidf", "floatunsidf", "powidf2"];
    let within = |prefix: &str, names: &[&str]| symbol.strip_prefix(prefix).is_some_and(|rest| names.contains(&rest));
    symbol.starts_with("__aeabi_dcmp") || within("__aeabi_", &arm) || within("__", &compiler)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Bytes of a header, of a section header, of a segment's, and of a symbol.
    const HEADER: usize = 52;
    const SECTION: usize = 40;
    const SEGMENT: usize = 32;
    const SYMBOL: usize = 16;

    /// An ELF file of only a header.
    fn header() -> Vec<u8> {
        let mut file = b"\x7fELF\x01\x01\x01".to_vec();
        file.resize(HEADER, 0);
        file
    }

    /// An ELF file of only a header and section headers: (type, flags, address, size) each. The last section has the names of the others.
    fn elf(sections: &[(u32, u32, u32, u32)]) -> Vec<u8> {
        let mut file = header();
        file[0x20..0x24].copy_from_slice(&52_u32.to_le_bytes());
        file[0x2e..0x30].copy_from_slice(&(SECTION as u16).to_le_bytes());
        file[0x30..0x32].copy_from_slice(&(sections.len() as u16).to_le_bytes());
        file[0x32..0x34].copy_from_slice(&(sections.len() as u16 - 1).to_le_bytes());
        for &(kind, flags, address, size) in sections {
            for field in [0, kind, flags, address, 0, size, 0, 0, 0, 0] {
                file.extend_from_slice(&u32::to_le_bytes(field));
            }
        }
        file
    }

    #[test]
    fn sections_count_where_they_are_stored() {
        let file = elf(&[
            (0, 0, 0, 0),
            (1, 2, 0x0800_0000, 0x188),  // vector table
            (1, 6, 0x0801_0000, 10_000), // .text
            (1, 3, 0x2000_0000, 64),     // .data: flash and RAM
            (8, 3, 0x2000_0040, 2_000),  // .bss
            (1, 0, 0, 500_000),          // debug information: neither
        ]);
        assert_eq!(footprint(&file).unwrap(), Footprint { flash: 0x188 + 10_000 + 64, ram: 2_064 });
    }

    #[test]
    fn an_image_without_content_is_an_error() {
        assert!(footprint(&elf(&[(0, 0, 0, 0), (1, 0, 0, 500)])).unwrap_err().to_string().contains("empty"));
    }

    #[test]
    fn every_cut_of_a_file_is_handled_without_a_panic() {
        let file = elf(&[(0, 0, 0, 0), (1, 6, 0x0801_0000, 10_000)]);
        for length in 0..file.len() {
            assert!(footprint(&file[..length]).is_err(), "{length}");
        }
        assert!(footprint(b"#!/bin/sh\n").unwrap_err().to_string().contains("ELF"));
    }

    /// A file with a symbol table of functions, at the end: (name, value) each.
    pub(crate) fn with_symbols(symbols: &[(&str, u32)]) -> Vec<u8> {
        // The first symbol has no name and no value.
        let size = (symbols.len() + 1) * SYMBOL;
        let mut file = elf(&[(0, 0, 0, 0), (2, 0, 0, size as u32), (3, 0, 0, 0)]);
        let table = file.len();
        let mut strings = vec![0_u8];
        file.resize(table + SYMBOL, 0);
        for (name, value) in symbols {
            for field in [strings.len() as u32, *value, 0, FUNCTION] {
                file.extend_from_slice(&field.to_le_bytes());
            }
            strings.extend_from_slice(name.as_bytes());
            strings.push(0);
        }
        file.extend_from_slice(&strings);
        for (section, field, value) in [(1, 4, table), (1, 6, 2), (2, 4, table + size), (2, 5, strings.len())] {
            let at = HEADER + SECTION * section + 4 * field;
            file[at..at + 4].copy_from_slice(&(value as u32).to_le_bytes());
        }
        file
    }

    /// The last word of a symbol that is a function.
    const FUNCTION: u32 = 2;

    /// An ELF file of only a header and loaded segments: (address, bytes) each.
    pub(crate) fn with_segments(segments: &[(u32, &[u8])]) -> Vec<u8> {
        let mut file = header();
        file[0x1c..0x20].copy_from_slice(&52_u32.to_le_bytes());
        file[0x2a..0x2c].copy_from_slice(&(SEGMENT as u16).to_le_bytes());
        file[0x2c..0x2e].copy_from_slice(&(segments.len() as u16).to_le_bytes());
        let mut offset = HEADER + SEGMENT * segments.len();
        for (address, bytes) in segments {
            // Variables with first values run in RAM and are stored in flash.
            for field in [1, offset as u32, 0x2000_0000, *address, bytes.len() as u32, bytes.len() as u32, 6, 4] {
                file.extend_from_slice(&field.to_le_bytes());
            }
            offset += bytes.len();
        }
        file.extend(segments.iter().flat_map(|(_, bytes)| bytes.iter()));
        file
    }

    #[test]
    fn an_image_has_a_part_on_each_side_of_the_parameters() {
        let vectors = (0x0800_0000, &b"vectors"[..]);
        let file = with_segments(&[(0x0801_0008, b"data"), vectors, (0x0801_0000, b"text"), (0x0801_0010, b"")]);
        let parts = flash_parts(&file).unwrap();
        assert_eq!(parts[0], Part { address: 0x0800_0000, bytes: b"vectors".to_vec() });
        assert_eq!(parts[1], Part { address: 0x0801_0000, bytes: b"text\xFF\xFF\xFF\xFFdata".to_vec() });
        assert_eq!(parts.len(), 2);
        for (segment, words) in [
            ((0x0800_3FFF, &b"ab"[..]), "parameter sector"),
            ((0x0800_4000, b"a"), "parameter sector"),
            ((0x0800_FFFF, b"a"), "parameter sector"),
            ((0x0800_0006, b"a"), "overlap"),
            ((0xFFFF_FFFF, b"ab"), "address space"),
        ] {
            let wrong = flash_parts(&with_segments(&[vectors, segment])).unwrap_err().to_string();
            assert!(wrong.contains(words), "{segment:x?}: {wrong}");
        }
        assert!(flash_parts(&with_segments(&[])).unwrap_err().to_string().contains("empty"));
        for length in 0..file.len() {
            assert!(flash_parts(&file[..length]).is_err(), "{length}");
        }
    }

    #[test]
    fn double_precision_is_found_by_its_routines() {
        let of = |names: &[&str]| with_symbols(&names.iter().map(|name| (*name, 0)).collect::<Vec<_>>());
        let file = of(&["main", "__aeabi_dmul", "__muldf3", "__aeabi_dcmpgt", "__aeabi_fcmpgt", "__aeabi_uldivmod"]);
        assert_eq!(double_precision(&file).unwrap(), ["__aeabi_dcmpgt", "__aeabi_dmul", "__muldf3"]);
        assert_eq!(double_precision(&of(&["step", "__divsf3"])).unwrap(), Vec::<String>::new());
        assert!(
            double_precision(&elf(&[(0, 0, 0, 0), (3, 0, 0, 0)])).unwrap_err().to_string().contains("no symbol table")
        );
    }

    #[test]
    fn a_cut_symbol_table_is_refused() {
        let file = with_symbols(&[("__aeabi_dmul", 0)]);
        for length in 0..file.len() {
            assert!(double_precision(&file[..length]).is_err(), "{length}");
        }
    }

    #[test]
    fn sizes_are_shown_in_kibibytes() {
        assert_eq!(Footprint { flash: 20_480, ram: 1_536 }.to_string(), "flash 20.0 KiB, static RAM 1.5 KiB");
    }
}
