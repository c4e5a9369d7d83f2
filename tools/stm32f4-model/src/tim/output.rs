//! Timer outputs: from the reference level OCxREF of a channel to its pins by polarity, enables, idle state and break (RM0090 17.3.11,
//! 17.3.12, table 94).

use super::Timer;
use super::bits::{BIF, BKE, BKP, MOE, OSSI, OSSR};

/// Enable and polarity bits of a channel in CCER.
struct Enables {
    main: bool,
    main_inverted: bool,
    complementary: bool,
    complementary_inverted: bool,
}

impl Timer {
    fn enables(&self, channel: u8) -> Enables {
        let bits = self.ccer >> (channel * 4);
        Enables {
            main: bits & 1 != 0,
            main_inverted: bits & 2 != 0,
            complementary: bits & 4 != 0,
            complementary_inverted: bits & 8 != 0,
        }
    }

    fn main_outputs_enabled(&self) -> bool {
        !self.features.advanced || self.bdtr & MOE != 0
    }

    /// Channels that drive a pin with their reference level, one bit each.
    pub(super) fn driving_channels(&self) -> u8 {
        if !self.main_outputs_enabled() {
            return 0;
        }
        self.channels_where(|timer, channel| timer.ccer >> (channel * 4) & 5 != 0)
    }

    /// Level that the timer drives on OCx, or on OCxN if `complementary`; `None`: it does not drive the pin (table 94).
    pub(crate) fn output(&self, channel: u8, complementary: bool) -> Option<bool> {
        let enables = self.enables(channel);
        let reference = self.reference >> channel & 1 != 0;
        let any = enables.main || enables.complementary;
        if self.is_input(usize::from(channel)) {
            return None;
        }
        if !self.main_outputs_enabled() {
            // MOE = 0: the idle level of CR2, if OSSI holds the pins of enabled channels.
            let idle = self.cr2 >> (8 + channel * 2 + u8::from(complementary)) & 1 != 0;
            return (self.bdtr & OSSI != 0 && any).then_some(idle);
        }
        // MOE = 1: an output that is off is held inactive by OSSR if its partner is on.
        let held = self.bdtr & OSSR != 0 && any;
        if complementary {
            match enables.complementary {
                // With both on, OCxN is the complement of the reference; alone it is the reference.
                true => Some((reference ^ enables.main) ^ enables.complementary_inverted),
                false => held.then_some(enables.complementary_inverted),
            }
        } else {
            match enables.main {
                true => Some(reference ^ enables.main_inverted),
                false => held.then_some(enables.main_inverted),
            }
        }
    }

    /// True while the break input, or a clock failure, forces the outputs off: BKE with the input at its active level (17.3.12).
    pub(super) fn break_active(&self) -> bool {
        let input = self.break_level == Some(self.bdtr & BKP != 0);
        self.features.advanced && self.bdtr & BKE != 0 && (input || self.clock_failed)
    }

    /// Sets the level at BKIN; `None`: no pin is connected to it. The break needs no clock.
    pub(crate) fn set_break_level(&mut self, level: Option<bool>) {
        self.break_level = level;
        self.apply_break();
    }

    /// Sets the clock failure signal of the clock security system: a break for as long as it is true.
    pub(crate) fn set_clock_failed(&mut self, failed: bool) {
        self.clock_failed = failed;
        self.apply_break();
    }

    /// True if BKE is set but no pin is connected to BKIN.
    pub(crate) fn break_without_pin(&self) -> bool {
        self.features.advanced && self.bdtr & BKE != 0 && self.break_level.is_none()
    }

    /// Applies the break. It acts on the level: while it is active MOE cannot be set and BIF cannot be cleared.
    pub(super) fn apply_break(&mut self) {
        if self.break_active() {
            self.trip_break();
        }
        self.refresh();
    }

    /// Performs a break event: clears MOE and sets BIF.
    pub(super) fn trip_break(&mut self) {
        self.bdtr &= !MOE;
        self.sr |= BIF;
    }
}
