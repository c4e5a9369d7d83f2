//! Conditions of the board on the flashed image on the virtual board: a processor that is too slow, a supply that is too low, and registers that
//! are not as written. Each keeps the outputs off or switches them off, and the host repeats the run to the bit.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use firmware::board::{GENERATOR_SECTOR, ROBOT_SECTOR};
use footfall_tests::board::{Board, Ran};
use footfall_tests::gestures::{ARM, STOP_TEST, walk_options};
use footfall_tests::limits::assert_in_time;
use footfall_tests::people::Person;
use footfall_tests::recordings::{default_trace, default_volts};
use hgod_adc::Validity;
use joint_loop::setup::default_loop::BoardLoop;
use joint_loop::store::generator_record::record_of;
use joint_loop::store::robot_record;
use joint_loop::{Cause, Frame, GeneratorConfig, RecordName, RobotConfig, SENSORS, SupervisorState};
use joint_units::Joint;
use test_suite::{report, tests};
use wire::{BrownOut, Conditions, Reset, Subject, Warnings};

fn main() -> ExitCode {
    test_suite::run(tests![
        a_processor_that_is_too_slow_does_not_arm(Image),
        a_low_supply_switches_the_outputs_off(Image),
        a_follower_does_not_walk_on_without_supply(Image),
        a_ripple_of_the_supply_stops_the_walk(Image),
        short_dips_are_counted_and_stop_a_walk_when_they_go_on(Image),
        without_a_sensor_the_supply_is_watched_too(NoSensorImage),
        ticks_that_end_late_stop_the_walk(Image),
        four_ticks_of_ten_lost_are_no_liveness(Image),
        the_tenth_lost_tick_of_a_second_is_a_fault(Image),
        a_contact_that_is_open_half_the_time_is_in_the_log(Image),
        a_changed_register_is_a_fault(Image),
        a_faster_trigger_is_a_fault_or_a_reset(Image),
        another_level_of_the_brown_out_reset_is_a_warning(Image, BlackPillImage),
        a_robot_that_demands_a_brown_out_reset_does_not_arm_without_one(Image),
        another_crystal_keeps_the_board_off(Image),
        a_state_of_some_milliseconds_is_in_the_log(Image),
    ])
}

/// The end of the counter of the timer that triggers the converter.
const TIM2_ARR: u32 = 0x4000_002C;

/// A supply over the time.
type Supply = dyn Fn(f64) -> f64;

/// The default volts with this supply, one row a millisecond, as a file in this folder.
fn volts(folder: &Path, secs: f64, supply: &Supply) -> OsString {
    let knee = default_volts();
    let mut text = String::from("time_s,PA1,VDDA\n");
    for n in 0..(secs * 1e3) as u32 {
        let time = f64::from(n) * 1e-3;
        text +=
            &format!("{time:.3},{:.6},{:.4}\n", knee.at(&knee.channels()[0], time % knee.duration_s()), supply(time));
    }
    let file = folder.join("volts.csv");
    std::fs::write(&file, text).expect("written");
    file.into()
}

/// A run with this supply, armed at 0.3 s, with a generator in its sector, and what the host's loop did.
fn run(generator: &GeneratorConfig, secs: f64, supply: &Supply) -> (Ran, Vec<Frame<SENSORS>>) {
    run_on(&Board::find(), generator, secs, supply)
}

/// The same on another image.
fn run_on(board: &Board, generator: &GeneratorConfig, secs: f64, supply: &Supply) -> (Ran, Vec<Frame<SENSORS>>) {
    let folder = tempfile::tempdir().expect("a folder");
    let sector = folder.path().join("generator.bin");
    std::fs::write(&sector, record_of(generator, &RecordName::BUILT_IN).bytes()).expect("written");
    let mut options: Vec<OsString> = ["--press", ARM, "--secs"].map(Into::into).to_vec();
    options.extend([secs.to_string().into(), "--volts".into(), volts(folder.path(), secs, supply)]);
    options.extend(["--flash".into(), format!("{:#010x}={}", GENERATOR_SECTOR, sector.display()).into()]);
    let ran = board.run_with(generator, options);
    assert_eq!((ran.end.unmodelled, ran.end.lints.len(), ran.boots.len()), (0, 0, 1), "{:?}", ran.end.lints);
    assert_eq!((ran.books.different, ran.books.lost_lines), (0, 0), "{:?}", ran.books.differences);
    let frames = ran.boots[0].watch(generator, BoardLoop::frame);
    (ran, frames)
}

/// The tick after the last one that moved, and its state and cause.
fn ended(frames: &[Frame<SENSORS>]) -> (u32, SupervisorState, Cause) {
    let last = frames.iter().rposition(|frame| frame.state == SupervisorState::Walking).expect("it walked");
    let after = frames.get(last + 1).expect("the walk ends");
    (after.tick, after.state, after.cause)
}

/// At 8 to 20 cycles an instruction most ticks are late: no pulse, and the reason is in the log.
fn a_processor_that_is_too_slow_does_not_arm() {
    let board = Board::find();
    for cpi in ["8", "12", "20"] {
        let folder = tempfile::tempdir().expect("a folder");
        let feed = volts(folder.path(), 3.0, &|_| 3.0);
        let mut options: Vec<OsString> = ["--cpi", cpi, "--press", "0.5:0.5", "--secs", "3"].map(Into::into).to_vec();
        options.extend(["--volts".into(), feed]);
        let ran = board.run(options);
        let last = ran.boots[0].ticks.last().expect("frames");
        report!(
            "{cpi} cycles an instruction: {} of {} ticks late, {} missed, {:?}",
            last.late,
            last.seq,
            last.missed,
            last.cause
        );
        assert!(ran.pulses.is_empty(), "{} frames with pulses", ran.pulses.len());
        // A board that is slower still is reset by its watchdog task before the press.
        assert!(ran.boots.len() > 1 || last.cause == Cause::Late, "{:?}", last.cause);
    }
}

/// From 3.0 to 2.6, 2.0 and 0.3 V: within 50 ms there is no pulse.
fn a_low_supply_switches_the_outputs_off() {
    for low in [2.6, 2.0, 0.3] {
        let (ran, frames) = run(&GeneratorConfig::default_walk(), 4.0, &move |time| if time < 3.0 { 3.0 } else { low });
        let (tick, state, cause) = ended(&frames);
        assert_eq!((state, cause), (SupervisorState::Fault, Cause::Supply), "{low} V");
        let last = ran.pulses.last().expect("pulses").0;
        report!("{low} V: a fault in tick {tick}, last pulse at {last} s");
        // The last pulse begins up to a servo frame before the outputs go off.
        assert_in_time("H27", (last - 3.0) * 1e3, &format!("{low} V"));
    }
}

/// A follower tolerates any fault of its sensor, but not this one.
fn a_follower_does_not_walk_on_without_supply() {
    let walk = default_trace().looped(1000.0).expect("a walk");
    let person = Person::of("default", walk.recording.clone(), Joint::LeftKnee);
    let follower = person.follower(Joint::LeftKnee, person.learned.stride_s);
    for low in [2.0, 0.3] {
        let (ran, frames) = run(&follower, 5.0, &move |time| if time < 4.0 { 3.0 } else { low });
        let (_, state, cause) = ended(&frames);
        assert_eq!((state, cause), (SupervisorState::Fault, Cause::Supply), "{low} V");
        assert!(ran.pulses.last().expect("pulses").0 <= 4.050, "{low} V");
    }
}

/// 50 Hz from 2.6 to 3.4 V: dips that are too short for a fault stop the walk after a second.
fn a_ripple_of_the_supply_stops_the_walk() {
    let hum = |time: f64| 3.0 + 0.4 * (time * 50.0 * std::f64::consts::TAU).sin();
    let (_, frames) = run(&GeneratorConfig::default_walk(), 5.0, &move |time| if time < 3.0 { 3.0 } else { hum(time) });
    let (tick, state, cause) = ended(&frames);
    report!("ripple from 3 s on: {} {} in tick {tick}", state.name(), cause.name());
    assert_eq!((state, cause), (SupervisorState::Stopping, Cause::Supply));
    assert!((3_980..4_060).contains(&tick), "{tick}");
    assert_eq!(frames.last().expect("frames").state, SupervisorState::Disarmed);
}

/// The last counts of the log, and whether the host's loop has the same at that tick.
fn counted(ran: &Ran) -> Conditions {
    let boot = &ran.boots[0];
    let host = boot.watch(&GeneratorConfig::default_walk(), |joints| Conditions::of(&joints.conditions(), 1));
    let last = boot.conditions.last().expect("a record a second");
    assert!(boot.conditions.iter().all(|one| host.contains(one)), "{last:?}");
    *last
}

/// Dips of 30 ms. One in 1.1 s is tolerated, and each is in the record and in the log; two a second stop the walk.
fn short_dips_are_counted_and_stop_a_walk_when_they_go_on() {
    let dips =
        |every_ms: u32| move |time: f64| if time > 2.9 && (time * 1e3) as u32 % every_ms < 30 { 2.6 } else { 3.0 };
    let (ran, frames) = run(&GeneratorConfig::default_walk(), 16.2, &dips(1_100));
    assert_eq!(frames.last().expect("frames").state, SupervisorState::Walking);
    // At 3.3 s, 4.4 s, ..., 15.4 s.
    assert_eq!(counted(&ran).supply_dips, 12);
    let lines = ran.boots[0].log.iter().filter(|line| line.contains("the supply fell below its minimum 1 times"));
    assert_eq!(lines.count(), 12, "{:?}", ran.boots[0].log);
    let (ran, frames) = run(&GeneratorConfig::default_walk(), 10.0, &dips(500));
    let (tick, state, cause) = ended(&frames);
    report!("dips of 30 ms every 500 ms from 3 s on: {} {} in tick {tick}", state.name(), cause.name());
    assert_eq!((state, cause), (SupervisorState::Stopping, Cause::Supply));
    // The eleventh of them.
    assert!((7_980..8_010).contains(&tick), "{tick}");
    assert!(counted(&ran).supply_dips >= 11);
}

/// The image with the feature `no-sensor` walks without one, and not without supply.
fn without_a_sensor_the_supply_is_watched_too() {
    let board = Board::no_sensor();
    let walk = GeneratorConfig::default_walk();
    for low in [2.6, 2.0, 0.3] {
        let (ran, frames) = run_on(&board, &walk, 4.0, &move |time| if time < 3.0 { 3.0 } else { low });
        assert!(ran.boots[0].boot.as_ref().is_some_and(|boot| !boot.sensor_required));
        let (_, state, cause) = ended(&frames);
        assert_eq!((state, cause), (SupervisorState::Fault, Cause::Supply), "{low} V");
        let last = ran.pulses.last().expect("pulses").0;
        assert!(last <= 3.050, "{low} V: a pulse at {last} s");
    }
    let hum = |time: f64| 3.0 + 0.4 * (time * 50.0 * std::f64::consts::TAU).sin();
    let (_, frames) = run_on(&board, &walk, 5.0, &move |time| if time < 3.0 { 3.0 } else { hum(time) });
    let (tick, state, cause) = ended(&frames);
    assert_eq!((state, cause), (SupervisorState::Stopping, Cause::Supply));
    assert!((3_980..4_060).contains(&tick), "{tick}");
}

/// A walk with a script.
fn scripted(secs: f64, script: &str) -> Ran {
    let file = tempfile::NamedTempFile::new().expect("a file");
    std::fs::write(file.path(), script).expect("written");
    Board::find().run(walk_options(secs, &["--script", file.path().to_str().expect("text")]))
}

/// Every tenth tick begins in time; 10 us after it has begun the processor is slow, for less than the rest of the period, and the tick ends late.
fn ticks_that_end_late_stop_the_walk() {
    let ran = scripted(
        4.5,
        "[[event]]\ncall = \"control_step\"\ncount = 3000\nafter_ms = 0.01\nevery_ms = 10\ntimes = 100\ninject = { slow = 60.0 }\nfor_ms = 0.7\n",
    );
    let boot = &ran.boots[0];
    let frames = boot.watch(&GeneratorConfig::default_walk(), BoardLoop::frame);
    let (tick, state, cause) = ended(&frames);
    assert_eq!((state, cause), (SupervisorState::Stopping, Cause::Late));
    let began = boot.calls.iter().find(|(_, call)| call.flags.late()).expect("a late tick").0;
    report!("the end of every tenth tick is late from tick {began} on: {} in tick {tick}", cause.name());
    // The sixth of a hundred.
    assert_eq!(tick, began + 50);
    let worst = boot.costs.iter().map(|cost| cost.latest_start_us).max();
    assert!(worst < Some(100), "no tick began late: {worst:?} us");
    assert_eq!(frames.last().expect("frames").missed, 0);
}

/// Of every 5 ms the trigger of the ticks stands for 2. The loop stops the motion, and the watchdog is not fed: the board resets, and says which task it was.
fn four_ticks_of_ten_lost_are_no_liveness() {
    for (from_s, state) in [(0.3, SupervisorState::Disarmed), (3.0, SupervisorState::Walking)] {
        let ran = scripted(
            from_s + 0.6,
            // TIM2_CR1, which has CEN alone.
            &[(from_s, 0), (from_s + 0.002, 1)]
                .map(|(at_s, value)| {
                    format!(
                        "[[event]]\nat_s = {at_s}\nevery_ms = 5\ntimes = 23\n\
                         inject = {{ write = {{ address = 0x40000000, value = {value} }} }}\n"
                    )
                })
                .concat(),
        );
        let [first, second, ..] = &ran.boots[..] else { panic!("{state:?}: no reset") };
        let before = first.ticks.iter().rfind(|frame| f64::from(frame.tick) * 1e-3 < from_s - 0.02).expect("frames");
        assert_eq!(before.state, state);
        let took_ms = (second.t_s - from_s) * 1e3;
        report!("40 % of the ticks lost, {}: reset after {took_ms:.1} ms", state.name());
        // A tenth of the span of 100 ms that had begun before, or of the next one.
        assert!((20.0..120.0).contains(&took_ms), "{took_ms} ms");
        assert_eq!(second.boot.as_ref().map(|boot| boot.reset), Some(Reset::Software));
        assert!(second.log.iter().any(|line| line.contains("last run ended by stalled task")), "{:?}", second.log);
    }
}

/// The trigger stands for a period, every 90 ms and every 120 ms: too few ticks for the watchdog task, ten and eight in a second.
fn the_tenth_lost_tick_of_a_second_is_a_fault() {
    for (every_ms, is_fault) in [(90, true), (120, false)] {
        let lost = [(3.0, 0), (3.001, 1)].map(|(at_s, value)| {
            format!(
                "[[event]]\nat_s = {at_s}\nevery_ms = {every_ms}\ntimes = 13\n\
                 inject = {{ write = {{ address = 0x40000000, value = {value} }} }}\n"
            )
        });
        let ran = scripted(4.8, &lost.concat());
        let [boot] = &ran.boots[..] else { panic!("{} boots", ran.boots.len()) };
        let frames = boot.watch(&GeneratorConfig::default_walk(), BoardLoop::frame);
        let last = frames.last().expect("frames");
        report!("a tick in {every_ms} ms lost: {} missed, {}", last.missed, last.state.name());
        if is_fault {
            let fault = frames.iter().find(|frame| frame.state == SupervisorState::Fault).expect("a fault");
            assert_eq!((fault.cause, fault.missed), (Cause::Gap, 10));
        } else {
            assert_eq!((last.state, last.missed), (SupervisorState::Walking, 13));
        }
    }
}

/// At rest, a contact that is open for 245 ms of every 500: some of the lines for people, ten a second, meet it closed and some open. One more line a second
/// says how often the validity changed and how long it was not good, however often that was, and the record has the counts of the host's loop.
fn a_contact_that_is_open_half_the_time_is_in_the_log() {
    const SECS: u32 = 8;
    let folder = tempfile::tempdir().expect("a folder");
    let knee = default_volts();
    let mut text = String::from("time_s,PA1\n");
    for ms in 0..SECS * 1_000 {
        let time = f64::from(ms) * 1e-3;
        let volts = knee.at(&knee.channels()[0], time % knee.duration_s());
        text += &format!("{time:.3},{:.6}\n", if (100..345).contains(&(ms % 500)) { 0.0 } else { volts });
    }
    let file = folder.path().join("volts.csv");
    std::fs::write(&file, text).expect("written");
    let mut options: Vec<OsString> = ["--secs", &SECS.to_string(), "--volts"].map(Into::into).to_vec();
    options.push(file.into());
    let ran = Board::find().run(options);
    let boot = &ran.boots[0];
    let lines: Vec<&String> =
        boot.log.iter().filter(|line| line.starts_with("disarmed") && line.contains(": hips")).collect();
    let good = lines.iter().filter(|line| line.contains(" good,")).count();
    assert!(lines.len() > 60 && (20..lines.len() - 20).contains(&good), "{lines:?}");
    let last = counted(&ran);
    let before = boot.conditions.iter().rfind(|one| one.tick + 1_000 <= last.tick).expect("a second before");
    let [Some(now), Some(then)] = [last, *before].map(|one| one.sensors[0]) else { panic!("one sensor") };
    let second = now.counts().since(&then.counts());
    let (not_good_ms, most) = second.not_good();
    report!(
        "{good} of {} lines say good; in a second {} changes, {not_good_ms} ms not good, most {most}",
        lines.len(),
        second.changes
    );
    // 490 ms, and the time in which the sensor is accepted again.
    assert!((490..=540).contains(&not_good_ms) && most == Validity::Open, "{second:?}");
    assert!((4..=20).contains(&second.changes), "{second:?}");
    let words = boot.log.iter().filter(|line| line.contains("its validity changed")).count() as u32;
    assert!((SECS - 2..=SECS).contains(&words), "{:?}", boot.log);
    assert_eq!(boot.costs.last().expect("a second").dropped, 0);
}

/// A register of everything that shapes a pulse changes between two ticks: a fault in one of the next two, or of the next four for what makes ticks and
/// codes, and no further pulse. (A compare register that changes in a tick, after the comparison, is written by that tick before a pulse has it.)
fn a_changed_register_is_a_fault() {
    let folder = tempfile::tempdir().expect("a folder");
    let feed = volts(folder.path(), 3.2, &|_| 3.0);
    for (name, write) in [
        ("TIM1 CR2", "0x40010004=0x8"),
        ("TIM1 CCER: three channels on", "0x40010020=0x1110"),
        ("TIM1 PSC", "0x40010028=83"),
        ("TIM1 ARR", "0x4001002C=9999"),
        ("TIM1 RCR", "0x40010030=1"),
        ("TIM1 CCR1: another width", "0x40010034=2400"),
        ("TIM1 CCR4: no width", "0x40010040=0"),
        ("TIM1 DIER: no break interrupt", "0x4001000C=0"),
        ("GPIOE MODER: servo pins are inputs", "0x40021000=0"),
        ("GPIOE OTYPER: open drain", "0x40021004=0x0200"),
        ("GPIOE AFRH: other functions", "0x40021024=0"),
        ("GPIOC MODER: the servo-rail enable is an input", "0x40020800=0xC"),
        ("GPIOB AFRH: no break input", "0x40020424=0"),
        ("GPIOB PUPDR: no pull-down at the emergency stop", "0x4002040C=0"),
        ("RCC CFGR: half the clock of TIM1", "0x40023808=0xB40A"),
        ("FLASH ACR: no caches", "0x40023C00=5"),
    ] {
        let write = format!("{write}@3.0008");
        is_a_fault(name, &feed, &["--register", &write]);
    }
    // Locks of BDTR and of a stream that is on keep stores, but not a disturbance. Of trigger, converter and stream a tick compares a quarter.
    for (name, address, mask) in [
        ("TIM2 ARR: a slower trigger", TIM2_ARR, 1 << 1),
        ("TIM2 PSC: a slower trigger", 0x4000_0028, 1 << 2),
        ("ADC1 CR1: codes of 10 bits", 0x4001_2004, 1 << 24),
        ("ADC1 CR2: codes to the left", 0x4001_2008, 1 << 11),
        ("ADC1 SQR1: 8 conversions", 0x4001_202C, 1 << 21),
        ("ADC1 SQR3: another channel", 0x4001_2034, 1),
        ("ADC1 SMPR2: a shorter sampling time", 0x4001_2010, 1 << 5),
        ("ADC CCR: a faster converter", 0x4001_2304, 1 << 16),
        ("DMA2 stream 0 CR: one place in memory for all codes", 0x4002_6410, 1 << 10),
        ("DMA2 stream 0 PAR: another data register", 0x4002_6418, 1 << 3),
        ("DMA2 stream 0 M0AR: another place in memory", 0x4002_641C, 1 << 6),
        ("DMA2 stream 0 M1AR: another place in memory", 0x4002_6420, 1 << 6),
        ("TIM1 CCMR1: channel 1 inactive on match", 0x4001_0018, 1 << 6),
        ("TIM1 CCMR1: channel 2 without preload", 0x4001_0018, 1 << 11),
        ("TIM1 CCMR2: channel 3 inverted", 0x4001_001C, 1 << 4),
        ("TIM1 CCMR2: channel 4 frozen", 0x4001_001C, 3 << 13),
    ] {
        let script = flip_at(folder.path(), 3.0008, address, mask);
        is_a_fault(name, &feed, &["--script", script.to_str().expect("text")]);
    }
}

/// A script that changes bits of a register at a time.
fn flip_at(folder: &Path, at_s: f64, address: u32, mask: u32) -> PathBuf {
    let script = folder.join("script.toml");
    let flip = format!("flip = {{ address = {address:#x}, mask = {mask:#x} }}");
    std::fs::write(&script, format!("[[event]]\nat_s = {at_s}\ninject = {{ {flip} }}\n")).expect("written");
    script
}

/// The end of the trigger's counter goes from 249 to 185. In a quarter of its period it is beyond that, goes on to its largest number, and there are no more
/// ticks: the board is reset. Otherwise a tick finds the change. Of four moments a quarter of the period apart each way has one at least.
fn a_faster_trigger_is_a_fault_or_a_reset() {
    let folder = tempfile::tempdir().expect("a folder");
    let feed = volts(folder.path(), 3.2, &|_| 3.0);
    let (mut faults, mut resets) = (0, 0);
    for quarter in 0..4 {
        let at_s = 3.0008 + f64::from(quarter) * 62.5e-6;
        let script = flip_at(folder.path(), at_s, TIM2_ARR, 1 << 6);
        let (ran, frames) = changed(&feed, &["--script", script.to_str().expect("text")]);
        let last = ran.pulses.last().expect("pulses").0;
        if let Some(after) = ran.boots.get(1) {
            assert_eq!(after.boot.as_ref().map(|boot| boot.reset), Some(Reset::Software), "at {at_s} s");
            assert_in_time("H24", (after.t_s - at_s) * 1e3, "a faster trigger");
            assert!(last <= after.t_s, "at {at_s} s: a pulse at {last} s, after the reset");
            resets += 1;
        } else {
            let (_, state, cause) = ended(&frames);
            assert_eq!((state, cause), (SupervisorState::Fault, Cause::Outputs), "at {at_s} s");
            assert!(last <= 3.006, "at {at_s} s: a pulse at {last} s");
            faults += 1;
        }
    }
    report!("{faults} faults, {resets} resets");
    assert!(faults > 0 && resets > 0, "{faults} faults, {resets} resets");
}

/// A walk in which these options change a register.
fn changed(feed: &OsString, change: &[&str]) -> (Ran, Vec<Frame<SENSORS>>) {
    let mut options: Vec<OsString> = ["--press", "0.3", "--secs", "3.2"].map(Into::into).to_vec();
    options.extend(change.iter().map(Into::into));
    options.extend(["--volts".into(), feed.clone()]);
    let ran = Board::find().run(options);
    let frames = ran.boots[0].watch(&GeneratorConfig::default_walk(), BoardLoop::frame);
    (ran, frames)
}

/// A walk in which this changes a register at 3.0008 s.
fn is_a_fault(name: &str, feed: &OsString, change: &[&str]) {
    let (ran, frames) = changed(feed, change);
    let last = frames.last().expect("frames").state;
    assert_ne!(last, SupervisorState::Walking, "{name}: it walks on");
    let (tick, state, cause) = ended(&frames);
    assert_eq!((state, cause), (SupervisorState::Fault, Cause::Outputs), "{name}");
    // The board's tick 0 is some milliseconds after power-on.
    assert!((2_985..=3_002).contains(&tick), "{name}: in tick {tick}");
    let last = ran.pulses.last().expect("pulses").0;
    assert!(last <= 3.006, "{name}: a pulse at {last} s");
}

/// A robot record, as an option of the virtual board; the file is in this folder.
fn robot_option(folder: &Path, require_brown_out_reset: bool) -> String {
    let robot = RobotConfig { require_brown_out_reset, ..RobotConfig::default_biped() };
    let file = folder.join("robot.bin");
    std::fs::write(&file, robot_record::record_of(&robot, &RecordName::BUILT_IN).bytes()).expect("written");
    format!("{ROBOT_SECTOR:#010x}={}", file.display())
}

/// Off as in a chip as delivered, too low and too high: the board walks, and says at the boot, at the arming and once a second what to do. With its own
/// level it says nothing.
fn another_level_of_the_brown_out_reset_is_a_warning() {
    for (board, wanted, others) in [(Board::find(), 2_u8, [0, 1, 3]), (Board::black_pill(), 3, [0, 1, 2])] {
        for level in others.into_iter().chain([wanted]) {
            let number = level.to_string();
            let option: &[&str] = if level == 0 { &["--no-brown-out-reset"] } else { &["--brown-out-level", &number] };
            let ran = board.run(walk_options(2.0, option));
            ran.assert_sound();
            let boot = &ran.boots[0];
            let BrownOut { level: seen, wanted: own } = boot.boot.as_ref().expect("a boot record").brown_out;
            assert_eq!((seen, own), (level, wanted));
            assert!(!ran.pulses.is_empty() && boot.refused.is_empty(), "level {level}: {:?}", boot.refused);
            let words = format!(
                "the brown-out reset is at level {level}, 0 is off; this board wants level {wanted}: `cargo xtask board brown-out` sets it"
            );
            let lines = boot.log.iter().filter(|line| **line == words).count();
            assert_eq!(lines, if level == wanted { 0 } else { 2 }, "{:?}", boot.log);
            let warnings = Warnings::BROWN_OUT.when(level != wanted);
            assert!(!boot.environment.is_empty() && boot.environment.iter().all(|chip| chip.warnings == warnings));
        }
    }
}

/// Only off is refused, only by a robot that demands it, and with the reason in words.
fn a_robot_that_demands_a_brown_out_reset_does_not_arm_without_one() {
    let folder = tempfile::tempdir().expect("a folder");
    for (is_demanded, option, is_refused) in [
        (true, &["--no-brown-out-reset"][..], true),
        (true, &["--brown-out-level", "1"], false),
        (false, &["--no-brown-out-reset"], false),
    ] {
        let robot = robot_option(folder.path(), is_demanded);
        let ran = Board::find().run(walk_options(2.0, &[&["--flash", &robot], option].concat()));
        assert_eq!(ran.pulses.is_empty(), is_refused, "{is_demanded} {option:?}");
        let refused: Vec<_> =
            ran.boots[0].refused.iter().map(|refused| (refused.subject, refused.reason.as_str())).collect();
        let words =
            "the brown-out reset is off, and the robot record demands it: `cargo xtask board brown-out` sets it";
        assert_eq!(refused, if is_refused { vec![(Subject::Arming, words)] } else { vec![] });
    }
}

/// The emergency stop closes some milliseconds after the press is accepted: the state `arming` lasts for a few ticks, between two frames of the log.
fn a_state_of_some_milliseconds_is_in_the_log() {
    let board = Board::find();
    let folder = tempfile::tempdir().expect("a folder");
    let feed = volts(folder.path(), 1.0, &|_| 3.0);
    let mut shortest = u32::MAX;
    for ms in 0..4 {
        // Armed at the release of the button, 20 ms of debouncing later.
        let stop = format!("{}:0.1", 0.4001 + f64::from(ms) * 2e-3);
        let mut options: Vec<OsString> =
            ["--press", ARM, "--secs", "1", "--emergency-stop", STOP_TEST, &stop].map(Into::into).to_vec();
        options.extend(["--volts".into(), feed.clone()]);
        let ran = board.run(options);
        let frames = ran.boots[0].watch(&GeneratorConfig::default_walk(), BoardLoop::frame);
        let mut before = (SupervisorState::Boot, Cause::None);
        let mut expected = Vec::new();
        for frame in &frames {
            let now = (frame.state, frame.cause);
            if std::mem::replace(&mut before, now) != now {
                expected.push((frame.tick, frame.state, frame.cause));
            }
        }
        let logged: Vec<_> = ran.boots[0].changes.iter().map(|one| (one.tick, one.state, one.cause)).collect();
        assert_eq!(logged, expected, "stop {ms}");
        let spans = logged.windows(2).filter(|two| two[0].1 == SupervisorState::Arming).map(|two| two[1].0 - two[0].0);
        shortest = shortest.min(spans.min().unwrap_or(u32::MAX));
    }
    report!("shortest state in the log: arming for {shortest} ms");
    assert!((1..10).contains(&shortest), "no state as short as was meant: {shortest} ms");
}

/// Crystals of other boards, and others: the reason has the frequency, and nothing moves. One that is slow or fast by less walks; its error is found by
/// nothing.
fn another_crystal_keeps_the_board_off() {
    let board = Board::find();
    for hz in [4e6, 7.3728e6, 9.216e6, 12e6, 16e6, 25e6, 26e6] {
        let ran = board.run(walk_options(2.0, &["--hse-hz", &hz.to_string()]));
        assert!(ran.pulses.is_empty() && ran.boots.len() == 1, "{hz} Hz");
        assert_eq!(ran.end.edges_before_arming, 0, "{hz} Hz");
        let [refused] = &ran.boots[0].refused[..] else { panic!("{hz} Hz: {:?}", ran.boots[0].refused) };
        report!("{hz} Hz: {}", refused.reason);
        assert_eq!(refused.subject, Subject::Clock);
        let words = refused.reason.strip_prefix("the clock HSE has ").and_then(|rest| rest.split_once(" MHz"));
        let measured_hz = words.expect("a frequency").0.parse::<f64>().expect("a number") * 1e6;
        assert!((measured_hz / hz - 1.0).abs() < 3e-3, "{hz} Hz: {}", refused.reason);
    }
    for hz in [7_990_000, 8_000_000] {
        let ran = board.run(walk_options(2.0, &["--hse-hz", &hz.to_string()]));
        assert!(!ran.pulses.is_empty(), "{hz} Hz");
    }
}
