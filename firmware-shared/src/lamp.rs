//! What the lamps show: a pattern for each state of the board, and for each reason why it stays off.
//!
//! A board has two lamps, of the pulses and of faults, or only the first, which then shows both. So no two patterns are alike in time.
//!
//! | pattern | lamp | meaning |
//! |---|---|---|
//! | a flash of 50 ms every 2 s | pulses | disarmed: the button arms |
//! | four flashes of 50 ms every 2 s | pulses | after a boot: press the emergency stop and release it, then the button arms |
//! | three flashes of 50 ms every 2 s | pulses | ready to trim: the button begins the trim of a servo |
//! | lit | pulses | armed, or in a trim: the servos get pulses |
//! | lit, with a gap of 100 ms every second | pulses | the same with the built-in robot: the board has no robot record |
//! | two flashes of 50 ms every 2 s | pulses | armed in shadow mode: everything runs, no pulses |
//! | 100 ms lit, 100 ms dark | fault | fault: the button acknowledges it |
//! | 1 s lit, 1 s dark | fault | locked out after repeated crashes, until a reset by hand or a power cycle, or because the robot demands a brown-out reset that is off, the watchdog's clock is wrong, or the program in flash was changed: the button does not arm |
//! | 2 flashes of 200 ms every 3.2 s | fault | stays off: the crystal did not start, or has another frequency than the image is for |
//! | 3 flashes | fault | stays off: the generator's record |
//! | 4 flashes | fault | stays off: the sensors' record |
//! | 5 flashes | fault | stays off: the robot's record |
//! | 6 flashes | fault | stays off: generator, sensors, robot and chip do not fit together |

use wire::Subject;

/// What is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shown {
    /// No pulses; the button arms.
    Disarmed,
    /// No pulses; the emergency stop has to be tested before the button arms.
    StopUntested,
    /// No pulses; the button begins a trim.
    TrimReady,
    /// The servos get pulses.
    Armed,
    /// The servos get pulses by the built-in robot.
    ArmedBuiltIn,
    /// Armed, and shadow mode withholds the pulses.
    Shadow,
    /// No pulses until the button acknowledges the fault.
    Fault,
    /// The button does not arm.
    LockedOut,
    /// The board does not start because of this.
    Off(Subject),
}

/// Which lamp.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lamp {
    /// That of the servo pulses.
    Pulses,
    /// That of faults.
    Fault,
}

/// Flashes and a pause, repeated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Pattern {
    lamp: Lamp,
    flashes: u32,
    lit_ms: u32,
    /// From the beginning of a flash to that of the next.
    step_ms: u32,
    period_ms: u32,
}

impl Pattern {
    const fn even(lamp: Lamp, lit_ms: u32, period_ms: u32) -> Self {
        Self { lamp, flashes: 1, lit_ms, step_ms: period_ms, period_ms }
    }

    const fn counted(flashes: u32) -> Self {
        Self { lamp: Lamp::Fault, flashes, lit_ms: 200, step_ms: 400, period_ms: 3_200 }
    }
}

/// All changes are at multiples of this time.
pub const STEP_MS: u16 = 50;

impl Shown {
    const fn pattern(self) -> Pattern {
        match self {
            Self::Disarmed => Pattern::even(Lamp::Pulses, 50, 2_000),
            Self::StopUntested => {
                Pattern { lamp: Lamp::Pulses, flashes: 4, lit_ms: 50, step_ms: 250, period_ms: 2_000 }
            }
            Self::TrimReady => Pattern { lamp: Lamp::Pulses, flashes: 3, lit_ms: 50, step_ms: 250, period_ms: 2_000 },
            Self::Armed => Pattern::even(Lamp::Pulses, 1_000, 1_000),
            Self::ArmedBuiltIn => Pattern::even(Lamp::Pulses, 900, 1_000),
            Self::Shadow => Pattern { lamp: Lamp::Pulses, flashes: 2, lit_ms: 50, step_ms: 250, period_ms: 2_000 },
            Self::Fault => Pattern::even(Lamp::Fault, 100, 200),
            Self::LockedOut | Self::Off(Subject::Arming) => Pattern::even(Lamp::Fault, 1_000, 2_000),
            Self::Off(Subject::Clock) => Pattern::counted(2),
            Self::Off(Subject::GeneratorRecord) => Pattern::counted(3),
            Self::Off(Subject::SensorRecord) => Pattern::counted(4),
            Self::Off(Subject::RobotRecord) => Pattern::counted(5),
            Self::Off(_) => Pattern::counted(6),
        }
    }

    /// The lamp that is lit at this time since the pattern began, ms; the other one is dark.
    ///
    /// ```
    /// use firmware_shared::lamp::{Lamp, Shown};
    /// assert_eq!([0, 40, 60].map(|ms| Shown::Disarmed.lit(ms)), [Some(Lamp::Pulses), Some(Lamp::Pulses), None]);
    /// assert_eq!(Shown::Armed.lit(123_456), Some(Lamp::Pulses));
    /// ```
    #[must_use]
    pub fn lit(self, ms: u32) -> Option<Lamp> {
        let Pattern { lamp, flashes, lit_ms, step_ms, period_ms } = self.pattern();
        // The divisors are constants of the table, none is 0.
        let at = ms.checked_rem(period_ms).unwrap_or(0);
        let is_lit = at < flashes * step_ms && at.checked_rem(step_ms).unwrap_or(0) < lit_ms;
        is_lit.then_some(lamp)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Shown; 13] = [
        Shown::Disarmed,
        Shown::StopUntested,
        Shown::TrimReady,
        Shown::Armed,
        Shown::ArmedBuiltIn,
        Shown::Shadow,
        Shown::Fault,
        Shown::LockedOut,
        Shown::Off(Subject::Clock),
        Shown::Off(Subject::GeneratorRecord),
        Shown::Off(Subject::SensorRecord),
        Shown::Off(Subject::RobotRecord),
        Shown::Off(Subject::Configuration),
    ];

    /// Lengths of the lit and dark spans by turns, ms, from the first change after 10 s on, over 10 s.
    fn spans(shown: Shown) -> Vec<(bool, u32)> {
        let lit = |ms: u32| shown.lit(ms).is_some();
        let mut spans: Vec<(bool, u32)> = vec![];
        let from = (10_000..20_000).find(|ms| lit(*ms) != lit(ms - 1)).unwrap_or(10_000);
        for ms in from..from + 10_000 {
            match spans.last_mut() {
                Some((is_lit, long)) if *is_lit == lit(ms) => *long += 1,
                _ => spans.push((lit(ms), 1)),
            }
        }
        spans.pop();
        spans
    }

    #[test]
    fn no_two_patterns_are_alike_on_one_lamp() {
        for (index, one) in ALL.iter().enumerate() {
            for other in &ALL[index + 1..] {
                assert_ne!(spans(*one), spans(*other), "{one:?}, {other:?}");
            }
        }
    }

    #[test]
    fn changes_are_at_multiples_of_the_step_and_one_lamp_is_used() {
        for shown in ALL {
            let lamps: std::collections::BTreeSet<_> =
                (0..20_000).filter_map(|ms| shown.lit(ms)).map(|lamp| lamp == Lamp::Fault).collect();
            assert_eq!(lamps.len(), 1, "{shown:?}");
            assert!(
                (1..20_000).all(|ms| ms % u32::from(STEP_MS) == 0 || shown.lit(ms) == shown.lit(ms - 1)),
                "{shown:?}"
            );
        }
    }

    #[test]
    fn flashes_count_the_reasons() {
        for (subject, flashes) in [(Subject::Clock, 2), (Subject::RobotRecord, 5), (Subject::Configuration, 6)] {
            let shown = Shown::Off(subject);
            let starts = (0..3_200).filter(|ms| shown.lit(*ms).is_some() && (*ms == 0 || shown.lit(ms - 1).is_none()));
            assert_eq!(starts.count(), flashes);
            // The pause is longer than that between two flashes.
            assert!((2_600..3_200).all(|ms| shown.lit(ms).is_none()), "{subject:?}");
        }
    }
}
