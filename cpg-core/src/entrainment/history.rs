//! Keeps phase and stride frequency of the last 2.4 s, so that a hold can begin with values from before the fault.
//!
//! A fault is found up to 0.4 s after it begins, and the estimate follows the wrong angles until then. A hold therefore begins with the phase
//! of 0.6 s ago, continued to now, and with the averaged stride frequency of 2.4 s ago. The values are in a ring with an entry every 50 ms.

use joint_units::{Period, Phase};

/// Number of entries: 2.4 s of steps, and the newest one.
const ENTRIES: usize = 49;
/// Time between entries, s.
const STEP_S: f32 = 0.05;
/// Time constant of the averaged frequency, s.
const SLOW_S: f32 = 1.0;

#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Entry {
    phase: Phase,
    /// Averaged frequency, rad/s.
    slow: f32,
}

/// The ring of past values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct History {
    entries: [Entry; ENTRIES],
    /// Index of the newest entry, and the number of entries in use.
    newest: usize,
    count: usize,
    /// Ticks since the newest entry, and ticks between two entries. Integers, because a sum of periods in `f32` could be one tick off.
    since: u32,
    every: u32,
    period_s: f32,
    /// Averaged frequency now, rad/s.
    slow: f32,
}

impl History {
    /// Without entries; the averaged frequency begins at `frequency`, rad/s.
    pub(super) const fn new(frequency: f32, period: Period) -> Self {
        let none = Entry { phase: Phase(0), slow: frequency };
        // Rounded; at least one tick.
        let ticks = (STEP_S / period.seconds() + 0.5) as u32;
        let every = if ticks == 0 { 1 } else { ticks };
        let (since, period_s) = (every, period.seconds());
        Self { entries: [none; ENTRIES], newest: 0, count: 0, since, every, period_s, slow: frequency }
    }

    /// Removes all entries; the averaged frequency begins again at `frequency`, rad/s.
    pub(super) const fn clear(&mut self, frequency: f32) {
        self.count = 0;
        self.since = self.every;
        self.slow = frequency;
    }

    /// Takes phase and frequency (rad/s) of one tick of a locked estimator.
    pub(super) fn keep(&mut self, phase: Phase, frequency: f32) {
        self.slow += (frequency - self.slow) * (self.period_s / SLOW_S).min(1.0);
        self.since = self.since.saturating_add(1);
        if self.since < self.every {
            return;
        }
        self.since = 0;
        self.newest = if self.newest + 1 < ENTRIES { self.newest + 1 } else { 0 };
        if let Some(entry) = self.entries.get_mut(self.newest) {
            *entry = Entry { phase, slow: self.slow };
        }
        self.count = (self.count + 1).min(ENTRIES);
    }

    /// The entry that many steps before the newest, or the oldest one, and its age in s; `None` without entries.
    fn back(&self, steps: usize) -> Option<(Entry, f32)> {
        let steps = steps.min(self.count.checked_sub(1)?);
        let place =
            if self.newest >= steps { self.newest - steps } else { (self.newest + ENTRIES).checked_sub(steps)? };
        let entry = self.entries.get(place)?;
        Some((*entry, (self.since + steps as u32 * self.every) as f32 * self.period_s))
    }

    /// The averaged frequency of 2.4 s ago, or the oldest one, rad/s.
    pub(super) fn stride_frequency(&self) -> Option<f32> {
        self.back(48).map(|(entry, _)| entry.slow)
    }

    /// The phase of 0.6 s ago, or the oldest one, and its age in s.
    pub(super) fn phase(&self) -> Option<(Phase, f32)> {
        self.back(12).map(|(entry, age)| (entry.phase, age))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_gives_back_what_was_there_at_that_age() {
        let mut history = History::new(6.0, Period::MILLISECOND);
        assert_eq!((history.stride_frequency(), history.phase()), (None, None));
        for tick in 0..10_000u32 {
            history.keep(Phase(tick), 6.0 + tick as f32 * 1e-3);
            let (phase, age) = history.phase().unwrap();
            let expected = tick as f32 * 1e-3 - phase.0 as f32 * 1e-3;
            assert!((age - expected).abs() < 1e-5, "tick {tick}: {age} for {expected}");
            assert!(tick < 700 || (0.599..0.651).contains(&age), "tick {tick}: {age}");
        }
        // The average lags by its time constant of 1 s behind a ramp of 1 rad/s^2; 2.4 s ago it was 6 + 9.999 - 1 - 2.4.
        let stride_frequency = history.stride_frequency().unwrap();
        assert!((stride_frequency - 12.6).abs() < 0.06, "{stride_frequency}");
    }
}
