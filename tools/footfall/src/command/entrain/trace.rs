//! What is played to the core, from a file of any format: the joints as `fit` reads them, without what only hindsight could mend.
//!
//! Times are made even, short gaps are bridged and signs turned as `fit` does it, each told. Not mended are jumps, since a sensor that
//! jumps is what the core must live with, and longer gaps: there the core gets no sample.

use gait_trace::{Conditioned, Done, Finding, FindingKind, LowPass, Rules, condition};
use gait_trace::{RawJoints, Recording};
use joint_units::Joint;

use super::run::Holes;
use crate::failure::Failure;

/// A recording and the joint that wears the sensor.
#[derive(Debug, Clone)]
pub struct Trace {
    /// The joints.
    pub recording: Recording,
    /// The joint that wears the sensor.
    pub sensor: Joint,
    /// What was not measured.
    pub holes: Holes,
    /// What kind of file it was.
    pub format: String,
    /// What the reader decided and what was done about the recording, a sentence each.
    pub notes: Vec<String>,
}

/// Prepares a recording for the core. `asked` is the joint that wears the sensor by the caller, `wanted` the one that the walker's file
/// says; with neither it is the recording's only joint, or the left hip.
///
/// # Errors
/// The recording has no such joint, is a cycle and no time, or cannot be conditioned.
pub fn trace(
    raw: &RawJoints,
    asked: Option<Joint>,
    wanted: Option<Joint>,
    low_pass: Option<LowPass>,
) -> Result<Trace, Failure> {
    let sensor = sensor(raw, asked, wanted)?;
    let low_pass = low_pass.unwrap_or(LowPass::Off);
    let rules = Rules { low_pass, jump_bend_deg: f64::INFINITY, ..Rules::default() };
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
    let notes = raw.notes.iter().cloned().chain(findings.iter().map(ToString::to_string)).collect();
    Ok(Trace { recording, sensor, holes, format: raw.format.clone(), notes })
}

fn sensor(raw: &RawJoints, asked: Option<Joint>, wanted: Option<Joint>) -> Result<Joint, Failure> {
    let there: Vec<Joint> = Joint::ALL.into_iter().filter(|joint| raw.joints[*joint as usize].is_some()).collect();
    let sensor = asked.or(wanted.filter(|joint| there.contains(joint))).unwrap_or(match there[..] {
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
