//! The cases of a campaign, each in a process of its own: what happens in a state, what it leads to, and whether that is as declared.

use std::io::Write;

use anyhow::{Context as _, Result};
use joint_loop::SupervisorState;
use rustix::fs::{FlockOperation, fcntl_lock};
use serde::Serialize;

use super::{BoardRun, PERIODIC_JOB_S};
use crate::campaign::{Campaign, Draw, Driving, End, Expected, Fault, Reaction, Reports, Sequence, Status};
use crate::inject::{Injection, InjectionKind};
use crate::plant::ButtonPress;
use crate::report;
use crate::script::Inject;

/// Between two phases, s: a little more than a tick, so that both the servo frame and the tick are met at all phases.
const PHASE_S: f64 = 1.05e-3;
/// Watched after a reaction, s: three servo frames.
const AFTERWARDS_S: f64 = 0.06;
/// Longest wait for the effect of a fault, such as the next call of a function, s.
const EFFECT_S: f64 = 1.2;
/// Longest wait for the first report of a boot, and what the log needs after it, s.
const BOOT_S: f64 = 1.0;
const LOG_S: f64 = 0.05;
/// Watched after the last of several faults, s.
const AFTER_SEVERAL_S: f64 = 0.3;

/// A case, which begins in a state.
#[derive(Debug)]
pub(super) enum Item<'a> {
    /// A fault at a phase of the servo frame.
    Fault(&'a Fault, u32),
    /// Gestures and faults.
    Sequence(&'a Sequence),
    /// Several faults at random.
    Several(Draw<'a>),
}

impl<'a> Item<'a> {
    /// Name of its fault or sequence.
    pub(super) fn name(&self) -> Option<&'a str> {
        match self {
            Item::Fault(fault, _) => Some(&fault.name),
            Item::Sequence(sequence) => Some(&sequence.name),
            Item::Several(_) => None,
        }
    }
}

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
    fault: Option<FaultTimes<'a>>,
    #[serde(flatten)]
    sequence: Option<SequenceResult>,
    #[serde(flatten)]
    several: Option<Drawn<'a>>,
}

/// What a fault led to.
#[derive(Debug, Serialize)]
struct FaultTimes<'a> {
    phase: u32,
    /// The name under which it is counted.
    row: &'a str,
    /// The outputs were on before.
    outputs: bool,
    /// The reaction that came; null: none that a file can declare.
    reaction: Option<Reaction>,
    /// State and cause that the board gives at the end.
    says: Option<String>,
    /// Only the limits of the pulses were judged.
    pulses_alone: bool,
    /// Processor time of the case, ms.
    cpu_ms: Option<f64>,
    /// From the effect of the fault until no servo gets a pulse any more, us; null: they go on.
    off_us: Option<f64>,
    /// From the effect to the reset, us; null: no reset.
    reset_us: Option<f64>,
    /// From the effect until the supply of the servos or the main output is off, us; null: neither.
    decided_us: Option<f64>,
    /// From the effect until the supply of the servos is off, us; null: it stays on.
    supply_us: Option<f64>,
    /// From the effect to the end of the last pulse, us; null: they go on.
    low_us: Option<f64>,
    /// What the boot after the reset says, if it is asked for.
    #[serde(flatten)]
    boot: Option<BootSays<'a>>,
}

/// The boot after a reset, for who can read its log.
#[derive(Debug, Serialize)]
struct BootSays<'a> {
    /// Causes of the resets of the case: more than one if what the fault changed was still there.
    resets: Vec<String>,
    /// What the boot may give as the end of the run.
    allowed: &'a [End],
    /// The log for people and the records since the last reset, as hexadecimal digits.
    log: [String; 2],
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
    /// The log for people and the records since the last boot, as hexadecimal digits.
    #[serde(skip_serializing_if = "Option::is_none")]
    log: Option<[String; 2]>,
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
    pub(super) fn case(&mut self, campaign: &Campaign, item: &Item<'_>, state: &str, boot_log: bool) -> Result<bool> {
        let outputs = self.output_state();
        let high_ms = match item {
            Item::Fault(fault, _) => fault.expected(outputs.armed).high_ms,
            Item::Sequence(_) => None,
            Item::Several(draw) => draw.faults.iter().filter_map(|(_, fault)| fault.expect.high_ms).reduce(f64::max),
        };
        self.judge.begin_case(campaign.limits.clone(), high_ms.unwrap_or_default() * 1e-3);
        self.driving = Some(Driving::new(outputs.armed && outputs.rail));
        let now = self.cpu.machine().seconds();
        // Nothing of the run follows, but for what a sequence says.
        self.cpu.machine().plant.drop_presses_after(now);
        self.injections.retain(|injection| !injection.is_pending());
        let line = match item {
            Item::Fault(fault, phase) => {
                self.log = boot_log.then(Default::default);
                self.one_fault(fault, *phase)
            }
            Item::Sequence(sequence) => self.sequence(sequence),
            Item::Several(draw) => self.several(draw),
        };
        // A fault that the model cannot inject is one that nothing is known about.
        let mut line = line.unwrap_or_else(|error| Line {
            r#type: if matches!(item, Item::Fault(..)) { "case" } else { "error" },
            name: item.name(),
            why: Some(format!("{error:#}")),
            ..Line::default()
        });
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
        let before = self.reports.status;
        self.reports.begin();
        let at = self.cpu.machine().seconds() + f64::from(phase) * PHASE_S;
        let (place, resets) = (self.injections.len(), self.resets.len());
        self.inject_at(fault, at)?;
        let expected = fault.expected(armed);
        let mut until = at + EFFECT_S;
        let mut has_effect = false;
        let mut frames_before = 0;
        let mut edges_before = Vec::new();
        let mut fault_ends_s = at;
        let mut said_s = None;
        let mut decided_s = None;
        let mut stood = 0;
        loop {
            self.pause_s = until;
            self.step_on(&mut stood)?;
            let now = self.cpu.machine().seconds();
            let reaction = self.injections[place].reaction(now);
            if let (false, Some(effect)) = (has_effect, reaction.effect_s) {
                has_effect = true;
                frames_before = self.reports.frames;
                edges_before = self.edges_of_servos();
                let lasts_ms = fault.for_ms.filter(|_| fault.inject.can_end());
                fault_ends_s = effect + lasts_ms.unwrap_or_default() * 1e-3;
                until = effect + expected.within_ms * 1e-3 + AFTERWARDS_S;
            }
            let says = says(&self.reports, before, expected);
            if has_effect && says != Some(Reaction::None) {
                said_s = said_s.or(Some(now));
            }
            let is_off = first_of(reaction.low_us, reaction.rail_us).is_some();
            let is_decided = match says {
                _ if reaction.reset_us.is_some() => is_off && expected.allows(Reaction::Reset),
                _ if armed && is_off => expected.allows(Reaction::Off),
                Some(said) if said_s.is_some() && said != Reaction::None => {
                    expected.allows(said) && !expected.allows(Reaction::Reset)
                }
                _ => false,
            };
            if is_decided {
                let decided = *decided_s.get_or_insert(now);
                // A chip that is held in reset boots at the end of the fault.
                until = match reaction.reset_us {
                    Some(_) => f64::max(decided, fault_ends_s) + AFTERWARDS_S,
                    None => until.min(decided + AFTERWARDS_S),
                };
            }
            if now >= until {
                break;
            }
        }
        let reaction = self.injections[place].reaction(self.cpu.machine().seconds());
        let outcome = Outcome {
            armed,
            is_latched: before.is_some_and(|before| before.state == SupervisorState::Fault),
            stays: self.output_state().armed == armed,
            says: says(&self.reports, before, expected),
            said_us: said_s.zip(reaction.effect_s).map(|(said, effect)| (said - effect) * 1e6),
            reaction: &reaction,
        };
        let seen = outcome.seen();
        let has_counted = expected.counts.is_none_or(|counter| self.reports.count(counter) > 0);
        let uncounted = || (!has_counted).then(|| format!("the board did not count it: {:?}", expected.counts));
        let is_silent = seen == Some(Reaction::None) && self.reports.frames == frames_before;
        let silent = || is_silent.then(|| "the board reports nothing any more".to_owned());
        let stands = || {
            let mut edges = edges_before.iter().zip(self.edges_of_servos());
            let servo =
                edges.position(|(before, now)| *before == now).filter(|_| armed && seen == Some(Reaction::None))?;
            Some(format!("servo {} gets no pulses any more", servo + 1))
        };
        let why = missed(expected, &outcome, self.reports.status).or_else(uncounted).or_else(silent).or_else(stands);
        let says = self.reports.status.map(|status| status.to_string());
        let log = if reaction.reset_us.is_some() { self.log_of_boot()? } else { None };
        let boot = log.map(|log| BootSays {
            resets: self.resets[resets..].iter().map(|reset| reset.cause.clone()).collect(),
            allowed: &expected.ends,
            log,
        });
        Ok(Line {
            r#type: "case",
            name: Some(&fault.name),
            why,
            fault: Some(FaultTimes {
                phase,
                row: fault.row(),
                outputs: armed,
                reaction: seen,
                says,
                pulses_alone: expected.is_of_the_pulses_alone(),
                cpu_ms: cpu_s().map(|seconds| report::micros(seconds * 1e6) * 1e-3),
                off_us: first_of(reaction.low_us, reaction.rail_us),
                reset_us: reaction.reset_us,
                decided_us: first_of(reaction.disarmed_us, reaction.rail_us),
                supply_us: reaction.rail_us,
                low_us: reaction.low_us,
                boot,
            }),
            ..Line::default()
        })
    }

    /// What the boot after the last reset says; `None`: nobody asked for it.
    fn log_of_boot(&mut self) -> Result<Option<[String; 2]>> {
        if self.log.is_some() {
            let end = self.now_s() + BOOT_S;
            while self.reports.status.is_none() && self.now_s() < end {
                self.run_until(self.now_s() + PERIODIC_JOB_S)?;
            }
            self.run_until(self.now_s() + LOG_S)?;
            self.drain_rtt();
            // A board that a fault resets again and again can be between a reset and its first words: those of this boot, or of the next.
            let end = self.now_s() + BOOT_S;
            while self.log.as_ref().is_some_and(|[_, records]| records.is_empty()) && self.now_s() < end {
                self.run_until(self.now_s() + PERIODIC_JOB_S)?;
                self.drain_rtt();
            }
        }
        Ok(self.log.take())
    }

    fn sequence<'a>(&mut self, sequence: &'a Sequence) -> Result<Line<'a>> {
        let from = self.cpu.machine().seconds();
        let (resets, edges) = (self.resets.len(), self.servo_edges());
        self.log = sequence.log.then(Default::default);
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
        for serial in &sequence.serial {
            self.send(from + serial.at_s, &serial.bytes)?;
        }
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
        self.has_several_faults = true;
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
        let lasts = |inject: &Inject| fault.for_ms.filter(|_| inject.can_end()).map(|ms| ms * 1e-3);
        self.injections.push(Injection::new(kind, fault.name.clone(), at).lasting(lasts(&fault.inject)));
        if let Some(then) = &fault.then {
            let kind = InjectionKind::of(then, self.image)?;
            let at = at + fault.then_after_ms * 1e-3;
            self.injections.push(Injection::new(kind, fault.name.clone(), at).lasting(lasts(then)));
        }
        self.schedule_stop();
        Ok(())
    }

    /// Edges of the servo pins so far.
    fn servo_edges(&self) -> u64 {
        self.edges_of_servos().iter().sum()
    }

    /// The same of each.
    fn edges_of_servos(&self) -> Vec<u64> {
        let board = self.cpu.machine();
        let pulses = &board.plant.pulses;
        pulses.servos().iter().map(|pin| pulses.edges().get(pin).copied().unwrap_or_default()).collect()
    }
}

/// The earlier one.
fn first_of(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    }
}

/// Writes a line at once. Lines of several processes do not mix: each locks the output while it writes. Where a system has no locks for a pipe, long
/// lines can mix, which the reader of the lines finds.
pub(super) fn write_line(line: &impl Serialize) -> Result<()> {
    let mut text = serde_json::to_vec(line)?;
    text.push(b'\n');
    let mut out = std::io::stdout().lock();
    let locked = fcntl_lock(&out, FlockOperation::LockExclusive).is_ok();
    let written = out.write_all(&text).and_then(|()| out.flush());
    if locked {
        fcntl_lock(&out, FlockOperation::Unlock).context("unlocking the output")?;
    }
    Ok(written?)
}

/// Processor time of this process, s; `None` where the system does not say it in this file.
pub(super) fn cpu_s() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/schedstat").ok()?;
    Some(text.split(' ').next()?.parse::<f64>().ok()? * 1e-9)
}

/// The reaction by what the board says of itself; `None`: one that no file can declare.
fn says(reports: &Reports, before: Option<Status>, expected: &Expected) -> Option<Reaction> {
    let (before, now) = (before?, reports.status?);
    if before.state == SupervisorState::Fault && now == before {
        // It is latched: only the inputs of the ticks show another fault, of those that they carry.
        let is_seen = expected.causes.iter().any(|cause| reports.saw_fault(cause.0));
        return Some(if is_seen { Reaction::Fault } else { Reaction::None });
    }
    match now {
        _ if now == before => Some(Reaction::None),
        Status { state: SupervisorState::Fault, .. } => Some(Reaction::Fault),
        Status { state, .. } if state == before.state => Some(Reaction::Cause),
        _ => None,
    }
}

/// What came of a fault.
struct Outcome<'a> {
    /// The outputs were on before.
    armed: bool,
    /// The supervisor was in the state `fault`, which keeps its cause.
    is_latched: bool,
    /// They are as before.
    stays: bool,
    /// By the board's own reports, and when they first said so, us after the effect.
    says: Option<Reaction>,
    said_us: Option<f64>,
    reaction: &'a report::Reaction,
}

impl Outcome<'_> {
    fn off_us(&self) -> Option<f64> {
        first_of(self.reaction.low_us, self.reaction.rail_us)
    }

    /// The reaction that came; `None`: one that no file can declare.
    fn seen(&self) -> Option<Reaction> {
        match self.says {
            _ if self.reaction.reset_us.is_some() => Some(Reaction::Reset),
            _ if self.armed && self.off_us().is_some() => Some(Reaction::Off),
            _ if !self.stays => None,
            // Servos that are driven in the state `fault`.
            Some(Reaction::Fault) if self.armed => None,
            says => says,
        }
    }

    /// When it came, us after the effect; `None`: not yet. A reset after another reaction that is allowed came with that.
    fn us(&self, seen: Reaction, expected: &Expected) -> Option<f64> {
        match seen {
            Reaction::Off => self.off_us(),
            Reaction::Reset if self.armed && expected.allows(Reaction::Off) => self.off_us(),
            Reaction::Reset if !self.armed && expected.allows(Reaction::Fault) => {
                self.said_us.or(self.reaction.reset_us)
            }
            Reaction::Reset => self.reaction.reset_us.zip(self.off_us()).map(|(reset, off)| reset.max(off)),
            Reaction::Fault | Reaction::Cause => self.said_us.or(Some(0.0)),
            Reaction::None => Some(0.0),
        }
    }
}

/// What is missing from the expected reactions.
fn missed(expected: &Expected, outcome: &Outcome<'_>, status: Option<Status>) -> Option<String> {
    let Expected { within_ms, reset_within_ms, decided_within_us, low_within_ms, .. } = *expected;
    let reaction = outcome.reaction;
    let late = |us: Option<f64>, most_us: f64| us.is_none_or(|us| us > most_us);
    let ms = |us: Option<f64>| us.map_or("never".to_owned(), |us| format!("after {:.3} ms", us * 1e-3));
    let says = status.map_or_else(|| "nothing".to_owned(), |status| status.to_string());
    let came = || {
        let (off, reset) = (ms(outcome.off_us()), ms(reaction.reset_us));
        format!("outputs off {off}, reset {reset}, the board says {says}")
    };
    let allowed: Vec<&str> = expected.reactions.iter().map(|one| one.name()).collect();
    let allowed = || format!("allowed: {} in {within_ms} ms", allowed.join(" or "));
    let seen = outcome.seen();
    let wrong = match seen {
        _ if reaction.effect_s.is_none() => Some("it had no effect".to_owned()),
        _ if expected.is_of_the_pulses_alone() => None,
        Some(seen) if expected.allows(seen) && !late(outcome.us(seen, expected), within_ms * 1e3) => None,
        _ => Some(format!("{}; {}", came(), allowed())),
    };
    let decided = first_of(reaction.disarmed_us, reaction.rail_us);
    // After a reset the board has no cause.
    let gives = |status: Status| expected.causes.iter().any(|cause| cause.0 == status.cause);
    let needs_cause = matches!(seen, Some(Reaction::Off | Reaction::Fault | Reaction::Cause));
    wrong
        .or_else(|| {
            let is_wrong =
                needs_cause && !outcome.is_latched && !expected.causes.is_empty() && !status.is_some_and(gives);
            let names: Vec<&str> = expected.causes.iter().map(|cause| cause.name()).collect();
            is_wrong.then(|| format!("{}; allowed causes: {}", came(), names.join(", ")))
        })
        .or_else(|| {
            let most = reset_within_ms.filter(|_| reaction.reset_us.is_some())?;
            let is_late = late(reaction.reset_us, most * 1e3) || outcome.armed && late(outcome.off_us(), most * 1e3);
            let (off, reset) = (ms(outcome.off_us()), ms(reaction.reset_us));
            is_late.then(|| format!("reset {reset}, outputs off {off}; allowed are {most} ms"))
        })
        .or_else(|| {
            let most = decided_within_us.filter(|most| late(decided, *most))?;
            Some(format!("supply or main output off {}; allowed are {most} us", ms(decided)))
        })
        .or_else(|| {
            let most = low_within_ms.filter(|most| late(reaction.low_us, most * 1e3))?;
            Some(format!("pulses end {}; allowed are {most} ms", ms(reaction.low_us)))
        })
}
