//! Offsets and bit masks of timer registers that several files use (RM0090 17.4).

/// Offset of the break and dead-time register.
pub(crate) const BDTR: u32 = 0x44;

// Flags in SR and enables in DIER.
pub(crate) const UIF: u32 = 1;
pub(crate) const TIF: u32 = 1 << 6;
pub(crate) const COMIF: u32 = 1 << 5;
pub(crate) const BIF: u32 = 1 << 7;
pub(crate) const UIE: u32 = 1;
pub(crate) const CC_IE: u32 = 0x1E;
pub(crate) const UDE: u32 = 1 << 8;
pub(crate) const CC_DE_SHIFT: u32 = 9;
// Bits of CR1.
pub(crate) const UDIS: u32 = 1 << 1;
pub(crate) const URS: u32 = 1 << 2;
pub(crate) const OPM: u32 = 1 << 3;
pub(crate) const ARPE: u32 = 1 << 7;
// Bits of CR2.
pub(crate) const CCDS: u32 = 1 << 3;
// Bits of BDTR.
pub(crate) const MOE: u32 = 1 << 15;
pub(crate) const AOE: u32 = 1 << 14;
pub(crate) const BKP: u32 = 1 << 13;
pub(crate) const BKE: u32 = 1 << 12;
pub(crate) const OSSR: u32 = 1 << 11;
pub(crate) const OSSI: u32 = 1 << 10;
