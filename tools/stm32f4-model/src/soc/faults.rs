//! What a caller can break: crystal, PLL, supply, reset pin, converter, transfers, flash.

use super::Soc;
use crate::bus::Width;
use crate::memory_map::{Model, locate};
use crate::reset::ResetCause;

/// Write protection that [`Soc::flip_bits`] restores.
enum Protection {
    /// BDTR.LOCK of a timer, and whether it was written.
    Lock((u32, bool)),
    /// Whether streams of a DMA controller were unprotected.
    Streams(bool),
    /// Whether the registers of the watchdog were.
    Key(bool),
}

impl Soc {
    /// Changes bits of a register as an electrical disturbance does: no lock and no write protection keeps them (BDTR.LOCK, a DMA stream that is on,
    /// the keys of the watchdog). Otherwise it acts as a write of the changed word. False: the model did not take the bits, because the register is
    /// read only, has no clock or no such bits.
    #[must_use]
    pub fn flip_bits(&mut self, addr: u32, mask: u32) -> bool {
        let before = self.read(addr, Width::Word);
        let protection = self.lift_protection(addr);
        self.write(addr, Width::Word, before ^ mask);
        if let Some(protection) = protection {
            self.restore_protection(addr, protection);
        }
        self.read(addr, Width::Word) == before ^ mask
    }

    /// Takes the write protection of a register away, if its block has one; returns what restores it.
    fn lift_protection(&mut self, addr: u32) -> Option<Protection> {
        match locate(addr)?.0.model {
            Model::Tim(number) => Some(Protection::Lock(self.timers[number].unlock())),
            Model::Dma(index) => Some(Protection::Streams(self.dma[index].unprotect(true))),
            Model::Iwdg => Some(Protection::Key(self.iwdg.unprotect(true))),
            _ => None,
        }
    }

    fn restore_protection(&mut self, addr: u32, protection: Protection) {
        match (locate(addr).map(|(block, _)| block.model), protection) {
            (Some(Model::Tim(number)), Protection::Lock(lock)) => {
                self.timers[number]
                    .lock_as(lock, locate(addr).is_some_and(|(_, offset)| offset == crate::tim::bits::BDTR));
            }
            (Some(Model::Dma(index)), Protection::Streams(was)) => {
                self.dma[index].unprotect(was);
            }
            (Some(Model::Iwdg), Protection::Key(was)) => {
                self.iwdg.unprotect(was);
            }
            _ => {}
        }
    }

    /// Stops the crystal permanently, also after a reset.
    pub fn fail_hse(&mut self) {
        self.change_clock(|soc| {
            soc.rcc.fail_hse();
        });
    }

    /// Gives the crystal another frequency, Hz, greater than 0. All that it clocks follows: PLL, core, timers, converter.
    pub fn set_hse_hz(&mut self, hz: f64) {
        self.change_clock(|soc| soc.rcc.set_hse_hz(hz));
    }

    /// Frequency of the crystal, Hz.
    #[must_use]
    pub fn hse_hz(&self) -> f64 {
        self.rcc.hse_hz()
    }

    /// Makes the PLL lose its lock, with this part of its frequency at its output; 0: it stops; 1: it is locked.
    pub fn set_pll_factor(&mut self, factor: f64) {
        self.change_clock(|soc| soc.rcc.set_pll_factor(factor));
    }

    fn change_clock(&mut self, change: impl FnOnce(&mut Self)) {
        let cycle = self.now;
        for timer in &mut self.timers {
            // Signals up to the present cycle were routed by the last advance.
            let _ = timer.run_to(cycle);
        }
        change(self);
        self.apply_clock_tree();
        self.refresh();
    }

    /// Changes the supply of the chip, V. Below the level of the brown-out reset it resets, and is held in reset until the supply is back; the voltage
    /// detector follows (RM0090 5.2).
    pub fn set_supply(&mut self, volts: f64) {
        let seconds = self.time.seconds(self.now);
        self.reset_request = self.supply.set_volts(volts, self.flash.bor_level(), seconds).or(self.reset_request);
        self.update_voltage_detector();
        self.schedule_release();
        self.refresh();
    }

    /// Pulls the reset pin NRST low, or releases it.
    pub fn pull_reset_pin(&mut self, low: bool) {
        self.reset_request = self.supply.pull_pin(low).or(self.reset_request);
        self.schedule_release();
        self.refresh();
    }

    /// Switches the power off and on again: the chip resets.
    pub fn cycle_power(&mut self) {
        self.reset_request = Some(ResetCause::PowerOn);
        self.refresh();
    }

    /// Updates PVDO and the edge of EXTI line 16 (5.2.3, 12.2.5).
    pub(super) fn update_voltage_detector(&mut self) {
        const LINE: u32 = 1 << 16;
        let (enabled, pls) = self.pwr.voltage_detector();
        let is_low = self.supply.detect(enabled, pls);
        let was_low = std::mem::replace(&mut self.pwr.supply_is_low, is_low);
        if is_low != was_low {
            // The line rises when the supply falls below the threshold.
            let (rising, falling) = if is_low { (LINE, 0) } else { (0, LINE) };
            self.exti.edges(rising, falling);
        }
    }

    pub(super) fn schedule_release(&mut self) {
        let until = self.supply.held_until();
        let later = until.is_finite() && until > self.time.seconds(self.now);
        self.released_at = if later { self.time.cycle_at(until) } else { u64::MAX };
    }

    pub(super) fn schedule_flash_end(&mut self) {
        self.flash_at = self.flash.ends_at().map_or(u64::MAX, |seconds| self.time.cycle_at(seconds).max(self.now));
    }

    /// Stores to an address of the flash, as the core or a debugger does (RM0090 3.6.4). What becomes of it is in [`Soc::take_flash_operations`].
    pub fn store_to_flash(&mut self, address: u32, width: Width, value: u32) {
        let seconds = self.time.seconds(self.now);
        self.flash.store(address, width, value, seconds);
        self.schedule_flash_end();
        self.refresh();
    }

    /// Makes the next regular conversion of a converter (0 to 2) an overrun, as if its last result had not been read in time.
    pub fn force_overrun(&mut self, index: usize) {
        if let Some(adc) = self.adcs.get_mut(index) {
            adc.force_overrun();
        }
    }

    /// Holds the conversions of a converter (0 to 2) without an end, or lets them end.
    pub fn hold_conversions(&mut self, index: usize, are_held: bool) {
        if let Some(adc) = self.adcs.get_mut(index) {
            adc.hold(are_held);
            self.refresh();
        }
    }

    /// Makes bits of each result of a converter (0 to 2) always 0, and others always 1; also after a reset.
    pub fn set_stuck_bits(&mut self, index: usize, low: u16, high: u16) {
        if let Some(adc) = self.adcs.get_mut(index) {
            adc.set_stuck_bits(low, high);
        }
    }

    /// Makes the next transfer of a stream (0 to 7) of a DMA controller (0 or 1) fail with a transfer error.
    pub fn fail_next_transfer(&mut self, controller: usize, stream: usize) {
        if let Some(dma) = self.dma.get_mut(controller).filter(|_| stream < 8) {
            dma.fail_next_transfer(stream);
        }
    }

    /// Stops serving the requests of a stream (0 to 7) of a DMA controller (0 or 1), or serves them again. A reset ends it.
    pub fn stall_stream(&mut self, controller: usize, stream: usize, is_stalled: bool) {
        if let Some(dma) = self.dma.get_mut(controller).filter(|_| stream < 8) {
            dma.stall(stream, is_stalled);
            // A request that waits is served with the next advance.
            self.is_settled = false;
        }
    }

    /// Makes a stream (0 to 7) of a DMA controller (0 or 1) take its next request without a transfer: an item is lost, without an overrun.
    pub fn lose_next_request(&mut self, controller: usize, stream: usize) {
        if let Some(dma) = self.dma.get_mut(controller).filter(|_| stream < 8) {
            dma.lose_next_request(stream);
        }
    }
}
