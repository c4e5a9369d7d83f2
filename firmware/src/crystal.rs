//! The arithmetic of measuring the crystal against the chip's own oscillator: a timer that counts HSI captures edges of HSE divided by 31.
//!
//! The chip has this connection for this purpose: to find a crystal of a harmonic or subharmonic frequency (RM0090 7.2.11).

use core::fmt;
use core::ops::RangeInclusive;

/// Frequency of HSI, which the chip starts with, Hz.
pub const HSI_HZ: u32 = 16_000_000;

/// Divider of HSE for the measurement: the largest, so that there is time between two captures.
pub const HSE_DIVIDER: u8 = 31;

/// Edges from one capture to the next: the prescaler of the timer's input.
pub const EDGES_A_CAPTURE: u32 = 8;

/// Intervals between captures that make a measurement: 0.25 ms at 8 MHz, which the timer's 16 bits hold down to 0.5 MHz.
pub const INTERVALS: u32 = 8;

/// Counts of HSI after which a measurement has found no crystal.
pub const TIMEOUT_COUNTS: u32 = 160_000;

const PERIODS: u32 = HSE_DIVIDER as u32 * EDGES_A_CAPTURE * INTERVALS;

/// Error of HSI from -40 to 105 degrees, permille of its frequency: -8 % to 4.5 %, as the data sheet of the STM32F405 and F407 has it in the table of
/// HSI's characteristics. Where another chip is off by more, a good crystal may be refused at an extreme temperature, never a wrong one taken.
const HSI_ERROR_PERMILLE: RangeInclusive<i32> = -80..=45;

/// A measurement may be off by so much more: two captures, each with an error of a count, and the tolerance of a crystal.
const MARGIN_PERMILLE: i32 = 5;

/// A frequency of HSE by the chip's own oscillator, Hz; off by as much as that is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MeasuredHse(pub u32);

impl MeasuredHse {
    /// The measurement whose [`INTERVALS`] took so many counts of HSI; 0 Hz for none.
    ///
    /// ```
    /// use firmware::crystal::MeasuredHse;
    /// assert_eq!([3_968, 1_270, 0].map(MeasuredHse::of), [8_000_000, 24_995_275, 0].map(MeasuredHse));
    /// ```
    #[must_use]
    pub fn of(counts: u16) -> Self {
        let hz = (u64::from(PERIODS) * u64::from(HSI_HZ)).checked_div(counts.into()).unwrap_or(0);
        // At most 2^35 by one count, which no interval of eight captures is.
        Self(u32::try_from(hz).unwrap_or(u32::MAX))
    }

    /// Whether it can be a crystal of the nominal frequency, Hz: one that is within what HSI may be off.
    ///
    /// ```
    /// use firmware::crystal::MeasuredHse;
    /// assert!(MeasuredHse(8_300_000).can_be(8_000_000) && !MeasuredHse(25_000_000).can_be(8_000_000));
    /// ```
    #[must_use]
    pub fn can_be(self, nominal_hz: u32) -> bool {
        allowed(nominal_hz).contains(&self.0)
    }
}

/// In megahertz.
impl fmt::Display for MeasuredHse {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        megahertz(self.0, f)
    }
}

/// The frequencies that a crystal of the nominal frequency is measured at, Hz. An oscillator that is slow measures a crystal that is fast.
#[must_use]
pub fn allowed(nominal_hz: u32) -> RangeInclusive<u32> {
    let by_hsi = |permille: i32, margin: i32| {
        let ratio = 1_000_000 / (1_000 + i64::from(permille)) + i64::from(margin);
        // At most a tenth more than a frequency of 32 bits that a crystal has.
        u32::try_from(i64::from(nominal_hz) * ratio / 1_000).unwrap_or(u32::MAX)
    };
    by_hsi(*HSI_ERROR_PERMILLE.end(), -MARGIN_PERMILLE)..=by_hsi(*HSI_ERROR_PERMILLE.start(), MARGIN_PERMILLE)
}

/// Why the clock cannot be started from HSE.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HseFault {
    /// It did not become ready.
    NotReady,
    /// It has another frequency than the program is for.
    Frequency {
        /// What was measured.
        measured: MeasuredHse,
        /// What the program is for, Hz.
        nominal_hz: u32,
    },
}

impl fmt::Display for HseFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotReady => {
                f.write_str("the clock HSE did not start: check the crystal or its solder bridge, then reset")
            }
            Self::Frequency { measured, nominal_hz } => {
                let range = allowed(*nominal_hz);
                write!(f, "the clock HSE has {measured} MHz by the chip's own oscillator; allowed is ")?;
                megahertz(*range.start(), f)?;
                f.write_str(" to ")?;
                megahertz(*range.end(), f)?;
                f.write_str(" MHz: is this image for another board?")
            }
        }
    }
}

/// A frequency in megahertz, with two decimals.
fn megahertz(hz: u32, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    write!(f, "{}.{:02}", hz / 1_000_000, hz % 1_000_000 / 10_000)
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOMINAL_HZ: u32 = 8_000_000;
    /// Of the Black Pill.
    const OTHER_NOMINAL_HZ: u32 = 25_000_000;

    /// The counts of a crystal by an HSI that is off by so many parts, with the timer's phase.
    fn counts(hse_hz: f64, hsi_error: f64, phase: f64) -> u16 {
        let span = f64::from(PERIODS) / hse_hz * f64::from(HSI_HZ) * (1.0 + hsi_error);
        (phase + span).floor() as u16
    }

    #[test]
    fn a_good_crystal_is_allowed_over_all_errors_of_hsi() {
        for error in 0..=125 {
            let error = -0.08 + f64::from(error) * 1e-3;
            for ppm in [-500.0, 0.0, 500.0] {
                for (phase, hz) in
                    [0.0, 0.5, 0.999].into_iter().flat_map(|phase| [NOMINAL_HZ, OTHER_NOMINAL_HZ].map(|hz| (phase, hz)))
                {
                    let measured = MeasuredHse::of(counts(f64::from(hz) * (1.0 + ppm * 1e-6), error, phase));
                    assert!(measured.can_be(hz), "{measured} MHz at {error}");
                }
            }
        }
    }

    /// With an HSI at its nominal frequency a crystal is refused from 6 % too slow and 10 % too fast on. Common crystals are further away.
    #[test]
    fn other_crystals_are_refused_over_all_errors_of_hsi() {
        for hse_hz in [4e6, 6e6, 12e6, 16e6, 24e6, 25e6, 26e6] {
            for error in [-0.08, 0.0, 0.045] {
                let measured = MeasuredHse::of(counts(hse_hz, error, 0.5));
                assert!(!measured.can_be(NOMINAL_HZ), "{measured} MHz, {hse_hz} Hz at {error}");
            }
        }
        for hse_hz in [8e6, 12e6, 16e6, 20e6, 30e6] {
            for error in [-0.08, 0.0, 0.045] {
                let measured = MeasuredHse::of(counts(hse_hz, error, 0.5));
                assert!(!measured.can_be(OTHER_NOMINAL_HZ), "{measured} MHz, {hse_hz} Hz at {error}");
            }
        }
        for (hse_hz, is_allowed) in [(7.5e6, false), (7.65e6, true), (8.7e6, true), (8.8e6, false), (7.3728e6, false)] {
            assert_eq!(MeasuredHse::of(counts(hse_hz, 0.0, 0.5)).can_be(NOMINAL_HZ), is_allowed, "{hse_hz} Hz");
        }
    }

    #[test]
    fn the_reason_has_both_frequencies() {
        let fault = HseFault::Frequency { measured: MeasuredHse::of(1_270), nominal_hz: NOMINAL_HZ };
        let expected = "the clock HSE has 24.99 MHz by the chip's own oscillator; allowed is 7.60 to 8.72 MHz: is this image for another board?";
        assert_eq!(fault.to_string(), expected);
    }
}
