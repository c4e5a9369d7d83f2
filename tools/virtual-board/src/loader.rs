//! ELF loader: flash contents by physical address, and symbols by mangled or demangled name.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context as _, Result, bail, ensure};
use object::elf::{EM_ARM, PT_LOAD, STT_FUNC, STT_NOTYPE, STT_OBJECT};
use object::read::elf::{ElfFile32, FileHeader as _, ProgramHeader as _};
use object::{Endianness, Object as _, ObjectSymbol as _};
use sha2::{Digest as _, Sha256};

use crate::addresses::FLASH;
use crate::modelled_board::ModelledBoard;
use crate::unicorn::rams;

/// A program: its flash contents and symbols.
#[derive(Debug)]
pub(crate) struct ProgramImage {
    /// Contents of flash from its start; gaps are 0xFF, as in erased flash.
    pub(crate) flash: Vec<u8>,
    /// SHA-256 of the ELF file, hexadecimal.
    pub(crate) sha256: String,
    /// The board on which it runs.
    pub(crate) board: ModelledBoard,
    symbols: SymbolTable,
}

/// Addresses of functions and objects by name.
#[derive(Debug, Default)]
struct SymbolTable {
    /// Functions and objects by mangled name.
    raw: BTreeMap<String, u32>,
    /// Functions by demangled name, without the hash at the end.
    plain: BTreeMap<String, Vec<u32>>,
}

impl ProgramImage {
    /// Reads the file at `path`. `board`: the board that the command line names, if it does.
    ///
    /// # Errors
    /// The file cannot be read, is for another board, or is not an ARM ELF for the flash of its chip.
    pub(crate) fn read(path: &Path, board: Option<ModelledBoard>) -> Result<Self> {
        let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
        Self::parse(&bytes, board).with_context(|| format!("{} cannot run here", path.display()))
    }

    /// A new chip: erased flash, and no program.
    pub(crate) fn erased(board: ModelledBoard) -> Self {
        ProgramImage { flash: Vec::new(), sha256: String::new(), board, symbols: SymbolTable::default() }
    }

    /// Parses the bytes of an ELF file.
    ///
    /// # Errors
    /// As [`ProgramImage::read`].
    pub(crate) fn parse(bytes: &[u8], board: Option<ModelledBoard>) -> Result<Self> {
        let elf = ElfFile32::<Endianness>::parse(bytes).context("not a 32-bit ELF file")?;
        let endian = elf.endian();
        ensure!(endian == Endianness::Little, "the ELF is big-endian; allowed is little-endian");
        let machine = elf.elf_header().e_machine(endian);
        ensure!(machine == EM_ARM, "the ELF is for machine {machine}; allowed is {EM_ARM} (ARM)");

        let board = ModelledBoard::of_image(elf.symbols().filter_map(|symbol| symbol.name().ok()), board)?;
        let chip = board.config().chip;
        let flash_size = chip.flash_bytes();
        let mut flash = Vec::new();
        for header in elf.elf_program_headers() {
            if header.p_type(endian) != PT_LOAD || header.p_filesz(endian) == 0 {
                continue;
            }
            let data = header.data(endian, bytes).ok().context("a segment lies outside of the file")?;
            let addr = header.p_paddr(endian);
            let start = addr.wrapping_sub(FLASH) as usize;
            let end = start.saturating_add(data.len());
            ensure!(
                end <= flash_size as usize,
                "a segment of {} bytes is loaded to 0x{addr:08X}; flash of an {chip} is 0x{FLASH:08X} to 0x{:08X}",
                data.len(),
                FLASH + flash_size - 1
            );
            if flash.len() < end {
                flash.resize(end, 0xFF);
            }
            flash[start..end].copy_from_slice(data);
        }
        ensure!(flash.len() >= 8, "no segment is loaded to 0x{FLASH:08X}, the address of the vector table");
        let word = |at: usize| u32::from_le_bytes([flash[at], flash[at + 1], flash[at + 2], flash[at + 3]]);
        let (sp, entry) = (word(0), word(4));
        if !rams(chip).iter().any(|&(base, size)| sp > base && sp <= base + size) {
            bail!("the stack pointer 0x{sp:08X} in the vector table is not in RAM");
        }
        if entry & 1 == 0 || (entry & !1).wrapping_sub(FLASH) >= flash_size {
            bail!("the reset vector 0x{entry:08X} in the vector table is not an odd address in flash");
        }

        let mut symbols = SymbolTable::default();
        for symbol in elf.symbols() {
            let kind = symbol.elf_symbol().st_type();
            // Those of the linker script, such as the ends of sections, have no type.
            let is_of_linker = |name: &str| kind == STT_NOTYPE && name.starts_with("__");
            let Some(name) =
                (symbol.name().ok()).filter(|name| kind == STT_FUNC || kind == STT_OBJECT || is_of_linker(name))
            else {
                continue;
            };
            // Bit 0 of the address of a function marks Thumb code.
            let address = symbol.address() as u32 & if kind == STT_FUNC { !1 } else { !0 };
            symbols.raw.insert(name.to_owned(), address);
            if kind == STT_FUNC {
                let plain = format!("{:#}", rustc_demangle::demangle(name));
                let known = symbols.plain.entry(plain).or_default();
                if !known.contains(&address) {
                    known.push(address);
                }
            }
        }
        let sha256 = Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect();
        Ok(ProgramImage { flash, sha256, board, symbols })
    }

    /// Adds bytes to flash that the program leaves erased, like a second download.
    ///
    /// # Errors
    /// The bytes do not fit into flash, or the program uses their addresses.
    pub(crate) fn add_download(&mut self, addr: u32, bytes: &[u8]) -> Result<()> {
        let start = addr.wrapping_sub(FLASH) as usize;
        let end = start.saturating_add(bytes.len());
        let flash_size = self.board.config().chip.flash_bytes();
        ensure!(
            end <= flash_size as usize,
            "{} bytes at 0x{addr:08X} do not fit; flash is 0x{FLASH:08X} to 0x{:08X}",
            bytes.len(),
            FLASH + flash_size - 1
        );
        if self.flash.len() < end {
            self.flash.resize(end, 0xFF);
        }
        ensure!(
            self.flash[start..end].iter().all(|&byte| byte == 0xFF),
            "the program uses flash in the {} bytes from 0x{addr:08X}; allowed is flash that it leaves erased",
            bytes.len()
        );
        self.flash[start..end].copy_from_slice(bytes);
        Ok(())
    }

    /// Address of a symbol, by its exact mangled name.
    #[must_use]
    pub(crate) fn symbol(&self, name: &str) -> Option<u32> {
        self.symbols.raw.get(name).copied()
    }

    /// The first function whose demangled name is exactly one of `names`, with its name.
    #[must_use]
    pub(crate) fn find_first_function(&self, names: &[&'static str]) -> Option<(&'static str, u32)> {
        names.iter().find_map(|&name| Some((name, *self.symbols.plain.get(name)?.first()?)))
    }

    /// Finds a function by its mangled name, its demangled name, or the last parts of that (`telemetry::run`).
    ///
    /// # Errors
    /// No function, or several, match; the message lists similar names.
    pub(crate) fn find_function(&self, name: &str) -> Result<u32> {
        if let Some(address) = self.symbol(name) {
            return Ok(address);
        }
        // The code of an async function is in a closure inside it.
        let endings = ["", "::{{closure}}", "::{closure#0}"].map(|suffix| format!("::{name}{suffix}"));
        let exact = self.symbols.plain.get(name);
        let fitting: Vec<(&str, u32)> = match exact {
            Some(addresses) => addresses.iter().map(|&address| (name, address)).collect(),
            None => (self.symbols.plain.iter())
                .filter(|(plain, _)| endings.iter().any(|ending| plain.ends_with(ending)))
                .flat_map(|(plain, addresses)| addresses.iter().map(|&address| (plain.as_str(), address)))
                .collect(),
        };
        let list = |names: Vec<String>| names.into_iter().take(12).collect::<Vec<_>>().join("\n  ");
        match fitting[..] {
            [(_, address)] => Ok(address),
            [] => {
                let near: Vec<String> =
                    self.symbols.plain.keys().filter(|plain| plain.contains(name)).cloned().collect();
                ensure!(!near.is_empty(), "the ELF has no function `{name}`, and none whose name contains it");
                bail!("the ELF has no function `{name}`; names that contain it:\n  {}", list(near))
            }
            _ => {
                let all = fitting.iter().map(|(plain, address)| format!("{plain} at 0x{address:08X}")).collect();
                bail!("`{name}` matches several functions; use one of these names:\n  {}", list(all))
            }
        }
    }

    /// Function at an address: the nearest one that starts at or before it; `None`: not in the image.
    #[must_use]
    pub(crate) fn function_at(&self, addr: u32) -> Option<&str> {
        if addr.wrapping_sub(FLASH) as usize >= self.flash.len() {
            return None;
        }
        let all = self.symbols.plain.iter().flat_map(|(name, at)| at.iter().map(move |&at| (at, name.as_str())));
        all.filter(|&(at, _)| at <= addr).max().map(|(_, name)| name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refuses_a_file_that_is_not_for_this_chip() {
        let error = |bytes: &[u8]| format!("{:#}", ProgramImage::parse(bytes, None).unwrap_err());
        assert!(error(b"hello").contains("not a 32-bit ELF"));
        assert!(error(&host_elf()).contains("not a 32-bit ELF"), "{}", error(&host_elf()));
        for (paddr, sp, entry, words) in [
            (0x2000_0000u32, 0x2000_1000u32, 0x0800_0009u32, "is loaded to 0x20000000"),
            (0x0800_0000, 0x3000_0000, 0x0800_0009, "stack pointer 0x30000000 in the vector table is not in RAM"),
            (0x0800_0000, 0x2000_1000, 0x0800_0008, "reset vector 0x08000008"),
            (0x080F_FFFC, 0x2000_1000, 0x0800_0009, "flash of an STM32F407 is 0x08000000 to 0x080FFFFF"),
        ] {
            let message = error(&elf(paddr, sp, entry));
            assert!(message.contains(words), "{message}");
        }
    }

    /// 512 KiB of flash, and no core-coupled memory.
    #[test]
    fn the_memory_is_that_of_the_chip() {
        let error = |elf: &[u8]| {
            let pill = ProgramImage::parse(elf, Some(ModelledBoard::BlackPillF411));
            format!("{:#}", pill.unwrap_err())
        };
        let high = elf(0x0808_0000, 0x2000_1000, 0x0800_0009);
        assert!(error(&high).contains("flash of an STM32F411 is 0x08000000 to 0x0807FFFF"), "{}", error(&high));
        assert!(error(&elf(0x0800_0000, 0x1000_1000, 0x0800_0009)).contains("not in RAM"));
        assert!(ProgramImage::parse(&elf(0x0800_0000, 0x1000_1000, 0x0800_0009), None).is_ok());
    }

    #[test]
    fn places_segments_by_physical_address() {
        let image = ProgramImage::parse(&elf(0x0800_0000, 0x2000_1000, 0x0800_0009), None).unwrap();
        assert_eq!(image.flash[..8], [0x00, 0x10, 0x00, 0x20, 0x09, 0x00, 0x00, 0x08]);
        let mut image = image;
        image.add_download(FLASH + 0x4000, &[1, 2]).unwrap();
        assert_eq!(image.flash[0x3FFF..0x4002], [0xFF, 1, 2]);
        let message = |result: Result<()>| result.unwrap_err().to_string();
        assert!(message(image.add_download(FLASH + 4, &[0])).contains("leaves erased"));
        assert!(message(image.add_download(0x080F_FFFF, &[0, 0])).contains("do not fit"));
        assert!(message(image.add_download(0x2000_0000, &[0])).contains("do not fit"));
        assert_eq!(image.sha256.len(), 64);
        assert!(image.find_function("main").unwrap_err().to_string().contains("no function `main`"));
    }

    #[test]
    fn functions_are_found_by_their_last_parts() {
        let mut symbols = SymbolTable::default();
        symbols.raw.insert("_SEGGER_RTT".into(), 0x2000_0000);
        for (name, addresses) in [
            ("app::tasks::telemetry::run", vec![0x0801_0000]),
            ("app::tasks::control::run", vec![0x0801_0100, 0x0801_0200]),
            ("app::blink::{{closure}}", vec![0x0801_0300]),
        ] {
            symbols.plain.insert(name.into(), addresses);
        }
        let image = ProgramImage {
            flash: vec![0xFF; 0x2_0000],
            sha256: String::new(),
            board: ModelledBoard::default(),
            symbols,
        };
        assert_eq!(image.find_function("telemetry::run").unwrap(), 0x0801_0000);
        assert_eq!(image.find_function("blink").unwrap(), 0x0801_0300);
        assert_eq!(image.find_function("_SEGGER_RTT").unwrap(), 0x2000_0000);
        assert!(image.find_function("run").unwrap_err().to_string().contains("matches several"));
        assert!(image.find_function("control::run").unwrap_err().to_string().contains("0x08010200"));
        assert!(image.find_function("emetry::run").unwrap_err().to_string().contains("app::tasks::telemetry::run"));
        assert_eq!(image.function_at(0x0801_0104), Some("app::tasks::control::run"));
        assert_eq!(image.function_at(0xFFFF_FFF8), None);
    }

    fn host_elf() -> Vec<u8> {
        let mut bytes = vec![0x7F, b'E', b'L', b'F', 2, 1, 1];
        bytes.resize(64, 0);
        bytes
    }

    /// An ELF of one segment: a vector table of two words.
    fn elf(paddr: u32, sp: u32, entry: u32) -> Vec<u8> {
        let mut bytes = vec![0x7F, b'E', b'L', b'F', 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        let half = |bytes: &mut Vec<u8>, value: u16| bytes.extend(value.to_le_bytes());
        let word = |bytes: &mut Vec<u8>, value: u32| bytes.extend(value.to_le_bytes());
        half(&mut bytes, 2);
        half(&mut bytes, 40);
        // version, entry, program headers at 52, no sections, flags
        [1, entry, 52, 0, 0].into_iter().for_each(|value| word(&mut bytes, value));
        [52, 32, 1, 40, 0, 0].into_iter().for_each(|value| half(&mut bytes, value));
        // PT_LOAD, offset 84, virtual and physical address, file and memory size, flags, alignment
        [1, 84, paddr, paddr, 8, 8, 5, 4].into_iter().for_each(|value| word(&mut bytes, value));
        [sp, entry].into_iter().for_each(|value| word(&mut bytes, value));
        bytes
    }
}
