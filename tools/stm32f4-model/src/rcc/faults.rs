//! Faults of the oscillators: a crystal that stops or has another frequency, a PLL that loses its lock (RM0090 7.2.1, 7.2.3, 7.2.7).

use super::{CSSF, CSSON, HSEON, HSERDY, HSION, PLLON, PLLSRC_HSE, Rcc, SW_HSE, SW_PLL};

/// Effect of a crystal failure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum HseFailure {
    /// No running clock depended on it.
    Unused,
    /// The clock security system acted: NMI, timer break, SYSCLK from HSI.
    Secured,
    /// SYSCLK has stopped.
    ClockStopped,
}

impl Rcc {
    /// Stops the crystal permanently.
    pub(crate) fn fail_hse(&mut self) -> HseFailure {
        self.hse_works = false;
        let was_ready = self.cr & HSERDY != 0;
        let drives_sysclk = match self.source() {
            SW_HSE => true,
            SW_PLL => self.pllcfgr & PLLSRC_HSE != 0,
            _ => false,
        };
        let secured = was_ready && self.cr & CSSON != 0;
        if secured {
            // 7.2.7: HSE is switched off, and the PLL too if HSE was its source and it clocked the system; SYSCLK comes from HSI.
            self.cr &= !HSEON;
            self.cir |= CSSF;
            if drives_sysclk {
                self.cr |= HSION;
                self.cfgr &= !3;
                self.cr &= !PLLON;
            }
        }
        self.update_clocks();
        match (secured, drives_sysclk) {
            (true, _) => HseFailure::Secured,
            (false, true) => {
                self.stopped = true;
                HseFailure::ClockStopped
            }
            (false, false) => HseFailure::Unused,
        }
    }

    /// Gives the crystal another frequency, Hz. The clock security system does not act: it only finds a crystal that stops (7.2.7).
    pub(crate) fn set_hse_hz(&mut self, hz: f64) {
        self.hse_hz = hz;
    }

    /// Frequency of the crystal, Hz.
    pub(crate) fn hse_hz(&self) -> f64 {
        self.hse_hz
    }

    /// Makes the PLL lose its lock: its output has this part of its frequency, 0 stops it; 1 locks it again. PLLRDY is 0 meanwhile (7.3.1). No
    /// manual states the frequency of an unlocked PLL; the clock security system does not act on one (7.2.7).
    pub(crate) fn set_pll_factor(&mut self, factor: f64) {
        self.pll_locked = factor == 1.0;
        if factor > 0.0 {
            // A clock that stands still keeps its last frequency for the count of cycles.
            self.pll_factor = factor;
        }
        self.update_clocks();
        if self.source() == SW_PLL {
            self.stopped = factor == 0.0;
        }
    }
}
