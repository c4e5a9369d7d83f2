//! The image: its code, its functions, and the inlined functions at an address, from the debug information.

use std::collections::BTreeMap;

use addr2line::gimli::{Dwarf, EndianSlice, LittleEndian as Little};
use addr2line::{Context as Lines, LookupResult};
use anyhow::{Context, Result, ensure};
use audit::image::Image;
use object::read::elf::ElfFile32;
use object::{LittleEndian, Object, ObjectSection};
use rustc_demangle::demangle;

type Slice<'a> = EndianSlice<'a, Little>;

/// An image with its debug information.
pub struct Program<'a> {
    /// Functions and code.
    pub image: Image,
    lines: Lines<Slice<'a>>,
    /// By address, the names of inlined functions.
    sections: BTreeMap<u32, &'a [u8]>,
}

impl<'a> Program<'a> {
    /// Reads an ELF file.
    ///
    /// # Errors
    ///
    /// When it is none, or has no debug information.
    pub fn parse(elf: &'a [u8]) -> Result<Self> {
        let image = Image::parse(elf)?;
        let file = ElfFile32::<LittleEndian>::parse(elf).context("reading the ELF file")?;
        ensure!(
            file.section_by_name(".debug_info").is_some(),
            "the image has no debug information, which says what is inlined; build it with `debug = 2`"
        );
        let section = |id: addr2line::gimli::SectionId| -> Result<Slice<'a>> {
            let data = file.section_by_name(id.name()).map(|section| section.data()).transpose();
            Ok(EndianSlice::new(data.context("reading debug information")?.unwrap_or_default(), Little))
        };
        let lines = Lines::from_dwarf(Dwarf::load(section)?).context("reading the debug information")?;
        let code = file.sections().filter(|section| section.kind() == object::SectionKind::Text);
        let sections = code
            .map(|section| Ok((section.address() as u32, section.data().context("reading code")?)))
            .collect::<Result<_>>()?;
        Ok(Self { image, lines, sections })
    }

    /// Bytes of code.
    ///
    /// # Errors
    ///
    /// When there is none at the address.
    pub fn code(&self, address: u32, length: u32) -> Result<&'a [u8]> {
        let (start, bytes) =
            self.sections.range(..=address).next_back().with_context(|| format!("no code at {address:#010x}"))?;
        let offset = (address - start) as usize;
        bytes.get(offset..offset + length as usize).with_context(|| format!("no code at {address:#010x}"))
    }

    /// Files and lines of the source at an address, the innermost of the inlined functions first.
    ///
    /// # Errors
    ///
    /// When the debug information is not sound.
    pub fn source_at(&self, address: u32) -> Result<Vec<String>> {
        let LookupResult::Output(frames) = self.lines.find_frames(u64::from(address)) else { return Ok(Vec::new()) };
        let mut frames = frames.context("reading debug information")?;
        let mut places = Vec::new();
        while let Some(frame) = frames.next().context("reading debug information")? {
            let place = frame.location.and_then(|place| {
                let mut parts = place.file?.rsplit('/');
                let (name, folder) = (parts.next()?, parts.next().unwrap_or_default());
                Some(format!("{folder}/{name}:{}", place.line?))
            });
            places.extend(place);
        }
        Ok(places)
    }

    /// Names of the functions at an address, without hashes: the innermost of the inlined ones first, last the one that has the code.
    ///
    /// # Errors
    ///
    /// When the debug information is not sound.
    pub fn functions_at(&self, address: u32) -> Result<Vec<String>> {
        let frames = match self.lines.find_frames(u64::from(address)) {
            LookupResult::Output(frames) => frames,
            LookupResult::Load { .. } => return Ok(Vec::new()),
        };
        let mut frames = frames.context("reading debug information")?;
        let mut names = Vec::new();
        while let Some(frame) = frames.next().context("reading debug information")? {
            if let Some(function) = frame.function {
                let raw = function.raw_name().context("a name in the debug information")?;
                names.push(format!("{:#}", demangle(&raw)));
            }
        }
        Ok(names)
    }
}
