//! The same motion inside the limits of the default robot.
//!
//! The gait at the lowest and that at the highest cadence are scaled and shifted into the limits, each by itself
//! ([`generator_file::inside_limits`]). A gait between them is a mean of the two at every phase, and ranges and poses are convex, so it is
//! inside too. Its rates may be beyond by `(r + 1/r - 2) / 4` with the ratio r of the cadences, 0.4 % for the run: less than the margin of
//! 0.5 % that the limits are drawn in by.

use gait_fit::series::Series;
use generator_file::file::{Coefficients, GeneratorSet, ShapeJoint, ShapeSet};
use generator_file::inside_limits::inside_limits;
use joint_loop::LoopConfig;

use crate::gait_family::leg::{HARMONICS, Leg, mean};

/// A leg inside the limits.
#[derive(Debug, Clone, PartialEq)]
pub struct Inside {
    /// The leg.
    pub leg: Leg,
    /// Root mean square change of hip and knee, degrees.
    pub cost_deg: [f64; 2],
}

/// The nearest gait of both legs alike inside the limits of the default robot.
///
/// # Errors
/// There is none; the text says why.
pub fn inside(leg: &Leg, cadence: f64) -> Result<Inside, String> {
    let found = inside_limits(&GeneratorSet::Shape(set_of(leg, cadence)), &LoopConfig::default_biped())?;
    let GeneratorSet::Shape(set) = found.set else { return Err("another kind of generator".into()) };
    // The limits of both legs are alike, so the mean of a solution and its mirror image is one too.
    let [left_hip, right_hip, left_knee, right_knee] = set.joints.each_ref().map(series);
    let both = |left: &Series, right: &Series| mean(left, &right.from_phase(0.5));
    let [a, b, c, d] = found.cost_deg;
    Ok(Inside {
        leg: Leg { hip: both(&left_hip, &right_hip), knee: both(&left_knee, &right_knee) },
        cost_deg: [f64::midpoint(a, b), f64::midpoint(c, d)],
    })
}

/// Phase and shape of both legs.
#[must_use]
pub fn set_of(leg: &Leg, cadence: f64) -> ShapeSet {
    let joint = |series: &Series| {
        let (cos, sin): (Vec<f32>, Vec<f32>) = series.terms.iter().map(|term| (term.0 as f32, term.1 as f32)).unzip();
        let list = |numbers: &[f32]| Coefficients::new(numbers).expect("six harmonics");
        ShapeJoint { mean_deg: series.mean as f32, cos_deg: list(&cos), sin_deg: list(&sin) }
    };
    let later = leg.from_phase(0.5);
    let joints = [&leg.hip, &later.hip, &leg.knee, &later.knee].map(joint);
    ShapeSet { stride_s: (120.0 / cadence) as f32, joints }
}

fn series(joint: &ShapeJoint) -> Series {
    let terms = joint.cos_deg.iter().zip(joint.sin_deg.iter()).take(HARMONICS);
    Series {
        mean: f64::from(joint.mean_deg),
        terms: terms.map(|(&cos, &sin)| (f64::from(cos), f64::from(sin))).collect(),
    }
}
