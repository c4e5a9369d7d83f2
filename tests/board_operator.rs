//! What a person does to the button and the emergency stop of the flashed image on the virtual board: contacts that chatter, and holds around
//! transitions of the supervisor. Judged at the pins: servos are driven again at most once for each deliberate gesture, right after it.

use footfall::board::image::Image;
use footfall_tests::boot_log::BootLog;
use footfall_tests::campaign::{self, Outcome, head};
use joint_loop::SupervisorState;
use joint_loop::tuning::{Action, Request};
use joint_units::Joint;
use serde_json::Value;
use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;
use test_suite::{report, tests};
use wire::{MAX_FRAME_BYTES, frame_request};

fn main() -> ExitCode {
    test_suite::run(tests![
        the_count_of_gestures_follows_the_rule(),
        a_button_that_chatters_arms_by_deliberate_holds_alone(Image),
        an_emergency_stop_that_chatters_arms_nothing(Image),
        around_transitions_a_hold_arms_once_at_most(Image),
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

/// Difference between a contact and its readings: a tick and a half, s.
const READING_S: f64 = 0.0015;
/// The contact is open for so long after a press, s.
const OPEN_S: f64 = 0.02;

/// Ends of the gestures that may arm, s, counted by the rule alone: a press ends when the contact was open for `open_s`, and counts if the contact was
/// closed for 0.3 s in it without a break, and the whole took 1.5 s at most. What the board refuses besides only takes from these.
fn gestures(contact: &Contact, open_s: f64) -> Vec<f64> {
    let mut presses: Vec<Contact> = Vec::new();
    for &(from, to) in contact {
        match presses.last_mut() {
            Some(press) if press.last().is_some_and(|(_, end)| from - end < open_s) => press.push((from, to)),
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
        assert_eq!(gestures(&contact, OPEN_S).len(), count, "{contact:?}");
    }
}

/// A case: what the contacts do in a state, with times after the state's.
struct Case {
    name: String,
    state: &'static str,
    lasts_s: f64,
    button: Contact,
    stop: Contact,
    /// A request, and when it is sent.
    request: Option<(f64, Action)>,
    /// Of the file: what happens besides.
    inject: &'static str,
    /// How often the servos are driven again; `None`: at most once for each gesture.
    arms: Option<usize>,
    /// A state that is entered.
    enters: Option<SupervisorState>,
}

impl Case {
    fn sequence(&self) -> String {
        let presses = |contact: &Contact| {
            let each = contact.iter().map(|(from, to)| format!("{{ at_s = {from:.6}, hold_s = {:.6} }}", to - from));
            each.collect::<Vec<_>>().join(", ")
        };
        let mut text = String::new();
        let serial = self.request.map(|(at_s, action)| {
            let mut buffer = [0; MAX_FRAME_BYTES];
            let bytes = frame_request(&Request { number: 90, action }, &mut buffer).expect("it fits");
            let digits: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
            format!("{{ at_s = {at_s:.6}, bytes = \"{digits}\" }}")
        });
        let _ = writeln!(
            text,
            "[[sequence]]\nname = \"{}\"\nstate = \"{}\"\nlasts_s = {}\nlog = true\npress = [{}]\nemergency_stop = [{}]\nserial = [{}]\n\
             inject = [{}]",
            self.name,
            self.state,
            self.lasts_s,
            presses(&self.button),
            presses(&self.stop),
            serial.unwrap_or_default(),
            self.inject
        );
        text
    }

    /// A case without a press.
    fn new(name: String, state: &'static str, lasts_s: f64) -> Self {
        Self { name, state, lasts_s, button: vec![], stop: vec![], request: None, inject: "", arms: None, enters: None }
    }

    /// Each time at which the servos are driven again belongs to a gesture of its own that has just ended.
    fn check(&self, result: &Value, image: &Image) -> usize {
        /// From the release: 20 ms of debouncing, and a servo frame.
        const SOON_S: std::ops::Range<f64> = 0.0..0.045;
        let name = &self.name;
        assert_eq!(result["violations"], 0, "{name}: {result}");
        let drives: Vec<f64> = result["drives_s"].as_array().expect("times").iter().filter_map(Value::as_f64).collect();
        // Two contacts that are open for a time between these are one press or two.
        let counted = [OPEN_S - READING_S, OPEN_S + READING_S].map(|open_s| gestures(&self.button, open_s));
        let belongs = |ends: &Vec<f64>| {
            let mut left = ends.clone();
            drives.iter().all(|at| {
                let place = left.iter().position(|end| SOON_S.contains(&(at - end)));
                place.map(|place| left.remove(place)).is_some()
            })
        };
        assert!(counted.iter().any(belongs), "{name}: driven at {drives:?} s, gestures end at {counted:?}");
        let entered = entered(result, image);
        if let Some(arms) = self.arms {
            assert_eq!(drives.len(), arms, "{name}: {drives:?}, {entered:?}");
        }
        // Nothing goes on moving from one state to another that a gesture begins. One that ends within a servo frame need not drive.
        let begins = |state| matches!(state, SupervisorState::Arming | SupervisorState::Trimming);
        let most = entered.iter().filter(|(state, _)| begins(*state)).count();
        let short = entered.windows(2).filter(|pair| begins(pair[0].0) && pair[1].1 - pair[0].1 < 40).count();
        assert!((most - short..=most).contains(&drives.len()), "{name}: {drives:?}, {entered:?}");
        if let Some(state) = self.enters {
            assert!(entered.iter().any(|(entered, _)| *entered == state), "{name}: {entered:?}");
        }
        drives.len()
    }
}

/// Whether all cases are run, or one of some.
fn chosen(cases: Vec<Case>, one_of: usize) -> Vec<Case> {
    let all = std::env::var_os("FOOTFALL_GESTURES").is_some_and(|value| value == "all");
    cases.into_iter().step_by(if all { 1 } else { one_of }).collect()
}

/// The results of a run of the file with these cases, in their order.
fn results(run: &str, cases: &[Case]) -> Vec<Value> {
    let text = cases.iter().fold(head(), |text, case| text + &case.sequence());
    let file = tempfile::NamedTempFile::new().expect("a file");
    std::fs::write(file.path(), text).expect("written");
    let outcome: Outcome = campaign::run(file.path(), run, &[]);
    assert_eq!((outcome.code, outcome.cases.len()), (Some(0), cases.len()), "{}\n{:?}", outcome.said, outcome.wrong());
    let of = |case: &Case| outcome.cases.iter().find(|result| result["name"] == case.name.as_str());
    cases.iter().map(|case| of(case).expect("its result").clone()).collect()
}

/// Runs the cases, and checks each; how often servos were driven again.
fn check(run: &str, cases: &[Case]) -> usize {
    let image = image();
    results(run, cases).iter().zip(cases).map(|(result, case)| case.check(result, &image)).sum()
}

/// At rest, in a walk and in a fault. Where no closed time reaches 0.3 s, nothing arms.
fn a_button_that_chatters_arms_by_deliberate_holds_alone() {
    let one_hold = Case { button: vec![(0.1, 0.5)], arms: Some(1), ..Case::new("one hold".into(), "disarmed", 1.0) };
    let mut cases = vec![one_hold];
    for (hz, state) in RATES.iter().flat_map(|hz| ["disarmed", "walking", "fault"].map(|state| (*hz, state))) {
        let button = chatter(hz, 0.1, 4.0, 0.5);
        let arms = gestures(&button, OPEN_S + READING_S).is_empty().then_some(0);
        cases.push(Case { button, arms, ..Case::new(format!("{hz} Hz, {state}"), state, 4.3) });
    }
    let cases = chosen(cases, 4);
    let armed = check("walk", &cases);
    report!("{} contacts that chatter: {armed} armings, each right after a deliberate hold", cases.len());
}

/// The stop alone, and with a hold of the button while it chatters: the outputs stay off, or go off and stay so.
fn an_emergency_stop_that_chatters_arms_nothing() {
    let mut cases = Vec::new();
    for (hz, state) in RATES.iter().flat_map(|hz| ["disarmed", "arming", "walking"].map(|state| (*hz, state))) {
        for button in [vec![], vec![(0.4, 0.8)]] {
            let name = format!("stop {hz} Hz, {state}, {} holds", button.len());
            // A fault takes two holds.
            cases.push(Case { button, stop: chatter(hz, 0.1, 1.5, 0.5), arms: Some(0), ..Case::new(name, state, 1.7) });
        }
    }
    let cases = chosen(cases, 7);
    assert_eq!(check("walk", &cases), 0);
    report!("{} emergency stops that chatter: no arming", cases.len());
}

/// What leads to a transition of the supervisor.
#[derive(Clone, Copy)]
enum By {
    /// A hold of the button, or its press.
    Hold,
    Press,
    /// The end of a ramp, or of the patience with a silent host.
    Time,
    EmergencyStop,
    Sensor,
    Request(Action),
}

/// A transition of the supervisor: the run of the file, the state in which it begins, the state that is entered.
struct Transition {
    run: &'static str,
    from: &'static str,
    to: SupervisorState,
    by: By,
}

impl Transition {
    fn name(&self) -> String {
        let by = match self.by {
            By::Hold => "a hold",
            By::Press => "a press",
            By::Time => "time",
            By::EmergencyStop => "the emergency stop",
            By::Sensor => "the sensor",
            By::Request(_) => "a request",
        };
        format!("{} to {} by {by}", self.from, self.to.name())
    }

    /// When what leads to it begins, s after the state's time; in a fault late enough that two holds are not the third press within 5 s.
    fn begins_s(&self) -> f64 {
        if self.from == "fault" { 2.8 } else { 0.5 }
    }

    /// A case with what leads to it.
    fn case(&self, what: &str, button: Contact, lasts_s: f64) -> Case {
        let mut case = Case { button, ..Case::new(format!("{}: {what}", self.name()), self.from, lasts_s) };
        let begins = self.begins_s();
        match self.by {
            By::Hold | By::Press | By::Time => {}
            By::EmergencyStop => case.stop = vec![(begins, begins + 0.1)],
            By::Sensor => case.inject = "{ at_s = 0.5, what = { volts = { pin = \"PA1\", volts = 0.0 } } }",
            By::Request(action) => case.request = Some((begins, action)),
        }
        case
    }

    /// Two cases that tell when it happens, where that is not known: it alone, and the emergency stop, which is a fault in the tick after.
    fn measured(&self) -> Option<[Case; 2]> {
        let stop = vec![(self.begins_s(), self.begins_s() + 0.1)];
        let stopped = Case { stop, ..Case::new(format!("{}: stopped", self.name()), self.from, 1.0) };
        matches!(self.by, By::Time | By::Sensor | By::Request(_)).then(|| [self.case("alone", vec![], 6.0), stopped])
    }

    /// When it happens by these two, s after the state's time.
    fn moment(&self, measured: &[Value; 2], image: &Image) -> f64 {
        let [at, stopped] = [(0, self.to), (1, SupervisorState::Fault)].map(|(place, state)| {
            let entered = entered(&measured[place], image);
            let found = entered.iter().find(|(entered, _)| *entered == state);
            f64::from(found.unwrap_or_else(|| panic!("{}: {entered:?}", self.name())).1)
        });
        self.begins_s() + (at - stopped) * 1e-3
    }

    /// Cases with a hold whose contact closes or opens near a moment, and those in which the board accepts that near it, after 20 ms of debouncing.
    fn holds(&self, moment: f64, quarter_ms: i32) -> Vec<Case> {
        let at = moment + f64::from(quarter_ms) * 0.25e-3;
        let begins = self.begins_s();
        let near = |which, button: Contact| {
            let lasts_s = button.last().expect("a press").1 + 0.3;
            self.case(&format!("a hold {which} {} us later", quarter_ms * 250), button, lasts_s)
        };
        let case = |which, button, arms| Case { arms, enters: Some(self.to), ..near(which, button) };
        let hold = (at, at + 0.4);
        match self.by {
            // The next hold; where the contact was open for less than 20 ms it is the same. In what the first began, the second one's press ends it.
            By::Hold => {
                let arms = (f64::from(quarter_ms) * 0.25e-3 > READING_S).then_some(1);
                vec![case("begins", vec![(begins - 0.4, begins), hold], arms)]
            }
            // The press is a contact that opens for a millisecond; its release arms nothing.
            By::Press => vec![case("begins", vec![(begins, at - 1e-3), hold], Some(0))],
            By::Time | By::EmergencyStop | By::Sensor | By::Request(_) => {
                let at_rest = matches!(self.to, SupervisorState::Disarmed | SupervisorState::TrimReady);
                let earlier = (at - OPEN_S, at - OPEN_S + 0.4);
                let mut cases =
                    vec![case("begins", vec![hold], Some(usize::from(at_rest))), near("is accepted", vec![earlier])];
                // What moves would be stopped by the press.
                if !matches!(self.from, "arming" | "walking" | "trimming") {
                    // No hold acts on a state that began after its press.
                    cases.push(case("ends", vec![(at - 0.4, at)], Some(0)));
                    cases.push(near("is accepted at its end", vec![(at - 0.4 - OPEN_S, at - OPEN_S)]));
                }
                cases
            }
        }
    }
}

/// Holds that begin, end or are accepted within 2 ms and some of transitions.
fn around_transitions_a_hold_arms_once_at_most() {
    use SupervisorState::{Arming, Disarmed, Fault, Stopping, TrimReady, Trimming, Walking};
    let (stop, trim) = (By::Request(Action::Stop), By::Request(Action::Trim { joint: Joint::LeftHip }));
    let transitions = [
        ("walk", "disarmed", Arming, By::Hold),
        ("walk", "disarmed", TrimReady, trim),
        ("walk", "disarmed", Fault, By::EmergencyStop),
        ("walk", "arming", Walking, By::Time),
        ("walk", "arming", Stopping, By::Press),
        ("walk", "arming", Stopping, stop),
        ("walk", "arming", Stopping, By::Sensor),
        ("walk", "arming", Fault, By::EmergencyStop),
        ("walk", "walking", Stopping, By::Press),
        ("walk", "walking", Stopping, stop),
        ("walk", "walking", Stopping, By::Sensor),
        ("walk", "walking", Fault, By::EmergencyStop),
        ("walk", "stopping", Disarmed, By::Time),
        ("walk", "stopping", Fault, By::EmergencyStop),
        ("walk", "fault", Disarmed, By::Hold),
        ("trim", "trim ready", Disarmed, stop),
        ("trim", "trim ready", Trimming, By::Hold),
        ("trim", "trim ready", Fault, By::EmergencyStop),
        ("trim", "trimming", TrimReady, By::Press),
        ("trim", "trimming", TrimReady, stop),
        ("trim", "trimming", TrimReady, By::Time),
        ("trim", "trimming", Fault, By::EmergencyStop),
    ]
    .map(|(run, from, to, by)| Transition { run, from, to, by });
    let image = image();
    let (mut armed, mut count) = (0, 0);
    for run in ["walk", "trim"] {
        let of_run: Vec<&Transition> = transitions.iter().filter(|transition| transition.run == run).collect();
        let measures: Vec<Case> = of_run.iter().filter_map(|transition| transition.measured()).flatten().collect();
        let measured = results(run, &measures);
        let mut measured = measured.as_chunks::<2>().0.iter();
        let mut cases = Vec::new();
        for transition in of_run {
            let moment = match transition.by {
                // After 20 ms of debouncing.
                By::Hold | By::Press => transition.begins_s() + OPEN_S,
                By::EmergencyStop => transition.begins_s(),
                By::Time | By::Sensor | By::Request(_) => {
                    transition.moment(measured.next().expect("its cases"), &image)
                }
            };
            cases.extend((-10..=10).flat_map(|quarter_ms| transition.holds(moment, quarter_ms)));
        }
        let cases = chosen(cases, 11);
        armed += check(run, &cases);
        count += cases.len();
    }
    report!("{count} holds around {} transitions: {armed} armings, each right after its hold", transitions.len());
}

fn image() -> Image {
    let path = std::env::var_os("FOOTFALL_ELF").expect("the image");
    Image::read(Path::new(&path)).unwrap_or_else(|error| panic!("{error}"))
}

/// The states that were entered, each with its tick, as the log says.
fn entered(result: &Value, image: &Image) -> Vec<(SupervisorState, u32)> {
    BootLog::read(&result["log"], image).entered
}
