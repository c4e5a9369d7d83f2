//! `footfall set`: changes a parameter of a running board, goes back, or stops it, through its serial port.

use clap::Args;
use joint_loop::tuning::{Action, GAITS, Outcome, Parameter, Request, Thousandths};
use serde_json::json;
use std::collections::VecDeque;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime};
use wire::{Answered, Record};

use crate::board::serial::{Port, Records, is_other_version};
use crate::failure::Failure;
use crate::file::capture::rtt::Came;
use crate::output;

/// Longest time to the first answer: a board answers in the tick that takes the request; a virtual board on a busy computer has slow ticks.
const ANSWER_WITHIN: Duration = Duration::from_secs(5);
/// Longest time from there to the effect: the longest wait for a phase boundary, and the ramp of an earlier change.
const EFFECT_WITHIN: Duration = Duration::from_secs(10);

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
        (Some(name), Some(value)) => set(name, value)?,
        _ => return Err(Failure::input("nothing to set; allowed are NAME and VALUE, --undo, --stop, --list")),
    };
    let Some(path) = &options.serial else { return Err(Failure::input("no port; allowed is --serial PORT")) };
    let number = SystemTime::UNIX_EPOCH.elapsed().map_or(1, |since| since.as_millis() as u16);
    let place = path.display();
    let mut port =
        Port::open(path, true).map_err(|error| Failure::input(format!("{place}: cannot be opened: {error}")))?;
    port.send(&Request { number, action })
        .map_err(|error| Failure::run(format!("{place}: does not take the request: {error}")))?;
    let mut answers = Answers { path, port, records: Records::default(), found: VecDeque::new(), interrupt };
    let first = answers.next(number, ANSWER_WITHIN)?.ok_or_else(|| {
        Failure::run(format!(
            "{place}: no answer to the request; check that the board runs and that this is its port, 2 Mbaud"
        ))
    })?;
    report(&first, action, options.json)?;
    if first.outcome == Outcome::Staged {
        let effect = answers.next(number, EFFECT_WITHIN)?.ok_or_else(|| {
            Failure::run("staged, but not in effect after 10 s; an undo may have discarded it".to_owned())
        })?;
        report(&effect, action, options.json)?;
    }
    Ok(())
}

/// The answers of a board.
struct Answers<'a> {
    path: &'a Path,
    port: Port,
    records: Records,
    found: VecDeque<Answered>,
    interrupt: &'a AtomicBool,
}

impl Answers<'_> {
    /// The next answer to the request of this number, or the effect of settings that were staged after it; `None` if it does not come in time.
    fn next(&mut self, number: u16, within: Duration) -> Result<Option<Answered>, Failure> {
        let until = Instant::now() + within;
        loop {
            while let Some(answer) = self.found.pop_front() {
                // Settings that are staged together take effect together, with the number of the last.
                if answer.number == number || within == EFFECT_WITHIN && answer.outcome == Outcome::InEffect {
                    return Ok(Some(answer));
                }
            }
            if self.interrupt.load(Ordering::Relaxed) {
                return Err(Failure::run("asked to end before the board answered"));
            }
            if Instant::now() >= until {
                return Ok(None);
            }
            let place = self.path.display();
            match self.port.next(until.min(Instant::now() + Duration::from_millis(50))) {
                Came::Bytes(bytes) => {
                    for record in self.records.push(&bytes) {
                        match record {
                            Ok(Record::Answered(answer)) => self.found.push_back(answer),
                            Err(error) if is_other_version(&record) => {
                                return Err(Failure::run(format!("{place}: {error}")));
                            }
                            _ => {}
                        }
                    }
                }
                Came::Nothing => {}
                Came::End => return Err(Failure::run(format!("{place}: the port was closed"))),
                Came::Broken(error) => return Err(Failure::run(format!("{place}: the port failed: {error}"))),
            }
        }
    }
}

/// Prints an answer; a refusal is a failure.
fn report(answer: &Answered, action: Action, as_json: bool) -> Result<(), Failure> {
    let Answered { tick, number, outcome } = *answer;
    if as_json {
        let object = json!({ "type": "answer", "number": number, "tick": tick, "outcome": outcome.name() });
        output::print(&format!("{object}\n"))?;
    }
    if outcome.is_refused() {
        return Err(Failure::run(format!("the board refused: {}", words(outcome, action))));
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

fn words(outcome: Outcome, action: Action) -> String {
    match (outcome, action) {
        (Outcome::OutOfRange, Action::Set { parameter, .. }) => allowed(parameter),
        (Outcome::NotAFollower, _) => "its generator follows nobody, so there is nothing to switch off".into(),
        (Outcome::FollowsAPerson, _) => "its generator takes the speed from the person; set another gait first".into(),
        (Outcome::NothingToUndo, _) => "there was no change before".into(),
        (Outcome::GaitNotPossible, _) => "the gait cannot run at its control period".into(),
        (outcome, _) => outcome.name().into(),
    }
}

/// The request of a name and a value, checked with the board's own table.
fn set(name: &str, value: &str) -> Result<Action, Failure> {
    let parameter = Parameter::from_name(name).ok_or_else(|| {
        let names = Parameter::ALL.map(Parameter::name).join(", ");
        Failure::input(format!("`{name}` is no parameter; allowed are {names}"))
    })?;
    let by_name = match parameter {
        Parameter::Gait if value == "own" => Some(0),
        Parameter::Gait => GAITS.iter().position(|gait| gait.name() == value).map(|place| (place as i32 + 1) * 1000),
        Parameter::Follow if value == "on" => Some(1000),
        Parameter::Follow if value == "off" => Some(0),
        _ => None,
    };
    let number = by_name.or_else(|| value.parse::<Thousandths>().ok().map(|Thousandths(number)| number));
    match number.filter(|number| parameter.allows(*number)) {
        Some(thousandths) => Ok(Action::Set { parameter, thousandths }),
        None => Err(Failure::input(format!("{name} = {value}: {}", allowed(parameter)))),
    }
}

fn allowed(parameter: Parameter) -> String {
    let [least, most, _] = parameter.range().map(Thousandths);
    match parameter {
        Parameter::Gait => format!("allowed are own, {}", GAITS.map(|gait| gait.name()).join(", ")),
        Parameter::Follow => "allowed are on and off".into(),
        _ => {
            let whole = if parameter.is_whole() { ", whole numbers" } else { ", up to three decimal places" };
            let unit = parameter.unit();
            format!("allowed are {least} to {most}{}{unit}{whole}", if unit.is_empty() { "" } else { " " })
        }
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_numbers_are_values() {
        for (name, value, thousandths) in [
            ("speed", "1.2", 1_200),
            ("offset_left_knee", "-2.5", -2_500),
            ("gait", "own", 0),
            ("gait", "natural-walk", 2_000),
            ("gait", "2", 2_000),
            ("follow", "off", 0),
            ("record_rate", "1000", 1_000_000),
        ] {
            let parameter = Parameter::from_name(name).unwrap();
            assert_eq!(set(name, value).unwrap(), Action::Set { parameter, thousandths }, "{name} {value}");
        }
        for (name, value, words) in [
            ("speed", "2", "speed = 2: allowed are 0.5 to 1.5, up to three decimal places"),
            ("speed", "nan", "speed = nan: allowed are 0.5 to 1.5"),
            ("offset_left_hip", "20", "allowed are -15 to 15 deg"),
            ("gait", "swim", "allowed are own, walk, natural-walk, human-walk, human-run"),
            ("record_rate", "0.5", "allowed are 1 to 1000 1/s, whole numbers"),
            ("arm", "1", "`arm` is no parameter; allowed are gait, speed"),
        ] {
            let error = set(name, value).unwrap_err();
            assert_eq!(error.exit_code(), 2);
            assert!(error.to_string().contains(words), "{error}");
        }
    }
}
