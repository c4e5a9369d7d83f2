//! CSV files of other countries and other recorders: headings in other languages, lines of text above the header, angles from 0 to 360.

mod support;

use gait_trace::format::open;
use gait_trace::{RawJoints, ReadOptions, Rules, condition};
use joint_units::Joint;
use std::fmt::Write as _;
use support::{joint, walk};

/// The walk as CSV with these headings.
fn csv(headings: [&str; 5], change: impl Fn(f64) -> f64) -> String {
    let walk = walk();
    let mut text = headings.join(";") + "\n";
    for (row, time) in walk.time_s().iter().enumerate() {
        let _ = write!(text, "{time}");
        Joint::ALL.into_iter().for_each(|which| text += &format!(";{}", change(joint(&walk, which)[row])));
        text.push('\n');
    }
    text
}

fn read(text: &str, how: &ReadOptions<'_>) -> Result<RawJoints, String> {
    open::of_bytes("walk.csv", text.as_bytes(), how).map_err(|error| error.to_string())
}

const ENGLISH: [&str; 5] = ["time_s", "left_hip_deg", "right_hip_deg", "left_knee_deg", "right_knee_deg"];

#[test]
fn headings_in_other_languages_are_read() {
    let expected = read(&csv(ENGLISH, |x| x), &ReadOptions::default()).unwrap();
    for headings in [
        ["Zeit [s]", "Hüfte links [°]", "Hüfte rechts [°]", "Knie links [°]", "Knie rechts [°]"],
        ["tiempo (s)", "Cadera Izq (grados)", "Cadera Der (grados)", "Rodilla Izq (grados)", "Rodilla Der (grados)"],
        ["Temps (s)", "Hanche_G (deg)", "Hanche_D (deg)", "Genou_G (deg)", "Genou_D (deg)"],
        ["tempo (s)", "anca_sx (deg)", "anca_dx (deg)", "ginocchio_sx (deg)", "ginocchio_dx (deg)"],
        ["tijd (s)", "heup links (°)", "heup rechts (°)", "knie links (°)", "knie rechts (°)"],
        ["tempo (s)", "quadril esquerdo (°)", "quadril direito (°)", "joelho esquerdo (°)", "joelho direito (°)"],
    ] {
        let raw = read(&csv(headings, |x| x), &ReadOptions::default()).unwrap();
        for (which, (found, wanted)) in Joint::ALL.into_iter().zip(raw.joints.iter().zip(&expected.joints)) {
            let (found, wanted) = (found.as_ref().unwrap(), wanted.as_ref().unwrap());
            assert_eq!((found.column.as_str(), &found.angle_deg), (headings[which as usize + 1], &wanted.angle_deg));
        }
    }
}

#[test]
fn other_headings_are_refused_with_a_map_for_the_file() {
    let error = read(&csv(["時間", "左股", "右股", "左膝", "右膝"], |x| x), &ReadOptions::default()).unwrap_err();
    assert!(error.contains("here `--map time=1` if that is `時間`"), "{error}");
    let error = read(&csv(["t", "左股", "右股", "左膝", "右膝"], |x| x), &ReadOptions::default()).unwrap_err();
    assert!(error.contains("here `--map left_hip=2` if that is `左股`"), "{error}");
}

#[test]
fn lines_of_text_above_the_header_are_left_out_and_said() {
    let table = csv(ENGLISH, |x| x);
    let plain = read(&table, &ReadOptions::default()).unwrap();
    let text = format!("Patient: Max, Muster\nDate;1.2.2020\n\nRate;150 Hz\n{table}");
    let raw = read(&text, &ReadOptions::default()).unwrap();
    assert_eq!((&raw.time_s, &raw.joints), (&plain.time_s, &plain.joints));
    assert!(
        raw.notes.contains(&"Line 5 is read as the header; the lines above it are left out.".into()),
        "{:?}",
        raw.notes
    );
    // Errors name the line of the file.
    let error = read(&text.replacen("\n0;", "\nabc;", 1), &ReadOptions::default()).unwrap_err();
    assert!(error.starts_with("walk.csv:6: column 1 `time_s`: `abc`"), "{error}");
    let unclear = read(&text.replace("_hip", "_a").replace("_knee", "_b"), &ReadOptions::default()).unwrap_err();
    assert!(unclear.contains("this line has") && unclear.contains("from line 6 on have 5"), "{unclear}");
    let twice = read(
        &format!("Trials\n{}\n{table}", table.lines().take(4).collect::<Vec<_>>().join("\n")),
        &ReadOptions::default(),
    )
    .unwrap_err();
    assert!(twice.contains("may be the header"), "{twice}");
}

#[test]
fn angles_from_0_to_360_are_read_without_the_turns() {
    let plain = read(&csv(ENGLISH, |x| x), &ReadOptions::default()).unwrap();
    for (what, change) in [("360", 360.0), ("2 pi", std::f64::consts::TAU)] {
        let headings =
            if change == 360.0 { ENGLISH } else { ["time_s", "left_hip", "right_hip", "left_knee", "right_knee"] };
        let turned = csv(headings, |x| (x / 360.0).rem_euclid(1.0) * change);
        let raw = read(&turned, &ReadOptions::default()).unwrap();
        assert!(
            raw.notes.iter().any(|note| note.contains("`left_hip") && note.contains("steps of a whole turn")),
            "{:?}",
            raw.notes
        );
        for (found, wanted) in raw.joints.iter().flatten().zip(plain.joints.iter().flatten()) {
            let apart = found.angle_deg.iter().zip(&wanted.angle_deg).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(apart < 1e-9, "{what}: {apart}");
        }
        assert!(condition(&raw, &Rules::default()).is_ok());
    }
}
