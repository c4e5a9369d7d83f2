//! Shared code of the fuzz targets: reads the bytes with several options and checks the guarantees of `RawJoints`.
//!
//! ```text
//! cargo +nightly fuzz run c3d fuzz/corpus/c3d tests/corpus/c3d -- -max_total_time=60
//! ```
//! Run it in the parent of this folder. Put each failing input into `../tests/corpus/<reader>/found_*`; an ordinary test reads the
//! files there.

use gait_trace::ReadOptions;
use gait_trace::{RawJoints, TraceError};
use hgod_adc::{Calibration, CalibrationPoint, Interpolation};
use joint_units::{Radians, Volts};

/// One reader.
pub type Reader = fn(&str, &[u8], &ReadOptions<'_>) -> Result<RawJoints, TraceError>;

/// Reads the bytes with several options and checks each result.
///
/// # Panics
/// A result breaks a guarantee.
pub fn check(name: &str, reader: Reader, bytes: &[u8]) {
    let point = |volts, degrees| CalibrationPoint { volts: Volts(volts), angle: Radians::from_degrees(degrees) };
    let table = Calibration::new(&[point(0.5, -40.0), point(2.5, 90.0)], Interpolation::Linear);
    let calibration = table.as_ref().ok();
    for map in ["", "left_knee=CH1", "time=1,left_hip=2,left_knee=3"] {
        let mut how = ReadOptions { calibration, ..ReadOptions::default() };
        if !map.is_empty() {
            how.add_map(map).expect("a good map");
        }
        match reader(name, bytes, &how) {
            Ok(raw) => check_guarantees(&raw),
            Err(error) => assert!(error.to_string().starts_with(name)),
        }
    }
}

fn check_guarantees(raw: &RawJoints) {
    assert!(raw.time_s.len() >= 2 && raw.time_s.iter().all(|time| time.is_finite()));
    assert!(raw.joints.iter().any(Option::is_some));
    for joint in raw.joints.iter().flatten() {
        assert_eq!(joint.angle_deg.len(), raw.time_s.len());
        assert!(joint.angle_deg.iter().any(|angle| !angle.is_nan()));
        assert!(joint.angle_deg.iter().all(|angle| angle.is_nan() || angle.abs() <= 200.0));
    }
}
