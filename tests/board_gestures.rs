//! Gestures of the person who operates the flashed image on the virtual board: the button arms by a deliberate hold alone.

use footfall_tests::board::{Board, Ran};
use footfall_tests::gestures::{self, ARM};
use footfall_tests::recordings::default_volts_file;
use joint_loop::{Cause, SupervisorState};
use std::ffi::OsString;
use std::process::ExitCode;
use test_suite::{report, tests};

fn main() -> ExitCode {
    test_suite::run(tests![
        chatter_of_the_button_never_arms(Image),
        chatter_of_long_holds_arms_once(Image),
        a_press_that_does_not_arm_says_why(Image),
        without_a_test_of_the_emergency_stop_nothing_arms(Image),
        a_cut_cable_of_the_emergency_stop_stops(Image),
    ])
}

/// Runs the board with a person who walks, with these presses.
fn run(secs: f64, presses: &[String], more: &[&str]) -> Ran {
    let mut options: Vec<OsString> = ["--secs".into(), secs.to_string().into(), "--loop".into()].into();
    options.extend(["--volts".into(), default_volts_file().into()]);
    options.extend(gestures::options(presses));
    options.extend(more.iter().map(Into::into));
    let ran = Board::find().run(options);
    let books = &ran.books;
    assert_eq!((ran.code, books.different, books.not_compared, books.lost_lines), (Some(0), 0, 0, 0));
    ran
}

/// The states that the log names, in order, each with its cause.
fn changes(ran: &Ran) -> Vec<(SupervisorState, Cause)> {
    let of = |line: &String| {
        let (state, cause) = line.split_once(", cause ")?;
        Some((SupervisorState::from_name(state)?, Cause::from_name(cause)?))
    };
    ran.boots[0].log.iter().filter_map(of).collect()
}

fn armings(ran: &Ran) -> usize {
    changes(ran).iter().filter(|(state, _)| *state == SupervisorState::Arming).count()
}

/// Levels of the emergency stop's line, as a file: high at first, then changed at these times.
fn line(changes_s: &[f64]) -> tempfile::NamedTempFile {
    let file = tempfile::NamedTempFile::new().expect("a file");
    let rows: String =
        [0.0].iter().chain(changes_s).zip(0..).map(|(t_s, n)| format!("{t_s},{}\n", (n + 1) % 2)).collect();
    std::fs::write(file.path(), format!("time_s,level\n{rows}")).expect("written");
    file
}

/// Presses of a contact that opens and closes at this rate for half of the time, s.
fn chatter(hz: f64, from_s: f64, to_s: f64) -> impl Iterator<Item = String> {
    let half = 0.5 / hz;
    (0..((to_s - from_s) * hz) as u32).map(move |n| format!("{:.5}:{half:.5}", from_s + f64::from(n) / hz))
}

/// Two seconds each at 2 to 200 Hz: at rest, in a walk, and after a fault.
fn chatter_of_the_button_never_arms() {
    let rates = [200.0, 100.0, 50.0, 33.0, 25.0, 20.0, 10.0, 5.0, 2.0];
    let from = |start: f64| {
        rates
            .iter()
            .zip(0..)
            .flat_map(move |(hz, n)| chatter(*hz, start + 2.0 * f64::from(n), start + 2.0 * f64::from(n) + 1.99))
    };
    let at_rest: Vec<String> = from(0.2).collect();
    let ran = run(18.6, &at_rest, &[]);
    assert_eq!((armings(&ran), ran.pulses.len(), ran.end.edges_before_arming), (0, 0, 0), "{:?}", changes(&ran));

    // In a walk the first accepted edge stops it, and nothing arms it again.
    let in_a_walk: Vec<String> = [ARM.to_owned()].into_iter().chain(from(2.6)).collect();
    let ran = run(21.0, &in_a_walk, &[]);
    assert_eq!(armings(&ran), 1, "{:?}", changes(&ran));
    assert_eq!(ran.end.edges_after_disarming, 0);
    assert!(
        ran.pulses.last().is_some_and(|(t_s, _)| *t_s < 14.0),
        "it stops at the first rate that passes the debouncing"
    );

    // A fault is not acknowledged.
    let ran = run(18.6, &at_rest, &["--emergency-stop", "0.05:0.03", "0.12:0.03"]);
    assert_eq!(changes(&ran).last(), Some(&(SupervisorState::Fault, Cause::BreakInput)), "{:?}", changes(&ran));
    assert!(ran.pulses.is_empty());
}

/// At 1 Hz each closed half is a deliberate hold: the first arms, the second stops, and from the third on they are too many.
fn chatter_of_long_holds_arms_once() {
    let presses: Vec<String> = chatter(1.0, 0.1, 14.0).collect();
    let ran = run(14.5, &presses, &[]);
    assert_eq!(armings(&ran), 1, "{:?}", changes(&ran));
    assert_eq!(changes(&ran).last(), Some(&(SupervisorState::Disarmed, Cause::Presses)), "{:?}", changes(&ran));
    report!("14 holds of 0.5 s at 1 Hz: {} arming, then refused", armings(&ran));
}

fn a_press_that_does_not_arm_says_why() {
    for (press, cause) in [("0.1:0.28", Cause::HoldShort), ("0.1:1.55", Cause::HoldLong)] {
        let ran = run(2.0, &[press.to_owned()], &[]);
        assert_eq!(changes(&ran).last(), Some(&(SupervisorState::Disarmed, cause)), "{:?}", changes(&ran));
        assert!(ran.pulses.is_empty());
    }
    // A hold arms at its release, not before; a press stops at its edge, and its release does nothing.
    let ran = run(6.0, &["0.1:0.9".to_owned(), "3.5:0.6".to_owned()], &[]);
    let first = ran.pulses.iter().find(|(_, us)| us.iter().any(Option::is_some)).expect("pulses").0;
    assert!((1.0..1.05).contains(&first), "the first pulse at {first} s");
    let states: Vec<_> = changes(&ran).into_iter().map(|(state, _)| state.name()).collect();
    assert_eq!(states, ["disarmed", "arming", "walking", "stopping", "disarmed"]);
    let last = ran.pulses.last().expect("pulses").0;
    assert!((4.4..4.6).contains(&last), "the last pulse at {last} s, a second after the press");
}

/// The line is high while the stop is released. A board that has not seen it come and go since its boot refuses to arm, and says so.
fn without_a_test_of_the_emergency_stop_nothing_arms() {
    let hold = [gestures::hold(0.5)];
    let refused = |options: &[&str], cause: Cause| {
        let ran = run(1.5, &hold, options);
        assert_eq!(changes(&ran).last(), Some(&(SupervisorState::Disarmed, cause)), "{options:?}");
        assert_eq!((ran.pulses.len(), ran.end.edges_before_arming), (0, 0), "{options:?}");
    };
    refused(&["--level", "PB12=1"], Cause::StopUntested);
    // A disturbance of 15 ms, and a stop that is pressed from the boot on and then released.
    refused(&["--emergency-stop", "0.2:0.015"], Cause::StopUntested);
    refused(&["--emergency-stop", "0:0.3"], Cause::StopUntested);
    // Pressed at the release; a cable that is cut, or was never connected.
    refused(&["--emergency-stop", "0.2:1"], Cause::BreakInput);
    refused(&["--level", "PB12=0"], Cause::BreakInput);
    let ran = run(1.5, &hold, &["--emergency-stop", "0.1:0.05"]);
    assert_eq!((armings(&ran), ran.pulses.is_empty()), (1, false));
    // A test between the press of the button and its release: this hold does not arm, the next one does.
    refused(&["--emergency-stop", "0.6:0.1"], Cause::BreakInput);
    let ran = run(2.5, &[gestures::hold(0.5), gestures::hold(1.5)], &["--emergency-stop", "0.6:0.1"]);
    let first = ran.pulses.iter().find(|(_, us)| us.iter().any(Option::is_some)).expect("pulses").0;
    assert!((1.9..1.96).contains(&first), "the first pulse at {first} s, after the second hold");
}

/// In a walk: the outputs are off in hardware, and it takes two holds to arm again.
fn a_cut_cable_of_the_emergency_stop_stops() {
    let (cut_s, mended_s) = (3.0, 5.0);
    let cable = line(&[0.05, 0.074, cut_s, mended_s]);
    let option = format!("PB12={}", cable.path().display());
    let holds = [ARM.to_owned(), gestures::hold(4.0), gestures::hold(10.5), gestures::hold(11.5)];
    let ran = run(13.0, &holds, &["--edges", &option]);
    let pulses = |from_s: f64, to_s: f64| {
        ran.pulses.iter().filter(|(t_s, us)| (from_s..to_s).contains(t_s) && us.iter().any(Option::is_some)).count()
    };
    assert!(pulses(0.4, cut_s) > 100 && pulses(11.9, 13.0) > 40);
    // Neither by the hold while it is cut, nor by itself once it is mended, nor by the hold that acknowledges.
    assert_eq!(pulses(cut_s, 11.9), 0);
    let states: Vec<_> = changes(&ran).into_iter().map(|(state, _)| state.name()).collect();
    assert_eq!(states, ["disarmed", "arming", "walking", "fault", "disarmed", "arming"], "{:?}", changes(&ran));
    assert_eq!(changes(&ran)[3].1, Cause::BreakInput);
}
