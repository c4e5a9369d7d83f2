//! Judges every pulse at the servo pins as a servo takes it, without regard to what the firmware says.

use serde::Deserialize;

use crate::pulses::{OutputChange, PulsePeriod, SERVOS, TimedOutputChange};

/// What the servos may get: the joints' ranges and rates, as pulses. In the order of the servo pins.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Limits {
    /// Shortest pulse, us.
    least_us: [f64; 4],
    /// Longest pulse, us.
    most_us: [f64; 4],
    /// Fastest change, us a second.
    us_per_s: [f64; 4],
}

/// Rounding of a pulse to a whole microsecond, on one side, us.
const ROUNDING_US: f64 = 0.6;
/// A servo that got no pulse for so long may be anywhere: the next pulse begins a new motion, s.
const FORGOTTEN_S: f64 = 0.1;

/// A servo whose supply is switched off so soon after a pulse hardly moves by it, s: one tick, in which a fast hobby servo (60 degrees in 0.08 s) turns
/// by less than a degree. A bit that ends a pulse is found by the next tick.
const WITHOUT_EFFECT_S: f64 = 1.1e-3;

/// A pulse that no servo may get.
#[derive(Debug, Clone)]
struct Violation {
    /// End of the pulse, s.
    ended: f64,
    /// In words.
    what: String,
}

/// Judge of the pulses so far.
#[derive(Debug, Clone)]
pub(crate) struct Judge {
    limits: Limits,
    last: [Option<(f64, f64)>; 4],
    violations: Vec<Violation>,
}

impl Judge {
    pub(crate) const fn new(limits: Limits) -> Self {
        Judge { limits, last: [None; 4], violations: Vec::new() }
    }

    /// Number of pulses that no servo may get, and the first of them in words.
    pub(crate) fn violations(&self) -> (usize, Option<&str>) {
        (self.violations.len(), self.violations.first().map(|first| first.what.as_str()))
    }

    /// Takes a change of the outputs.
    pub(crate) fn change(&mut self, change: &TimedOutputChange) {
        if change.change == OutputChange::Rail(false) {
            self.violations.retain(|violation| change.seconds - violation.ended > WITHOUT_EFFECT_S);
        }
    }

    /// Takes the pulses of a servo frame.
    pub(crate) fn take(&mut self, period: &PulsePeriod) {
        for servo in 0..SERVOS.len() {
            // Without its supply a servo takes no pulse.
            let Some(us) = period.us[servo].filter(|_| period.rail) else {
                continue;
            };
            let (least, most) = (self.limits.least_us[servo], self.limits.most_us[servo]);
            if !(least - ROUNDING_US..=most + ROUNDING_US).contains(&us) {
                self.note(period, servo, format!("{us:.1} us is outside {least} to {most} us"));
            }
            if let Some((seconds, before)) = self.last[servo].replace((period.seconds, us)) {
                let elapsed = period.seconds - seconds;
                let most = self.limits.us_per_s[servo] * elapsed + 2.0 * ROUNDING_US;
                if elapsed < FORGOTTEN_S && (us - before).abs() > most {
                    self.note(period, servo, format!("{before:.1} to {us:.1} us in {:.1} ms", elapsed * 1e3));
                }
            }
        }
    }

    fn note(&mut self, period: &PulsePeriod, servo: usize, what: String) {
        let what = format!("{} at {:.4} s: {what}", SERVOS[servo], period.seconds);
        let ended = period.seconds + period.us[servo].unwrap_or(0.0) * 1e-6;
        self.violations.push(Violation { ended, what });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judge() -> Judge {
        Judge::new(Limits { least_us: [600.0; 4], most_us: [2400.0; 4], us_per_s: [1000.0; 4] })
    }

    fn period(seconds: f64, us: f64, rail: bool) -> PulsePeriod {
        PulsePeriod { seconds, us: [Some(us), None, None, Some(1500.0)], rail }
    }

    #[test]
    fn range_and_rate_are_judged_and_a_servo_without_supply_is_not() {
        let mut judge = judge();
        for (seconds, us) in [(0.0, 600.0), (0.02, 621.0), (0.04, 601.0), (0.2, 2400.0)] {
            judge.take(&period(seconds, us, true));
        }
        assert_eq!(judge.violations(), (0, None));
        judge.take(&period(0.22, 90.0, false));
        assert_eq!(judge.violations(), (0, None), "its supply is off");
        judge.take(&period(0.24, 2357.0, true));
        assert_eq!(judge.violations(), (1, Some("PE9 at 0.2400 s: 2400.0 to 2357.0 us in 40.0 ms")));
        judge.take(&period(0.5, 599.0, true));
        assert_eq!(judge.violations().0, 2);
        judge.take(&period(0.9, 300.0, true));
        assert_eq!(judge.violations().0, 3);
        let off = |seconds| TimedOutputChange { seconds, instructions: 0, change: OutputChange::Rail(false) };
        judge.change(&off(0.9015));
        assert_eq!(judge.violations().0, 3, "the supply went too late");
        judge.take(&period(1.2, 300.0, true));
        judge.change(&off(1.200_302));
        assert_eq!(judge.violations().0, 3);
    }
}
