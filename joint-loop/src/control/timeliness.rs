//! Watches whether the ticks come, begin and end in time.
//!
//! A tick that is late writes its pulse widths late; one that is missed does not write any. A few of either do no harm, because a servo frame is
//! twenty ticks long. A processor that is slower than it should be makes many of them.

use crate::control::burst::Burst;
use crate::control::supervisor::{Cause, Demand};

/// Ticks among which late ones are counted.
pub const LATE_WINDOW: u32 = 100;
const WINDOW_BITS: u128 = (1 << LATE_WINDOW) - 1;

/// Limits, checked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Timeliness {
    /// Late ticks of the last [`LATE_WINDOW`] that do not stop the motion.
    pub(crate) late: u32,
    /// Missed periods of a second that are no fault.
    pub(crate) missed: u32,
    /// A second, in periods.
    pub(crate) second: u32,
}

/// The last ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct TimelinessState {
    /// Late ticks, one bit each; bit 0 is the last one.
    late: u128,
    missed: Burst,
}

impl Timeliness {
    /// Takes a tick, and whether it was late; `elapsed` is the number of periods since the one before.
    pub(crate) fn judge(&self, state: &mut TimelinessState, late: bool, elapsed: u32) -> Demand {
        state.late = (state.late << 1 | u128::from(late)) & WINDOW_BITS;
        if state.missed.note(elapsed.saturating_sub(1), elapsed, self.second) > self.missed {
            Demand::Fault(Cause::Gap)
        } else if state.late.count_ones() > self.late {
            Demand::Stop(Cause::Late)
        } else {
            Demand::Go
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Timeliness = Timeliness { late: 5, missed: 9, second: 1_000 };

    /// The demand after each of these ticks: late or not, elapsed periods.
    fn demands(ticks: impl IntoIterator<Item = (bool, u32)>) -> Vec<Demand> {
        let mut state = TimelinessState::default();
        ticks.into_iter().map(|(late, elapsed)| LIMITS.judge(&mut state, late, elapsed)).collect()
    }

    #[test]
    fn the_sixth_late_tick_of_a_hundred_stops() {
        let every = |nth: u32| demands((0..1_000).map(|tick| (tick % nth == 0, 1)));
        assert!(every(20).iter().all(|demand| *demand == Demand::Go));
        assert_eq!(every(19)[94..96], [Demand::Go, Demand::Stop(Cause::Late)]);
        // Six in a row stop until 95 ticks after the last of them.
        let row = demands((0..300).map(|tick| (tick < 6, 1)));
        let stops: Vec<_> = (0..300).filter(|&tick| row[tick] != Demand::Go).collect();
        assert_eq!(stops, (5..100).collect::<Vec<_>>());
    }

    /// The bits against the ticks themselves, over rare and frequent late ticks.
    #[test]
    fn the_bits_are_the_last_hundred_ticks() {
        for nth in 2..400_u32 {
            let late: Vec<bool> = (0..2_000_u32).map(|tick| tick.wrapping_mul(2_654_435_761) % nth == 0).collect();
            let mut state = TimelinessState::default();
            for (tick, is_late) in late.iter().enumerate() {
                LIMITS.judge(&mut state, *is_late, 1);
                let window = &late[(tick + 1).saturating_sub(LATE_WINDOW as usize)..=tick];
                let count = window.iter().filter(|late| **late).count() as u32;
                assert_eq!(state.late.count_ones(), count, "one in {nth}, tick {tick}");
            }
        }
    }

    #[test]
    fn the_tenth_missed_period_of_a_second_is_a_fault() {
        let fault = Demand::Fault(Cause::Gap);
        assert_eq!(demands([(false, 10)]), [Demand::Go]);
        assert_eq!(demands([(false, 11)]), [fault]);
        // One in 112 ms is nine in a second; one in 100 ms is ten.
        let every = |nth: u32| demands((0..10_000).map(|tick| (false, if tick % nth == 0 { 2 } else { 1 })));
        assert!(every(112).iter().all(|demand| *demand == Demand::Go));
        assert!(every(100).contains(&fault));
        // Two of five lost.
        let lost = demands((0..100).map(|tick| (false, if tick % 3 == 0 { 3 } else { 1 })));
        assert_eq!(lost.iter().position(|demand| *demand == fault), Some(12));
    }
}
