//! Judges every pulse at the servo pins as a servo takes it, without regard to what the firmware says.
//!
//! - A pulse is within the range of its joint and within its rate, by the robot record in flash at the last boot; without a valid record there is none.
//! - A pulse starts only after a hold of the button ([`operator`]).
//! - A motion starts at the park pose, or where the last pulse of the servo was.
//! - No pulse ends before the timer's compare value, except with a cause (the emergency stop, a reset, an injected fault), and with the servos' supply.
//!   A pulse in which the supply goes first is none to a servo.
//! - No line is high for long while the servo has its supply.
//! - In a trim that a host asked for, one servo may leave the range of its joint: slowly, within the pulses of the servo, and while the others stand.

mod limits;
mod log;
mod operator;

pub(crate) use limits::{Joint, Limits, PARAMETERS_END};
pub(crate) use log::JudgeLog;

use serde::Serialize;
use stm32f4_model::Pin;

use crate::pulses::{OutputChange, TimedOutputChange};
use crate::servo_pulse::{PulseSupply, ServoPulse};
use operator::Operator;

/// Rounding of a pulse to a whole microsecond, on one side, us.
const ROUNDING_US: f64 = 0.6;
/// Error of a crystal that is no fault: pulses are shorter by this part of them.
const CRYSTAL_ERROR: f64 = 1e-3;
/// Servos that got no pulse for so long stand: the next pulse begins a new motion, s.
const PAUSE_S: f64 = 0.1;
/// The first pulse of a motion is at its start within the rate in so long, s: a servo frame and a quarter.
const START_S: f64 = 0.025;
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
    /// Width of the last pulse that was as it should be, us.
    known: Option<f64>,
    /// The first pulse after a pause.
    first_us: f64,
    /// It has moved since then, or faster than a trim.
    moved: bool,
    moved_fast: bool,
}

/// Judge of the pulses so far.
#[derive(Debug, Clone)]
pub(crate) struct Judge {
    /// Since the last boot, and before it. `None`: no pulse is allowed.
    limits: Option<Limits>,
    before: Option<Limits>,
    /// The servo pins, for what is wrong.
    servos: [Pin; 4],
    operator: Operator,
    motions: [Motion; 4],
    /// The servo that leaves the range of its joint in a trim.
    trimmed: Option<usize>,
    /// A host has sent something: it may have asked for a trim.
    has_host: bool,
    /// Start of the last pulse of any servo, and of the first one after a pause, s.
    last_pulse: f64,
    motion_began: f64,
    /// From this time on injected faults are a cause for cuts, s.
    injected: f64,
    /// One pulse of each servo may last so long, because the injected fault stops or slows the timer in it, s.
    high_s: f64,
    has_been_high: [bool; 4],
    /// The limits are those of a campaign, whatever is in flash.
    is_campaign: bool,
    reset: f64,
    violations: Vec<Violation>,
    judged: Judged,
}

impl Judge {
    /// A judge at power-on. `None`: no pulse is allowed.
    pub(crate) const fn new(limits: Option<Limits>, servos: [Pin; 4]) -> Self {
        let motion = Motion { last: None, known: None, first_us: 0.0, moved: false, moved_fast: false };
        Judge {
            limits,
            before: None,
            servos,
            operator: Operator::new(),
            motions: [motion; 4],
            trimmed: None,
            has_host: false,
            last_pulse: f64::NEG_INFINITY,
            motion_began: f64::NEG_INFINITY,
            injected: f64::INFINITY,
            high_s: 0.0,
            has_been_high: [false; 4],
            is_campaign: false,
            reset: f64::NEG_INFINITY,
            violations: Vec::new(),
            judged: Judged { pulses: 0, cut: 0, trimmed: Vec::new(), violations: 0, first: Vec::new() },
        }
    }

    /// Goes on with the limits of a campaign, in which faults are injected by which one pulse of each servo lasts so long at most, s.
    pub(crate) fn begin_case(&mut self, limits: Limits, high_s: f64) {
        (self.limits, self.is_campaign, self.injected) = (Some(limits), true, f64::NEG_INFINITY);
        (self.high_s, self.has_been_high) = (high_s, [false; 4]);
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

    /// Takes a reset of the chip, which boots with these limits; called only if they matter.
    pub(crate) fn reset(&mut self, seconds: f64, limits: impl FnOnce() -> Option<Limits>) {
        self.reset = seconds;
        self.operator.reset(seconds);
        if !self.is_campaign {
            self.before = std::mem::replace(&mut self.limits, limits());
        }
    }

    /// Takes that a host has sent something to the board.
    pub(crate) fn host_sent(&mut self) {
        self.has_host = true;
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

    /// Takes a pulse.
    pub(crate) fn take(&mut self, pulse: &ServoPulse) {
        // Without its supply a servo takes no pulse.
        if pulse.supplied_s() == 0.0 {
            return;
        }
        self.judged.pulses += 1;
        self.judge_start(pulse);
        if pulse.from - self.last_pulse > PAUSE_S {
            self.motion_began = pulse.from;
        }
        self.last_pulse = self.last_pulse.max(pulse.from);
        let Some(limits) = self.limits_of(pulse) else { return self.note_without_limits(pulse) };
        if pulse.supply == PulseSupply::Absent || pulse.lost_supply().is_some() {
            // Such a pulse is none to a servo, but for the time with supply.
            self.judge_high(&limits, pulse);
        } else {
            self.judge(&limits, pulse);
        }
    }

    /// Judges whether the operator allowed the pulse.
    fn judge_start(&mut self, pulse: &ServoPulse) {
        if let Err(why) = self.operator.pulse(pulse.from) {
            let what = format!("{} at {:.4} s: {why}", self.servos[pulse.servo], pulse.from);
            self.note(pulse.to, false, what);
        }
    }

    /// The limits of the boot in which a pulse began.
    fn limits_of(&self, pulse: &ServoPulse) -> Option<Limits> {
        let is_before = pulse.from < self.reset && !self.is_campaign;
        if is_before { self.before.clone() } else { self.limits.clone() }
    }

    /// Judges for how long a line was high while the servo had its supply; true if there is no more to judge: it was longer than a cut or a changed
    /// width explains, or as long as declared.
    fn judge_high(&mut self, limits: &Limits, pulse: &ServoPulse) -> bool {
        let high_s = pulse.supplied_s();
        let is_longer = pulse.programmed_us.is_some_and(|programmed| high_s * 1e6 > programmed + ROUNDING_US);
        if is_longer && high_s <= self.high_s && !std::mem::replace(&mut self.has_been_high[pulse.servo], true) {
            return true;
        }
        let is_long = high_s > limits.most_us[pulse.servo] * 1e-6 + WITHOUT_EFFECT_S;
        if is_long {
            let what = format!("{} at {:.4} s: high for {:.2} ms", self.servos[pulse.servo], pulse.from, high_s * 1e3);
            self.note(pulse.to, false, what);
        }
        is_long
    }

    fn judge(&mut self, limits: &Limits, pulse: &ServoPulse) {
        if self.judge_high(limits, pulse) {
            return;
        }
        let (servo, started, us) = (pulse.servo, pulse.from, pulse.us());
        let mut wrong = Vec::new();
        let motion = &mut self.motions[servo];
        let began = self.motion_began;
        let last = motion.last.replace((started, us)).filter(|(before, _)| *before >= began);
        let change = last.map_or((0.0, 0.0), |(before, width)| (started - before, (us - width).abs()));
        if last.is_none() {
            *motion = Motion { first_us: us, moved: false, moved_fast: false, ..*motion };
            self.trimmed = self.trimmed.filter(|trimmed| *trimmed != servo);
        }
        motion.moved |= (us - motion.first_us).abs() > ROUNDING_US;
        motion.moved_fast |= change.1 > TRIM_US_PER_S * change.0 + 2.0 * ROUNDING_US;
        let (least, most) = (limits.least_us[servo], limits.most_us[servo]);
        let is_inside = (least - ROUNDING_US..=most + ROUNDING_US).contains(&us);
        let is_trim = self.has_host
            && limits.trim_us.is_some_and(|trim| (trim[servo][0]..=trim[servo][1]).contains(&us.round()))
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
        let rate = limits.us_per_s[servo];
        if let Some((_, before)) = last
            && change.1 > rate * change.0 + 2.0 * ROUNDING_US
        {
            wrong.push(format!("{before:.1} to {us:.1} us in {:.1} ms", change.0 * 1e3));
        }
        let park = limits.park_us[servo];
        let starts = [Some(park), self.motions[servo].known, limits.neutral_us.map(|us| us[servo]).filter(|_| is_trim)];
        if last.is_none() && !starts.into_iter().flatten().any(|start| (us - start).abs() <= rate * START_S) {
            wrong.push(format!(
                "{us:.1} us begins a motion, neither at the park pose ({park:.1} us) nor at the last pulse"
            ));
        }
        let is_cut = |programmed: &f64| us < programmed * (1.0 - CRYSTAL_ERROR) - ROUNDING_US;
        if let Some(programmed) = pulse.programmed_us.filter(is_cut) {
            wrong.push(format!("{us:.1} us of {programmed} us: cut short"));
        }
        if wrong.is_empty() {
            self.motions[servo].known = Some(us);
        } else {
            // What one pulse does wrong is one violation: a cut pulse is often too short as well.
            let what = format!("{} at {started:.4} s: {}", self.servos[servo], wrong.join(", "));
            self.note(pulse.to, true, what);
        }
    }

    /// Takes a pulse that has not ended at the end of the run.
    pub(crate) fn end(&mut self, pulse: &ServoPulse) {
        if pulse.supplied_s() == 0.0 {
            return;
        }
        self.judge_start(pulse);
        match self.limits_of(pulse) {
            Some(limits) => {
                self.judge_high(&limits, pulse);
            }
            None => self.note_without_limits(pulse),
        }
    }

    fn note_without_limits(&mut self, pulse: &ServoPulse) {
        let why = "a pulse with a damaged parameter sector";
        self.note(pulse.to, false, format!("{} at {:.4} s: {why}", self.servos[pulse.servo], pulse.from));
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
