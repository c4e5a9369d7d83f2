//! Judges every pulse at the servo pins as a servo takes it, without regard to what the firmware says.
//!
//! - A pulse is within the range of its joint and within its rate, by the robot record in flash at the last boot; without a valid record there is none.
//! - A pulse starts only after a hold of the button ([`operator`]).
//! - A motion starts where the last pulse of the servo was, for a minute, also over a reset that keeps the memory; else at the park pose.
//! - No pulse ends before the timer's compare value, except with a cause (the emergency stop, a reset, an injected fault), and with the servos' supply.
//!   A pulse in which the supply goes first is none to a servo.
//! - No line is high for long while the servo has its supply.
//! - In a trim that a host asked for, one servo may leave the range of its joint: slowly, within the pulses of the servo, and while no other one moves
//!   away from its park pose. Where a trim has left it, it may be again: as slowly it comes back.

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

/// The last pulses are known for so long, s; and the difference that the board's count of it may have.
const KNOWN_S: f64 = 60.0;
const KNOWN_SLACK_S: f64 = 0.1;

/// A servo whose supply is switched off so soon after a pulse hardly moves by it, s: one tick, in which a fast hobby servo (60 degrees in 0.08 s) turns
/// by less than a degree. A bit that ends a pulse is found by the next tick.
pub(crate) const WITHOUT_EFFECT_S: f64 = 1.1e-3;

/// The emergency stop and a reset take the supply with the pulse: within this time, s.
pub(crate) const WITH_PULSE_S: f64 = 1e-4;

/// A supply that is switched off falls in this time at most, s: until then a servo may take a pulse that is cut short.
const FALLS_S: f64 = 1e-3;

/// Violations that are described in the summary.
const DESCRIBED: usize = 10;

/// A pulse that no servo may get.
#[derive(Debug, Clone)]
struct Violation {
    /// End of the pulse, s.
    ended: f64,
    /// What takes its effect away.
    excuse: Excuse,
    /// In words.
    what: String,
}

/// What takes the effect of a wrong pulse away.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Excuse {
    Nothing,
    /// The supply that goes with the pulse.
    Supply,
    /// A reset that ends it: the supply has gone before.
    Reset,
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
    /// Least distance from the park pose since then, us.
    nearest_us: f64,
    /// It has moved away from there since then, or moved faster than a trim.
    left: bool,
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
    /// The motion began away from the park pose, and has not come there yet.
    is_from_elsewhere: bool,
    /// Start of the last pulse of any servo, and of the first one after a pause, s.
    last_pulse: f64,
    motion_began: f64,
    /// Injected faults by which pulses are wrong until the supply is off: from when on, and how soon that must be, s.
    injected: Vec<(f64, f64)>,
    /// The last pulses are known until then, s; and whether they were, and were not for sure, when the present motion began.
    known_until: f64,
    began_known: bool,
    began_forgotten: bool,
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
        let motion = Motion { last: None, known: None, nearest_us: f64::INFINITY, left: false, moved_fast: false };
        Judge {
            limits,
            before: None,
            servos,
            operator: Operator::new(),
            motions: [motion; 4],
            trimmed: None,
            has_host: false,
            is_from_elsewhere: false,
            last_pulse: f64::NEG_INFINITY,
            motion_began: f64::NEG_INFINITY,
            injected: Vec::new(),
            known_until: f64::NEG_INFINITY,
            began_known: false,
            began_forgotten: true,
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
        (self.limits, self.is_campaign) = (Some(limits), true);
        self.injected.clear();
        (self.high_s, self.has_been_high) = (high_s, [false; 4]);
        self.violations.clear();
    }

    /// Number of pulses that no servo may get, and the first of them in words.
    pub(crate) fn violations(&self) -> (usize, Option<&str>) {
        (self.violations.len(), self.violations.first().map(|first| first.what.as_str()))
    }

    /// Takes the levels at the pins of the button and of the emergency stop.
    pub(crate) fn observe(&mut self, seconds: f64, button: bool, stop: bool) {
        let stop_s = match &self.limits {
            Some(limits) if !self.is_from_elsewhere => limits.stop_s,
            _ => Limits::LONGEST_STOP_S,
        };
        self.operator.observe(seconds, button, stop, stop_s);
    }

    /// Takes a reset of the chip, which boots with these limits; called only if they matter. `keeps`: the memory keeps what is in it. `by_program`: it
    /// is no excuse for a pulse that ends with it.
    pub(crate) fn reset(
        &mut self,
        seconds: f64,
        keeps: bool,
        by_program: bool,
        limits: impl FnOnce() -> Option<Limits>,
    ) {
        self.reset = seconds;
        self.operator.reset(seconds);
        let with_it = |violation: &Violation| (violation.ended - seconds).abs() <= WITH_PULSE_S;
        self.violations.retain(|violation| by_program || violation.excuse != Excuse::Reset || !with_it(violation));
        // A boot that finds the last pulses knows them for as long again.
        self.known_until = if keeps && seconds < self.known_until { seconds + KNOWN_S } else { f64::NEG_INFINITY };
        if !self.is_campaign {
            self.before = std::mem::replace(&mut self.limits, limits());
        }
    }

    /// Takes that a host has sent something to the board.
    pub(crate) fn host_sent(&mut self) {
        self.has_host = true;
    }

    /// Takes an injected fault by which pulses may be wrong for so long, until the supply of the servos is off, s.
    pub(crate) fn injected(&mut self, seconds: f64, longest_s: f64) {
        self.injected.push((seconds, longest_s));
    }

    /// Takes a change of the outputs.
    pub(crate) fn change(&mut self, change: &TimedOutputChange) {
        if change.change != OutputChange::Rail(false) {
            return;
        }
        self.operator.supply_off(change.seconds);
        let before = self.violations.len();
        let (operator, reset, injected) = (&self.operator, self.reset, &self.injected);
        self.violations.retain(|violation| {
            let by = |cause: f64| (violation.ended - cause).abs() <= WITH_PULSE_S;
            let ends = (by(operator.stopped) || by(reset)).then_some(WITH_PULSE_S);
            let faults = injected.iter().filter(|(from, _)| violation.ended >= *from).map(|(_, longest)| *longest);
            let longest = faults.chain(ends).fold(f64::NEG_INFINITY, f64::max);
            violation.excuse != Excuse::Supply || change.seconds - violation.ended > longest
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
            self.began_known = pulse.from < self.known_until + KNOWN_SLACK_S;
            self.began_forgotten = pulse.from > self.known_until - KNOWN_SLACK_S;
        }
        self.last_pulse = self.last_pulse.max(pulse.from);
        let Some(limits) = self.limits_of(pulse) else { return self.note_without_limits(pulse) };
        if pulse.supply == PulseSupply::Absent || pulse.lost_supply().is_some() {
            // Such a pulse is none to a servo, but for the time with supply, which falls slowly.
            self.judge_high(&limits, pulse);
            self.judge_end(pulse);
        } else {
            self.judge(&limits, pulse);
        }
    }

    /// Judges a pulse whose supply went before its end: what switches it off while the processor runs waits for the end of the pulse.
    fn judge_end(&mut self, pulse: &ServoPulse) {
        let Some(supply_off) = pulse.lost_supply() else { return };
        let Some(programmed) = pulse.programmed_us.filter(|programmed| is_cut(pulse.us(), *programmed)) else { return };
        let is_by_hardware = (pulse.to - self.operator.stopped).abs() <= WITH_PULSE_S
            || self.injected.iter().any(|(from, _)| pulse.to >= *from);
        if pulse.to - supply_off < FALLS_S && !is_by_hardware {
            let (pin, us) = (&self.servos[pulse.servo], pulse.us());
            let what = format!(
                "{pin} at {:.4} s: {us:.1} us of {programmed} us: cut short, while its supply fell",
                pulse.from
            );
            self.note(pulse.to, Excuse::Reset, what);
        }
    }

    /// Judges whether the operator allowed the pulse.
    fn judge_start(&mut self, pulse: &ServoPulse) {
        if let Err(why) = self.operator.pulse(pulse.from) {
            let what = format!("{} at {:.4} s: {why}", self.servos[pulse.servo], pulse.from);
            self.note(pulse.to, Excuse::Nothing, what);
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
            self.note(pulse.to, Excuse::Nothing, what);
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
            *motion = Motion { nearest_us: f64::INFINITY, left: false, moved_fast: false, ..*motion };
            self.trimmed = self.trimmed.filter(|trimmed| *trimmed != servo);
        }
        let park = limits.park_us[servo];
        motion.left |= (us - park).abs() > motion.nearest_us + ROUNDING_US;
        motion.nearest_us = motion.nearest_us.min((us - park).abs());
        motion.moved_fast |= change.1 > TRIM_US_PER_S * change.0 + 2.0 * ROUNDING_US;
        let (least, most) = (limits.least_us[servo], limits.most_us[servo]);
        let is_inside = (least - ROUNDING_US..=most + ROUNDING_US).contains(&us);
        let is_trim = self.has_host
            && limits.trim_us.is_some_and(|trim| (trim[servo][0]..=trim[servo][1]).contains(&us.round()))
            && !self.motions[servo].moved_fast
            && (0..self.servos.len()).all(|other| other == servo || !self.motions[other].left);
        let excess = |us: f64| (least - us).max(us - most).max(0.0);
        let known = self.motions[servo].known.filter(|_| last.is_some() || self.began_known);
        let comes_back = us.is_finite()
            && !self.motions[servo].moved_fast
            && known.is_some_and(|known| excess(us) <= excess(known) + ROUNDING_US);
        if !is_inside && comes_back {
            // As slowly as in the trim that left it there.
        } else if !is_inside && is_trim {
            if self.trimmed.replace(servo) != Some(servo) {
                self.judged.trimmed.push(self.servos[servo].to_string());
            }
        } else if !is_inside {
            wrong.push(format!("{us:.1} us is outside {least:.1} to {most:.1} us"));
        }
        if self.trimmed.is_some_and(|trimmed| trimmed != servo) && self.motions[servo].left {
            wrong.push("it moves beside a trim".into());
        }
        let rate = limits.us_per_s[servo];
        if let Some((_, before)) = last
            && change.1 > rate * change.0 + 2.0 * ROUNDING_US
        {
            wrong.push(format!("{before:.1} to {us:.1} us in {:.1} ms", change.0 * 1e3));
        }
        let starts = [known, Some(park).filter(|_| known.is_none() || self.began_forgotten)];
        let near = rate * START_S + 2.0 * ROUNDING_US;
        if last.is_none() && !starts.into_iter().flatten().any(|start| (us - start).abs() <= near) {
            let expected = known.map_or_else(
                || format!("not at the park pose ({park:.1} us)"),
                |known| format!("not at the last pulse ({known:.1} us)"),
            );
            wrong.push(format!("{us:.1} us begins a motion, {expected}"));
        }
        if let Some(programmed) = pulse.programmed_us.filter(|programmed| is_cut(us, *programmed)) {
            wrong.push(format!("{us:.1} us of {programmed} us: cut short"));
        }
        if last.is_none() && (us - park).abs() > near {
            self.is_from_elsewhere = true;
        } else if self.is_from_elsewhere {
            let is_at_park = |servo: usize| {
                self.motions[servo].last.is_some_and(|(_, us)| (us - limits.park_us[servo]).abs() <= 2.0 * ROUNDING_US)
            };
            self.is_from_elsewhere = !(0..self.servos.len()).all(is_at_park);
        }
        if wrong.is_empty() {
            self.motions[servo].known = Some(us);
            self.known_until = started + KNOWN_S;
        } else {
            // What one pulse does wrong is one violation: a cut pulse is often too short as well.
            let what = format!("{} at {started:.4} s: {}", self.servos[servo], wrong.join(", "));
            self.note(pulse.to, Excuse::Supply, what);
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
        self.note(pulse.to, Excuse::Nothing, format!("{} at {:.4} s: {why}", self.servos[pulse.servo], pulse.from));
    }

    /// What came of the pulses so far.
    pub(crate) fn judged(&self) -> Judged {
        let first = self.violations.iter().take(DESCRIBED).map(|violation| violation.what.clone()).collect();
        Judged { violations: self.violations.len(), first, ..self.judged.clone() }
    }

    fn note(&mut self, ended: f64, excuse: Excuse, what: String) {
        self.violations.push(Violation { ended, excuse, what });
    }
}

/// Whether a pulse ended before the timer's compare value.
fn is_cut(us: f64, programmed_us: f64) -> bool {
    us < programmed_us * (1.0 - CRYSTAL_ERROR) - ROUNDING_US
}

#[cfg(test)]
mod tests;
