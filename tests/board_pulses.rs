//! Servo pulses and the servos' supply on the flashed image on the virtual board: no pulse is cut short while the processor runs, the supply goes
//! off first where that cannot be, and servo frames start far from the ticks.

use std::path::Path;
use std::process::ExitCode;

use firmware::board::f4_discovery::BOARD;
use footfall_tests::board::{Board, Ran};
use footfall_tests::campaign;
use footfall_tests::gestures::{STOP_TEST, walk_options};
use footfall_tests::limits::assert_in_time;
use joint_loop::{Cause, SupervisorState};
use serde_json::Value;
use test_suite::{report, tests};

fn main() -> ExitCode {
    test_suite::run(tests![
        a_fault_handler_waits_for_the_end_of_a_pulse(Image),
        a_timer_that_stands_still_holds_no_handler(Image),
        the_emergency_stop_takes_the_supply_with_the_pulse(Image),
        the_emergency_stop_takes_the_supply_at_any_moment_of_a_tick(Image),
        a_reset_in_a_pulse_takes_the_supply_with_it(Image),
        the_supply_is_on_only_while_there_are_pulses(Image),
        frames_start_far_from_the_ticks(Image),
        frames_start_far_from_the_ticks_after_lost_conversions(Image),
    ])
}

/// Latest moment at which the servos' supply is off after a handler has begun, us.
const LATEST_RAIL_US: f64 = 10.0;
/// Latest moment at which it is off after the break input has cut a pulse, us: the interrupt waits for a critical section at most.
const LATEST_RAIL_AFTER_BREAK_US: f64 = 50.0;
/// Latest moment at which the outputs are off after a handler has begun: the longest pulse, and some instructions.
const LATEST_DARK_US: f64 = 2_510.0;
/// Shortest accepted time between a write of a pulse width and the start of a servo frame, us.
const LEAST_MARGIN_US: f64 = 300.0;
/// A servo frame, s.
const FRAME_S: f64 = 0.02;

/// A run without a fault, as long as any other here.
fn undisturbed(board: &Board) -> Ran {
    board.run(walk_options(3.4, &[]))
}

/// The start of a servo frame of the walk, s.
fn frame_start_s(undisturbed: &Ran) -> f64 {
    undisturbed.pulses.iter().map(|(at, _)| *at).find(|at| *at > 2.0).expect("it walks")
}

fn number(object: &Value, key: &str) -> f64 {
    object[key].as_f64().unwrap_or_else(|| panic!("no {key}: {object}"))
}

/// Widths of a run that the same run without the fault does not have: two runs are the same up to the fault.
fn cut(ran: &Ran, undisturbed: &Ran) -> Vec<f64> {
    let mut cut = Vec::new();
    for ((t_s, us), (expected_s, expected)) in ran.pulses.iter().zip(&undisturbed.pulses) {
        assert!((t_s - expected_s).abs() < 1e-3, "a frame at {t_s} s, not at {expected_s} s");
        cut.extend(us.iter().zip(expected).filter(|(us, expected)| us != expected).filter_map(|(us, _)| *us));
    }
    cut
}

/// A panic and a fault at 12 moments of a frame: the supply is off at once, every pulse is whole, then the outputs are off.
fn a_fault_handler_waits_for_the_end_of_a_pulse() {
    let board = Board::find();
    let undisturbed = undisturbed(&board);
    let start_s = frame_start_s(&undisturbed);
    let (mut latest_rail, mut latest_dark) = (0.0_f64, 0.0_f64);
    for part in 0..12 {
        let at = start_s + FRAME_S + 0.0002 * f64::from(part - 1);
        let panics = at.to_string();
        let faults = format!("telemetry_step@{at}");
        for (option, value) in [("--panic", &panics), ("--fault", &faults)] {
            let ran = board.run(walk_options(2.4, &[option, value]));
            let [reaction] = ran.end.injections.as_slice() else { panic!("{:?}", ran.end.injections) };
            let [rail, dark, low] = ["rail_us", "disarmed_us", "low_us"].map(|key| number(reaction, key));
            assert_in_time("H07", rail * 1e-3, option);
            assert!(rail <= LATEST_RAIL_US && dark <= LATEST_DARK_US && low <= dark, "{option} {value}: {reaction}");
            assert!(cut(&ran, &undisturbed).is_empty(), "{option} {value}: {:?}", cut(&ran, &undisturbed));
            (latest_rail, latest_dark) = (latest_rail.max(rail), latest_dark.max(dark));
        }
    }
    report!("supply off after {latest_rail} us at most, outputs off after {latest_dark} us at most");
}

/// TIM1 stops in the middle of a pulse, then the program panics: the wait ends, the pins are low, and the board boots again.
fn a_timer_that_stands_still_holds_no_handler() {
    let board = Board::find();
    let at = frame_start_s(&undisturbed(&board)) + FRAME_S + 0.0004;
    let (stops, panics) = (format!("0x40010000=0x80@{at}"), (at + 0.0001).to_string());
    let ran = board.run(walk_options(2.4, &["--register", &stops, "--panic", &panics]));
    let reaction = ran.end.injections.iter().find(|one| one["kind"] == "panic").expect("it panics");
    let [rail, dark, reset] = ["rail_us", "disarmed_us", "reset_us"].map(|key| number(reaction, key));
    report!("timer stopped: supply off after {rail} us, outputs off after {dark} us, reset after {reset} us");
    assert!(rail <= LATEST_RAIL_US && dark <= reset && reset <= 38_000.0, "{reaction}");
    assert_eq!((ran.boots.len(), ran.end.edges_after_disarming), (2, 0));
}

/// The break input at 80 moments of a frame, each at another moment of a tick's period, 12.5 us apart, so that some are inside a tick: hardware cuts the pulse, the supply follows, and the board counts what was cut.
fn the_emergency_stop_takes_the_supply_with_the_pulse() {
    let board = Board::find();
    let undisturbed = undisturbed(&board);
    let start_s = frame_start_s(&undisturbed) + FRAME_S;
    let folder = tempfile::tempdir().expect("a folder");
    let rail = folder.path().join("rail.csv");
    let (mut latest, mut all) = (0.0_f64, 0);
    for part in 0..80 {
        let at = start_s + FRAME_S * f64::from(part) / 80.0 + 12.5e-6 * f64::from(part) + 3.1e-6;
        let stop = format!("{at}:1");
        let rails = format!("{}={}", BOARD.servo_rail, rail.display());
        let ran = board.run(walk_options(3.4, &["--emergency-stop", STOP_TEST, &stop, "--record-edges", &rails]));
        let off = falls(&rail);
        let [off] = off.as_slice() else { panic!("the supply goes off once: {off:?}") };
        latest = latest.max((off - at) * 1e6);
        assert!(
            (0.0..=LATEST_RAIL_AFTER_BREAK_US).contains(&((off - at) * 1e6)),
            "stop at {at}, supply off at {off} s"
        );
        let boot = &ran.boots[0];
        let last = boot.ticks.last().expect("frames");
        assert_eq!((last.state, last.cause), (SupervisorState::Fault, Cause::BreakInput));
        let counted = boot.costs.last().expect("a second has passed").truncated as usize;
        let cut = cut(&ran, &undisturbed);
        assert_eq!(counted, cut.len(), "{cut:?}");
        assert_eq!(boot.log.iter().any(|line| line.contains("cut short")), counted > 0, "{:?}", boot.log);
        all += counted;
    }
    assert!(all >= 4, "{all} pulses cut at 80 moments: none of them in a pulse");
    assert_in_time("H56", latest * 1e-3, "the emergency stop");
    report!("emergency stop at 80 moments of a frame: {all} pulses cut, supply off after {latest:.2} us at most");
}

/// The emergency stop at each microsecond of a control period: its interrupt may have to wait for a part of the tick that masks interrupts.
fn the_emergency_stop_takes_the_supply_at_any_moment_of_a_tick() {
    const MOMENTS: usize = 1000;
    let head = campaign::head();
    let limits = head.split_once("[limits]").expect("limits").1.split_once("\n\n").expect("their end").0;
    let name = |moment: usize| format!("{moment} us");
    let states: Vec<String> = (0..MOMENTS)
        .map(|moment| {
            let at_s = 3.2 + 1e-6 * moment as f64;
            format!("{{ name = \"{}\", at_s = {at_s:.6}, outputs = true, says = \"walking (none)\" }}", name(moment))
        })
        .collect();
    let names: Vec<String> = (0..MOMENTS).map(|moment| format!("\"{}\"", name(moment))).collect();
    let text = format!(
        "phases = 1\n[limits]{limits}\n[[run]]\nname = \"walk\"\nemergency_stop = [{{ at_s = 0.05, hold_s = 0.05 }}]\n\
         press = [{{ at_s = 0.4, hold_s = 0.35 }}]\nstate = [{}]\n[[fault]]\nname = \"stop\"\n\
         inject = {{ level = {{ pin = \"PB12\", high = false }} }}\nstates = [{}]\n\
         expect = {{ reaction = \"off\", within_ms = 1, cause = \"break_input\" }}\n",
        states.join(", "),
        names.join(", ")
    );
    let file = tempfile::NamedTempFile::new().expect("a file");
    std::fs::write(file.path(), text).expect("written");
    let outcome = campaign::run(file.path(), "walk", &[]);
    assert_eq!((outcome.code, outcome.cases.len()), (Some(0), MOMENTS), "{}", outcome.said);
    let latest = outcome.cases.iter().map(|case| case["supply_us"].as_f64().expect("a time")).fold(0.0, f64::max);
    report!("emergency stop at {MOMENTS} moments of a period: supply off after {latest:.2} us at most");
    assert_in_time("H56", latest * 1e-3, "the emergency stop");
}

/// Times at which a recorded pin goes low.
fn falls(file: &Path) -> Vec<f64> {
    let text = std::fs::read_to_string(file).expect("recorded");
    let rows = text.lines().skip(1).filter_map(|line| line.split_once(','));
    rows.filter(|(_, level)| *level == "0").map(|(at, _)| at.parse().expect("a time")).collect()
}

/// The thread hangs, so the watchdog resets the chip, at some moment of a frame: with it the supply is off.
fn a_reset_in_a_pulse_takes_the_supply_with_it() {
    let board = Board::find();
    let folder = tempfile::tempdir().expect("a folder");
    let rail = folder.path().join("rail.csv");
    let rails = format!("{}={}", BOARD.servo_rail, rail.display());
    let undisturbed = undisturbed(&board);
    let mut in_pulse = 0;
    // The time from the last feed to the reset goes with the period of the oscillator: it covers a frame in steps of 1 ms.
    for part in 0..20 {
        let hz = (32_000.0 * 21.0 / (15.0 + f64::from(part))).round().to_string();
        let hang = "telemetry_step@2";
        let ran = board.run(walk_options(2.4, &["--hang", hang, "--lsi-hz", &hz, "--record-edges", &rails]));
        let [reset] = ran.end.resets.as_slice() else { panic!("{:?}", ran.end.resets) };
        let off = falls(&rail);
        assert!(off.len() == 1 && off[0] <= reset.t_s + 1e-7, "reset at {} s, supply off at {off:?} s", reset.t_s);
        in_pulse += cut(&ran, &undisturbed).len();
    }
    assert!(in_pulse >= 1, "20 resets over a frame cut no pulse");
    report!("20 resets by the watchdog over a frame cut {in_pulse} pulses; the supply was off with each");
}

/// The supply comes with the first pulse and goes after the last, and every pulse has it.
fn the_supply_is_on_only_while_there_are_pulses() {
    let board = Board::find();
    let folder = tempfile::tempdir().expect("a folder");
    let rail = folder.path().join("rail.csv");
    let rails = format!("{}={}", BOARD.servo_rail, rail.display());
    let ran = board.run(walk_options(6.0, &["--press", "3.0", "--record-edges", &rails]));
    ran.assert_sound();
    let powered =
        ran.output.lines().filter(|line| line.contains("\"pulses\"") && line.contains("\"rail\":true")).count();
    assert_eq!((powered, ran.end.edges[BOARD.servo_rail.name]), (ran.pulses.len(), 2));
    let off = falls(&rail)[0];
    let last = ran.pulses.last().expect("pulses").0;
    assert!((0.0..=0.024).contains(&(off - last)), "last pulse at {last} s, supply off at {off} s");
}

/// At 0.8 to 3 cycles an instruction no width is written within 300 us of the start of a frame.
fn frames_start_far_from_the_ticks() {
    let board = Board::find();
    for cpi in ["0.8", "1", "1.5", "2", "3"] {
        // The slowest is not yet ready for the stop's test at the usual time.
        let ran =
            board.run(walk_options(4.0, &["--emergency-stop", "0.06:0.024", "--press", "0.1:0.304", "--cpi", cpi]));
        let margin = ran.end.frame_margin_us.expect("it walks");
        report!("{cpi} cycles an instruction: {margin} us from a write to the start of a frame");
        assert!(margin >= LEAST_MARGIN_US, "{margin} us at {cpi} cycles an instruction");
    }
}

/// A converter that restarts does so at its place in the servo frames.
fn frames_start_far_from_the_ticks_after_lost_conversions() {
    let board = Board::find();
    for option in ["--adc-overrun", "--dma-error"] {
        let times = ["2", "2.60001", "3.20026", "3.80028", "4.40051", "5.00079"];
        let more: Vec<&str> = times.into_iter().flat_map(|time| [option, time]).collect();
        let ran = board.run(walk_options(6.0, &more));
        let margin = ran.end.frame_margin_us.expect("it walks");
        report!("{option}: {margin} us from a write to the start of a frame");
        assert!(margin >= LEAST_MARGIN_US, "{option}: {margin} us");
    }
}
