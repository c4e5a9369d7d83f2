//! The guarantees of `RawJoints`: what holds of all that a reader gives.

use gait_trace::RawJoints;

/// Panics if one of them does not hold.
pub(crate) fn check(raw: &RawJoints) {
    assert!(raw.time_s.len() >= 2 && raw.time_s.iter().all(|time| time.is_finite()));
    assert!(raw.joints.iter().any(Option::is_some));
    for joint in raw.joints.iter().flatten() {
        assert_eq!(joint.angle_deg.len(), raw.time_s.len());
        assert!(joint.angle_deg.iter().any(|angle| !angle.is_nan()));
        assert!(joint.angle_deg.iter().all(|angle| angle.is_nan() || angle.abs() <= 200.0));
    }
}
