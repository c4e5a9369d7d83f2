//! What the image knows after a reset of the run before, on the virtual board: the last pulses, from which the next arming starts, and the pulses that
//! were cut short.

use std::process::ExitCode;

use footfall::board::default_loop::Parameters;
use footfall_tests::board::{Board, Booted, Ran};
use footfall_tests::gestures::{self, STOP_TEST, walk_options};
use joint_loop::setup::default_loop::BoardLoop;
use joint_loop::{RobotConfig, SupervisorState};
use joint_units::{Period, PulseMicros};
use test_suite::{report, tests};
use wire::{LastOutputs, Reset};

fn main() -> ExitCode {
    test_suite::run(tests![
        after_a_power_on_the_first_pulse_is_the_park_pose(Image),
        after_a_reset_arming_starts_at_the_last_pulses(Image),
        after_a_fault_arming_starts_at_the_last_pulses(Image),
        after_a_minute_the_last_pulses_are_not_known(Image),
        pulses_that_a_clock_failure_cuts_are_counted_at_the_next_boot(Image),
        pulses_that_the_stop_cuts_are_counted_at_the_next_boot(Image),
        a_reset_that_finds_the_outputs_on_is_reported(Image),
    ])
}

/// Largest difference between the last pulse before the reset and the first one after it, us: the rounding of the angle in between.
const ROUNDING_US: f64 = 1.0;
/// Most that a servo turns from one pulse to the next, us: 500 degrees a second, and the rounding of both.
const MOST_A_FRAME_US: f64 = 500.0 * 0.02 * 1000.0 / 90.0 + 1.0;
/// A servo frame, s.
const FRAME_S: f64 = 0.02;

/// Arming again: presses that arm, and a test of the emergency stop before them.
fn again(presses: &[f64]) -> Vec<String> {
    let holds = presses.iter().flat_map(|at| ["--press".to_owned(), gestures::hold(*at)]);
    ["--emergency-stop".to_owned(), STOP_TEST.to_owned(), "3.2:0.1".to_owned()].into_iter().chain(holds).collect()
}

fn parked_us() -> [f64; 4] {
    let robot = RobotConfig::default_biped();
    let built = robot.build(Period::MILLISECOND).expect("valid");
    let mut servos = built.servos.iter().zip(robot.park);
    [(); 4].map(|()| {
        let (servo, angle) = servos.next().expect("four");
        let PulseMicros(pulse) = servo.pulse(angle).expect("finite");
        pulse.into()
    })
}

/// The widths of the whole frames of a run from a time on.
fn frames(ran: &Ran, from_s: f64, to_s: f64) -> Vec<[f64; 4]> {
    let whole = ran.pulses.iter().filter(|(at, us)| (from_s..to_s).contains(at) && us.iter().all(Option::is_some));
    whole.map(|(_, us)| us.map(|us| us.expect("checked"))).collect()
}

fn is_near(one: &[f64; 4], other: &[f64; 4], us: f64) -> bool {
    one.iter().zip(other).all(|(one, other)| (one - other).abs() <= us)
}

/// The second motion of a run starts at the last pulse of the first, goes to the park pose at the joint rate limit, and then walks.
fn assert_starts_at_last(ran: &Ran, between_s: f64, last: &[f64; 4]) {
    let second = frames(ran, between_s, f64::INFINITY);
    let first = second.first().expect("it is armed again");
    assert!(is_near(first, last, ROUNDING_US), "starts at {first:?}, ended at {last:?} us");
    assert!(!is_near(last, &parked_us(), 20.0), "{last:?} is the park pose: nothing is shown");
    for two in second.windows(2) {
        assert!(is_near(&two[0], &two[1], MOST_A_FRAME_US), "from {:?} to {:?} us in a frame", two[0], two[1]);
    }
    let at_park =
        second.iter().position(|us| is_near(us, &parked_us(), ROUNDING_US)).expect("it comes to the park pose");
    report!("from {last:?} us: at the park pose {} ms after the first pulse", at_park * 20);
    assert!(at_park < 50, "{at_park} frames");
}

/// The boot's records, replayed on the host with its last pulses: the frames are the board's.
fn assert_replayed(ran: &Ran) {
    let books = &ran.books;
    assert_eq!((books.different, books.lost_lines), (0, 0), "{:?}", books.differences);
    let robot = RobotConfig::default_biped();
    for boot in &ran.boots {
        let host = boot.watch_as(&Parameters::with_defaults(None, None, robot).expect("valid"), BoardLoop::frame);
        for tick in &boot.ticks {
            let host = host.iter().find(|frame| frame.tick == tick.tick).expect("its inputs are there");
            assert_eq!(wire::Frame::from(host), *tick);
        }
    }
}

fn last_outputs(boot: &Booted) -> Option<LastOutputs> {
    boot.boot.as_ref().expect("a boot record").last_outputs
}

fn after_a_power_on_the_first_pulse_is_the_park_pose() {
    let ran = Board::find().run(walk_options(2.0, &[]));
    ran.assert_sound();
    assert_eq!(last_outputs(&ran.boots[0]), None);
    let first = frames(&ran, 0.0, 2.0)[0];
    assert!(is_near(&first, &parked_us(), ROUNDING_US), "{first:?}");
}

/// A hang that the watchdog ends, a stall that the watchdog task ends, and a panic.
fn after_a_reset_arming_starts_at_the_last_pulses() {
    let board = Board::find();
    let again = again(&[4.0]);
    let again: Vec<&str> = again.iter().map(String::as_str).collect();
    for (fault, reset) in [
        (["--hang", "control_step@2.8"], Reset::IndependentWatchdog),
        (["--hang", "telemetry_step@2.85"], Reset::IndependentWatchdog),
        (["--panic", "2.9"], Reset::Software),
    ] {
        let ran = board.run(walk_options(7.5, &[&fault[..], &again].concat()));
        let boot = &ran.boots[1];
        assert_eq!((ran.boots.len(), boot.boot.as_ref().map(|boot| boot.reset)), (2, Some(reset)), "{fault:?}");
        let kept = last_outputs(boot).expect("kept").pulses_us.map(f64::from);
        let whole = frames(&ran, 0.0, boot.t_s - FRAME_S);
        // The timer may have put out the last command of the loop, or the one before it.
        let last = whole.last().expect("it walked");
        assert!(is_near(last, &kept, MOST_A_FRAME_US), "{last:?} us, kept {kept:?}");
        assert_starts_at_last(&ran, boot.t_s, &kept);
        assert_eq!(boot.ticks.last().expect("frames").state, SupervisorState::Walking);
        assert_replayed(&ran);
    }
}

/// The emergency stop ends the walk; one hold acknowledges it, the next one arms.
fn after_a_fault_arming_starts_at_the_last_pulses() {
    // Not three within 5 s.
    let presses = ["3.4:0.4", "5.6:0.4"];
    let more = ["--emergency-stop", STOP_TEST, "2.7:0.2", "--press", presses[0], "--press", presses[1]];
    let ran = Board::find().run(walk_options(8.5, &more));
    ran.assert_sound();
    let last = *frames(&ran, 0.0, 2.7 - FRAME_S).last().expect("it walked");
    let commanded =
        ran.boots[0].ticks.iter().rev().find(|tick| tick.state == SupervisorState::Walking && tick.tick < 2_700);
    assert!(is_near(&last, &commanded.expect("it walked").pulses_us.map(f64::from), MOST_A_FRAME_US));
    let first = frames(&ran, 3.0, 9.0)[0];
    assert!(is_near(&first, &last, MOST_A_FRAME_US), "starts at {first:?}, ended at {last:?}");
    assert_starts_at_last(&ran, 3.0, &first);
    assert_replayed(&ran);
}

/// A minute after the reset the first pulse is the park pose, as without a last one.
fn after_a_minute_the_last_pulses_are_not_known() {
    let again = again(&[63.5]);
    let again: Vec<&str> = again.iter().map(String::as_str).collect();
    let ran = Board::find().run(walk_options(65.0, &[&["--panic", "2.9"], &again[..]].concat()));
    assert!(last_outputs(&ran.boots[1]).is_some());
    let first = frames(&ran, 4.0, 66.0)[0];
    assert!(is_near(&first, &parked_us(), ROUNDING_US), "{first:?}");
    assert_replayed(&ran);
}

/// Widths of a run that the same run without the fault does not have.
fn cut(ran: &Ran, undisturbed: &Ran) -> usize {
    let both = ran.pulses.iter().zip(&undisturbed.pulses);
    both.map(|((_, us), (_, whole))| us.iter().zip(whole).filter(|(us, whole)| us.is_some() && us != whole).count())
        .sum()
}

/// The moments of a frame of the walk, s: one in 0.2 ms of its first 3 ms.
fn moments(undisturbed: &Ran) -> impl Iterator<Item = f64> {
    let start_s = undisturbed.pulses.iter().map(|(at, _)| *at).find(|at| *at > 2.0).expect("it walks") + FRAME_S;
    (0..15).map(move |part| start_s + 0.0002 * f64::from(part) + 1.03e-5)
}

/// The crystal stops: hardware cuts the pulses at once and the program resets. The next boot has their number.
fn pulses_that_a_clock_failure_cuts_are_counted_at_the_next_boot() {
    let board = Board::find();
    let undisturbed = board.run(walk_options(2.6, &[]));
    let mut all = 0;
    for at in moments(&undisturbed) {
        let ran = board.run(walk_options(2.6, &["--hse-fail", &at.to_string()]));
        let boot = &ran.boots[1];
        let LastOutputs { cut: counted, on, .. } = last_outputs(boot).expect("kept");
        assert_eq!((counted as usize, on), (cut(&ran, &undisturbed), false), "crystal stopped at {at} s");
        let lines = boot.log.iter().filter(|line| line.contains("of the last run cut short")).count();
        assert_eq!(lines, usize::from(counted > 0), "{:?}", boot.log);
        all += counted;
    }
    report!("a crystal that stops at 15 moments: {all} pulses cut, all in the next boot record");
    assert!(all >= 10, "{all} pulses cut");
}

/// The emergency stop cuts pulses, and then the board is reset.
fn pulses_that_the_stop_cuts_are_counted_at_the_next_boot() {
    let board = Board::find();
    let undisturbed = board.run(walk_options(2.6, &[]));
    let mut all = 0;
    for at in moments(&undisturbed).step_by(3) {
        let stop = format!("{at}:1");
        let ran = board.run(walk_options(2.6, &["--emergency-stop", STOP_TEST, &stop, "--panic", "2.4"]));
        let LastOutputs { cut: counted, on, .. } = last_outputs(&ran.boots[1]).expect("kept");
        assert_eq!((counted as usize, on), (cut(&ran, &undisturbed), false), "stopped at {at} s");
        all += counted;
    }
    assert!(all >= 3, "{all} pulses cut");
}

/// A watchdog reset may cut each pulse, and nothing runs that could count it: the next boot says that the outputs were on. A panic ends them first.
fn a_reset_that_finds_the_outputs_on_is_reported() {
    let board = Board::find();
    for (fault, is_on) in [
        (&["--hang", "control_step@2.2"][..], true),
        (&["--halt", "2.2"], true),
        (&["--panic", "2.2"], false),
        (&["--press", "2.0:0.1", "--hang", "control_step@4"], false),
    ] {
        let ran = board.run(walk_options(4.6, fault));
        let boot = &ran.boots[1];
        let last = last_outputs(boot).expect("kept");
        assert_eq!((last.on, last.cut), (is_on, 0), "{fault:?}");
        let lines = boot.log.iter().filter(|line| line.contains("the reset came while the outputs were on")).count();
        assert_eq!(lines, usize::from(is_on), "{fault:?}: {:?}", boot.log);
    }
}
