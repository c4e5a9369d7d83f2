//! RCC: oscillators, clock tree, clock enables, resets, reset flags (RM0090 chapter 7, STM32F405/407; RM0383 chapter 6 has the
//! same registers and limits of the PLL).
//!
//! An oscillator or PLL is ready as soon as it is on and its source runs; start-up and lock times are not modelled. `faults` has what can happen to
//! them.

mod faults;
mod plain;

use crate::chip::Chip;
use crate::clock::{ClockTree, HSI_HZ, ahb_divider, apb_divider};
use crate::lint::LintKind;
use crate::memory_map::Bus;
use crate::reset::ResetCause;

use plain::Plain;

const CR: u32 = 0x00;
const PLLCFGR: u32 = 0x04;
const CFGR: u32 = 0x08;
const CIR: u32 = 0x0C;
const BDCR: u32 = 0x70;
const CSR: u32 = 0x74;
const DCKCFGR: u32 = 0x8C;

const HSION: u32 = 1;
const HSIRDY: u32 = 1 << 1;
const HSEON: u32 = 1 << 16;
const HSERDY: u32 = 1 << 17;
const HSEBYP: u32 = 1 << 18;
const CSSON: u32 = 1 << 19;
const PLLON: u32 = 1 << 24;
const PLLRDY: u32 = 1 << 25;
const PLLI2SON: u32 = 1 << 26;
const PLLI2SRDY: u32 = 1 << 27;
const CR_WRITABLE: u32 = HSION | 0xF8 | HSEON | HSEBYP | CSSON | PLLON | PLLI2SON;

const PLLSRC_HSE: u32 = 1 << 22;
const CSSF: u32 = 1 << 7;
const RMVF: u32 = 1 << 24;

const SW_HSI: u32 = 0;
const SW_HSE: u32 = 1;
const SW_PLL: u32 = 2;

/// RCC registers and the state of the crystals.
#[derive(Debug)]
pub(crate) struct Rcc {
    hse_hz: f64,
    hse_works: bool,
    lse_works: bool,
    pll_locked: bool,
    /// Part of its frequency that the PLL's output has: 1 while it is locked.
    pll_factor: f64,
    cr: u32,
    pllcfgr: u32,
    cfgr: u32,
    /// Ready flags, enables and CSSF of RCC_CIR.
    cir: u32,
    bdcr: u32,
    csr: u32,
    /// LSI oscillates while it is on.
    lsi_works: bool,
    plain: Plain,
    /// SYSCLK is stopped because its source failed.
    stopped: bool,
}

impl Rcc {
    pub(crate) fn new(chip: Chip, hse_hz: u32, hse_works: bool, lse_works: bool) -> Self {
        let mut rcc = Rcc {
            hse_hz: f64::from(hse_hz),
            hse_works,
            lse_works,
            pll_locked: true,
            pll_factor: 1.0,
            cr: 0,
            pllcfgr: 0,
            cfgr: 0,
            cir: 0,
            bdcr: 0,
            csr: 0,
            lsi_works: true,
            plain: Plain::of(chip),
            stopped: false,
        };
        rcc.reset(ResetCause::PowerOn);
        rcc
    }

    /// Sets the reset values of 7.3. BDCR keeps its value except at a power-on (6.1.3); the flags in CSR accumulate until RMVF.
    pub(crate) fn reset(&mut self, cause: ResetCause) {
        self.cr = HSION | HSIRDY | 16 << 3;
        self.pllcfgr = 0x2400_3010;
        self.cfgr = 0;
        self.cir = 0;
        if cause == ResetCause::PowerOn {
            self.bdcr = 0;
            self.csr = 0;
        }
        self.csr = (self.csr & 0xFE00_0000) | cause.flags();
        self.plain.reset();
        self.stopped = false;
    }

    /// Whether LSI oscillates while it is on: LSIRDY follows.
    pub(crate) fn set_lsi_works(&mut self, works: bool) {
        self.lsi_works = works;
        self.update_lsi_ready();
    }

    /// LSION (7.3.21).
    pub(crate) fn lsi_on(&self) -> bool {
        self.csr & 1 != 0
    }

    /// HSE_RTC: HSE after the prescaler RTCPRE, Hz; 0 where HSE is off, or the prescaler is 0 or 1, which is no clock (7.3.3).
    pub(crate) fn hse_rtc_hz(&self) -> f64 {
        let divider = self.cfgr >> 16 & 0x1F;
        if self.cr & HSERDY != 0 && divider >= 2 { self.hse_hz / f64::from(divider) } else { 0.0 }
    }

    fn update_lsi_ready(&mut self) {
        self.csr = (self.csr & !2) | u32::from(self.lsi_on() && self.lsi_works) << 1;
    }

    pub(crate) fn peek(&self, offset: u32) -> Option<u32> {
        Some(match offset {
            CR => self.cr,
            PLLCFGR => self.pllcfgr,
            CFGR => self.cfgr,
            CIR => self.cir,
            BDCR => self.bdcr,
            CSR => self.csr,
            // Reserved on the F405/407, TIMPRE on the F411; drivers for the whole family write 0 to it.
            DCKCFGR => 0,
            _ => self.plain.value(offset)?,
        })
    }

    /// Writes a register. `backup_writable` is PWR_CR.DBP; while it is false, RCC_BDCR is write-protected (7.3.20).
    pub(crate) fn write(&mut self, offset: u32, value: u32, backup_writable: bool, lints: &mut Vec<LintKind>) {
        match offset {
            CR => self.write_cr(value, lints),
            PLLCFGR => self.write_pllcfgr(value, lints),
            CFGR => self.write_cfgr(value, lints),
            CIR => {
                self.cir = (self.cir & 0xFF) | (value & 0x3F00);
                // Bits 16 to 21 clear the ready flags, bit 23 the clock security flag.
                self.cir &= !(value >> 16 & 0xBF);
            }
            BDCR if !backup_writable => {
                if value != self.bdcr {
                    lints.push(LintKind::Misuse("RCC_BDCR is write-protected: set PWR_CR.DBP first"));
                }
            }
            BDCR => {
                const LSEON: u32 = 1;
                self.bdcr = if value & 1 << 16 != 0 { 1 << 16 } else { value & 0x8305 };
                if self.lse_works && self.bdcr & LSEON != 0 {
                    self.bdcr |= 2;
                }
            }
            CSR => {
                self.csr = (self.csr & !1) | (value & 1);
                if value & RMVF != 0 {
                    self.csr &= 0x00FF_FFFF;
                }
                self.update_lsi_ready();
            }
            DCKCFGR if value == 0 => {}
            _ => self.plain.write(offset, value, lints),
        }
    }

    /// 7.3.1: the oscillator that clocks the system cannot be switched off.
    fn write_cr(&mut self, value: u32, lints: &mut Vec<LintKind>) {
        let mut wanted = value & CR_WRITABLE;
        let source = self.source();
        let pll_from_hse = self.pllcfgr & PLLSRC_HSE != 0;
        let held = match source {
            SW_HSI => HSION,
            SW_HSE => HSEON,
            _ => PLLON | if pll_from_hse { HSEON } else { HSION },
        };
        if wanted & held != held {
            lints.push(LintKind::Misuse("the oscillator that clocks the system cannot be switched off"));
            wanted |= held;
        }
        if self.cr & HSEON != 0 && (wanted ^ self.cr) & HSEBYP != 0 {
            lints.push(LintKind::Misuse("HSEBYP can only be written while HSE is off"));
            wanted = (wanted & !HSEBYP) | (self.cr & HSEBYP);
        }
        if wanted & !self.cr & PLLON != 0 {
            self.check_pll(lints);
        }
        self.cr = wanted | (self.cr & (HSIRDY | HSERDY | PLLRDY | PLLI2SRDY));
        self.update_clocks();
    }

    /// 7.3.2: the PLL's factors can only be written while it is off.
    fn write_pllcfgr(&mut self, value: u32, lints: &mut Vec<LintKind>) {
        if self.cr & (PLLON | PLLI2SON) != 0 && value != self.pllcfgr {
            lints.push(LintKind::Misuse("RCC_PLLCFGR can only be written while the PLLs are off"));
            return;
        }
        self.pllcfgr = 0x2000_0000 | (value & 0x0F43_7FFF);
    }

    /// Limits of 7.3.2 and of the data sheet (table 35), when the PLL is switched on.
    fn check_pll(&self, lints: &mut Vec<LintKind>) {
        let (m, n) = (self.pllcfgr & 0x3F, self.pllcfgr >> 6 & 0x1FF);
        if m < 2 || !(50..=432).contains(&n) || self.pllcfgr >> 24 & 0xF < 2 {
            lints.push(LintKind::Misuse("a PLL factor is out of range: M 2 to 63, N 50 to 432, Q 2 to 15"));
            return;
        }
        let input = self.pll_source_hz() / f64::from(m);
        if !(0.95e6..=2.1e6).contains(&input) {
            lints.push(LintKind::Misuse("the PLL's input after M must lie between 0.95 and 2.1 MHz"));
        }
        if !(100e6..=432e6).contains(&(input * f64::from(n))) {
            lints.push(LintKind::Misuse("the PLL's VCO must run at 100 to 432 MHz"));
        }
    }

    fn write_cfgr(&mut self, value: u32, lints: &mut Vec<LintKind>) {
        if value & 3 == 3 {
            lints.push(LintKind::Misuse("RCC_CFGR.SW = 3 selects no clock: allowed is 0 (HSI), 1 (HSE), 2 (PLL)"));
        }
        self.cfgr = (value & 0xFFFF_FCF3) | (self.cfgr & 0xC);
        self.update_clocks();
    }

    /// Updates the ready flags and the clock switch from the oscillators that are on and working.
    fn update_clocks(&mut self) {
        let before = self.cr;
        let on = |bit: u32| self.cr & bit != 0;
        let hse = on(HSEON) && self.hse_works;
        let source = if self.pllcfgr & PLLSRC_HSE != 0 { hse } else { on(HSION) };
        let ready = [
            (HSIRDY, on(HSION)),
            (HSERDY, hse),
            (PLLRDY, on(PLLON) && source && self.pll_locked),
            (PLLI2SRDY, on(PLLI2SON) && source),
        ];
        for (bit, is_ready) in ready {
            self.cr = if is_ready { self.cr | bit } else { self.cr & !bit };
        }
        // 7.3.4: a ready flag is set when the clock becomes ready with its interrupt enabled.
        let risen = self.cr & !before;
        for (bit, flag) in [(HSIRDY, 2), (HSERDY, 3), (PLLRDY, 4), (PLLI2SRDY, 5)] {
            if risen & bit != 0 && self.cir & 1 << (flag + 8) != 0 {
                self.cir |= 1 << flag;
            }
        }
        let wanted = self.cfgr & 3;
        let available = match wanted {
            SW_HSI => self.cr & HSIRDY,
            SW_HSE => self.cr & HSERDY,
            SW_PLL => self.cr & PLLRDY,
            _ => 0,
        };
        if available != 0 {
            self.cfgr = (self.cfgr & !0xC) | wanted << 2;
        }
    }

    /// SWS: the present source of SYSCLK.
    fn source(&self) -> u32 {
        self.cfgr >> 2 & 3
    }

    fn pll_source_hz(&self) -> f64 {
        if self.pllcfgr & PLLSRC_HSE != 0 { self.hse_hz } else { f64::from(HSI_HZ) }
    }

    /// The present clock tree.
    pub(crate) fn clocks(&self) -> ClockTree {
        let sysclk = match self.source() {
            SW_HSE => self.hse_hz,
            SW_PLL => {
                let m = f64::from((self.pllcfgr & 0x3F).max(1));
                let n = f64::from(self.pllcfgr >> 6 & 0x1FF);
                let p = f64::from(((self.pllcfgr >> 16 & 3) + 1) * 2);
                // One division, so that 8 MHz * 168 / (4 * 2) is exact.
                self.pll_source_hz() * n / (m * p) * self.pll_factor
            }
            _ => f64::from(HSI_HZ),
        };
        // N = 0 makes a lint; at least 1 Hz keeps time advancing.
        let hclk = sysclk.max(1.0) / ahb_divider(self.cfgr >> 4) as f64;
        ClockTree { hclk, apb: [apb_divider(self.cfgr >> 10), apb_divider(self.cfgr >> 13)] }
    }

    /// PLLON.
    pub(crate) fn pll_on(&self) -> bool {
        self.cr & PLLON != 0
    }

    /// True while SYSCLK is stopped.
    pub(crate) fn stopped(&self) -> bool {
        self.stopped
    }

    pub(crate) fn enabled(&self, (bus, bit): (Bus, u8)) -> bool {
        let offset = match bus {
            Bus::Ahb1 => 0x30,
            Bus::Ahb2 => 0x34,
            Bus::Ahb3 => 0x38,
            Bus::Apb1 => 0x40,
            Bus::Apb2 => 0x44,
        };
        self.plain.value(offset).unwrap_or(0) >> bit & 1 != 0
    }

    pub(crate) fn in_reset(&self, (bus, bit): (Bus, u8)) -> bool {
        let offset = match bus {
            Bus::Ahb1 => 0x10,
            Bus::Ahb2 => 0x14,
            Bus::Ahb3 => 0x18,
            Bus::Apb1 => 0x20,
            Bus::Apb2 => 0x24,
        };
        self.plain.value(offset).unwrap_or(0) >> bit & 1 != 0
    }

    /// RCC global interrupt: a ready flag is set and enabled.
    pub(crate) fn interrupt(&self) -> bool {
        self.cir & self.cir >> 8 & 0x3F != 0
    }

    /// CSSF, which drives the core's NMI (7.2.7).
    pub(crate) fn nmi(&self) -> bool {
        self.cir & CSSF != 0
    }
}

#[cfg(test)]
mod tests;
