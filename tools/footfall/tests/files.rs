//! `footfall check` and `footfall volts` take a recording of any format.

use gait_trace::format::{csv_file, opensim};
use std::ffi::OsString;
use std::path::Path;
use std::process::{Command, Output};

const DEFAULT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/traces/gaitkit_fukuchi_healthy.csv");

fn footfall(arguments: &[&str], path: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_footfall")).args(arguments).arg(OsString::from(path)).output().unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_recording_of_any_format_is_checked_and_made_volts() {
    let folder = tempfile::tempdir().unwrap();
    let recording = csv_file::read(Path::new(DEFAULT)).unwrap();
    let mot = folder.path().join("walk.mot");
    opensim::write(&mot, &recording).unwrap();
    // A laboratory's own table: semicolons, extension positive at the knees.
    let foreign = folder.path().join("lab.csv");
    let column = |name: &str| recording.channel(name).unwrap().values();
    let mut text =
        "Time (s);Left Hip Flexion (deg);Left Knee Flexion (deg);Right Hip Flexion (deg);Right Knee Flexion (deg)\n"
            .to_owned();
    let joints = ["left_hip", "left_knee", "right_hip", "right_knee"].map(column);
    for (row, time) in recording.time_s().iter().enumerate() {
        let [hip, knee, other_hip, other_knee] = joints.map(|joint| joint[row]);
        text += &format!("{time};{hip};{};{other_hip};{}\n", -knee, -other_knee);
    }
    std::fs::write(&foreign, text).unwrap();
    let plain = footfall(&["volts", "--trace"], Path::new(DEFAULT));
    let volts = |output: &Output| csv_file::parse("volts", output.stdout.as_slice()).unwrap();
    for (path, format, column) in [
        (&mot, "OpenSim motion", "left_knee  `knee_angle_l`, degrees, stated in the file, flexion positive"),
        (
            &foreign,
            "CSV, semicolons",
            "left_knee  `Left Knee Flexion (deg)`, degrees, stated in the file, sign changed",
        ),
    ] {
        let checked = footfall(&["check", "--trace"], path);
        let text = String::from_utf8(checked.stdout.clone()).unwrap();
        assert_eq!(checked.status.code(), Some(0), "{}", said(&checked));
        for words in [
            ": good: `fit` takes it, 2 strides of 1.088 s",
            column,
            format,
            "374 rows at 150.00 Hz, 2.487 s from 0 s on",
        ] {
            assert!(text.contains(words), "{words}: {text}");
        }
        let made = footfall(&["volts", "--trace"], path);
        assert_eq!(made.status.code(), Some(0), "{}", said(&made));
        let (one, two) = (volts(&plain), volts(&made));
        let (one, two) = (one.channels()[0].values(), two.channels()[0].values());
        // The cut into strides looks at all joints that there are, so that it may begin elsewhere; the volts are the same curve's.
        let ends = |x: &[f64]| (x.iter().copied().fold(9.0, f64::min), x.iter().copied().fold(0.0, f64::max));
        let ((a, b), (c, d)) = (ends(one), ends(two));
        assert!((a - c).abs() < 0.01 && (b - d).abs() < 0.01, "{format}: {a} to {b} V, {c} to {d} V");
    }
    // CSV of this program with a short hole, which is bridged.
    let holed = folder.path().join("holed.csv");
    let text = std::fs::read_to_string(DEFAULT).unwrap();
    let mut row = 0;
    let lines = text.lines().map(|line| {
        row += usize::from(line.starts_with(|c: char| c.is_ascii_digit()));
        let time = line.split(',').next().unwrap_or_default();
        if (100..104).contains(&row) { format!("{time},nan,,NaN,\n") } else { format!("{line}\n") }
    });
    std::fs::write(&holed, lines.collect::<String>()).unwrap();
    let made = footfall(&["volts", "--trace"], &holed);
    assert_eq!(made.status.code(), Some(0), "{}", said(&made));
    assert!(said(&made).contains("missing values; replaced by a cubic"), "{}", said(&made));
    for command in ["check", "volts"] {
        let output = footfall(&[command, "--trace"], &foreign);
        let text = said(&output) + &String::from_utf8_lossy(&output.stdout);
        assert!(text.contains("left knee: extension is positive in the file"), "{command}: {text}");
    }
}

/// What the file does not say comes from the options; what contradicts it is refused.
#[test]
fn options_complete_a_recording_and_never_contradict_it() {
    let folder = tempfile::tempdir().unwrap();
    let sensor = folder.path().join("sensor.toml");
    let points = "[[points]]\nsensor_v = 0.5\nangle_deg = -40.0\n[[points]]\nsensor_v = 2.5\nangle_deg = 90.0\n";
    std::fs::write(&sensor, format!("schema = 1\ninterpolation = \"linear\"\ndivider = 1.0\n{points}")).unwrap();
    let sensor = sensor.to_string_lossy().into_owned();
    let out = folder.path().join("out.csv");
    // Three swings of a knee in 3.3 s, or one in a cycle.
    let knee = |t: f64| {
        let p = std::f64::consts::TAU * t / 1.1;
        24.0 + 20.0 * p.cos() + 14.0 * (2.0 * p + 0.3).cos()
    };
    let table = |header: &str, rows: usize, row: &dyn Fn(usize) -> String| {
        let path = folder.path().join("in.csv");
        std::fs::write(&path, (0..rows).fold(format!("{header}\n"), |text, n| text + &row(n) + "\n")).unwrap();
        path
    };
    let convert = |path: &Path, more: &[&str]| {
        let mut arguments = vec!["convert", "--force", "--low-pass", "off", "-o", out.to_str().unwrap()];
        arguments.extend(more);
        let output = footfall(&arguments, path);
        (output.status.code(), said(&output))
    };
    let degrees =
        table("time_s,left_knee_deg", 331, &|n| format!("{},{:.4}", n as f64 / 100.0, knee(n as f64 / 100.0)));
    let (code, text) = convert(&degrees, &["--calibration", &sensor]);
    assert!(code == Some(2) && text.contains("no column is in volts") && !out.exists(), "{text}");
    let millivolts = |n: usize| format!("{n},{:.4}", 500.0 + (knee(n as f64 / 100.0) + 40.0) / 130.0 * 2000.0);
    let volts = table("Frame,left_knee (mV)", 331, &millivolts);
    let (code, text) = convert(&volts, &["--rate", "100"]);
    assert!(code == Some(2) && text.contains("--calibration FILE"), "{text}");
    let (code, text) = convert(&volts, &["--calibration", &sensor]);
    assert!(code == Some(2) && text.contains("--rate HZ"), "{text}");
    let (code, text) = convert(&volts, &["--calibration", &sensor, "--rate", "100"]);
    assert_eq!(code, Some(0), "{text}");
    let angles = csv_file::read(&out).unwrap();
    let found = angles.channel("left_knee").unwrap().values();
    assert!(found.len() == 331 && found.iter().enumerate().all(|(n, x)| (x - knee(n as f64 / 100.0)).abs() < 0.01));
    // A knee that swings to both sides.
    let both = table("time_s,left_knee_deg", 331, &|n| {
        format!("{},{:.4}", n as f64 / 100.0, 20.0 * (n as f64 / 100.0 * std::f64::consts::TAU / 1.1).sin())
    });
    let (code, text) = convert(&both, &[]);
    assert!(code == Some(2) && text.contains("`--knee-sign flexion`"), "{text}");
    let (code, text) = convert(&both, &["--knee-sign", "extension"]);
    assert!(code == Some(0) && text.contains("as requested"), "{text}");
    let hip = table("time_s,left_hip_deg", 331, &|n| {
        format!("{},{:.4}", n as f64 / 100.0, 20.0 + 20.0 * (n as f64 / 100.0 * std::f64::consts::TAU / 1.1).sin())
    });
    let (code, text) = convert(&hip, &["--hip-sign", "extension"]);
    assert!(code == Some(0) && text.contains("left hip: extension is positive in the file (as requested)"), "{text}");
    let angles = csv_file::read(&out).unwrap();
    assert!(angles.channel("left_hip").unwrap().values().iter().all(|angle| (-40.1..0.1).contains(angle)));
    assert!(std::fs::read_to_string(&out).unwrap().contains("--hip-sign extension"));
    let cycle = table("percent,left_knee_deg", 101, &|n| format!("{n},{:.4}", knee(n as f64 * 0.011)));
    let (code, text) = convert(&cycle, &[]);
    assert!(code == Some(0) && text.contains("`--stride-time S` gives the real duration"), "{text}");
    let (code, text) = convert(&cycle, &["--stride-time", "1.3"]);
    assert!(code == Some(0) && text.contains("it lasts 1.3 s, as requested"), "{text}");
    assert!((csv_file::read(&out).unwrap().duration_s() - 1.3).abs() < 1e-6);
}

#[test]
fn plain_files_keep_their_strict_reader_and_others_say_where_to_go() {
    let folder = tempfile::tempdir().unwrap();
    let put = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let hole = put("hole.csv", "time_s,left_knee_deg\n0,1\n0.01,\n0.02,3\n");
    let mapped = put("mapped.csv", "t,a,b\n0,1,2\n0.01,2,3\n");
    let output = footfall(&["volts", "--trace"], &hole);
    let text = said(&output);
    assert!(output.status.code() == Some(2) && text.contains("hole.csv: 3 rows; allowed are 16 or more"), "{text}");
    let output = footfall(&["volts", "--trace"], &mapped);
    let text = said(&output);
    assert!(
        output.status.code() == Some(2)
            && text.contains("`footfall convert` has options for what the file does not state"),
        "{text}"
    );
    assert!(output.stdout.is_empty());
    // Volts at a pin are a recording to play, and none to fit.
    let pin = put("pin.csv", "time_s,PA1\n0,1\n0.01,1.1\n0.02,1.2\n");
    let checked = footfall(&["check", "--trace"], &pin);
    let text = String::from_utf8(checked.stdout).unwrap();
    assert!(checked.status.code() == Some(2) && text.contains("`watch` and `volts` can play PA1, 0.020 s"), "{text}");
}
