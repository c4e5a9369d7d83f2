//! Calls the program, and makes movements to call it with.
#![allow(dead_code, reason = "each test file uses a part of it")]

use std::ffi::OsString;
use std::process::{Command, Output, Stdio};

pub(crate) const DEFAULT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/traces/gaitkit_fukuchi_healthy.csv");

pub(crate) fn footfall<A: Into<OsString>>(arguments: impl IntoIterator<Item = A>) -> Output {
    Command::new(env!("CARGO_BIN_EXE_footfall"))
        .args(arguments.into_iter().map(Into::into))
        .stdin(Stdio::null())
        .output()
        .expect("footfall runs")
}

/// Exit code, standard output, standard error.
pub(crate) fn parts(output: Output) -> (i32, String, String) {
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
    (output.status.code().expect("a code"), text(output.stdout), text(output.stderr))
}

/// Both streams.
pub(crate) fn said(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

pub(crate) fn table(seconds: f64, angles: impl Fn(f64) -> [f64; 4]) -> String {
    let mut csv = String::from("time_s,left_hip_deg,right_hip_deg,left_knee_deg,right_knee_deg\n");
    for row in 0..(seconds * 100.0) as usize {
        let t = row as f64 * 0.01;
        let [a, b, c, d] = angles(t);
        csv += &format!("{t:.2},{a:.4},{b:.4},{c:.4},{d:.4}\n");
    }
    csv
}

/// Walking; `right_s` is how much later than half a stride the right leg is.
pub(crate) fn walk(seconds: f64, stride_s: f64, right_s: f64) -> String {
    table(seconds, |t| {
        let joint = |mean: f64, one: f64, two: f64, turn: f64, t: f64| {
            let p = std::f64::consts::TAU * t / stride_s;
            mean + one * p.cos() + two * (2.0 * p + turn).cos()
        };
        let right = t + 0.5 * stride_s - right_s;
        let hip = |t: f64| joint(8.0, 21.0, 4.0, 2.6, t);
        let knee = |t: f64| joint(24.0, 20.0, 15.0, 0.2, t + 0.24 * stride_s);
        [hip(t), hip(right), knee(t), knee(right)]
    })
}

/// Squats of two seconds.
pub(crate) fn squats() -> String {
    table(12.0, |t| {
        let depth = |t: f64| 0.5 - 0.5 * (std::f64::consts::PI * t).cos();
        let (left, right) = (depth(t), 0.96 * depth(t - 0.02));
        [5.0 + 110.0 * left, 5.0 + 110.0 * right, 4.0 + 115.0 * left, 4.0 + 115.0 * right]
    })
}
