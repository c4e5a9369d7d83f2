//! Reads an image's ELF file (32 bit, little-endian): its size in flash and RAM, its bytes in flash, and whether it computes in double
//! precision.

use std::fmt;
use std::ops::Range;

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

// Of the ELF specification.
const PT_LOAD: u32 = 1;
const SHT_SYMTAB: u32 = 2;
const SHT_NOBITS: u32 = 8;
const SHF_ALLOC: u32 = 2;
const SYMBOL_SIZE: usize = 16;
/// Place of the type in a symbol.
const SYMBOL_INFO: usize = 12;
const STT_FUNC: u8 = 2;
/// Where an STM32's RAM starts; flash lies below (RM0090, memory map).
const RAM_START: u32 = 0x2000_0000;

const CUT: &str = "the ELF file is cut short";
const NOT_ELF: &str = "not a 32 bit little-endian ELF file";

fn half(elf: &[u8], at: usize) -> Result<u16, &'static str> {
    let bytes = at.checked_add(2).and_then(|end| elf.get(at..end)).ok_or(CUT)?;
    bytes.try_into().map(u16::from_le_bytes).map_err(|_| CUT)
}

fn word(elf: &[u8], at: usize) -> Result<u32, &'static str> {
    let bytes = at.checked_add(4).and_then(|end| elf.get(at..end)).ok_or(CUT)?;
    bytes.try_into().map(u32::from_le_bytes).map_err(|_| CUT)
}

/// A section header, as far as it is needed.
struct Section {
    kind: u32,
    flags: u32,
    address: u32,
    offset: u32,
    size: u32,
    link: u32,
}

fn sections(elf: &[u8]) -> Result<Vec<Section>, &'static str> {
    if elf.get(..6) != Some(b"\x7fELF\x01\x01") {
        return Err(NOT_ELF);
    }
    let table = word(elf, 0x20)? as usize;
    let entry = usize::from(half(elf, 0x2e)?);
    let count = usize::from(half(elf, 0x30)?);
    let section = |index: usize| {
        let field = |number: usize| word(elf, table.saturating_add(index * entry + 4 * number));
        Ok(Section {
            kind: field(1)?,
            flags: field(2)?,
            address: field(3)?,
            offset: field(4)?,
            size: field(5)?,
            link: field(6)?,
        })
    };
    (0..count).map(section).collect()
}

/// The compiler, as it writes itself into the section `.comment`: lines that end with a zero byte, after one of another section.
pub(crate) fn compiler(elf: &[u8]) -> Option<&str> {
    const BEGIN: &[u8] = b"\0rustc version ";
    let at = elf.windows(BEGIN.len()).position(|bytes| bytes == BEGIN)? + 1;
    let line = elf[at..].split(|byte| *byte == 0).next()?;
    std::str::from_utf8(line).ok()
}

/// Adds the loaded sections up; the error says what is wrong with the file.
pub(crate) fn footprint(elf: &[u8]) -> Result<Footprint, &'static str> {
    let mut footprint = Footprint { flash: 0, ram: 0 };
    for section in sections(elf)?.iter().filter(|section| section.flags & SHF_ALLOC != 0) {
        if section.address >= RAM_START {
            footprint.ram = footprint.ram.saturating_add(section.size);
        }
        // A variable with a first value is in both: the first value is stored in flash.
        if section.kind != SHT_NOBITS {
            footprint.flash = footprint.flash.saturating_add(section.size);
        }
    }
    if footprint.flash == 0 {
        // What a build leaves when the linker script was not applied: it links, and is empty.
        return Err("the image is empty: no section is loaded");
    }
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
pub(crate) fn flash_parts(elf: &[u8]) -> Result<Vec<Part>, &'static str> {
    let sectors = Sector::ALL.map(Sector::address);
    let parameters = sectors[0]..sectors[2] + SECTOR_BYTES as u32;
    let mut loaded = loaded(elf)?;
    loaded.sort_by_key(|part| part.address);
    let mut parts: Vec<Part> = Vec::new();
    for part in loaded {
        let end = part.address.checked_add(part.bytes.len() as u32).ok_or("a segment ends beyond the address space")?;
        if part.address < parameters.end && end > parameters.start {
            return Err("a segment lies in a parameter sector");
        }
        match parts.last_mut() {
            // Both before the parameter sectors, or both after them.
            Some(last) if (last.address < parameters.start) == (part.address < parameters.start) => {
                let offset = (part.address - last.address) as usize;
                if offset < last.bytes.len() {
                    return Err("two segments overlap");
                }
                last.bytes.resize(offset, 0xFF);
                last.bytes.extend(part.bytes);
            }
            _ => parts.push(part),
        }
    }
    if parts.is_empty() { Err("the image is empty: no segment is loaded") } else { Ok(parts) }
}

/// The segments with content, at the addresses where they are stored (`p_paddr`).
pub(crate) fn loaded(elf: &[u8]) -> Result<Vec<Part>, &'static str> {
    let bytes =
        |segment: Segment| Ok(Part { address: segment.address, bytes: elf.get(segment.file).ok_or(CUT)?.to_vec() });
    segments(elf)?.into_iter().map(bytes).collect()
}

/// Where in the file so many bytes are that are stored at this address; `None` if no segment has them all.
pub(crate) fn place(elf: &[u8], address: u32, bytes: usize) -> Result<Option<Range<usize>>, &'static str> {
    let in_segment = |segment: Segment| {
        let start = segment.file.start.checked_add(address.checked_sub(segment.address)? as usize)?;
        let end = start.checked_add(bytes)?;
        (end <= segment.file.end).then_some(start..end)
    };
    Ok(segments(elf)?.into_iter().find_map(in_segment))
}

/// A segment with content.
struct Segment {
    /// Where it is stored on the chip.
    address: u32,
    /// Where it is in the file.
    file: Range<usize>,
}

fn segments(elf: &[u8]) -> Result<Vec<Segment>, &'static str> {
    if elf.get(..6) != Some(b"\x7fELF\x01\x01") {
        return Err(NOT_ELF);
    }
    let table = word(elf, 0x1c)? as usize;
    let entry = usize::from(half(elf, 0x2a)?);
    let count = usize::from(half(elf, 0x2c)?);
    let mut segments = Vec::new();
    for index in 0..count {
        let field = |number: usize| word(elf, table.saturating_add(index * entry + 4 * number));
        let (kind, offset, address, size) = (field(0)?, field(1)? as usize, field(3)?, field(4)? as usize);
        if kind == PT_LOAD && size > 0 {
            let end = offset.checked_add(size).filter(|&end| end <= elf.len()).ok_or(CUT)?;
            segments.push(Segment { address, file: offset..end });
        }
    }
    Ok(segments)
}

/// An entry of the symbol table.
struct Symbol {
    name: String,
    value: u32,
    is_function: bool,
}

/// The symbol table.
fn symbols(elf: &[u8]) -> Result<Vec<Symbol>, &'static str> {
    let sections = sections(elf)?;
    let table = sections.iter().find(|section| section.kind == SHT_SYMTAB).ok_or("the ELF file has no symbol table")?;
    let names = sections.get(table.link as usize).ok_or(CUT)?;
    let count = table.size as usize / SYMBOL_SIZE;
    let symbol = |index: usize| {
        let at = table.offset as usize + index * SYMBOL_SIZE;
        let rest = elf.get((names.offset as usize).saturating_add(word(elf, at)? as usize)..).ok_or(CUT)?;
        let end = rest.iter().position(|&byte| byte == 0).ok_or(CUT)?;
        let name = String::from_utf8_lossy(&rest[..end]).into_owned();
        let is_function = *elf.get(at + SYMBOL_INFO).ok_or(CUT)? & 0xF == STT_FUNC;
        Ok(Symbol { name, value: word(elf, at + 4)?, is_function })
    };
    (0..count).map(symbol).collect()
}

/// Names and addresses of the functions.
pub(crate) fn functions(elf: &[u8]) -> Result<Vec<(String, u32)>, &'static str> {
    let functions = symbols(elf)?.into_iter().filter(|symbol| symbol.is_function);
    // Bit 0 says that the code is Thumb.
    Ok(functions.map(|symbol| (symbol.name, symbol.value & !1)).collect())
}

/// Routines that compute in double precision: the Cortex-M4F does that in software, fifty times slower than in single precision.
pub(crate) fn double_precision(elf: &[u8]) -> Result<Vec<String>, &'static str> {
    let mut found: Vec<String> =
        symbols(elf)?.into_iter().map(|symbol| symbol.name).filter(|name| is_double_precision(name)).collect();
    found.sort();
    found.dedup();
    Ok(found)
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

    /// An ELF file of only a header and section headers: (type, flags, address, size) each.
    fn elf(sections: &[(u32, u32, u32, u32)]) -> Vec<u8> {
        let mut file = b"\x7fELF\x01\x01".to_vec();
        file.resize(52, 0);
        file[0x20..0x24].copy_from_slice(&52_u32.to_le_bytes());
        file[0x2e..0x30].copy_from_slice(&40_u16.to_le_bytes());
        file[0x30..0x32].copy_from_slice(&(sections.len() as u16).to_le_bytes());
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
        assert_eq!(footprint(&file), Ok(Footprint { flash: 0x188 + 10_000 + 64, ram: 2_064 }));
    }

    #[test]
    fn an_image_without_content_is_an_error() {
        assert!(footprint(&elf(&[(1, 0, 0, 500)])).unwrap_err().contains("empty"));
    }

    #[test]
    fn every_cut_of_a_file_is_handled_without_a_panic() {
        let file = elf(&[(1, 6, 0x0801_0000, 10_000)]);
        for length in 0..file.len() {
            // The last fields of a header are not needed.
            if length < 52 + 24 {
                assert!(footprint(&file[..length]).is_err(), "{length}");
            }
        }
        assert!(footprint(b"#!/bin/sh\n").unwrap_err().contains("ELF"));
    }

    /// A file with a symbol table of the given names, at the end.
    fn with_symbols(names: &[&str]) -> Vec<u8> {
        let headers = 52 + 2 * 40;
        let mut file = elf(&[(2, 0, 0, (names.len() * 16) as u32), (3, 0, 0, 0)]);
        let strings_at = headers + names.len() * 16;
        let mut strings = vec![0_u8];
        for name in names {
            file.extend_from_slice(&(strings.len() as u32).to_le_bytes());
            file.extend_from_slice(&[0; 12]);
            strings.extend_from_slice(name.as_bytes());
            strings.push(0);
        }
        file.extend_from_slice(&strings);
        for (section, field, value) in [(0, 4, headers), (0, 6, 1), (1, 4, strings_at)] {
            let at = 52 + 40 * section + 4 * field;
            file[at..at + 4].copy_from_slice(&(value as u32).to_le_bytes());
        }
        file
    }

    /// An ELF file of only a header and loaded segments: (address, bytes) each.
    pub(crate) fn with_segments(segments: &[(u32, &[u8])]) -> Vec<u8> {
        let mut file = b"\x7fELF\x01\x01".to_vec();
        file.resize(52, 0);
        file[0x1c..0x20].copy_from_slice(&52_u32.to_le_bytes());
        file[0x2a..0x2c].copy_from_slice(&32_u16.to_le_bytes());
        file[0x2c..0x2e].copy_from_slice(&(segments.len() as u16).to_le_bytes());
        let mut offset = 52 + 32 * segments.len();
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

    /// A file with code in flash, and a symbol table of functions: (name, value) each.
    pub(crate) fn with_functions(address: u32, code: &[u8], functions: &[(&str, u32)]) -> Vec<u8> {
        let names: Vec<&str> = functions.iter().map(|(name, _)| *name).collect();
        let mut file = with_symbols(&names);
        let table = 52 + 2 * 40;
        for (index, (_, value)) in functions.iter().enumerate() {
            let at = table + SYMBOL_SIZE * index;
            file[at + 4..at + 8].copy_from_slice(&(address + value).to_le_bytes());
            file[at + SYMBOL_INFO] = STT_FUNC;
        }
        let (headers, length) = (file.len() as u32, code.len() as u32);
        file[0x1c..0x20].copy_from_slice(&headers.to_le_bytes());
        file[0x2a..0x2c].copy_from_slice(&32_u16.to_le_bytes());
        file[0x2c..0x2e].copy_from_slice(&1_u16.to_le_bytes());
        for field in [PT_LOAD, headers + 32, address, address, length, length, 5, 4] {
            file.extend_from_slice(&field.to_le_bytes());
        }
        file.extend_from_slice(code);
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
            assert!(flash_parts(&with_segments(&[vectors, segment])).unwrap_err().contains(words), "{segment:x?}");
        }
        assert!(flash_parts(&with_segments(&[])).unwrap_err().contains("empty"));
        for length in 0..file.len() {
            assert!(flash_parts(&file[..length]).is_err(), "{length}");
        }
    }

    #[test]
    fn double_precision_is_found_by_its_routines() {
        let file =
            with_symbols(&["main", "__aeabi_dmul", "__muldf3", "__aeabi_dcmpgt", "__aeabi_fcmpgt", "__aeabi_uldivmod"]);
        assert_eq!(double_precision(&file).unwrap(), ["__aeabi_dcmpgt", "__aeabi_dmul", "__muldf3"]);
        assert_eq!(double_precision(&with_symbols(&["step", "__divsf3"])).unwrap(), Vec::<String>::new());
    }

    #[test]
    fn functions_have_even_addresses_and_data_is_none() {
        let mut file = with_functions(0x0800_0000, &[], &[("data", 0x10), ("step", 0x101)]);
        file[52 + 2 * 40 + SYMBOL_INFO] = 1;
        assert_eq!(functions(&file).unwrap(), [("step".to_owned(), 0x0800_0100)]);
    }

    #[test]
    fn a_cut_symbol_table_is_refused() {
        let file = with_symbols(&["__aeabi_dmul"]);
        for length in 0..file.len() {
            assert!(double_precision(&file[..length]).is_err(), "{length}");
        }
    }

    #[test]
    fn sizes_are_shown_in_kibibytes() {
        assert_eq!(Footprint { flash: 20_480, ram: 1_536 }.to_string(), "flash 20.0 KiB, static RAM 1.5 KiB");
    }
}
