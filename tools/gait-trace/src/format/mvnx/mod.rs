//! Reads MVNX, the XML of Xsens MVN (versions 3 and 4): the joint angles of a body of inertial sensors.
//!
//! `<subject frameRate=..>` has a list of `<joint label=..>` and a list of `<frame type=.. index=.. time=..>`; the element
//! `<jointAngle>` of a frame has three angles of each joint in degrees, of which the third is flexion (Euler angles in the order Z, X, Y).
//! Frames of another type than `normal` are poses of the calibration; they are skipped and counted. The time of a frame is in
//! milliseconds, often whole ones; where the numbers of the frames agree with it, they give the time.
//!
//! References to entities are never expanded, and a file that defines some is refused.

#[cfg(feature = "interchange")]
mod document;
#[cfg(feature = "interchange")]
mod times;

use crate::fault::TraceError;
use crate::format::description::{DEFINED, Description};
use crate::options::ReadOptions;
use crate::raw::RawJoints;
use memchr::memmem;

/// The row of the table of formats.
pub(crate) const DESCRIPTION: Description = Description {
    name: "MVNX of Xsens MVN (`.mvnx`); its joint angles in CSV are read as any CSV, with `--rate`",
    recognised: "XML with the element `mvnx`",
    units: "degrees, by definition of the format",
    axes: "the third angle of the joints `jLeftHip`, `jRightKnee`, ...",
    signs: DEFINED,
    rate: "`time` of the frames, in ms, or their numbers at `frameRate` where these agree with it",
    options: &["--map", "--unit", "--hip-sign", "--knee-sign", "--mirror", "--stride-time"],
};

/// Whether the text begins like an MVNX file.
pub(crate) fn looks_like(text: &str) -> bool {
    let head = text.trim_start().as_bytes();
    head.starts_with(b"<") && memmem::find(&head[..head.len().min(4096)], b"<mvnx").is_some()
}

/// Reads the bytes of a file.
///
/// # Errors
/// The first fault of the file, with its line.
///
/// ```
/// use gait_trace::ReadOptions;
/// use gait_trace::format::mvnx;
/// let text = b"<mvnx version='4'><subject frameRate='60'><frames><frame/></frames></subject></mvnx>";
/// let error = mvnx::parse("walk.mvnx", text, &ReadOptions::default()).unwrap_err().to_string();
/// assert!(error.starts_with("walk.mvnx:1: `<joints>` is missing"), "{error}");
/// ```
#[cfg(feature = "interchange")]
pub fn parse(name: &str, bytes: &[u8], how: &ReadOptions<'_>) -> Result<RawJoints, TraceError> {
    document::parse(name, crate::format::text_table::text(name, bytes)?, how)
}

/// Refuses the file: this build has no reader of XML.
///
/// # Errors
/// Always.
#[cfg(not(feature = "interchange"))]
pub fn parse(name: &str, _: &[u8], _: &ReadOptions<'_>) -> Result<RawJoints, TraceError> {
    let fault = crate::fault::Fault::Unsupported {
        what: "an MVNX file of Xsens MVN",
        instead: "this build of the program has no reader of XML; `cargo footfall convert` writes the angles as CSV",
    };
    Err(TraceError::new(name, None, fault))
}
