//! Judges every pulse at the servo pins as a servo takes it, without regard to what the firmware says.
//!
//! - A pulse is within the range of its joint and within its rate, by the robot record in flash; without a valid record there is none.
//! - A pulse starts only after a hold of the button ([`operator`]).
//! - No pulse ends before the timer's compare value, except with a cause (the emergency stop, a reset, an injected fault), and with the servos' supply.
//! - In a trim one servo may leave the range of its joint: slowly, within the pulses of the servo, and while the others stand.

mod limits;
mod log;
mod operator;

pub(crate) use limits::{Joint, Limits};
pub(crate) use log::JudgeLog;

use serde::Serialize;
use stm32f4_model::Pin;

use crate::pulses::{OutputChange, PulsePeriod, TimedOutputChange};
use operator::Operator;

/// Rounding of a pulse to a whole microsecond, on one side, us.
const ROUNDING_US: f64 = 0.6;
/// A servo that got no pulse for so long may be anywhere: the next pulse begins a new motion, s.
const FORGOTTEN_S: f64 = 0.1;
/// Fastest change in a trim, us a second: one microsecond in 10 ms.
const TRIM_US_PER_S: f64 = 100.0;

/// A servo whose supply is switched off so soon after a pulse hardly moves by it, s: one tick, in which a fast hobby servo (60 degrees in 0.08 s) turns
/// by less than a degree. A bit that ends a pulse is found by the next tick.
const WITHOUT_EFFECT_S: f64 = 1.1e-3;

/// The emergency stop and a reset take the supply with the pulse: within this time, s.
const WITH_PULSE_S: f64 = 1e-4;

/// Violations that are described in the summary.
const DESCRIBED: usize = 10;

/// A pulse that no servo may get.
#[derive(Debug, Clone)]
struct Violation {
    /// End of the pulse, s.
    ended: f64,
    /// The supply that goes with the pulse takes its effect away.
    is_excusable: bool,
    /// In words.
    what: String,
}

/// What came of a run's pulses.
#[derive(Debug, Clone, Default, Serialize)]
pub(crate) struct Judged {
    /// Number of pulses that were judged.
    pub(crate) pulses: u64,
    /// Of these, those that ended early together with the servos' supply, for a declared cause.
    pub(crate) cut: u64,
    /// Servos that were trimmed.
    pub(crate) trimmed: Vec<String>,
    /// Number of violations.
    pub(crate) violations: usize,
    /// The first of them, in words.
    pub(crate) first: Vec<String>,
}

/// The pulses of the present motion of one servo.
#[derive(Debug, Clone, Copy, Default)]
struct Motion {
    /// Time and width of the last pulse.
    last: Option<(f64, f64)>,
    /// The first pulse after a pause.
    first_us: f64,
    /// It has moved since then, or faster than a trim.
    moved: bool,
    moved_fast: bool,
}

/// Judge of the pulses so far.
#[derive(Debug, Clone)]
pub(crate) struct Judge {
    /// `None`: no pulse is allowed.
    limits: Option<Limits>,
    /// The servo pins, for what is wrong.
    servos: [Pin; 4],
    operator: Operator,
    motions: [Motion; 4],
    /// The servo that leaves the range of its joint in a trim.
    trimmed: Option<usize>,
    /// From this time on injected faults are a cause for cuts, s.
    injected: f64,
    reset: f64,
    violations: Vec<Violation>,
    judged: Judged,
}

impl Judge {
    /// A judge at power-on. `None`: no pulse is allowed.
    pub(crate) const fn new(limits: Option<Limits>, servos: [Pin; 4]) -> Self {
        let motion = Motion { last: None, first_us: 0.0, moved: false, moved_fast: false };
        Judge {
            limits,
            servos,
            operator: Operator::new(),
            motions: [motion; 4],
            trimmed: None,
            injected: f64::INFINITY,
            reset: f64::NEG_INFINITY,
            violations: Vec::new(),
            judged: Judged { pulses: 0, cut: 0, trimmed: Vec::new(), violations: 0, first: Vec::new() },
        }
    }

    /// Goes on with the limits of a campaign, in which a fault is injected.
    pub(crate) fn begin_case(&mut self, limits: Limits) {
        (self.limits, self.injected) = (Some(limits), f64::NEG_INFINITY);
        self.violations.clear();
    }

    /// Number of pulses that no servo may get, and the first of them in words.
    pub(crate) fn violations(&self) -> (usize, Option<&str>) {
        (self.violations.len(), self.violations.first().map(|first| first.what.as_str()))
    }

    /// Takes the levels at the pins of the button and of the emergency stop.
    pub(crate) fn observe(&mut self, seconds: f64, button: bool, stop: bool) {
        self.operator.observe(seconds, button, stop);
    }

    /// Takes a reset of the chip.
    pub(crate) fn reset(&mut self, seconds: f64) {
        self.reset = seconds;
        self.operator.reset(seconds);
    }

    /// Takes an injected fault that may cut pulses.
    pub(crate) fn injected(&mut self, seconds: f64) {
        self.injected = self.injected.min(seconds);
    }

    /// Takes a change of the outputs.
    pub(crate) fn change(&mut self, change: &TimedOutputChange) {
        if change.change != OutputChange::Rail(false) {
            return;
        }
        self.operator.supply_off(change.seconds);
        let before = self.violations.len();
        let (operator, reset, injected) = (&self.operator, self.reset, self.injected);
        self.violations.retain(|violation| {
            let by = |cause: f64| (violation.ended - cause).abs() <= WITH_PULSE_S;
            let longest = if violation.ended >= injected {
                WITHOUT_EFFECT_S
            } else if by(operator.stopped) || by(reset) {
                WITH_PULSE_S
            } else {
                return true;
            };
            !violation.is_excusable || change.seconds - violation.ended > longest
        });
        self.judged.cut += (before - self.violations.len()) as u64;
    }

    /// Takes the pulses of a servo frame.
    pub(crate) fn take(&mut self, period: &PulsePeriod) {
        for servo in 0..self.servos.len() {
            // Without its supply a servo takes no pulse.
            let Some(us) = period.us[servo].filter(|_| period.rail) else {
                continue;
            };
            self.judged.pulses += 1;
            self.judge(period, servo, us);
        }
        if period.rail
            && let Err(why) = self.operator.pulse(period.seconds)
        {
            self.note(period.seconds, false, format!("a pulse at {:.4} s: {why}", period.seconds));
        }
    }

    fn judge(&mut self, period: &PulsePeriod, servo: usize, us: f64) {
        let (started, ended) = (period.seconds, period.seconds + us * 1e-6);
        let mut wrong = Vec::new();
        let motion = &mut self.motions[servo];
        let last = motion.last.replace((started, us)).filter(|(before, _)| started - before < FORGOTTEN_S);
        let change = last.map_or((0.0, 0.0), |(before, width)| (started - before, (us - width).abs()));
        if last.is_none() {
            *motion = Motion { last: motion.last, first_us: us, moved: false, moved_fast: false };
            self.trimmed = self.trimmed.filter(|trimmed| *trimmed != servo);
        }
        motion.moved |= (us - motion.first_us).abs() > ROUNDING_US;
        motion.moved_fast |= change.1 > TRIM_US_PER_S * change.0 + 2.0 * ROUNDING_US;
        let Some(limits) = &self.limits else {
            let what = format!(
                "{} at {started:.4} s: a pulse without a valid robot record, or with a damaged sector",
                self.servos[servo]
            );
            return self.note(ended, false, what);
        };
        let (least, most) = (limits.least_us[servo], limits.most_us[servo]);
        let is_inside = (least - ROUNDING_US..=most + ROUNDING_US).contains(&us);
        let is_trim = limits.trim_us.is_some_and(|trim| (trim[servo][0]..=trim[servo][1]).contains(&us.round()))
            && !self.motions[servo].moved_fast
            && (0..self.servos.len()).all(|other| other == servo || !self.motions[other].moved);
        if !is_inside && is_trim {
            if self.trimmed.replace(servo) != Some(servo) {
                self.judged.trimmed.push(self.servos[servo].to_string());
            }
        } else if !is_inside {
            wrong.push(format!("{us:.1} us is outside {least:.1} to {most:.1} us"));
        }
        if self.trimmed.is_some_and(|trimmed| trimmed != servo) && self.motions[servo].moved {
            wrong.push("it moves beside a trim".into());
        }
        if let Some((_, before)) = last
            && change.1 > limits.us_per_s[servo] * change.0 + 2.0 * ROUNDING_US
        {
            wrong.push(format!("{before:.1} to {us:.1} us in {:.1} ms", change.0 * 1e3));
        }
        if let Some(programmed) = period.programmed_us[servo].filter(|programmed| us < programmed - ROUNDING_US) {
            wrong.push(format!("{us:.1} us of {programmed} us: cut short"));
        }
        if !wrong.is_empty() {
            // What one pulse does wrong is one violation: a cut pulse is often too short as well.
            let what = format!("{} at {started:.4} s: {}", self.servos[servo], wrong.join(", "));
            self.note(ended, true, what);
        }
    }

    /// Takes the pins that are high at the end of the run, each with the time since when, s.
    pub(crate) fn end(&mut self, seconds: f64, high_since: [Option<f64>; 4], rail: bool) {
        for (servo, since) in high_since.into_iter().enumerate() {
            let Some(since) = since.filter(|_| rail) else { continue };
            let us = (seconds - since) * 1e6;
            let most = self.limits.as_ref().map_or(0.0, |limits| limits.most_us[servo]);
            if us > most + ROUNDING_US {
                self.note(seconds, false, format!("{} is high since {since:.4} s, for {us:.0} us", self.servos[servo]));
            }
        }
    }

    /// What came of the pulses so far.
    pub(crate) fn judged(&self) -> Judged {
        let first = self.violations.iter().take(DESCRIBED).map(|violation| violation.what.clone()).collect();
        Judged { violations: self.violations.len(), first, ..self.judged.clone() }
    }

    fn note(&mut self, ended: f64, is_excusable: bool, what: String) {
        self.violations.push(Violation { ended, is_excusable, what });
    }
}

#[cfg(test)]
mod tests;
