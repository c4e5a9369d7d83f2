//! Fault counters since the boot. They also catch faults that are shorter than one telemetry frame.

use hgod_adc::Validity;

/// Counts since the boot, all of which wrap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Conditions<const S: usize> {
    /// Control periods that they cover.
    pub tick: u32,
    /// Dips of the supply below its minimum, however short.
    pub supply_dips: u32,
    /// Each gait sensor; a channel without one has no counts.
    pub sensors: [SensorCounts; S],
}

/// Validities of one sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SensorCounts {
    /// Ticks in which the validity was another one than in the tick before.
    pub changes: u32,
    /// Control periods with each validity that is not good, in the order of [`Validity::ALL`] without its first.
    pub bad: [u32; BAD],
}

/// Number of validities that are not good.
pub const BAD: usize = Validity::ALL.len() - 1;

impl SensorCounts {
    /// No counts.
    pub const NONE: Self = Self { changes: 0, bad: [0; BAD] };

    /// Adds a tick, `elapsed` periods after the one before; `before` is `None` in the first tick, which is no change.
    pub(crate) fn note(&mut self, before: Option<Validity>, now: Validity, elapsed: u32) {
        if before.is_some_and(|before| before != now) {
            self.changes = self.changes.wrapping_add(1);
        }
        let place = (now as usize).checked_sub(1);
        if let Some(periods) = place.and_then(|place| self.bad.get_mut(place)) {
            *periods = periods.wrapping_add(elapsed);
        }
    }

    /// The counts since an earlier moment.
    #[must_use]
    pub fn since(&self, earlier: &Self) -> Self {
        let mut bad = self.bad;
        for (periods, earlier) in bad.iter_mut().zip(&earlier.bad) {
            *periods = periods.wrapping_sub(*earlier);
        }
        Self { changes: self.changes.wrapping_sub(earlier.changes), bad }
    }

    /// Control periods in which the sensor was not good, and the validity that most of them had: good where there are none.
    ///
    /// ```
    /// use hgod_adc::Validity;
    /// use joint_loop::SensorCounts;
    /// let counts = SensorCounts { changes: 3, bad: [10, 0, 480, 0, 0, 0, 0, 0] };
    /// assert_eq!(counts.not_good(), (490, Validity::ALL[3]));
    /// assert_eq!(SensorCounts::NONE.not_good(), (0, Validity::Good));
    /// ```
    #[must_use]
    pub fn not_good(&self) -> (u32, Validity) {
        let named = Validity::ALL.into_iter().skip(1).zip(self.bad);
        let (_, most) = named.fold(
            (0, Validity::Good),
            |most, (validity, periods)| {
                if periods > most.0 { (periods, validity) } else { most }
            },
        );
        (self.bad.iter().fold(0, |sum, periods| sum.wrapping_add(*periods)), most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_validity_has_its_place() {
        for (place, validity) in Validity::ALL.into_iter().enumerate() {
            assert_eq!(validity as usize, place);
            let mut counts = SensorCounts::NONE;
            counts.note(Some(Validity::Good), validity, 3);
            let changes = u32::from(validity != Validity::Good);
            assert_eq!((counts.changes, counts.not_good()), (changes, (3 * changes, validity)));
        }
    }

    /// Changes and periods of a course, over the wrap of both.
    #[test]
    fn changes_and_periods_are_counted_through_the_wrap() {
        let begun = SensorCounts { changes: u32::MAX, bad: [u32::MAX; BAD] };
        let mut counts = begun;
        counts.note(None, Validity::Open, 1);
        assert_eq!(counts.since(&begun).changes, 0, "the first tick is no change");
        for (before, now) in
            [(Validity::Open, Validity::Open), (Validity::Open, Validity::Good), (Validity::Good, Validity::Spike)]
        {
            counts.note(Some(before), now, 2);
        }
        let since = counts.since(&begun);
        assert_eq!((since.changes, since.not_good()), (2, (5, Validity::Open)));
    }
}
