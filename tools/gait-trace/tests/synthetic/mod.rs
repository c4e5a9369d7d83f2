//! A synthetic gait of known phase, with harmonics of the size and phase of human walking.
#![allow(dead_code, reason = "each test binary uses its part")]

use gait_trace::{RawJoint, RawJoints};
use joint_units::Joint;
use std::f64::consts::TAU;

/// Angle of a joint at a phase in cycles, degrees, flexion positive.
pub(crate) fn angle(joint: Joint, phase: f64) -> f64 {
    let is_right = matches!(joint, Joint::RightHip | Joint::RightKnee);
    let p = TAU * (phase + if is_right { 0.5 } else { 0.0 });
    match joint {
        Joint::LeftHip | Joint::RightHip => {
            8.0 + 21.0 * p.cos() + 4.6 * (2.0 * p + 2.6).cos() + 1.2 * (3.0 * p + 1.0).cos()
        }
        Joint::LeftKnee | Joint::RightKnee => {
            let p = p + 1.5;
            24.0 + 20.0 * p.cos() + 16.0 * (2.0 * p + 0.2).cos() + 5.0 * (3.0 * p + 0.5).cos() + 1.5 * (4.0 * p).cos()
        }
    }
}

/// Columns from a function of joint and time.
pub(crate) fn raw(time_s: Vec<f64>, x: impl Fn(Joint, f64) -> f64) -> RawJoints {
    let joints = Joint::ALL.map(|joint| {
        let angle_deg = time_s.iter().map(|&t| x(joint, t)).collect();
        Some(RawJoint::degrees(joint.name(), angle_deg))
    });
    RawJoints {
        file: "walk.csv".into(),
        format: "made up".into(),
        time_s,
        received: false,
        joints,
        notes: vec![],
        doubts: vec![],
    }
}

/// Even times.
pub(crate) fn times(seconds: f64, rate_hz: f64) -> Vec<f64> {
    (0..=(seconds * rate_hz) as usize).map(|n| n as f64 / rate_hz).collect()
}

/// Steady walking.
pub(crate) fn walk(seconds: f64, rate_hz: f64, period_s: f64, phase: f64) -> RawJoints {
    raw(times(seconds, rate_hz), |joint, t| angle(joint, t / period_s + phase))
}

/// The numbers of a column.
pub(crate) fn column(raw: &mut RawJoints, joint: Joint) -> &mut Vec<f64> {
    &mut raw.joints[joint as usize].as_mut().expect("the joint is there").angle_deg
}
