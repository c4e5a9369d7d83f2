//! Timer registers: effects of reads and writes (RM0090 17.4, 18.4, 19.4, 19.5, 20.4).

use super::bits::{
    AOE, ARPE, BDTR, BKE, BKP, CC_DE_SHIFT, CCDS, COMIF, MOE, OPM, OSSI, OSSR, TIF, UDE, UDIS, UIF, URS,
};
use super::{Signals, Timer};
use crate::lint::LintKind;

const UG: u32 = 1;
/// LOCK of BDTR.
const LOCK: u32 = 0x300;
const BG: u32 = 1 << 7;
/// OCxM and OCxPE of both channels of a CCMR.
const CCMR_MODES: u32 = 0x7878;

impl Timer {
    /// Value of a register; `None`: the timer has none at this offset. The caller must first advance the timer to the present cycle.
    pub(crate) fn peek(&self, offset: u32) -> Option<u32> {
        if !self.features.has(offset) {
            return None;
        }
        let counter = &self.counter;
        Some(match offset {
            0x00 => self.cr1 | u32::from(counter.enabled),
            0x04 => self.cr2,
            0x08 => self.smcr,
            0x0C => self.dier,
            0x10 => self.sr,
            0x14 => 0,
            0x18 | 0x1C => self.ccmr[usize::from(offset == 0x1C)],
            0x20 => self.ccer,
            0x24 => counter.cnt,
            0x28 => counter.psc.written,
            0x2C => counter.arr.written,
            0x30 => counter.rcr.written,
            0x34..=0x40 => counter.ccr[(offset as usize - 0x34) / 4].written,
            BDTR => self.bdtr,
            0x50 => self.option,
            _ => return None,
        })
    }

    /// Writes a register at `cycle`, to which the caller must first advance the timer. Returns the resulting signals.
    pub(crate) fn write(&mut self, offset: u32, value: u32, cycle: u64, lints: &mut Vec<LintKind>) -> Signals {
        let mut signals = Signals::default();
        if !self.features.has(offset) {
            lints.push(LintKind::Unmodelled);
            return signals;
        }
        match offset {
            0x00 => self.write_cr1(value, cycle, &mut signals, lints),
            0x04 => self.write_cr2(value, lints),
            0x08 => {
                if value & 0x4007 != 0 {
                    lints.push(LintKind::Mode("timer slave mode or external clock"));
                }
                self.smcr = value & 0xFFF7;
            }
            0x0C => self.dier = value & self.dier_bits(),
            // 17.4.5: flags are cleared by writing 0. The break flag stays while the input is active.
            0x10 => self.sr &= value,
            0x14 => self.generate(value, cycle, &mut signals),
            0x18 | 0x1C => self.write_ccmr(usize::from(offset == 0x1C), value, lints),
            0x20 => self.write_ccer(value, lints),
            0x24 => self.counter.cnt = value & self.counter.top(),
            0x28 => self.counter.psc.written = value & 0xFFFF,
            0x2C => {
                self.counter.arr.written = value & self.counter.top();
                if self.cr1 & ARPE == 0 {
                    self.counter.arr.transfer();
                }
                if value == 0 {
                    lints.push(LintKind::Misuse("an auto-reload value of 0 blocks the counter"));
                }
            }
            0x30 => self.counter.rcr.written = value & 0xFF,
            0x34..=0x40 => {
                let channel = (offset as usize - 0x34) / 4;
                self.counter.ccr[channel].written = value & self.counter.top();
                if !self.preloads(channel) {
                    self.counter.ccr[channel].transfer();
                }
            }
            BDTR => self.write_bdtr(value, lints),
            0x50 => {
                if !self.option_is_modelled(value) {
                    lints.push(LintKind::Mode("timer input remapping"));
                }
                self.option = value & 0xFFFF;
            }
            _ => lints.push(LintKind::Unmodelled),
        }
        self.update_references(0, &mut signals);
        self.apply_break();
        signals
    }

    fn write_cr1(&mut self, value: u32, cycle: u64, signals: &mut Signals, lints: &mut Vec<LintKind>) {
        let directions = if self.features.channels >= 4 { 0x70 } else { 0 };
        if value & 0x70 & directions != 0 {
            lints.push(LintKind::Mode("counting down or centre-aligned"));
        }
        let mask = if self.features.channels == 0 { 0x8E } else { 0x38E | directions };
        self.cr1 = value & mask;
        if self.cr1 & ARPE == 0 {
            self.counter.arr.transfer();
        }
        let enable = value & 1 != 0;
        if enable != self.counter.enabled {
            self.counter.enabled = enable;
            self.counter.set_reference_cycle(cycle);
            // 17.4.2: MMS = 1 puts the counter enable on TRGO.
            if self.mms() == 1 {
                signals.trgo_rise = enable;
                signals.trgo_fall = !enable;
            }
        }
    }

    fn write_cr2(&mut self, value: u32, lints: &mut Vec<LintKind>) {
        let mask = match (self.features.advanced, self.features.channels) {
            (true, _) => 0x7FFD,
            (_, 4) => 0x00F8,
            _ => 0x0070,
        };
        if value & mask & 0x85 != 0 {
            lints.push(LintKind::Mode("commutation preload or XORed input"));
        }
        // 17.4.18: lock level 1 freezes the idle states.
        let idle = if self.lock() >= 1 { 0x7F00 } else { 0 };
        if (value ^ self.cr2) & idle & mask != 0 {
            lints.push(LintKind::Misuse("the idle states in CR2 are locked by BDTR.LOCK"));
        }
        self.cr2 = (value & mask & !idle) | (self.cr2 & idle);
    }

    fn dier_bits(&self) -> u32 {
        match (self.features.advanced, self.features.channels) {
            (true, _) => 0x7FFF,
            (_, 4) => 0x5F5F,
            (_, 2) => 0x0047,
            (_, 1) => 0x0003,
            _ => 0x0101,
        }
    }

    /// Generates events by EGR (17.4.6).
    fn generate(&mut self, value: u32, cycle: u64, signals: &mut Signals) {
        if value & UG != 0 {
            self.counter.restart(cycle);
            if self.cr1 & UDIS == 0 {
                self.update(signals);
                // URS: only an overflow raises the flag and the request.
                if self.cr1 & URS == 0 {
                    self.sr |= UIF;
                    signals.dma_update |= self.dier & UDE != 0;
                }
                if self.cr1 & OPM != 0 {
                    self.counter.enabled = false;
                }
            }
            // MMS = 0 puts UG itself on TRGO.
            if self.mms() == 0 {
                signals.pulse();
            }
        }
        let channels = (value >> 1 & 0xF) as u8 & ((1 << self.features.channels) - 1);
        self.sr |= u32::from(channels) << 1;
        if self.cr2 & CCDS == 0 {
            signals.dma_cc |= channels & (self.dier >> CC_DE_SHIFT) as u8;
        }
        if value & 1 << 5 != 0 && self.features.advanced {
            self.sr |= COMIF;
        }
        if value & 1 << 6 != 0 && self.features.slave {
            self.sr |= TIF;
        }
        if value & BG != 0 && self.features.advanced {
            self.trip_break();
        }
    }

    fn write_ccmr(&mut self, which: usize, value: u32, lints: &mut Vec<LintKind>) {
        let mask = if self.features.channels == 1 { 0x00FF } else { 0xFFFF };
        if !self.capture_is_modelled(which, value & mask) {
            lints.push(LintKind::Mode("input capture"));
        }
        if value & mask & 0x8080 != 0 {
            lints.push(LintKind::Mode("clearing outputs from ETRF (OCxCE)"));
        }
        // 17.4.18: lock level 3 freezes modes and preload enables.
        let frozen = if self.lock() >= 3 { CCMR_MODES } else { 0 };
        if (value ^ self.ccmr[which]) & frozen != 0 {
            lints.push(LintKind::Misuse("output modes in CCMR are locked by BDTR.LOCK"));
        }
        self.ccmr[which] = (value & mask & !frozen) | (self.ccmr[which] & frozen);
        for channel in which * 2..which * 2 + 2 {
            if !self.preloads(channel) {
                self.counter.ccr[channel].transfer();
            }
        }
    }

    fn write_ccer(&mut self, value: u32, lints: &mut Vec<LintKind>) {
        let mask = match (self.features.advanced, self.features.channels) {
            (true, _) => 0x3FFF,
            (_, 4) => 0xBBBB,
            (_, 2) => 0x00BB,
            _ => 0x000B,
        };
        // 17.4.18: lock level 2 freezes the polarities.
        let frozen = if self.lock() >= 2 { 0x2AAA } else { 0 };
        if (value ^ self.ccer) & frozen & mask != 0 {
            lints.push(LintKind::Misuse("output polarities in CCER are locked by BDTR.LOCK"));
        }
        self.ccer = (value & mask & !frozen) | (self.ccer & frozen);
        self.check_dead_time(lints);
    }

    fn check_dead_time(&self, lints: &mut Vec<LintKind>) {
        let both = self.features.advanced && (0..3).any(|channel| self.ccer >> (channel * 4) & 5 == 5);
        if both && self.bdtr & 0xFF != 0 {
            lints.push(LintKind::Mode("dead time between complementary outputs"));
        }
    }

    /// Takes the lock away; returns its bits of BDTR, and whether they were written since the reset.
    pub(crate) fn unlock(&mut self) -> (u32, bool) {
        let bits = self.bdtr & LOCK;
        self.bdtr &= !LOCK;
        (bits, std::mem::take(&mut self.lock_set))
    }

    /// Restores the lock. If BDTR itself was `written` meanwhile, it has the lock that was written.
    pub(crate) fn lock_as(&mut self, (bits, was_set): (u32, bool), written: bool) {
        if !written {
            self.bdtr |= bits;
        }
        self.lock_set = was_set;
    }

    /// Lock level in BDTR, 0 to 3.
    fn lock(&self) -> u32 {
        self.bdtr >> 8 & 3
    }

    fn write_bdtr(&mut self, value: u32, lints: &mut Vec<LintKind>) {
        let mut frozen = 0;
        if self.lock() >= 1 {
            frozen |= 0xFF | BKE | BKP | AOE;
        }
        if self.lock() >= 2 {
            frozen |= OSSI | OSSR;
        }
        if self.lock_set {
            frozen |= LOCK;
        }
        if (value ^ self.bdtr) & frozen != 0 {
            lints.push(LintKind::Misuse(
                "bits of BDTR are locked by BDTR.LOCK, which can be written once after a reset",
            ));
        }
        self.lock_set = true;
        self.bdtr = (value & 0xFFFF & !frozen) | (self.bdtr & frozen);
        self.check_dead_time(lints);
        if self.break_active() && value & MOE != 0 {
            lints.push(LintKind::Misuse("MOE cannot be set while the break input is active"));
        }
    }
}
