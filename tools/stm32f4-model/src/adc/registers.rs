//! Reads and writes of the converters' registers, and the common block (RM0090 13.13).

use super::{ADON, Adc, DMA, Group, OVR};
use crate::lint::LintKind;

const DR: u32 = 0x4C;
const JSWSTART: u32 = 1 << 22;
const SWSTART: u32 = 1 << 30;
/// CR1: discontinuous modes.
const DISCONTINUOUS: u32 = 1 << 11 | 1 << 12;

impl Adc {
    /// The value of a register, without the effects of a read.
    pub(crate) fn peek(&self, offset: u32) -> Option<u32> {
        Some(match offset {
            0x00 => self.sr,
            0x04 => self.cr1,
            0x08 => self.cr2,
            0x0C | 0x10 => self.smpr[usize::from(offset == 0x10)],
            0x14..=0x20 => self.jofr[(offset as usize - 0x14) / 4],
            0x24 => self.htr,
            0x28 => self.ltr,
            0x2C..=0x34 => self.sqr[(offset as usize - 0x2C) / 4],
            0x38 => self.jsqr,
            0x3C..=0x48 => self.jdr[(offset as usize - 0x3C) / 4],
            DR => self.dr,
            _ => return None,
        })
    }

    /// What a read changes: reading DR clears EOC (13.13.1).
    pub(crate) fn after_read(&mut self, offset: u32) {
        if offset == DR {
            self.sr &= !super::EOC;
        }
    }

    /// A write at `cycle`.
    pub(crate) fn write(&mut self, offset: u32, value: u32, cycle: u64, notes: &mut Vec<LintKind>) {
        match offset {
            0x00 => self.sr &= value,
            0x04 => {
                if value & DISCONTINUOUS != 0 {
                    notes.push(LintKind::Mode("ADC discontinuous mode"));
                }
                self.cr1 = value & 0x07C0_FFFF;
            }
            0x08 => self.write_cr2(value, cycle, notes),
            0x0C => self.smpr[0] = value & 0x07FF_FFFF,
            0x10 => self.smpr[1] = value & 0x3FFF_FFFF,
            0x14..=0x20 => self.jofr[(offset as usize - 0x14) / 4] = value & 0xFFF,
            0x24 => self.htr = value & 0xFFF,
            0x28 => self.ltr = value & 0xFFF,
            0x2C => self.sqr[0] = value & 0x00FF_FFFF,
            0x30 | 0x34 => self.sqr[(offset as usize - 0x2C) / 4] = value & 0x3FFF_FFFF,
            0x38 => self.jsqr = value & 0x003F_FFFF,
            0x3C..=DR => notes.push(LintKind::Misuse("ADC data registers are read only")),
            _ => notes.push(LintKind::Unmodelled),
        }
    }

    fn write_cr2(&mut self, value: u32, cycle: u64, notes: &mut Vec<LintKind>) {
        // 13.13.3: SWSTART and JSWSTART are cleared as soon as the conversion starts.
        self.cr2 = value & 0x3F3F_0F03;
        if value & DMA == 0 {
            self.dma_waits = false;
            self.dma_over = false;
        }
        if value & ADON == 0 {
            self.running = None;
            self.regular_waits = None;
            if value & (SWSTART | JSWSTART) != 0 {
                notes.push(LintKind::Misuse("a conversion is started while ADON is 0"));
            }
            return;
        }
        if value & JSWSTART != 0 {
            self.start(Group::Injected, cycle);
        }
        if value & SWSTART != 0 {
            if self.sr & OVR != 0 {
                notes.push(LintKind::Misuse("a regular conversion is started while OVR is set"));
            }
            self.start(Group::Regular, cycle);
        }
    }
}

/// The registers that the three converters share (13.13.15 to 13.13.17).
#[derive(Debug, Clone, Default)]
pub(crate) struct Common {
    ccr: u32,
}

impl Common {
    pub(crate) fn peek(&self, offset: u32, adcs: &[Adc; 3]) -> Option<u32> {
        match offset {
            0x00 => Some(adcs.iter().rev().fold(0, |status, adc| status << 8 | (adc.sr & 0x3F))),
            0x04 => Some(self.ccr),
            _ => None,
        }
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32, notes: &mut Vec<LintKind>) {
        if offset != 0x04 {
            notes.push(LintKind::Unmodelled);
            return;
        }
        if value & 0xC01F != 0 {
            notes.push(LintKind::Mode("dual or triple ADC mode"));
        }
        self.ccr = value & 0x00C3_EF1F;
    }

    /// PCLK2 cycles per ADCCLK cycle.
    pub(crate) fn divider(&self) -> u64 {
        u64::from((self.ccr >> 16 & 3) + 1) * 2
    }

    /// TSVREFE: temperature sensor and VREFINT are on.
    pub(crate) fn reference_on(&self) -> bool {
        self.ccr & 1 << 23 != 0
    }

    /// VBATE: the divider at VBAT is on.
    pub(crate) fn vbat_on(&self) -> bool {
        self.ccr & 1 << 22 != 0
    }
}
