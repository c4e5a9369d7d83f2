//! The four joints as a file has them: the output of every reader, before any repair, change of sign or cut.

use joint_units::Joint;

/// One column of a file that was recognised as a joint.
#[derive(Debug, Clone, PartialEq)]
pub struct RawJoint {
    /// The column's name in the file, or the trajectories that the angle was computed from.
    pub column: String,
    /// Angle in degrees with the file's own sign, one value per row; NaN where the file has no value.
    pub angle_deg: Vec<f64>,
}

/// Joint angles as read: times may be uneven, values may be missing, signs are those of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct RawJoints {
    /// The file's name.
    pub file: String,
    /// The file's format in words: `OpenSim motion, version 1, tabs, radians`.
    pub format: String,
    /// Time in seconds, as in the file: finite, but not necessarily increasing.
    pub time_s: Vec<f64>,
    /// In the order of [`Joint::ALL`]; `None` where the file has no such joint.
    pub joints: [Option<RawJoint>; Joint::COUNT],
    /// Decisions of the reader that the user should know, one sentence each.
    pub notes: Vec<String>,
}
