//! The ELF file of an image: its functions, their code, and what is loaded.

use std::collections::BTreeMap;

use anyhow::{Context, Result, bail, ensure};
use object::elf::{PT_LOAD, STT_FUNC};
use object::read::elf::{ElfFile32, ProgramHeader};
use object::{LittleEndian, Object, ObjectSection, ObjectSymbol, SectionKind, SymbolFlags, SymbolKind};

/// A function of the image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Function {
    /// Its names, without hashes; more than one where the linker merged equal functions or where a handler is a default one.
    pub names: Vec<String>,
    /// Address of its first instruction.
    pub address: u32,
    /// Address after its last byte.
    pub end: u32,
    /// Its code, without data that lies between: the address of each part with its bytes.
    pub code: Vec<(u32, Vec<u8>)>,
}

impl Function {
    /// Its first name.
    #[must_use]
    pub fn name(&self) -> &str {
        self.names.first().map_or("", String::as_str)
    }

    /// Whether one of its names contains this text.
    #[must_use]
    pub fn is(&self, part: &str) -> bool {
        self.names.iter().any(|name| name.contains(part))
    }
}

/// Bytes that are loaded, at the address where they are stored.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Loaded {
    /// Address of the first byte in flash.
    pub address: u32,
    /// The bytes.
    pub bytes: Vec<u8>,
}

/// An image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// By address.
    pub functions: Vec<Function>,
    /// What is loaded, by address.
    pub loaded: Vec<Loaded>,
    /// What the compiler says of itself: `rustc version 1.96.0 (ac68faa20 2026-05-25)`.
    pub compiler: String,
    /// Bytes of code, constants, vector table and first values of variables.
    pub flash: u64,
    /// Bytes of variables and buffers, without the stack.
    pub ram: u64,
}

/// Where an STM32's RAM starts; flash lies below (RM0090, memory map).
const RAM_START: u64 = 0x2000_0000;

impl Image {
    /// Reads an ELF file.
    ///
    /// # Errors
    ///
    /// When it is not a 32 bit little-endian ELF file with symbols and code.
    pub fn parse(elf: &[u8]) -> Result<Self> {
        let file = ElfFile32::<LittleEndian>::parse(elf).context("reading the ELF file")?;
        let mut loaded = Vec::new();
        for header in file.elf_program_headers() {
            let bytes = header.data(LittleEndian, elf).ok().context("a segment is cut short")?;
            if header.p_type.get(LittleEndian) == PT_LOAD && !bytes.is_empty() {
                loaded.push(Loaded { address: header.p_paddr.get(LittleEndian), bytes: bytes.to_vec() });
            }
        }
        loaded.sort_by_key(|part| part.address);
        ensure!(!loaded.is_empty(), "the image is empty: no segment is loaded");
        let (mut flash, mut ram) = (0, 0);
        for section in file.sections().filter(|section| section.address() > 0 || section.kind() == SectionKind::Text) {
            if section.address() >= RAM_START {
                ram += section.size();
            }
            if !matches!(section.kind(), SectionKind::UninitializedData) {
                flash += section.size();
            }
        }
        let comment = file.section_by_name(".comment").context("the image does not name its compiler (.comment)")?;
        let comment = String::from_utf8_lossy(comment.data().context("reading .comment")?).into_owned();
        let compiler = comment.split('\0').find(|line| line.starts_with("rustc")).unwrap_or_default().to_owned();
        let functions = functions(&file)?;
        Ok(Self { functions, loaded, compiler, flash, ram })
    }

    /// The function that this address lies in, by its place in the list.
    #[must_use]
    pub fn function_at(&self, address: u32) -> Option<usize> {
        let after = self.functions.partition_point(|function| function.address <= address);
        let index = after.checked_sub(1)?;
        (address < self.functions[index].end).then_some(index)
    }

    /// The functions with a name that contains this text, by their places in the list.
    #[must_use]
    pub fn named(&self, part: &str) -> Vec<usize> {
        (0..self.functions.len()).filter(|&index| self.functions[index].is(part)).collect()
    }

    /// The one function with this whole name.
    ///
    /// # Errors
    ///
    /// When there is none.
    pub fn only(&self, name: &str) -> Result<usize> {
        let found = self.functions.iter().position(|function| function.names.iter().any(|own| own == name));
        found.with_context(|| format!("the image has no function `{name}`"))
    }
}

/// The functions by their symbols, and by the mapping symbols `$t` and `$d` what of them is code (ELF for the Arm architecture, 5.5.5).
fn functions(file: &ElfFile32<'_, LittleEndian>) -> Result<Vec<Function>> {
    let mut ends: BTreeMap<u32, (u32, Vec<String>)> = BTreeMap::new();
    // From this address on: code or not.
    let mut marks: BTreeMap<u32, bool> = BTreeMap::new();
    for symbol in file.symbols() {
        let name = symbol.name().unwrap_or_default();
        let address = symbol.address() as u32;
        match name.split('.').next() {
            Some("$t") => drop(marks.insert(address, true)),
            Some("$d") => drop(marks.insert(address, false)),
            _ => {}
        }
        let is_function = matches!(symbol.flags(), SymbolFlags::Elf { st_info, .. } if st_info & 0xF == STT_FUNC);
        if is_function && symbol.is_definition() && symbol.kind() == SymbolKind::Text {
            // The lowest bit says Thumb.
            let start = address & !1;
            let (end, names) = ends.entry(start).or_insert_with(|| (start, Vec::new()));
            *end = (*end).max(start + symbol.size() as u32);
            names.push(format!("{:#}", rustc_demangle::demangle(name)));
        }
    }
    ensure!(!ends.is_empty(), "the image has no symbols of functions");
    let starts: Vec<u32> = ends.keys().copied().collect();
    let mut functions = Vec::new();
    for (index, (address, (mut end, mut names))) in ends.into_iter().enumerate() {
        let next = starts.get(index + 1).copied();
        let section = file.sections().find(|section| {
            section.kind() == SectionKind::Text
                && (section.address()..section.address() + section.size()).contains(&u64::from(address))
        });
        // A symbol without a section of code, such as one of the linker script.
        let Some(section) = section else { continue };
        let section_end = (section.address() + section.size()) as u32;
        if end == address {
            // Assembly without a size: to the next function.
            end = next.unwrap_or(section_end);
        }
        if next.is_some_and(|next| next < end) {
            bail!("{} reaches into the next function", names[0]);
        }
        names.sort();
        names.dedup();
        let bytes = section.data().context("reading code")?;
        let part = |from: u32, to: u32| {
            let offset = |at: u32| (u64::from(at) - section.address()) as usize;
            bytes.get(offset(from)..offset(to)).map(<[u8]>::to_vec).context("code is cut short")
        };
        let mut code = Vec::new();
        let mut from = address;
        let mut is_code = marks.range(..=address).next_back().is_none_or(|(_, &is_code)| is_code);
        let inside = marks.range(address + 1..end.max(address + 1)).map(|(at, is_code)| (*at, *is_code));
        for (at, next_is_code) in inside.chain([(end, false)]) {
            if is_code && at > from {
                code.push((from, part(from, at)?));
            }
            (from, is_code) = (at, next_is_code);
        }
        functions.push(Function { names, address, end, code });
    }
    Ok(functions)
}
