//! The image that would be flashed, on the virtual board: in normal operation, and with a fault injected.
//!
//! What this shows is shown on models of the chip's peripherals, not on hardware.

use firmware::board::{GENERATOR_SECTOR, ROBOT_SECTOR, SECTOR_BYTES};
use footfall::board::default_loop::SENSOR_JOINT;
use footfall::command::sync::{coded, edges};
use footfall_tests::board::{Board, Booted, Ran};
use footfall_tests::gestures::{self, ARM};
use footfall_tests::limits::assert_in_time;
use footfall_tests::recordings::default_volts_file;
use generator_file::file::{GeneratorFile, GeneratorSet};
use hgod_adc::{OVERSAMPLING, SensorState, trimmed_mean};
use joint_loop::io::time_code::level;
use joint_loop::setup::default_loop::{BoardLoop, Parameters};
use joint_loop::store::generator_record::record_of;
use joint_loop::store::robot_record;
use joint_loop::{
    BoardFaults, Direction, GeneratorConfig, JointSensor, LoopConfig, RecordName, RobotConfig, SupervisorState,
};
use joint_units::{AdcCode, Joint, PulseMicros, RadPerSec, Radians, Volts};
use serde_json::Value;
use std::ffi::OsString;
use std::io::{BufRead, BufReader};
use std::process::ExitCode;
use std::process::{Command, Stdio};
use test_suite::{report, tests};
use wire::{RecordId, Reset, Warnings};

fn main() -> ExitCode {
    test_suite::run(tests![
        ten_seconds_of_walking(Image),
        two_runs_are_bit_identical(Image),
        logged_angles_are_the_hosts_for_the_same_codes(Image),
        setpoints_of_a_run_equal_those_of_the_replay(Image),
        logged_codes_are_those_of_the_converter(Image),
        a_lost_conversion_is_a_fault_of_one_tick(Image),
        a_block_that_is_full_while_another_is_read_is_marked(Image),
        the_synchronisation_output_has_the_edges_of_its_code(Image),
        the_synchronisation_output_is_decoded(Image),
        the_board_reports_its_temperature_and_supply(Image),
        without_a_press_no_pin_ever_moves(Image),
        a_task_that_hangs_is_reset_and_boots_disarmed(Image),
        time_stamps_go_on_while_the_control_task_stands_still(Image),
        a_panic_or_a_fault_switches_the_supply_off_first(Image),
        an_open_wire_stops_the_walk_and_is_named(Image),
        the_board_runs_the_generator_of_its_parameter_sector(Image),
        a_broken_parameter_sector_keeps_the_outputs_off(Image),
        the_board_runs_the_robot_of_its_record(Image),
        without_a_robot_record_the_built_in_robot_walks_and_the_board_warns(Image),
        without_a_whole_robot_record_the_outputs_stay_off(Image),
        a_stalled_reader_of_the_log_delays_no_tick(Image),
        the_program_reports_the_run_with_two_equal_hashes(Image, Program),
        ctrl_c_ends_the_program_with_a_finished_recording(Image, Program),
    ])
}

/// The tasks that move the outputs, by the functions that each round of them calls.
const TASKS: [&str; 4] = ["sensor_step", "control_step", "telemetry_step", "watchdog_step"];

/// Latest moment at which the outputs are disarmed after a fault or panic handler has begun, in microseconds: the end of the longest pulse.
const LATEST_DARK_US: f64 = 2_600.0;

/// Options: so many seconds on the default volts, with these gestures of the button.
fn options(secs: f64, presses: &[&str], more: &[&str]) -> Vec<OsString> {
    let mut options: Vec<OsString> = vec!["--secs".into(), secs.to_string().into()];
    options.extend(["--volts".into(), default_volts_file().into(), "--loop".into()]);
    options.extend(gestures::options(presses));
    options.extend(more.iter().map(Into::into));
    options
}

/// Nothing irregular: the models were enough, no fault, no pin moved while disarmed.
fn assert_regular(ran: &Ran) {
    let end = &ran.end;
    assert_eq!((ran.code, end.reason.as_str()), (Some(0), "time"));
    assert_eq!((end.unmodelled, end.lints.len(), end.unexpected_faults), (0, 0, 0), "{:?}", end.lints);
    assert_eq!((end.edges_before_arming, end.edges_after_disarming), (0, 0), "edges while disarmed");
}

fn only(ran: &Ran) -> &Booted {
    assert_eq!((ran.boots.len(), ran.end.resets.len()), (1, 0), "one boot, no reset");
    &ran.boots[0]
}

/// Ticks of walking: ten seconds, or those of the variable `FOOTFALL_TICKS`.
fn walking_ticks() -> u32 {
    std::env::var("FOOTFALL_TICKS").map_or(10_000, |ticks| ticks.parse().expect("a number of ticks"))
}

/// Arms at 0.3 s, walks for so many ticks and some more, comes to rest, and stays dark for half a second.
fn walk(board: &Board) -> Ran {
    let secs = f64::from(walking_ticks()) * 1e-3;
    board.run(options(secs + 4.8, &[ARM, &gestures::stop(secs + 2.9)], &[]))
}

fn ten_seconds_of_walking() {
    let board = Board::find();
    let ran = walk(&board);
    assert_regular(&ran);
    let boot = only(&ran);
    let frames = boot.replay(&GeneratorConfig::default_walk());

    let walking = frames.iter().filter(|frame| frame.state == SupervisorState::Walking).count();
    assert!(walking >= walking_ticks() as usize, "{walking} ticks of walking");
    let last = frames[frames.len() - 1];
    assert_eq!((last.missed, last.late, last.overruns), (0, 0, 0));
    // All of the run at 1 kHz, but for the boot and what telemetry had not sent yet.
    let all = walking_ticks() + 4_800;
    assert!((all - 20..=all).contains(&last.tick), "{} ticks in {all} ms", last.tick);
    assert_eq!(last.state, SupervisorState::Disarmed);

    // Four pulse trains at 50 Hz without a hole, from the first pulse to the last.
    assert!(ran.pulses.iter().all(|(_, us)| us.iter().all(Option::is_some)), "a servo without its pulse");
    for two in ran.pulses.windows(2) {
        let period = two[1].0 - two[0].0;
        assert!((period - 0.02).abs() < 1e-6, "{period} s from pulse to pulse at {}", two[0].0);
    }
    let moving = frames.iter().filter(|frame| frame.state.moving()).count() as f64 * 1e-3;
    let seen = ran.pulses.len() as f64 * 0.02;
    assert!((seen - moving).abs() <= 0.04, "{seen} s of pulses, {moving} s of motion");

    // Each width is one that the host commands in the 45 ms before the pulse ends: preload takes one period at most.
    for (t_s, us) in &ran.pulses {
        let tick = (*t_s * 1e3) as usize;
        let near = &frames[tick.saturating_sub(45)..(tick + 3).min(frames.len())];
        for (servo, us) in us.iter().enumerate() {
            let us = us.unwrap_or_default();
            assert!(
                near.iter().any(|frame| f64::from(frame.pulses[servo].0) == us),
                "servo {servo}: {us} us at {t_s} s"
            );
        }
    }

    // And all of them inside what the gate's range lets through the servo map.
    let config = LoopConfig::default_biped();
    for (servo, joint) in Joint::ALL.into_iter().enumerate() {
        let map = config.servos[servo].build(joint).unwrap();
        let range = config.gate.range[servo];
        let ends = [range.least, range.most].map(|angle| f64::from(map.pulse(angle).unwrap().0));
        let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        let [least, most] = ran.end.pulse_us[servo].unwrap();
        assert!(least >= low && most <= high, "{}: {least}..{most} us, range {low}..{high}", joint.name());
        assert!(most - least > 200.0, "{} hardly moves: {least}..{most} us", joint.name());
    }
}

fn two_runs_are_bit_identical() {
    let board = Board::find();
    let [one, two] = [(); 2].map(|()| board.run(options(4.0, &[ARM], &[])));
    assert!(one.output.lines().count() > 400);
    assert!(one.output == two.output, "the second run is another one");
}

fn logged_angles_are_the_hosts_for_the_same_codes() {
    let board = Board::find();
    let ran = walk(&board);
    let boot = only(&ran);
    let words = boot.boot.as_ref().unwrap();
    // The sensor alone, without the loop around it.
    let joint_sensor = JointSensor::uncalibrated(SENSOR_JOINT).unwrap();
    let sensor = joint_sensor.build(AdcCode(words.reference_cal), Volts(words.min_supply_v)).unwrap();
    let mut state = SensorState::default();
    let mut ticks = boot.ticks.iter().peekable();
    let mut compared = 0;
    for (tick, call) in &boot.calls {
        state.missed(u32::from(call.elapsed) - 1);
        let reading = sensor.sample(&mut state, AdcCode(call.codes[0]), AdcCode(call.reference));
        if let Some(line) = ticks.next_if(|line| line.tick == *tick) {
            let logged = line.sensors[0].unwrap();
            assert_eq!(logged.angle_rad.to_bits(), reading.angle.0.to_bits(), "tick {tick}");
            assert_eq!(logged.validity, reading.validity, "tick {tick}");
            compared += 1;
        }
    }
    assert_eq!((compared, ticks.next().is_none()), (boot.ticks.len(), true));
    assert!(compared > 1_400, "{compared} lines");
}

fn setpoints_of_a_run_equal_those_of_the_replay() {
    let board = Board::find();
    let ran = walk(&board);
    let boot = only(&ran);
    let books = &ran.books;
    let (on_board, on_host) = books.hashes.expect("lines were compared");
    report!("setpoint hash: board {on_board:016x}, host {on_host:016x}");
    assert_eq!(on_board, on_host);
    assert_eq!(
        (books.different, books.not_compared, books.lost_lines, books.malformed),
        (0, 0, 0, 0),
        "{:?}",
        books.differences
    );
    assert!(books.why_not.is_none(), "{:?}", books.why_not);
    assert_eq!(books.compared as usize, boot.ticks.len());
    // No call of the loop is missing from the log, so the hash is of the whole run.
    assert_eq!(books.calls as usize, boot.calls.len());
    let last = boot.ticks[boot.ticks.len() - 1];
    // The run may end between the inputs of ten calls and the frame of the last of them.
    assert_eq!(last.setpoint_hash, on_board);
    assert!(
        [0, 10].contains(&(boot.calls.len() - last.seq as usize)),
        "{} calls, frame {}",
        boot.calls.len(),
        last.seq
    );
}

/// The codes in the log are trimmed means of the ones that the converter's model delivered, four a tick, in order.
/// A line of `--record-conversions`.
struct Conversion<'a> {
    /// Its end.
    time_s: f64,
    channel: &'a str,
    code: AdcCode,
}

fn conversions(text: &str) -> Vec<Conversion<'_>> {
    let mut rows = text.lines();
    let header: Vec<&str> = rows.next().unwrap().split(',').collect();
    let column =
        |name: &str| header.iter().position(|heading| *heading == name).unwrap_or_else(|| panic!("{header:?}"));
    let (time, channel, code) = (column("time_s"), column("channel"), column("code"));
    rows.map(|row| {
        let fields: Vec<&str> = row.split(',').collect();
        let (time_s, code) = (fields[time].parse().unwrap(), AdcCode(fields[code].parse().unwrap()));
        Conversion { time_s, channel: fields[channel], code }
    })
    .collect()
}

/// The codes of a channel as the firmware makes them: one of four conversions.
fn codes_of(rows: &[Conversion], name: &str) -> Vec<AdcCode> {
    let codes: Vec<AdcCode> = rows.iter().filter(|row| row.channel == name).map(|row| row.code).collect();
    let (fours, _) = codes.as_chunks::<OVERSAMPLING>();
    fours.iter().map(|four| trimmed_mean(*four)).collect()
}

fn logged_codes_are_those_of_the_converter() {
    let board = Board::find();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("conversions.csv");
    let mut options = options(2.0, &[ARM], &[]);
    options.extend(["--record-conversions".into(), file.clone().into()]);
    let ran = board.run(options);
    let text = std::fs::read_to_string(file).unwrap();
    let rows = conversions(&text);
    let codes_of = |name: &str| codes_of(&rows, name);
    let calls = &only(&ran).calls;
    let logged: Vec<AdcCode> = calls.iter().map(|(_, call)| AdcCode(call.codes[0])).collect();
    assert!(logged.len() > 1_900);
    assert!(codes_of("ADC1_IN1").starts_with(&logged), "the sensor's codes are others");
    let references: Vec<AdcCode> = calls.iter().map(|(_, call)| AdcCode(call.reference)).collect();
    assert!(codes_of("ADC1_IN17").starts_with(&references), "the reference's codes are others");

    // Four scans a tick, 250 us apart to the cycle: four sensors, connected or not, reference, temperature.
    let scans: Vec<&[Conversion]> = rows.chunks_exact(6).collect();
    let order = ["ADC1_IN1", "ADC1_IN11", "ADC1_IN8", "ADC1_IN9", "ADC1_IN17", "ADC1_IN16"];
    let seconds = |scan: &[Conversion]| scan[0].time_s;
    for two in scans.windows(2) {
        assert_eq!(std::array::from_fn(|n| two[0][n].channel), order);
        assert!((seconds(two[1]) - seconds(two[0]) - 250e-6).abs() < 1e-8, "at {} s", seconds(two[0]));
    }
    let took = scans[0][5].time_s - seconds(scans[0]);
    // From the end of the first sensor's conversion: three of 144 + 12 and two of 480 + 12 cycles of 21 MHz.
    assert!((took - (3.0 * 156.0 + 2.0 * 492.0) / 21e6).abs() < 1e-8, "{took} s");
}

/// The interrupt at the end of a block is held off, by the register that enables it, until the next block is full or nearly so: 60 times in a walk, 0.25 us
/// apart. The codes of each tick are those of one block, whole, or the tick has the fault; both ways occur. (A handler that began last reads for some
/// microseconds; the block that it reads is written again 170 us after the end of the other one.)
fn a_block_that_is_full_while_another_is_read_is_marked() {
    /// Interrupt of DMA2 stream 0, and the registers that enable and disable it.
    const LINE: u32 = 56;
    const ENABLE: u32 = 0xE000_E100 + LINE / 32 * 4;
    const DISABLE: u32 = 0xE000_E180 + LINE / 32 * 4;
    let board = Board::find();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("conversions.csv");
    let run = |more: &[&str]| {
        let mut options = options(2.6, &[ARM], more);
        options.extend(["--record-conversions".into(), file.clone().into()]);
        let ran = board.run(options);
        (ran, std::fs::read_to_string(&file).unwrap())
    };
    let (_, text) = run(&[]);
    let ends: Vec<f64> = conversions(&text).chunks_exact(6 * OVERSAMPLING).map(|block| block[23].time_s).collect();
    let mut script = String::new();
    let mut add = |at: f64, address: u32| {
        script += &format!(
            "[[event]]\nat_s = {at:.9}\ninject = {{ write = {{ address = {address:#x}, value = {:#x} }} }}\n",
            1 << (LINE % 32)
        );
    };
    for n in 0..60 {
        let block = 1_000 + 25 * n;
        add(ends[block] - 300e-6, DISABLE);
        add(ends[block + 1] - 10e-6 + 0.25e-6 * n as f64, ENABLE);
    }
    let path = folder.path().join("held-off.toml");
    std::fs::write(&path, script).unwrap();
    let (ran, text) = run(&["--script", path.to_str().unwrap()]);
    let boot = only(&ran);
    assert_eq!(ran.books.different, 0, "{:?}", ran.books.differences);
    let rows = conversions(&text);
    let blocks: Vec<(AdcCode, AdcCode)> =
        codes_of(&rows, "ADC1_IN1").into_iter().zip(codes_of(&rows, "ADC1_IN17")).collect();
    let (mut next, mut marked, mut held_off) = (0, 0, 0);
    for (tick, call) in &boot.calls {
        let is_marked = call.flags.faults().contains(BoardFaults::ADC_OVERRUN);
        marked += usize::from(is_marked);
        held_off += usize::from(call.elapsed > 1);
        let codes = (AdcCode(call.codes[0]), AdcCode(call.reference));
        // A set that was not read in time is replaced by the next one.
        let found = blocks[next..].iter().take(3).position(|block| *block == codes);
        assert!(is_marked || found.is_some(), "tick {tick}: {codes:?} is of no block, and not marked");
        next += found.unwrap_or(0) + 1;
    }
    report!("{} ticks, {held_off} after a missed one, {marked} marked", boot.calls.len());
    assert!(marked > 3 && held_off > 20, "{marked} marked, {held_off} after a missed period");
}

/// The converter's model makes a single conversion wrong or lost; the ticks go on, and each loss is a fault of one tick.
fn a_lost_conversion_is_a_fault_of_one_tick() {
    let board = Board::find();
    let undisturbed = board.run(options(6.0, &[ARM], &[]));
    let ticks = only(&undisturbed).calls.last().unwrap().0;
    for option in ["--adc-overrun", "--dma-error"] {
        // Anywhere in the millisecond: between scans, in a scan, before and after the tick.
        let times = ["2", "2.60001", "3.20026", "3.80028", "4.40051", "5.00079"];
        let more: Vec<&str> = times.into_iter().flat_map(|time| [option, time]).collect();
        let ran = board.run(options(6.0, &[ARM], &more));
        assert_regular(&ran);
        assert_eq!(ran.end.injections.len(), times.len());
        let boot = only(&ran);
        let frames = boot.replay(&GeneratorConfig::default_walk());
        let last = frames[frames.len() - 1];
        assert_eq!((last.state, last.overruns, last.late), (SupervisorState::Walking, 6, 0), "{option}");
        // The count of ticks stays that of the clock; the log comes in lines of ten.
        assert!(last.tick.abs_diff(ticks) <= 10, "{option}: {} ticks in 6 s, undisturbed {ticks}", last.tick);
        report!("{option}: {} ticks missed of {}", last.missed, last.tick);
        // Besides, the emergency stop was tested.
        let is_lost = |call: &wire::Call| !call.sample().faults.without(BoardFaults::BREAK_INPUT).is_empty();
        let faulty: Vec<u32> = boot.calls.iter().filter(|(_, call)| is_lost(call)).map(|(tick, _)| *tick).collect();
        for (tick, time) in faulty.iter().zip(times) {
            let at = time.parse::<f64>().unwrap() * 1e3;
            assert!((f64::from(*tick) - at).abs() < 20.0, "{option}: a fault in tick {tick}, injected at {at} ms");
        }
        // The sensor's codes are still the sensor's: after a restart no channel has changed its place.
        let code = |call: &wire::Call| (call.codes[0], call.reference);
        for (tick, call) in &boot.calls {
            let (sensor, vrefint) = code(call);
            assert!((1640..=1665).contains(&vrefint) && sensor > 1000, "{option}: {sensor} {vrefint} in tick {tick}");
        }
    }
}

/// As many edges as the code has.
fn the_synchronisation_output_has_the_edges_of_its_code() {
    let board = Board::find();
    let ran = board.run(options(7.0, &[], &[]));
    assert_regular(&ran);
    let last = only(&ran).calls.last().unwrap().0;
    let edges = |to: u32| (1..=to).filter(|tick| level(*tick) != level(tick - 1)).count() as u64;
    // Tick 1 finds the level of its slot already up: an edge more. The log may be ten ticks behind.
    let (seen, least, most) = (ran.end.edges["PB5"], edges(last) + 1, edges(last + 12) + 1);
    assert!((least..=most).contains(&seen), "{seen} edges, by the code {least} to {most}");
}

/// Its pulses as another system would record them, decoded: the two clocks are one, begun when the board booted.
fn the_synchronisation_output_is_decoded() {
    let board = Board::find();
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("sync.csv");
    let ran = board.run(options(11.0, &[], &["--record-edges", &format!("PB5={}", file.display())]));
    assert_regular(&ran);
    let edges = edges::read(&file).expect("edges").edges;
    assert_eq!(edges.len() as u64, ran.end.edges["PB5"], "every edge that was counted");
    let fit = coded::fit(&edges).expect("decoded");
    report!("synchronisation output: {fit:?}");
    assert!(fit.frames >= 2, "whole frames: {}", fit.frames);
    // The board's time is tick / 1 kHz, and a tick's edge comes within the tick: offset is the time from power-on to tick 0.
    let booted = only(&ran).t_s;
    assert!((booted..booted + 0.02).contains(&fit.clocks.offset_s), "{fit:?}, booted at {booted} s");
    assert!(fit.clocks.drift_ppm.abs() < 0.1, "one clock drifts by {} ppm against itself", fit.clocks.drift_ppm);
    assert!(fit.clocks.worst_s < 1e-5, "off by {} s", fit.clocks.worst_s);
    // All pulses but the first, which tick 1 found begun.
    let last = only(&ran).calls.last().expect("calls").0;
    assert!(fit.unused <= 1 && fit.ticks.1.abs_diff(last) <= 110, "{fit:?}, last tick {last}");
}

/// Die of 25 degrees by the model's own curve, at each supply.
fn the_board_reports_its_temperature_and_supply() {
    let board = Board::find();
    for vdda in ["2.8", "3.0", "3.3"] {
        let ran = board.run(options(3.2, &[], &["--vdda", vdda]));
        let reported = &only(&ran).environment;
        assert!(reported.len() >= 3, "{reported:?}");
        for env in reported {
            let (die, supply) = (env.die_c.unwrap(), env.supply_v.unwrap());
            assert!((die - 25.0).abs() < 0.5, "{die} degrees at {vdda} V");
            assert!((supply - vdda.parse::<f32>().unwrap()).abs() < 0.003, "{supply} V instead of {vdda} V");
        }
    }
}

fn without_a_press_no_pin_ever_moves() {
    let board = Board::find();
    let ran = board.run(options(3.0, &[], &[]));
    assert_regular(&ran);
    assert!(ran.pulses.is_empty());
    for pin in ["PE9", "PE11", "PE13", "PE14"] {
        assert_eq!(ran.end.edges.get(pin), None, "{pin}");
    }
    assert!(
        only(&ran).ticks.iter().skip(1).all(|tick| tick.state == SupervisorState::Disarmed && tick.pulses_us == [0; 4])
    );
}

/// What the injected fault led to.
fn reaction(ran: &Ran) -> &Value {
    let [reaction] = ran.end.injections.as_slice() else { panic!("{:?}", ran.end.injections) };
    reaction
}

fn number(object: &Value, key: &str) -> f64 {
    object[key].as_f64().unwrap_or_else(|| panic!("no {key}: {object}"))
}

/// A reset out of a walk, and after it a board that is dark and disarmed.
fn assert_boots_disarmed(ran: &Ran) {
    assert!(ran.boots.len() >= 2, "no reset");
    assert_eq!((ran.end.edges_before_arming, ran.end.edges_after_disarming), (0, 0), "edges while disarmed");
    assert_eq!((ran.end.unmodelled, ran.end.lints.len(), ran.end.unexpected_faults), (0, 0, 0), "{:?}", ran.end.lints);
    let before = &ran.boots[0];
    assert_eq!(before.ticks[before.ticks.len() - 1].state, SupervisorState::Walking, "it was walking");
    let after = &ran.boots[1];
    assert!(after.ticks.len() > 20, "it runs again");
    for tick in &after.ticks {
        assert!(
            matches!(tick.state, SupervisorState::Boot | SupervisorState::Disarmed) && tick.pulses_us == [0; 4],
            "{tick:?}"
        );
    }
    let last_pulse = ran.pulses[ran.pulses.len() - 1].0;
    assert!(last_pulse < after.t_s, "a pulse at {last_pulse} s after the reset at {} s", after.t_s);
}

fn a_task_that_hangs_is_reset_and_boots_disarmed() {
    let board = Board::find();
    for task in TASKS {
        // The ends of what the data sheet allows for the watchdog's oscillator: the slowest resets last, the fastest first.
        for lsi in ["17000", "32000", "47000"] {
            let hang = format!("{task}@3");
            let ran = board.run(options(3.6, &[ARM], &["--hang", &hang, "--lsi-hz", lsi]));
            let reaction = reaction(&ran);
            let [dark, reset] = ["disarmed_us", "reset_us"].map(|key| number(reaction, key));
            report!("{task} hangs, LSI {lsi} Hz: outputs off after {dark} us, reset after {reset} us");
            for id in ["H24", "H30", "H31"] {
                assert_in_time(id, reset * 1e-3, task);
            }
            assert_boots_disarmed(&ran);
            // After a reset by the watchdog the reset flag says so; after one by the image itself the log names the task that stalled.
            let after = &ran.boots[1];
            let words = after.boot.as_ref().unwrap();
            let part = task.trim_end_matches("_step");
            let own = words.reset == Reset::Software
                && after.log.iter().any(|line| line.contains("stalled") && line.contains(part));
            assert!(words.reset == Reset::IndependentWatchdog || own, "{task}: {words:?}, {:?}", after.log);
        }
    }
    // What stands still without holding the processor: only the task that reloads the watchdog finds it. The board resets itself and names the part.
    let ran = board.run(options(3.6, &[ARM], &["--trigger-stop", "3"]));
    assert_boots_disarmed(&ran);
    assert_in_time("H31", number(reaction(&ran), "reset_us") * 1e-3, "no sample");
    let after = &ran.boots[1];
    assert_eq!(after.boot.as_ref().map(|boot| boot.reset), Some(Reset::Software));
    assert!(after.log.iter().any(|line| line.contains("stalled task sensor")), "{:?}", after.log);
}

/// No sample comes any more: the control task stands still, the log and its time stamps go on until the watchdog task resets the board.
fn time_stamps_go_on_while_the_control_task_stands_still() {
    let board = Board::find();
    let ran = board.run(options(3.6, &[ARM], &["--trigger-stop", "3"]));
    assert_boots_disarmed(&ran);
    let before = &ran.boots[0];
    let last = before.ticks[before.ticks.len() - 1];
    let (line, stamp_s) = before.log.iter().zip(&before.log_times).next_back().expect("a line for people");
    println!("last tick {}, then at {stamp_s} s: {line}", last.tick);
    assert!(line.contains("sensor stalled"), "{line}");
    // Ticks are numbered from the clock's start on, to some milliseconds; the watchdog task waits for 10 ms at least.
    let after_last_tick_s = stamp_s - f64::from(last.tick) * 1e-3;
    assert!((0.010..0.040).contains(&after_last_tick_s), "{after_last_tick_s} s after the last frame");
    let [dark, reset] = ["disarmed_us", "reset_us"].map(|key| number(reaction(&ran), key));
    assert!(dark <= reset, "outputs off after {dark} us, reset after {reset} us");
    assert_in_time("H30", reset * 1e-3, "no sample");
    let after = &ran.boots[1];
    assert_eq!(after.boot.as_ref().map(|boot| boot.reset), Some(Reset::Software));
    assert!(after.log.iter().any(|line| line.contains("stalled task sensor")), "{:?}", after.log);
}

fn a_panic_or_a_fault_switches_the_supply_off_first() {
    let board = Board::find();
    for (option, value, why) in [
        ("--panic", "3", "panic"),
        ("--fault", "control_step@3", "hard_fault"),
        ("--fault", "telemetry_step@3", "hard_fault"),
        ("--fault", "sensor_step@3", "hard_fault"),
    ] {
        let ran = board.run(options(3.6, &[ARM], &[option, value]));
        let reaction = reaction(&ran);
        let [rail, dark, low] = ["rail_us", "disarmed_us", "low_us"].map(|key| number(reaction, key));
        report!(
            "{option} {value}: supply off after {rail} us, outputs off after {dark} us, last pin low after {low} us"
        );
        assert_in_time("H07", rail * 1e-3, option);
        assert!(dark <= LATEST_DARK_US && low <= LATEST_DARK_US, "{option} {value}: {reaction}");
        assert_boots_disarmed(&ran);
        let log = &ran.boots[1].log;
        assert!(
            log.iter().any(|line| line.contains("last run ended by") && line.contains(why)),
            "{option} {value}: {log:?}"
        );
    }
}

fn an_open_wire_stops_the_walk_and_is_named() {
    let board = Board::find();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("open.csv");
    // A knee that swings, until the wire comes off at 4 s: the pull-down takes the pin to ground.
    let knee = |n: i32| 1.6 + 0.25 * (f64::from(n) * 0.057).sin();
    let mut text = String::from("time_s,PA1\n");
    for n in 0..400 {
        text += &format!("{},{:.6}\n", f64::from(n) * 0.01, knee(n));
    }
    text += "4.0,0\n";
    std::fs::write(&file, text).unwrap();
    let arguments: [OsString; 6] =
        ["--secs".into(), "6".into(), "--press".into(), ARM.into(), "--volts".into(), file.into()];
    let ran = board.run(arguments);
    assert_regular(&ran);
    let boot = only(&ran);
    let frames = boot.replay(&GeneratorConfig::default_walk());
    let left = frames.iter().rposition(|frame| frame.state == SupervisorState::Walking).unwrap();
    let open = frames.iter().position(|frame| frame.validity[0] == Some(hgod_adc::Validity::Open)).unwrap();
    let off = boot.calls.iter().position(|(_, call)| call.codes[0] < 81).unwrap();
    assert!(open - off <= 50, "named after {} ms", open - off);
    assert!(left - off <= 55, "the walk goes on for {} ms", left - off);
    assert_eq!(frames[left + 1].cause, joint_loop::Cause::SensorOpen);
    // A hurried stop: at rest within 0.3 s and the gate's settling.
    let rest = frames[left..].iter().position(|frame| !frame.state.moving()).unwrap();
    assert!(rest <= 400, "at rest after {rest} ms");
    assert_eq!(frames[frames.len() - 1].state, SupervisorState::Disarmed);
    assert_eq!(ran.books.different, 0, "{:?}", ran.books.differences);
}

/// Options that write these bytes into the generator's sector.
fn sector(bytes: &[u8]) -> (tempfile::NamedTempFile, String) {
    sector_at(GENERATOR_SECTOR, bytes)
}

/// Options that write these bytes into a sector.
fn sector_at(address: u32, bytes: &[u8]) -> (tempfile::NamedTempFile, String) {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), bytes).unwrap();
    let option = format!("{address:#010x}={}", file.path().display());
    (file, option)
}

fn the_board_runs_the_generator_of_its_parameter_sector() {
    let board = Board::find();
    for name in ["phase-coupled", "thesis"] {
        let mut file = GeneratorFile::default_of(name).unwrap();
        if let GeneratorSet::PhaseCoupled(set) = &mut file.set {
            // Not the built-in one.
            set.natural_period_s *= 0.9;
            set.joints[2].amplitude_deg = 25.0;
        }
        let config = file.set.config();
        let record = record_of(&config, &RecordName::new("normal walk").unwrap());
        let (_file, download) = sector(record.bytes());
        let ran = board.run_with(&config, options(6.0, &[ARM], &["--flash", &download]));
        assert_regular(&ran);
        // The boot line has the name and the check sum.
        let line = format!("generator \"normal walk\" {:08x}", record.crc());
        assert!(only(&ran).log.iter().any(|text| text.contains(&line)), "{line}: {:?}", only(&ran).log);
        let frames = only(&ran).replay(&config);
        assert_eq!((ran.books.different, ran.books.not_compared), (0, 0), "{name}: {:?}", ran.books.differences);
        assert!(ran.books.compared > 550, "{name}: {} lines compared", ran.books.compared);
        assert_eq!(frames[frames.len() - 1].state, SupervisorState::Walking, "{name}");
        let built_in = only(&ran).replay(&GeneratorConfig::default_walk());
        assert_ne!(frames[5_000].setpoints, built_in[5_000].setpoints, "{name} walks as the built-in one");
    }
}

/// Half a record, one without its commit word, one flipped bit, someone else's bytes, one byte at the end of an erased sector: no guess, no
/// pulse, and the log says what is wrong.
fn a_broken_parameter_sector_keeps_the_outputs_off() {
    let board = Board::find();
    let record = record_of(&GeneratorConfig::default_walk(), &RecordName::BUILT_IN);
    let mut flipped = record.bytes().to_vec();
    flipped[40] ^= 4;
    let mut almost_erased = vec![0xFF; SECTOR_BYTES];
    almost_erased[SECTOR_BYTES - 1] = 0;
    for (bytes, words) in [
        (&record.bytes()[..60], "generator_record refused: damaged: commit word ffffffff, its write was interrupted"),
        (&record.bytes()[..record.bytes().len() - 4], "damaged: commit word ffffffff"),
        (&flipped[..], "damaged: check sum"),
        (b"#!/bin/sh", "damaged: not all erased; allowed is that, or a record that begins with FFWK"),
        (&almost_erased, "damaged: not all erased"),
    ] {
        let (_file, download) = sector(bytes);
        let ran = board.run(options(1.5, &[ARM], &["--flash", &download]));
        assert!(ran.boots[0].log.iter().any(|line| line.contains(words)), "{words}: {:?}", ran.boots[0].log);
        assert!(ran.pulses.is_empty() && ran.boots[0].ticks.is_empty(), "{words}");
        assert_eq!((ran.end.edges_before_arming, ran.end.edges_after_disarming), (0, 0), "{words}");
    }
}

/// A robot with other servos, ranges, rates, park pose and supply: the board is the host's robot to the bit, keeps to its limits, and its
/// pulses are those of its servo maps.
fn the_board_runs_the_robot_of_its_record() {
    let board = Board::find();
    let mut robot = RobotConfig::default_biped();
    robot.min_supply = Volts(2.9);
    robot.gate.rate[0] = RadPerSec(Radians::from_degrees(60.0).0);
    robot.gate.range[2].most = Radians::from_degrees(40.0);
    robot.park[3] = Radians::from_degrees(12.0);
    robot.servos[0].neutral = PulseMicros(1_400);
    robot.servos[1].direction = Direction::Forward;
    robot.servos[3].micros_per_radian = 500.0;
    let parameters = Parameters::with_defaults(None, None, robot).unwrap();
    let record = robot_record::record_of(&robot, &RecordName::new("other robot").unwrap());
    let (_file, download) = sector_at(ROBOT_SECTOR, record.bytes());
    let ran = board.run_as(&parameters, options(6.0, &[ARM], &["--flash", &download]));
    assert_regular(&ran);
    let boot = only(&ran);
    let words = boot.boot.as_ref().unwrap();
    assert_eq!(words.robot, Some(RecordId::new("other robot", record.crc())));
    assert_eq!(words.min_supply_v, 2.9);
    let line = format!("robot \"other robot\" {:08x}", record.crc());
    assert!(boot.log.iter().any(|text| text.contains(&line)), "{line}: {:?}", boot.log);

    assert_eq!((ran.books.different, ran.books.not_compared), (0, 0), "{:?}", ran.books.differences);
    assert!(ran.books.compared > 550, "{} lines compared", ran.books.compared);
    let frames = boot.watch_as(&parameters, BoardLoop::frame);
    assert_eq!(frames[frames.len() - 1].state, SupervisorState::Walking);
    let degrees = |tick: usize, joint: usize| f64::from(frames[tick].setpoints[joint].0).to_degrees();
    assert!((degrees(50, 3) - 12.0).abs() < 1e-4, "the park pose of this robot");
    let steps = (1..frames.len()).map(|tick| (degrees(tick, 0) - degrees(tick - 1, 0)).abs() * 1e3);
    let (fastest, highest) =
        (steps.fold(0.0, f64::max), (0..frames.len()).map(|tick| degrees(tick, 2)).fold(0.0, f64::max));
    report!("left hip at most {fastest:.2} degrees/s, left knee at most {highest:.3} degrees");
    assert!((59.0..60.01).contains(&fastest), "{fastest} degrees/s");
    assert!((39.9..40.001).contains(&highest), "{highest} degrees");
    let default = boot.replay(&GeneratorConfig::default_walk());
    assert!(default[5_000].setpoints != frames[5_000].setpoints, "it walks as the default robot");

    // Neutral, direction and scale, with the default ones where nothing was changed; from setpoints near the end of the pulse.
    let servo = |joint: usize, degrees: f64| match joint {
        0 => 1_400.0 + 636.62 * degrees.to_radians(),
        1 => 1_500.0 + 636.62 * degrees.to_radians(),
        2 => 1_500.0 + 636.62 * (degrees - 45.0).to_radians(),
        _ => 1_500.0 - 500.0 * (degrees - 45.0).to_radians(),
    };
    assert!(ran.pulses.len() > 220, "{} periods of pulses", ran.pulses.len());
    for (t_s, us) in &ran.pulses {
        let tick = (*t_s * 1e3) as usize;
        for (joint, us) in us.iter().enumerate() {
            let near = tick.saturating_sub(45)..(tick + 3).min(frames.len());
            let us = us.unwrap_or_default();
            let is_near = near.into_iter().any(|tick| (servo(joint, degrees(tick, joint)) - us).abs() <= 0.51);
            assert!(is_near, "joint {joint}: {us} us at {t_s} s");
        }
    }
}

/// An erased sector: the built-in robot walks, and the board says so at the boot, at the arming and once a second; its records name it.
fn without_a_robot_record_the_built_in_robot_walks_and_the_board_warns() {
    let (_file, download) = sector_at(ROBOT_SECTOR, &[0xFF; 16]);
    let ran = Board::find().run(options(3.0, &[ARM], &["--flash", &download]));
    assert_regular(&ran);
    let boot = only(&ran);
    let built_in = robot_record::record_of(&RobotConfig::default_biped(), &RecordName::BUILT_IN);
    let record = boot.boot.as_ref().unwrap();
    assert_eq!(record.robot, Some(RecordId::new("built-in", built_in.crc())));
    assert_eq!(boot.ticks.last().unwrap().state, SupervisorState::Walking);
    assert_eq!((ran.books.different, ran.books.not_compared), (0, 0), "{:?}", ran.books.differences);
    let lines = boot.log.iter().filter(|line| line.starts_with("no robot record: the built-in robot walks")).count();
    assert_eq!(lines, 2, "{:?}", boot.log);
    assert!(
        !boot.environment.is_empty() && boot.environment.iter().all(|chip| chip.warnings == Warnings::BUILT_IN_ROBOT)
    );
    // The same robot from a record is no reason for a warning.
    let ran = Board::find().run(options(2.0, &[ARM], &[]));
    assert!(only(&ran).environment.iter().all(|chip| chip.warnings == Warnings::NONE));
}

/// Half a record, a record without its commit word, and a sound record of a robot that no servo reaches.
fn without_a_whole_robot_record_the_outputs_stay_off() {
    let board = Board::find();
    let record = |robot| robot_record::record_of(&robot, &RecordName::BUILT_IN);
    let good = record(RobotConfig::default_biped());
    let mut far = RobotConfig::default_biped();
    far.servos[1].micros_per_radian = 1_500.0;
    for (bytes, words) in [
        (&good.bytes()[..100], "robot_record refused: damaged: commit word ffffffff"),
        (&good.bytes()[..good.bytes().len() - 4], "robot_record refused: damaged: commit word ffffffff"),
        (record(far).bytes(), "robot_record refused: gate.range[right_hip] needs a pulse of"),
    ] {
        let (_file, download) = sector_at(ROBOT_SECTOR, bytes);
        let ran = board.run(options(1.0, &[ARM], &["--flash", &download]));
        assert!(ran.boots[0].log.iter().any(|line| line.contains(words)), "{words}: {:?}", ran.boots[0].log);
        assert!(ran.pulses.is_empty() && ran.boots[0].ticks.is_empty(), "{words}");
        assert_eq!((ran.end.edges_before_arming, ran.end.edges_after_disarming), (0, 0), "{words}");
    }
}

/// A debugger that attached, asked for a log that waits, and then reads nothing: the tick must not notice.
fn a_stalled_reader_of_the_log_delays_no_tick() {
    let board = Board::find();
    let ran = board.run(options(5.0, &[ARM], &["--rtt-mode", "2", "--no-drain"]));
    assert_regular(&ran);
    assert_eq!(ran.boots.len(), 1);
    let drained = board.run(options(5.0, &[ARM], &[]));
    let times = |ran: &Ran| ran.pulses.iter().map(|(_, us)| *us).collect::<Vec<_>>();
    assert!(ran.pulses.len() > 220);
    assert_eq!(times(&ran), times(&drained), "the same pulses, whether anyone reads the log or not");
}

/// The program, as `cargo xtask run` calls it.
fn program() -> Command {
    let path = |variable: &str| std::env::var_os(variable).expect(variable);
    let mut command = Command::new(path("FOOTFALL_BIN"));
    command.arg("watch").arg("--elf").arg(path("FOOTFALL_ELF"));
    command.arg("--virtual-board").arg(path("FOOTFALL_VIRTUAL_BOARD"));
    command.stdin(Stdio::null());
    command
}

fn the_program_reports_the_run_with_two_equal_hashes() {
    let mut watch = program();
    let folder = tempfile::tempdir().unwrap();
    let record = folder.path().join("out.csv");
    let output = watch.args(["--secs", "5", "--disarm", "--json", "--record"]).arg(&record).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    let last: Value = serde_json::from_str(text.lines().last().unwrap()).unwrap();
    for zero in
        ["late_ticks", "missed_ticks", "unmodelled", "edges_before_arming", "edges_after_disarming", "lost_lines"]
    {
        assert_eq!(last[zero], 0, "{zero}");
    }
    assert!(last["ticks"].as_u64().unwrap() >= 4_970, "{}", last["ticks"]);
    assert_eq!((&last["state"], &last["setpoint_hash"]), (&"disarmed".into(), &last["host_replay_hash"]));
    assert!(last["pulse_us"].as_array().unwrap().iter().all(Value::is_array));
    let rows = std::fs::read_to_string(record).unwrap().lines().count() as u64 - 1;
    assert_eq!(rows, last["replayed_calls"].as_u64().unwrap());
}

fn ctrl_c_ends_the_program_with_a_finished_recording() {
    let mut watch = program();
    let folder = tempfile::tempdir().unwrap();
    let record = folder.path().join("out.csv");
    let mut child =
        watch.args(["--secs", "3600", "--json", "--record"]).arg(&record).stdout(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines().map(Result::unwrap);
    let walking = lines.find(|line| line.contains("\"walking\"")).expect("it walks");
    assert!(walking.contains("setpoint_deg"), "{walking}");
    // The shell has `kill`; a program of that name need not be there.
    let kill = format!("kill -INT {}", child.id());
    assert!(Command::new("sh").args(["-c", &kill]).status().unwrap().success());
    let last: Value = serde_json::from_str(&lines.last().unwrap()).unwrap();
    assert_eq!((&last["type"], &last["reason"]), (&"end".into(), &"killed".into()));
    assert_eq!(last["setpoint_hash"], last["host_replay_hash"]);
    assert_eq!(child.wait().unwrap().code(), Some(0));
    let about: Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("out.csv.json")).unwrap()).unwrap();
    let rows = std::fs::read_to_string(record).unwrap().lines().count() as u64 - 1;
    assert_eq!((&about["finished"], about["rows"].as_u64()), (&true.into(), Some(rows)));
}
