//! The image of the Black Pill on the virtual board, which models its STM32F411: boot, arming, walk, stop, emergency stop, a hang, the lamp, the key
//! without a resistor, and a crystal of another frequency.
//!
//! What this shows is shown on models of the chip's peripherals, not on hardware.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::Path;
use std::process::{Command, ExitCode};

use firmware::board::black_pill_f411::BOARD;
use firmware::interrupts::ENABLED;
use firmware_shared::lamp::Shown;
use footfall::board::image::Image;
use footfall_tests::board::{Board, Ran};
use footfall_tests::gestures::{ARM, STOP_TEST, stop, walk_options};
use footfall_tests::lamps::Lamps;
use footfall_tests::limits::assert_in_time;
use footfall_tests::recordings::default_volts_file;
use joint_loop::{Cause, GeneratorConfig, SupervisorState};
use serde_json::Value;
use test_suite::{report, tests};
use wire::{Reset, Subject};

fn main() -> ExitCode {
    test_suite::run(tests![
        it_walks_ten_seconds_and_stops_by_the_key(BlackPillImage),
        its_samples_and_frames_are_exact(BlackPillImage),
        no_pin_moves_before_it_is_armed(BlackPillImage),
        its_ticks_are_on_time_at_any_speed_of_the_processor(BlackPillImage),
        the_emergency_stop_takes_the_supply_with_the_pulse(BlackPillImage),
        a_hang_is_reset_by_the_watchdog(BlackPillImage),
        the_one_lamp_shows_each_state(BlackPillImage),
        the_pull_up_holds_the_key(BlackPillImage),
        a_board_with_a_crystal_of_8_mhz_stays_off(BlackPillImage),
        its_image_runs_on_no_other_board(BlackPillImage),
        its_image_names_the_pins_of_its_sensors(BlackPillImage),
    ])
}

/// Latest moment at which the supply is off after the break input has cut a pulse, us.
const LATEST_RAIL_AFTER_BREAK_US: f64 = 50.0;
/// Shortest accepted time between a write of a pulse width and the start of a servo frame, us.
const LEAST_MARGIN_US: f64 = 300.0;

fn number(object: &Value, key: &str) -> f64 {
    object[key].as_f64().unwrap_or_else(|| panic!("no {key}: {object}"))
}

/// The columns of a CSV file.
fn rows(file: &Path) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(file).expect("recorded");
    text.lines().skip(1).map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

fn it_walks_ten_seconds_and_stops_by_the_key() {
    let press = stop(12.9);
    let ran = Board::black_pill().run(walk_options(14.8, &["--press", &press]));
    ran.assert_sound();
    let (end, boot) = (&ran.end, &ran.boots[0]);
    assert_eq!((end.edges_before_arming, end.edges_after_disarming, end.unexpected_faults), (0, 0, 0));
    let start = ran.output.lines().next().expect("a first line");
    assert!(start.contains("\"board\":\"black-pill-f411\""), "{start}");
    assert_eq!(
        boot.boot.as_ref().map(|boot| (boot.board.as_str(), boot.chip.as_str())),
        Some((BOARD.name, BOARD.chip))
    );

    let frames = boot.replay(&GeneratorConfig::default_walk());
    let walking = frames.iter().filter(|frame| frame.state == SupervisorState::Walking).count();
    let last = frames.last().expect("frames");
    assert!(walking >= 10_000, "{walking} ticks of walking");
    assert!((14_780..=14_800).contains(&last.tick), "{} ticks in 14.8 s", last.tick);
    assert_eq!((last.missed, last.late, last.overruns, last.state), (0, 0, 0, SupervisorState::Disarmed));
    // To the bit: each frame of the log against the host's loop with the same inputs.
    assert_eq!(ran.books.different, 0);
    assert!(ran.books.compared >= boot.ticks.len() as u64 && boot.ticks.len() > 1_000, "{:?}", ran.books);

    // Every pulse was judged, and each is of a width that the host commands in the 45 ms before it ends.
    assert_eq!((end.judged.violations, end.judged.cut, end.judged.pulses), (0, 0, ran.pulses.len() as u64 * 4));
    for (t_s, us) in &ran.pulses {
        let tick = (t_s * 1e3) as usize;
        let near = &frames[tick.saturating_sub(45)..(tick + 3).min(frames.len())];
        for (servo, us) in us.iter().enumerate() {
            let us = us.unwrap_or_else(|| panic!("servo {servo} has no pulse at {t_s} s"));
            let is_commanded = near.iter().any(|frame| (f64::from(frame.pulses[servo].0) - us).abs() < 0.6);
            assert!(is_commanded, "servo {servo} at {t_s} s: {us} us");
        }
    }
    let listed: BTreeMap<u8, u8> = ENABLED.iter().map(|interrupt| (interrupt.line, interrupt.priority)).collect();
    assert_eq!(end.interrupts, listed);
    let cost = boot.costs.last().expect("a second has passed");
    let longest = boot.costs.iter().map(|cost| cost.longest_cycles).max();
    report!(
        "{} frames with pulses, longest tick {longest:?} instructions, stack {} of {} bytes",
        ran.pulses.len(),
        cost.stack_used,
        cost.stack_size
    );
}

/// The converter starts each 250 us, the servo frames each 20 ms, to the clock cycle: 25 MHz make exact microseconds.
fn its_samples_and_frames_are_exact() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("conversions.csv");
    let options = ["--record-conversions", file.to_str().expect("UTF-8")];
    let ran = Board::black_pill().run(walk_options(3.0, &options));
    ran.assert_sound();
    let of = |channel: &str| -> Vec<f64> {
        let name = format!("ADC1_IN{channel}");
        rows(&file).iter().filter(|row| row[2] == name).map(|row| row[0].parse().expect("a time")).collect()
    };
    let cycle_s = 1.0 / (f64::from(BOARD.clocks.core_mhz()) * 1e6);
    // The first sensor is the first of each scan.
    let times = of("1");
    assert!(times.len() > 11_000, "{} samples in 3 s", times.len());
    let worst = times.windows(2).map(|two| (two[1] - two[0] - 250e-6).abs()).fold(0.0, f64::max);
    assert!(worst <= 1.5 * cycle_s, "{worst} s from sample to sample");
    let all: usize = BOARD.sensors.iter().map(|sensor| of(&sensor.channel.to_string()).len()).sum();
    assert!(
        all >= 4 * times.len() - 4 && !of("17").is_empty() && !of("18").is_empty(),
        "{all} samples of four sensors"
    );
    let frames = ran.pulses.windows(2).map(|two| (two[1].0 - two[0].0 - 0.02).abs()).fold(0.0, f64::max);
    assert!(frames <= 1.5 * cycle_s, "{frames} s from frame to frame");
    // Reference and temperature are read from their channels: 3.3 V, 25 degrees in the model.
    let chip = ran.boots[0].environment.last().expect("a second has passed");
    let (volts, celsius) = (chip.supply_v.expect("a supply"), chip.die_c.expect("a temperature"));
    assert!((volts - 3.3).abs() < 0.01 && (celsius - 25.0).abs() < 1.5, "{volts} V, {celsius} degrees");
}

fn no_pin_moves_before_it_is_armed() {
    // A press without the test of the emergency stop does not arm.
    for options in [&["--secs", "3"][..], &["--secs", "3", "--press", ARM, "--level", "PB12=1"]] {
        let ran = Board::black_pill().run(options);
        ran.assert_sound();
        assert!(ran.pulses.is_empty() && ran.end.edges_before_arming == 0, "{options:?}");
        let moved: Vec<&String> = ran.end.edges.keys().collect();
        let expected = [BOARD.sync_output, BOARD.led_pulses.expect("it has one")].map(|pin| pin.to_string());
        assert_eq!(moved, expected.iter().collect::<Vec<_>>(), "{options:?}");
    }
}

/// From 0.8 to 3 cycles an instruction, at 100 MHz: no tick is late, and the widths are written far from the start of a servo frame.
fn its_ticks_are_on_time_at_any_speed_of_the_processor() {
    for cpi in ["0.8", "1", "2", "3"] {
        // At 3 cycles an instruction the board boots in more than the 50 ms after which the stop is tested before `ARM`.
        let volts = default_volts_file();
        let gestures = ["--emergency-stop", "0.15:0.1", "--press", "0.3:0.4"];
        let mut options: Vec<OsString> =
            ["--cpi", cpi, "--secs", "4"].into_iter().chain(gestures).map(Into::into).collect();
        options.extend(["--loop".into(), "--volts".into(), volts.into()]);
        let ran = Board::black_pill().run(options);
        ran.assert_sound();
        let margin = ran.end.frame_margin_us.expect("widths were written");
        let latest = ran.boots[0].costs.iter().map(|cost| cost.latest_start_us).max();
        let longest = ran.boots[0].costs.iter().map(|cost| cost.longest_cycles).max();
        report!("{cpi} cycles an instruction: {margin} us to the frame, start at {latest:?} us, {longest:?} cycles");
        assert!(margin >= LEAST_MARGIN_US, "{cpi} cycles an instruction: {margin} us");
        assert_eq!(ran.boots[0].ticks.last().map(|tick| tick.state), Some(SupervisorState::Walking));
    }
}

/// In the middle of a pulse: hardware cuts it, and the interrupt of the break switches the supply off.
fn the_emergency_stop_takes_the_supply_with_the_pulse() {
    let board = Board::black_pill();
    let undisturbed = board.run(walk_options(3.0, &[]));
    let start = undisturbed.pulses.iter().map(|(at, _)| *at).find(|at| *at > 2.0).expect("it walks");
    let at = start + 0.0005;
    let folder = tempfile::tempdir().expect("a folder");
    let rail = folder.path().join("rail.csv");
    let rails = format!("{}={}", BOARD.servo_rail, rail.display());
    let press = format!("{at}:1");
    let ran = board.run(walk_options(3.4, &["--emergency-stop", STOP_TEST, &press, "--record-edges", &rails]));
    let off: Vec<f64> =
        rows(&rail).iter().filter(|row| row[1] == "0").map(|row| row[0].parse().expect("a time")).collect();
    let [off] = off.as_slice() else { panic!("the supply goes off once: {off:?}") };
    let after_us = (off - at) * 1e6;
    report!("supply off {after_us:.2} us after the emergency stop");
    assert!((0.0..=LATEST_RAIL_AFTER_BREAK_US).contains(&after_us), "{after_us} us");
    let boot = &ran.boots[0];
    let last = boot.ticks.last().expect("frames");
    assert_eq!((last.state, last.cause), (SupervisorState::Fault, Cause::BreakInput));
    assert_eq!(boot.costs.last().expect("a second has passed").truncated, 4, "{:?}", boot.log);
    assert!(ran.pulses.last().expect("pulses").0 <= at, "a pulse after the stop");
}

fn a_hang_is_reset_by_the_watchdog() {
    for task in ["control_step", "telemetry_step", "watchdog_step"] {
        let hang = format!("{task}@2");
        let ran = Board::black_pill().run(walk_options(3.0, &["--hang", &hang]));
        let [reaction] = ran.end.injections.as_slice() else { panic!("{:?}", ran.end.injections) };
        let [low, reset] = ["low_us", "reset_us"].map(|key| number(reaction, key));
        report!("{task} hangs: reset after {reset} us");
        assert!(low <= reset, "{task}: {reaction}");
        assert_in_time("H24", reset * 1e-3, task);
        let after = ran.boots[1].boot.as_ref().expect("a boot record");
        assert!([Reset::IndependentWatchdog, Reset::Software].contains(&after.reset), "{task}: {:?}", after.reset);
        assert!(ran.boots[1].ticks.iter().all(|tick| tick.pulses_us == [0; 4]), "{task}: it boots disarmed");
        assert_eq!((ran.end.unmodelled, ran.end.edges_before_arming), (0, 0), "{task}");
    }
}

fn the_one_lamp_shows_each_state() {
    let board = Board::black_pill();
    let run = |secs: f64, options: &[&str]| Lamps::of_run(&BOARD, &board, secs, options);
    let (lamps, _) = run(5.0, &[]);
    lamps.assert_shown(Shown::Disarmed, 300);
    let (lamps, _) = run(5.0, &["--emergency-stop", "100"]);
    lamps.assert_shown(Shown::StopUntested, 200);
    let (lamps, ran) = run(4.0, &["--press", ARM]);
    lamps.assert_shown(Shown::Armed, 500);
    assert!(!ran.pulses.is_empty());
    // The lamp of the pulses shows faults too, and why the board stays off.
    let (lamps, _) = run(5.0, &["--press", ARM, "--emergency-stop", "0.05:0.05", "0.15:0.05"]);
    lamps.assert_shown(Shown::Fault, 300);
    let (lamps, ran) = run(8.0, &["--hse-dead"]);
    lamps.assert_shown(Shown::Off(Subject::Clock), 1_000);
    let [refused] = ran.boots[0].refused.as_slice() else { panic!("{:?}", ran.boots[0].refused) };
    assert!(refused.reason.contains("the clock HSE did not start"), "{}", refused.reason);
}

/// The key only connects its pin with ground. Without the pull-up, which the program switches on, the open key reads as pressed.
fn the_pull_up_holds_the_key() {
    const PUPDR_OF_A: &str = "0x4002000C";
    let board = Board::black_pill();
    let state = |ran: &Ran| ran.boots[0].ticks.last().map(|tick| tick.state);
    let held = board.run(walk_options(3.4, &[]));
    assert_eq!(state(&held), Some(SupervisorState::Walking));
    let without = format!("{PUPDR_OF_A}=0@3");
    let released = board.run(walk_options(3.4, &["--register", &without]));
    assert_ne!(state(&released), Some(SupervisorState::Walking), "an open key stops the walk");
}

/// The same board is sold with 8 MHz: every pulse would be 3.1 times too long. It stays off, and the log names both frequencies.
fn a_board_with_a_crystal_of_8_mhz_stays_off() {
    let ran = Board::black_pill().run(walk_options(4.0, &["--hse-hz", "8000000"]));
    assert_eq!((ran.code, ran.end.unmodelled, ran.end.lints.len()), (Some(0), 0, 0), "{:?}", ran.end.lints);
    assert!(ran.pulses.is_empty() && ran.end.edges_before_arming == 0);
    let [refused] = ran.boots[0].refused.as_slice() else { panic!("{:?}", ran.boots[0].refused) };
    report!("{}", refused.reason);
    assert_eq!(refused.subject, Subject::Clock);
    let words = ["the clock HSE has 8.0", "allowed is 23.77 to 27.27 MHz"];
    assert!(words.iter().all(|words| refused.reason.contains(words)), "{}", refused.reason);
}

fn its_image_runs_on_no_other_board() {
    let path = |variable: &str| std::env::var_os(variable).expect(variable);
    let output = Command::new(path("FOOTFALL_VIRTUAL_BOARD"))
        .arg(path("FOOTFALL_BLACK_PILL_ELF"))
        .args(["--board", "f4-discovery", "--secs", "1"])
        .output()
        .expect("it starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!((output.status.code(), output.stdout.len()), (Some(2), 0), "{said}");
    assert!(said.contains("the ELF is for the board black-pill-f411, and --board names f4-discovery"), "{said}");
}

/// `footfall watch` feeds a recording to these pins.
fn its_image_names_the_pins_of_its_sensors() {
    let elf = std::env::var_os("FOOTFALL_BLACK_PILL_ELF").expect("FOOTFALL_BLACK_PILL_ELF");
    let image = Image::read(elf.as_ref()).expect("the image");
    assert_eq!(image.sensor_pins(), BOARD.sensors.map(|sensor| sensor.pin.name));
}
