//! The input of a follower from a recording of any format: the joints as `fit` reads them, without corrections that need later samples.
//!
//! Time steps are made equal, short gaps are bridged and signs turned as in `fit`, each with a note. Jumps are kept, since a follower must
//! handle a sensor that jumps; in longer gaps it gets no sample.

use gait_fit::following::run::Holes;
use gait_trace::{Conditioned, Done, Finding, FindingKind, Rules, condition};
use gait_trace::{RawJoints, Recording};
use joint_units::Joint;

use crate::failure::Failure;

/// A recording and the joint with the sensor.
#[derive(Debug, Clone)]
pub struct Trace {
    /// The joints.
    pub recording: Recording,
    /// The joint with the sensor.
    pub sensor: Joint,
    /// The spans that were not measured.
    pub holes: Holes,
    /// The kind of file.
    pub format: String,
    /// Decisions of the reader, one sentence each.
    pub notes: Vec<String>,
    /// Defects of the recording and what was done about each.
    pub findings: Vec<Finding>,
}

/// Prepares a recording. `asked` is the joint with the sensor by the caller, `of_file` the one of the generator file; with neither it is the
/// recording's only joint, or the left hip.
///
/// # Errors
/// The recording has no such joint, its time axis is a cycle, or it cannot be conditioned.
pub fn trace(raw: &RawJoints, asked: Option<Joint>, of_file: Option<Joint>, rules: &Rules) -> Result<Trace, Failure> {
    let sensor = sensor(raw, asked, of_file)?;
    let rules = Rules { jump_bend_deg: f64::INFINITY, ..*rules };
    let Conditioned { recording, findings, unusable, normalised_cycle, .. } =
        condition(raw, &rules).map_err(Failure::input)?;
    if normalised_cycle {
        return Err(Failure::input(format!(
            "{}: the time axis is a cycle; allowed is a recording in seconds, of two strides or more",
            raw.file
        )));
    }
    let is_hole = |finding: &&Finding| {
        let left_out = finding.what == FindingKind::Gap && finding.done == Done::LeftOut;
        left_out && finding.joint.is_none_or(|joint| joint == sensor)
    };
    let holes = findings.iter().filter(is_hole).map(|finding| (finding.from_s, finding.to_s)).collect();
    let holes = Holes { sensor: holes, any: unusable };
    let mut notes = raw.notes.clone();
    if let Some(of_file) = of_file.filter(|of_file| *of_file != sensor) {
        notes.push(format!("the generator file follows {}; {} is played", of_file.name(), sensor.name()));
    }
    Ok(Trace { recording, sensor, holes, format: raw.format.clone(), notes, findings })
}

fn sensor(raw: &RawJoints, asked: Option<Joint>, of_file: Option<Joint>) -> Result<Joint, Failure> {
    let there: Vec<Joint> = Joint::ALL.into_iter().filter(|joint| raw.joints[*joint as usize].is_some()).collect();
    let sensor = asked.or(of_file.filter(|joint| there.contains(joint))).unwrap_or(match there[..] {
        [only] => only,
        _ => Joint::LeftHip,
    });
    if there.contains(&sensor) {
        return Ok(sensor);
    }
    let names: Vec<&str> = there.iter().map(|joint| joint.name()).collect();
    let (file, sensor, names) = (&raw.file, sensor.name(), names.join(", "));
    Err(Failure::input(format!(
        "{file}: no {sensor} to play; there is {names}: allowed is --sensor with one of these, or --map {sensor}=COLUMN"
    )))
}
