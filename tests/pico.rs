//! The image of the Raspberry Pi Pico on rp2040js: boot, the test of the emergency stop, arming, ten seconds of walking with the setpoints of the
//! host to the bit, pulses, emergency stop, a hang, what the board refuses, and its serial port over USB.
//!
//! What this shows is shown on an emulator that this project did not write, and not on hardware.

use std::process::ExitCode;
use std::sync::OnceLock;

use firmware_rp2040::board::{BOARD, GENERATOR_SECTOR, ROBOT_SECTOR, SENSORS_SECTOR};
use firmware_rp2040::timing::CORE_MHZ;
use firmware_rp2040::watchdog_time::TIMEOUT_US;
use footfall::board::transport::{Heard, Transport};
use footfall_tests::campaign::faults_file;
use footfall_tests::pico::{PicoImage, PicoRan, emulator, run, run_image};
use footfall_tests::workspace::root;
use generator_file::file::GeneratorFile;
use hgod_adc::Validity;
use joint_loop::setup::default_loop::Parameters;
use joint_loop::store::{generator_record, sensor_record};
use joint_loop::tuning::{Action, Outcome, Parameter, Request};
use joint_loop::{Cause, GeneratorConfig, JointSensor, JointSensors, RecordName, RobotConfig, SupervisorState};
use joint_units::Joint;
use serde_json::{Value, json};
use test_suite::{report, tests};
use wire::{MAX_FRAME_BYTES, Record, Reset, Subject, frame_request};

fn main() -> ExitCode {
    test_suite::run(tests![
        the_documented_first_walk_walks_from_the_drive_of_the_boot_rom(PicoImage),
        the_documented_shadow_walk_moves_no_pin(PicoImage),
        the_boot_rom_loses_pages_of_a_file_whose_sectors_are_not_whole(PicoImage),
        a_core_that_a_debugger_resets_is_no_crash(PicoImage),
        it_walks_ten_seconds_as_the_host_computes(PicoImage),
        its_ticks_are_on_time_with_margin(PicoImage),
        its_pulses_are_those_of_the_loop(PicoImage),
        no_servo_line_moves_before_it_is_armed(PicoImage),
        it_says_at_boot_what_the_chip_has_not(PicoImage),
        channels_that_nobody_reads_keep_whole_frames(PicoImage),
        it_does_not_arm_before_the_stop_is_tested(PicoImage),
        the_emergency_stop_cuts_supply_and_pulses(PicoImage),
        a_hang_is_reset_by_the_watchdog(PicoImage),
        a_follower_is_refused(PicoImage),
        three_sensors_are_on_time_and_each_has_its_angle(PicoImage),
        a_fourth_sensor_is_refused(PicoImage),
        the_serial_port_begins_with_the_boot_and_has_the_setpoints_of_the_host(PicoImage),
        a_request_over_usb_changes_the_speed(PicoImage),
        damaged_requests_are_counted_and_change_nothing(PicoImage),
        gaits_change_on_time(PicoImage),
        a_host_that_does_not_read_delays_no_tick(PicoImage),
        the_port_works_again_after_it_was_unplugged(PicoImage),
        the_emulator_warns_of_nothing_else(PicoImage),
        the_emulator_has_the_pins_of_the_board(),
        the_page_and_its_picture_have_the_pins_of_the_board(),
    ])
}

/// When the emergency stop is tested, and when the button is released, which arms, s.
const ARMED_S: f64 = 0.7;
/// When the last line of a walk is read, s: between two pulses.
const END_S: f64 = 13.205;
/// What the ROM and the start of the program take, s: tick n is n milliseconds later.
const STARTED_S: f64 = 0.081;

/// The tick of a moment of a run, s.
fn tick_at(s: f64) -> u32 {
    ((s - STARTED_S) * 1e3) as u32
}

/// Longest tick that is accepted, core cycles of the 200,000 in a period.
const MOST_CYCLES: u32 = 75_000;
/// The same in the ramp between two gaits by name: a fifth of a period is left to what counts as late.
const MOST_CYCLES_IN_A_RAMP: u32 = 120_000;

/// The gestures that arm a board, and a sensor that swings.
fn scenario(secs: f64) -> Value {
    let event = |s: f64, pin: &str, level: bool| json!({"s": s, "pin": pin, "level": level});
    json!({
        "secs": secs,
        "flash": [],
        "volts": [{"mean": 1.5, "swing": 0.3, "hz": 1.0}],
        "events": [
            event(0.15, "emergency_stop", false),
            event(0.25, "emergency_stop", true),
            event(0.3, "button", false),
            event(ARMED_S, "button", true),
        ],
    })
}

/// A scenario that begins at the drive of the boot ROM, with a flash that is full of zeros: what the ROM does not erase stays zero.
fn from_the_drive(mut scenario: Value) -> Value {
    scenario["drive"] = json!({"old": 0});
    scenario
}

/// What a run from the drive shows of the ROM, whatever the program does.
fn the_rom_wrote_it(ran: &PicoRan) {
    assert_eq!(ran.drive.files, ["INDEX   HTM", "INFO_UF2TXT"]);
    assert!(ran.drive.info.contains("\nBoard-ID: RPI-RP2\n"), "{}", ran.drive.info);
    assert!(ran.drive.flash_differs.is_empty(), "{:#x?}", ran.drive.flash_differs);
    // The ROM restarts the chip by the watchdog, which is no crash.
    assert_eq!(ran.resets, [(0.0, "timer".to_owned())]);
    let [boot] = &ran.boots[..] else { panic!("{} boots", ran.boots.len()) };
    let record = boot.boot.as_ref().expect("a boot record");
    assert_eq!((record.reset, record.streak), (Reset::PowerOn, 0));
    assert!(boot.refused.is_empty(), "{:?}", boot.refused);
}

/// The last file that the commands of docs/pico.md write to the drive: with the robot and the generator of the commands, without a sensor.
fn the_documented_first_walk_walks_from_the_drive_of_the_boot_rom() {
    let mut scenario = from_the_drive(scenario(6.0));
    // Nobody holds a goniometer: an open pin.
    scenario["volts"] = json!([]);
    let ran = run_image(&PicoImage::of_the_first_walk("walk"), &scenario, &[]);
    the_rom_wrote_it(&ran);
    let boot = &ran.boots[0];
    assert_eq!(begun(&ran, SupervisorState::Walking).len(), 1, "{:?}", boot.changes);
    let file = GeneratorFile::read(&root().join("samples/generator.toml")).expect("a shape");
    let host = boot.replay(&file.set.config());
    for frame in &boot.ticks {
        assert_eq!(frame, &wire::Frame::from(&host[frame.tick as usize - 1]), "tick {}", frame.tick);
    }
    let last = boot.ticks.last().expect("frames");
    assert_eq!((last.state, last.missed, last.late), (SupervisorState::Walking, 0, 0));
    assert!(ran.servos.iter().all(|line| line[0] > ARMED_S * 1e9 && line.len() > 2 * 200), "pulses of each servo");
    assert_eq!(ran.rail.len(), 1, "{:?}", ran.rail);
}

fn the_documented_shadow_walk_moves_no_pin() {
    let ran = run_image(&PicoImage::of_the_first_walk("shadow"), &from_the_drive(scenario(4.0)), &[]);
    the_rom_wrote_it(&ran);
    assert_eq!(begun(&ran, SupervisorState::Walking).len(), 1, "{:?}", ran.boots[0].changes);
    assert!(ran.servos.iter().all(Vec::is_empty) && ran.rail.is_empty());
}

/// The erratum that the whole sectors of our files are for: it shows that the ROM of the test has it.
fn the_boot_rom_loses_pages_of_a_file_whose_sectors_are_not_whole() {
    let usual = std::fs::read(PicoImage::usual().uf2).expect("the file");
    // The first 21 pages of the program and the first one of the robot's record, as a file of their own.
    let word = |block: &[u8], at: usize| u32::from_le_bytes(block[at..at + 4].try_into().expect("a word"));
    let robot = usual.chunks(512).find(|block| word(block, 12) == ROBOT_SECTOR).expect("the robot's record");
    let mut file = [&usual[..21 * 512], robot].concat();
    for (number, block) in (0_u32..).zip(file.chunks_mut(512)) {
        block[20..24].copy_from_slice(&number.to_le_bytes());
        block[24..28].copy_from_slice(&22_u32.to_le_bytes());
    }
    let folder = tempfile::tempdir().expect("a folder");
    let image = PicoImage { uf2: folder.path().join("short.uf2"), ..PicoImage::usual() };
    std::fs::write(&image.uf2, file).expect("written");
    let ran = run_image(&image, &from_the_drive(scenario(0.0)), &[]);
    assert_eq!(ran.drive.flash_differs, [ROBOT_SECTOR]);
}

/// A debugger resets the core alone: the pulses go on until the program drives the lines low, and REASON still has the restart by the ROM.
fn a_core_that_a_debugger_resets_is_no_crash() {
    // At three phases of the blocks that DMA goes on writing.
    for at_s in [4.0, 4.0005, 4.0035] {
        a_core_reset_at(at_s);
    }
}

fn a_core_reset_at(at_s: f64) {
    /// The ROM, the copy of the program to RAM, at the clock that goes on.
    const LOW_AGAIN_NS: f64 = 10e6;
    let mut scenario = from_the_drive(scenario(4.3));
    scenario["events"].as_array_mut().expect("a list").push(json!({"s": at_s, "core_reset": true}));
    let ran = run(&scenario, &[]);
    assert_eq!(ran.resets.len(), 1, "the watchdog has not reset the chip: {:?}", ran.resets);
    let [_, boot] = &ran.boots[..] else { panic!("{} boots", ran.boots.len()) };
    let record = boot.boot.as_ref().expect("a boot record");
    assert_eq!((record.reset, record.streak), (Reset::Software, 0));
    assert!(record.last_outputs.as_ref().is_some_and(|last| last.on), "{:?}", record.last_outputs);
    for line in ran.servos.iter().chain([&ran.rail]) {
        assert!(
            line.len().is_multiple_of(2) && line.last().is_some_and(|last| *last < at_s * 1e9 + LOW_AGAIN_NS),
            "{line:?}"
        );
    }
}

/// The run that several tests look at.
fn walk() -> &'static PicoRan {
    static WALK: OnceLock<PicoRan> = OnceLock::new();
    WALK.get_or_init(|| run(&scenario(END_S), &[]))
}

/// Ticks at which a state began.
fn begun(ran: &PicoRan, state: SupervisorState) -> Vec<u32> {
    ran.boots[0].changes.iter().filter(|change| change.state == state).map(|change| change.tick).collect()
}

fn it_walks_ten_seconds_as_the_host_computes() {
    let ran = walk();
    let [boot] = &ran.boots[..] else { panic!("{} boots", ran.boots.len()) };
    assert!(ran.resets.is_empty(), "{:?}", ran.resets);
    // Every tick of the run, in order.
    let ticks: Vec<u32> = boot.calls.iter().map(|(tick, _)| *tick).collect();
    assert!(ticks.iter().copied().eq(1..=ticks.len() as u32), "a tick is missing");
    assert!(ticks.len() > 13_100, "{} ticks", ticks.len());
    let walking = begun(ran, SupervisorState::Walking);
    let [from] = walking[..] else { panic!("{:?}", boot.changes) };
    let walked = boot.ticks.iter().filter(|frame| frame.state == SupervisorState::Walking).count() * 10;
    assert!(walked >= 10_000, "{walked} ticks from {from} on");
    let host = boot.replay(&GeneratorConfig::default_walk());
    for frame in &boot.ticks {
        let same = wire::Frame::from(&host[frame.tick as usize - 1]);
        // Bits of the setpoints, and the hash over all ticks before.
        assert_eq!(frame.setpoints_rad.map(f32::to_bits), same.setpoints_rad.map(f32::to_bits), "tick {}", frame.tick);
        assert_eq!(frame, &same);
    }
    report!("{} ticks, {} frames compared, {walked} ticks of walking", ticks.len(), boot.ticks.len());
}

fn its_ticks_are_on_time_with_margin() {
    let ran = walk();
    let boot = &ran.boots[0];
    let last = boot.ticks.last().expect("frames");
    assert_eq!((last.missed, last.late, last.overruns), (0, 0, 0));
    assert_eq!(ran.core_hz, f64::from(CORE_MHZ) * 1e6);
    let longest = boot.costs.iter().map(|cost| cost.longest_cycles).max().expect("costs");
    let latest = boot.costs.iter().map(|cost| cost.latest_start_us).max().expect("costs");
    let cost = boot.costs.last().expect("costs");
    report!(
        "longest tick {longest} cycles, latest start {latest} us, stack {} of {}",
        cost.stack_used,
        cost.stack_size
    );
    assert!((20_000..MOST_CYCLES).contains(&longest), "{longest} cycles");
    assert!(latest < 100, "{latest} us");
    assert!(cost.stack_used < cost.stack_size / 10 * 8, "{cost:?}");
    assert_eq!((cost.dropped, cost.truncated), (0, 0));
}

/// Rising and falling edges as pairs.
fn pulses(edges: &[f64]) -> Vec<(f64, f64)> {
    edges.chunks_exact(2).map(|edge| (edge[0], edge[1] - edge[0])).collect()
}

fn its_pulses_are_those_of_the_loop() {
    const FRAME_NS: f64 = 20e6;
    let ran = walk();
    let host = ran.boots[0].replay(&GeneratorConfig::default_walk());
    let lines = ran.servos.each_ref().map(|edges| pulses(edges));
    let count = lines[0].len();
    assert!(count > 600 && lines.iter().all(|line| line.len() == count), "{:?}", lines.each_ref().map(Vec::len));
    for line in &lines {
        assert!(line.iter().all(|(_, width)| (500e3..=2500e3).contains(width)), "a pulse beyond every servo's limits");
        assert!(line.windows(2).all(|pair| (pair[1].0 - pair[0].0 - FRAME_NS).abs() < 1.0), "frames of 20 ms");
        assert!(
            line.iter().zip(&lines[0]).all(|(one, first)| (one.0 - first.0).abs() < 1.0),
            "all pulses begin at one moment"
        );
    }
    // The tick whose widths the first frame has, and from there every twentieth.
    let fits = |first: usize| {
        (0..count).all(|frame| {
            let Some(tick) = host.get(first + 20 * frame) else { return false };
            (0..4).all(|joint| (lines[joint][frame].1 / 1e3 - f64::from(tick.pulses[joint].0)).abs() < 0.01)
        })
    };
    let armed = begun(ran, SupervisorState::Arming)[0] as usize - 1;
    let first: Vec<usize> = (armed..armed + 60).filter(|first| fits(*first)).collect();
    assert_eq!(first.len(), 1, "the ticks after {armed} whose widths all frames have: {first:?}");
    report!(
        "{count} frames of four pulses; the first has the widths of the tick {} ticks after arming",
        first[0] - armed
    );
}

fn no_servo_line_moves_before_it_is_armed() {
    let ran = walk();
    let released = ARMED_S * 1e9;
    assert!(ran.servos.iter().all(|line| line[0] > released), "a servo line moved before the button was released");
    assert!(ran.rail[0] > released && ran.rail.len() == 1, "the supply is switched once: {:?}", ran.rail);
    assert!(ran.servos.iter().all(|line| line[0] > ran.rail[0]), "no pulse before the supply is on");
}

fn it_says_at_boot_what_the_chip_has_not() {
    let log = walk().boots[0].log.join("\n");
    for words in ["no break input", "no measured supply", "no oscillator of the watchdog", "no view of a debugger"] {
        assert!(log.contains(words), "`{words}` in\n{log}");
    }
}

/// What does not fit into the RTT channels is dropped whole: the boot and what came after it, until each was full. (A damaged frame fails the run.)
fn channels_that_nobody_reads_keep_whole_frames() {
    let mut unread = scenario(4.0);
    unread["unread"] = true.into();
    let ran = run(&unread, &[]);
    let [boot] = &ran.boots[..] else { panic!("{} boots", ran.boots.len()) };
    let (first, last) = (boot.calls[0].0, boot.calls.last().expect("calls").0);
    assert!(first == 1 && (200..2_000).contains(&last), "{first} to {last}");
    assert!(boot.calls.iter().map(|(tick, _)| *tick).eq(first..=last), "a tick is missing");
    assert!(boot.log[0].contains("reset power_on") && boot.log_times.is_sorted(), "{:?}", boot.log);
    assert!(*boot.log_times.last().expect("lines") < 3.5, "{:?}", boot.log);
    report!("{last} ticks and {} lines fit", boot.log.len());
}

fn it_does_not_arm_before_the_stop_is_tested() {
    let mut untested = scenario(1.5);
    untested["events"].as_array_mut().expect("a list").drain(..2);
    let ran = run(&untested, &[]);
    assert!(begun(&ran, SupervisorState::Arming).is_empty());
    assert!(ran.servos.iter().all(Vec::is_empty) && ran.rail.is_empty());
}

fn the_emergency_stop_cuts_supply_and_pulses() {
    /// From the opened contact to the last of the five pins, ns.
    const REACTION_NS: f64 = 10e3;
    // In a pulse: the frames begin at one phase after each power-on, so that the pulses until then are those of the walk.
    let rise = walk().servos[0].iter().step_by(2).find(|rise| **rise > 3e9).expect("a pulse");
    let stop = rise + 400e3;
    let mut opened = scenario(4.2);
    let events = opened["events"].as_array_mut().expect("a list");
    events.push(json!({"s": stop / 1e9, "pin": "emergency_stop", "level": false}));
    let ran = run(&opened, &[]);
    let last = *ran.rail.last().expect("edges");
    assert_eq!(ran.rail.len(), 2, "{:?}", ran.rail);
    assert!(last >= stop && last < stop + REACTION_NS, "the supply goes off at {last}");
    for (servo, line) in ran.servos.iter().enumerate() {
        assert!(
            line.len().is_multiple_of(2) && line.last().is_some_and(|last| *last < stop + REACTION_NS),
            "servo {servo}"
        );
    }
    let ends: Vec<f64> = ran.servos.iter().map(|line| *line.last().expect("edges")).collect();
    let cut = ends.iter().filter(|end| **end >= stop).count();
    assert!(cut > 0, "the contact opens in a pulse: {ends:?}");
    let change = ran.boots[0].changes.iter().find(|change| change.state == SupervisorState::Fault).expect("a fault");
    assert_eq!(change.cause, Cause::BreakInput);
    assert_eq!(ran.boots[0].costs.last().expect("costs").truncated as usize, cut);
    report!(
        "supply off after {} ns, last line low after {:.0} ns, {cut} pulses cut",
        last - stop,
        ends.iter().copied().fold(0.0, f64::max) - stop
    );
}

fn a_hang_is_reset_by_the_watchdog() {
    const HANG_S: f64 = 2.0;
    let mut hang = scenario(2.4);
    hang["hang_s"] = json!(HANG_S);
    let ran = run(&hang, &[]);
    let [(at, reason)] = &ran.resets[..] else { panic!("{:?}", ran.resets) };
    assert_eq!(reason, "timer");
    let after_us = (at - HANG_S) * 1e6;
    assert!(after_us > 0.0 && after_us <= f64::from(TIMEOUT_US) + 10.0, "{after_us} us");
    let [_, boot] = &ran.boots[..] else { panic!("{} boots", ran.boots.len()) };
    let record = boot.boot.as_ref().expect("a boot record");
    assert_eq!((record.reset, record.streak), (Reset::IndependentWatchdog, 1));
    assert!(record.last_outputs.as_ref().is_some_and(|last| last.on), "{:?}", record.last_outputs);
    for line in ran.servos.iter().chain([&ran.rail]) {
        // The reset lets go of the pins, and the chip's pull-downs take them low.
        assert!(line.len().is_multiple_of(2) && line.last().is_some_and(|last| *last <= at * 1e9 + 1.0), "{line:?}");
    }
    report!("reset {after_us:.0} us after the hang");
}

/// The reason with which the board stays off.
fn refusal(ran: &PicoRan) -> (Subject, String) {
    assert!(ran.servos.iter().all(Vec::is_empty) && ran.rail.is_empty() && ran.boots[0].calls.is_empty());
    let [refused] = &ran.boots[0].refused[..] else { panic!("{:?}", ran.boots[0].refused) };
    (refused.subject, refused.reason.as_str().to_owned())
}

fn a_follower_is_refused() {
    let file = GeneratorFile::read(&faults_file().with_file_name("follower.toml")).expect("the follower");
    let record = generator_record::record_of(&file.set.config(), &RecordName::BUILT_IN);
    let (subject, reason) = refusal(&run(&scenario(0.3), &[(GENERATOR_SECTOR, record.bytes())]));
    assert_eq!(subject, Subject::GeneratorRecord);
    assert!(reason.contains("follower") && reason.contains("phase-coupled, shape, spline"), "{reason}");
}

fn three_sensors_are_on_time_and_each_has_its_angle() {
    let joints = [Joint::LeftHip, Joint::RightHip, Joint::RightKnee];
    let sensors = joints.map(|joint| JointSensor::uncalibrated(joint).expect("the default"));
    let sensors = JointSensors::build(sensors).expect("three");
    let record = sensor_record::record_of(&sensors, &RecordName::BUILT_IN);
    let mut scenario = scenario(6.0);
    scenario["volts"] = json!([
        {"mean": 1.5, "swing": 0.3, "hz": 1.0}, {"mean": 1.2, "swing": 0.2, "hz": 0.7}, {"mean": 1.8, "swing": 0.25, "hz": 1.3},
    ]);
    let ran = run(&scenario, &[(SENSORS_SECTOR, record.bytes())]);
    let boot = &ran.boots[0];
    let parameters = Parameters::with_defaults(None, Some(sensors), RobotConfig::default_biped()).expect("allowed");
    let host = boot.watch_as(&parameters, |joints| joints.frame());
    for frame in &boot.ticks {
        assert_eq!(frame, &wire::Frame::from(&host[frame.tick as usize - 1]), "tick {}", frame.tick);
    }
    let last = boot.ticks.last().expect("frames");
    assert_eq!((last.state, last.missed, last.late), (SupervisorState::Walking, 0, 0));
    // Volts of each sensor alone: the angles that its own wave leads to, and a fourth that is not there.
    let spread = |channel: usize| {
        let angles = boot.ticks.iter().skip(100).filter_map(|frame| Some(frame.sensors[channel]?.angle_deg()));
        angles.fold((f32::MAX, f32::MIN), |(least, most), angle| (least.min(angle), most.max(angle)))
    };
    let spreads = [0, 1, 2].map(spread);
    let longest = boot.costs.iter().map(|cost| cost.longest_cycles).max().expect("costs");
    report!("three sensors: longest tick {longest} cycles; angles {spreads:.1?}");
    assert!(last.sensors[..3].iter().all(|reading| reading.is_some_and(|one| one.validity == Validity::Good)));
    assert!(last.sensors[3].is_none());
    let means = spreads.map(|(least, most)| (least + most) / 2.0);
    assert!((means[0] - means[1]).abs() > 5.0 && (means[0] - means[2]).abs() > 5.0, "{means:?}");
    assert!((20_000..MOST_CYCLES).contains(&longest), "{longest} cycles");
}

fn a_fourth_sensor_is_refused() {
    let sensors = Joint::ALL.map(|joint| JointSensor::uncalibrated(joint).expect("the default"));
    let record = sensor_record::record_of(&JointSensors::build(sensors).expect("four"), &RecordName::BUILT_IN);
    let (subject, reason) = refusal(&run(&scenario(0.3), &[(SENSORS_SECTOR, record.bytes())]));
    assert_eq!((subject, reason.as_str()), (Subject::SensorRecord, "4 sensors; this board has inputs for 3"));
}

/// When the host opens the port, s.
const OPENED_S: f64 = 0.5;
/// When it sends what is no request, and when a request, s.
const DAMAGED_S: f64 = 2.8;
const ASKED_S: f64 = 3.0;
/// When it stops reading, and when it reads again, s.
const UNREAD_S: f64 = 4.2;
const READ_S: f64 = 5.2;
/// When the board is unplugged, and when a program opens the port again, s.
const UNPLUGGED_S: f64 = 5.6;
const OPENED_AGAIN_S: f64 = 5.9;
/// Frames that are no request, each of another kind: damaged, too short, too long, without a request.
const DAMAGED: u32 = 4;

/// The request of the run with a host.
const FASTER: Request = Request { number: 7, action: Action::Set { parameter: Parameter::Speed, thousandths: 1_250 } };

/// The bytes of a request on the port.
fn framed(request: &Request) -> Vec<u8> {
    frame_request(request, &mut [0; MAX_FRAME_BYTES]).expect("it fits").to_vec()
}

/// A walk with a host at the serial port that does all of this.
fn with_host() -> &'static PicoRan {
    static RAN: OnceLock<PicoRan> = OnceLock::new();
    RAN.get_or_init(|| {
        let request = framed(&FASTER);
        let mut damaged = request.clone();
        damaged[2] ^= 0x10;
        let bytes = [&damaged[..], &[2, 1, 0], &[0x55; 900], &[0], &request[..request.len() - 3], &[0]].concat();
        let mut scenario = scenario(6.6);
        let events = scenario["events"].as_array_mut().expect("a list");
        for (s, usb, bytes) in [
            (OPENED_S, "open", Vec::new()),
            (DAMAGED_S, "send", bytes),
            (ASKED_S, "send", request.clone()),
            (UNREAD_S, "hold", Vec::new()),
            (READ_S, "read", Vec::new()),
            (UNPLUGGED_S, "replug", Vec::new()),
            (OPENED_AGAIN_S, "open", Vec::new()),
        ] {
            events.push(json!({"s": s, "usb": usb, "bytes": bytes}));
        }
        run(&scenario, &[])
    })
}

/// What the host received: the records, and how many frames were damaged.
fn received(ran: &PicoRan) -> (Vec<Record>, usize) {
    let (mut records, mut damaged) = (Vec::new(), 0);
    let pushed = Transport::default().push(&ran.serial, |heard| match heard {
        Heard::Record(record) => records.push(record),
        _ => damaged += 1,
    });
    pushed.expect("records of this version");
    (records, damaged)
}

/// The frames among records.
fn frames(records: &[Record]) -> Vec<wire::Frame> {
    records.iter().filter_map(|record| if let Record::Frame(frame) = record { Some(*frame) } else { None }).collect()
}

/// The last counters of the port among records.
fn counts(records: &[Record]) -> wire::Port {
    let port = |record: &Record| if let Record::Port(port) = record { Some(*port) } else { None };
    records.iter().rev().find_map(port).expect("counters")
}

fn the_serial_port_begins_with_the_boot_and_has_the_setpoints_of_the_host() {
    let ran = with_host();
    let (records, damaged) = received(ran);
    let boot = &ran.boots[0];
    let Record::Boot(first) = &records[0] else { panic!("{:?}", records[0]) };
    assert_eq!(Some(first), boot.boot.as_ref());
    let frames = frames(&records);
    let host = boot.replay(&GeneratorConfig::default_walk());
    // At the end of the run the port is a few ticks ahead of the log.
    for frame in frames.iter().filter(|frame| frame.tick as usize <= host.len()) {
        assert_eq!(frame, &wire::Frame::from(&host[frame.tick as usize - 1]), "tick {}", frame.tick);
    }
    // From the opening to the moment from which nothing was read, every frame came, and the first at once.
    let (opened, unread) = (tick_at(OPENED_S), tick_at(UNREAD_S));
    let seen: Vec<u32> = frames.iter().map(|frame| frame.tick).filter(|tick| *tick < unread - 20).collect();
    assert!(seen[0].abs_diff(opened) < 30, "{}", seen[0]);
    assert!(seen.windows(2).all(|pair| pair[1] == pair[0] + 10), "a frame is missing: {seen:?}");
    report!("{} records, {} frames equal, {damaged} damaged", records.len(), frames.len());
    assert!(seen.len() > 340 && damaged <= 1, "{} {damaged}", seen.len());
}

fn a_request_over_usb_changes_the_speed() {
    let ran = with_host();
    let (records, _) = received(ran);
    let answers: Vec<(Outcome, u32)> = records
        .iter()
        .filter_map(|record| if let Record::Answered(answer) = record { Some(answer) } else { None })
        .map(|answer| (answer.outcome, answer.tick))
        .collect();
    let [(Outcome::Staged, staged), (Outcome::InEffect, effect)] = answers[..] else { panic!("{answers:?}") };
    let asked = tick_at(ASKED_S);
    assert!(staged.abs_diff(asked) < 40 && effect > staged, "{answers:?}");
    // What the host computes with the recorded request is what the board did: compared in the test before. Without it, it is not.
    let boot = &ran.boots[0];
    let requests: Vec<&Request> = boot.calls.iter().filter_map(|(_, call)| call.request.as_ref()).collect();
    assert_eq!(requests, [&FASTER]);
    let mut unasked = boot.clone();
    unasked.calls.iter_mut().for_each(|(_, call)| call.request = None);
    let [with, without] = [boot, &unasked].map(|boot| boot.replay(&GeneratorConfig::default_walk()));
    let at = effect as usize + 200;
    assert_ne!(with[at].setpoints, without[at].setpoints);
    let longest = boot.costs.iter().map(|cost| cost.longest_cycles).max().expect("costs");
    assert!(longest < MOST_CYCLES, "{longest} cycles");
    report!("staged at tick {staged}, in effect at {effect}; longest tick {longest} cycles");
}

/// A run in which gaits by name change at a speed, with this generator as the board's own.
struct Changes {
    own: GeneratorConfig,
    speed: f64,
}

impl Changes {
    /// Gaits by their numbers, one after the other: `walk`, a network, then three shapes, and the board's own generator.
    const GAITS: [i32; 5] = [1, 2, 4, 3, 0];
    /// Between two requests, s: a change waits for a phase boundary, and its ramp takes 1 s.
    const APART_S: f64 = 2.4;
    /// A walk begins 3 s after the power-on.
    const FIRST_S: f64 = 3.1;

    /// Runs it, checks that each change came and that each setpoint is the host's, and gives the state at the end and the longest tick, cycles.
    fn run(&self) -> (SupervisorState, u32) {
        let set = |parameter, thousandths| Action::Set { parameter, thousandths };
        let gaits = Self::GAITS.map(|gait| set(Parameter::Gait, gait * 1000));
        let speed = set(Parameter::Speed, (self.speed * 1e3) as i32);
        let mut scenario = scenario(Self::FIRST_S + Self::APART_S * Self::GAITS.len() as f64);
        let events = scenario["events"].as_array_mut().expect("a list");
        events.push(json!({"s": OPENED_S, "usb": "open", "bytes": []}));
        for (action, number) in [speed].into_iter().chain(gaits).zip(1_u16..) {
            let s = if number == 1 { 2.0 } else { Self::FIRST_S + Self::APART_S * f64::from(number - 2) };
            events.push(json!({"s": s, "usb": "send", "bytes": framed(&Request { number, action })}));
        }
        let record = generator_record::record_of(&self.own, &RecordName::BUILT_IN);
        let ran = run(&scenario, &[(GENERATOR_SECTOR, record.bytes())]);
        let boot = &ran.boots[0];
        let outcome = |record: &Record| if let Record::Answered(answer) = record { Some(answer.outcome) } else { None };
        let answers: Vec<Outcome> = received(&ran).0.iter().filter_map(outcome).collect();
        assert_eq!(answers, [Outcome::Staged, Outcome::InEffect].repeat(1 + Self::GAITS.len()));
        let host = boot.replay(&self.own);
        for frame in &boot.ticks {
            assert_eq!(frame, &wire::Frame::from(&host[frame.tick as usize - 1]), "tick {}", frame.tick);
        }
        let last = boot.ticks.last().expect("frames");
        assert_eq!((last.missed, last.late), (0, 0));
        (last.state, boot.costs.iter().map(|cost| cost.longest_cycles).max().expect("costs"))
    }
}

/// In the ramp between two gaits by name a tick steps both and the board's own generator, above speed 1 some twice.
fn gaits_change_on_time() {
    let shape = GeneratorFile::read(&root().join("samples/generator.toml")).expect("a shape").set.config();
    let walk = GeneratorConfig::default_walk;
    // The greatest speed has the most work.
    for (name, own, speed) in [("default walk", walk(), 1.0), ("default walk", walk(), 1.5), ("shape", shape, 1.5)] {
        let (state, longest) = Changes { own, speed }.run();
        report!("{name} at speed {speed}: longest tick {longest} cycles");
        assert_eq!(state, SupervisorState::Walking, "{name} at speed {speed}");
        assert!(longest < MOST_CYCLES_IN_A_RAMP, "{name} at speed {speed}: {longest} cycles");
    }
}

fn damaged_requests_are_counted_and_change_nothing() {
    let ran = with_host();
    let counts = counts(&received(ran).0);
    assert_eq!((counts.malformed, counts.requests, counts.too_many, counts.other_version), (DAMAGED, 1, 0, 0));
}

fn a_host_that_does_not_read_delays_no_tick() {
    let ran = with_host();
    let boot = &ran.boots[0];
    let last = boot.ticks.last().expect("frames");
    assert_eq!((last.missed, last.late, last.overruns), (0, 0, 0));
    assert!(boot.calls.iter().map(|(tick, _)| *tick).eq(1..=boot.calls.len() as u32), "a tick is missing");
    let latest = boot.costs.iter().map(|cost| cost.latest_start_us).max().expect("costs");
    let longest = boot.costs.iter().map(|cost| cost.longest_cycles).max().expect("costs");
    let cost = boot.costs.last().expect("costs");
    assert!(latest < 100 && longest < MOST_CYCLES, "{latest} us, {longest} cycles");
    assert_eq!((cost.dropped, cost.truncated), (0, 0));
    // The records of the second without a reader are dropped whole, and counted.
    let (records, _) = received(ran);
    let not_sent = counts(&records).not_sent;
    let gap = frames(&records).windows(2).map(|pair| pair[1].tick - pair[0].tick).max().expect("frames");
    report!(
        "{not_sent} records not sent, a gap of {gap} ticks; longest tick {longest} cycles, latest start {latest} us"
    );
    assert!(not_sent > 100 && (500..1_200).contains(&gap), "{not_sent} {gap}");
}

fn the_port_works_again_after_it_was_unplugged() {
    let ran = with_host();
    assert_eq!(ran.usb_connections, 2);
    let (records, _) = received(ran);
    let boots: Vec<usize> = (0..records.len()).filter(|place| matches!(records[*place], Record::Boot(_))).collect();
    let [0, again] = boots[..] else { panic!("{boots:?}") };
    assert_eq!(records[0], records[again]);
    let after = frames(&records[again..]);
    assert!(after[0].tick.abs_diff(tick_at(OPENED_AGAIN_S)) < 30 && after.len() > 50, "{}", after[0].tick);
    assert!(after.windows(2).all(|pair| pair[1].tick == pair[0].tick + 10));
}

/// Registers that rp2040js does not have: the ring oscillator, which reads as ones, and the masks of the clocks, which the boot ROM opens.
const NOT_MODELLED: [&str; 3] = [
    "ROSC_BASE: Unimplemented peripheral",
    "CLOCKS_BASE: Unimplemented peripheral write to 0xa0: 0xffffffff",
    "CLOCKS_BASE: Unimplemented peripheral write to 0xa4: 0xffffffff",
];

/// The USB driver begins with a zero in each register, of which some can only be read, and some are of the cable's levels.
fn is_known(message: &str) -> bool {
    NOT_MODELLED.iter().any(|known| message.starts_with(known))
        || (message.starts_with("USB: Unimplemented peripheral write") && message.ends_with(": 0x0"))
}

fn the_emulator_warns_of_nothing_else() {
    let messages = walk().messages.iter().chain(&with_host().messages);
    let unexpected: Vec<&String> = messages.filter(|message| !is_known(message)).collect();
    assert!(unexpected.is_empty(), "{unexpected:#?}");
}

fn the_emulator_has_the_pins_of_the_board() {
    let script = std::fs::read_to_string(emulator().join("board.mjs")).expect("the script");
    let [a, b, c, d] = BOARD.servos.map(|pin| pin.0);
    let pins = format!(
        "servos: [{a}, {b}, {c}, {d}], servo_rail: {}, emergency_stop: {}, foot_switch: {}, button: {}, sync_output: {}, led: {}",
        BOARD.servo_rail.0,
        BOARD.emergency_stop.0,
        BOARD.foot_switch.0,
        BOARD.button.0,
        BOARD.sync_output.0,
        BOARD.led.0
    );
    assert!(script.contains(&pins), "{pins}");
}

/// Of each GPIO from 0 on its pin on the board (Raspberry Pi Pico datasheet, figure 4).
const PINS: [u8; 16] = [1, 2, 4, 5, 6, 7, 9, 10, 11, 12, 14, 15, 16, 17, 19, 20];

fn the_page_and_its_picture_have_the_pins_of_the_board() {
    let read = |name: &str| std::fs::read_to_string(root().join(name)).expect(name);
    let (page, picture) = (read("docs/pico.md"), read("docs/wiring-pico.svg"));
    let bold = |words: &str| picture.contains(&format!("font-weight=\"bold\" font-size=\"11\">{words}</text>"));
    for gpio in BOARD.servos.iter().chain([&BOARD.emergency_stop, &BOARD.button]).map(|pin| pin.0) {
        let pin = PINS[usize::from(gpio)];
        assert!(page.contains(&format!("| {pin} | GP{gpio} | {gpio} |")), "GPIO {gpio} at pin {pin}");
        assert!(bold(&format!("{pin}  GP{gpio}")), "GPIO {gpio} at pin {pin}");
    }
    assert!(bold("3V3(OUT)  36") && bold("3  GND"));
}
