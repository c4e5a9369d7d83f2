//! The run of a follower with corrections that were learned from other strides of the same recording.

use crate::corrections::{JointOutcome, Learned, NotLearned, Recorded, learn};
use cpg_core::entrainment::Corrections;
use gait_trace::Recording;
use joint_units::Joint;

use super::run::{self, Entrainment, Following, Holes, within};
use super::tick::{TICKS_PER_S, Tick};

/// A follower with corrections.
#[derive(Debug, Clone)]
pub struct Corrected {
    /// Learned from the whole recording.
    pub corrections: Corrections,
    /// What was learned for each joint.
    pub joints: [JointOutcome; Joint::COUNT],
    /// Every tick; in each tenth of the recording with the corrections that were learned from the rest.
    pub ticks: Vec<Tick>,
    /// How well that follows.
    pub following: Following,
}

/// Learns corrections for the follower of a run and repeats the run with them.
///
/// # Errors
/// Why there are none: too few strides ([`crate::corrections::LEAST_STRIDES`]), for instance.
pub fn corrected(
    recording: &Recording,
    sensor: Joint,
    holes: &Holes,
    run: &Entrainment,
) -> Result<Corrected, NotLearned> {
    let unusable = |why: &dyn std::fmt::Display| NotLearned::Unusable(why.to_string());
    let follower = run::follower(run.templates, sensor, run.learned.stride_s).map_err(|why| unusable(&why))?;
    let samples = run::samples(recording, sensor).map_err(|why| unusable(&why))?;
    let samples = run::without(samples, &holes.sensor);
    let lost = |tick: usize| within(&holes.any, tick as f64 / TICKS_PER_S);
    let angles = Joint::ALL.map(|joint| {
        let is_there = joint == sensor || recording.channel(joint.name()).is_ok();
        let angles = if is_there { run::samples(recording, joint).unwrap_or_default() } else { vec![] };
        angles.into_iter().enumerate().map(|(tick, angle)| if lost(tick) { f64::NAN } else { angle }).collect()
    });
    let Learned { corrections, held_out, joints } =
        learn(follower, &Recorded { samples: &samples, joints: angles.each_ref().map(Vec::as_slice) })?;
    let mut ticks = Vec::with_capacity(samples.len());
    for (span, corrections) in &held_out {
        let mut follower = follower.with_corrections(corrections).map_err(|why| unusable(&why))?;
        let part = run::run(&mut follower, samples[..span.end].iter().copied());
        ticks.extend_from_slice(&part[span.clone()]);
    }
    let templates = run.templates.map(Some);
    let following = run::judge_without(&ticks, recording, sensor, &run.learned, &templates, &holes.any);
    Ok(Corrected { corrections, joints, ticks, following })
}
