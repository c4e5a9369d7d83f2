//! Recordings of the synthetic person: CSV, OpenSim .mot, C3D, and the volts of a sensor on an oscilloscope.

#[allow(dead_code, reason = "the tests of the reader use the other number formats")]
#[path = "../../../gait-trace/tests/support/c3d_writer.rs"]
mod c3d_writer;

use super::motion::{RATE_HZ, ankles, rows};
use super::random::Noise;
use super::sensor;
use c3d_writer::{C3d, Format};
use std::fmt::Write as _;

/// CSV of the project: 40 s, so long that a follower learns its corrections.
pub(super) fn csv() -> String {
    let mut text = String::from("time_s,left_hip_deg,right_hip_deg,left_knee_deg,right_knee_deg\n");
    for (row, [a, b, c, d]) in rows(40.0, 1).into_iter().enumerate() {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{:.2},{a:.2},{b:.2},{c:.2},{d:.2}", row as f64 / RATE_HZ);
    }
    text
}

/// OpenSim, version 3, degrees; knees with extension positive, as most models have them: 12 s.
pub(super) fn mot() -> String {
    let rows = rows(12.0, 2);
    let mut text = format!(
        "Coordinates\nversion=1\nnRows={}\nnColumns=5\ninDegrees=yes\nendheader\n\
         time\thip_flexion_l\thip_flexion_r\tknee_angle_l\tknee_angle_r\n",
        rows.len()
    );
    for (row, [a, b, c, d]) in rows.into_iter().enumerate() {
        let _ = writeln!(text, "{:.2}\t{a:.2}\t{b:.2}\t{:.2}\t{:.2}", row as f64 / RATE_HZ, -c, -d);
    }
    text
}

/// OpenSim as [`mot`], with the ankles and with noise of its own: 12 s.
pub(super) fn with_ankles() -> String {
    let (legs, feet) = (rows(12.0, 10), ankles(12.0, 11));
    let mut text = format!(
        "Coordinates\nversion=1\nnRows={}\nnColumns=7\ninDegrees=yes\nendheader\n\
         time\thip_flexion_l\thip_flexion_r\tknee_angle_l\tknee_angle_r\tankle_angle_l\tankle_angle_r\n",
        legs.len()
    );
    for (row, ([a, b, c, d], [e, f])) in legs.into_iter().zip(feet).enumerate() {
        let _ = writeln!(text, "{:.2}\t{a:.2}\t{b:.2}\t{:.2}\t{:.2}\t{e:.2}\t{f:.2}", row as f64 / RATE_HZ, -c, -d);
    }
    text
}

/// Angles as Plug-in Gait names them, scaled integers: 12 s.
pub(super) fn c3d() -> Vec<u8> {
    let rows = rows(12.0, 3);
    let names = ["LHipAngles", "RHipAngles", "LKneeAngles", "RKneeAngles"];
    let points = names.into_iter().enumerate().map(|(joint, name)| {
        let places = rows.iter().map(|row| Some([row[joint] as f32, 0.0, 0.0])).collect();
        (name.to_owned(), places)
    });
    let mut file = C3d::new(Format::Intel, Some(0.01), RATE_HZ as f32, points.collect());
    file.texts.push(("POINT", "ANGLE_UNITS", "deg"));
    file.bytes()
}

/// The volts of the sensor of `sensor.toml` on the left knee, as a Tektronix oscilloscope writes them: 15 s.
pub(super) fn oscilloscope() -> String {
    let rows = rows(15.0, 4);
    let mut noise = Noise::new(5);
    let mut text = format!(
        "Model,MDO3024\nFirmware Version,1.26\n\nHorizontal Units,s\nSample Interval,0.01\nRecord Length,{}\n\
         Vertical Units,V\n,\nLabel,\nTIME,CH1\n",
        rows.len()
    );
    for (row, [_, _, left_knee, _]) in rows.into_iter().enumerate() {
        let volts = sensor::volts(left_knee) + noise.normal(0.001);
        let _ = writeln!(text, "{:.2},{volts:.4}", row as f64 / RATE_HZ);
    }
    text
}
