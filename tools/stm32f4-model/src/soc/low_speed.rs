//! What LSI clocks: the timeout of the watchdog; and the timers that measure a clock by captures (RM0090 7.2.11).

use super::Soc;
use crate::measured_clock::{Capture, MEASURED, Measured};
use crate::oscillator::Oscillator;

impl Soc {
    /// Gives LSI another frequency from now on, Hz; 0 stops it. It stays also after a reset.
    pub fn set_lsi(&mut self, hz: f64) {
        self.lsi.set(hz, self.time.seconds(self.now));
        self.rcc.set_lsi_works(self.lsi.oscillates());
        self.schedule_low_speed();
        self.refresh();
    }

    /// Frequency of LSI, Hz.
    #[must_use]
    pub fn lsi_hz(&self) -> f64 {
        self.lsi.hz()
    }

    /// Computes the cycles of the next events that depend on a measured clock, after a change of any clock or of a register.
    pub(super) fn schedule_low_speed(&mut self) {
        let is_frozen = self.halted && self.dbgmcu.stops_watchdog();
        let deadline = self.iwdg.deadline.filter(|_| !is_frozen);
        self.watchdog_at = deadline.map_or(u64::MAX, |periods| self.time.cycle_at(self.lsi.time_of(periods)));
        let seconds = self.time.seconds(self.now);
        let hse_rtc_hz = self.rcc.hse_rtc_hz();
        if self.hse_rtc.hz() != hse_rtc_hz {
            self.hse_rtc.set(hse_rtc_hz, seconds);
        }
        for (index, (clock, timer)) in MEASURED.into_iter().enumerate() {
            let oscillator = self.oscillator(clock);
            let capture = self.timers[timer].captured_edges().filter(|_| self.is_on(clock)).map(|edges| {
                let next = || oscillator.periods(seconds).floor() + f64::from(edges);
                let periods = self.captures[index].map_or_else(next, |capture| capture.periods);
                Capture { periods, at: self.time.cycle_at(oscillator.time_of(periods)) }
            });
            self.captures[index] = capture;
        }
    }

    fn oscillator(&self, clock: Measured) -> &Oscillator {
        match clock {
            Measured::Lsi => &self.lsi,
            Measured::HseRtc => &self.hse_rtc,
        }
    }

    fn is_on(&self, clock: Measured) -> bool {
        match clock {
            // 7.2.5: the watchdog forces it on.
            Measured::Lsi => self.rcc.lsi_on() || self.iwdg.started(),
            Measured::HseRtc => self.hse_rtc.oscillates(),
        }
    }

    /// Cycle of the next capture; `u64::MAX`: none.
    pub(super) fn capture_at(&self) -> u64 {
        self.captures.iter().flatten().map(|capture| capture.at).min().unwrap_or(u64::MAX)
    }

    /// Carries out the captures that are due.
    pub(super) fn capture(&mut self) {
        let now = self.now;
        for (index, (_, timer)) in MEASURED.into_iter().enumerate() {
            let Some(capture) = self.captures[index].filter(|capture| capture.at <= now) else { continue };
            let signals = self.timers[timer].run_to(now);
            self.pass_signals(timer, signals);
            self.timers[timer].capture();
            if let Some(edges) = self.timers[timer].captured_edges() {
                self.captures[index] = Some(Capture { periods: capture.periods + f64::from(edges), at: u64::MAX });
            }
        }
        self.schedule_low_speed();
    }
}
