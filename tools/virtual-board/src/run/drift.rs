//! A frequency that changes evenly.

/// An oscillator whose frequency can change evenly.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Oscillator {
    /// The crystal.
    Crystal,
    /// The low speed oscillator, which clocks the watchdog.
    LowSpeed,
}

/// A frequency that changes evenly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Drift {
    /// Whose frequency it is.
    pub(super) of: Oscillator,
    /// Beginning and end, s.
    pub(super) from_s: f64,
    pub(super) until_s: f64,
    /// Frequency at the beginning and at the end, Hz.
    pub(super) from_hz: f64,
    pub(super) to_hz: f64,
}

impl Drift {
    pub(super) fn hz_at(&self, seconds: f64) -> f64 {
        let part = ((seconds - self.from_s) / (self.until_s - self.from_s)).clamp(0.0, 1.0);
        self.from_hz + (self.to_hz - self.from_hz) * part
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drift_is_even_and_stays_at_its_end() {
        let drift = Drift { of: Oscillator::Crystal, from_s: 1.0, until_s: 3.0, from_hz: 8e6, to_hz: 9e6 };
        assert_eq!([0.5, 1.0, 2.0, 3.0, 4.0].map(|t| drift.hz_at(t)), [8e6, 8e6, 8.5e6, 9e6, 9e6]);
    }
}
