//! `footfall replay`: runs the control loop of this program with the inputs of a capture, and compares every tick with it, bit for bit.

use clap::Args;
use joint_loop::setup::default_loop::BoardLoop;
use serde_json::{Value, json};
use std::path::PathBuf;
use wire::Frame;

use crate::board::host_copy::loop_of;
use crate::board::replay::Difference;
use crate::failure::Failure;
use crate::file::capture::recorded;
use crate::file::capture::recorded::{Output, Recorded, Tick};
use crate::messages;
use crate::output;

/// Differences that are named.
const NAMED: usize = 10;

/// Options of `footfall replay`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// A capture of `record`, `watch` or `cargo xtask run --record`: CSV with the JSON file beside it, or MCAP
    #[arg(value_name = "CAPTURE")]
    pub capture: PathBuf,
    /// Print a JSON object
    #[arg(long)]
    pub json: bool,
}

/// What was compared.
#[derive(Debug, Default)]
pub struct Comparison {
    /// The loop of the boot with this number, or why there is none.
    host: Option<(u32, Result<BoardLoop, String>)>,
    ticks: u64,
    compared: u64,
    without_output: u64,
    different: u64,
    /// The first of them, with the number of the boot.
    differences: Vec<(u32, Difference)>,
    /// Why ticks were not replayed, with the boot, once each.
    reasons: Vec<(u32, String)>,
}

/// The loop of a boot of a capture, counted from 1, before its first tick.
///
/// # Errors
/// The boot record was lost, or the board ran other records than those of the capture; the text says which.
pub fn loop_of_boot(recorded: &Recorded, boot: u32) -> Result<BoardLoop, String> {
    let record = (boot as usize).checked_sub(1).and_then(|index| recorded.boots.get(index));
    match record.and_then(Option::as_ref) {
        Some(boot) => loop_of(&recorded.parameters, boot),
        None => Err("the boot record was lost; begin the capture before the board's reset".into()),
    }
}

impl Comparison {
    /// Runs the loop for one tick, and compares what it gives with the capture.
    pub fn take(&mut self, recorded: &Recorded, tick: &Tick) {
        self.ticks += 1;
        if self.host.as_ref().is_none_or(|(boot, _)| *boot != tick.boot) {
            self.host = Some((tick.boot, loop_of_boot(recorded, tick.boot)));
        }
        let Some((_, host)) = &mut self.host else { return };
        if let Ok(joints) = host {
            let (before, elapsed) = (joints.frame().tick, u32::from(tick.call.elapsed.max(1)));
            if before.wrapping_add(elapsed) == tick.tick {
                joints.tick(&tick.call.sample());
                let frame = Frame::from(&joints.frame());
                self.compare(tick, &frame);
                return;
            }
            let (first, last) = (before.wrapping_add(1), tick.tick.wrapping_sub(elapsed));
            *host = Err(format!("the inputs of ticks {first} to {last} were lost"));
        }
        if let Err(why) = host
            && self.reasons.last().is_none_or(|(boot, _)| *boot != tick.boot)
        {
            self.reasons.push((tick.boot, why.clone()));
        }
    }

    /// The counts, the first differences and the reasons, as `footfall replay --json` prints them; `finished` as in [`Recorded`].
    #[must_use]
    pub fn to_json(&self, finished: bool) -> Value {
        let named = self.differences.iter().map(|(boot, found)| {
            json!({ "boot": boot, "tick": found.tick, "field": found.field, "capture": found.board, "host": found.host })
        });
        json!({
            "ticks": self.ticks, "compared": self.compared, "different": self.different, "without_output": self.without_output,
            "not_replayed": self.not_replayed(), "finished": finished,
            "differences": named.collect::<Vec<_>>(),
            "reasons": self.reasons.iter().map(|(boot, why)| json!({ "boot": boot, "why": why })).collect::<Vec<_>>(),
        })
    }

    const fn not_replayed(&self) -> u64 {
        self.ticks - self.compared - self.without_output
    }

    fn compare(&mut self, tick: &Tick, host: &Frame) {
        let Some(output) = &tick.output else {
            self.without_output += 1;
            return;
        };
        self.compared += 1;
        let found = differences(tick.tick, output, host);
        self.different += u64::from(!found.is_empty());
        let left = NAMED - self.differences.len().min(NAMED);
        self.differences.extend(found.into_iter().take(left).map(|difference| (tick.boot, difference)));
    }
}

fn differences(tick: u32, board: &Output, host: &Frame) -> Vec<Difference> {
    let mut found = Vec::new();
    let mut compare = |field, same: bool, board: String, host: String| {
        if !same {
            found.push(Difference { tick, field, board, host });
        }
    };
    let host_deg = host.setpoints_deg();
    let same = board.setpoints_deg.map(f32::to_bits) == host_deg.map(f32::to_bits);
    compare("set", same, format!("{:?}", board.setpoints_deg), format!("{host_deg:?}"));
    let same = board.pulses_us == host.pulses_us;
    compare("pulse", same, format!("{:?}", board.pulses_us), format!("{:?}", host.pulses_us));
    compare("state", board.state == host.state.name(), board.state.clone(), host.state.name().into());
    compare("seq", board.seq == host.seq, board.seq.to_string(), host.seq.to_string());
    compare("limited", board.limited == host.limited, board.limited.to_string(), host.limited.to_string());
    found
}

/// Runs the command.
///
/// # Errors
/// The capture cannot be read, no tick of it can be compared, or ticks differ.
pub fn run(options: &Options) -> Result<(), Failure> {
    let mut comparison = Comparison::default();
    let recorded =
        recorded::read(&options.capture, |recorded, tick| comparison.take(recorded, &tick)).map_err(Failure::input)?;
    let place = options.capture.display();
    if !recorded.finished {
        messages::note(format_args!("{place}: has no end: its recorder was stopped; what is there is replayed"));
    }
    let object = comparison.to_json(recorded.finished);
    let not_replayed = comparison.not_replayed();
    let Comparison { ticks, compared, without_output, different, differences, reasons, .. } = comparison;
    for (boot, why) in &reasons {
        messages::note(format_args!("{place}: boot {boot}: not replayed from there on: {why}"));
    }
    if options.json {
        output::print(&format!("{object}\n"))?;
    } else {
        let equal = compared - different;
        output::print(&format!(
            "{place}: {ticks} ticks, {equal} equal, {different} different, {not_replayed} not replayed, {without_output} without output\n"
        ))?;
    }
    if different > 0 {
        let words: Vec<String> = differences.iter().map(|(boot, found)| format!("boot {boot}, {found}")).collect();
        return Err(Failure::run(format!("the capture and this program differ: {}", words.join("; "))));
    }
    if compared == 0 {
        return Err(Failure::run(format!("{place}: no tick could be compared")));
    }
    Ok(())
}
