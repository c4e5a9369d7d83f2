//! Judges the clock of the board's watchdog, which the board measures: a condition of the board, not of a sensor.
//!
//! A watchdog has an oscillator of its own. One that is too slow resets a board that hangs too late, one that stands still never does, and one that is
//! too fast resets a board that works. The board works while this is found, so a motion stops by the ramp to the park pose.

use crate::control::supervisor::{Cause, Demand};

/// Slowest oscillator for which the board's watchdog resets in time, Hz: the least of the data sheets of the boards' chips.
pub const SLOWEST_HZ: u32 = 17_000;
/// Fastest oscillator for which it does not reset a board that works, Hz: the most of these data sheets.
pub const FASTEST_HZ: u32 = 47_000;
/// Error of a measurement that is accepted beyond these limits, in parts per thousand.
pub const TOLERANCE_PERMILLE: u32 = 3;

/// Measured frequency of the watchdog's oscillator, Hz; 0 if it stands still, or is too slow to be measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct WatchdogHz(pub u32);

impl WatchdogHz {
    /// Whether the watchdog is as fast as the board needs it: [`SLOWEST_HZ`] to [`FASTEST_HZ`], with the error of the measurement.
    ///
    /// ```
    /// use joint_loop::control::watchdog_clock::WatchdogHz;
    /// assert_eq!([17_000, 32_000, 47_000].map(|hz| WatchdogHz(hz).is_allowed()), [true; 3]);
    /// assert_eq!([0, 10_000, 60_000, 100_000].map(|hz| WatchdogHz(hz).is_allowed()), [false; 4]);
    /// ```
    #[must_use]
    pub const fn is_allowed(self) -> bool {
        let (least, most) =
            (SLOWEST_HZ / 1000 * (1000 - TOLERANCE_PERMILLE), FASTEST_HZ / 1000 * (1000 + TOLERANCE_PERMILLE));
        self.0 >= least && self.0 <= most
    }
}

/// The last measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct WatchdogClockState {
    last: Option<WatchdogHz>,
}

impl WatchdogClockState {
    /// Takes the measurement of a tick, if there is one. Where it is `required`, there must have been one.
    pub(crate) fn judge(&mut self, measured: Option<WatchdogHz>, required: bool) -> Demand {
        if measured.is_some() {
            self.last = measured;
        }
        let is_allowed = match self.last {
            Some(hz) => hz.is_allowed(),
            None => !required,
        };
        if is_allowed { Demand::Go } else { Demand::Stop(Cause::WatchdogClock) }
    }

    /// The last measurement, if it is not allowed.
    pub(crate) const fn wrong(self) -> Option<WatchdogHz> {
        match self.last {
            Some(hz) if !hz.is_allowed() => Some(hz),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 17 kHz less 0.3 %, 47 kHz and 0.3 % more.
    #[test]
    fn the_limits_are_exact() {
        let allowed = [16_948, 16_949, 47_141, 47_142].map(|hz| WatchdogHz(hz).is_allowed());
        assert_eq!(allowed, [false, true, true, false]);
    }

    #[test]
    fn the_last_measurement_counts() {
        let mut state = WatchdogClockState::default();
        let stop = Demand::Stop(Cause::WatchdogClock);
        let mut see = |hz: Option<u32>| (state.judge(hz.map(WatchdogHz), true), state.wrong());
        assert_eq!(see(None), (stop, None));
        assert_eq!(see(Some(32_000)), (Demand::Go, None));
        assert_eq!(see(None), (Demand::Go, None));
        for hz in [0, 16_900, 47_200] {
            assert_eq!(see(Some(hz)), (stop, Some(WatchdogHz(hz))));
            assert_eq!(see(None), (stop, Some(WatchdogHz(hz))));
        }
        assert_eq!(see(Some(17_000)), (Demand::Go, None));
        // A loop whose board has no watchdog.
        assert_eq!(WatchdogClockState::default().judge(None, false), Demand::Go);
        assert_eq!(WatchdogClockState::default().judge(Some(WatchdogHz(0)), false), stop);
    }
}
