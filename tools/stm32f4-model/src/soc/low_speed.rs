//! What LSI clocks: the timeout of the watchdog, and the captures of TIM5.

use super::Soc;

/// The timer whose channel 4 can capture LSI (RM0090 7.2.11).
const MEASURING: usize = 5;

impl Soc {
    /// Gives LSI another frequency from now on, Hz; 0 stops it. It stays also after a reset.
    pub fn set_lsi(&mut self, hz: f64) {
        self.lsi.set(hz, self.time.seconds(self.now));
        self.rcc.set_lsi_works(self.lsi.oscillates());
        self.schedule_low_speed();
        self.refresh();
    }

    /// Computes the cycles of the next events that depend on LSI, after a change of any clock or of a register.
    pub(super) fn schedule_low_speed(&mut self) {
        let is_frozen = self.halted && self.dbgmcu.stops_watchdog();
        let deadline = self.iwdg.deadline.filter(|_| !is_frozen);
        self.watchdog_at = deadline.map_or(u64::MAX, |periods| self.time.cycle_at(self.lsi.time_of(periods)));
        // 7.2.5: the watchdog forces LSI on.
        let edges = self.timers[MEASURING].captured_edges().filter(|_| self.rcc.lsi_on() || self.iwdg.started());
        self.capture = edges.map(|edges| {
            let next = || self.lsi.periods(self.time.seconds(self.now)).floor() + f64::from(edges);
            let periods = self.capture.map_or_else(next, |(periods, _)| periods);
            (periods, self.time.cycle_at(self.lsi.time_of(periods)))
        });
    }

    /// Cycle of the next capture; `u64::MAX`: none.
    pub(super) fn capture_at(&self) -> u64 {
        self.capture.map_or(u64::MAX, |(_, cycle)| cycle)
    }

    /// Carries out the capture that is due.
    pub(super) fn capture(&mut self) {
        let now = self.now;
        let signals = self.timers[MEASURING].run_to(now);
        self.pass_signals(MEASURING, signals);
        self.timers[MEASURING].capture();
        if let (Some((periods, _)), Some(edges)) = (self.capture, self.timers[MEASURING].captured_edges()) {
            self.capture = Some((periods + f64::from(edges), 0));
        }
        self.schedule_low_speed();
    }
}
