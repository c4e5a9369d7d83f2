//! A write of a record that is interrupted anywhere: the sector is erased, holds the old or the new record whole, or is damaged. No cut
//! gives another value, and none stands for an erased sector.

use cpg_core::entrainment::{Corrections, EventSource};
use cpg_core::network::thesis::ThesisConfig;
use joint_loop::store::{generator_record, robot_record, sensor_record};
use joint_loop::{
    FollowConfig, GeneratorConfig, JointSensor, JointSensors, RecordName, RobotConfig, SERIES_HARMONICS, SeriesConfig,
    ShapeConfig,
};
use joint_units::{Joint, Radians};
use std::ops::RangeInclusive;

/// Longer than any record; a sector of the board is longer still.
const SECTOR: usize = 2048;

/// What a reader makes of a sector.
#[derive(Debug, PartialEq)]
enum Content<T> {
    Erased,
    Record(T),
    Damaged,
}

/// How flash is written.
#[derive(Debug, Clone, Copy)]
enum Unit {
    Byte,
    Word,
}

impl Unit {
    fn bytes(self) -> usize {
        match self {
            Self::Byte => 1,
            Self::Word => 4,
        }
    }
}

/// Of a byte that is being written, the bits that still have their former value: every set of them.
const TORN: RangeInclusive<u8> = 0x00..=0xFF;

fn padded(record: &[u8]) -> Vec<u8> {
    let mut sector = record.to_vec();
    sector.resize(SECTOR, 0xFF);
    sector
}

/// A sector in which every unit before `cut` is as in `after`, the one at `cut` has changed in part, and the others are as in `before`.
fn cut_at(before: &[u8], after: &[u8], cut: usize, unit: Unit, torn: u8) -> Vec<u8> {
    let end = (cut + unit.bytes()).min(SECTOR);
    let mut sector = [&after[..cut], &before[cut..]].concat();
    for place in cut..end {
        sector[place] = (before[place] & torn) | (after[place] & !torn);
    }
    sector
}

/// Cuts the two steps of a write, which are to erase the old record and to program the new one, at every unit of either record, with every set of its
/// bits (each byte of a word the same), and reads each sector; returns the number of cuts.
fn check<T: PartialEq + std::fmt::Debug>(
    [old, new]: [&[u8]; 2],
    [old_value, new_value]: [&T; 2],
    read: impl Fn(&[u8]) -> Content<T>,
) -> usize {
    let (old, new, erased) = (padded(old), padded(new), vec![0xFF; SECTOR]);
    let used = |sector: &[u8]| sector.iter().rposition(|byte| *byte != 0xFF).map_or(0, |last| last + 1);
    let mut cuts = 0;
    for (before, after) in [(&old, &erased), (&erased, &new)] {
        for unit in [Unit::Byte, Unit::Word] {
            for cut in (0..used(before).max(used(after))).step_by(unit.bytes()) {
                for torn in TORN {
                    let sector = cut_at(before, after, cut, unit, torn);
                    let expected = match &sector {
                        sector if *sector == erased => Content::Erased,
                        sector if *sector == old => Content::Record(old_value),
                        sector if *sector == new => Content::Record(new_value),
                        _ => Content::Damaged,
                    };
                    let found = read(&sector);
                    let same = match (&found, &expected) {
                        (Content::Record(found), Content::Record(expected)) => found == *expected,
                        (Content::Erased, Content::Erased) | (Content::Damaged, Content::Damaged) => true,
                        _ => false,
                    };
                    assert!(same, "{unit:?} {cut}, {torn:02x}: {found:?}, expected {expected:?}");
                    cuts += 1;
                }
            }
        }
    }
    assert_eq!(read(&erased), Content::Erased);
    cuts
}

fn content<T, E>(read: Result<Option<T>, E>) -> Content<T> {
    match read {
        Ok(None) => Content::Erased,
        Ok(Some(value)) => Content::Record(value),
        Err(_) => Content::Damaged,
    }
}

fn names() -> [RecordName; 2] {
    ["an earlier person", "normal walk"].map(|name| RecordName::new(name).expect("short"))
}

/// A generator of each way to store one, and a shape.
fn generators() -> Vec<GeneratorConfig> {
    let series =
        |mean| SeriesConfig { mean: Radians(mean), cos: [0.25; SERIES_HARMONICS], sin: [-1e-7; SERIES_HARMONICS] };
    let shape = ShapeConfig { stride_s: 1.25, joints: [0.1, 0.2, 0.3, 0.4].map(series) };
    let follow = FollowConfig {
        sensor: Joint::RightHip,
        events: EventSource::FootSwitch,
        shape,
        corrections: Corrections::NONE,
    };
    vec![
        GeneratorConfig::default_walk(),
        GeneratorConfig::Thesis(ThesisConfig::set_s()),
        GeneratorConfig::Shape(shape),
        GeneratorConfig::Follow(follow),
    ]
}

#[test]
fn a_generator_record_is_whole_or_damaged() {
    let (all, [old_name, new_name]) = (generators(), names());
    let mut cuts = 0;
    for (place, old) in all.iter().enumerate() {
        let new = &all[(place + 1) % all.len()];
        let records = [generator_record::record_of(old, &old_name), generator_record::record_of(new, &new_name)];
        let values = [(*old, old_name), (*new, new_name)];
        cuts += check(records.each_ref().map(|record| record.bytes()), values.each_ref(), |sector| {
            content(generator_record::read(sector).map(|found| found.map(|stored| (stored.config, stored.name))))
        });
    }
    assert!(cuts >= 100_000, "{cuts} cuts");
}

#[test]
fn a_sensor_record_is_whole_or_damaged() {
    let [old_name, new_name] = names();
    let of = |joints: &[Joint]| {
        let sensors = joints.iter().map(|joint| JointSensor::uncalibrated(*joint).expect("monotone"));
        JointSensors::build(sensors).expect("one a joint")
    };
    let (old, new) = (of(&Joint::ALL[..1]), of(&Joint::ALL));
    let mut cuts = 0;
    for (old, new) in [(&old, &new), (&new, &old)] {
        let records = [sensor_record::record_of(old, &old_name), sensor_record::record_of(new, &new_name)];
        let values = [(old.clone(), old_name), (new.clone(), new_name)];
        cuts += check(records.each_ref().map(|record| record.bytes()), values.each_ref(), |sector| {
            content(sensor_record::read(sector).map(|found| found.map(|stored| (stored.sensors, stored.name))))
        });
    }
    assert!(cuts >= 100_000, "{cuts} cuts");
}

#[test]
fn a_robot_record_is_whole_or_damaged() {
    let [old_name, new_name] = names();
    let default = RobotConfig::default_biped();
    let mut other = default;
    other.servos[0].neutral.0 += 7;
    other.gate.rate[2].0 -= 1.0;
    other.gate.pose[0] = None;
    other.gate.pose.rotate_left(1);
    let mut cuts = 0;
    for (old, new) in [(default, other), (other, default)] {
        let records = [robot_record::record_of(&old, &old_name), robot_record::record_of(&new, &new_name)];
        let values = [(old, old_name), (new, new_name)];
        cuts += check(records.each_ref().map(|record| record.bytes()), values.each_ref(), |sector| {
            content(robot_record::read(sector).map(|found| found.map(|stored| (stored.robot, stored.name))))
        });
    }
    assert!(cuts >= 100_000, "{cuts} cuts");
}
