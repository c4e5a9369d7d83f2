//! Registers of one converter: effects of reads and writes (RM0090 13.13).

use super::{ADON, Adc, DMA, EOC, Group, OVR};
use crate::lint::LintKind;

const DR: u32 = 0x4C;
const JSWSTART: u32 = 1 << 22;
const SWSTART: u32 = 1 << 30;
/// Discontinuous mode bits of CR1.
const DISCONTINUOUS: u32 = 1 << 11 | 1 << 12;

impl Adc {
    /// Value of a register, without the side effects of a read; `None`: no register at this offset.
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

    /// Applies the side effect of a read: reading DR clears EOC (13.13.1).
    pub(crate) fn after_read(&mut self, offset: u32) {
        if offset == DR {
            self.sr &= !EOC;
        }
    }

    /// Writes a register at `cycle`.
    pub(crate) fn write(&mut self, offset: u32, value: u32, cycle: u64, lints: &mut Vec<LintKind>) {
        match offset {
            0x00 => self.sr &= value,
            0x04 => {
                if value & DISCONTINUOUS != 0 {
                    lints.push(LintKind::Mode("ADC discontinuous mode"));
                }
                self.cr1 = value & 0x07C0_FFFF;
            }
            0x08 => self.write_cr2(value, cycle, lints),
            0x0C => self.smpr[0] = value & 0x07FF_FFFF,
            0x10 => self.smpr[1] = value & 0x3FFF_FFFF,
            0x14..=0x20 => self.jofr[(offset as usize - 0x14) / 4] = value & 0xFFF,
            0x24 => self.htr = value & 0xFFF,
            0x28 => self.ltr = value & 0xFFF,
            0x2C => self.sqr[0] = value & 0x00FF_FFFF,
            0x30 | 0x34 => self.sqr[(offset as usize - 0x2C) / 4] = value & 0x3FFF_FFFF,
            0x38 => self.jsqr = value & 0x003F_FFFF,
            0x3C..=DR => lints.push(LintKind::Misuse("ADC data registers are read only")),
            _ => lints.push(LintKind::Unmodelled),
        }
    }

    fn write_cr2(&mut self, value: u32, cycle: u64, lints: &mut Vec<LintKind>) {
        // 13.13.3: SWSTART and JSWSTART are cleared as soon as the conversion starts.
        self.cr2 = value & 0x3F3F_0F03;
        if value & DMA == 0 {
            self.dma_pending = false;
            self.dma_finished = false;
        }
        if value & ADON == 0 {
            self.running = None;
            self.pending_regular = None;
            if value & (SWSTART | JSWSTART) != 0 {
                lints.push(LintKind::Misuse("a conversion is started while ADON is 0: set ADON first"));
            }
            return;
        }
        if value & JSWSTART != 0 {
            self.start(Group::Injected, cycle);
        }
        if value & SWSTART != 0 {
            if self.sr & OVR != 0 {
                lints.push(LintKind::Misuse("a regular conversion is started while OVR is set: clear OVR first"));
            }
            self.start(Group::Regular, cycle);
        }
    }
}
