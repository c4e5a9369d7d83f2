//! The clock of the watchdog and an attached debugger, on the flashed image on the virtual board.
//!
//! The watchdog has an oscillator of its own, which the board measures at boot and once a minute: outside of what the watchdog's times are computed for the
//! board does not arm, and a walk stops. A debugger may halt the core: from the
//! arming on timers and watchdog go on, and the watchdog ends the pulses; at rest they stand still with it.

use std::ffi::OsString;
use std::process::ExitCode;

use footfall_tests::board::{Board, Ran};
use footfall_tests::gestures::{hold, walk_options};
use footfall_tests::limits::assert_in_time;
use footfall_tests::recordings::default_volts_file;
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
        a_core_that_is_halted_at_rest_is_not_disturbed(Image),
        a_halt_about_the_first_pulse_leaves_no_pulses(Image),
        resets_of_the_watchdog_with_a_debugger_lock_nothing(Image),
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

/// A script of halts: begin and length, ms.
fn halts(halts: &[(f64, f64)]) -> tempfile::NamedTempFile {
    let event = |(at_ms, for_ms): &(f64, f64)| {
        format!("[[event]]\nat_s = {}\ninject = \"halt\"\nfor_ms = {for_ms}\n", at_ms * 1e-3)
    };
    let file = tempfile::NamedTempFile::new().expect("a file");
    std::fs::write(file.path(), halts.iter().map(event).collect::<String>()).expect("written");
    file
}

/// As a probe halts the core to attach and to read: twenty times for 1 to 39 ms, then for a second. Watchdog and timers stand still with it: no reset, no
/// tick is missed, no fault has to be acknowledged, and the next hold arms.
fn a_core_that_is_halted_at_rest_is_not_disturbed() {
    let short = (0..20_u8).map(|n| (500.0 + 60.37 * f64::from(n), 1.0 + 2.0 * f64::from(n)));
    let script = halts(&short.chain([(1_900.0, 1_000.0)]).collect::<Vec<_>>());
    let mut options: Vec<OsString> = ["--secs", "5", "--press", &hold(3.3), "--loop"].map(Into::into).to_vec();
    options.extend(["--volts".into(), default_volts_file().into(), "--script".into(), script.path().into()]);
    let ran = Board::find().run(options);
    assert_replayed(&ran);
    let [boot] = &ran.boots[..] else { panic!("{:?}", ran.end.resets) };
    let last = boot.ticks.last().expect("frames");
    // A tick that was halted may end late; six of a hundred would stop a walk.
    assert!(last.state.moving() && last.missed == 0 && last.late <= 5, "{last:?}");
    assert!(boot.ticks.iter().all(|tick| tick.state != SupervisorState::Fault));
    // With the timers 1.4 s of the run did not happen for the program.
    let ticks = last.tick;
    report!("halted for 1.4 s in all: {ticks} ticks in 5 s, none missed");
    assert!((3_560..3_610).contains(&ticks), "{ticks}");
    // One that is not let go on stays as it is.
    let ran = Board::find().run(["--secs", "1.6", "--halt", "0.5"]);
    assert_eq!((ran.boots.len(), ran.end.edges_before_arming), (1, 0), "{:?}", ran.end.resets);
}

/// Halted at moments from 24 ms before the first pulse to 4 ms after it: before the outputs go on nothing comes, and from then on the watchdog's reset ends
/// the pulses as in a walk.
fn a_halt_about_the_first_pulse_leaves_no_pulses() {
    let board = Board::find();
    let first = board.run(walk_options(0.6, &[])).pulses.first().expect("it arms").0;
    let (mut at_rest, mut reset) = (0, 0);
    for part in 0..56 {
        let at = first - 0.024 + 0.000_513 * f64::from(part);
        let ran = board.run(walk_options(0.6, &["--halt", &at.to_string()]));
        if let [_, after] = &ran.boots[..] {
            assert_in_time("H08", (after.t_s - at) * 1e3, "a halt about the first pulse");
            assert!(ran.pulses.iter().all(|(t_s, _)| *t_s <= after.t_s), "{at} s");
            reset += 1;
        } else {
            assert!(ran.pulses.is_empty() && ran.boots.len() == 1, "{at} s: {:?}", ran.end.resets);
            at_rest += 1;
        }
    }
    report!("halts about the first pulse: {at_rest} at rest, {reset} reset");
    assert!(at_rest > 3 && reset > 20, "{at_rest} at rest, {reset} reset");
}

/// Five halts, each in an armed board: each is reset by the watchdog and reported, none counts as a crash, and the next hold arms.
fn resets_of_the_watchdog_with_a_debugger_lock_nothing() {
    const APART_MS: f64 = 800.0;
    let script = halts(&(1..=5_u8).map(|n| (APART_MS * f64::from(n), 100.0)).collect::<Vec<_>>());
    let mut options: Vec<OsString> = ["--secs", "4.8", "--debugger", "--script"].map(Into::into).to_vec();
    options.extend([script.path().into(), "--loop".into(), "--volts".into(), default_volts_file().into()]);
    for n in 0..6_u8 {
        let from_s = APART_MS * 1e-3 * f64::from(n) + if n == 0 { 0.0 } else { 0.03 };
        options.extend(["--emergency-stop".into(), format!("{:.3}:0.024", from_s + 0.06).into()]);
        options.extend(["--press".into(), format!("{:.3}:0.304", from_s + 0.1).into()]);
    }
    let ran = Board::find().run(options);
    let boots: Vec<_> = ran.boots.iter().map(|boot| boot.boot.as_ref().expect("a boot record")).collect();
    let seen: Vec<_> = boots.iter().map(|boot| (boot.reset, boot.streak)).collect();
    assert_eq!(seen, [&[(Reset::PowerOn, 0)][..], &[(Reset::IndependentWatchdog, 0); 5]].concat());
    for boot in &ran.boots {
        assert!(boot.ticks.iter().any(|tick| tick.state.moving()), "armed after {}", boot.t_s);
        assert!(boot.refused.is_empty(), "{:?}", boot.refused);
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
