//! How `footfall watch` judges the end of a run: only what an injected fault explains is excused, and nothing is called good that was not seen.

mod support;

use serde_json::{Value, json};
use std::process::{Output, Stdio};
use support::{Bench, SimulatedBoard};
use wire::{Change, Record, Refused, Subject};

fn watched(simulated: &SimulatedBoard, options: &[&str]) -> (Output, Value, String) {
    ended(&Bench::plays(&simulated.lines), options)
}

/// The output of a run, its last object, and its messages.
fn ended(bench: &Bench, options: &[&str]) -> (Output, Value, String) {
    let output = bench.watch().args(["--json", "--secs", "2"]).args(options).stdin(Stdio::null()).output().unwrap();
    let last = String::from_utf8_lossy(&output.stdout).lines().last().map(|line| serde_json::from_str(line).unwrap());
    let messages = String::from_utf8_lossy(&output.stderr).into_owned();
    (output, last.unwrap_or(Value::Null), messages)
}

fn injected(kind: &str, at_s: f64) -> Value {
    json!([{ "kind": kind, "symbol": kind, "injected_s": at_s }])
}

/// The record of a change of the supervisor's state.
fn change(tick: u32, state: joint_loop::SupervisorState, cause: joint_loop::Cause) -> Record {
    Record::Change(Change { tick, state, cause })
}

/// A walk whose supervisor goes to the fault state at 1.0 s, with this cause.
fn stops_with(cause: joint_loop::Cause) -> SimulatedBoard {
    let mut simulated = SimulatedBoard::new();
    simulated.walk(1);
    simulated.record(&change(1000, joint_loop::SupervisorState::Fault, cause));
    simulated.tick_with(20, false, |sample| sample.faults = joint_loop::BoardFaults::OUTPUTS);
    simulated
}

#[test]
fn a_fault_excuses_only_the_ends_that_it_explains() {
    use joint_loop::Cause::{Outputs, SensorShort};
    for (cause, kind, at_s, excused) in [
        (SensorShort, "volts", 0.9, true),
        (SensorShort, "hang", 0.9, false),
        (SensorShort, "volts", 1.9, false),
        (Outputs, "volts", 0.9, false),
        (Outputs, "register", 0.9, true),
    ] {
        let mut simulated = stops_with(cause);
        simulated.end_as("time", json!({ "injections": injected(kind, at_s) }));
        let (output, last, messages) = watched(&simulated, &[]);
        assert_eq!((&last["state"], &last["cause"]), (&json!("fault"), &json!(cause.name())));
        assert_eq!(output.status.code(), Some(i32::from(!excused)), "{cause:?} {kind} {at_s}: {messages}");
        let words = format!("the motion ended: fault, cause {}", cause.name());
        assert_eq!(messages.contains(&words), !excused, "{messages}");
    }
}

/// The motion after it, or a boot, does not hide it.
#[test]
fn each_end_of_a_motion_is_judged() {
    use joint_loop::{Cause, SupervisorState};
    for (cause, kind, code) in
        [(Cause::SensorShort, "volts", 0), (Cause::SensorShort, "hang", 1), (Cause::Button, "", 0)]
    {
        let mut simulated = stops_with(cause);
        simulated.record(&change(1020, SupervisorState::Arming, Cause::None));
        simulated.end_as("time", json!({ "injections": injected(kind, 0.9) }));
        let (output, last, messages) = watched(&simulated, &[]);
        assert_eq!((&last["cause"], &last["earlier_ends"][0]["cause"]), (&json!("none"), &json!(cause.name())));
        assert_eq!(output.status.code(), Some(code), "{cause:?} {kind}: {messages}");
        assert_eq!(messages.contains("the motion ended at 1.0"), code == 1, "{messages}");
    }
}

#[test]
fn a_reset_without_a_fault_that_explains_it_is_named() {
    for (injections, code) in [(json!([]), 1), (injected("volts", 0.5), 1), (injected("hang", 1.0), 0)] {
        let mut simulated = SimulatedBoard::new();
        simulated.walk(1);
        simulated.reset();
        simulated.tick(500, false);
        let resets = json!([{ "t_s": 1.005, "cause": "iwdg" }]);
        simulated.end_as("time", json!({ "resets": resets, "injections": injections }));
        let (output, last, messages) = watched(&simulated, &[]);
        assert_eq!(output.status.code(), Some(code), "{injections}: {messages}");
        assert_eq!(messages.contains("the board was reset at 1.005 s, cause iwdg"), code == 1, "{messages}");
        assert_eq!(last["state"], "disarmed");
    }
}

#[test]
fn a_board_without_frames_is_not_called_walking() {
    for (kind, code) in [("reset-button", 0), ("volts", 1)] {
        let mut simulated = SimulatedBoard::new();
        simulated.walk(1);
        let last_frame_s = simulated.t_s();
        for _ in 0..5 {
            simulated.silent(100);
        }
        simulated.end_as("time", json!({ "injections": injected(kind, 1.0) }));
        let (output, last, messages) = watched(&simulated, &[]);
        assert_eq!((&last["state"], &last["no_frame_since_s"]), (&json!("unknown"), &json!(last_frame_s)));
        assert_eq!(output.status.code(), Some(code), "{messages}");
        assert_eq!(messages.contains("no frame came since 1.000 s, the state of the board is unknown"), code == 1);
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let ticks: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        let silent = ticks.iter().filter(|one| one["type"] == "tick" && one["no_frame_since_s"] == json!(1.0)).count();
        assert_eq!(silent, 4, "all but the first of the status lines after the silence");
        let bench = Bench::plays(&simulated.lines);
        let plain = bench.watch().args(["--secs", "2"]).stdin(Stdio::null()).output().unwrap();
        let plain = String::from_utf8_lossy(&plain.stdout).into_owned();
        assert!(plain.contains("   1.500 s  no frame since 1.000 s, state unknown\n"), "{plain}");
        assert!(plain.contains("state unknown\n") && plain.contains("\nno frame came since 1.000 s"), "{plain}");
    }
}

#[test]
fn late_ticks_are_those_of_all_boots() {
    let mut simulated = SimulatedBoard::new();
    simulated.walk(1);
    simulated.tick_with(3, false, |sample| sample.late = true);
    simulated.tick(17, false);
    assert_eq!(simulated.late(), 3);
    simulated.reset();
    simulated.tick_with(2, false, |sample| sample.late = true);
    simulated.walk(1);
    simulated.tick(8, false);
    simulated.end_as("time", json!({ "injections": injected("hang", 1.0) }));
    let (output, last, messages) = watched(&simulated, &[]);
    assert_eq!((&last["boots"], &last["late_ticks"]), (&json!(2), &json!(5)), "{messages}");
    let plain = Bench::plays(&simulated.lines).watch().args(["--secs", "2"]).stdin(Stdio::null()).output().unwrap();
    assert!(String::from_utf8_lossy(&plain.stdout).contains(", late 5, missed 0; unmodelled"), "{output:?}");
}

#[test]
fn a_board_that_refuses_to_start_fails_the_run_with_its_reason() {
    for (subject, code) in [(Subject::SensorRecord, 1), (Subject::Configuration, 1)] {
        let mut simulated = SimulatedBoard::new();
        let refused = Refused::new(subject, "sensor 1: code 4019 is in an end band");
        simulated.record(&Record::Refused(refused));
        for _ in 0..5 {
            simulated.silent(100);
        }
        simulated.end_as("time", json!({ "pulse_us": [null, null, null, null] }));
        let (output, last, messages) = watched(&simulated, &[]);
        assert_eq!(output.status.code(), Some(code), "{messages}");
        assert!(messages.contains("the board refused to start: sensor 1: code 4019 is in an end band"), "{messages}");
        assert_eq!(last["not_started"], "sensor 1: code 4019 is in an end band");
    }
}

#[test]
fn a_record_that_a_fault_destroyed_may_be_refused() {
    for (kind, code) in [("flash-erase", 0), ("volts", 1)] {
        let mut simulated = SimulatedBoard::new();
        simulated.walk(1);
        simulated.reset();
        let refused = Refused::new(Subject::RobotRecord, "damaged");
        simulated.record(&Record::Refused(refused));
        simulated.silent(300);
        simulated.end_as("time", json!({ "injections": injected(kind, 1.0) }));
        let (output, _, messages) = watched(&simulated, &[]);
        assert_eq!(output.status.code(), Some(code), "{kind}: {messages}");
    }
}

/// A program that writes its error only after its output is closed, as the operating system may order them.
fn refuses(code: i32) -> Bench {
    let bench = Bench::plays(&[]);
    let script =
        format!("#!/bin/sh\nexec 1>&-\nsleep 0.3\necho 'virtual-board: line 3: what is wrong' >&2\nexit {code}\n");
    std::fs::write(bench.path("board"), script).unwrap();
    bench
}

#[test]
fn wrong_input_of_the_virtual_board_is_wrong_input_with_its_words() {
    for (code, words) in [(2, "the virtual board refused its input"), (1, "ended without its last line")] {
        let (output, _, messages) = ended(&refuses(code), &[]);
        assert_eq!(output.status.code(), Some(code), "{messages}");
        let last = messages.lines().last().unwrap();
        assert!(last.contains(words) && last.contains("virtual-board: line 3: what is wrong"), "{messages}");
    }
}

#[test]
fn a_press_that_would_arm_is_refused_as_disarming() {
    let (output, _, messages) = ended(&refuses(0), &["--press", "none", "--disarm"]);
    assert_eq!(output.status.code(), Some(2), "{messages}");
    assert!(messages.contains("--disarm: its press would arm a board that nothing has armed"), "{messages}");
}

/// An earlier capture is not lost to a run that does not begin.
#[test]
fn a_virtual_board_that_refuses_its_input_leaves_the_capture_as_it_was() {
    let bench = refuses(2);
    let capture = bench.path("run.csv");
    let options = ["--record", capture.to_str().unwrap(), "--overwrite"];
    assert_eq!(ended(&bench, &options).0.status.code(), Some(2));
    assert!(!capture.exists());
    std::fs::write(&capture, "of yesterday\n").unwrap();
    assert_eq!(ended(&bench, &options).0.status.code(), Some(2));
    assert_eq!(std::fs::read_to_string(&capture).unwrap(), "of yesterday\n");
}

#[test]
fn a_virtual_board_that_ends_with_1_after_a_good_run_fails_the_run() {
    let mut simulated = SimulatedBoard::new();
    simulated.walk(2);
    simulated.end();
    let bench = Bench::plays(&simulated.lines);
    let script = std::fs::read_to_string(bench.path("board")).unwrap();
    std::fs::write(bench.path("board"), script.replace("exit 0", "echo 'event 2 did not come' >&2\nexit 1")).unwrap();
    let (output, _, messages) = ended(&bench, &[]);
    assert_eq!(output.status.code(), Some(1), "{messages}");
    assert!(messages.contains("ended with exit code 1: event 2 did not come"), "{messages}");
}

#[test]
fn who_tests_the_emergency_stop_is_said() {
    let mut simulated = SimulatedBoard::new();
    simulated.walk(1);
    simulated.end();
    let (_, _, messages) = watched(&simulated, &[]);
    assert!(messages.contains("emergency stop: pressed and released at 0.05 s"), "{messages}");
    let (_, _, messages) = watched(&simulated, &["--", "--emergency-stop", "3"]);
    assert!(messages.contains("emergency stop: only as the options after `--` say"), "{messages}");
}
