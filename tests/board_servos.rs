//! Modelled servos at the pins of the flashed image on the virtual board: what the joints do in a walk, at arming and at a stop.

use std::io::Write as _;
use std::process::ExitCode;

use firmware::board::ROBOT_SECTOR;
use footfall_tests::board::{Board, Ran};
use footfall_tests::gestures::{ARM, STOP_TEST};
use footfall_tests::recordings::default_volts_file;
use serde_json::Value;
use servo_model::{DataSheet, Servo};
use test_suite::{report, tests};

fn main() -> ExitCode {
    test_suite::run(tests![
        in_a_walk_the_joints_stay_inside_their_ranges(Image),
        at_arming_a_joint_turns_to_the_park_pose_at_full_speed(Image),
        armed_again_a_digital_servo_does_not_jump(Image),
        a_cut_by_the_emergency_stop_turns_no_joint(Image),
        a_board_with_a_damaged_robot_record_has_no_servos(Image),
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
    // A digital servo starts 0.2 s late: the ramp to the gait has moved the setpoint by two degrees when it arrives.
    for (kind, (least_speed, near)) in KINDS.into_iter().zip([(390.0, 1.0), (600.0, 2.5)]) {
        let ran = run(kind, "2", &["--servo-at", "0,0,90,5"]);
        let angles = angles(&ran);
        let speeds = angles.windows(2).map(|pair| (pair[0].1[2] - pair[1].1[2]) / (pair[1].0 - pair[0].0));
        let fastest = speeds.fold(0.0, f64::max);
        report!("{kind}: the left knee turns from 90 degrees at {fastest:.0} degrees/s");
        assert!(fastest >= least_speed, "{kind}: {fastest} degrees/s");
        assert!(
            angles.iter().any(|(t_s, degrees, _)| *t_s < 0.8 && (degrees[2] - 5.0).abs() < near),
            "{kind}: it arrives"
        );
    }
}

/// Scale of the default robot, us for a degree.
const US_PER_DEGREE: f64 = 1000.0 / 90.0;
const FRAME_S: f64 = 0.02;

/// Highest speed over a servo frame, degrees/s, of a digital servo that stands at the first of these pulses and gets its supply with it.
fn highest_speed(pulses: &[(f64, f64)]) -> f64 {
    let (start_s, us) = pulses[0];
    let mut servo = Servo::new(&DataSheet::FT_7235, US_PER_DEGREE, (us - 1500.0) / US_PER_DEGREE);
    servo.set_supply(start_s, true);
    let mut fastest = 0.0_f64;
    for (start_s, us) in pulses {
        let before = servo.angle();
        servo.pulse(start_s + us * 1e-6, *us);
        servo.advance(start_s + us * 1e-6 + FRAME_S);
        fastest = fastest.max((servo.angle() - before).abs() / FRAME_S);
    }
    fastest
}

/// The emergency stop ends a walk; the supply goes with the pulses, and comes with those of the next arming. A digital servo starts meanwhile: it finds the
/// pulses where it stands, and follows them at the rate limit. Had they been held for two frames only, it would turn at its full speed.
fn armed_again_a_digital_servo_does_not_jump() {
    let again = ["--servo-at", "0,0,5,5", "--press", "3.4:0.4", "--press", "5.6:0.4"];
    let ran = run("digital", "7.5", &[&["--emergency-stop", STOP_TEST, "2.7:0.2"][..], &again].concat());
    ran.assert_sound();
    let second = ran.pulses.iter().filter(|(at, us)| *at > 5.0 && us.iter().all(Option::is_some));
    let second: Vec<(f64, [f64; 4])> = second.map(|(at, us)| (*at, us.map(|us| us.expect("checked")))).collect();
    let (armed_s, first) = second[0];
    // Up to the park pose: before the ramp.
    let motion: Vec<_> = second.iter().filter(|(at, _)| *at < armed_s + 0.9).collect();
    let (_, parked) = motion.last().expect("a motion");
    let farthest = |joint: &usize| (first[*joint] - parked[*joint]).abs();
    let joint = (0..4).max_by(|one, other| farthest(one).total_cmp(&farthest(other))).expect("four");
    let turned = farthest(&joint) / US_PER_DEGREE;

    let lines = angles(&ran);
    let lines: Vec<_> = lines.iter().filter(|(at, ..)| (armed_s..armed_s + 0.9).contains(at)).collect();
    let (_, before, _) = lines[0];
    let (_, after, _) = lines.last().expect("lines");
    assert!((after[joint] - before[joint]).abs() > 20.0, "nothing is shown: {before:?} to {after:?} degrees");
    let speed = |two: &[&(f64, [f64; 4], [f64; 4])]| (two[1].1[joint] - two[0].1[joint]).abs() / (two[1].0 - two[0].0);
    let fastest = lines.windows(2).map(speed).fold(0.0, f64::max);

    let held: Vec<_> = motion.iter().map(|(at, us)| (*at, us[joint])).collect();
    let resumed =
        |at: f64| if at < armed_s + 0.04 { Some(at) } else { Some(at - 0.46).filter(|at| *at >= armed_s + 0.04) };
    let two_frames: Vec<_> = held.iter().filter_map(|(at, us)| resumed(*at).map(|at| (at, *us))).collect();
    let [with, without] = [highest_speed(&held), highest_speed(&two_frames)];
    report!(
        "joint {joint} turns {turned:.0} degrees to the park pose: at {fastest:.0} degrees/s at most, by its pulses {with:.0}; held for two frames {without:.0}"
    );
    assert!(fastest < 530.0 && with < 530.0, "the joint turns at {fastest} degrees/s, by its pulses {with}");
    assert!(without > 600.0, "{without} degrees/s");
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

fn a_board_with_a_damaged_robot_record_has_no_servos() {
    let mut record = tempfile::NamedTempFile::new().expect("a file");
    record.write_all(&[0x55; 64]).expect("written");
    let mut flash = std::ffi::OsString::from(format!("{ROBOT_SECTOR:#010x}="));
    flash.push(record.path());
    let ran = std::process::Command::new(std::env::var_os("FOOTFALL_VIRTUAL_BOARD").expect("FOOTFALL_VIRTUAL_BOARD"))
        .arg(std::env::var_os("FOOTFALL_ELF").expect("FOOTFALL_ELF"))
        .args(["--secs", "0.1", "--servo", "digital", "--flash"])
        .arg(flash)
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
