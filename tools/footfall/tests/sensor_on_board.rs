//! `check` and `pack` say of a sensor file what the control loop of a board says of it.

use firmware::board::BOARDS;
use footfall::board::default_loop::TYPICAL_VREFINT_CAL;
use footfall::file::calibration_file;
use joint_loop::setup::default_loop::{Parameters, board_loop};
use joint_loop::{JointSensor, JointSensors, RobotConfig};
use joint_units::Joint;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

fn sample(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../samples").join(name)
}

fn footfall(arguments: &[OsString]) -> (Option<i32>, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_footfall")).args(arguments).output().unwrap();
    (
        output.status.code(),
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr),
    )
}

fn check(file: &Path, board: &str) -> (Option<i32>, String) {
    footfall(&["check".into(), "--calibration".into(), file.into(), "--board".into(), board.into()])
}

fn pack(file: &Path, board: &str) -> (Option<i32>, String) {
    let mut sensor = OsString::from("left_hip=");
    sensor.push(file);
    let out = file.with_extension("bin").into();
    footfall(&[
        "pack".into(),
        "--sensor".into(),
        sensor,
        "--board".into(),
        board.into(),
        "--force".into(),
        "--out".into(),
        out,
    ])
}

/// Whether the loop is built from the file as the firmware builds it.
fn board_takes(file: &Path, board: &firmware::board::Board) -> bool {
    let wired = calibration_file::read(file).unwrap();
    let sensor = JointSensor { joint: Joint::LeftHip, divider: wired.divider, calibration: wired.calibration };
    let robot = RobotConfig::default_biped();
    let min_supply = robot.min_supply_on(board.min_supply);
    let parameters = Parameters::with_defaults(None, Some(JointSensors::build([sensor]).unwrap()), robot).unwrap();
    board_loop(&parameters, TYPICAL_VREFINT_CAL, min_supply, true).is_ok()
}

#[test]
fn check_and_pack_say_what_the_board_says() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("knee.toml");
    let (mut taken, mut refused) = (0, 0);
    for (least, most, divider) in
        [(0.35, 2.65, 1.0), (0.35, 2.6, 1.0), (0.35, 2.93, 1.0), (0.35, 2.95, 1.0), (0.05, 2.0, 1.0), (0.2, 5.0, 2.0)]
    {
        let text = format!(
            "schema = 1\ninterpolation = \"linear\"\ndivider = {divider:?}\npoints = [\n    {{ sensor_v = {least:?}, angle_deg = 0 }},\n    \
             {{ sensor_v = 1.5, angle_deg = 50 }},\n    {{ sensor_v = {most:?}, angle_deg = 90 }},\n]\n"
        );
        std::fs::write(&file, text).unwrap();
        for board in BOARDS {
            let takes = board_takes(&file, board);
            *(if takes { &mut taken } else { &mut refused }) += 1;
            for (code, words) in [check(&file, board.name), pack(&file, board.name)] {
                assert_eq!(code, Some(if takes { 0 } else { 2 }), "{least} {most} {divider} {}: {words}", board.name);
                let named = [board.name, "knee.toml:", "points[", "shorten the table", "broken wire"];
                assert!(takes || named.iter().all(|name| words.contains(name)), "{words}");
            }
        }
    }
    assert!(taken > 3 && refused > 3, "{taken} {refused}");
}

#[test]
fn the_words_name_line_code_and_what_is_allowed() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("knee.toml");
    let text = std::fs::read_to_string(sample("sensor.toml")).unwrap();
    let (first, last) = text.rsplit_once("sensor_v = ").unwrap();
    let (_, rest) = last.split_once(',').unwrap();
    std::fs::write(&file, format!("{first}sensor_v = 2.6500,{rest}")).unwrap();
    let line = text.lines().count() - 1;
    for (code, words) in [check(&file, "f4-discovery"), pack(&file, "f4-discovery")] {
        assert_eq!(code, Some(2), "{words}");
        let said = format!(
            "knee.toml:{line}: field `points[17].sensor_v`: at a supply of 2.7 V it reads code 4019 on the board f4-discovery"
        );
        assert!(words.contains(&said) && words.contains("allowed are 82 to 4013"), "{words}");
    }
    let higher = |option: &str, value: &str| {
        footfall(&["check".into(), "--calibration".into(), file.clone().into(), option.into(), value.into()])
    };
    assert_eq!(higher("--min-supply", "2.8").0, Some(0));
    assert_eq!(higher("--board", "nucleo-f446re").0, Some(0));
    let commands =
        [(&["check", "--generator"][..], "generator.toml"), (&["pack", "-o", "none.bin", "--robot"], "robot.toml")];
    for (command, file) in commands {
        let mut arguments: Vec<OsString> = command.iter().map(Into::into).collect();
        arguments.extend([sample(file).into(), "--board".into(), "nucleo-f446re".into()]);
        let (code, words) = footfall(&arguments);
        assert!(code == Some(2) && words.contains("there is none here: remove them"), "{command:?}: {words}");
    }
    let (code, words) = higher("--board", "none");
    assert!(code == Some(2) && words.contains("allowed is one of f4-discovery, "), "{words}");
    // Volts of a recording need no board.
    let trace = ["--trace".into(), sample("oscilloscope.csv").into(), "--map".into(), "left_knee=CH1".into()];
    let (_, words) = footfall(&[&["check".into(), "--calibration".into(), file.clone().into()], &trace[..]].concat());
    assert!(words.contains("for recordings only: ") && words.contains("code 4019"), "{words}");
}

#[test]
fn boards_take_the_sample_and_what_is_calibrated_from_the_sample_rows() {
    let folder = tempfile::tempdir().unwrap();
    let hip = folder.path().join("hip.toml");
    let arguments = ["calibrate".into(), sample("rows.csv").into(), "-o".into(), hip.clone().into()];
    let (code, words) = footfall(&arguments);
    assert!(code == Some(0) && !words.contains("would refuse it"), "{words}");
    let copy = folder.path().join("sensor.toml");
    std::fs::copy(sample("sensor.toml"), &copy).unwrap();
    for file in [hip, copy] {
        for board in BOARDS {
            assert!(board_takes(&file, board));
            assert_eq!(check(&file, board.name).0, Some(0));
            assert_eq!(pack(&file, board.name).0, Some(0));
        }
    }
}
