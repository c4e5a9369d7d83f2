//! The cases of a campaign, each in a process of its own: what happens in a state, what it leads to, and whether that is as declared.

use std::io::Write;

use anyhow::Result;
use serde::Serialize;

use super::BoardRun;
use super::campaign::{Item, write_line};
use crate::campaign::{Campaign, Draw, Driving, Expected, Fault, Reaction, Sequence};
use crate::inject::{Injection, InjectionKind};
use crate::plant::ButtonPress;
use crate::report;

/// Between two phases, s: a little more than a tick, so that both the servo frame and the tick are met at all phases.
const PHASE_S: f64 = 1.05e-3;
/// Watched after a reaction, s: three servo frames.
const AFTERWARDS_S: f64 = 0.06;
/// Longest wait for the effect of a fault, such as the next call of a function, s.
const EFFECT_S: f64 = 1.2;
/// Watched after the last of several faults, s.
const AFTER_SEVERAL_S: f64 = 0.3;

/// A line of the output.
#[derive(Debug, Default, Serialize)]
struct Line<'a> {
    r#type: &'static str,
    /// Name of the fault or the sequence.
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<&'a str>,
    state: &'a str,
    good: bool,
    /// Why it is not good.
    why: Option<String>,
    /// Pulses that no servo may get.
    violations: usize,
    #[serde(flatten)]
    fault: Option<FaultTimes>,
    #[serde(flatten)]
    sequence: Option<SequenceResult>,
    #[serde(flatten)]
    several: Option<Drawn<'a>>,
}

/// What a fault led to.
#[derive(Debug, Serialize)]
struct FaultTimes {
    phase: u32,
    /// From the effect of the fault until no servo gets a pulse any more, us; null: they go on.
    off_us: Option<f64>,
    /// From the effect to the reset, us; null: no reset.
    reset_us: Option<f64>,
    /// From the effect until the supply of the servos or the main output is off, us; null: neither.
    decided_us: Option<f64>,
    /// From the effect to the end of the last pulse, us; null: they go on.
    low_us: Option<f64>,
}

/// What a sequence led to.
#[derive(Debug, Serialize)]
struct SequenceResult {
    /// When servos began to be driven, s after the state's time.
    drives_s: Vec<f64>,
    /// Edges at the servo pins.
    edges: u64,
    /// Causes of the resets.
    resets: Vec<String>,
    /// The log since the last boot, as hexadecimal digits.
    #[serde(skip_serializing_if = "Option::is_none")]
    log: Option<String>,
}

/// Several faults, as they were drawn.
#[derive(Debug, Serialize)]
struct Drawn<'a> {
    seed: u64,
    /// Each fault with its time after the state's, s.
    faults: Vec<(&'a str, f64)>,
}

impl<W: Write> BoardRun<'_, W> {
    /// One case; returns whether it is good.
    pub(super) fn case(&mut self, campaign: &Campaign, item: &Item<'_>, state: &str) -> Result<bool> {
        let outputs = self.output_state();
        let high_ms = match item {
            Item::Fault(fault, _) => fault.expect.high_ms,
            Item::Sequence(_) => None,
            Item::Several(draw) => draw.faults.iter().filter_map(|(_, fault)| fault.expect.high_ms).reduce(f64::max),
        };
        self.judge.begin_case(campaign.limits.clone(), high_ms.unwrap_or_default() * 1e-3);
        self.driving = Some(Driving::new(outputs.armed && outputs.rail));
        let now = self.cpu.machine().seconds();
        // Nothing of the run follows, but for what a sequence says.
        self.cpu.machine().plant.drop_presses_after(now);
        self.injections.retain(|injection| !injection.is_pending());
        let mut line = match item {
            Item::Fault(fault, phase) => self.one_fault(fault, *phase)?,
            Item::Sequence(sequence) => self.sequence(sequence)?,
            Item::Several(draw) => self.several(draw)?,
        };
        line.state = state;
        let (violations, first) = self.judge.violations();
        line.violations = violations;
        line.why = first.map(str::to_owned).or(line.why);
        line.good = line.why.is_none();
        write_line(&line)?;
        Ok(line.good)
    }

    fn one_fault<'a>(&mut self, fault: &'a Fault, phase: u32) -> Result<Line<'a>> {
        let armed = self.output_state().armed;
        let at = self.cpu.machine().seconds() + f64::from(phase) * PHASE_S;
        let place = self.injections.len();
        self.inject_at(fault, at)?;
        let Expected { reaction: expected, within_ms, .. } = fault.expect;
        let mut until = at + EFFECT_S;
        let mut has_effect = false;
        let mut stood = 0;
        loop {
            self.pause_s = until;
            self.step_on(&mut stood)?;
            let now = self.cpu.machine().seconds();
            let reaction = self.injections[place].reaction(now);
            if let (false, Some(effect)) = (has_effect, reaction.effect_s) {
                has_effect = true;
                until = effect + within_ms * 1e-3 + AFTERWARDS_S;
            }
            let is_off = first_of(reaction.low_us, reaction.rail_us).is_some();
            let is_decided = match expected {
                Reaction::Off => is_off,
                Reaction::Reset => is_off && reaction.reset_us.is_some(),
                Reaction::None | Reaction::OffOrNone | Reaction::Any => false,
            };
            if is_decided {
                until = until.min(now + AFTERWARDS_S);
            }
            if now >= until {
                break;
            }
        }
        let reaction = self.injections[place].reaction(self.cpu.machine().seconds());
        let stays = self.output_state().armed == armed;
        Ok(Line {
            r#type: "case",
            name: Some(&fault.name),
            why: missed(fault.expect, &reaction, stays),
            fault: Some(FaultTimes {
                phase,
                off_us: first_of(reaction.low_us, reaction.rail_us),
                reset_us: reaction.reset_us,
                decided_us: first_of(reaction.disarmed_us, reaction.rail_us),
                low_us: reaction.low_us,
            }),
            ..Line::default()
        })
    }

    fn sequence<'a>(&mut self, sequence: &'a Sequence) -> Result<Line<'a>> {
        let from = self.cpu.machine().seconds();
        let (resets, edges) = (self.resets.len(), self.servo_edges());
        self.log = sequence.log.then(String::new);
        for one in &sequence.injects {
            let kind = InjectionKind::of(&one.what, self.image)?;
            self.injections.push(Injection::new(kind, sequence.name.clone(), from + one.at_s));
        }
        let after = |press: &_| {
            let press = ButtonPress::from(*press);
            ButtonPress { at: from + press.at, ..press }
        };
        {
            let mut board = self.cpu.machine();
            sequence.presses.iter().for_each(|press| board.plant.press_button(after(press)));
            sequence.emergency_stops.iter().for_each(|press| board.plant.press_emergency_stop(after(press)));
        }
        self.schedule_stop();
        self.run_until(from + sequence.lasts_s)?;
        self.drain_rtt();
        let began = self.driving.as_ref().map_or(&[][..], |driving| driving.began());
        let drives_s = began.iter().map(|at| report::seconds(at - from)).collect();
        Ok(Line {
            r#type: "sequence",
            name: Some(&sequence.name),
            sequence: Some(SequenceResult {
                drives_s,
                edges: self.servo_edges() - edges,
                resets: self.resets[resets..].iter().map(|reset| reset.cause.clone()).collect(),
                log: self.log.take(),
            }),
            ..Line::default()
        })
    }

    fn several<'a>(&mut self, draw: &Draw<'a>) -> Result<Line<'a>> {
        let from = self.cpu.machine().seconds();
        for (at_s, fault) in &draw.faults {
            self.inject_at(fault, from + at_s)?;
        }
        let last = draw.faults.last().map_or(0.0, |(at_s, _)| *at_s);
        self.run_until(from + last + AFTER_SEVERAL_S)?;
        Ok(Line {
            r#type: "several",
            several: Some(Drawn {
                seed: draw.seed,
                faults: draw.faults.iter().map(|(at_s, fault)| (fault.name.as_str(), *at_s)).collect(),
            }),
            ..Line::default()
        })
    }

    fn inject_at(&mut self, fault: &Fault, at: f64) -> Result<()> {
        let kind = InjectionKind::of(&fault.inject, self.image)?;
        let lasts_s = fault.for_ms.map(|ms| ms * 1e-3);
        self.injections.push(Injection::new(kind, fault.name.clone(), at).lasting(lasts_s));
        self.schedule_stop();
        Ok(())
    }

    /// Edges of the servo pins so far.
    fn servo_edges(&self) -> u64 {
        let board = self.cpu.machine();
        let pulses = &board.plant.pulses;
        pulses.servos().iter().filter_map(|pin| pulses.edges().get(pin)).sum()
    }
}

/// The earlier one.
fn first_of(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    }
}

/// What is missing from the expected reaction.
fn missed(expect: Expected, reaction: &report::Reaction, stays: bool) -> Option<String> {
    let Expected { reaction: expected, within_ms, decided_within_us, low_within_ms, high_ms: _ } = expect;
    let late = |us: Option<f64>, most_us: f64| us.is_none_or(|us| us > most_us);
    let in_time = |us: Option<f64>| !late(us, within_ms * 1e3);
    let off = first_of(reaction.low_us, reaction.rail_us);
    let ms = |us: Option<f64>| us.map_or("never".to_owned(), |us| format!("after {:.3} ms", us * 1e-3));
    let reset = ms(reaction.reset_us);
    let wrong = match expected {
        Reaction::Any => None,
        Reaction::None | Reaction::OffOrNone if reaction.reset_us.is_none() && stays => None,
        Reaction::None => Some(format!("nothing was to happen; outputs off {}, reset {reset}", ms(off))),
        _ if reaction.effect_s.is_none() => Some("it had no effect".into()),
        Reaction::Off | Reaction::OffOrNone if in_time(off) => None,
        Reaction::Off | Reaction::OffOrNone => Some(format!("outputs off {}; allowed are {within_ms} ms", ms(off))),
        Reaction::Reset if in_time(off) && in_time(reaction.reset_us) => None,
        Reaction::Reset => Some(format!("outputs off {}, reset {reset}; allowed are {within_ms} ms", ms(off))),
    };
    let decided = first_of(reaction.disarmed_us, reaction.rail_us);
    wrong
        .or_else(|| {
            let most = decided_within_us.filter(|most| late(decided, *most))?;
            Some(format!("supply or main output off {}; allowed are {most} us", ms(decided)))
        })
        .or_else(|| {
            let most = low_within_ms.filter(|most| late(reaction.low_us, most * 1e3))?;
            Some(format!("pulses end {}; allowed are {most} ms", ms(reaction.low_us)))
        })
}
