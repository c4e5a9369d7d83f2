//! What a person does to the button and the emergency stop of the flashed image on the virtual board: contacts that chatter, and holds around every
//! transition of the supervisor. Judged at the pins: servos are driven again at most once for each deliberate gesture, right after it.

use footfall_tests::board::{Board, Ran};
use footfall_tests::campaign::{self, Outcome, head};
use footfall_tests::recordings::default_volts_file;
use joint_loop::SupervisorState;
use serde_json::Value;
use std::fmt::Write as _;
use std::process::ExitCode;
use test_suite::{report, tests};

fn main() -> ExitCode {
    test_suite::run(tests![
        the_count_of_gestures_follows_the_rule(),
        a_button_that_chatters_arms_by_deliberate_holds_alone(Image),
        an_emergency_stop_that_chatters_arms_nothing(Image),
        around_every_transition_a_hold_arms_once_at_most(Image),
    ])
}

/// Rates of a contact that chatters, Hz.
const RATES: [f64; 15] = [1.0, 2.0, 3.0, 5.0, 8.0, 10.0, 15.0, 20.0, 25.0, 33.0, 50.0, 70.0, 100.0, 150.0, 200.0];

/// When a contact is closed: from and to, s, in the order of time.
type Contact = Vec<(f64, f64)>;

/// A contact that chatters from a time on, for so long, s: closed for this share of each period.
fn chatter(hz: f64, from_s: f64, lasts_s: f64, share: f64) -> Contact {
    (0..(lasts_s * hz) as u32).map(|n| from_s + f64::from(n) / hz).map(|at| (at, at + share / hz)).collect()
}

/// Ends of the gestures that may arm, s, counted by the rule alone: a press ends when the contact was open for 20 ms, and counts if the contact was closed
/// for 0.3 s in it without a break, and the whole took 1.5 s at most. What the board refuses besides only takes from these. A tick and a half of
/// difference between the contact and its readings is allowed.
fn gestures(contact: &Contact) -> Vec<f64> {
    const READING_S: f64 = 0.0015;
    let mut presses: Vec<Contact> = Vec::new();
    for &(from, to) in contact {
        match presses.last_mut() {
            Some(press) if press.last().is_some_and(|(_, end)| from - end < 0.02 + READING_S) => press.push((from, to)),
            _ => presses.push(vec![(from, to)]),
        }
    }
    let ends = presses.into_iter().filter_map(|press| {
        let (begin, end) = (press.first()?.0, press.last()?.1);
        let longest = press.iter().map(|(from, to)| to - from).fold(0.0, f64::max);
        (longest >= 0.3 - READING_S && end - begin <= 1.5 + READING_S).then_some(end)
    });
    ends.collect()
}

/// The rule against cases that are counted by hand.
fn the_count_of_gestures_follows_the_rule() {
    for (contact, count) in [
        (vec![(0.0, 0.29)], 0),
        (vec![(0.0, 0.31)], 1),
        (vec![(0.0, 1.49)], 1),
        (vec![(0.0, 1.6)], 0),
        // A bounce in a hold and after it; a break of more than 20 ms makes two presses.
        (vec![(0.0, 0.01), (0.015, 0.4), (0.41, 0.42)], 1),
        (vec![(0.0, 0.2), (0.21, 0.4)], 0),
        (vec![(0.0, 0.4), (0.45, 0.9)], 2),
        (chatter(200.0, 0.0, 2.0, 0.5), 0),
        (chatter(1.0, 0.0, 4.0, 0.5), 4),
    ] {
        assert_eq!(gestures(&contact).len(), count, "{contact:?}");
    }
}

/// A case: what the contacts do in a state, with times after the state's.
struct Case {
    name: String,
    state: &'static str,
    lasts_s: f64,
    button: Contact,
    stop: Contact,
    /// Of the file: what happens besides.
    inject: String,
    /// How often the servos are driven again; `None`: at most once for each gesture.
    arms: Option<usize>,
}

impl Case {
    fn sequence(&self) -> String {
        let presses = |contact: &Contact| {
            let each = contact.iter().map(|(from, to)| format!("{{ at_s = {from:.6}, hold_s = {:.6} }}", to - from));
            each.collect::<Vec<_>>().join(", ")
        };
        let mut text = String::new();
        let _ = writeln!(
            text,
            "[[sequence]]\nname = \"{}\"\nstate = \"{}\"\nlasts_s = {}\npress = [{}]\nemergency_stop = [{}]\ninject = [{}]",
            self.name,
            self.state,
            self.lasts_s,
            presses(&self.button),
            presses(&self.stop),
            self.inject
        );
        text
    }

    /// Each time at which the servos are driven again belongs to a gesture of its own that has just ended.
    fn check(&self, result: &Value) -> usize {
        /// From the release: 20 ms of debouncing, and a servo frame.
        const SOON_S: std::ops::Range<f64> = 0.0..0.045;
        let name = &self.name;
        assert_eq!(result["violations"], 0, "{name}: {result}");
        let drives: Vec<f64> = result["drives_s"].as_array().expect("times").iter().filter_map(Value::as_f64).collect();
        let mut left = gestures(&self.button);
        for at in &drives {
            let place = left.iter().position(|end| SOON_S.contains(&(at - end)));
            left.remove(place.unwrap_or_else(|| panic!("{name}: driven at {at} s, gestures end at {left:?}")));
        }
        if let Some(arms) = self.arms {
            assert_eq!(drives.len(), arms, "{name}: {result}");
        }
        drives.len()
    }
}

/// Whether all cases are run, or one of some.
fn chosen(cases: Vec<Case>, one_of: usize) -> Vec<Case> {
    let all = std::env::var_os("FOOTFALL_GESTURES").is_some_and(|value| value == "all");
    cases.into_iter().step_by(if all { 1 } else { one_of }).collect()
}

/// Runs the cases, and checks each; how often servos were driven again.
fn run(cases: &[Case]) -> usize {
    let text = cases.iter().fold(head(), |text, case| text + &case.sequence());
    let file = tempfile::NamedTempFile::new().expect("a file");
    std::fs::write(file.path(), text).expect("written");
    let outcome: Outcome = campaign::run(file.path(), "walk", &[]);
    assert_eq!((outcome.code, outcome.cases.len()), (Some(0), cases.len()), "{}\n{:?}", outcome.said, outcome.wrong());
    let of = |case: &Case| {
        let result = outcome.cases.iter().find(|result| result["name"] == case.name.as_str()).expect("its result");
        case.check(result)
    };
    cases.iter().map(of).sum()
}

/// At rest, in a walk and in a fault. Where no closed time reaches 0.3 s, nothing arms.
fn a_button_that_chatters_arms_by_deliberate_holds_alone() {
    let mut cases = vec![Case {
        name: "one hold".into(),
        state: "disarmed",
        lasts_s: 1.0,
        button: vec![(0.1, 0.5)],
        stop: vec![],
        inject: String::new(),
        arms: Some(1),
    }];
    for (hz, state) in RATES.iter().flat_map(|hz| ["disarmed", "walking", "fault"].map(|state| (*hz, state))) {
        let button = chatter(hz, 0.1, 4.0, 0.5);
        let arms = gestures(&button).is_empty().then_some(0);
        let name = format!("{hz} Hz, {state}");
        cases.push(Case { name, state, lasts_s: 4.3, button, stop: vec![], inject: String::new(), arms });
    }
    let cases = chosen(cases, 4);
    let armed = run(&cases);
    report!("{} contacts that chatter: {armed} armings, each right after a deliberate hold", cases.len());
}

/// The stop alone, and with a hold of the button while it chatters: the outputs stay off, or go off and stay so.
fn an_emergency_stop_that_chatters_arms_nothing() {
    let mut cases = Vec::new();
    for (hz, state) in RATES.iter().flat_map(|hz| ["disarmed", "arming", "walking"].map(|state| (*hz, state))) {
        for button in [vec![], vec![(0.4, 0.8)]] {
            let name = format!("stop {hz} Hz, {state}, {} holds", button.len());
            let stop = chatter(hz, 0.1, 1.5, 0.5);
            // A fault takes two holds.
            cases.push(Case { name, state, lasts_s: 1.7, button, stop, inject: String::new(), arms: Some(0) });
        }
    }
    let cases = chosen(cases, 7);
    assert_eq!(run(&cases), 0);
    report!("{} emergency stops that chatter: no arming", cases.len());
}

/// When the supervisor enters a state, s after the release at 0.75 s of the hold that arms in the run `walk`, in which the walk is stopped at 4 s.
fn entered(ran: &Ran, state: SupervisorState) -> f64 {
    let tick_of = |wanted| ran.boots[0].changes.iter().find(|change| change.state == wanted).expect("the state").tick;
    // 20 ms of debouncing after the release.
    0.77 + f64::from(tick_of(state) - tick_of(SupervisorState::Arming)) * 1e-3
}

/// Holds that begin or end within 2 ms and some of each transition that the button itself does not cause.
fn around_every_transition_a_hold_arms_once_at_most() {
    let volts = default_volts_file();
    let options = ["--secs", "6.5", "--loop", "--press", "0.4:0.35", "--press", "4.8:0.1", "--volts"];
    let ran = Board::find().run(options.iter().map(std::ffi::OsStr::new).chain([volts.as_os_str()]));
    let walking = entered(&ran, SupervisorState::Walking) - 1.5;
    let changes = &ran.boots[0].changes;
    let stopping = changes.iter().find(|change| change.state == SupervisorState::Stopping).expect("a stop").tick;
    let last = changes.last().expect("changes");
    assert_eq!(last.state, SupervisorState::Disarmed);
    let disarmed = 4.82 + f64::from(last.tick - stopping) * 1e-3 - 5.1;
    let open = "{ at_s = 0.5, what = { volts = { pin = \"PA1\", volts = 0.0 } } }";
    let stop = vec![(0.5, 0.6)];
    let mut cases = Vec::new();
    for (what, state, at_s, stop, inject) in [
        ("arming to walking", "arming", walking, vec![], ""),
        ("stopping to disarmed", "stopping", disarmed, vec![], ""),
        ("disarmed to fault", "disarmed", 0.5, stop.clone(), ""),
        ("arming to fault", "arming", 0.5, stop.clone(), ""),
        ("walking to fault", "walking", 0.5, stop, ""),
        ("walking to stopping", "walking", 0.551, vec![], open),
    ] {
        for quarter_ms in -10..=10 {
            let moment = at_s + f64::from(quarter_ms) * 0.25e-3;
            for (which, button) in [("begins", vec![(moment, moment + 0.4)]), ("ends", vec![(moment - 0.4, moment)])] {
                let name = format!("{what}: a hold {which} {} us later", quarter_ms * 250);
                let lasts_s = moment + 0.6;
                cases.push(Case {
                    name,
                    state,
                    lasts_s,
                    button,
                    stop: stop.clone(),
                    inject: inject.into(),
                    arms: None,
                });
            }
        }
    }
    let cases = chosen(cases, 11);
    let armed = run(&cases);
    assert!(armed > 0, "a hold after the stop arms again");
    report!("{} holds around transitions: {armed} armings, each right after its hold", cases.len());
}
