//! From a channel's reference level OCxREF to its pins: polarity, enables, idle state, break (RM0090 17.3.11, 17.3.12, table 94).

use super::{BIF, BKE, BKP, MOE, OSSI, OSSR, Timer};

/// A channel's four enable and polarity bits in CCER.
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
        !self.kind.advanced || self.bdtr & MOE != 0
    }

    /// Channels that drive a pin with their reference level now.
    pub(super) fn driving_channels(&self) -> u8 {
        if !self.main_outputs_enabled() {
            return 0;
        }
        self.channels_where(|timer, channel| timer.ccer >> (channel * 4) & 5 != 0)
    }

    /// Level that the timer drives on OCx, or OCxN; `None`: the pin is let go (table 94).
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
        self.kind.advanced && self.bdtr & BKE != 0 && (input || self.clock_failed)
    }

    /// Level of the BKIN pin; `None`: no pin carries it. Acts without a clock.
    pub(crate) fn set_break_level(&mut self, level: Option<bool>) {
        self.break_level = level;
        self.apply_break();
    }

    /// The clock security system reports that HSE has failed: a break as long as the failure lasts.
    pub(crate) fn set_clock_failed(&mut self, failed: bool) {
        self.clock_failed = failed;
        self.apply_break();
    }

    /// True where BKE is set without a pin that carries BKIN.
    pub(crate) fn break_without_pin(&self) -> bool {
        self.kind.advanced && self.bdtr & BKE != 0 && self.break_level.is_none()
    }

    /// The break acts on the level: while it is active MOE cannot be set, nor BIF cleared.
    pub(super) fn apply_break(&mut self) {
        if self.break_active() {
            self.brk();
        }
        self.refresh();
    }

    /// A break event: MOE falls at once, BIF is set.
    pub(super) fn brk(&mut self) {
        self.bdtr &= !MOE;
        self.sr |= BIF;
    }
}
