//! `footfall set`: changes a parameter of a running board, goes back, stops it, or shows its settings, through its serial port or a debug probe.

use clap::Args;
use joint_loop::tuning::{Action, Outcome, Parameter, Request, Thousandths};
use serde_json::{Map, Value, json};
use std::collections::VecDeque;
use std::fmt::Write as _;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};
use wire::Record;

use crate::board::at_port::{AtPort, Reported};
use crate::board::requests::{ANSWER_WITHIN, EFFECT_WITHIN, Reply, Requests, refusal, setting, value_in_words};
use crate::failure::Failure;
use crate::options::at::At;
use crate::output;

/// Options of `footfall set`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// Where the board is
    #[command(flatten)]
    pub at: At,
    /// The parameter; --list shows all
    #[arg(value_name = "NAME", requires = "value", required_unless_present_any = ["list", "show", "undo", "stop"])]
    pub name: Option<String>,
    /// Its new value: a number, the name of a gait, or `on` and `off`
    #[arg(value_name = "VALUE", allow_hyphen_values = true)]
    pub value: Option<String>,
    /// Discard what is staged; with nothing staged, go back to the settings before the last change
    #[arg(long, conflicts_with_all = ["name", "stop", "show", "list"])]
    pub undo: bool,
    /// Stop at once, by the short ramp to the park pose. Nothing here can arm: that takes the board's button
    #[arg(long, conflicts_with_all = ["name", "show", "list"])]
    pub stop: bool,
    /// Print the settings in effect
    #[arg(long, conflicts_with_all = ["name", "list"])]
    pub show: bool,
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
        _ if options.show => return show(&open(options, interrupt)?.report()?, options.json),
        _ if options.undo => Action::Undo,
        _ if options.stop => Action::Stop,
        (Some(name), Some(value)) => {
            let (parameter, thousandths) = setting(name, value).map_err(Failure::input)?;
            Action::Set { parameter, thousandths }
        }
        _ => return Err(Failure::input("nothing to set; allowed are NAME and VALUE, --undo, --stop, --show, --list")),
    };
    let mut answers =
        Answers { board: open(options, interrupt)?, requests: Requests::default(), found: VecDeque::new() };
    let request = answers.requests.ask(action, Instant::now());
    answers.board.send(&request)?;
    let first = answers.next(ANSWER_WITHIN)?.ok_or_else(|| answers.board.no_answer())?;
    report(&first, options.json)?;
    if first.outcome == Outcome::Staged {
        let effect = answers.next(EFFECT_WITHIN)?.ok_or_else(|| {
            Failure::run("staged, but not in effect after 10 s; an undo may have discarded it".to_owned())
        })?;
        report(&effect, options.json)?;
    }
    Ok(())
}

fn open<'a>(options: &Options, interrupt: &'a AtomicBool) -> Result<AtPort<'a>, Failure> {
    AtPort::open(options.at.origin()?, interrupt)
}

/// The answers of a board.
struct Answers<'a> {
    board: AtPort<'a>,
    requests: Requests,
    found: VecDeque<Reply>,
}

impl Answers<'_> {
    /// The next answer to the request; `None` if it does not come in time.
    fn next(&mut self, within: Duration) -> Result<Option<Reply>, Failure> {
        let until = Instant::now() + within;
        while self.found.is_empty() && Instant::now() < until {
            let Self { board, requests, found } = self;
            board.receive(|record| {
                if let Record::Answered(answer) = record {
                    found.extend(requests.take(&answer));
                }
            })?;
        }
        Ok(self.found.pop_front())
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

fn show(reported: &Reported, as_json: bool) -> Result<(), Failure> {
    let Reported { settings, state } = reported;
    let values = Parameter::ALL.map(|parameter| {
        let thousandths = settings.values.thousandths(parameter);
        (parameter, value_in_words(parameter, thousandths), thousandths == parameter.range()[2])
    });
    if as_json {
        let values: Map<String, Value> =
            values.into_iter().map(|(parameter, value, _)| (parameter.name().into(), value.into())).collect();
        let [generator, robot] = [settings.generator, settings.robot].map(|sum| format!("{sum:08x}"));
        let object = json!({
            "type": "settings", "tick": settings.tick, "state": state.name(), "generator": generator, "robot": robot,
            "values": values,
        });
        return output::print(&format!("{object}\n"));
    }
    let lines = values.map(|(parameter, value, is_default)| {
        let unit = if parameter.unit().is_empty() { String::new() } else { format!(" {}", parameter.unit()) };
        format!("{:<21} {value}{unit}{}\n", parameter.name(), if is_default { "" } else { "  (changed)" })
    });
    output::print(&lines.concat())
}

fn list(as_json: bool) -> Result<(), Failure> {
    let mut text = String::new();
    for parameter in Parameter::ALL {
        let names = names(parameter);
        let (name, unit, about) = (parameter.name(), parameter.unit(), parameter.about());
        let [least, most, default] = parameter.range();
        // Writing to a string cannot fail.
        let _ = if as_json {
            let [least, most, default] = [least, most, default].map(|number| f64::from(number) / 1000.0);
            let object = json!({
                "name": name, "unit": unit, "least": least, "most": most, "default": default, "about": about, "names": names,
            });
            writeln!(text, "{object}")
        } else {
            let [least, most, default] = [least, most, default].map(Thousandths);
            let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
            let numbered: Vec<String> = (0..).zip(&names).map(|(n, name): (i32, _)| format!("{n} {name}")).collect();
            let names = if names.is_empty() { String::new() } else { format!(" {}.", numbered.join(", ")) };
            writeln!(text, "{name:<21} {least} to {most}{unit}, default {default}. {about}{names}")
        };
    }
    output::print(&text)
}

/// The names of the values 0, 1, ... of a parameter; empty if they are numbers only.
fn names(parameter: Parameter) -> Vec<String> {
    match parameter {
        Parameter::Gait | Parameter::Follow => {
            (0..=parameter.range()[1] / 1000).map(|value| value_in_words(parameter, value * 1000)).collect()
        }
        _ => Vec::new(),
    }
}
