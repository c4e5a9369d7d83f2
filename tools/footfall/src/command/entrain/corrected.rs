//! The run of a follower with corrections that were learned from other strides of the same recording.

use cpg_core::entrainment::Corrections;
use gait_fit::corrections::{Recorded, learn};
use gait_trace::Recording;
use joint_units::Joint;

use super::run::{self, Entrainment, Following, Holes, TICKS_PER_S, Tick, within};

/// A follower with corrections.
#[derive(Debug, Clone)]
pub struct Corrected {
    /// Learned from the whole recording.
    pub corrections: Corrections,
    /// Every tick; in each tenth of the recording with the corrections that were learned from the rest.
    pub ticks: Vec<Tick>,
    /// How well that follows.
    pub following: Following,
}

/// Learns corrections for the follower of a run and repeats the run with them. `None` if there are too few strides
/// ([`gait_fit::corrections::LEAST_STRIDES`]).
#[must_use]
pub fn corrected(recording: &Recording, sensor: Joint, holes: &Holes, run: &Entrainment) -> Option<Corrected> {
    let follower = run::follower(run.templates, sensor, run.learned.stride_s).ok()?;
    let samples = run::without(run::samples(recording, sensor).ok()?, &holes.sensor);
    let lost = |tick: usize| within(&holes.any, tick as f64 / TICKS_PER_S);
    let angles = Joint::ALL.map(|joint| {
        let is_there = joint == sensor || recording.channel(joint.name()).is_ok();
        let angles = if is_there { run::samples(recording, joint).unwrap_or_default() } else { vec![] };
        angles.into_iter().enumerate().map(|(tick, angle)| if lost(tick) { f64::NAN } else { angle }).collect()
    });
    let learned = learn(follower, &Recorded { samples: &samples, joints: angles.each_ref().map(Vec::as_slice) })?;
    let mut ticks = Vec::with_capacity(samples.len());
    for (span, corrections) in &learned.held_out {
        let mut follower = follower.with_corrections(corrections).ok()?;
        let part = run::run(&mut follower, samples[..span.end].iter().copied());
        ticks.extend_from_slice(&part[span.clone()]);
    }
    let templates = run.templates.map(Some);
    let following = run::judge_without(&ticks, recording, sensor, &run.learned, &templates, &holes.any);
    Some(Corrected { corrections: learned.corrections, ticks, following })
}
