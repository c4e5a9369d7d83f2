//! How large the corrections of a follower become: on a simulated person whose measured joint differs from its template by twice what is usual.
//!
//! The person walks at the template's cadence; the measured angle is the template plus smooth random differences (white noise through two
//! low-pass filters of 0.03 strides each), so large that the innovation's root mean square is [`TIMES_USUAL`] times the usual one. Up to
//! there corrections act in full ([`cpg_core::entrainment::correction`]). If the follower does not stay locked then, the differences are halved.
//! The same samples go to the follower without corrections; the difference of the two are the corrections.

use cpg_core::entrainment::correction::LARGEST;
use cpg_core::entrainment::{Corrections, Follower, Lock};
use cpg_core::{Follow, Generator};
use joint_loop::{FollowConfig, GateConfig};
use joint_units::{Joint, Period, Radians};
use serde::Serialize;

use crate::led::SimulatedPerson;

/// Root mean square of the innovation, divided by the usual one.
pub const TIMES_USUAL: f64 = 2.0;
/// Time constant of each low-pass filter of the differences, strides.
const SMOOTH_STRIDES: f64 = 0.03;
/// Strides that are measured, and those before them.
const STRIDES: (f64, f64) = (60.0, 10.0);
/// Most halvings of the differences.
const HALVINGS: u32 = 12;
/// Part of the time at its bound from which on a correction is refused: its gains do not fit its recording.
pub const AT_BOUND: f64 = 0.05;

/// What the corrections of a follower do.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Corrected {
    /// The largest correction that is possible, degrees. It is added to each joint that is corrected; the gate limits the sum.
    pub bound_deg: f64,
    /// Root mean square of the innovation while this was measured, degrees; the gains' usual one is half of it, or less.
    pub innovation_deg: f64,
    /// The joints that are corrected.
    pub joints: Vec<CorrectedJoint>,
}

/// The correction of one joint.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CorrectedJoint {
    /// `left_hip`, `right_hip`, `left_knee` or `right_knee`.
    pub name: &'static str,
    /// Root mean square of the correction, degrees.
    pub rms_deg: f64,
    /// Largest correction, degrees.
    pub largest_deg: f64,
    /// Part of the time at the bound.
    pub at_bound: f64,
    /// Smallest angle with corrections, degrees.
    pub least_deg: f64,
    /// Largest angle with corrections, degrees.
    pub most_deg: f64,
    /// Whether both are within the range of the robot; the gate holds the joint there if not.
    pub inside_range: bool,
}

impl Corrected {
    /// Why the corrections are refused; none if they are accepted.
    #[must_use]
    pub fn refused_because(&self) -> Option<String> {
        let joint = self.joints.iter().find(|joint| joint.at_bound > AT_BOUND)?;
        Some(format!(
            "the correction of {} is at its bound of {:.1} degrees in {:.0} % of the time, with an innovation of {:.2} degrees; allowed is {:.0} %",
            joint.name,
            self.bound_deg,
            100.0 * joint.at_bound,
            self.innovation_deg,
            100.0 * AT_BOUND
        ))
    }

    /// The rows of a table for people: name and text.
    #[must_use]
    pub fn in_words(&self) -> Vec<(&'static str, String)> {
        let first = format!(
            "at most {:.1} deg at each joint, within the gate; with an innovation of {:.2} deg:",
            self.bound_deg, self.innovation_deg
        );
        let joints = self.joints.iter().map(|joint| {
            let range = if joint.inside_range { "inside the range" } else { "BEYOND THE RANGE, held at its end" };
            let CorrectedJoint { name, rms_deg, largest_deg, least_deg, most_deg, .. } = joint;
            (
                "",
                format!(
                    "{name} {rms_deg:.1} rms, {largest_deg:.1} largest; {least_deg:.1} to {most_deg:.1} deg: {range}"
                ),
            )
        });
        std::iter::once(("corrections", first)).chain(joints).collect()
    }
}

/// Measures the corrections; `None` if there are none.
///
/// # Errors
/// The follower cannot be built; the text says why.
pub(crate) fn corrected(config: &FollowConfig, gate: &GateConfig) -> Result<Option<Corrected>, String> {
    if config.corrections.is_none() {
        return Ok(None);
    }
    let without = build(config, &Corrections::NONE)?;
    let with = build(config, &config.corrections)?;
    let wanted = TIMES_USUAL * f64::from(config.corrections.usual_innovation.0);
    let mut size = wanted;
    let mut innovation = None;
    for _ in 0..HALVINGS {
        innovation = Run { config, size }.innovation(without);
        match innovation {
            // The lock takes up a part of the differences: they are made larger by that, once.
            Some(found) => {
                let larger = size * (size / found).clamp(1.0, 2.0);
                if let Some(found) = (Run { config, size: larger }).innovation(without) {
                    (size, innovation) = (larger, Some(found));
                }
                break;
            }
            None => size *= 0.5,
        }
    }
    let Some(innovation) = innovation else {
        return Err("its corrections cannot be measured: it does not stay locked".into());
    };
    let joints = Run { config, size }.joints(with, without, gate);
    let bound_deg = f64::from(LARGEST).to_degrees();
    Ok(Some(Corrected { bound_deg, innovation_deg: innovation.to_degrees(), joints }))
}

fn build(config: &FollowConfig, corrections: &Corrections) -> Result<Follower, String> {
    let shapes = config.shape.shapes().map_err(|error| error.to_string())?;
    let follower = config.entrained().build(shapes, config.sensor, Period::MILLISECOND);
    follower.and_then(|follower| follower.with_corrections(corrections)).map_err(|error| error.to_string())
}

/// A person with differences of this size: their root mean square, rad.
struct Run<'a> {
    config: &'a FollowConfig,
    size: f64,
}

impl Run<'_> {
    /// The samples, with whether the tick is measured.
    fn samples(&self) -> impl Iterator<Item = (Radians, bool)> {
        let stride_s = f64::from(self.config.shape.stride_s);
        // Built before: the shapes are valid.
        let template = self.config.shape.shapes().ok().map(|shapes| shapes[self.config.sensor as usize]);
        let person = template.map(|template| SimulatedPerson::new(template, 0.0, stride_s));
        let ticks = |strides: f64| (strides * stride_s * 1e3) as u32;
        let (measured, settled) = (ticks(STRIDES.0), ticks(STRIDES.1));
        let step = 1e-3 / (SMOOTH_STRIDES * stride_s);
        // White noise of variance 1 leaves two equal low-pass filters with the variance step / 4.
        let scale = self.size / (step / 4.0).sqrt();
        let mut passed = [0.0; 2];
        person.into_iter().flat_map(move |mut person| {
            (0..settled + measured).map(move |tick| {
                let angle = person.tick();
                passed[0] += (person.random.normal() - passed[0]) * step;
                passed[1] += (passed[0] - passed[1]) * step;
                (Radians(angle.0 + (scale * passed[1]) as f32), tick >= settled)
            })
        })
    }

    /// Root mean square of the innovation, rad; `None` if it does not stay locked.
    fn innovation(&self, mut follower: Follower) -> Option<f64> {
        let (mut squares, mut count) = (0.0, 0.0);
        for (angle, measured) in self.samples() {
            follower.observe(Some(angle));
            follower.step();
            if measured {
                if follower.status().state != Lock::Locked {
                    return None;
                }
                squares += f64::from(follower.phase_lock().innovation().0).powi(2);
                count += 1.0;
            }
        }
        Some((squares / count).sqrt())
    }

    fn joints(&self, mut with: Follower, mut without: Follower, gate: &GateConfig) -> Vec<CorrectedJoint> {
        let bound = f64::from(LARGEST);
        let mut joints = Joint::ALL.map(|joint| CorrectedJoint {
            name: joint.name(),
            rms_deg: 0.0,
            largest_deg: 0.0,
            at_bound: 0.0,
            least_deg: f64::INFINITY,
            most_deg: f64::NEG_INFINITY,
            inside_range: false,
        });
        let mut count = 0.0;
        for (angle, measured) in self.samples() {
            for follower in [&mut with, &mut without] {
                follower.observe(Some(angle));
                follower.step();
            }
            if !measured {
                continue;
            }
            count += 1.0;
            for (joint, (with, without)) in joints.iter_mut().zip(with.angles().iter().zip(without.angles())) {
                let correction = f64::from(with.0 - without.0).abs();
                joint.rms_deg += correction * correction;
                joint.largest_deg = joint.largest_deg.max(correction.to_degrees());
                joint.at_bound += f64::from(u8::from(correction > 0.98 * bound));
                joint.least_deg = joint.least_deg.min(f64::from(with.degrees()));
                joint.most_deg = joint.most_deg.max(f64::from(with.degrees()));
            }
        }
        for (joint, range) in joints.iter_mut().zip(&gate.range) {
            joint.rms_deg = (joint.rms_deg / count).sqrt().to_degrees();
            joint.at_bound /= count;
            let [least, most] = [range.least, range.most].map(|end| f64::from(end.degrees()));
            joint.inside_range = joint.least_deg >= least && joint.most_deg <= most;
        }
        let gains = self.config.corrections.gains;
        let is_corrected = |joint: &Joint| gains[*joint as usize].as_flattened().iter().any(|gain| *gain != 0.0);
        Joint::ALL.into_iter().zip(joints).filter(|(joint, _)| is_corrected(joint)).map(|(_, joint)| joint).collect()
    }
}
