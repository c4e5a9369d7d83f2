//! The part of a live screen that changes the running board: the selected parameter, its value, and what the board answered last.

use joint_loop::tuning::{Action, Outcome, Parameter, Request, Settings};
use std::time::Instant;
use wire::Answered;

use crate::board::requests::{ANSWER_WITHIN, Reply, Requests, allowed, refusal, value_in_words};
use crate::view::keys::TuneKey;

/// Rates of frames between which the keys change.
const RATES: [i32; 10] = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];

/// The keys of a live screen that change the board.
#[derive(Debug, Clone, Default)]
pub struct Tuning {
    selected: usize,
    requests: Requests,
    /// What became of the last request, or why there was none; or how an earlier one failed.
    last: String,
    /// The last request.
    asked: Option<Request>,
}

impl Tuning {
    /// Acts on a key; gives the request that is to be sent.
    pub fn press(&mut self, key: TuneKey, now: Instant) -> Option<Request> {
        let count = Parameter::COUNT;
        let action = match key {
            TuneKey::Previous => {
                self.selected = (self.selected + count - 1) % count;
                return None;
            }
            TuneKey::Next => {
                self.selected = (self.selected + 1) % count;
                return None;
            }
            TuneKey::Undo => Action::Undo,
            TuneKey::Stop => Action::Stop,
            TuneKey::Less | TuneKey::More => {
                let parameter = self.parameter();
                let before = self.requests.planned(parameter).unwrap_or(parameter.range()[2]);
                let thousandths = stepped(parameter, before, key == TuneKey::More);
                if thousandths == before {
                    self.last = format!("{} is at its limit: {}", parameter.name(), allowed(parameter));
                    return None;
                }
                Action::Set { parameter, thousandths }
            }
        };
        self.last = format!("{}: sent", in_words(action));
        self.asked = Some(self.requests.ask(action, now));
        self.asked
    }

    /// The request could not be sent.
    pub fn not_sent(&mut self, why: &dyn std::fmt::Display) {
        self.last = format!("not sent: {why}");
    }

    /// Takes an answer of the board.
    pub fn take(&mut self, answer: &Answered) {
        for Reply { request, tick, outcome } in self.requests.take(answer) {
            let went_well = matches!(outcome, Outcome::Staged | Outcome::InEffect);
            if went_well && self.asked != Some(request) {
                // What a person looks for now is the answer to the last key.
                continue;
            }
            let what = match (outcome, request.action) {
                (Outcome::Staged, _) => format!("staged at tick {tick}, waits for the next phase boundary"),
                (Outcome::InEffect, Action::Stop) => format!("stops from tick {tick} on"),
                (Outcome::InEffect, _) => format!("in effect at tick {tick}"),
                (_, action) => format!("refused at tick {tick}: {}", refusal(outcome, action)),
            };
            self.last = format!("{}: {what}", in_words(request.action));
        }
    }

    /// The board reports its settings.
    pub fn reported(&mut self, settings: Settings) {
        self.requests.reported(settings);
    }

    /// The board has started: its settings are the defaults.
    pub fn booted(&mut self) {
        self.requests.booted();
    }

    /// Time passes: a request may be left without an answer.
    pub fn wait(&mut self, now: Instant) {
        if let Some(request) = self.requests.overdue(now).last() {
            let secs = ANSWER_WITHIN.as_secs();
            self.last = format!(
                "{}: no answer within {secs} s; does the board's input get bytes (its RX pin)?",
                in_words(request.action)
            );
        }
    }

    /// The selected parameter, and what became of the last request.
    #[must_use]
    pub fn lines(&self) -> [String; 2] {
        let parameter = self.parameter();
        let unit = if parameter.unit().is_empty() { String::new() } else { format!(" {}", parameter.unit()) };
        let shown = |value: i32| format!("{}{unit}", value_in_words(parameter, value));
        let (now, planned) = (self.requests.value(parameter), self.requests.planned(parameter));
        let known = match now {
            Some(value) => shown(value),
            None => format!("not known, default {}", shown(parameter.range()[2])),
        };
        let next = planned.filter(|_| planned != now).map_or(String::new(), |value| format!(" -> {}", shown(value)));
        let place = format!("{}/{}", self.selected + 1, Parameter::COUNT);
        [format!("{place} {} = {known}{next}   {}", parameter.name(), allowed(parameter)), self.last.clone()]
    }

    /// What differs from the defaults, as the command line takes it: `speed=1.2`. Parameters whose value is not known are left out.
    #[must_use]
    pub fn changed(&self) -> Vec<String> {
        let value = |parameter: Parameter| self.requests.value(parameter).map(|value| (parameter, value));
        let known = Parameter::ALL.into_iter().filter_map(value);
        let changed = known.filter(|(parameter, value)| *value != parameter.range()[2]);
        changed.map(|(parameter, value)| format!("{}={}", parameter.name(), value_in_words(parameter, value))).collect()
    }

    fn parameter(&self) -> Parameter {
        Parameter::ALL[self.selected]
    }
}

/// The next value in this direction, inside the range of the parameter.
fn stepped(parameter: Parameter, from: i32, up: bool) -> i32 {
    let [least, most, _] = parameter.range();
    let step = match parameter {
        Parameter::Gait | Parameter::Follow => 1_000,
        Parameter::Speed | Parameter::Amplitude(_) => 50,
        Parameter::Offset(_) => 500,
        Parameter::RecordRate => {
            let mut rates = RATES.iter().map(|rate| rate * 1_000);
            let next = if up { rates.find(|rate| *rate > from) } else { rates.rfind(|rate| *rate < from) };
            return next.unwrap_or(from);
        }
    };
    (if up { from + step } else { from - step }).clamp(least, most)
}

fn in_words(action: Action) -> String {
    match action {
        Action::Stop => "stop".into(),
        Action::Undo => "undo".into(),
        Action::Set { parameter, thousandths } => {
            format!("set {} {}", parameter.name(), value_in_words(parameter, thousandths))
        }
        Action::Trim { joint } => format!("trim {}", joint.name()),
        Action::Jog { pulse } => format!("jog {} us", pulse.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn answer(request: Request, tick: u32, outcome: Outcome) -> Answered {
        Answered { tick, number: request.number, outcome }
    }

    #[test]
    fn keys_select_change_undo_and_stop_and_answers_are_shown() {
        let (mut tuning, now) = (Tuning::default(), Instant::now());
        assert!(tuning.lines()[0].contains("gait = not known, default own"), "{:?}", tuning.lines());
        tuning.booted();
        assert_eq!(tuning.press(TuneKey::Next, now), None);
        let request = tuning.press(TuneKey::More, now).unwrap();
        assert_eq!(request.action, Action::Set { parameter: Parameter::Speed, thousandths: 1_050 });
        assert_eq!(tuning.lines()[1], "set speed 1.05: sent");
        tuning.take(&answer(request, 320, Outcome::Staged));
        assert!(tuning.lines()[0].starts_with("2/12 speed = 1 -> 1.05 "), "{:?}", tuning.lines());
        assert!(tuning.lines()[1].contains("staged at tick 320"), "{:?}", tuning.lines());
        tuning.reported(Settings::default().with(Parameter::Speed, 1_050).unwrap());
        tuning.take(&answer(request, 700, Outcome::InEffect));
        assert!(tuning.lines()[0].starts_with("2/12 speed = 1.05 "), "{:?}", tuning.lines());
        assert_eq!(tuning.lines()[1], "set speed 1.05: in effect at tick 700");
        assert_eq!(tuning.changed(), ["speed=1.05"]);
        let request = tuning.press(TuneKey::Less, now).unwrap();
        tuning.take(&answer(request, 800, Outcome::FollowsAPerson));
        assert!(
            tuning.lines()[1].contains("refused at tick 800: its generator takes the speed"),
            "{:?}",
            tuning.lines()
        );
        assert_eq!(tuning.press(TuneKey::Stop, now).unwrap().action, Action::Stop);
        assert_eq!(tuning.press(TuneKey::Undo, now).unwrap().action, Action::Undo);
        tuning.wait(now + Duration::from_secs(6));
        assert!(tuning.lines()[1].starts_with("undo: no answer within 5 s"), "{:?}", tuning.lines());
        // From the first parameter back to the last.
        tuning.press(TuneKey::Previous, now);
        tuning.press(TuneKey::Previous, now);
        assert!(tuning.lines()[0].contains("record_rate = 100 1/s"), "{:?}", tuning.lines());
    }

    /// An undo may take effect after the stop that was pressed next.
    #[test]
    fn an_earlier_request_is_shown_only_where_it_failed() {
        let (mut tuning, now) = (Tuning::default(), Instant::now());
        tuning.booted();
        let [undo, stop] = [TuneKey::Undo, TuneKey::Stop].map(|key| tuning.press(key, now).unwrap());
        tuning.take(&answer(undo, 290, Outcome::Staged));
        assert_eq!(tuning.lines()[1], "stop: sent");
        tuning.take(&answer(stop, 300, Outcome::InEffect));
        tuning.take(&answer(undo, 350, Outcome::InEffect));
        assert_eq!(tuning.lines()[1], "stop: stops from tick 300 on");
        let [undo, stop] = [TuneKey::Undo, TuneKey::Stop].map(|key| tuning.press(key, now).unwrap());
        tuning.take(&answer(stop, 400, Outcome::InEffect));
        tuning.take(&answer(undo, 401, Outcome::NothingToUndo));
        assert_eq!(tuning.lines()[1], "undo: refused at tick 401: there was no change before");
    }

    /// Every value that the keys reach is allowed, from one end of the range to the other.
    #[test]
    fn steps_stay_inside_the_range() {
        for parameter in Parameter::ALL {
            let [least, most, default] = parameter.range();
            for (up, end) in [(true, most), (false, least)] {
                let mut value = default;
                for _ in 0..100 {
                    value = stepped(parameter, value, up);
                    assert!(parameter.allows(value), "{} {value}", parameter.name());
                }
                assert_eq!(value, end, "{}", parameter.name());
            }
        }
        let (mut tuning, now) = (Tuning::default(), Instant::now());
        tuning.booted();
        assert_eq!(tuning.press(TuneKey::Less, now), None);
        assert!(tuning.lines()[1].starts_with("gait is at its limit: allowed are own, walk"), "{:?}", tuning.lines());
    }
}
