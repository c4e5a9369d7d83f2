//! The robot record: a robot as bytes. A host writes it to the board's third parameter sector, the board reads it at boot. A board without
//! one runs [`RobotConfig::default_biped`].
//!
//! The format is that of [`crate::store::flash_record`] with the magic word "FFRB" and kind 1, or 2 if a joint has feedback: a program that does not
//! know feedback refuses the record. Numbers are the bits of `f32`, in SI units:
//! ```text
//! least supply      V
//! stand             s, after which a follower without a stride of its person disarms
//! rules             bits, 0 to 3:
//!                   1: after a lost sensor a follower walks again by itself
//!                   2: a board whose brown-out reset is off does not arm. A program that does not know this bit refuses the record
//! of each joint, in the order of Joint::ALL:
//!   least, most     range, rad
//!   rate            rad/s
//!   acceleration    rad/s^2
//!   park            angle of the park pose, rad
//!   neutral         us, an integer
//!   at neutral      angle at the neutral pulse, rad
//!   scale           us/rad
//!   direction       0 forward, 1 mirrored
//!   shortest        us, an integer
//!   longest         us, an integer
//! in kind 2, of each joint, not all 0:
//!   feedback        share of the distance to the last setpoint that is added to the next target, no unit
//! of each pose limit, 0 to 6:
//!   first, second   indices in Joint::ALL
//!   sense           0 sum, 1 difference
//!   most            rad
//! ```

use core::fmt;

use joint_units::{Joint, Period, PulseMicros, RadPerSec, RadPerSec2, Radians, Volts};

use crate::error::LoopError;
use crate::setup::robot::{Direction, GateConfig, JointRange, POSE_LIMITS, PoseLimit, PoseSense, ServoConfig};
use crate::setup::robot_config::{FollowerRules, RobotConfig};
use crate::store::flash_record::{FlashRecordError, Framed, WordError, WordReader, bytes_of, choice, open};
use crate::store::record_name::RecordName;

/// Bytes of the longest record.
pub const MAX_BYTES: usize = bytes_of(MAX_WORDS);

/// First bytes of a record.
pub const MAGIC: [u8; 4] = *b"FFRB";
const SCHEMA: u16 = 2;
/// A robot without feedback, and one with it.
const KIND: u16 = 1;
const FEEDBACK_KIND: u16 = 2;
/// Words before those of the joints.
const HEAD_WORDS: usize = 3;
/// Words of a robot without pose limits and feedback.
const JOINT_WORDS: usize = HEAD_WORDS + 11 * Joint::COUNT;
const POSE_WORDS: usize = 4;
const MAX_WORDS: usize = JOINT_WORDS + Joint::COUNT + POSE_WORDS * POSE_LIMITS;

/// Why a sector has no robot record, although it is not erased.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum RobotRecordError {
    /// It has no complete record.
    Frame(FlashRecordError),
    /// A word that is an integer or an index is too large.
    Word {
        /// Name of the word.
        field: &'static str,
        /// The word.
        word: u32,
        /// The largest word that is allowed.
        most: u32,
    },
    /// Every feedback of a record of a robot with feedback is 0.
    NoFeedback,
    /// The robot is not allowed.
    Robot(LoopError),
}

impl fmt::Display for RobotRecordError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Frame(error @ (FlashRecordError::Schema { .. } | FlashRecordError::Kind { .. })) => {
                write!(f, "{error}; make the record again with `footfall pack --robot`")
            }
            Self::Frame(error) => write!(f, "{error}"),
            Self::Word { field, word, most } => write!(f, "{field} is {word}; allowed is 0 to {most}"),
            Self::NoFeedback => f.write_str(
                "kind 2 is of a robot with feedback, and every feedback is 0; allowed is one that is not: make the record again with `footfall pack --robot`",
            ),
            Self::Robot(error) => write!(f, "{error}"),
        }
    }
}

impl core::error::Error for RobotRecordError {}

impl From<FlashRecordError> for RobotRecordError {
    fn from(error: FlashRecordError) -> Self {
        Self::Frame(error)
    }
}

impl From<WordError> for RobotRecordError {
    fn from(error: WordError) -> Self {
        match error {
            WordError::Record(error) => Self::Frame(error),
            WordError::Choice { field, word, most } => Self::Word { field, word, most },
        }
    }
}

/// A robot record.
pub type Record = Framed<MAX_BYTES>;

/// A robot read from a record, with the name and the checksum that identify it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stored {
    /// The robot, checked.
    pub robot: RobotConfig,
    /// Name of the record.
    pub name: RecordName,
    /// Checksum of the record.
    pub crc: u32,
}

/// Makes the record of a robot. Its pose limits are stored without gaps between them.
#[must_use]
pub fn record_of(robot: &RobotConfig, name: &RecordName) -> Record {
    let RobotConfig { gate, servos, park, min_supply, follower, feedback, require_brown_out_reset } = robot;
    let has_feedback = *feedback != [0.0; Joint::COUNT];
    let kind = if has_feedback { FEEDBACK_KIND } else { KIND };
    Record::new(MAGIC, SCHEMA, kind, name, |record| {
        record.floats(&[min_supply.0, follower.disarm_after_stand_s]);
        record.push(u32::from(follower.walks_again_after_lost_sensor) | u32::from(*require_brown_out_reset) << 1);
        let limits = gate.range.iter().zip(&gate.rate).zip(&gate.acceleration);
        for (((range, rate), acceleration), (servo, park)) in limits.zip(servos.iter().zip(park)) {
            record.floats(&[range.least.0, range.most.0, rate.0, acceleration.0, park.0]);
            record.push(servo.neutral.0.into());
            record.floats(&[servo.angle_at_neutral.0, servo.micros_per_radian]);
            record.push(servo.direction as u32);
            record.push(servo.shortest.0.into());
            record.push(servo.longest.0.into());
        }
        if has_feedback {
            record.floats(feedback);
        }
        for limit in gate.pose.iter().flatten() {
            record.push(limit.first as u32);
            record.push(limit.second as u32);
            record.push(limit.sense as u32);
            record.floats(&[limit.most.0]);
        }
    })
}

/// Reads the record of a sector; `None` if all of the sector is erased.
///
/// ```
/// use joint_loop::store::robot_record::{read, record_of};
/// use joint_loop::{RecordName, RobotConfig};
/// let (robot, name) = (RobotConfig::default_biped(), RecordName::new("biped").unwrap());
/// let record = record_of(&robot, &name);
/// let stored = read(record.bytes())?.unwrap();
/// assert_eq!((stored.robot, stored.name, stored.crc), (robot, name, record.crc()));
/// assert_eq!(read(&[0xFF; 64]), Ok(None));
/// assert!(read(b"FFSN, sensors").unwrap_err().to_string().contains("begins with FFRB"));
/// # Ok::<(), joint_loop::store::robot_record::RobotRecordError>(())
/// ```
///
/// # Errors
/// [`RobotRecordError`]; also if the robot is not allowed at a period of 1 ms.
pub fn read(sector: &[u8]) -> Result<Option<Stored>, RobotRecordError> {
    let is_known = |kind, words: u32| {
        let others = match kind {
            KIND => JOINT_WORDS,
            FEEDBACK_KIND => JOINT_WORDS + Joint::COUNT,
            _ => return false,
        };
        let poses = (words as usize).checked_sub(others);
        poses.is_some_and(|words| words % POSE_WORDS == 0 && words <= POSE_WORDS * POSE_LIMITS)
    };
    let Some(mut found) = open(sector, MAGIC, SCHEMA, is_known)? else { return Ok(None) };
    let mut robot = RobotConfig::default_biped();
    robot.min_supply = Volts(found.words.float()?);
    let disarm_after_stand_s = found.words.float()?;
    let rules = [(false, false), (true, false), (false, true), (true, true)];
    let (walks_again_after_lost_sensor, required) = choice(&mut found.words, "the word of the rules", &rules)?;
    robot.follower = FollowerRules { disarm_after_stand_s, walks_again_after_lost_sensor };
    robot.require_brown_out_reset = required;
    let GateConfig { range, rate, acceleration, pose } = &mut robot.gate;
    let limits = range.iter_mut().zip(rate).zip(acceleration);
    for (((range, rate), acceleration), (servo, park)) in limits.zip(robot.servos.iter_mut().zip(&mut robot.park)) {
        let [least, most, radians_per_second, radians_per_second2, angle] = found.words.floats()?;
        *range = JointRange { least: Radians(least), most: Radians(most) };
        *rate = RadPerSec(radians_per_second);
        *acceleration = RadPerSec2(radians_per_second2);
        *park = Radians(angle);
        *servo = servo_of(&mut found.words)?;
    }
    if found.kind == FEEDBACK_KIND {
        robot.feedback = found.words.floats()?;
        if robot.feedback == [0.0; Joint::COUNT] {
            return Err(RobotRecordError::NoFeedback);
        }
    }
    for limit in pose.iter_mut() {
        *limit = if found.words.is_empty() { None } else { Some(pose_of(&mut found.words)?) };
    }
    robot.build(Period::MILLISECOND).map_err(RobotRecordError::Robot)?;
    Ok(Some(Stored { robot, name: found.name, crc: found.crc }))
}

fn servo_of(words: &mut WordReader<'_>) -> Result<ServoConfig, RobotRecordError> {
    let neutral = micros(words, "neutral")?;
    let [angle_at_neutral, micros_per_radian] = words.floats()?;
    Ok(ServoConfig {
        neutral,
        angle_at_neutral: Radians(angle_at_neutral),
        micros_per_radian,
        direction: choice(words, "direction", &Direction::ALL)?,
        shortest: micros(words, "shortest")?,
        longest: micros(words, "longest")?,
    })
}

fn pose_of(words: &mut WordReader<'_>) -> Result<PoseLimit, RobotRecordError> {
    Ok(PoseLimit {
        first: choice(words, "first joint of a pose limit", &Joint::ALL)?,
        second: choice(words, "second joint of a pose limit", &Joint::ALL)?,
        sense: choice(words, "sense of a pose limit", &PoseSense::ALL)?,
        most: Radians(words.float()?),
    })
}

fn micros(words: &mut WordReader<'_>, field: &'static str) -> Result<PulseMicros, RobotRecordError> {
    let word = words.word()?;
    let micros = u16::try_from(word).map_err(|_| RobotRecordError::Word { field, word, most: u16::MAX.into() })?;
    Ok(PulseMicros(micros))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    const NAME: RecordName = RecordName::literal("a test");

    /// A robot that differs from the default one in every number.
    fn other() -> RobotConfig {
        let mut robot = RobotConfig::default_biped();
        robot.min_supply = Volts(2.9);
        robot.follower = FollowerRules { disarm_after_stand_s: 12.5, walks_again_after_lost_sensor: true };
        for joint in 0..Joint::COUNT {
            let more = joint as f32 * 0.01;
            robot.gate.range[joint].least.0 += 0.02 + more;
            robot.gate.range[joint].most.0 -= 0.03 + more;
            robot.gate.rate[joint].0 -= 0.1 + more;
            robot.gate.acceleration[joint].0 += 1.0 + more;
            robot.park[joint].0 += 0.04 + more;
            let servo = &mut robot.servos[joint];
            let neutral = 1_501 + joint as u16;
            servo.neutral = PulseMicros(neutral);
            servo.angle_at_neutral.0 += more - 0.005;
            servo.micros_per_radian = 601.5 + more;
            servo.direction = Direction::ALL[usize::from(servo.direction == Direction::Forward)];
            (servo.shortest, servo.longest) = (PulseMicros(neutral - 1_000), PulseMicros(neutral + 990));
        }
        robot.gate.pose[1] = Some(PoseLimit {
            first: Joint::RightKnee,
            second: Joint::LeftHip,
            sense: PoseSense::Sum,
            most: Radians(2.5),
        });
        robot.gate.pose[4] = None;
        robot
    }

    /// The same with feedback, other at each joint.
    fn with_feedback() -> RobotConfig {
        RobotConfig { feedback: [-0.8, 0.0, 0.3, 0.8], ..other() }
    }

    /// Both rules in one word, each with its own bit: a record of before, which has the first alone, is read as it was.
    #[test]
    fn the_rules_have_a_bit_each() {
        for (word, walks_again, required) in [(0, false, false), (1, true, false), (2, false, true), (3, true, true)] {
            let mut robot = RobotConfig { require_brown_out_reset: required, ..RobotConfig::default_biped() };
            robot.follower.walks_again_after_lost_sensor = walks_again;
            let record = record_of(&robot, &NAME);
            assert_eq!(words_of(&record)[2], word);
            assert_eq!(read(record.bytes()).expect("whole").expect("there").robot, robot);
        }
    }

    fn of_words(words: &[u32]) -> Record {
        of_kind(KIND, words)
    }

    fn of_kind(kind: u16, words: &[u32]) -> Record {
        Record::new(MAGIC, SCHEMA, kind, &NAME, |record| words.iter().for_each(|word| record.push(*word)))
    }

    fn words_of(record: &Record) -> Vec<u32> {
        let bytes = record.bytes();
        bytes[36..bytes.len() - 8].chunks(4).map(|word| u32::from_le_bytes(word.try_into().expect("four"))).collect()
    }

    #[test]
    fn a_robot_is_read_back_and_a_changed_bit_is_found() {
        for robot in [RobotConfig::default_biped(), other(), with_feedback()] {
            let record = record_of(&robot, &NAME);
            let stored = read(record.bytes()).expect("whole").expect("there");
            assert_eq!(stored, Stored { robot, name: NAME, crc: record.crc() });
            let bytes = record.bytes();
            for bit in 0..bytes.len() * 8 {
                let mut changed = bytes.to_vec();
                changed[bit / 8] ^= 1 << (bit % 8);
                assert!(read(&changed).is_err(), "bit {bit}");
            }
        }
        // Every word of the other robot differs, so that none is left out.
        let [default, other] = [RobotConfig::default_biped(), other()].map(|robot| words_of(&record_of(&robot, &NAME)));
        let same: Vec<usize> = (0..JOINT_WORDS).filter(|place| default[*place] == other[*place]).collect();
        assert!(same.is_empty(), "{same:?}");
        assert_eq!((default.len(), other.len()), (JOINT_WORDS + 5 * POSE_WORDS, JOINT_WORDS + 4 * POSE_WORDS));
    }

    #[test]
    fn the_lists_have_the_order_of_the_record() {
        for place in 0..2 {
            assert_eq!((Direction::ALL[place] as usize, PoseSense::ALL[place] as usize), (place, place));
        }
    }

    /// Wrong words with a correct checksum.
    #[test]
    fn each_wrong_word_is_named() {
        let good = words_of(&record_of(&RobotConfig::default_biped(), &NAME));
        let refusal = |place: usize, word: u32| {
            let mut words = good.clone();
            words[place] = word;
            read(of_words(&words).bytes()).expect_err("wrong").to_string()
        };
        let nan = f32::NAN.to_bits();
        for (place, word, words) in [
            (0, 1.0_f32.to_bits(), "robot.min_supply is 1 V; allowed are 1.8 to 3.6 V"),
            (1, 61.0_f32.to_bits(), "follower.disarm_after_stand_s is 61 s; allowed are 1 to 60 s"),
            (1, nan, "follower.disarm_after_stand_s is not a finite number"),
            (2, 4, "the word of the rules is 4; allowed is 0 to 3"),
            (HEAD_WORDS, nan, "gate.range.least[left_hip] is not a finite number"),
            (14 + 1, 9.0_f32.to_bits(), "gate.range.most[right_hip] is 515.662 deg"),
            (25 + 2, 0, "gate.rate[left_knee] is 0 deg/s"),
            (36 + 3, nan, "gate.acceleration[right_knee] is not"),
            (7, 2.0_f32.to_bits(), "blend.park[left_hip] is 114.592 deg; allowed are -30 to 60 deg"),
            (8, 70_000, "neutral is 70000; allowed is 0 to 65535"),
            (8, 2_600, "servos.neutral[left_hip] is 2600 us; allowed are 500 to 2500 us"),
            (9, nan, "servos.angle_at_neutral[left_hip] is not"),
            (10, 0, "servos.micros_per_radian[left_hip] is 0 us/rad; allowed are 100 to 2000 us/rad"),
            (11, 2, "direction is 2; allowed is 0 to 1"),
            (12, 499, "servos.shortest[left_hip] is 499 us"),
            (13, 2_501, "servos.longest[left_hip] is 2501 us"),
            (JOINT_WORDS, 4, "first joint of a pose limit is 4; allowed is 0 to 3"),
            (JOINT_WORDS, 3, "gate.pose[0] must name two different joints"),
            (JOINT_WORDS + 2, 7, "sense of a pose limit is 7; allowed is 0 to 1"),
            (JOINT_WORDS + 3, nan, "gate.pose.most is not a finite number"),
        ] {
            let error = refusal(place, word);
            assert!(error.starts_with(words), "{place}: {error}");
        }
        let seven = [good.clone(), good[JOINT_WORDS..JOINT_WORDS + 8].to_vec()].concat();
        let longest: &[u32] = &seven[..MAX_WORDS - Joint::COUNT];
        assert!(read(of_words(longest).bytes()).is_ok());
        assert!(matches!(
            read(of_words(&good[..good.len() - 1]).bytes()),
            Err(RobotRecordError::Frame(FlashRecordError::Kind { kind: KIND, .. }))
        ));
    }

    /// The feedback stands between the joints and the pose limits, and only in a record of a robot that has some.
    #[test]
    fn feedback_has_a_kind_of_its_own() {
        let (without, with) = (words_of(&record_of(&other(), &NAME)), words_of(&record_of(&with_feedback(), &NAME)));
        let feedback = with_feedback().feedback.map(f32::to_bits);
        assert_eq!(with, [&without[..JOINT_WORDS], &feedback, &without[JOINT_WORDS..]].concat());
        let read_as = |kind, words: &[u32]| read(of_kind(kind, words).bytes());
        let robot = |found: Result<Option<Stored>, RobotRecordError>| found.expect("whole").expect("there").robot;
        assert_eq!((robot(read_as(1, &without)), robot(read_as(2, &with))), (other(), with_feedback()));
        // A zero of either sign is none.
        let signed = RobotConfig { feedback: [0.0, -0.0, 0.0, -0.0], ..other() };
        assert_eq!(record_of(&signed, &NAME).bytes(), record_of(&other(), &NAME).bytes());
        for (place, word, words) in [
            (0, (-0.9_f32).to_bits(), "robot.feedback[left_hip] is -0.9; allowed are -0.8 to 0.8"),
            (3, f32::NAN.to_bits(), "robot.feedback[right_knee] is not a finite number"),
        ] {
            let mut wrong = with.clone();
            wrong[JOINT_WORDS + place] = word;
            assert_eq!(read_as(2, &wrong).expect_err(words).to_string(), words);
        }
        for zero in [0.0_f32, -0.0] {
            let mut none = with.clone();
            none[JOINT_WORDS..JOINT_WORDS + Joint::COUNT].fill(zero.to_bits());
            assert_eq!(read_as(2, &none), Err(RobotRecordError::NoFeedback));
        }
        // The words of the one kind as the other: the number of words is allowed, what they say is not.
        assert!(read_as(1, &with).is_err() && read_as(2, &without).is_err());
        assert!(matches!(read_as(3, &with), Err(RobotRecordError::Frame(FlashRecordError::Kind { kind: 3, .. }))));
    }

    /// A record of the schema before, which had no rules of a follower: the board stays off, and the words say how the record is made again.
    #[test]
    fn a_record_of_the_schema_before_is_refused() {
        let new = words_of(&record_of(&RobotConfig::default_biped(), &NAME));
        let old = [&new[..1], &new[HEAD_WORDS..]].concat();
        let record = Record::new(MAGIC, 1, KIND, &NAME, |record| old.iter().for_each(|word| record.push(*word)));
        let error = read(record.bytes()).expect_err("old").to_string();
        assert!(
            error.contains("schema 1") && error.ends_with("make the record again with `footfall pack --robot`"),
            "{error}"
        );
    }

    proptest! {
        #[test]
        fn no_words_panic(words in prop::collection::vec(any::<u32>(), 0..80), places in prop::collection::vec((0..JOINT_WORDS, any::<u32>()), 0..4)) {
            let _ = read(of_words(&words).bytes());
            let mut near = words_of(&record_of(&other(), &NAME));
            for (place, word) in places {
                near[place] = word;
            }
            let _ = read(of_words(&near).bytes());
            let _ = read(of_kind(FEEDBACK_KIND, &near).bytes());
            let _ = read(of_kind(FEEDBACK_KIND, &words).bytes());
        }
    }
}
