//! The run of a campaign. A copy of the process (`fork`) is a copy of the whole board at that moment: boot and ramp are executed once.

use std::io::Write;
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result, ensure};
use fork::{Fork, fork};
use rustix::process::{WaitOptions, wait};
use serde::Serialize;

use super::BoardRun;
use crate::campaign::{Campaign, Expected, Fault, Reaction};
use crate::inject::{Injection, InjectionKind};
use crate::report;

/// Between two phases, s: a little more than a tick, so that both the servo frame and the tick are met at all phases.
const PHASE_S: f64 = 1.05e-3;
/// Watched after a reaction, s: three servo frames.
const AFTERWARDS_S: f64 = 0.06;
/// Longest wait for the effect of a fault, such as the next call of a function, s.
const EFFECT_S: f64 = 1.2;
/// Between two messages.
const PROGRESS: Duration = Duration::from_secs(5);

/// Exit status of a case.
const GOOD: u8 = 0;
const WRONG: u8 = 1;

/// A fault at a phase, in a state: a line of the output.
#[derive(Debug, Serialize)]
struct Case<'a> {
    r#type: &'static str,
    fault: &'a str,
    state: &'a str,
    phase: u32,
    good: bool,
    /// Why it is not good.
    why: Option<String>,
    /// From the effect of the fault until no servo gets a pulse any more, us; null: they go on.
    off_us: Option<f64>,
    /// From the effect to the reset, us; null: no reset.
    reset_us: Option<f64>,
    /// Pulses that no servo may get.
    violations: usize,
}

/// Number of cases, and of those that were not good.
#[derive(Debug, Default, Serialize)]
struct Count {
    cases: u64,
    wrong: u64,
}

impl<W: Write> BoardRun<'_, W> {
    /// Runs the cases of a campaign, a line for each, `jobs` at a time: the first one and then one of `every`. Returns the exit status: 0 if all are good.
    ///
    /// # Errors
    /// A fault cannot be injected into this image, no process can be made, or the emulator fails.
    pub(crate) fn campaign(mut self, campaign: &Campaign, jobs: usize, every: usize) -> Result<u8> {
        let all: usize = campaign.faults.iter().map(|fault| fault.states.len()).sum();
        let all = (all * campaign.phases as usize).div_ceil(every);
        let (mut place, mut running, mut count) = (0_usize, 0, Count::default());
        let (began, mut said) = (Instant::now(), Instant::now());
        // A name that the image lacks is found before the first case.
        for fault in &campaign.faults {
            InjectionKind::of(&fault.inject, self.image).with_context(|| format!("fault `{}`", fault.name))?;
        }
        self.begin();
        for state in &campaign.states {
            self.run_until(state.at_s)?;
            let armed = self.output_state().armed;
            ensure!(
                armed == state.outputs,
                "state `{}` at {} s: the outputs are {}, the file says {}; change the times of the gestures, or `outputs`",
                state.name,
                state.at_s,
                on_or_off(armed),
                on_or_off(state.outputs)
            );
            for fault in campaign.faults.iter().filter(|fault| fault.states.contains(&state.name)) {
                for phase in 0..campaign.phases {
                    place += 1;
                    if !(place - 1).is_multiple_of(every) {
                        continue;
                    }
                    if running == jobs {
                        count.add(finished()?);
                        running -= 1;
                    }
                    if said.elapsed() > PROGRESS {
                        said = Instant::now();
                        eprintln!(
                            "campaign: {} of {all} cases, {} wrong, {:.0} s",
                            count.cases,
                            count.wrong,
                            began.elapsed().as_secs_f64()
                        );
                    }
                    match fork().map_err(|error| anyhow::anyhow!("cannot make a process: {error}"))? {
                        Fork::Parent(_) => running += 1,
                        Fork::Child => {
                            let code = self.case(campaign, fault, &state.name, phase, armed).unwrap_or_else(|error| {
                                eprintln!("virtual-board: fault `{}`, phase {phase}: {error:#}", fault.name);
                                WRONG
                            });
                            std::process::exit(code.into());
                        }
                    }
                }
            }
        }
        while running > 0 {
            count.add(finished()?);
            running -= 1;
        }
        #[derive(Serialize)]
        struct End {
            r#type: &'static str,
            #[serde(flatten)]
            count: Count,
            faults: usize,
            phases: u32,
            seconds: f64,
        }
        let seconds = (began.elapsed().as_secs_f64() * 10.0).round() / 10.0;
        let code = if count.wrong == 0 { GOOD } else { WRONG };
        write_line(&End { r#type: "end", count, faults: campaign.faults.len(), phases: campaign.phases, seconds })?;
        Ok(code)
    }

    /// Runs on to a time, s.
    fn run_until(&mut self, seconds: f64) -> Result<()> {
        self.pause_s = seconds;
        while self.cpu.machine().seconds() < seconds {
            self.step()?;
        }
        Ok(())
    }

    /// One case, in a process of its own. Returns its exit status.
    fn case(&mut self, campaign: &Campaign, fault: &Fault, state: &str, phase: u32, armed: bool) -> Result<u8> {
        let at = self.cpu.machine().seconds() + f64::from(phase) * PHASE_S;
        self.judge.begin_case(campaign.limits.clone());
        let kind = InjectionKind::of(&fault.inject, self.image)?;
        let lasts = fault.for_ms.map(|ms| ms * 1e-3);
        self.injections.push(Injection::new(kind, fault.name.clone(), at).lasting(lasts));
        self.schedule_stop();
        let Expected { reaction: expected, within_ms } = fault.expect;
        let mut until = at + EFFECT_S;
        let mut has_effect = false;
        loop {
            self.pause_s = until;
            self.step()?;
            let now = self.cpu.machine().seconds();
            let reaction = self.injections[0].reaction(now);
            if let (false, Some(effect)) = (has_effect, reaction.effect_s) {
                has_effect = true;
                until = effect + within_ms * 1e-3 + AFTERWARDS_S;
            }
            let off = off_us(&reaction);
            let is_decided = match expected {
                Reaction::Off => off.is_some(),
                Reaction::Reset => off.is_some() && reaction.reset_us.is_some(),
                Reaction::None | Reaction::OffOrNone | Reaction::Any => false,
            };
            if is_decided {
                until = until.min(now + AFTERWARDS_S);
            }
            if now >= until {
                break;
            }
        }
        let now = self.cpu.machine().seconds();
        let reaction = self.injections[0].reaction(now);
        let (violations, first) = self.judge.violations();
        let stays = self.output_state().armed == armed;
        let why = match first {
            Some(first) => Some(first.to_owned()),
            None => missed(fault.expect, &reaction, stays),
        };
        let (off_us, reset_us) = (off_us(&reaction), reaction.reset_us);
        let good = why.is_none();
        write_line(&Case {
            r#type: "case",
            fault: &fault.name,
            state,
            phase,
            good,
            why,
            off_us,
            reset_us,
            violations,
        })?;
        Ok(if good { GOOD } else { WRONG })
    }
}

const fn on_or_off(outputs: bool) -> &'static str {
    if outputs { "on" } else { "off" }
}

/// From the effect until the servos got no pulse or no supply, us.
fn off_us(reaction: &report::Reaction) -> Option<f64> {
    match (reaction.low_us, reaction.rail_us) {
        (Some(low), Some(rail)) => Some(low.min(rail)),
        (low, rail) => low.or(rail),
    }
}

/// What is missing from the expected reaction.
fn missed(
    Expected { reaction: expected, within_ms }: Expected,
    reaction: &report::Reaction,
    stays: bool,
) -> Option<String> {
    let in_time = |us: Option<f64>| us.is_some_and(|us| us <= within_ms * 1e3);
    let off = off_us(reaction);
    let ms = |us: Option<f64>| us.map_or("never".to_owned(), |us| format!("after {:.1} ms", us * 1e-3));
    match expected {
        Reaction::Any => None,
        Reaction::None | Reaction::OffOrNone if reaction.reset_us.is_none() && stays => None,
        Reaction::None => {
            Some(format!("nothing was to happen; outputs off {}, reset {}", ms(off), ms(reaction.reset_us)))
        }
        _ if reaction.effect_s.is_none() => Some("it had no effect".into()),
        Reaction::Off | Reaction::OffOrNone if in_time(off) => None,
        Reaction::Off | Reaction::OffOrNone => Some(format!("outputs off {}; allowed are {within_ms} ms", ms(off))),
        Reaction::Reset if in_time(off) && in_time(reaction.reset_us) => None,
        Reaction::Reset => {
            Some(format!("outputs off {}, reset {}; allowed are {within_ms} ms", ms(off), ms(reaction.reset_us)))
        }
    }
}

impl Count {
    fn add(&mut self, code: i32) {
        self.cases += 1;
        self.wrong += u64::from(code != i32::from(GOOD));
    }
}

/// Waits for the end of a case; its exit status, -1 after a signal.
fn finished() -> Result<i32> {
    let status = wait(WaitOptions::empty()).context("waiting for a case")?;
    Ok(status.and_then(|(_, status)| status.exit_status()).unwrap_or(-1))
}

/// Writes a line at once: lines of several processes do not mix.
fn write_line(line: &impl Serialize) -> Result<()> {
    let mut text = serde_json::to_vec(line)?;
    text.push(b'\n');
    let mut out = std::io::stdout().lock();
    out.write_all(&text)?;
    Ok(out.flush()?)
}
