//! The clock of the watchdog and an attached debugger, on the flashed image on the virtual board.
//!
//! The watchdog has an oscillator of its own, which the board measures at boot and once a minute: outside of what the watchdog's times are computed for the
//! board does not arm, and a walk stops. A debugger may halt the core while timers and watchdog go on: the watchdog ends the pulses.

use std::process::ExitCode;

use footfall_tests::board::{Board, Ran};
use footfall_tests::gestures::walk_options;
use footfall_tests::limits::assert_in_time;
use joint_loop::{Cause, Debugger, GeneratorConfig, SupervisorState};
use serde_json::Value;
use test_suite::{report, tests};
use wire::{Reset, Subject};

fn main() -> ExitCode {
    test_suite::run(tests![
        within_the_range_the_board_arms_and_is_not_reset(Image),
        outside_of_the_range_arming_is_refused_in_words(Image),
        a_clock_that_changes_stops_the_walk_within_a_minute(Image),
        a_debugger_is_recorded_and_reported(Image),
        a_halted_core_leaves_no_pulses(Image),
        a_debugger_that_stops_the_watchdog_is_overruled(Image),
        a_debugger_that_stops_the_watchdog_last_repeats_the_last_pulses(Image),
        a_build_that_refuses_a_debugger_does_not_arm(NoSensorImage),
    ])
}

/// Longest time from a change of the oscillator to the end of the walk, s: a minute to the measurement, and the ramp.
const LATEST_STOP_S: f64 = 60.6;

/// Checks that the host's copy of the loop has done the same in every boot, to the bit.
fn assert_replayed(ran: &Ran) {
    let books = &ran.books;
    assert_eq!((books.different, books.lost_lines), (0, 0), "{:?}", books.differences);
    assert!(books.compared > 0);
    assert_eq!((ran.end.unmodelled, ran.end.lints.len(), ran.end.unexpected_faults), (0, 0, 0), "{:?}", ran.end.lints);
}

fn number(object: &Value, key: &str) -> f64 {
    object[key].as_f64().unwrap_or_else(|| panic!("no {key}: {object}"))
}

fn within_the_range_the_board_arms_and_is_not_reset() {
    let board = Board::find();
    for hz in [17_000_u32, 32_000, 47_000] {
        let ran = board.run(walk_options(3.0, &["--lsi-hz", &hz.to_string()]));
        ran.assert_sound();
        assert_replayed(&ran);
        let boot = &ran.boots[0];
        assert_eq!(boot.ticks.last().expect("frames").state, SupervisorState::Walking, "{hz} Hz");
        let measured = boot.environment.last().expect("a second has passed").watchdog_hz.expect("measured");
        report!("an oscillator of {hz} Hz is measured as {measured} Hz");
        assert!(measured.abs_diff(hz) * 1_000 <= hz * 3, "{measured} Hz of {hz} Hz");
        assert!(boot.refused.is_empty(), "{:?}", boot.refused);
    }
}

/// No pulse, and each channel says why: the cause, the log in words with the frequency, and a record.
fn outside_of_the_range_arming_is_refused_in_words() {
    let board = Board::find();
    for hz in [0_u32, 10_000, 60_000, 100_000] {
        let ran = board.run(walk_options(2.0, &["--lsi-hz", &hz.to_string()]));
        assert_replayed(&ran);
        assert!(ran.pulses.is_empty(), "{hz} Hz: {} frames with pulses", ran.pulses.len());
        let words = |text: &str| {
            let measured = text.split_once("runs at ").and_then(|(_, rest)| rest.split_once(" Hz"));
            let measured: u32 = measured.expect("a frequency").0.parse().expect("a number");
            assert!(measured.abs_diff(hz) * 1_000 <= hz * 5, "{measured} Hz of {hz} Hz");
            assert!(text.contains("17000 to 47000 Hz"), "{text}");
        };
        for boot in &ran.boots {
            let [refused] = boot.refused.as_slice() else { panic!("{hz} Hz: {:?}", boot.refused) };
            assert_eq!(refused.subject, Subject::Arming);
            words(&refused.reason);
            words(boot.log.iter().find(|line| line.contains("arming refused")).expect("a line of the log"));
        }
        // A clock that is much too fast may reset a board that works: then too it does not arm.
        let refusals = ran.boots.iter().flat_map(|boot| &boot.changes);
        let refused_hold = refusals.filter(|change| change.cause == Cause::WatchdogClock).count();
        report!("{hz} Hz: {} boots, {refused_hold} refused holds", ran.boots.len());
        assert!(refused_hold == 1 || ran.boots.len() > 1, "{hz} Hz");
        assert!(ran.boots.len() == 1 || hz == 100_000, "{hz} Hz: {:?}", ran.end.resets);
    }
}

/// From 32 kHz to too slow in the walk: the next measurement finds it, and the walk ends by the short ramp.
fn a_clock_that_changes_stops_the_walk_within_a_minute() {
    let board = Board::find();
    let ran = board.run(walk_options(62.0, &["--lsi", "10000@10"]));
    ran.assert_sound();
    assert_replayed(&ran);
    let boot = &ran.boots[0];
    let change = boot.changes.iter().find(|change| change.cause == Cause::WatchdogClock).expect("a stop");
    assert_eq!(change.state, SupervisorState::Stopping);
    assert_eq!(boot.ticks.last().expect("frames").state, SupervisorState::Disarmed);
    let last = ran.pulses.last().expect("pulses").0;
    report!("an oscillator that changes to 10 kHz at 10 s: stop in tick {}, last pulse at {last} s", change.tick);
    assert!((10.0..10.0 + LATEST_STOP_S).contains(&last), "last pulse at {last} s");
    let [refused] = boot.refused.as_slice() else { panic!("{:?}", boot.refused) };
    assert!(refused.reason.contains("the clock of the watchdog runs at"), "{}", refused.reason);
}

/// With a debugger every call has it, the board says so when it is armed, and it walks; without one nothing does.
fn a_debugger_is_recorded_and_reported() {
    let board = Board::find();
    for is_attached in [false, true] {
        let ran = board.run(walk_options(3.0, if is_attached { &["--debugger"] } else { &[] }));
        ran.assert_sound();
        assert_replayed(&ran);
        let boot = &ran.boots[0];
        let expected = if is_attached { Debugger::Attached } else { Debugger::Absent };
        assert!(boot.calls.iter().all(|(_, call)| call.flags.debugger() == expected));
        let lines = boot.log.iter().filter(|line| line.contains("armed with a debugger attached")).count();
        assert_eq!(lines, usize::from(is_attached), "{:?}", boot.log);
        assert!(boot.environment.iter().all(|chip| chip.debugger == is_attached));
        assert_eq!(boot.ticks.last().expect("frames").state, SupervisorState::Walking);
        let frames = boot.replay(&GeneratorConfig::default_walk());
        assert_eq!(frames.last().expect("frames").state, SupervisorState::Walking);
    }
}

/// Halted at ten moments of a frame, with the slowest, the nominal and the fastest clock of the watchdog: its reset ends the pulses.
fn a_halted_core_leaves_no_pulses() {
    let board = Board::find();
    for hz in ["17000", "32000", "47000"] {
        let mut latest = 0.0_f64;
        for part in 0..10 {
            let at = 1.5 + 0.0021 * f64::from(part);
            let ran = board.run(walk_options(1.8, &["--lsi-hz", hz, "--halt", &at.to_string()]));
            latest = latest.max(assert_reset_in_time(&ran, at));
        }
        report!("a halted core, LSI {hz} Hz: reset and supply off after {latest} us at most");
    }
}

/// The reset comes in time, with it the supply and the pulses end, and the board boots disarmed; the time of the reset, us.
fn assert_reset_in_time(ran: &Ran, at: f64) -> f64 {
    assert_replayed(ran);
    let [reaction] = ran.end.injections.iter().filter(|one| one["kind"] == "halt").collect::<Vec<_>>()[..] else {
        panic!("{:?}", ran.end.injections)
    };
    let [rail, dark, reset] = ["rail_us", "disarmed_us", "reset_us"].map(|key| number(reaction, key));
    assert!(rail <= reset && dark <= reset, "{reaction}");
    assert_in_time("H08", reset * 1e-3, "a halted core");
    let last = ran.pulses.last().expect("pulses").0;
    assert!(last <= at + reset * 1e-6, "a pulse at {last} s after a halt at {at} s");
    let after = &ran.boots[1];
    assert_eq!(after.boot.as_ref().map(|boot| boot.reset), Some(Reset::IndependentWatchdog));
    assert!(after.ticks.iter().all(|tick| tick.pulses_us == [0; 4]));
    reset
}

/// A debugger that sets the freeze bits of watchdog and TIM1, as some do when they attach, and halts 20 ms later: they were cleared in between.
fn a_debugger_that_stops_the_watchdog_is_overruled() {
    let freeze = ["0xE0042008=0x00001000@2.5", "0xE004200C=0x00000001@2.5"];
    let at = 2.52;
    let more = ["--register", freeze[0], "--register", freeze[1], "--halt", "2.52"];
    let ran = Board::find().run(walk_options(3.0, &more));
    let reset = assert_reset_in_time(&ran, at);
    report!("freeze bits set, then halted: reset after {reset} us");
}

/// The same bits 0.1 ms before the halt, too late for the program to clear them. With the watchdog's alone there is no reset: the timer repeats the last
/// pulses, each inside its range, for as long as the core is halted (here to the end of the run). With that of TIM1 too the pulses stop, and a line that is
/// high stays high.
fn a_debugger_that_stops_the_watchdog_last_repeats_the_last_pulses() {
    let watchdog = ["--register", "0xE0042008=0x00001000@2.5199", "--halt", "2.52"];
    let ran = Board::find().run(walk_options(4.0, &watchdog));
    assert_replayed(&ran);
    assert_eq!(ran.boots.len(), 1, "{:?}", ran.end.resets);
    let after: Vec<_> = ran.pulses.iter().filter(|(t_s, _)| *t_s > 2.56).collect();
    report!("watchdog frozen, core halted for {} s: {} frames with the last pulses", 4.0 - 2.52, after.len());
    assert!((70..=74).contains(&after.len()), "{}", after.len());
    let first = after[0].1;
    assert!(first.iter().all(Option::is_some) && after.iter().all(|(_, us)| *us == first), "{first:?}");
}

/// The image with the feature `no-debugger`: attached, no hold arms, and the cause says why; without one it walks.
fn a_build_that_refuses_a_debugger_does_not_arm() {
    let board = Board::no_sensor();
    let ran = board.run(walk_options(2.0, &["--debugger"]));
    assert_replayed(&ran);
    let boot = &ran.boots[0];
    assert!(ran.pulses.is_empty(), "{} frames with pulses", ran.pulses.len());
    assert!(boot.calls.iter().all(|(_, call)| call.flags.debugger() == Debugger::Refused));
    let refused = boot.changes.last().expect("a change");
    assert_eq!((refused.state, refused.cause), (SupervisorState::Disarmed, Cause::Debugger));
    assert!(boot.log.iter().any(|line| line == "disarmed, cause debugger"), "{:?}", boot.log);
    // Without one the same image walks.
    let ran = board.run(walk_options(3.0, &[]));
    ran.assert_sound();
    assert_eq!(ran.boots[0].ticks.last().expect("frames").state, SupervisorState::Walking);
}
