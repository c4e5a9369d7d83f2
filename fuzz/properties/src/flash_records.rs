//! Flash records: what is accepted is written again to the same bytes, builds, and keeps the limits of the robot.
//!
//! A record ends with a check sum that no fuzzer guesses. So the bytes are read twice: as a sector, and as a record whose magic word, schema,
//! number of words, check sum and commit word are made right first.

use std::ops::Range;

use cpg_core::{Follow as _, Generator as _};
use crc::{CRC_32_ISO_HDLC, Crc};
use joint_loop::setup::default_loop::{Parameters, board_loop};
use joint_loop::store::{generator_record, robot_record, sensor_record};
use joint_loop::{Gate, GeneratorConfig, JointSensors, RecordName, RobotConfig};
use joint_units::{AdcCode, Period, Radians, Volts};

use crate::motion_limits::MotionLimits;

const MAGIC_AND_SCHEMA: Range<usize> = 0..6;
const COUNT: Range<usize> = 8..12;
/// Bytes before the words.
const HEAD: usize = 36;
/// Check sum and commit word.
const TAIL: usize = 8;

/// Ticks for which an accepted generator is stepped.
const TICKS: u32 = 300;

/// The code of the chip's internal reference in these tests.
const REFERENCE: AdcCode = AdcCode(1501);
/// The least supply in these tests.
const LEAST_SUPPLY: Volts = Volts(2.7);

/// The bytes as a record with the magic word and schema of `like` and everything else right that does not carry meaning; `None` if they are
/// too short.
fn sealed(bytes: &[u8], like: &[u8]) -> Option<Vec<u8>> {
    let whole_words = (bytes.len().checked_sub(HEAD + TAIL)?) / 4 * 4;
    let mut record = bytes[..HEAD + whole_words].to_vec();
    record[MAGIC_AND_SCHEMA].copy_from_slice(&like[MAGIC_AND_SCHEMA]);
    record[COUNT].copy_from_slice(&u32::try_from(whole_words / 4).ok()?.to_le_bytes());
    let sum = Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&record);
    record.extend(sum.to_le_bytes());
    record.extend(b"DONE");
    Some(record)
}

/// Checks what was read from a sector: it begins with the record that `written` is, and is erased behind it.
fn assert_same_bytes(sector: &[u8], written: &[u8]) {
    assert_eq!(sector.get(..written.len()), Some(written), "what was read is written as other bytes");
    assert!(sector[written.len()..].iter().all(|byte| *byte == 0xFF), "bytes behind the record were accepted");
}

/// Reads both forms of the bytes.
fn each_form<T, E: std::fmt::Display>(
    bytes: &[u8],
    like: &[u8],
    read: impl Fn(&[u8]) -> Result<Option<T>, E>,
    accepted: impl Fn(&[u8], &T),
) {
    for sector in [Some(bytes.to_vec()), sealed(bytes, like)].into_iter().flatten() {
        match read(&sector) {
            Ok(Some(stored)) => accepted(&sector, &stored),
            Ok(None) => {
                assert!(sector.iter().all(|byte| *byte == 0xFF), "a sector that is written to was taken as erased")
            }
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    }
}

/// Generator records: accepted ones build, and their motion keeps the limits of the robot.
pub fn generator(bytes: &[u8]) {
    let like = generator_record::record_of(&GeneratorConfig::default_walk(), &RecordName::BUILT_IN);
    each_form(bytes, like.bytes(), generator_record::read, |sector, stored| {
        let again = generator_record::record_of(&stored.config, &stored.name);
        assert_same_bytes(sector, again.bytes());
        assert_eq!(again.crc(), stored.crc);
        assert_moves_inside(&stored.config);
    });
}

/// Steps a generator with measured angles and without, and limits its angles with the default robot.
fn assert_moves_inside(config: &GeneratorConfig) {
    let mut generator = config.build(Period::MILLISECOND).expect("the record was accepted, so it builds");
    let robot = RobotConfig::default_biped();
    let gate = Gate::build(&robot.gate, Period::MILLISECOND).expect("the default robot");
    let mut state = gate.rest(robot.park).expect("the park pose is inside");
    let mut limits = MotionLimits::new(robot.gate, Period::MILLISECOND);
    limits.check(&robot.park);
    for tick in 0..TICKS {
        // Swings of a leg, then a lost sensor, then angles that jump.
        let swing = 0.3 * (tick as f32 * 0.006).sin();
        generator.observe(match tick / 100 {
            0 => Some(Radians(swing)),
            1 => None,
            _ => Some(Radians(if tick % 7 == 0 { 2.0 } else { swing })),
        });
        if tick % 90 == 0 {
            generator.heel_strike();
        }
        generator.step();
        let angles = generator.angles();
        if generator.check().is_ok() {
            assert!(angles.iter().all(|angle| angle.0.is_finite()), "{angles:?} passed the check");
        }
        if let Ok((setpoints, _)) = gate.limit(&mut state, angles) {
            limits.check(&setpoints);
        }
    }
}

/// Sensor records: each accepted sensor builds and gives a finite angle for every code, and the loop of a board takes them.
pub fn sensors(bytes: &[u8]) {
    let default = Parameters::default_sensors(&GeneratorConfig::default_walk()).expect("the default sensors");
    let like = sensor_record::record_of(&default, &RecordName::BUILT_IN);
    each_form(bytes, like.bytes(), sensor_record::read, |sector, stored| {
        let again = sensor_record::record_of(&stored.sensors, &stored.name);
        assert_same_bytes(sector, again.bytes());
        assert_measures(&stored.sensors);
    });
}

fn assert_measures(sensors: &JointSensors) {
    for sensor in sensors.iter() {
        let ((low, high), (least, most)) = (sensor.calibration.volts_span(), sensor.calibration.span());
        for step in 0..=64 {
            let volts = low.0 + (high.0 - low.0) * step as f32 / 64.0;
            if let Ok(angle) = sensor.calibration.angle(Volts(volts)) {
                assert!(angle >= least && angle <= most, "{angle:?} at {volts} V is outside {least:?} to {most:?}");
            }
        }
    }
    let robot = RobotConfig::default_biped();
    let parameters = Parameters::with_defaults(None, Some(sensors.clone()), robot).expect("sensors are given");
    if let Err(error) = board_loop(&parameters, REFERENCE, LEAST_SUPPLY, true) {
        assert!(!error.to_string().is_empty());
    }
}

/// Robot records: accepted ones build, and the default walk keeps their limits.
pub fn robot(bytes: &[u8]) {
    let like = robot_record::record_of(&RobotConfig::default_biped(), &RecordName::BUILT_IN);
    each_form(bytes, like.bytes(), robot_record::read, |sector, stored| {
        let again = robot_record::record_of(&stored.robot, &stored.name);
        assert_same_bytes(sector, again.bytes());
        assert_keeps_its_limits(&stored.robot);
    });
}

fn assert_keeps_its_limits(config: &RobotConfig) {
    let robot = config.build(Period::MILLISECOND).expect("the record was accepted, so it builds");
    let gate = Gate::build(&config.gate, Period::MILLISECOND).expect("a part of it");
    let mut state = gate.rest(config.park).expect("the park pose of an accepted robot is inside");
    let mut limits = MotionLimits::new(config.gate, Period::MILLISECOND);
    for tick in 0..TICKS {
        // From one corner of the largest motion to the other.
        let far = if tick / 60 % 2 == 0 { 3.0 } else { -3.0 };
        let target = [far, -far, far, far].map(Radians);
        let (setpoints, _) = gate.limit(&mut state, target).expect("finite targets");
        limits.check(&setpoints);
        for ((angle, map), servo) in setpoints.iter().zip(&robot.servos).zip(&config.servos) {
            let pulse = map.pulse(*angle).expect("finite").0;
            assert!((servo.shortest.0..=servo.longest.0).contains(&pulse), "{pulse} us of {servo:?}");
        }
    }
}
