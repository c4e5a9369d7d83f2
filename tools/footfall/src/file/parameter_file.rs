//! The loop's parameters as a file: gate, servos, blend and monitor of [`joint_loop::LoopConfig`], in degrees, seconds and microseconds.
//!
//! `footfall defaults parameters` prints the default set in this layout. Every field is required, so that a file does not depend on the
//! defaults of the program that reads it.

use crate::board::default_loop::BoardLoopError;
use crate::file::degrees;
use generator_file::toml_table::{Document, FileError, Problem, Section};
use joint_loop::{
    BlendConfig, Direction, GateConfig, JointRange, LoopConfig, LoopError, MonitorConfig, POSE_LIMITS, PoseLimit,
    PoseSense, ServoConfig,
};
use joint_units::{Joint, PulseMicros, RadPerSec, RadPerSec2, Radians};
use std::fmt::Write as _;
use std::path::Path;

/// Version of the layout.
pub const SCHEMA: u32 = 1;

const JOINTS: [&str; Joint::COUNT] = ["left_hip", "right_hip", "left_knee", "right_knee"];
const SENSES: [(&str, PoseSense); 2] = [("sum", PoseSense::Sum), ("difference", PoseSense::Difference)];
const DIRECTIONS: [(&str, Direction); 2] = [("forward", Direction::Forward), ("mirrored", Direction::Mirrored)];
const SERVO: [&str; 6] = ["neutral_us", "angle_at_neutral_deg", "us_per_rad", "direction", "shortest_us", "longest_us"];
const MONITOR: [&str; 7] = [
    "sensor_required",
    "sensor_tolerance_s",
    "pose_tolerance_s",
    "stop_gap_s",
    "fault_gap_s",
    "overruns_per_s",
    "debounce_s",
];

/// Range of all numbers here; the loop checks the exact ranges.
const SENSIBLE: (f32, f32) = (-1e6, 1e6);

/// Reads a file.
///
/// # Errors
/// The first error, with line and field.
pub fn read(path: &Path) -> Result<LoopConfig, FileError> {
    parse(&Document::read(path)?)
}

/// Reads a text, and checks that a loop can be built with it.
///
/// # Errors
/// As [`read`].
pub fn parse(document: &Document) -> Result<LoopConfig, FileError> {
    let tree = document.parse()?;
    let top = document.top(tree.get_ref(), &["schema", "gate", "servos", "blend", "monitor"])?;
    top.schema(SCHEMA)?;
    let config = LoopConfig {
        gate: gate(&top)?,
        servos: servos(&top)?,
        blend: blend(&top)?,
        monitor: monitor(&top)?,
        ..LoopConfig::default_biped()
    };
    match crate::board::default_loop::loop_with(&config) {
        Ok(_) => Ok(config),
        Err(BoardLoopError::Loop(error)) => Err(document.at(&field_of(&error), Problem::Rule(error.to_string()))),
        // Not an error of the file: the default sensor and walk do not depend on it.
        Err(other) => Err(document.at("schema", Problem::Rule(other.to_string()))),
    }
}

fn sensible(section: &Section<'_>, key: &str) -> Result<f32, FileError> {
    section.number(key, SENSIBLE.0, SENSIBLE.1, "")
}

fn gate(top: &Section<'_>) -> Result<GateConfig, FileError> {
    let gate = top.table("gate", &["rate_deg_per_s", "acceleration_deg_per_s2", "range_deg", "pose"])?;
    let in_radians = |key: &str| Ok::<f32, FileError>(Radians::from_degrees(sensible(&gate, key)?).0);
    let ranges = gate.table("range_deg", &JOINTS)?;
    let mut range = [JointRange { least: Radians(0.0), most: Radians(0.0) }; Joint::COUNT];
    for (range, joint) in range.iter_mut().zip(JOINTS) {
        let (least, most) = ranges.pair(joint, -180.0, 180.0, " degrees")?;
        *range = JointRange { least: Radians::from_degrees(least), most: Radians::from_degrees(most) };
    }
    let limits = gate.tables("pose", &["first", "second", "sense", "most_deg"])?;
    let mut pose = [None; POSE_LIMITS];
    if limits.len() > pose.len() {
        return Err(
            gate.error_at("pose", Problem::Rule(format!("{} limits; allowed are 0 to {POSE_LIMITS}", limits.len())))
        );
    }
    let joints: Vec<(&str, Joint)> = JOINTS.into_iter().zip(Joint::ALL).collect();
    for (slot, limit) in pose.iter_mut().zip(&limits) {
        let most = limit.number("most_deg", -257.0, 257.0, " degrees")?;
        *slot = Some(PoseLimit {
            first: limit.word("first", &joints)?,
            second: limit.word("second", &joints)?,
            sense: limit.word("sense", &SENSES)?,
            most: Radians::from_degrees(most),
        });
    }
    Ok(GateConfig {
        range,
        pose,
        rate: RadPerSec(in_radians("rate_deg_per_s")?),
        acceleration: RadPerSec2(in_radians("acceleration_deg_per_s2")?),
    })
}

fn servos(top: &Section<'_>) -> Result<[ServoConfig; Joint::COUNT], FileError> {
    let servos = top.table("servos", &JOINTS)?;
    let mut configs = [ServoConfig::hobby(Radians(0.0), Direction::Forward); Joint::COUNT];
    for (config, joint) in configs.iter_mut().zip(JOINTS) {
        let servo = servos.table(joint, &SERVO)?;
        // Whole microseconds by type, so a fraction is refused here; the loop checks the range.
        let pulse = |key: &str| Ok::<_, FileError>(PulseMicros(servo.whole(key, 0, 10_000, " us")? as u16));
        *config = ServoConfig {
            neutral: pulse("neutral_us")?,
            angle_at_neutral: Radians::from_degrees(sensible(&servo, "angle_at_neutral_deg")?),
            micros_per_radian: sensible(&servo, "us_per_rad")?,
            direction: servo.word("direction", &DIRECTIONS)?,
            shortest: pulse("shortest_us")?,
            longest: pulse("longest_us")?,
        };
    }
    Ok(configs)
}

fn blend(top: &Section<'_>) -> Result<BlendConfig, FileError> {
    let blend = top.table("blend", &["park_deg", "ramp_s", "stop_s", "hurry_s"])?;
    let parks = blend.table("park_deg", &JOINTS)?;
    let mut park = [Radians(0.0); Joint::COUNT];
    for (park, joint) in park.iter_mut().zip(JOINTS) {
        *park = Radians::from_degrees(sensible(&parks, joint)?);
    }
    let seconds = |key: &str| sensible(&blend, key);
    Ok(BlendConfig { park, ramp_s: seconds("ramp_s")?, stop_s: seconds("stop_s")?, hurry_s: seconds("hurry_s")? })
}

fn monitor(top: &Section<'_>) -> Result<MonitorConfig, FileError> {
    let monitor = top.table("monitor", &MONITOR)?;
    let seconds = |key: &str| sensible(&monitor, key);
    Ok(MonitorConfig {
        sensor_required: monitor.flag("sensor_required")?,
        sensor_tolerance_s: seconds("sensor_tolerance_s")?,
        pose_tolerance_s: seconds("pose_tolerance_s")?,
        stop_gap_s: seconds("stop_gap_s")?,
        fault_gap_s: seconds("fault_gap_s")?,
        overruns_per_s: monitor.whole("overruns_per_s", 0, 100, "")?,
        debounce_s: seconds("debounce_s")?,
    })
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
        LoopError::Generator => ("", None),
    };
    let of = |path: &str| joint.map_or(path.to_owned(), |joint| format!("{path}.{}", joint.name()));
    let servo = |name: &str| format!("{}.{name}", of("servos"));
    match field {
        "gate.rate" => "gate.rate_deg_per_s".into(),
        "gate.acceleration" => "gate.acceleration_deg_per_s2".into(),
        "gate.range" | "gate.range.least" | "gate.range.most" => of("gate.range_deg"),
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

/// The text of a file.
#[must_use]
pub fn to_text(config: &LoopConfig) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write_to(&mut text, config);
    text
}

fn write_to(out: &mut String, config: &LoopConfig) -> std::fmt::Result {
    // The channel of the gait sensor belongs to the sensor file.
    let LoopConfig { gate, servos, blend, monitor, gait_sensor: _ } = config;
    let deg = degrees::shortest;
    writeln!(
        out,
        "# Parameters of the loop. Angles in degrees, flexion positive; times in seconds; pulses in microseconds."
    )?;
    writeln!(out, "schema = {SCHEMA}\n\n[gate]")?;
    writeln!(out, "rate_deg_per_s = {}", deg(Radians(gate.rate.0)))?;
    writeln!(out, "acceleration_deg_per_s2 = {}", deg(Radians(gate.acceleration.0)))?;
    if gate.pose.iter().all(Option::is_none) {
        writeln!(out, "pose = []")?;
    }
    writeln!(out, "\n# Least and most angle of each joint.\n[gate.range_deg]")?;
    for (joint, range) in JOINTS.iter().zip(&gate.range) {
        writeln!(out, "{joint} = [{}, {}]", deg(range.least), deg(range.most))?;
    }
    writeln!(out, "\n# Bounds on two joints together: first + second (sum) or first - second (difference).")?;
    for limit in gate.pose.iter().flatten() {
        let (first, second) = (limit.first.name(), limit.second.name());
        let sense = SENSES.iter().find(|(_, sense)| *sense == limit.sense).map_or("", |(word, _)| word);
        writeln!(out, "[[gate.pose]]\nfirst = \"{first}\"\nsecond = \"{second}\"\nsense = \"{sense}\"")?;
        writeln!(out, "most_deg = {}\n", deg(limit.most))?;
    }
    for (joint, servo) in JOINTS.iter().zip(servos) {
        let direction = DIRECTIONS.iter().find(|(_, way)| *way == servo.direction).map_or("", |(word, _)| word);
        writeln!(out, "[servos.{joint}]\nneutral_us = {}", servo.neutral.0)?;
        writeln!(out, "angle_at_neutral_deg = {}", deg(servo.angle_at_neutral))?;
        writeln!(out, "us_per_rad = {}\ndirection = \"{direction}\"", servo.micros_per_radian)?;
        writeln!(out, "shortest_us = {}\nlongest_us = {}\n", servo.shortest.0, servo.longest.0)?;
    }
    writeln!(out, "[blend]\nramp_s = {}\nstop_s = {}\nhurry_s = {}", blend.ramp_s, blend.stop_s, blend.hurry_s)?;
    writeln!(out, "\n# The pose that motion starts from and comes back to.\n[blend.park_deg]")?;
    for (joint, park) in JOINTS.iter().zip(blend.park) {
        writeln!(out, "{joint} = {}", deg(park))?;
    }
    writeln!(out, "\n[monitor]\nsensor_required = {}", monitor.sensor_required)?;
    writeln!(
        out,
        "sensor_tolerance_s = {}\npose_tolerance_s = {}",
        monitor.sensor_tolerance_s, monitor.pose_tolerance_s
    )?;
    writeln!(out, "stop_gap_s = {}\nfault_gap_s = {}", monitor.stop_gap_s, monitor.fault_gap_s)?;
    writeln!(out, "overruns_per_s = {}\ndebounce_s = {}", monitor.overruns_per_s, monitor.debounce_s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn parsed(text: String) -> Result<LoopConfig, FileError> {
        parse(&Document::of_text("loop.toml", text))
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
            ("rate_deg_per_s = 500", "rate_deg_per_s = 5000", "gate.rate_deg_per_s"),
            ("acceleration_deg_per_s2 = 20000", "acceleration_deg_per_s2 = 1", "gate.acceleration_deg_per_s2"),
            ("left_hip = [-30, 60]", "left_hip = [-31, 60]", "gate.range_deg.left_hip"),
            ("right_knee = [-2, 120]", "right_knee = [60, 60]", "gate.range_deg.right_knee"),
            ("left_knee = 5", "left_knee = 130", "blend.park_deg.left_knee"),
            ("ramp_s = 2", "ramp_s = 0.1", "blend.ramp_s"),
            ("hurry_s = 0.3", "hurry_s = 3", "blend.hurry_s"),
            ("stop_gap_s = 0.005", "stop_gap_s = 0.05", "monitor.stop_gap_s"),
            ("debounce_s = 0.02", "debounce_s = 2", "monitor.debounce_s"),
            ("neutral_us = 1500", "neutral_us = 2600", "servos.left_hip.neutral_us"),
            ("shortest_us = 500", "shortest_us = 400", "servos.left_hip.shortest_us"),
            ("us_per_rad = 636.62", "us_per_rad = 63.662", "servos.left_hip.us_per_rad"),
            ("second = \"right_knee\"", "second = \"left_knee\"", "gate.pose[0]"),
            ("most_deg = 150", "most_deg = 5", "gate.pose[0]"),
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
