//! The arithmetic of measuring the watchdog's oscillator: a timer that counts microseconds captures its edges.

use joint_loop::WatchdogHz;
use joint_loop::control::watchdog_clock::{FASTEST_HZ, TOLERANCE_PERMILLE};

/// Edges from one capture to the next: the prescaler of the timer's input.
pub const EDGES_A_CAPTURE: u32 = 8;

/// Intervals between captures that make a measurement.
pub const INTERVALS: u32 = 4;

/// A measurement that takes longer has found no oscillator, us: one of less than 6 kHz.
pub const TIMEOUT_US: u32 = 8_000;

/// Time from one measurement to the next, s.
pub const MEASURED_EVERY_S: u32 = 60;

const PERIODS: u32 = EDGES_A_CAPTURE * INTERVALS;

/// Each end of the span is captured with an error of less than this, us.
const ERROR_US: u32 = 1;
const _: () = assert!(
    2 * ERROR_US * 1_000 <= PERIODS * 1_000_000 / FASTEST_HZ * TOLERANCE_PERMILLE,
    "the tolerance of the loop is more than the error of a measurement"
);

/// Frequency of an oscillator whose [`INTERVALS`] take so long, rounded; 0 for no time.
///
/// ```
/// use firmware_shared::oscillator::frequency;
/// use joint_loop::WatchdogHz;
/// assert_eq!([1_000, 680, 0].map(frequency), [WatchdogHz(32_000), WatchdogHz(47_059), WatchdogHz(0)]);
/// ```
#[must_use]
pub fn frequency(span_us: u32) -> WatchdogHz {
    WatchdogHz((PERIODS * 1_000_000 + span_us / 2).checked_div(span_us).unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use joint_loop::control::watchdog_clock::SLOWEST_HZ;

    /// Whatever the phase of the oscillator to the timer.
    #[test]
    fn what_the_data_sheet_allows_is_allowed_and_nothing_far_from_it() {
        let measured = |hz: u32, phase: f64| {
            let count = |periods: f64| (phase + periods * 1e6 / f64::from(hz)).floor() as u32;
            frequency(count(f64::from(PERIODS)) - count(0.0))
        };
        for step in 0..1_000 {
            let phase = f64::from(step) / 1_000.0;
            for hz in [SLOWEST_HZ, 32_000, FASTEST_HZ] {
                assert!(measured(hz, phase).is_allowed(), "{hz} Hz");
            }
            for hz in [10_000, SLOWEST_HZ - 100, FASTEST_HZ + 300, 60_000, 100_000] {
                assert!(!measured(hz, phase).is_allowed(), "{hz} Hz");
            }
        }
    }
}
