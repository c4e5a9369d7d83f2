//! What the tests of the readers share: a real walk, and files made from it.
#![allow(dead_code, reason = "each test binary uses its part")]

pub(crate) mod c3d_writer;

use c3d_writer::{C3d, Format};
use gait_trace::Recording;
use gait_trace::format::csv_file;
use hgod_adc::{Calibration, CalibrationPoint, Interpolation};
use joint_units::{Joint, Radians, Volts};
use std::fmt::Write as _;
use std::path::Path;

/// The recording in tests/traces: overground walking, 150 Hz, four joints.
pub(crate) fn walk() -> Recording {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/traces/gaitkit_fukuchi_healthy.csv");
    csv_file::read(&path).expect("the recording in tests/traces")
}

/// One joint of a recording, in degrees.
pub(crate) fn joint(recording: &Recording, joint: Joint) -> &[f64] {
    recording.channel(joint.name()).expect("a joint of the recording").values()
}

pub(crate) fn rate_hz(recording: &Recording) -> f32 {
    let times = recording.time_s();
    ((times.len() - 1) as f64 / recording.duration_s()).round() as f32
}

/// Points as Plug-in Gait makes of angles: the first component is flexion.
pub(crate) fn angle_points(recording: &Recording) -> Vec<(String, Vec<Option<[f32; 3]>>)> {
    let names = ["LHipAngles", "RHipAngles", "LKneeAngles", "RKneeAngles"];
    let points = Joint::ALL.into_iter().zip(names).map(|(which, name)| {
        let values = joint(recording, which).iter().map(|&angle| Some([angle as f32, 3.0, -4.0])).collect();
        (format!("Anna:{name}"), values)
    });
    [("LASI".to_owned(), vec![Some([100.0, 200.0, 900.0]); recording.time_s().len()])]
        .into_iter()
        .chain(points)
        .collect()
}

/// The person's orientation in the laboratory.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stand {
    pub(crate) up: [f64; 3],
    pub(crate) forward: [f64; 3],
    /// Millimetres from one frame to the next; 0 on a treadmill.
    pub(crate) step_mm: f64,
    /// Degrees by which the direction turns over the recording.
    pub(crate) turn_deg: f64,
}

/// Joint centres by forward kinematics: hips 160 mm apart, thighs of 420 mm, shanks of 400 mm.
pub(crate) fn centre_points(recording: &Recording, stand: Stand) -> Vec<(String, Vec<Option<[f32; 3]>>)> {
    let frames = recording.time_s().len();
    let (up, ahead) = (stand.up, stand.forward);
    let left = cross(up, ahead);
    let mut middle = [310.0, -170.0, 40.0];
    let mut points: Vec<(String, Vec<Option<[f32; 3]>>)> =
        ["LHJC", "LKJC", "LAJC", "RHJC", "RKJC", "RAJC"].map(|name| (name.to_owned(), Vec::new())).into();
    for frame in 0..frames {
        let turn = (stand.turn_deg * (frame as f64 / frames as f64 - 0.5)).to_radians();
        let forward = sum(&[(ahead, turn.cos()), (left, turn.sin())]);
        let left = cross(up, forward);
        middle = sum(&[(middle, 1.0), (forward, stand.step_mm)]);
        let height = sum(&[(middle, 1.0), (up, 850.0)]);
        for (leg, side) in [1.0, -1.0].into_iter().enumerate() {
            let [hip, knee] =
                [Joint::ALL[leg], Joint::ALL[leg + 2]].map(|which| joint(recording, which)[frame].to_radians());
            let shank = hip - knee;
            let at_hip = sum(&[(height, 1.0), (left, 80.0 * side)]);
            let at_knee = sum(&[(at_hip, 1.0), (forward, 420.0 * hip.sin()), (up, -420.0 * hip.cos())]);
            let at_ankle = sum(&[(at_knee, 1.0), (forward, 400.0 * shank.sin()), (up, -400.0 * shank.cos())]);
            for (n, place) in [at_hip, at_knee, at_ankle].into_iter().enumerate() {
                points[leg * 3 + n].1.push(Some(place.map(|value| value as f32)));
            }
        }
    }
    points
}

/// A TRC file of points, as motion capture programs write it; a missing point has empty fields.
pub(crate) fn trc(points: &[(String, Vec<Option<[f32; 3]>>)], rate_hz: f64) -> String {
    let frames = points[0].1.len();
    let mut text = format!(
        "PathFileType\t4\t(X/Y/Z)\twalk.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n{rate_hz:.2}\t{rate_hz:.2}\t{frames}\t{}\tmm\t{rate_hz:.2}\t1\t{frames}\nFrame#\tTime",
        points.len()
    );
    points.iter().for_each(|(name, _)| text += &format!("\t{name}\t\t"));
    text += "\n\t";
    (1..=points.len()).for_each(|n| text += &format!("\tX{n}\tY{n}\tZ{n}"));
    text += "\n\n";
    for frame in 0..frames {
        let _ = write!(text, "{}\t{}", frame + 1, frame as f64 / rate_hz);
        for (_, track) in points {
            match track[frame] {
                Some([x, y, z]) => text += &format!("\t{x}\t{y}\t{z}"),
                None => text += "\t\t\t",
            }
        }
        text.push('\n');
    }
    text
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn sum(parts: &[([f64; 3], f64)]) -> [f64; 3] {
    std::array::from_fn(|n| parts.iter().map(|(vector, factor)| vector[n] * factor).sum())
}

pub(crate) fn c3d_of_angles(format: Format, scale: Option<f32>) -> C3d {
    let walk = walk();
    let mut file = C3d::new(format, scale, rate_hz(&walk), angle_points(&walk));
    file.texts.push(("POINT", "ANGLE_UNITS", "deg"));
    file
}

/// An OpenSim file of a recording: version 1 to 3, tabs or blanks, degrees or radians.
pub(crate) fn mot(recording: &Recording, version: u8, separator: &str, in_degrees: bool) -> String {
    let rows = recording.time_s().len();
    let yes = if in_degrees { "yes" } else { "no" };
    let mut text = match version {
        3 => format!(
            "inDegrees={yes}\nnColumns=6\nnRows={rows}\nDataType=double\nversion=3\nOpenSimVersion=4.4\nendheader\n"
        ),
        _ => format!(
            "Coordinates\nversion={version}\nnRows={rows}\nnColumns=6\ninDegrees={yes}\n\nUnits are S.I. units (second, meters, Newtons, ...)\n\nendheader\n"
        ),
    };
    let names = if version == 3 {
        [
            "/jointset/hip_l/hip_flexion_l/value",
            "/jointset/hip_r/hip_flexion_r/value",
            "/jointset/knee_l/knee_angle_l/value",
            "/jointset/knee_r/knee_angle_r/value",
        ]
    } else {
        ["hip_flexion_l", "hip_flexion_r", "knee_angle_l", "knee_angle_r"]
    };
    let _ = writeln!(text, "time{separator}pelvis_tx{separator}{}", names.join(separator));
    for (row, time) in recording.time_s().iter().enumerate() {
        let _ = write!(text, "{time}{separator}0.25");
        for which in Joint::ALL {
            let degrees = joint(recording, which)[row];
            let _ = write!(text, "{separator}{}", if in_degrees { degrees } else { degrees.to_radians() });
        }
        text.push('\n');
    }
    text
}

/// 0.5 V to 2.5 V for -40 to 90 degrees.
pub(crate) fn calibration() -> Calibration {
    let point = |volts, degrees| CalibrationPoint { volts: Volts(volts), angle: Radians::from_degrees(degrees) };
    Calibration::new(&[point(0.5, -40.0), point(2.5, 90.0)], Interpolation::Linear).expect("a good table")
}

/// The volts of an angle, by that table.
pub(crate) fn volts(degrees: f64) -> f64 {
    0.5 + (degrees + 40.0) / 130.0 * 2.0
}
