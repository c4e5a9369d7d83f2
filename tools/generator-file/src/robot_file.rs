//! The robot file: servos, limits, park pose and least supply of a robot, in degrees, seconds, microseconds and volts.
//!
//! ```toml
//! schema = 2
//! name = "biped 2"               # 1 to 24 bytes, shown in the board's boot line
//! min_supply_v = 2.7
//! require_brown_out_reset = true # may be absent: false
//!
//! [follower]                     # when a generator that follows a person stops by itself
//! disarm_after_stand_s = 10
//! walks_again_after_lost_sensor = false
//!
//! [left_hip]                     # and so on for each joint
//! neutral_us = 1500
//! ...
//!
//! [[pose]]                       # up to 6 bounds on two joints together
//! ...
//! ```
//! `footfall defaults robot` prints the default robot in this layout. Every field is required, so that a file does not depend on the
//! defaults of the program that reads it; but for `feedback` of a joint, a share from -0.8 to 0.8 that is 0 where it is absent, and `require_brown_out_reset`, which is `false`. A file of schema 1 has no table `follower`: it is read with the numbers that every board had then, those above. Numbers are written in the shortest form that reads back to the same bits.

use std::path::Path;

use joint_loop::{
    Direction, FollowerRules, GateConfig, JointRange, LoopError, POSE_LIMITS, PoseLimit, PoseSense, RecordName,
    RobotConfig, ServoConfig,
};
use joint_units::{Joint, Period, PulseMicros, RadPerSec, RadPerSec2, Radians, Volts};
use serde::{Deserialize, Serialize};

use crate::degrees::shortest;
use crate::toml_file::{FileError, FileKind, Problem, TomlFile};
use crate::word::{self, Word};

/// Version of the layout.
pub const SCHEMA: u32 = 2;

/// The version before, without the rules of a follower.
const OLD_SCHEMA: u32 = 1;

/// How a correct file is made, for errors.
const HELP: &str = "`footfall defaults robot` prints one";

const COMMENT: &str = "\
# A robot. Angles in degrees, flexion positive; pulses in microseconds.
# pulse = neutral_us + us_per_rad * (angle - angle_at_neutral), with minus for a mirrored servo. The pulses of both ends of range_deg
# must be within shortest_us to longest_us. park_deg: the pose that motion starts from and comes back to.
# pose: up to 6 bounds on two joints together, first + second (sum) or first - second (difference).
# min_supply_v: below it no sensor sample is good; the board's own least supply holds where it is higher.
# require_brown_out_reset = true: a board whose brown-out reset is off does not arm; without the key it warns.
# follower: when a generator that follows a person stops by itself. disarm_after_stand_s, 1 to 60: after so long without a stride of the person the
# outputs go off. walks_again_after_lost_sensor: true lets it walk again by itself when a sensor that was lost for more than 5 s is good again, before
# the outputs are off by the time above; with false that takes a hold of the button.
# A joint with a sensor may have feedback = 0.3, or another share from -0.8 to 0.8: so much of its distance to its last setpoint is added to its next
# target. Above 0 the joint is stiffer, below 0 softer; without the key it is 0. The generator must not follow this joint.
";

/// Largest bound of a pose limit, without its sign.
const MOST_POSE_DEG: f32 = 257.0;

/// A robot file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobotFile {
    /// Name of the robot, and of its record on the board.
    pub name: RecordName,
    /// The robot, checked.
    pub robot: RobotConfig,
}

impl RobotFile {
    /// The default robot.
    #[must_use]
    pub fn default_biped() -> Self {
        Self { name: RecordName::cut("default biped"), robot: RobotConfig::default_biped() }
    }

    /// Reads a file, or gives the default robot where there is none.
    ///
    /// # Errors
    /// As [`RobotFile::read`].
    pub fn read_or_default(path: Option<&Path>) -> Result<Self, FileError> {
        path.map_or(Ok(Self::default_biped()), Self::read)
    }

    /// Reads a file.
    ///
    /// # Errors
    /// The first error in the file, with line and key.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        Self::of(&TomlFile::read(path)?)
    }

    /// Reads a text; `name` stands for the file in errors.
    ///
    /// # Errors
    /// As [`RobotFile::read`].
    pub fn parse(name: &str, text: &str) -> Result<Self, FileError> {
        Self::of(&TomlFile::of_text(name, text.into()))
    }

    fn of(file: &TomlFile) -> Result<Self, FileError> {
        let top = file.top(HELP)?;
        let joints = Joint::ALL.map(Joint::name);
        let old_keys = [&["schema", "name", "min_supply_v", "require_brown_out_reset", "pose"][..], &joints].concat();
        let keys = [&old_keys[..], &["follower"]].concat();
        let schema = top.layout(FileKind::Robot, &[(OLD_SCHEMA, &old_keys), (SCHEMA, &keys)])?;
        let layout: Layout = top.read()?;
        let follower = match (layout.follower, schema) {
            (Some(rules), _) => rules.rules(),
            (None, OLD_SCHEMA) => FollowerRules { disarm_after_stand_s: 10.0, walks_again_after_lost_sensor: false },
            (None, _) => top.get::<Follower>("follower")?.rules(),
        };
        let name =
            RecordName::new(&layout.name).map_err(|error| top.error("name", Problem::Rule(error.to_string())))?;
        if layout.pose.len() > POSE_LIMITS {
            return Err(top.not_allowed("pose", &format!("0 to {POSE_LIMITS} limits")));
        }
        // The gate has this bound in radians.
        let is_bound = |pose: &Pose| (-MOST_POSE_DEG..=MOST_POSE_DEG).contains(&pose.most_deg);
        if let Some(index) = layout.pose.iter().position(|pose| !is_bound(pose)) {
            let allowed = format!("a number from -{MOST_POSE_DEG} to {MOST_POSE_DEG} degrees");
            return Err(top.not_allowed(&format!("pose[{index}].most_deg"), &allowed));
        }
        let robot = layout.robot(follower);
        match robot.build(Period::MILLISECOND) {
            Ok(_) => Ok(Self { name, robot }),
            Err(error @ LoopError::NotFinite { .. }) => Err(top.not_allowed(&field_of(&error), "a finite number")),
            Err(error) => Err(top.error(&field_of(&error), Problem::Rule(error.to_string()))),
        }
    }

    /// The text of the file.
    #[must_use]
    pub fn to_toml(&self) -> String {
        // Words, numbers and tables: TOML can represent all of them.
        COMMENT.to_owned() + &toml::to_string(&Layout::of(self)).unwrap_or_default()
    }
}

/// The file, in its own units.
#[derive(Serialize, Deserialize)]
struct Layout {
    schema: u32,
    name: String,
    min_supply_v: f32,
    /// `None` is `false`.
    #[serde(skip_serializing_if = "Option::is_none")]
    require_brown_out_reset: Option<bool>,
    /// Required from schema 2 on.
    follower: Option<Follower>,
    left_hip: OneJoint,
    right_hip: OneJoint,
    left_knee: OneJoint,
    right_knee: OneJoint,
    pose: Vec<Pose>,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Follower {
    disarm_after_stand_s: f32,
    walks_again_after_lost_sensor: bool,
}

impl Follower {
    fn rules(self) -> FollowerRules {
        let Self { disarm_after_stand_s, walks_again_after_lost_sensor } = self;
        FollowerRules { disarm_after_stand_s, walks_again_after_lost_sensor }
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct OneJoint {
    range_deg: [f32; 2],
    rate_deg_per_s: f32,
    acceleration_deg_per_s2: f32,
    park_deg: f32,
    neutral_us: u16,
    angle_at_neutral_deg: f32,
    us_per_rad: f32,
    #[serde(with = "word")]
    direction: Direction,
    shortest_us: u16,
    longest_us: u16,
    /// `None` is 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    feedback: Option<f32>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Pose {
    #[serde(with = "word")]
    first: Joint,
    #[serde(with = "word")]
    second: Joint,
    #[serde(with = "word")]
    sense: PoseSense,
    most_deg: f32,
}

impl Layout {
    fn of(file: &RobotFile) -> Self {
        let RobotConfig { gate, servos, park, min_supply, follower, feedback, require_brown_out_reset } = file.robot;
        let joint = |joint: Joint| {
            let at = joint as usize;
            let (range, servo) = (gate.range[at], servos[at]);
            OneJoint {
                range_deg: [shortest(range.least), shortest(range.most)],
                rate_deg_per_s: shortest(Radians(gate.rate[at].0)),
                acceleration_deg_per_s2: shortest(Radians(gate.acceleration[at].0)),
                park_deg: shortest(park[at]),
                neutral_us: servo.neutral.0,
                angle_at_neutral_deg: shortest(servo.angle_at_neutral),
                us_per_rad: servo.micros_per_radian,
                direction: servo.direction,
                shortest_us: servo.shortest.0,
                longest_us: servo.longest.0,
                feedback: Some(feedback[at]).filter(|share| share.to_bits() != 0),
            }
        };
        let pose = |limit: PoseLimit| {
            let PoseLimit { first, second, sense, most } = limit;
            Pose { first, second, sense, most_deg: shortest(most) }
        };
        let [left_hip, right_hip, left_knee, right_knee] = Joint::ALL.map(joint);
        Self {
            schema: SCHEMA,
            name: file.name.as_str().into(),
            min_supply_v: min_supply.0,
            require_brown_out_reset: Some(true).filter(|_| require_brown_out_reset),
            follower: Some(Follower {
                disarm_after_stand_s: follower.disarm_after_stand_s,
                walks_again_after_lost_sensor: follower.walks_again_after_lost_sensor,
            }),
            left_hip,
            right_hip,
            left_knee,
            right_knee,
            pose: gate.pose.into_iter().flatten().map(pose).collect(),
        }
    }

    fn robot(self, follower: FollowerRules) -> RobotConfig {
        let joints = [self.left_hip, self.right_hip, self.left_knee, self.right_knee];
        let joints = joints.each_ref();
        let rad = Radians::from_degrees;
        let mut limits = self.pose.into_iter().map(|pose| {
            let Pose { first, second, sense, most_deg } = pose;
            PoseLimit { first, second, sense, most: rad(most_deg) }
        });
        RobotConfig {
            gate: GateConfig {
                range: joints.map(|joint| {
                    let [least, most] = joint.range_deg.map(rad);
                    JointRange { least, most }
                }),
                rate: joints.map(|joint| RadPerSec(rad(joint.rate_deg_per_s).0)),
                acceleration: joints.map(|joint| RadPerSec2(rad(joint.acceleration_deg_per_s2).0)),
                pose: [(); POSE_LIMITS].map(|()| limits.next()),
            },
            servos: joints.map(|joint| ServoConfig {
                neutral: PulseMicros(joint.neutral_us),
                angle_at_neutral: rad(joint.angle_at_neutral_deg),
                micros_per_radian: joint.us_per_rad,
                direction: joint.direction,
                shortest: PulseMicros(joint.shortest_us),
                longest: PulseMicros(joint.longest_us),
            }),
            park: joints.map(|joint| rad(joint.park_deg)),
            min_supply: Volts(self.min_supply_v),
            follower,
            feedback: joints.map(|joint| joint.feedback.unwrap_or(0.0)),
            require_brown_out_reset: self.require_brown_out_reset.unwrap_or(false),
        }
    }
}

impl Word for PoseSense {
    const WORDS: &'static [&'static str] = &["sum", "difference"];
    const VALUES: &'static [Self] = &Self::ALL;
}

impl Word for Direction {
    const WORDS: &'static [&'static str] = &["forward", "mirrored"];
    const VALUES: &'static [Self] = &Self::ALL;
}

/// The field of the file that a rule of the robot is about.
fn field_of(error: &LoopError) -> String {
    let (field, joint) = match *error {
        LoopError::NotFinite { field, joint }
        | LoopError::OutOfRange { field, joint, .. }
        | LoopError::Inverted { field, joint } => (field, joint),
        LoopError::BeyondPulses { joint, .. } => ("gate.range", Some(joint)),
        LoopError::SameJoint { index } | LoopError::ParkOutsidePose { index } => return format!("pose[{index}]"),
        _ => ("", None),
    };
    let key = match field {
        "robot.min_supply" => return "min_supply_v".into(),
        "follower.disarm_after_stand_s" => return field.into(),
        "gate.range" => "range_deg",
        "gate.range.least" => "range_deg[0]",
        "gate.range.most" => "range_deg[1]",
        "gate.rate" => "rate_deg_per_s",
        "gate.acceleration" => "acceleration_deg_per_s2",
        "blend.park" => "park_deg",
        "servos.shortest" | "servos.shortest..longest" => "shortest_us",
        "servos.longest" => "longest_us",
        "servos.neutral" => "neutral_us",
        "servos.angle_at_neutral" => "angle_at_neutral_deg",
        "servos.micros_per_radian" => "us_per_rad",
        "robot.feedback" => "feedback",
        // What a robot alone does not have.
        _ => return "schema".into(),
    };
    joint.map_or(key.into(), |joint| format!("{}.{key}", joint.name()))
}

#[cfg(test)]
mod tests;
