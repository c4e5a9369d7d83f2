//! The loop's parameters as a file: gate, servos, blend and monitor of [`joint_loop::LoopConfig`], in degrees, seconds and microseconds.
//!
//! `footfall defaults parameters` prints the default set in this layout. Every field is required, so that a file does not depend on the
//! defaults of the program that reads it.

use std::path::Path;

use generator_file::toml_file::{FileError, Problem, TomlFile};
use joint_loop::{
    BlendConfig, Direction, GateConfig, JointRange, LoopConfig, LoopError, MonitorConfig, POSE_LIMITS, PoseLimit,
    PoseSense, ServoConfig,
};
use joint_units::{Joint, PulseMicros, RadPerSec, RadPerSec2, Radians};
use serde::{Deserialize, Serialize};

use crate::board::default_loop::{self, BoardLoopError};
use crate::file::degrees::shortest;
use crate::file::word::{self, Word};

/// Version of the layout. In version 1 the table `monitor` was called `watch`.
pub const SCHEMA: u32 = 2;

/// How a correct file is made, for errors.
const HELP: &str = "`footfall defaults parameters` prints a new one";

const COMMENT: &str = "\
# Parameters of the loop. Angles in degrees, flexion positive; times in seconds; pulses in microseconds.
# range_deg: least and most angle of each joint. pose: bounds on two joints together, first + second (sum)
# or first - second (difference). park_deg: the pose that motion starts from and comes back to.
";

/// Largest bound of a pose limit, without its sign.
const MOST_POSE_DEG: f32 = 257.0;

/// Reads a file.
///
/// # Errors
/// The first error, with line and field.
pub fn read(path: &Path) -> Result<LoopConfig, FileError> {
    parse(&TomlFile::read(path)?)
}

/// Reads a text, and checks that a loop can be built with it.
///
/// # Errors
/// As [`read`].
pub fn parse(file: &TomlFile) -> Result<LoopConfig, FileError> {
    let top = file.top(HELP)?;
    top.layout(&[(SCHEMA, &["schema", "gate", "servos", "blend", "monitor"])])?;
    let layout: Layout = top.read()?;
    let poses = &layout.gate.pose;
    if poses.len() > POSE_LIMITS {
        return Err(top.not_allowed("gate.pose", &format!("0 to {POSE_LIMITS} limits")));
    }
    // The loop has this bound in radians.
    if let Some(index) = poses.iter().position(|pose| !(-MOST_POSE_DEG..=MOST_POSE_DEG).contains(&pose.most_deg)) {
        let allowed = format!("a number from -{MOST_POSE_DEG} to {MOST_POSE_DEG} degrees");
        return Err(top.not_allowed(&format!("gate.pose[{index}].most_deg"), &allowed));
    }
    let config = layout.config();
    match default_loop::loop_with(&config) {
        Ok(_) => Ok(config),
        Err(BoardLoopError::Loop(error @ LoopError::NotFinite { .. })) => {
            Err(top.not_allowed(&field_of(&error), "a finite number"))
        }
        Err(BoardLoopError::Loop(error)) => Err(top.error(&field_of(&error), Problem::Rule(error.to_string()))),
        // Not an error of the file: the default sensor and walk do not depend on it.
        Err(other) => Err(top.error("schema", Problem::Rule(other.to_string()))),
    }
}

/// The text of a file.
#[must_use]
pub fn to_text(config: &LoopConfig) -> String {
    // Words, numbers and tables: TOML can represent all of them.
    COMMENT.to_owned() + &toml::to_string(&Layout::of(config)).unwrap_or_default()
}

/// The file, in its own units.
#[derive(Serialize, Deserialize)]
struct Layout {
    schema: u32,
    gate: Gate,
    servos: PerJoint<Servo>,
    blend: Blend,
    #[serde(with = "Monitor")]
    monitor: MonitorConfig,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PerJoint<T> {
    left_hip: T,
    right_hip: T,
    left_knee: T,
    right_knee: T,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Gate {
    rate_deg_per_s: f32,
    acceleration_deg_per_s2: f32,
    range_deg: PerJoint<[f32; 2]>,
    pose: Vec<Pose>,
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

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Servo {
    neutral_us: u16,
    angle_at_neutral_deg: f32,
    us_per_rad: f32,
    #[serde(with = "word")]
    direction: Direction,
    shortest_us: u16,
    longest_us: u16,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Blend {
    ramp_s: f32,
    stop_s: f32,
    hurry_s: f32,
    park_deg: PerJoint<f32>,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "MonitorConfig", deny_unknown_fields)]
struct Monitor {
    sensor_required: bool,
    sensor_tolerance_s: f32,
    pose_tolerance_s: f32,
    stop_gap_s: f32,
    fault_gap_s: f32,
    overruns_per_s: u32,
    debounce_s: f32,
}

impl<T> PerJoint<T> {
    fn of<A>(array: [A; Joint::COUNT], form: impl Fn(A) -> T) -> Self {
        let [left_hip, right_hip, left_knee, right_knee] = array.map(form);
        Self { left_hip, right_hip, left_knee, right_knee }
    }

    fn array<A>(self, value: impl Fn(T) -> A) -> [A; Joint::COUNT] {
        [self.left_hip, self.right_hip, self.left_knee, self.right_knee].map(value)
    }
}

impl Layout {
    fn of(config: &LoopConfig) -> Self {
        // The channel of the gait sensor belongs to the sensor file.
        let LoopConfig { gate, servos, blend, monitor, gait_sensor: _ } = *config;
        let pose = |limit: PoseLimit| {
            let PoseLimit { first, second, sense, most } = limit;
            Pose { first, second, sense, most_deg: shortest(most) }
        };
        Self {
            schema: SCHEMA,
            gate: Gate {
                rate_deg_per_s: shortest(Radians(gate.rate.0)),
                acceleration_deg_per_s2: shortest(Radians(gate.acceleration.0)),
                range_deg: PerJoint::of(gate.range, |range| [shortest(range.least), shortest(range.most)]),
                pose: gate.pose.into_iter().flatten().map(pose).collect(),
            },
            servos: PerJoint::of(servos, |servo| Servo {
                neutral_us: servo.neutral.0,
                angle_at_neutral_deg: shortest(servo.angle_at_neutral),
                us_per_rad: servo.micros_per_radian,
                direction: servo.direction,
                shortest_us: servo.shortest.0,
                longest_us: servo.longest.0,
            }),
            blend: Blend {
                ramp_s: blend.ramp_s,
                stop_s: blend.stop_s,
                hurry_s: blend.hurry_s,
                park_deg: PerJoint::of(blend.park, shortest),
            },
            monitor,
        }
    }

    fn config(self) -> LoopConfig {
        let Self { schema: _, gate, servos, blend: Blend { ramp_s, stop_s, hurry_s, park_deg }, monitor } = self;
        let rad = Radians::from_degrees;
        let mut limits = gate.pose.into_iter().map(|pose| {
            let Pose { first, second, sense, most_deg } = pose;
            PoseLimit { first, second, sense, most: rad(most_deg) }
        });
        LoopConfig {
            gate: GateConfig {
                rate: RadPerSec(rad(gate.rate_deg_per_s).0),
                acceleration: RadPerSec2(rad(gate.acceleration_deg_per_s2).0),
                range: gate.range_deg.array(|[least, most]| JointRange { least: rad(least), most: rad(most) }),
                pose: [(); POSE_LIMITS].map(|()| limits.next()),
            },
            servos: servos.array(|servo| ServoConfig {
                neutral: PulseMicros(servo.neutral_us),
                angle_at_neutral: rad(servo.angle_at_neutral_deg),
                micros_per_radian: servo.us_per_rad,
                direction: servo.direction,
                shortest: PulseMicros(servo.shortest_us),
                longest: PulseMicros(servo.longest_us),
            }),
            blend: BlendConfig { park: park_deg.array(rad), ramp_s, stop_s, hurry_s },
            monitor,
            ..LoopConfig::default_biped()
        }
    }
}

impl Word for PoseSense {
    const WORDS: &'static [&'static str] = &["sum", "difference"];
    const VALUES: &'static [Self] = &[Self::Sum, Self::Difference];
}

impl Word for Direction {
    const WORDS: &'static [&'static str] = &["forward", "mirrored"];
    const VALUES: &'static [Self] = &[Self::Forward, Self::Mirrored];
}

/// The field of the file that a rule of the loop is about.
fn field_of(error: &LoopError) -> String {
    let (field, joint) = match *error {
        LoopError::NotFinite { field, joint }
        | LoopError::OutOfRange { field, joint, .. }
        | LoopError::Inverted { field, joint } => (field, joint),
        LoopError::BeyondPulses { joint, .. } => ("gate.range", Some(joint)),
        LoopError::SameJoint { index } | LoopError::ParkOutsidePose { index } => return format!("gate.pose[{index}]"),
        LoopError::Park => ("blend.park", None),
        LoopError::NoSensor => ("monitor.sensor_required", None),
        // The generator is not in the file.
        _ => ("schema", None),
    };
    let of = |path: &str| joint.map_or(path.to_owned(), |joint| format!("{path}.{}", joint.name()));
    let servo = |name: &str| format!("{}.{name}", of("servos"));
    match field {
        "gate.rate" => "gate.rate_deg_per_s".into(),
        "gate.acceleration" => "gate.acceleration_deg_per_s2".into(),
        "gate.range" => of("gate.range_deg"),
        "gate.range.least" => of("gate.range_deg") + "[0]",
        "gate.range.most" => of("gate.range_deg") + "[1]",
        "blend.park" => of("blend.park_deg"),
        "servos.shortest" | "servos.shortest..longest" => servo("shortest_us"),
        "servos.longest" => servo("longest_us"),
        "servos.neutral" => servo("neutral_us"),
        "servos.angle_at_neutral" => servo("angle_at_neutral_deg"),
        "servos.micros_per_radian" => servo("us_per_rad"),
        "monitor.stop_gap_s..fault_gap_s" => "monitor.stop_gap_s".into(),
        same => same.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn parsed(text: String) -> Result<LoopConfig, FileError> {
        parse(&TomlFile::of_text("loop.toml", text))
    }

    #[test]
    fn the_default_set_is_written_and_read_back_bit_for_bit() {
        let default = LoopConfig::default_biped();
        assert_eq!(parsed(to_text(&default)), Ok(default));
        let mut bare = default;
        bare.gate.pose = [None; POSE_LIMITS];
        assert_eq!(parsed(to_text(&bare)), Ok(bare));
    }

    #[test]
    fn rules_of_the_loop_name_the_line_of_the_file() {
        let default = to_text(&LoopConfig::default_biped());
        for (from, to, field) in [
            ("rate_deg_per_s = 500.0", "rate_deg_per_s = 5000", "gate.rate_deg_per_s"),
            ("acceleration_deg_per_s2 = 20000.0", "acceleration_deg_per_s2 = 1", "gate.acceleration_deg_per_s2"),
            ("left_hip = [-30.0, 60.0]", "left_hip = [-31, 60]", "gate.range_deg.left_hip[0]"),
            ("right_knee = [-2.0, 120.0]", "right_knee = [60, 60]", "gate.range_deg.right_knee"),
            ("left_knee = 5.0", "left_knee = 130", "blend.park_deg.left_knee"),
            ("ramp_s = 2.0", "ramp_s = 0.1", "blend.ramp_s"),
            ("hurry_s = 0.3", "hurry_s = 3", "blend.hurry_s"),
            ("stop_gap_s = 0.005", "stop_gap_s = 0.05", "monitor.stop_gap_s"),
            ("debounce_s = 0.02", "debounce_s = 2", "monitor.debounce_s"),
            ("neutral_us = 1500", "neutral_us = 2600", "servos.left_hip.neutral_us"),
            ("shortest_us = 500", "shortest_us = 400", "servos.left_hip.shortest_us"),
            ("us_per_rad = 636.62", "us_per_rad = 63.662", "servos.left_hip.us_per_rad"),
            ("second = \"right_knee\"", "second = \"left_knee\"", "gate.pose[0]"),
            ("most_deg = 150.0", "most_deg = 5", "gate.pose[0]"),
        ] {
            let at = default.find(from).unwrap_or_else(|| panic!("{from} is not in the file"));
            let text = format!("{}{to}{}", &default[..at], &default[at + from.len()..]);
            let error = parsed(text).unwrap_err();
            assert_eq!(error.field.as_deref(), Some(field), "{to}: {error}");
            // A limit on a pose is a table: the line where it begins is two or more above.
            let line = default[..at].matches('\n').count() + 1;
            let found = error.line.unwrap();
            assert!(if field == "gate.pose[0]" { line - found <= 4 } else { line == found }, "{line}: {error}");
            assert!(matches!(error.problem, Problem::Rule(_)), "{error}");
        }
    }

    #[test]
    fn a_file_of_schema_1_is_an_old_file() {
        let old =
            to_text(&LoopConfig::default_biped()).replace("schema = 2", "schema = 1").replace("[monitor]", "[watch]");
        let error = parsed(old).unwrap_err().to_string();
        let expected = "loop.toml:4: field `schema`: is 1: this is an old file; allowed is 2, the version of this file's \
                        layout: `footfall defaults parameters` prints a new one";
        assert_eq!(error, expected);
    }

    proptest! {
        #[test]
        fn what_is_good_is_read_back_bit_for_bit(
            least in -29.0_f32..-10.0, most in 30.0_f32..90.0, rate in 100.0_f32..900.0, ramp in 0.5_f32..30.0, park in 0.0_f32..5.0,
        ) {
            let mut config = LoopConfig::default_biped();
            config.gate.range[0] = JointRange { least: Radians::from_degrees(least), most: Radians::from_degrees(most) };
            config.gate.rate = RadPerSec(Radians::from_degrees(rate).0);
            config.blend.ramp_s = ramp;
            config.blend.park[1] = Radians::from_degrees(park);
            prop_assume!(crate::board::default_loop::loop_with(&config).is_ok());
            prop_assert_eq!(parsed(to_text(&config)), Ok(config));
        }

        #[test]
        fn junk_never_panics(text in "(schema|gate|=|1|\\[|\\]|\n|\"| |-|nan|\\{|\\}|\\.|,){0,40}") {
            let _ = parsed(text);
        }
    }
}
