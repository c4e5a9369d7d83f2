//! What a program did that the model cannot follow, or that the chip would not do as meant.
//!
//! A lint is recorded once for each kind, address, width and direction, with a count: a program that polls a register that is not
//! modelled makes one lint, not a million.

use core::fmt;

use crate::bus::Width;
use crate::memory_map::place;

/// Why an access was recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LintKind {
    /// No model for this block or register: it reads as 0 and ignores writes.
    Unmodelled,
    /// The register is modelled, the mode that was written is not; the text names it.
    Mode(&'static str),
    /// The block's clock enable bit in RCC is off: it reads as 0 and ignores writes.
    Unclocked,
    /// RCC holds the block in reset: it reads as 0 and ignores writes.
    InReset,
    /// The reference manual does not allow this access width here: it reads as 0 and ignores writes.
    Width,
    /// The address is no multiple of the access width: it reads as 0 and ignores writes.
    Unaligned,
    /// The chip accepts the access but does not do what the writer will have wanted, or runs out of its ratings; the text says why.
    Misuse(&'static str),
}

impl LintKind {
    /// True where the model ends, so that a run which met it proves nothing: [`LintKind::Unmodelled`] and [`LintKind::Mode`].
    #[must_use]
    pub const fn is_unmodelled(self) -> bool {
        matches!(self, LintKind::Unmodelled | LintKind::Mode(_))
    }
}

impl fmt::Display for LintKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LintKind::Unmodelled => f.write_str("unmodelled"),
            LintKind::Mode(what) => write!(f, "unmodelled mode: {what}"),
            LintKind::Unclocked => f.write_str("its clock is off"),
            LintKind::InReset => f.write_str("held in reset"),
            LintKind::Width => f.write_str("width not allowed"),
            LintKind::Unaligned => f.write_str("unaligned"),
            LintKind::Misuse(what) => write!(f, "misuse: {what}"),
        }
    }
}

/// One kind of access that was recorded; its first occurrence, and how often it came.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lint {
    /// HCLK cycle of the first occurrence.
    pub cycle: u64,
    /// Address of the access.
    pub addr: u32,
    /// Width of the access.
    pub width: Width,
    /// Why it was recorded.
    pub kind: LintKind,
    /// True for a write, false for a read.
    pub write: bool,
    /// Value of the first write; 0 for a read.
    pub value: u32,
    /// How many such accesses there were.
    pub count: u64,
}

impl Lint {
    /// Name of the block, as `TIM1`; `None` where the memory map has none.
    #[must_use]
    pub fn block(&self) -> Option<&'static str> {
        place(self.addr).map(|(block, _)| block.name)
    }

    /// Offset in the block, or the address itself where the memory map has no block.
    #[must_use]
    pub fn offset(&self) -> u32 {
        place(self.addr).map_or(self.addr, |(_, offset)| offset)
    }
}

/// For example `write of 0x00000001 to TIM1+0x50 (unmodelled) at cycle 1200`.
impl fmt::Display for Lint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.write {
            write!(f, "write of 0x{:08X} to ", self.value)?;
        } else {
            f.write_str("read of ")?;
        }
        match self.block() {
            Some(block) => write!(f, "{block}+0x{:02X}", self.offset())?,
            None => write!(f, "0x{:08X}", self.addr)?,
        }
        if self.width != Width::Word {
            write!(f, " as a {}", self.width)?;
        }
        write!(f, " ({}) at cycle {}", self.kind, self.cycle)?;
        if self.count > 1 {
            write!(f, ", {} times", self.count)?;
        }
        Ok(())
    }
}
