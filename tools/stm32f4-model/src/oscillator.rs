//! A clock whose periods are counted: LSI (RM0090 7.2.5), and the crystal after its prescaler, HSE_RTC (7.2.8).
//!
//! Its users keep times in its periods, not in seconds, so that a frequency that changes acts on what is under way.

/// The clock: the periods since power-on as a function of the time.
#[derive(Debug, Clone)]
pub(crate) struct Oscillator {
    hz: f64,
    /// Time of the last change of the frequency, s, and the periods until then.
    changed_s: f64,
    periods: f64,
}

impl Oscillator {
    /// An oscillator of this frequency, Hz; 0: it does not oscillate.
    pub(crate) fn new(hz: f64) -> Self {
        Oscillator { hz: valid(hz), changed_s: 0.0, periods: 0.0 }
    }

    /// Changes the frequency from now on, Hz.
    pub(crate) fn set(&mut self, hz: f64, seconds: f64) {
        *self = Oscillator { hz: valid(hz), changed_s: seconds, periods: self.periods(seconds) };
    }

    /// Its frequency, Hz; 0: it does not oscillate.
    pub(crate) fn hz(&self) -> f64 {
        self.hz
    }

    pub(crate) fn oscillates(&self) -> bool {
        self.hz > 0.0
    }

    /// Periods until a time, s.
    pub(crate) fn periods(&self, seconds: f64) -> f64 {
        self.periods + (seconds - self.changed_s) * self.hz
    }

    /// Time at which so many periods are over, s; infinite if it does not oscillate.
    pub(crate) fn time_of(&self, periods: f64) -> f64 {
        if self.oscillates() { self.changed_s + (periods - self.periods) / self.hz } else { f64::INFINITY }
    }
}

/// A frequency that is not finite, or negative, is 0.
fn valid(hz: f64) -> f64 {
    if hz.is_finite() { hz.max(0.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn periods_go_on_from_where_a_change_finds_them() {
        let mut clock = Oscillator::new(32_000.0);
        assert_eq!((clock.periods(0.5), clock.time_of(16_000.0)), (16_000.0, 0.5));
        clock.set(10_000.0, 0.5);
        assert_eq!((clock.periods(0.6), clock.time_of(17_000.0)), (17_000.0, 0.6));
        clock.set(0.0, 0.6);
        assert_eq!((clock.periods(9.0), clock.time_of(17_001.0), clock.oscillates()), (17_000.0, f64::INFINITY, false));
        clock.set(100_000.0, 9.0);
        assert!((clock.periods(9.1) - 27_000.0).abs() < 1e-6 && clock.oscillates());
    }

    #[test]
    fn no_frequency_makes_an_infinite_count() {
        for hz in [-1.0, f64::NAN, f64::INFINITY] {
            assert!(!Oscillator::new(hz).oscillates(), "{hz}");
        }
    }
}
