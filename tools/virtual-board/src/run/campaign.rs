//! The run of a campaign. A copy of the process (`fork`) is a copy of the whole board at that moment: boot and ramp are executed once.

use std::io::Write;
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result, bail, ensure};
use fork::{Fork, fork};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{WaitOptions, wait};
use serde::Serialize;

use super::BoardRun;
use super::case::{Item, cpu_s, write_line};
use crate::campaign::{Campaign, Run, Several};
use crate::cpu::{Cpu as _, Reg};
use crate::inject::{Injection, InjectionKind};
use crate::report;

/// Between two messages.
const PROGRESS: Duration = Duration::from_secs(5);

/// Exit status of a case.
const GOOD: u8 = 0;
const WRONG: u8 = 1;

/// What of a campaign is run, and how.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plan<'a> {
    /// Name of the run.
    pub(crate) run: &'a str,
    /// Only faults and sequences whose name contains this.
    pub(crate) only: Option<&'a str>,
    /// Several faults at once instead of single ones.
    pub(crate) several: Option<Several>,
    /// One case of so many, the first one included.
    pub(crate) every: usize,
    /// Cases at a time.
    pub(crate) jobs: usize,
    /// After a reset a case goes on until the board has said why, and its line has the log of that boot.
    pub(crate) boot_log: bool,
}

impl Plan<'_> {
    /// The cases of a run, in the order of its states, each with the number of its state.
    fn items<'a>(&self, campaign: &'a Campaign, run: &'a Run) -> Vec<(usize, Item<'a>)> {
        let chosen = |name: &str| self.only.is_none_or(|only| name.contains(only));
        let number_of = |state: &str| run.states.iter().position(|one| one.name == state);
        let mut items = Vec::new();
        if let Some(several) = self.several {
            let draws = several.draws(campaign).step_by(self.every);
            items.extend(draws.filter_map(|draw| Some((number_of(draw.state)?, Item::Several(draw)))));
        } else {
            for (place, fault) in campaign.faults.iter().enumerate().filter(|(_, fault)| chosen(&fault.name)) {
                let cases = campaign.cases_of(fault);
                for case in sample(cases.len(), self.every, place) {
                    let (state, phase) = cases[case];
                    items.extend(number_of(state).map(|number| (number, Item::Fault(fault, phase))));
                }
            }
            let here = campaign.sequences.iter().filter(|one| chosen(&one.name)).step_by(self.every);
            items.extend(here.filter_map(|one| Some((number_of(&one.state)?, Item::Sequence(one)))));
        }
        // Stable: within a state the order is that of the file.
        items.sort_by_key(|(number, _)| *number);
        items
    }
}

/// Of so many cases of a fault one in `every`, at least one, evenly spread. Where they begin differs from fault to fault (by the golden section, which
/// meets every part of the cases alike), so that all states and phases are met.
fn sample(cases: usize, every: usize, place: usize) -> impl Iterator<Item = usize> {
    const GOLDEN_SECTION: f64 = 0.618_034;
    let count = (cases / every).max(1).min(cases);
    let first = ((place as f64 * GOLDEN_SECTION).fract() * cases as f64) as usize;
    (0..count).map(move |n| (first + n * cases / count) % cases)
}

impl<W: Write> BoardRun<'_, W> {
    /// Runs the cases of a campaign, a line for each. Returns the exit status: 0 if all are good.
    ///
    /// # Errors
    /// There is no such run, a fault cannot be injected into this image, a state is not as declared, no process can be made, or the emulator fails.
    pub(crate) fn campaign(mut self, campaign: &Campaign, plan: &Plan<'_>) -> Result<u8> {
        let run = campaign.run(plan.run)?;
        let items = plan.items(campaign, run);
        let mut pool = Pool::new(items.len(), plan.jobs);
        // A name that the image lacks is found before the first case.
        for fault in &campaign.faults {
            for inject in [Some(&fault.inject), fault.then.as_ref()].into_iter().flatten() {
                InjectionKind::of(inject, self.image).with_context(|| format!("fault `{}`", fault.name))?;
            }
        }
        self.prepare(run)?;
        self.begin();
        let mut sent = 0;
        let mut items = items.into_iter().peekable();
        for (number, state) in run.states.iter().enumerate() {
            if items.peek().is_none() {
                break;
            }
            let before_s = cpu_s();
            while let Some(serial) = run.serial.get(sent).filter(|serial| serial.at_s <= state.at_s) {
                self.send(serial.at_s, &serial.bytes)?;
                sent += 1;
            }
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
            let says = self.reports.status.map_or_else(|| "nothing".to_owned(), |status| status.to_string());
            ensure!(
                says == state.says,
                "state `{}` at {} s: the board says `{says}`, the file says `{}`; change the times of the gestures, or `says`",
                state.name,
                state.at_s,
                state.says
            );
            pool.count_boot(before_s.zip(cpu_s()).map(|(before, now)| now - before));
            while let Some((_, item)) = items.next_if(|(at, _)| *at == number) {
                pool.wait_for_slot()?;
                pool.alone_s += pool.boot_s;
                match fork().map_err(|error| anyhow::anyhow!("cannot make a process: {error}"))? {
                    Fork::Parent(_) => pool.running += 1,
                    Fork::Child => {
                        let good = self.case(campaign, &item, &state.name, plan.boot_log).unwrap_or_else(|error| {
                            eprintln!("virtual-board: {item:?}: {error:#}");
                            false
                        });
                        std::process::exit(if good { GOOD } else { WRONG }.into());
                    }
                }
            }
        }
        pool.end(campaign)
    }

    /// Schedules the gestures and faults of a run.
    fn prepare(&mut self, run: &Run) -> Result<()> {
        for one in &run.injects {
            let kind = InjectionKind::of(&one.what, self.image).with_context(|| format!("run `{}`", run.name))?;
            self.injections.push(Injection::new(kind, run.name.clone(), one.at_s));
        }
        let mut board = self.cpu.machine();
        run.presses.iter().for_each(|press| board.plant.press_button((*press).into()));
        run.emergency_stops.iter().for_each(|press| board.plant.press_emergency_stop((*press).into()));
        Ok(())
    }

    /// Runs on to a time, s, and sends bytes on the serial port.
    pub(super) fn send(&mut self, seconds: f64, bytes: &[u8]) -> Result<()> {
        self.run_until(seconds)?;
        self.cpu.machine().soc.put_serial(bytes);
        self.judge.host_sent();
        Ok(())
    }

    /// Runs on to a time, s.
    pub(super) fn run_until(&mut self, seconds: f64) -> Result<()> {
        let mut stood = 0;
        self.pause_s = seconds;
        while self.cpu.machine().seconds() < seconds {
            self.step_on(&mut stood)?;
        }
        Ok(())
    }

    /// A step of the run; `stood` counts those in a row in which no time passed.
    ///
    /// # Errors
    /// There were too many: the models want to act at a time that has come, and do not.
    pub(super) fn step_on(&mut self, stood: &mut u32) -> Result<()> {
        /// Far more than happen at one moment.
        const MOST: u32 = 100_000;
        let before = self.cpu.machine().now();
        self.step()?;
        let now = self.cpu.machine().now();
        *stood = if now == before { *stood + 1 } else { 0 };
        if *stood > MOST {
            let pc = self.cpu.reg(Reg::Pc);
            let board = self.cpu.machine();
            bail!(
                "the virtual board's time stands still at {} s, cycle {now}: idle {:?}, at {pc:#010x}, {}",
                board.seconds(),
                self.idle,
                board.deadlines()
            );
        }
        Ok(())
    }
}

/// Cases that run side by side.
struct Pool {
    all: usize,
    jobs: usize,
    running: usize,
    count: Count,
    began: Instant,
    said: Instant,
    /// Processor time from power-on to the present state, s: without the copies, each case would need it.
    boot_s: f64,
    /// The same, of all cases.
    alone_s: f64,
}

/// Number of cases, and of those that were not good.
#[derive(Debug, Default, Serialize)]
struct Count {
    cases: u64,
    wrong: u64,
}

impl Pool {
    fn new(all: usize, jobs: usize) -> Self {
        let now = Instant::now();
        Pool { all, jobs, running: 0, count: Count::default(), began: now, said: now, boot_s: 0.0, alone_s: 0.0 }
    }

    /// Counts processor time that led to the present state, s.
    fn count_boot(&mut self, seconds: Option<f64>) {
        self.boot_s += seconds.unwrap_or_default();
    }

    /// Waits until another case may begin, and says how far the campaign is.
    ///
    /// # Errors
    /// Nobody reads the lines any more: further cases would be for nothing.
    fn wait_for_slot(&mut self) -> Result<()> {
        ensure!(!is_output_closed()?, "nobody reads the results of the campaign any more; it ends");
        if self.running == self.jobs {
            self.wait_for_one()?;
        }
        if self.said.elapsed() > PROGRESS {
            self.said = Instant::now();
            let (Count { cases, wrong }, seconds) = (&self.count, self.began.elapsed().as_secs_f64());
            eprintln!("campaign: {cases} of {} cases, {wrong} wrong, {seconds:.0} s", self.all);
        }
        Ok(())
    }

    /// Waits for the end of a case. One that a signal ended is wrong.
    fn wait_for_one(&mut self) -> Result<()> {
        let status = wait(WaitOptions::empty()).context("waiting for a case")?;
        let code = status.and_then(|(_, status)| status.exit_status());
        self.count.cases += 1;
        self.count.wrong += u64::from(code != Some(GOOD.into()));
        self.running -= 1;
        Ok(())
    }

    /// Waits for all, and writes the last line. Returns the exit status.
    fn end(mut self, campaign: &Campaign) -> Result<u8> {
        while self.running > 0 {
            self.wait_for_one()?;
        }
        #[derive(Serialize)]
        struct End {
            r#type: &'static str,
            #[serde(flatten)]
            count: Count,
            faults: usize,
            phases: u32,
            seconds: f64,
            /// Processor time of the boot and the way to the last state, once.
            boot_cpu_s: f64,
            /// The same with the copies of the process.
            parent_cpu_s: f64,
            /// The same, if each case had its own.
            alone_cpu_s: f64,
        }
        let code = if self.count.wrong == 0 { GOOD } else { WRONG };
        let seconds = (self.began.elapsed().as_secs_f64() * 10.0).round() / 10.0;
        let (faults, phases) = (campaign.faults.len(), campaign.phases);
        let parent_s = cpu_s().unwrap_or_default();
        let [boot_cpu_s, parent_cpu_s, alone_cpu_s] = [self.boot_s, parent_s, self.alone_s].map(report::seconds);
        let count = self.count;
        write_line(&End { r#type: "end", count, faults, phases, seconds, boot_cpu_s, parent_cpu_s, alone_cpu_s })?;
        Ok(code)
    }
}

/// Whether standard output is a pipe whose reader has closed it.
fn is_output_closed() -> Result<bool> {
    let stdout = std::io::stdout();
    let mut output = [PollFd::new(&stdout, PollFlags::OUT)];
    poll(&mut output, Some(&Timespec::default())).context("asking for the state of the output")?;
    Ok(output[0].revents().intersects(PollFlags::ERR | PollFlags::HUP))
}

const fn on_or_off(outputs: bool) -> &'static str {
    if outputs { "on" } else { "off" }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn a_sample_has_each_fault_and_is_spread() {
        let all: Vec<usize> = sample(160, 1, 7).collect();
        assert_eq!(all.iter().copied().collect::<BTreeSet<_>>(), (0..160).collect());
        assert_eq!(all.len(), 160);
        // One of 61 of 160 cases are two; of fewer than 61 one.
        assert_eq!((sample(160, 61, 3).count(), sample(40, 61, 3).count(), sample(20, 1000, 3).count()), (2, 1, 1));
        let mut seen = BTreeSet::new();
        for place in 0..600 {
            seen.extend(sample(160, 61, place));
        }
        assert_eq!(seen.len(), 160, "every state and phase is met by a fault");
        assert_eq!(sample(0, 3, 1).count(), 0);
    }
}
