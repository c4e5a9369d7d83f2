//! Inputs of the flashed image on the virtual board: four sensors with calibrations of their own, a foot switch, the synchronisation line
//! of another system; and shadow mode, in which all inputs are read and no servo is driven.

use cpg_core::entrainment::{EventSource, Lock};
use cpg_core::waveform::shape::Shape;
use firmware::board::{GENERATOR_SECTOR, SENSORS_SECTOR};
use footfall::board::default_loop::SENSOR_PINS;
use footfall_tests::board::{Board, Ran};
use footfall_tests::chain;
use footfall_tests::degraded::Random;
use footfall_tests::gestures::ARM;
use footfall_tests::people::Person;
use footfall_tests::recordings::{default_trace, default_volts_file};
use gait_trace::format::csv_file;
use gait_trace::{Channel, Looped, Quantity, Recording};
use hgod_adc::{Calibration, CalibrationPoint, Interpolation, Validity};
use joint_loop::setup::default_loop::Parameters;
use joint_loop::store::{generator_record, sensor_record};
use joint_loop::{FollowConfig, GeneratorConfig, JointSensor, JointSensors, RecordName, RobotConfig, SupervisorState};
use joint_units::{Joint, Phase, Radians, Volts};
use std::ffi::OsString;
use std::path::Path;
use std::process::ExitCode;
use test_suite::{report, tests};
use wire::{Call, RecordId};

fn main() -> ExitCode {
    test_suite::run(tests![
        each_of_four_sensors_has_its_own_calibration(Image),
        a_follower_uses_the_channel_of_its_joint(Image),
        a_foot_switch_keeps_the_phase_while_the_sensor_is_lost(Image),
        a_broken_sensor_sector_keeps_the_outputs_off(Image),
        synchronisation_edges_are_timed_by_the_boards_clock(Image),
        a_ringing_line_delays_no_tick(Image),
        in_shadow_mode_everything_runs_and_no_pin_moves(ShadowImage),
    ])
}

/// Nothing irregular, every line the host's to the bit, and of the stack, which is used most at boot, no more than six tenths.
fn assert_equal(ran: &Ran) {
    assert_eq!((ran.code, ran.end.unmodelled, ran.end.lints.len(), ran.boots.len()), (Some(0), 0, 0, 1));
    let books = &ran.books;
    assert_eq!((books.different, books.not_compared, books.lost_lines), (0, 0, 0), "{:?}", books.differences);
    assert!(books.compared > 100);
    let margin = ran.boots[0].costs.last().unwrap();
    assert!(10 * margin.stack_used <= 6 * margin.stack_size, "{} of {} bytes", margin.stack_used, margin.stack_size);
}

fn download(address: u32, bytes: &[u8], folder: &Path, name: &str) -> [OsString; 2] {
    let file = folder.join(name);
    std::fs::write(&file, bytes).unwrap();
    ["--flash".into(), format!("{address:#010x}={}", file.display()).into()]
}

/// Four sensors that are not alike: volts that rise or fall with the angle, curved or straight, straight on the pin or through a divider.
fn four() -> JointSensors {
    let straight = |joint, from: f32, to: f32, divider: f32| {
        let point = |part: f32| CalibrationPoint {
            volts: Volts(divider * (0.4 + 2.1 * part)),
            angle: Radians::from_degrees(from + (to - from) * part),
        };
        let points: Vec<_> = (0..8).map(|n| point(n as f32 / 7.0)).collect();
        let calibration = Calibration::new(&points, Interpolation::Linear).unwrap();
        JointSensor { joint, divider, calibration }
    };
    JointSensors::build([
        straight(Joint::RightKnee, -20.0, 100.0, 1.0),
        straight(Joint::LeftHip, 70.0, -50.0, 1.6),
        JointSensor::uncalibrated(Joint::LeftKnee).unwrap(),
        straight(Joint::RightHip, -40.0, 60.0, 0.5),
    ])
    .unwrap()
}

/// Volts of these joints' sensors at their pins over a walk.
fn volts(walk: &Looped, sensors: &JointSensors) -> Recording {
    let channels = sensors.iter().zip(SENSOR_PINS).map(|(sensor, pin)| {
        let channel = walk.recording.of_joint(sensor.joint).unwrap();
        let one = walk.recording.semi_synthetic_volts(channel, &sensor.calibration, sensor.divider, pin).unwrap();
        one.channels()[0].clone()
    });
    Recording::build(walk.recording.time_s().to_vec(), channels.collect()).unwrap()
}

fn each_of_four_sensors_has_its_own_calibration() {
    let board = Board::find();
    let (folder, walk, sensors) = (tempfile::tempdir().unwrap(), default_trace().looped(1000.0).unwrap(), four());
    let parameters = Parameters::with_defaults(None, Some(sensors.clone()), RobotConfig::default_biped()).unwrap();
    let feed = folder.path().join("volts.csv");
    csv_file::write(&feed, &volts(&walk, &sensors)).unwrap();
    let mut options: Vec<OsString> = ["--secs", "5", "--press", ARM, "--loop", "--volts"].map(Into::into).to_vec();
    options.push(feed.into());
    let record = sensor_record::record_of(&sensors, &RecordName::BUILT_IN);
    options.extend(download(SENSORS_SECTOR, record.bytes(), folder.path(), "sensors.bin"));
    let ran = board.run_as(&parameters, &options);
    assert_equal(&ran);
    let boot = &ran.boots[0];
    let id = RecordId::new("built-in", record.crc());
    assert_eq!(boot.boot.as_ref().unwrap().sensors, Some(id));
    // The board's own lines.
    let mut worst = [0.0f64; 4];
    for line in &boot.ticks {
        for (channel, sensor) in sensors.iter().enumerate() {
            let reading = line.sensors[channel].unwrap();
            assert_eq!(reading.validity, Validity::Good, "{} in tick {}", sensor.joint.name(), line.tick);
            if line.tick < 200 {
                continue;
            }
            // The conversions of a tick end about 9 ms after the feed's time 0, and the filter is late.
            let joint = walk.recording.of_joint(sensor.joint).unwrap();
            let near = |late: f64| {
                let at = (f64::from(line.tick) * 1e-3 - late).rem_euclid(walk.recording.duration_s());
                (f64::from(reading.angle_deg()) - walk.recording.at(joint, at)).abs()
            };
            worst[channel] =
                worst[channel].max((-12..=12).map(|ms| near(f64::from(ms) * 1e-3)).fold(f64::MAX, f64::min));
        }
    }
    report!("four sensors: at most {worst:.2?} degrees from the recorded joints");
    assert!(worst.iter().all(|worst| *worst < 0.6), "{worst:?}");
    assert_eq!(boot.ticks.last().unwrap().state, SupervisorState::Walking);
    assert_eq!(ran.end.lints.len(), 0);
}

/// The gait sensor of a follower is the one on its joint, whichever channel that is.
fn a_follower_uses_the_channel_of_its_joint() {
    let board = Board::find();
    let (folder, walk, sensors) = (tempfile::tempdir().unwrap(), default_trace().looped(1000.0).unwrap(), four());
    let person = Person::of("default", looped(&walk, 12.0), Joint::LeftHip);
    let config = person.follower(Joint::LeftHip, person.learned.stride_s);
    let feed = folder.path().join("volts.csv");
    csv_file::write(&feed, &volts(&walk, &sensors)).unwrap();
    let mut options: Vec<OsString> = ["--secs", "6", "--press", ARM, "--loop", "--volts"].map(Into::into).to_vec();
    options.push(feed.into());
    let with = |sensors: &JointSensors| {
        let mut options = options.clone();
        options.extend(download(
            GENERATOR_SECTOR,
            generator_record::record_of(&config, &RecordName::BUILT_IN).bytes(),
            folder.path(),
            "w",
        ));
        options.extend(download(
            SENSORS_SECTOR,
            sensor_record::record_of(sensors, &RecordName::BUILT_IN).bytes(),
            folder.path(),
            "s",
        ));
        board.run_as(
            &Parameters::with_defaults(Some(config), Some(sensors.clone()), RobotConfig::default_biped()).unwrap(),
            &options,
        )
    };
    let ran = with(&sensors);
    assert_equal(&ran);
    let following = ran.books.following.unwrap();
    assert_eq!((following.state, following.fault), ("locked", None));
    assert!(following.locked_at_s.unwrap() < 4.0, "{following:?}");
    // Every frame holds the state of the lock.
    assert!(ran.boots[0].ticks.iter().all(|frame| frame.following.is_some()));

    // Without a sensor on that joint the outputs stay off and the log says why.
    let knees = JointSensors::build([Joint::LeftKnee, Joint::RightKnee].map(|j| JointSensor::uncalibrated(j).unwrap()));
    let dark = with(&knees.unwrap());
    assert_eq!(dark.boots[0].ticks.len(), 0);
    let said = dark.boots[0].log.iter().any(|line| line.contains("follows left_hip, which has no sensor"));
    assert!(said, "{:?}", dark.boots[0].log);
}

/// From the moment on in which the sensor's wire comes off the person takes quicker steps: with a foot switch the phase is followed.
fn a_foot_switch_keeps_the_phase_while_the_sensor_is_lost() {
    let board = Board::find();
    let (folder, walk) = (tempfile::tempdir().unwrap(), default_trace().looped(1000.0).unwrap());
    let person = Person::of("default", looped(&walk, 12.0), Joint::LeftHip);
    let (lost_s, secs) = (10.0, 11.9);
    // Strides of 1.1 s, then of 1.02 s; the other foot strikes, late by 40 ms.
    let cycles = |t: f64| if t < lost_s { t / 1.1 } else { lost_s / 1.1 + (t - lost_s) / 1.02 };
    let phase = |t: f64| Phase::from_cycles(cycles(t).fract() as f32);
    let rows: Vec<f64> = (0..(secs * 1e3) as u32).map(|ms| f64::from(ms) * 1e-3).collect();
    let angle = |t: &f64| f64::from(Radians(person.templates[0].at(phase(*t)).angle).degrees());
    let sound = chain::volts(&rows.iter().map(angle).collect::<Vec<_>>());
    let values = rows.iter().zip(sound.channels()[0].values()).map(|(t, v)| if *t < lost_s { *v } else { 0.0 });
    let channel = Channel::new("PA1", Quantity::PinVolts, values.collect());
    let feed = folder.path().join("volts.csv");
    csv_file::write(&feed, &Recording::build(rows.clone(), vec![channel]).unwrap()).unwrap();
    let on_floor = |t: f64| (cycles(t - 0.04) + 0.5).fract() < 0.6;
    let mut edges = vec![];
    for pair in rows.windows(2).filter(|pair| on_floor(pair[0]) != on_floor(pair[1])) {
        edges.push((pair[1], on_floor(pair[1])));
    }
    let strikes = folder.path().join("strikes.csv");
    edges_file(&strikes, &edges);

    let off = |events: EventSource| {
        let GeneratorConfig::Follow(follow) = person.follower(Joint::LeftHip, 1.1) else { panic!("not a follower") };
        let config = GeneratorConfig::Follow(FollowConfig { events, ..follow });
        let mut options: Vec<OsString> = ["--press", ARM, "--secs", &secs.to_string()].map(Into::into).to_vec();
        options.extend(["--volts".into(), feed.clone().into()]);
        options.extend(["--edges".into(), format!("PC5={}", strikes.display()).into()]);
        options.extend(download(
            GENERATOR_SECTOR,
            generator_record::record_of(&config, &RecordName::BUILT_IN).bytes(),
            folder.path(),
            "w",
        ));
        let ran = board.run_with(&config, &options);
        assert_equal(&ran);
        // The foot is in the inputs of every tick, and the replay got the same strikes.
        let closed = |(_, call): &&(u32, Call)| call.sample().foot;
        assert!(ran.boots[0].calls.iter().filter(closed).count() > 5_000);
        let estimates = ran.boots[0].watch(&config, |joints| {
            let joint_loop::BoardGenerator::Follow(follower) = joints.generator() else { panic!("not a follower") };
            (f64::from(joints.frame().tick) * 1e-3, follower.phase_lock().phase(), follower.status().state)
        });
        let late = chain::begun_ms(&ran.boots[0]) as f64 * 1e-3;
        let (t, estimate, state) = *estimates.last().unwrap();
        assert_eq!(state, Lock::Holding);
        estimate.radians_after(phase(t + late)).degrees().abs()
    };
    let (without, with) = (off(EventSource::None), off(EventSource::FootSwitch));
    report!("phase error after {:.1} s: {without:.1} degrees without, {with:.1} with the foot switch", secs - lost_s);
    assert!(without > 30.0, "{without}");
    assert!(with < 0.5 * without, "{with} of {without}");
}

/// The walk as a recording that lasts.
fn looped(walk: &Looped, secs: f64) -> Recording {
    let rows = (secs * 1000.0) as usize;
    let channels = walk.recording.channels().iter().map(|channel| {
        let round = channel.values().len() - 1;
        let values = (0..rows).map(|n| channel.values()[n % round]).collect();
        Channel::new(channel.name(), channel.quantity(), values)
    });
    Recording::build((0..rows).map(|n| n as f64 * 1e-3).collect(), channels.collect()).unwrap()
}

/// A sector of sensors with one bit changed, and one of something else.
fn a_broken_sensor_sector_keeps_the_outputs_off() {
    let board = Board::find();
    let folder = tempfile::tempdir().unwrap();
    let good = sensor_record::record_of(&four(), &RecordName::BUILT_IN);
    let mut changed = good.bytes().to_vec();
    changed[40] ^= 4;
    for (bytes, words) in
        [(changed.as_slice(), "sensor_record refused: damaged: check sum"), (b"FFWK, not sensors", "begins with FFSN")]
    {
        let mut options: Vec<OsString> = ["--secs", "0.5", "--press", ARM].map(Into::into).to_vec();
        options.extend(download(SENSORS_SECTOR, bytes, folder.path(), "sensors.bin"));
        let ran = board.run(options);
        assert!(ran.boots[0].ticks.is_empty() && ran.end.edges_before_arming == 0);
        assert!(ran.boots[0].log.iter().any(|line| line.contains(words)), "{:?}", ran.boots[0].log);
    }
}

/// Edges of a line as `time_s,level`.
fn edges_file(path: &Path, edges: &[(f64, bool)]) {
    let rows: String = edges.iter().map(|(time, high)| format!("{time},{}\n", u8::from(*high))).collect();
    std::fs::write(path, format!("time_s,level\n{rows}")).unwrap();
}

/// Edges at random times are logged in the board's time: a constant delay and some microseconds after the true time.
fn synchronisation_edges_are_timed_by_the_boards_clock() {
    let board = Board::find();
    let folder = tempfile::tempdir().unwrap();
    let mut random = Random(7);
    let (mut time, mut edges) = (0.1, vec![]);
    while time < 5.8 {
        edges.push((time, edges.len() % 2 == 0));
        // From 60 us to 40 ms, also several in a tick.
        time += 60e-6 * (random.unit() * 6.5).exp();
    }
    let file = folder.path().join("edges.csv");
    edges_file(&file, &edges);
    let mut options: Vec<OsString> = ["--secs", "6", "--press", ARM, "--loop", "--volts"].map(Into::into).to_vec();
    options.extend([default_volts_file().into(), "--edges".into(), format!("PC6={}", file.display()).into()]);
    let ran = board.run(options);
    assert_equal(&ran);
    let logged = &ran.boots[0].edges;
    assert_eq!(logged.len(), edges.len());
    assert!(logged.iter().zip(&edges).all(|(logged, (_, high))| logged.high == *high));
    let off: Vec<f64> = logged.iter().zip(&edges).map(|(logged, (time, _))| logged.time_s() - time).collect();
    let (least, most) = off.iter().fold((f64::MAX, f64::MIN), |(least, most), off| (least.min(*off), most.max(*off)));
    report!(
        "{} edges, {:.3} to {:.3} ms after the true time by the board's clock",
        logged.len(),
        least * 1e3,
        most * 1e3
    );
    // The boot's clock begins later than the feed's; what is left is the handler and the microsecond.
    assert!(most - least < 4e-6, "{least} to {most}");
    assert!(ran.boots[0].edges.iter().all(|edge| !edge.lost_before));
}

/// A line that rings at 200 kHz for 50 ms: the lost edges are counted, and no tick is late.
fn a_ringing_line_delays_no_tick() {
    let board = Board::find();
    let folder = tempfile::tempdir().unwrap();
    let edges: Vec<(f64, bool)> = (0..20_000).map(|n| (1.0 + f64::from(n) * 2.5e-6, n % 2 == 0)).collect();
    let file = folder.path().join("edges.csv");
    edges_file(&file, &edges);
    let mut options: Vec<OsString> = ["--secs", "2", "--loop", "--volts"].map(Into::into).to_vec();
    options.extend([default_volts_file().into(), "--edges".into(), format!("PC6={}", file.display()).into()]);
    let ran = board.run(options);
    assert_equal(&ran);
    let last = ran.boots[0].ticks.last().unwrap();
    assert_eq!((last.late, last.missed), (0, 0));
    let logged = ran.boots[0].edges.len();
    assert!((100..=500).contains(&logged), "{logged} edges");
    assert!(ran.boots[0].edges.iter().filter(|edge| edge.lost_before).count() >= 40);
}

/// With the shadow image: the loop arms and walks, its setpoints are the host's, and no servo pin ever moves.
fn in_shadow_mode_everything_runs_and_no_pin_moves() {
    let board = Board::shadow();
    let walk = default_trace().looped(1000.0).unwrap();
    let person = Person::of("default", looped(&walk, 12.0), Joint::LeftHip);
    let config = person.follower(Joint::LeftHip, person.learned.stride_s);
    let ran = chain::run(&board, &config, &chain::volts(&person.samples(Joint::LeftHip)), 8.0, &[ARM]);
    assert_equal(&ran);
    let boot = &ran.boots[0];
    assert!(boot.boot.as_ref().unwrap().shadow && ran.books.shadow);
    let last = boot.ticks.last().unwrap();
    assert_eq!(last.state, SupervisorState::Walking);
    assert!(last.pulses_us.iter().all(|us| (500..=2500).contains(us)), "{last:?}");
    // No edge at the servo pins; the setpoints of the knees move, and the phase error is logged.
    assert!(ran.pulses.is_empty(), "{:?}", ran.pulses.first());
    for pin in ["PE9", "PE11", "PE13", "PE14"] {
        assert_eq!(ran.end.edges.get(pin).copied().unwrap_or(0), 0, "{pin}");
    }
    let knee = boot.ticks.iter().filter(|tick| tick.tick > 6000).map(|tick| tick.setpoints_deg()[2]);
    let (least, most) = knee.fold((f32::MAX, f32::MIN), |(least, most), deg| (least.min(deg), most.max(deg)));
    assert!(most - least > 40.0, "{least} to {most} degrees");
    let follow = last.following.unwrap();
    assert!(follow.phase_error_deg().abs() < 20.0 && follow.confidence > 0.3, "{follow:?}");
    assert_eq!(ran.books.following.map(|following| following.state), Some("locked"));
}
