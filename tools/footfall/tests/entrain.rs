//! `footfall entrain` called as a program: any file that `fit` reads, captures of one sensor, and its output.

mod support;

use gait_trace::Recording;
use gait_trace::format::{csv_file, opensim};
use joint_units::Joint;
use serde_json::Value;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use support::{Bench, SimulatedBoard};

fn entrain(file: &Path, more: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_footfall"));
    command.arg("entrain").arg(file).args(more).stdin(Stdio::null()).output().unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The object of a run that ended well.
fn object(file: &Path, more: &[&str]) -> Value {
    let output = entrain(file, &[more, &["--json"]].concat());
    assert_eq!(output.status.code(), Some(0), "{}: {}", file.display(), said(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn rmse(object: &Value) -> [Option<f64>; 4] {
    Joint::ALL.map(|joint| object["steady_rmse_deg"][joint.name()].as_f64())
}

/// Angles of a person whose stride time varies a little: left and right hip, left and right knee, degrees.
fn angles(t: f64) -> [f64; 4] {
    let cycles = t / 1.15 + 0.01 * (0.7 * t).sin();
    let of = |mean: f64, one: f64, two: f64, turn: f64, lead: f64| {
        let p = TAU * (cycles + lead);
        mean + one * p.cos() + two * (2.0 * p + turn).cos()
    };
    let hip = |lead| of(8.0, 21.0, 5.0, 2.5, lead);
    let knee = |lead| of(24.0, 20.0, 15.0, 0.3, lead + 0.24);
    [hip(0.0), hip(0.5), knee(0.0), knee(0.5)]
}

/// 24 s of it, a row every 10 ms, in the sign and unit that `written` makes of degrees.
fn text(header: &str, separator: &str, joints: &[usize], written: impl Fn(f64) -> f64) -> String {
    let mut text = format!("{header}\n");
    for row in 0..2400 {
        let t = f64::from(row) * 0.01;
        let _ = write!(text, "{t:.2}");
        for &joint in joints {
            let _ = write!(text, "{separator}{:.5}", written(angles(t)[joint]));
        }
        text.push('\n');
    }
    text
}

const OURS: &str = "time_s,left_hip_deg,right_hip_deg,left_knee_deg,right_knee_deg";

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

fn put(folder: &tempfile::TempDir, name: &str, text: &str) -> PathBuf {
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    path
}

fn recording() -> Recording {
    csv_file::parse("walk.csv", text(OURS, ",", &[0, 1, 2, 3], |deg| deg).as_bytes()).unwrap()
}

#[test]
fn the_object_has_lock_errors_of_four_joints_false_locks_and_holds() {
    let folder = folder();
    let path = put(&folder, "walk.csv", &text(OURS, ",", &[0, 1, 2, 3], |deg| deg));
    for sensor in ["left_hip", "right_hip", "left_knee", "right_knee"] {
        let object = object(&path, &["--sensor", sensor]);
        let lock = object["lock_s"].as_f64().unwrap();
        assert!((0.1..3.5).contains(&lock), "{sensor}: {lock}");
        assert!(rmse(&object).iter().all(|rmse| rmse.is_some_and(|rmse| rmse > 0.0 && rmse < 2.5)), "{object}");
        assert_eq!((object["false_locks"].as_u64(), object["holds"].as_u64()), (Some(0), Some(0)));
        assert_eq!(object["hold_events"].as_array().unwrap().len(), 0);
        assert_eq!((object["false_stops"].as_u64(), object["slips"].as_u64()), (Some(0), Some(0)));
        for joint in Joint::ALL.map(Joint::name) {
            let [got, perfect, ratio] = ["steady_rmse_deg", "perfect_phase_rmse_deg", "ratio"]
                .map(|key| object[key][joint].as_f64().unwrap_or_else(|| panic!("{key} of {joint}: {object}")));
            assert!((ratio - got / perfect).abs() < 1e-6 && perfect < 2.0, "{joint}: {object}");
        }
        assert_eq!((object["sensor"].as_str(), object["core"].as_str()), (Some(sensor), Some("host")));
        assert!((object["stride_s"].as_f64().unwrap() - 1.15).abs() < 0.02);
        assert!((object["cadence_steps_per_min"].as_f64().unwrap() - 104.3).abs() < 1.5);
    }
    // Without --sensor it is the left hip.
    assert_eq!(object(&path, &[])["sensor"], "left_hip");
}

/// A person whose phase wanders within the stride, more quickly than a follower's estimate; the left knee has noise of 2 degrees instead.
fn jittery(noise_deg: f64, wander: f64) -> String {
    let mut seed = 1u32;
    let mut noise = || {
        // The sum of four uniform numbers from -0.5 to 0.5 has the variance 1/3.
        let mut sum = 0.0;
        for _ in 0..4 {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            sum += f64::from(seed >> 8) / 16_777_216.0 - 0.5;
        }
        noise_deg * 3.0_f64.sqrt() * sum
    };
    let mut text = format!("{OURS}\n");
    for row in 0..4500 {
        let t = f64::from(row) * 0.01;
        let [lh, rh, lk, rk] = angles(t + wander * (TAU * 1.3 * t).sin());
        let _ = writeln!(text, "{t:.2},{lh:.5},{rh:.5},{:.5},{rk:.5}", lk + noise());
    }
    text
}

#[test]
fn a_joint_above_what_is_possible_is_a_warning() {
    let folder = folder();
    // Noise that no phase explains is as large with a perfect phase.
    let noisy = object(&put(&folder, "noisy.csv", &jittery(2.0, 0.0)), &["--sensor", "left_hip"]);
    assert_eq!(noisy["verdict"]["left_knee"], "within_perfect_phase", "{noisy}");
    let bound = noisy["causal_bound_deg"]["left_knee"].as_f64().unwrap();
    assert!((1.94..2.16).contains(&bound), "{bound}");
    assert_eq!(noisy["causal_bound_deg"]["left_hip"], 0.0);

    let path = put(&folder, "jittery.csv", &jittery(0.0, 0.02));
    let object = object(&path, &[]);
    assert_eq!(object["verdict"]["right_knee"], "above", "{object}");
    assert!(object["causal_bound_deg"]["right_knee"].as_f64().unwrap() < 1.0, "{object}");
    let lenient = entrain(&path, &[]);
    let words = said(&lenient);
    assert!(lenient.status.code() == Some(0) && words.contains("warning: right_knee: error of"), "{words}");
    let text = String::from_utf8_lossy(&lenient.stdout);
    assert!(text.contains("\ncausal_bound_deg left_hip 0.00") && text.contains("right_knee above"), "{text}");
    let strict = entrain(&path, &["--strict"]);
    let words = said(&strict);
    assert!(strict.status.code() == Some(1) && words.contains("--strict allows no warning: "), "{words}");
    assert!(!strict.stdout.is_empty(), "what was measured is reported first");

    // Enough strides for a bound, and too few for corrections: that is said, and it is no warning.
    let middle: String = jittery(0.0, 0.02).lines().take(2500).map(|line| format!("{line}\n")).collect();
    let path = put(&folder, "middle.csv", &middle);
    let strict = entrain(&path, &["--strict", "--json"]);
    let words = said(&strict);
    let object: Value = serde_json::from_slice(&strict.stdout).unwrap();
    assert_eq!((strict.status.code(), &object["corrections"]), (Some(0), &Value::from("none")), "{words}");
    assert!(object["verdict"]["right_knee"] == "above" && object["corrected_rmse_deg"].is_null(), "{object}");
    assert!(words.contains("note: right_knee: error of") && !words.contains("warning: "), "{words}");
    let why = "no corrections, so the errors are those of the templates alone: the follower was locked at full amplitude for ";
    assert!(
        words.contains(why) && words.contains("not counting the first 3 s of a lock; allowed is 20 or more"),
        "{words}"
    );

    // Too few strides for a bound.
    let short: String = jittery(0.0, 0.02).lines().take(1500).map(|line| format!("{line}\n")).collect();
    let object = self::object(&put(&folder, "short.csv", &short), &[]);
    assert_eq!(
        (&object["causal_bound_deg"]["right_knee"], &object["verdict"]["right_knee"]),
        (&Value::Null, &Value::from("not_known"))
    );
}

/// The same walk in every dress: what comes out is the same.
#[test]
fn every_format_that_is_fitted_is_played() {
    let folder = folder();
    let ours = put(&folder, "walk.csv", &text(OURS, ",", &[0, 1, 2, 3], |deg| deg));
    let plain = object(&ours, &[]);
    let mot = folder.path().join("walk.mot");
    opensim::write(&mot, &recording()).unwrap();
    let header = "Time (s);hl;hr;kl;kr";
    let foreign = put(&folder, "foreign.csv", &text(header, ";", &[0, 1, 2, 3], f64::to_radians).replace('.', ","));
    // Knees as OpenSim's older models have them, by names of a laboratory.
    let header = "time,hip_flexion_l,hip_flexion_r,knee_angle_l,knee_angle_r";
    let backwards = put(&folder, "backwards.csv", &{
        let mut text = format!("{header}\n");
        for row in 0..2400 {
            let [lh, rh, lk, rk] = angles(f64::from(row) * 0.01);
            let _ = writeln!(text, "{:.2},{lh:.5},{rh:.5},{:.5},{:.5}", f64::from(row) * 0.01, -lk, -rk);
        }
        text
    });
    let map = ["--map", "left_hip=hl,right_hip=hr,left_knee=4,right_knee=5", "--unit", "rad"];
    for (path, more, format) in [
        (&mot, &[][..], "OpenSim motion"),
        (&foreign, &map[..], "CSV, semicolons"),
        (&backwards, &[][..], "CSV, commas"),
    ] {
        let other = object(path, more);
        assert!(other["format"].as_str().unwrap().starts_with(format), "{}", other["format"]);
        assert!((other["lock_s"].as_f64().unwrap() - plain["lock_s"].as_f64().unwrap()).abs() < 0.02, "{format}");
        for (a, b) in rmse(&plain).iter().zip(rmse(&other)) {
            assert!((a.unwrap() - b.unwrap()).abs() < 0.02, "{format}: {other}");
        }
    }
    let notes = said(&entrain(&backwards, &[]));
    assert!(notes.contains("left knee: extension is positive in the file"), "{notes}");
    // Without a map the columns are nobody's.
    let output = entrain(&foreign, &[]);
    assert!(output.status.code() == Some(2) && said(&output).contains("left_hip=COLUMN"), "{}", said(&output));
}

/// A low-pass is what is asked for, and else there is none: a core on a leg has none either.
#[test]
fn a_low_pass_is_asked_for() {
    let folder = folder();
    let path = put(&folder, "walk.csv", &text(OURS, ",", &[0, 1, 2, 3], |deg| deg));
    assert!(!said(&entrain(&path, &[])).contains("low-pass"));
    let notes = said(&entrain(&path, &["--low-pass", "8"]));
    assert!(notes.contains("low-pass") && notes.contains("8 Hz"), "{notes}");
}

/// The board that plays lines: its left knee is a sine of 1.1 s. No other joint is in a capture.
#[test]
fn a_capture_of_one_sensor_takes_the_other_joints_from_the_default() {
    let mut simulated = SimulatedBoard::new();
    simulated.walk(24);
    simulated.end();
    let bench = Bench::plays(&simulated.lines);
    let mut locks = vec![];
    for name in ["walk.csv", "walk.mcap"] {
        let file = bench.path(name);
        let mut command = Command::new(env!("CARGO_BIN_EXE_footfall"));
        command.arg("record").arg("--elf").arg(bench.path("fw.elf")).arg("--virtual-board").arg(bench.path("board"));
        let output = command.args(["--secs", "24", "--out"]).arg(&file).stdin(Stdio::null()).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", said(&output));
        let object = object(&file, &[]);
        assert_eq!(object["sensor"], "left_knee", "the only joint there is");
        assert!(object["template"].as_str().unwrap().ends_with("; default left_hip, right_hip, right_knee"));
        let [None, None, Some(knee), None] = rmse(&object) else { panic!("{object}") };
        assert!(knee < 3.0, "{object}");
        assert_eq!((object["false_locks"].as_u64(), object["holds"].as_u64()), (Some(0), Some(0)), "{object}");
        locks.push(object["lock_s"].as_f64().unwrap());
        // A sensor that nobody wore is refused by what there is.
        let output = entrain(&file, &["--sensor", "left_hip"]);
        assert_eq!(output.status.code(), Some(2));
        let notes = said(&output);
        assert!(notes.contains("no left_hip to play; there is left_knee: allowed is --sensor"), "{notes}");
    }
    assert_eq!(locks[0], locks[1], "both formats hold the same");
}

/// The generator file has templates and sensor; its cycle may begin elsewhere than the recording's.
#[test]
fn a_generator_file_has_templates_and_sensor() {
    let folder = folder();
    let path = put(&folder, "walk.csv", &text(OURS, ",", &[0, 1, 2, 3], |deg| deg));
    for (more, kind) in [(&["--follow", "right_hip"][..], "follow"), (&[][..], "shape")] {
        let generator = folder.path().join(format!("{kind}.toml"));
        let mut command = Command::new(env!("CARGO_BIN_EXE_footfall"));
        let output = command.arg("fit").arg(&path).arg("-o").arg(&generator).args(more).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", said(&output));
        let file = generator.to_str().unwrap();
        let driven = object(&path, &["--generator", file]);
        assert_eq!(driven["sensor"], if kind == "follow" { "right_hip" } else { "left_hip" });
        assert_eq!(driven["template"], file);
        // The errors are on the strides that it was fitted to.
        assert_eq!((&driven["fitted_to_this"], &driven["corrections"]), (&Value::from(true), &Value::from("none")));
        let notes = said(&entrain(&path, &["--generator", file]));
        assert!(notes.contains("note: the generator was fitted to this recording: the errors are not"), "{notes}");
        assert!(rmse(&driven).iter().all(|rmse| rmse.is_some_and(|rmse| rmse < 2.5)), "{driven}");
        assert_eq!(driven["false_locks"], 0);
        // One knee of it alone: the file has the rest.
        let knee = put(&folder, "knee.csv", &text("time_s,left_knee_deg", ",", &[2], |deg| deg));
        let alone = object(&knee, &["--generator", file]);
        assert_eq!((alone["sensor"].as_str(), alone["false_locks"].as_u64()), (Some("left_knee"), Some(0)));
        assert_eq!(alone["fitted_to_this"], false);
        assert!(rmse(&alone)[2].is_some_and(|rmse| rmse < 2.5), "{alone}");
    }
    let robust = folder.path().join("robust.toml");
    let defaults = Command::new(env!("CARGO_BIN_EXE_footfall")).args(["defaults", "generator"]).output().unwrap();
    std::fs::write(&robust, defaults.stdout).unwrap();
    let output = entrain(&path, &["--generator", robust.to_str().unwrap()]);
    let notes = said(&output);
    assert!(output.status.code() == Some(2) && notes.contains("allowed are `shape` and `follow`"), "{notes}");
}

/// A sensor without samples for 0.8 s: the follower reports a hold, goes on, and locks again; short gaps are bridged.
#[test]
fn a_hole_in_the_recording_is_a_lost_sensor() {
    let folder = folder();
    let hole = |from: f64, to: f64| {
        let whole = text(OURS, ",", &[0, 1, 2, 3], |deg| deg);
        let rows = whole.lines().map(|line| {
            let time = line.split(',').next().unwrap().parse().unwrap_or(-1.0);
            if (from..to).contains(&time) { format!("{time},,,,") } else { line.to_owned() }
        });
        rows.collect::<Vec<_>>().join("\n") + "\n"
    };
    let lost = put(&folder, "lost.csv", &hole(18.0, 18.8));
    let object = object(&lost, &[]);
    let events = object["hold_events"].as_array().unwrap();
    assert_eq!(object["holds"].as_u64(), Some(events.len() as u64));
    assert!(!events.is_empty() && events.iter().all(|event| event["fault"] == "missing"), "{object}");
    let at = events[0]["t_s"].as_f64().unwrap();
    assert!((18.0..18.1).contains(&at), "{at}");
    assert_eq!(object["false_locks"], 0);
    assert!(rmse(&object).iter().all(|rmse| rmse.is_some_and(|rmse| rmse < 2.5)), "{object}");
    let notes = said(&entrain(&lost, &[]));
    assert!(notes.contains("17.990 s to 18.800 s"), "{notes}");
    let short = put(&folder, "short.csv", &hole(18.0, 18.05));
    let output = entrain(&short, &["--json"]);
    let bridged: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(bridged["holds"], 0, "{bridged}");
}

/// A goniometer's file that names no side.
#[test]
fn a_knee_without_a_side_is_the_one_that_is_asked_for() {
    let folder = folder();
    let knee = put(&folder, "knee.csv", &text("time_s,knee_deg", ",", &[2], |deg| deg));
    for (more, sensor) in [(&[][..], "left_knee"), (&["--sensor", "right_knee"][..], "right_knee")] {
        let object = object(&knee, more);
        assert_eq!(object["sensor"], sensor);
        let note = format!("`knee_deg` names no side; it is read as {sensor}.");
        assert_eq!(object["notes"][0].as_str(), Some(note.as_str()));
    }
    let output = entrain(&knee, &["--sensor", "left_hip"]);
    assert!(output.status.code() == Some(2) && said(&output).contains("there is left_knee"), "{}", said(&output));
}

#[test]
fn recordings_that_cannot_be_played_are_refused() {
    let folder = folder();
    let pin = put(&folder, "pin.csv", &text("time_s,PA1", ",", &[2], |deg| 1.0 + deg / 100.0));
    let cycle: String = (0..=100).map(|n| format!("{},{}\n", n, angles(f64::from(n) * 0.0115)[0].round())).collect();
    let cycle = put(&folder, "cycle.csv", &format!("time_s,left_hip_deg\n{cycle}"));
    let still = put(&folder, "still.csv", &text("time_s,left_hip_deg", ",", &[0], |_| 5.0));
    let hanging = text(OURS, ",", &[0, 1, 2, 3], |deg| deg);
    let hanging: String = hanging
        .lines()
        .map(|line| match line.split(',').collect::<Vec<_>>()[..] {
            [time, _, b, c, d] if !time.contains("time") => format!("{time},12.0,{b},{c},{d}\n"),
            _ => format!("{line}\n"),
        })
        .collect();
    let hanging = put(&folder, "hanging.csv", &hanging);
    for (path, words) in [
        (
            &hanging,
            "left_hip does not move (range 0.00 degrees), so its sensor shows no phase; allowed is --sensor with a joint",
        ),
        (&pin, "no channel is assigned to a joint"),
        (&cycle, "the time axis is a cycle; allowed is a recording in seconds"),
        (&still, "no joint moves"),
        (&folder.path().join("none.csv"), "cannot be read"),
        (&folder.path().to_path_buf(), "no regular file"),
    ] {
        let output = entrain(path, &["--json"]);
        let notes = said(&output);
        assert_eq!(output.status.code(), Some(2), "{notes}");
        assert!(output.stdout.is_empty() && notes.contains(words), "{words}: {notes}");
    }
}
