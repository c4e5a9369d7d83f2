//! Modelled servos at the pins of the flashed image on the virtual board: what the joints do in a walk, at arming and at a stop.

use std::process::ExitCode;

use footfall_tests::board::{Board, Ran};
use footfall_tests::gestures::{ARM, STOP_TEST};
use footfall_tests::recordings::default_volts_file;
use serde_json::Value;
use test_suite::{report, tests};

fn main() -> ExitCode {
    test_suite::run(tests![
        in_a_walk_the_joints_stay_inside_their_ranges(Image),
        at_arming_a_joint_turns_to_the_park_pose_at_full_speed(Image),
        a_cut_by_the_emergency_stop_turns_no_joint(Image),
        a_board_without_a_robot_record_has_no_servos(Image),
        a_run_that_is_meant_to_violate_and_does_not_fails(Image),
    ])
}

const KINDS: [&str; 2] = ["analogue", "digital"];
/// Ranges of the default robot, degrees.
const RANGES: [[f64; 2]; 4] = [[-30.0, 60.0], [-30.0, 60.0], [-2.0, 120.0], [-2.0, 120.0]];

fn run(kind: &str, secs: &str, more: &[&str]) -> Ran {
    let volts = default_volts_file();
    let volts = volts.to_str().expect("a name");
    let options = ["--secs", secs, "--press", ARM, "--loop", "--volts", volts, "--servo", kind];
    Board::find().run(options.iter().chain(more))
}

/// Times and joint angles of the modelled servos, degrees, and their torques.
fn angles(ran: &Ran) -> Vec<(f64, [f64; 4], [f64; 4])> {
    let four = |value: &Value| -> [f64; 4] { serde_json::from_value(value.clone()).expect("four numbers") };
    let lines = ran.remarks.iter().filter(|remark| remark["type"] == "servos");
    lines.map(|line| (line["t_s"].as_f64().expect("a time"), four(&line["deg"]), four(&line["torque"]))).collect()
}

fn in_a_walk_the_joints_stay_inside_their_ranges() {
    for kind in KINDS {
        let ran = run(kind, "6", &["--servo-at", "0,0,5,5"]);
        ran.assert_sound();
        let angles = angles(&ran);
        assert!(angles.len() >= 290, "{} lines", angles.len());
        for (joint, [least, most]) in RANGES.into_iter().enumerate() {
            let of_joint = angles.iter().map(|(_, degrees, _)| degrees[joint]);
            let (low, high) =
                of_joint.fold((f64::MAX, f64::MIN), |(low, high), angle| (low.min(angle), high.max(angle)));
            assert!(low >= least - 0.1 && high <= most + 0.1, "{kind}, joint {joint}: {low} to {high} degrees");
            assert!(high - low > 20.0, "{kind}, joint {joint} walks: {low} to {high} degrees");
        }
    }
}

/// H02: nothing slows the motion to the first pulse.
fn at_arming_a_joint_turns_to_the_park_pose_at_full_speed() {
    for (kind, least_speed) in KINDS.into_iter().zip([390.0, 600.0]) {
        let ran = run(kind, "2", &["--servo-at", "0,0,90,5"]);
        let angles = angles(&ran);
        let speeds = angles.windows(2).map(|pair| (pair[0].1[2] - pair[1].1[2]) / (pair[1].0 - pair[0].0));
        let fastest = speeds.fold(0.0, f64::max);
        report!("{kind}: the left knee turns from 90 degrees at {fastest:.0} degrees/s");
        assert!(fastest >= least_speed, "{kind}: {fastest} degrees/s");
        assert!(
            angles.iter().any(|(t_s, degrees, _)| *t_s < 0.8 && (degrees[2] - 5.0).abs() < 1.0),
            "{kind}: it arrives"
        );
    }
}

/// The stop at 20 moments of the pulses of a frame.
fn a_cut_by_the_emergency_stop_turns_no_joint() {
    for kind in KINDS {
        let undisturbed = run(kind, "2.4", &[]);
        let start = undisturbed.pulses.iter().map(|(at, _)| *at).find(|at| *at > 2.0).expect("it walks");
        let (mut cuts, mut largest) = (0, 0.0_f64);
        for part in 0..20 {
            let at = start + 1e-4 * f64::from(part) + 1.3e-5;
            let stop = format!("{at}:1");
            let ran = run(kind, "2.4", &["--emergency-stop", STOP_TEST, &stop]);
            cuts += ran.end.judged.cut;
            // The last line before the stop, and the last of the run: the walk itself turns the joints until the stop.
            let lines = angles(&ran);
            let (_, before, _) = lines.iter().rev().find(|(t_s, ..)| *t_s <= at).expect("a line before");
            let (_, after, torque) = lines.last().expect("lines");
            assert_eq!(*torque, [0.0; 4], "{kind}");
            let walk = undisturbed.remarks.iter().filter(|remark| remark["type"] == "servos");
            let frame = walk
                .filter(|line| line["t_s"].as_f64().is_some_and(|t_s| (start - 0.02..=start + 0.04).contains(&t_s)));
            let reached: Vec<[f64; 4]> =
                frame.map(|line| serde_json::from_value(line["deg"].clone()).expect("four")).collect();
            for joint in 0..4 {
                let [low, high] = reached
                    .iter()
                    .fold([before[joint]; 2], |[low, high], at| [low.min(at[joint]), high.max(at[joint])]);
                largest = largest.max(low - after[joint]).max(after[joint] - high);
            }
        }
        report!(
            "{kind}: {cuts} pulses cut by the emergency stop; the joints turned {largest:.3} degrees beyond the walk at most"
        );
        assert!(cuts >= 4, "{kind}: {cuts} pulses were cut");
        assert!(largest < 0.1, "{kind}: {largest} degrees");
    }
}

fn a_board_without_a_robot_record_has_no_servos() {
    let ran = std::process::Command::new(std::env::var_os("FOOTFALL_VIRTUAL_BOARD").expect("FOOTFALL_VIRTUAL_BOARD"))
        .arg(std::env::var_os("FOOTFALL_ELF").expect("FOOTFALL_ELF"))
        .args(["--secs", "0.1", "--servo", "digital"])
        .output()
        .expect("it starts");
    let error = String::from_utf8(ran.stderr).expect("text");
    assert_eq!(ran.status.code(), Some(2), "{error}");
    assert!(error.contains("no valid robot record"), "{error}");
}

fn a_run_that_is_meant_to_violate_and_does_not_fails() {
    let ran = std::process::Command::new(std::env::var_os("FOOTFALL_VIRTUAL_BOARD").expect("FOOTFALL_VIRTUAL_BOARD"))
        .arg(std::env::var_os("FOOTFALL_ELF").expect("FOOTFALL_ELF"))
        .args(["--secs", "0.1", "--violates", "a test of the option"])
        .env_remove("FOOTFALL_JUDGED")
        .output()
        .expect("it starts");
    assert_eq!(ran.status.code(), Some(1));
}
