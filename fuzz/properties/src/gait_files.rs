//! Readers of recorded gait: what is read satisfies the guarantees of `RawJoints`, and an error begins with the name of the file.

use gait_trace::format::{c3d as c3d_file, gcd as gcd_file, mcap_file, mvnx as mvnx_file, trc as trc_file};
use gait_trace::format::{mapped_csv, open as any_file, opensim as opensim_file, scope as scope_file};
use gait_trace::format::{vicon as vicon_file, visual3d as visual3d_file};
use gait_trace::{RawJoints, ReadOptions, TraceError};
use hgod_adc::{Calibration, CalibrationPoint, Interpolation};
use joint_units::{Radians, Volts};

use crate::guarantees;

type Reader = fn(&str, &[u8], &ReadOptions<'_>) -> Result<RawJoints, TraceError>;

/// The format that the content chooses.
pub fn open(bytes: &[u8]) {
    check("a", any_file::of_bytes, bytes);
}

/// Comma-separated values.
pub fn csv(bytes: &[u8]) {
    check("a.csv", mapped_csv::parse, bytes);
}

/// Motion and storage files of OpenSim.
pub fn opensim(bytes: &[u8]) {
    check("a.mot", opensim_file::parse, bytes);
}

/// C3D.
pub fn c3d(bytes: &[u8]) {
    check("a.c3d", c3d_file::parse, bytes);
}

/// Exports of oscilloscopes.
pub fn scope(bytes: &[u8]) {
    check("a.csv", scope_file::parse, bytes);
}

/// Joint states of ROS 2 in MCAP.
pub fn mcap(bytes: &[u8]) {
    check("a.mcap", mcap_file::parse, bytes);
}

/// Marker trajectories.
pub fn trc(bytes: &[u8]) {
    check("a.trc", trc_file::parse, bytes);
}

/// Exports of Xsens.
pub fn mvnx(bytes: &[u8]) {
    check("a.mvnx", mvnx_file::parse, bytes);
}

/// Exports of Vicon Nexus.
pub fn vicon(bytes: &[u8]) {
    check("a.csv", vicon_file::parse, bytes);
}

/// Exports of Visual3D.
pub fn visual3d(bytes: &[u8]) {
    check("a.txt", visual3d_file::parse, bytes);
}

/// Gait cycle data.
pub fn gcd(bytes: &[u8]) {
    check("a.gcd", gcd_file::parse, bytes);
}

/// Reads the bytes with several options and checks each result.
fn check(name: &str, reader: Reader, bytes: &[u8]) {
    let point = |volts, degrees| CalibrationPoint { volts: Volts(volts), angle: Radians::from_degrees(degrees) };
    let table = Calibration::new(&[point(0.5, -40.0), point(2.5, 90.0)], Interpolation::Linear).expect("it rises");
    for map in ["", "left_knee=CH1", "time=1,left_hip=2,left_knee=3"] {
        let mut how = ReadOptions { calibration: Some(&table), ..ReadOptions::default() };
        if !map.is_empty() {
            how.add_map(map).expect("a good map");
        }
        match reader(name, bytes, &how) {
            Ok(raw) => guarantees::check(&raw),
            Err(error) => assert!(error.to_string().starts_with(name), "{error}"),
        }
    }
}
