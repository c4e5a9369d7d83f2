//! `footfall set`: changes a parameter of a running board, goes back, or stops it, through its serial port.

use clap::Args;
use joint_loop::tuning::{Action, Outcome, Parameter, Request, Thousandths};
use serde_json::json;
use std::collections::VecDeque;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use wire::Record;

use crate::board::requests::{ANSWER_WITHIN, EFFECT_WITHIN, Reply, Requests, refusal, setting};
use crate::board::serial::Port;
use crate::board::transport::{Heard, Transport};
use crate::failure::Failure;
use crate::file::capture::rtt::Came;
use crate::output;

/// Options of `footfall set`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// The board's serial port: a device file
    #[arg(long, value_name = "PORT", required_unless_present = "list")]
    pub serial: Option<PathBuf>,
    /// The parameter; --list shows all
    #[arg(value_name = "NAME", requires = "value", required_unless_present_any = ["list", "undo", "stop"])]
    pub name: Option<String>,
    /// Its new value: a number, the name of a gait, or `on` and `off`
    #[arg(value_name = "VALUE", allow_hyphen_values = true)]
    pub value: Option<String>,
    /// Discard what is staged; with nothing staged, go back to the settings before the last change
    #[arg(long, conflicts_with_all = ["name", "stop", "list"])]
    pub undo: bool,
    /// Stop at once, by the short ramp to the park pose. Nothing here can arm: that takes the board's button
    #[arg(long, conflicts_with_all = ["name", "list"])]
    pub stop: bool,
    /// List the parameters with unit, range and default
    #[arg(long, conflicts_with = "name")]
    pub list: bool,
    /// Print one JSON object a line: the table, or the answers of the board
    #[arg(long)]
    pub json: bool,
}

/// Runs the command. `interrupt` is set by a signal that asks it to end.
///
/// # Errors
/// Wrong input, a port that cannot be opened, no answer, or a refusal of the board.
pub fn run(options: &Options, interrupt: &AtomicBool) -> Result<(), Failure> {
    let action = match (&options.name, &options.value) {
        _ if options.list => return list(options.json),
        _ if options.undo => Action::Undo,
        _ if options.stop => Action::Stop,
        (Some(name), Some(value)) => {
            let (parameter, thousandths) = setting(name, value).map_err(Failure::input)?;
            Action::Set { parameter, thousandths }
        }
        _ => return Err(Failure::input("nothing to set; allowed are NAME and VALUE, --undo, --stop, --list")),
    };
    let Some(path) = &options.serial else { return Err(Failure::input("no port; allowed is --serial PORT")) };
    let place = path.display();
    let mut port =
        Port::open(path, true).map_err(|error| Failure::input(format!("{place}: cannot be opened: {error}")))?;
    let mut requests = Requests::default();
    port.send(&requests.ask(action, Instant::now()))
        .map_err(|error| Failure::run(format!("{place}: does not take the request: {error}")))?;
    let mut answers =
        Answers { path, port, transport: Transport::serial(), requests, found: VecDeque::new(), interrupt };
    let first = answers.next(ANSWER_WITHIN)?.ok_or_else(|| {
        Failure::run(format!(
            "{place}: no answer to the request; check that the board runs and that this is its port, 2 Mbaud"
        ))
    })?;
    report(&first, options.json)?;
    if first.outcome == Outcome::Staged {
        let effect = answers.next(EFFECT_WITHIN)?.ok_or_else(|| {
            Failure::run("staged, but not in effect after 10 s; an undo may have discarded it".to_owned())
        })?;
        report(&effect, options.json)?;
    }
    Ok(())
}

/// The answers of a board.
struct Answers<'a> {
    path: &'a Path,
    port: Port,
    transport: Transport<'static>,
    requests: Requests,
    found: VecDeque<Reply>,
    interrupt: &'a AtomicBool,
}

impl Answers<'_> {
    /// The next answer to the request; `None` if it does not come in time.
    fn next(&mut self, within: Duration) -> Result<Option<Reply>, Failure> {
        let until = Instant::now() + within;
        loop {
            if let Some(reply) = self.found.pop_front() {
                return Ok(Some(reply));
            }
            if self.interrupt.load(Ordering::Relaxed) {
                return Err(Failure::run("asked to end before the board answered"));
            }
            if Instant::now() >= until {
                return Ok(None);
            }
            let Self { requests, found, .. } = self;
            let place = self.path.display();
            match self.port.next(until.min(Instant::now() + Duration::from_millis(50))) {
                Came::Bytes(bytes) => {
                    let each = |heard| {
                        if let Heard::Record(Record::Answered(answer)) = heard {
                            found.extend(requests.take(&answer));
                        }
                    };
                    self.transport.push(&bytes, each).map_err(|error| Failure::run(format!("{place}: {error}")))?;
                }
                Came::Nothing => {}
                Came::End => return Err(Failure::run(format!("{place}: the port was closed"))),
                Came::Broken(error) => return Err(Failure::run(format!("{place}: the port failed: {error}"))),
            }
        }
    }
}

/// Prints an answer; a refusal is a failure.
fn report(reply: &Reply, as_json: bool) -> Result<(), Failure> {
    let Reply { request: Request { number, action }, tick, outcome } = *reply;
    if as_json {
        let object = json!({ "type": "answer", "number": number, "tick": tick, "outcome": outcome.name() });
        output::print(&format!("{object}\n"))?;
    }
    if outcome.is_refused() {
        return Err(Failure::run(format!("the board refused: {}", refusal(outcome, action))));
    }
    if !as_json {
        let what = match (outcome, action) {
            (Outcome::Staged, _) => "staged: takes effect at the next phase boundary",
            (_, Action::Stop) => "stops",
            _ => "in effect",
        };
        output::print(&format!("tick {tick}: {what}\n"))?;
    }
    Ok(())
}

fn list(as_json: bool) -> Result<(), Failure> {
    let mut text = String::new();
    for parameter in Parameter::ALL {
        let (name, unit, about) = (parameter.name(), parameter.unit(), parameter.about());
        let [least, most, default] = parameter.range();
        // Writing to a string cannot fail.
        let _ = if as_json {
            let [least, most, default] = [least, most, default].map(|number| f64::from(number) / 1000.0);
            let object = json!({
                "name": name, "unit": unit, "least": least, "most": most, "default": default, "about": about,
            });
            writeln!(text, "{object}")
        } else {
            let [least, most, default] = [least, most, default].map(Thousandths);
            let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
            writeln!(text, "{name:<21} {least} to {most}{unit}, default {default}. {about}")
        };
    }
    output::print(&text)
}
