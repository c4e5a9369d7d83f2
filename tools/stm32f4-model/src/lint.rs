//! Lints: records of accesses that are not modelled, not allowed, or without the intended effect on the chip.
//!
//! One record with a count for each kind, address, width and direction, so that polling a register makes one lint.

use core::fmt;

use crate::bus::Width;
use crate::memory_map::locate;

/// Reason for recording an access.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LintKind {
    /// The block or register is not modelled: it reads as 0 and ignores writes.
    Unmodelled,
    /// The register is modelled, but not the mode that was written; the text names the mode.
    Mode(&'static str),
    /// The block's clock enable bit in RCC is off: it reads as 0 and ignores writes.
    Unclocked,
    /// RCC holds the block in reset: it reads as 0 and ignores writes.
    InReset,
    /// The reference manual does not allow this access width here: it reads as 0 and ignores writes.
    Width,
    /// The address is no multiple of the access width: it reads as 0 and ignores writes.
    Unaligned,
    /// The chip ignores the access or leaves its ratings; the text names the rule.
    Misuse(&'static str),
}

impl LintKind {
    /// True for a limit of the model, [`LintKind::Unmodelled`] and [`LintKind::Mode`]: the run then shows nothing about the chip.
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

/// A recorded access: its first occurrence and the number of occurrences.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lint {
    /// HCLK cycle of the first occurrence.
    pub cycle: u64,
    /// Address of the access.
    pub addr: u32,
    /// Width of the access.
    pub width: Width,
    /// Reason.
    pub kind: LintKind,
    /// True for a write, false for a read.
    pub write: bool,
    /// Value of the first write; 0 for a read.
    pub value: u32,
    /// Number of occurrences, at least 1.
    pub count: u64,
}

impl Lint {
    /// Name of the peripheral block, for example `TIM1`; `None` for an address outside of all blocks.
    #[must_use]
    pub fn block(&self) -> Option<&'static str> {
        locate(self.addr).map(|(block, _)| block.name)
    }

    /// Offset in the block, bytes; the address itself outside of all blocks.
    #[must_use]
    pub fn offset(&self) -> u32 {
        locate(self.addr).map_or(self.addr, |(_, offset)| offset)
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
