//! A sample of the campaign of faults (`cargo xtask campaign`): every fault in one state at one phase at least, each with its reaction in time, and
//! no pulse beyond the limits of the robot.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use firmware::board::ROBOT_SECTOR;
use footfall_tests::recordings::default_volts_file;
use joint_loop::store::robot_record;
use joint_loop::{Direction, GateConfig, ServoConfig};
use joint_loop::{RecordName, RobotConfig};
use serde_json::Value;
use test_suite::{report, tests};

/// One case of so many: prime to the 20 phases.
const SAMPLE: &str = "29";

fn main() -> ExitCode {
    test_suite::run(tests![
        the_limits_are_those_of_the_default_robot(),
        a_sample_of_the_faults_leads_to_the_declared_reactions(Image),
        wrong_limits_and_wrong_reactions_are_noticed(Image),
        a_state_that_is_not_as_declared_ends_the_campaign(Image),
    ])
}

fn faults_file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("campaign/faults.toml")
}

fn the_limits_are_those_of_the_default_robot() {
    let text = std::fs::read_to_string(faults_file()).expect("the file");
    let file: toml::Table = text.parse().expect("TOML");
    let limit = |key: &str, joint: usize| file["limits"][key][joint].as_float().expect("a number");
    let (gate, servos) = (GateConfig::default_biped(), ServoConfig::default_biped());
    for (joint, servo) in servos.iter().enumerate() {
        let direction = if servo.direction == Direction::Forward { 1.0 } else { -1.0 };
        let micros = |angle: f32| {
            f64::from(servo.neutral.0)
                + direction * f64::from(servo.micros_per_radian) * f64::from(angle - servo.angle_at_neutral.0)
        };
        let ends = [gate.range[joint].least.0, gate.range[joint].most.0].map(micros);
        let (least, most) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        assert!((limit("least_us", joint) - least).abs() < 0.1, "joint {joint}: {least}");
        assert!((limit("most_us", joint) - most).abs() < 0.1, "joint {joint}: {most}");
        let rate = f64::from(servo.micros_per_radian * gate.rate[joint].0);
        assert!((limit("us_per_s", joint) - rate).abs() < 0.2, "joint {joint}: {rate}");
    }
}

/// The lines of a campaign, and the exit code.
fn campaign(faults: &Path, every: &str) -> (Vec<Value>, Option<i32>) {
    let path = |name: &str| std::env::var_os(name).unwrap_or_else(|| panic!("{name}"));
    let record = tempfile::NamedTempFile::new().expect("a file");
    let robot = robot_record::record_of(&RobotConfig::default_biped(), &RecordName::BUILT_IN);
    std::fs::write(record.path(), robot.bytes()).expect("written");
    let flash = OsString::from(format!("{ROBOT_SECTOR:#010x}={}", record.path().display()));
    let output = Command::new(path("FOOTFALL_VIRTUAL_BOARD"))
        .arg(path("FOOTFALL_ELF"))
        .args(["--loop", "--volts"])
        .arg(default_volts_file())
        .arg("--flash")
        .arg(flash)
        .arg("--campaign")
        .arg(faults)
        .args(["--every", every])
        .output()
        .expect("the virtual board starts");
    let text = String::from_utf8(output.stdout).expect("text");
    let lines = text.lines().map(|line| serde_json::from_str(line).expect("an object")).collect();
    (lines, output.status.code())
}

fn a_sample_of_the_faults_leads_to_the_declared_reactions() {
    let (lines, code) = campaign(&faults_file(), SAMPLE);
    let (cases, end): (Vec<&Value>, Vec<&Value>) = lines.iter().partition(|line| line["type"] == "case");
    let wrong: Vec<&&Value> = cases.iter().filter(|case| case["good"] != true).collect();
    assert_eq!((code, wrong.len()), (Some(0), 0), "{wrong:#?}");
    report!("{} cases of {} faults in {} s, none wrong", cases.len(), end[0]["faults"], end[0]["seconds"]);
    assert!(cases.len() >= 400 && end[0]["faults"].as_u64() >= Some(240), "{}", cases.len());
    // Each kind of reaction was seen, and states in which the servos move.
    for key in ["off_us", "reset_us"] {
        assert!(cases.iter().filter(|case| case[key].as_f64().is_some_and(|us| us > 0.0)).count() > 5, "{key}");
    }
    assert!(cases.iter().any(|case| case["state"] == "walking" && case["off_us"].is_null()));
}

/// Limits within which no walk fits, and a reaction that does not come.
fn wrong_limits_and_wrong_reactions_are_noticed() {
    let text = std::fs::read_to_string(faults_file()).expect("the file");
    let (head, _) = text.split_once("# ---- The program").expect("a head");
    let fault = |inject: &str, reaction: &str| {
        format!(
            "{head}[[fault]]\nname = \"a\"\ninject = {inject}\nstates = [\"walking\"]\nexpect = {{ reaction = \"{reaction}\", within_ms = 100 }}\n"
        )
    };
    let file = tempfile::NamedTempFile::new().expect("a file");
    for (text, words) in [
        (fault("\"overrun\"", "none").replace("least_us = [1166.6,", "least_us = [2100.0,"), "is outside 2100"),
        (fault("\"overrun\"", "none").replace("us_per_s = [5555.7,", "us_per_s = [50.0,"), "us in 20.0 ms"),
        (fault("\"overrun\"", "off"), "outputs off never; allowed are 100 ms"),
        (fault("\"panic\"", "none"), "nothing was to happen"),
        (
            fault("{ hang = \"telemetry_step\" }", "reset").replace("within_ms = 100", "within_ms = 2"),
            "allowed are 2 ms",
        ),
    ] {
        std::fs::write(file.path(), text).expect("written");
        let (lines, code) = campaign(file.path(), "1");
        assert_eq!(code, Some(1), "{words}");
        let whys: Vec<&str> = lines.iter().filter_map(|line| line["why"].as_str()).collect();
        assert!(whys.iter().any(|why| why.contains(words)), "{words}: {whys:?}");
    }
}

/// A board that never arms would pass every case.
fn a_state_that_is_not_as_declared_ends_the_campaign() {
    let text = std::fs::read_to_string(faults_file()).expect("the file");
    let file = tempfile::NamedTempFile::new().expect("a file");
    // The board is not armed in it.
    let unarmed = text.replace("hold_s = 0.35", "hold_s = 0.1");
    assert_ne!(unarmed, text);
    std::fs::write(file.path(), unarmed).expect("written");
    let (lines, code) = campaign(file.path(), "1000");
    assert_eq!(code, Some(2));
    assert!(lines.iter().all(|line| line["state"] == "disarmed"), "{lines:?}");
}
