//! Tests of the robot file: exact round trips through file and record, and every field refused by name and line.

use super::*;
use joint_loop::store::robot_record::{read, record_of};
use proptest::prelude::*;

fn parsed(text: &str) -> Result<RobotFile, FileError> {
    RobotFile::parse("robot.toml", text)
}

/// File, record and back, with equal bits.
fn assert_round_trip(file: RobotFile) {
    assert_eq!(parsed(&file.to_toml()), Ok(file), "{}", file.to_toml());
    let record = record_of(&file.robot, &file.name);
    let stored = read(record.bytes()).expect("whole").expect("there");
    assert_eq!((stored.robot, stored.name), (file.robot, file.name));
    let again = record_of(&parsed(&file.to_toml()).expect("good").robot, &file.name);
    assert_eq!(again.bytes(), record.bytes(), "the bytes are those of the numbers, to the bit");
    let built = |robot: &RobotConfig| robot.build(Period::MILLISECOND).expect("allowed");
    assert_eq!(built(&stored.robot), built(&file.robot));
}

#[test]
fn the_default_robot_makes_an_exact_round_trip() {
    let default = RobotFile::default_biped();
    assert_eq!(default.robot, RobotConfig::default_biped());
    assert_round_trip(default);
    let mut bare = default;
    bare.robot.gate.pose = [None; POSE_LIMITS];
    assert_round_trip(bare);
}

/// Each field out of its range: the error has its line, its name and what is allowed.
#[test]
fn each_field_out_of_range_is_refused_by_name() {
    let default = RobotFile::default_biped().to_toml();
    for (from, to, field, words) in [
        ("min_supply_v = 2.7", "min_supply_v = 1.7", "min_supply_v", "1.8 to 3.6 V"),
        ("disarm_after_stand_s = 10.0", "disarm_after_stand_s = 0.9", "follower.disarm_after_stand_s", "1 to 60 s"),
        ("disarm_after_stand_s = 10.0", "disarm_after_stand_s = 61", "follower.disarm_after_stand_s", "1 to 60 s"),
        ("range_deg = [-30.0, 60.0]", "range_deg = [-31, 60]", "left_hip.range_deg[0]", "-30 to 120 deg"),
        ("range_deg = [-30.0, 60.0]", "range_deg = [-30, 121]", "left_hip.range_deg[1]", "-30 to 120 deg"),
        ("range_deg = [-30.0, 60.0]", "range_deg = [20, 10]", "left_hip.range_deg", "below the most"),
        ("range_deg = [-2.0, 120.0]", "range_deg = [-2, 140]", "left_knee.range_deg", "500 to 2500 us"),
        ("rate_deg_per_s = 500.0", "rate_deg_per_s = 1001", "left_hip.rate_deg_per_s", "1 to 1000 deg/s"),
        (
            "acceleration_deg_per_s2 = 20000.0",
            "acceleration_deg_per_s2 = 1000",
            "left_hip.acceleration_deg_per_s2",
            "allowed are 1388.889 to",
        ),
        ("park_deg = 0.0", "park_deg = 61", "left_hip.park_deg", "-30 to 60 deg"),
        ("neutral_us = 1500", "neutral_us = 2501", "left_hip.neutral_us", "500 to 2500 us"),
        (
            "angle_at_neutral_deg = 0.0",
            "angle_at_neutral_deg = 181",
            "left_hip.angle_at_neutral_deg",
            "-180 to 180 deg",
        ),
        ("us_per_rad = 636.62", "us_per_rad = 99", "left_hip.us_per_rad", "100 to 2000 us/rad"),
        ("shortest_us = 500", "shortest_us = 499", "left_hip.shortest_us", "500 to 2500 us"),
        ("shortest_us = 500", "shortest_us = 2500", "left_hip.shortest_us", "below the most"),
        ("longest_us = 2500", "longest_us = 2501", "left_hip.longest_us", "500 to 2500 us"),
        ("shortest_us = 500", "feedback = 0.81\nshortest_us = 500", "left_hip.feedback", "allowed are -0.8 to 0.8"),
        ("shortest_us = 500", "feedback = -0.9\nshortest_us = 500", "left_hip.feedback", "allowed are -0.8 to 0.8"),
        ("shortest_us = 500", "feedback = inf\nshortest_us = 500", "left_hip.feedback", "allowed is a finite number"),
    ] {
        let at = default.find(from).unwrap_or_else(|| panic!("{from} is not in the file"));
        let text = format!("{}{to}{}", &default[..at], &default[at + from.len()..]);
        let error = parsed(&text).expect_err(to);
        assert_eq!(error.field.as_deref(), Some(field), "{to}: {error}");
        assert_eq!(error.line, Some(default[..at].matches('\n').count() + 1), "{error}");
        assert!(error.to_string().contains(words), "{error}");
    }
    // A limit of a pose is a table: the line is that of its first key or the one above.
    for (from, to, field, words) in [
        ("second = \"right_knee\"", "second = \"left_knee\"", "pose[0]", "two different joints"),
        ("most_deg = 150.0", "most_deg = 5", "pose[0]", "strictly inside"),
        ("most_deg = 150.0", "most_deg = 258", "pose[0].most_deg", "-257 to 257 degrees"),
        ("name = \"default biped\"", "name = \"\"", "name", "1 to 24 bytes"),
        ("name = \"default biped\"", "name = \"a name of more than 24 bytes\"", "name", "has 28 bytes"),
    ] {
        let error = parsed(&default.replacen(from, to, 1)).expect_err(to);
        assert!(error.line.is_some() && error.field.as_deref() == Some(field), "{to}: {error}");
        assert!(error.to_string().contains(words), "{error}");
    }
    let seven = default.clone() + &default[default.find("[[pose]]").expect("a limit")..];
    let error = parsed(&seven).expect_err("ten limits").to_string();
    assert!(error.contains("field `pose`") && error.contains("0 to 6 limits"), "{error}");
}

/// The one key that may be absent: it stands in the file of a robot that has feedback, of the joints that have it.
#[test]
fn feedback_is_0_where_it_is_absent() {
    let default = RobotFile::default_biped();
    assert!(!default.to_toml().lines().any(|line| line.starts_with("feedback")));
    let mut file = default;
    file.robot.feedback = [0.0, -0.5, 0.3, 0.0];
    assert_round_trip(file);
    let text = file.to_toml();
    assert_eq!(text.matches("\nfeedback = ").count(), 2, "{text}");
    let knee = text.find("[left_knee]").expect("the table");
    assert!(text[knee..].contains("feedback = 0.3\n"), "{text}");
    let error = parsed(&text.replace("feedback = 0.3", "feedback = \"x\"")).expect_err("no number");
    let line = text[..knee + text[knee..].find("feedback").expect("the key")].matches('\n').count() + 1;
    assert_eq!((error.field.as_deref(), error.line), (Some("left_knee.feedback"), Some(line)), "{error}");
}

/// A file of the version before is read with the numbers of that time; its own key is none of that version, and the table is required in this one.
#[test]
fn a_file_of_the_version_before_is_read() {
    let new = RobotFile::default_biped().to_toml();
    let start = new.find("[follower]").expect("the table");
    let end = start + new[start..].find("[left_hip]").expect("a joint");
    let without = format!("{}{}", &new[..start], &new[end..]);
    let old = without.replace("schema = 2", "schema = 1");
    assert_eq!(parsed(&old), Ok(RobotFile::default_biped()));
    let error = parsed(&new.replace("schema = 2", "schema = 1")).expect_err("a key of the next version").to_string();
    assert!(error.contains("follower"), "{error}");
    let error = parsed(&without).expect_err("a missing table").to_string();
    assert!(error.contains("field `follower`") && error.contains("is missing"), "{error}");
}

/// Every field broken in turn: the error names file, line and field, and says what is allowed.
#[test]
fn each_broken_field_is_named_with_its_line() {
    let text = RobotFile::default_biped().to_toml();
    let mut broken_lines = 0;
    for (index, line) in text.lines().enumerate().filter(|(_, line)| !line.starts_with('#')) {
        let Some((key, value)) = line.split_once(" = ") else { continue };
        let junk = if value.starts_with('"') { "7" } else { "\"x\"" };
        for broken in [format!("{key} = {junk}"), format!("{key}x = 1"), format!("{key} = nan")] {
            let mut lines: Vec<&str> = text.lines().collect();
            lines[index] = &broken;
            let error = parsed(&lines.join("\n")).expect_err(&broken).to_string();
            assert!(error.starts_with(&format!("robot.toml:{}: ", index + 1)), "{broken}: {error}");
            assert!(error.contains("allowed") && error.contains(key), "{broken}: {error}");
            broken_lines += 1;
        }
        // Without the line the field is missing.
        let without: Vec<&str> =
            text.lines().enumerate().filter(|(place, _)| *place != index).map(|(_, line)| line).collect();
        let error = parsed(&without.join("\n")).expect_err("a missing key").to_string();
        assert!(error.contains(key) && error.contains("is missing"), "{key}: {error}");
    }
    assert_eq!(broken_lines, 3 * (3 + 2 + 4 * 10 + 5 * 4));
}

proptest! {
    #[test]
    fn any_robot_makes_an_exact_round_trip(
        least in prop::array::uniform4(-2.0_f32..-1.0), most in prop::array::uniform4(30.0_f32..60.0),
        rate in prop::array::uniform4(100.0_f32..500.0), acceleration in prop::array::uniform4(2_000.0_f32..60_000.0),
        park in prop::array::uniform4(0.0_f32..5.0), neutral in prop::array::uniform4(1_450_u16..1_550),
        scale in prop::array::uniform4(300.0_f32..650.0), mirrored: [bool; 4], supply in 1.8_f32..3.6, poses in 0_usize..7,
        stand in 1.0_f32..60.0, walks_again: bool, required: bool, feedback in prop::array::uniform4(prop::option::of(-0.8_f32..=0.8)),
    ) {
        let mut file = RobotFile::default_biped();
        let robot = &mut file.robot;
        let rad = |degrees: [f32; 4]| degrees.map(Radians::from_degrees);
        let (least, most, rate, acceleration) = (rad(least), rad(most), rad(rate), rad(acceleration));
        robot.gate.pose = robot.gate.pose.map(|_| None);
        for (place, limit) in robot.gate.pose.iter_mut().take(poses).enumerate() {
            let (first, second) = (Joint::ALL[place % 4], Joint::ALL[(place + 1) % 4]);
            *limit = Some(PoseLimit { first, second, sense: PoseSense::ALL[place % 2], most: most[place % 4] });
        }
        for joint in 0..4 {
            robot.gate.range[joint] = JointRange { least: least[joint], most: most[joint] };
            robot.gate.rate[joint] = RadPerSec(rate[joint].0);
            robot.gate.acceleration[joint] = RadPerSec2(acceleration[joint].0);
            let servo = &mut robot.servos[joint];
            (servo.neutral, servo.micros_per_radian) = (PulseMicros(neutral[joint]), scale[joint]);
            servo.direction = Direction::ALL[usize::from(mirrored[joint])];
        }
        (robot.park, robot.min_supply) = (rad(park), Volts(supply));
        robot.follower = FollowerRules { disarm_after_stand_s: stand, walks_again_after_lost_sensor: walks_again };
        robot.feedback = feedback.map(|share| share.unwrap_or(0.0));
        robot.require_brown_out_reset = required;
        prop_assume!(robot.build(Period::MILLISECOND).is_ok());
        assert_round_trip(file);
    }

    #[test]
    fn junk_never_panics(text in "(schema|name|left_hip|=|1|\\[|\\]|\n|\"| |-|nan|\\{|\\}|\\.|,){0,40}") {
        let _ = parsed(&text);
    }
}

/// A file of another kind is named, with the option that it belongs to.
#[test]
fn a_file_of_another_kind_is_named() {
    let said = |error: FileError| error.to_string();
    let robot = RobotFile::default_biped().to_toml();
    let error = said(crate::file::GeneratorFile::parse("robot.toml", &robot).unwrap_err());
    assert!(error.contains("is a robot file, which belongs to `--robot`; allowed here is a generator file"), "{error}");
    let sensor = "schema = 1\ninterpolation = \"linear\"\npoints = []\n";
    let error = said(crate::file::GeneratorFile::parse("knee.toml", sensor).unwrap_err());
    assert!(error.contains("is a sensor file, which belongs to `--sensor` or `--calibration`"), "{error}");
    let error = said(parsed("schema = 2\ngenerator = \"shape\"\n").unwrap_err());
    assert!(
        error.contains("is a generator file, which belongs to `--generator`; allowed here is a robot file"),
        "{error}"
    );
}
