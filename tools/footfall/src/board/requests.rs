//! Requests to a running board, and the answers that belong to them; and what is known of its settings from these.
//!
//! A board reports its settings each second and when they change. Between a boot and its first report they are the defaults.

use joint_loop::tuning::{Action, GAITS, Outcome, Parameter, Request, Settings, Thousandths};
use std::time::{Duration, Instant, SystemTime};
use wire::Answered;

/// Longest time to the first answer: a board answers in the tick that takes the request; a virtual board on a busy computer has slow ticks.
pub const ANSWER_WITHIN: Duration = Duration::from_secs(5);
/// Longest time from there to the effect: the longest wait for a phase boundary, and the ramp of an earlier change.
pub const EFFECT_WITHIN: Duration = Duration::from_secs(10);

/// What became of a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reply {
    /// The request.
    pub request: Request,
    /// The tick of the answer.
    pub tick: u32,
    /// What the board answered.
    pub outcome: Outcome,
}

/// A request that waits.
#[derive(Debug, Clone, Copy)]
struct Waiting {
    request: Request,
    since: Instant,
    is_staged: bool,
}

/// Requests of this program.
#[derive(Debug, Clone)]
pub struct Requests {
    next: u16,
    waiting: Vec<Waiting>,
    in_effect: Option<Settings>,
}

impl Default for Requests {
    /// No request yet, to a board of which nothing is known. Numbers begin where those of another program probably do not.
    fn default() -> Self {
        let next = SystemTime::UNIX_EPOCH.elapsed().map_or(1, |since| since.as_millis() as u16);
        Self { next, waiting: Vec::new(), in_effect: None }
    }
}

impl Requests {
    /// A request with a number of its own; its answers are expected from now on.
    pub fn ask(&mut self, action: Action, now: Instant) -> Request {
        let request = Request { number: self.next, action };
        self.next = self.next.wrapping_add(1);
        self.waiting.push(Waiting { request, since: now, is_staged: false });
        request
    }

    /// The board has started: its settings are the defaults, and what was asked for before is lost.
    pub fn booted(&mut self) {
        *self = Self { next: self.next, waiting: Vec::new(), in_effect: Some(Settings::default()) };
    }

    /// The board reports these settings.
    pub fn reported(&mut self, settings: Settings) {
        self.in_effect = Some(settings);
    }

    /// Value in effect, thousandths of the unit; `None` if it is not known.
    #[must_use]
    pub fn value(&self, parameter: Parameter) -> Option<i32> {
        self.in_effect.map(|settings| settings.thousandths(parameter))
    }

    /// The value that was asked for last and was not refused, or is in effect.
    #[must_use]
    pub fn planned(&self, parameter: Parameter) -> Option<i32> {
        let asked = self.waiting.iter().rev().find_map(|waiting| match waiting.request.action {
            Action::Set { parameter: of, thousandths } if of == parameter => Some(thousandths),
            _ => None,
        });
        asked.or_else(|| self.value(parameter))
    }

    /// The requests whose answer did not come in time; they are not waited for any longer.
    pub fn overdue(&mut self, now: Instant) -> Vec<Request> {
        let is_late = |waiting: &Waiting| {
            let within = if waiting.is_staged { ANSWER_WITHIN + EFFECT_WITHIN } else { ANSWER_WITHIN };
            now.saturating_duration_since(waiting.since) > within
        };
        self.waiting.extract_if(.., |waiting| is_late(waiting)).map(|waiting| waiting.request).collect()
    }

    /// Takes an answer: the requests of this program that it settles, or of which it says that they are staged.
    pub fn take(&mut self, answer: &Answered) -> Vec<Reply> {
        let Answered { tick, number, outcome } = *answer;
        let reply = |waiting: Waiting| Reply { request: waiting.request, tick, outcome };
        let first = self.waiting.iter().position(|waiting| !waiting.is_staged && waiting.request.number == number);
        match (first, outcome) {
            (Some(place), Outcome::Staged) => {
                self.waiting[place].is_staged = true;
                vec![reply(self.waiting[place])]
            }
            (Some(place), _) => {
                let answered = self.waiting.remove(place);
                if (answered.request.action, outcome) == (Action::Undo, Outcome::InEffect) {
                    // What was staged is discarded.
                    self.waiting.retain(|waiting| !waiting.is_staged);
                }
                vec![reply(answered)]
            }
            // Settings that are staged together take effect together, with the number of the last.
            (None, Outcome::InEffect) => self.waiting.extract_if(.., |waiting| waiting.is_staged).map(reply).collect(),
            (None, _) => Vec::new(),
        }
    }
}

/// A parameter and its value, in thousandths of its unit, from the words of the command line; checked with the board's own table.
///
/// # Errors
/// There is no such parameter, or it does not allow the value: what is allowed.
pub fn setting(name: &str, value: &str) -> Result<(Parameter, i32), String> {
    let parameter = Parameter::from_name(name).ok_or_else(|| {
        let names = Parameter::ALL.map(Parameter::name).join(", ");
        format!("`{name}` is no parameter; allowed are {names}")
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
        Some(thousandths) => Ok((parameter, thousandths)),
        None => Err(format!("{name} = {value}: {}", allowed(parameter))),
    }
}

/// Why the board refused a request.
#[must_use]
pub fn refusal(outcome: Outcome, action: Action) -> String {
    match (outcome, action) {
        (Outcome::OutOfRange, Action::Set { parameter, .. }) => allowed(parameter),
        (Outcome::NotAFollower, _) => "its generator follows nobody, so there is nothing to switch off".into(),
        (Outcome::FollowsAPerson, _) => "its generator takes the speed from the person; set another gait first".into(),
        (Outcome::NothingToUndo, _) => "there was no change before".into(),
        (Outcome::GaitNotPossible, _) => "the gait cannot run at its control period".into(),
        (outcome, _) => outcome.name().into(),
    }
}

/// The values that a parameter allows, in words.
#[must_use]
pub fn allowed(parameter: Parameter) -> String {
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

/// A value as the command line takes it: a name where there is one, else a number.
#[must_use]
pub fn value_in_words(parameter: Parameter, thousandths: i32) -> String {
    match (parameter, thousandths / 1000) {
        (Parameter::Gait, 0) => "own".into(),
        (Parameter::Gait, place) => {
            let gait = usize::try_from(place - 1).ok().and_then(|place| GAITS.get(place));
            gait.map_or_else(|| place.to_string(), |gait| gait.name().into())
        }
        (Parameter::Follow, 0) => "off".into(),
        (Parameter::Follow, _) => "on".into(),
        _ => Thousandths(thousandths).to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(thousandths: i32) -> Action {
        Action::Set { parameter: Parameter::Speed, thousandths }
    }

    fn answer(request: Request, tick: u32, outcome: Outcome) -> Answered {
        Answered { tick, number: request.number, outcome }
    }

    fn speed(thousandths: i32) -> Settings {
        Settings::default().with(Parameter::Speed, thousandths).unwrap()
    }

    #[test]
    fn settings_are_known_from_a_boot_or_a_report() {
        let mut requests = Requests::default();
        assert_eq!(requests.value(Parameter::Speed), None);
        requests.reported(speed(1_200));
        assert_eq!(requests.value(Parameter::Speed), Some(1_200));
        requests.booted();
        assert_eq!(requests.value(Parameter::Speed), Some(1_000));
    }

    #[test]
    fn what_is_staged_together_takes_effect_together_or_is_discarded() {
        let mut requests = Requests::default();
        requests.booted();
        let now = Instant::now();
        let offset = Parameter::from_name("offset_left_hip").unwrap();
        let asked = [set(1_100), Action::Set { parameter: offset, thousandths: 2_000 }].map(|it| requests.ask(it, now));
        assert_eq!(requests.planned(Parameter::Speed), Some(1_100));
        for request in asked {
            requests.take(&answer(request, 5, Outcome::Staged));
        }
        assert_eq!((requests.value(offset), requests.planned(offset)), (Some(0), Some(2_000)));
        requests.reported(speed(1_100).with(offset, 2_000).unwrap());
        let replies = requests.take(&answer(asked[1], 9, Outcome::InEffect));
        assert_eq!(replies, asked.map(|request| Reply { request, tick: 9, outcome: Outcome::InEffect }));
        let dropped = requests.ask(set(1_400), now);
        requests.take(&answer(dropped, 20, Outcome::Staged));
        assert_eq!(requests.planned(Parameter::Speed), Some(1_400));
        let undo = requests.ask(Action::Undo, now);
        assert_eq!(requests.take(&answer(undo, 21, Outcome::InEffect))[0].request, undo);
        assert_eq!(
            (requests.planned(Parameter::Speed), requests.overdue(now + EFFECT_WITHIN * 3)),
            (Some(1_100), vec![])
        );
    }

    #[test]
    fn refusals_silence_and_strange_answers_change_nothing() {
        let mut requests = Requests::default();
        requests.booted();
        let now = Instant::now();
        let refused = requests.ask(set(9_000), now);
        assert!(requests.take(&answer(refused, 3, Outcome::OutOfRange))[0].outcome.is_refused());
        let lost = requests.ask(set(900), now);
        assert_eq!(requests.overdue(now + ANSWER_WITHIN), []);
        assert_eq!(requests.overdue(now + ANSWER_WITHIN * 2), [lost]);
        for outcome in [Outcome::Staged, Outcome::InEffect] {
            let number = refused.number.wrapping_sub(7);
            assert_eq!(requests.take(&Answered { tick: 9, number, outcome }), []);
        }
        assert_eq!(requests.planned(Parameter::Speed), Some(1_000));
    }

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
            assert_eq!(setting(name, value).unwrap(), (parameter, thousandths), "{name} {value}");
            // A named choice is printed by its name.
            let words = value_in_words(parameter, thousandths);
            assert_eq!(setting(name, &words).unwrap().1, thousandths, "{name} {words}");
        }
        for (name, value, words) in [
            ("speed", "2", "speed = 2: allowed are 0.5 to 1.5, up to three decimal places"),
            ("speed", "nan", "speed = nan: allowed are 0.5 to 1.5"),
            ("offset_left_hip", "20", "allowed are -15 to 15 deg"),
            ("gait", "swim", "allowed are own, walk, natural-walk, human-walk, human-run"),
            ("record_rate", "0.5", "allowed are 1 to 1000 1/s, whole numbers"),
            ("arm", "1", "`arm` is no parameter; allowed are gait, speed"),
        ] {
            let error = setting(name, value).unwrap_err();
            assert!(error.contains(words), "{error}");
        }
    }
}
