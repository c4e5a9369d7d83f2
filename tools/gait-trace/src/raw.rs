//! What a reader hands on: the four joints as the file has them, before anything is repaired, flipped or cut.

use joint_units::Joint;

/// One column of a file that was taken for a joint.
#[derive(Debug, Clone, PartialEq)]
pub struct RawJoint {
    /// The column's name in the file, or the trajectories that the angle was computed from.
    pub column: String,
    /// Degrees, in the file's own sign, a value a row; NaN where the file has none.
    pub angle_deg: Vec<f64>,
}

/// Joint angles as read: times may be uneven, values may be missing, signs are the file's.
#[derive(Debug, Clone, PartialEq)]
pub struct RawJoints {
    /// The file's name.
    pub file: String,
    /// What kind of file it was, in words for a person: `OpenSim .mot version 1, tabs, radians`.
    pub format: String,
    /// Seconds, as in the file: finite, but not checked to increase.
    pub time_s: Vec<f64>,
    /// In the order of [`Joint::ALL`]; `None` where the file has no such joint.
    pub joints: [Option<RawJoint>; Joint::COUNT],
    /// What the reader decided by itself and a person should know, a sentence each.
    pub notes: Vec<String>,
}
