//! Faults of a converter: a lost result, a conversion without an end, bits that are stuck.

use super::Adc;

impl Adc {
    /// Makes the next regular result an overrun, if the mode detects overruns.
    pub(crate) fn force_overrun(&mut self) {
        self.overrun_forced = true;
    }

    /// Holds the conversion that runs, or the next one, without an end, or lets it end: no EOC, and triggers have no effect (13.3.5).
    pub(crate) fn hold(&mut self, is_held: bool) {
        self.is_held = is_held;
    }

    /// Makes bits of each result always 0, and others always 1.
    pub(crate) fn set_stuck_bits(&mut self, low: u16, high: u16) {
        self.stuck = (low & 0xFFF, high & 0xFFF);
    }

    /// The state after a reset. What is broken stays so.
    pub(crate) fn reset(&mut self) {
        *self = Adc { is_held: self.is_held, stuck: self.stuck, ..Adc::new(self.index) };
    }
}
