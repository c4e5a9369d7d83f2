//! The shape of a joint's movement in its strides: mean, range and two harmonics, and the sign that they indicate.

use crate::series::{quantile, range};
use std::f64::consts::TAU;

/// Below this range, degrees, a joint counts as still and its sign is not judged.
pub const LEAST_RANGE_DEG: f64 = 5.0;
/// Knee: absolute mean angle, degrees, beyond which it indicates the sign.
pub(super) const KNEE_MEAN_DEG: f64 = 5.0;
/// Knee: absolute skewness beyond which it indicates the sign (swing is a large excursion to one side).
pub(super) const KNEE_SKEWNESS: f64 = 0.2;
/// Knee: double bump from which its phase indicates the sign.
pub(super) const KNEE_BUMP: f64 = 0.3;
/// Hip: double bump from which its phase indicates the sign.
pub(super) const HIP_BUMP: f64 = 0.08;
/// Hip: middle of the bump phase with flexion positive, cycles.
pub(super) const HIP_BUMP_PHASE: f64 = 0.4;

/// A joint in the strides with most movement.
pub(super) struct Shape {
    pub(super) mean: f64,
    pub(super) range: f64,
    /// Smallest and largest angle without the outermost hundredths.
    pub(super) extent: (f64, f64),
    skewness: f64,
    /// First and second harmonic, where a stride period is known.
    harmonics: Option<[(f64, f64); 2]>,
}

impl Shape {
    pub(super) fn of(x: &[f64], strides: Option<f64>) -> Self {
        let n = x.len() as f64;
        let mean = x.iter().sum::<f64>() / n;
        let moment = |power: i32| x.iter().map(|x| (x - mean).powi(power)).sum::<f64>() / n;
        let sd = moment(2).sqrt();
        let skewness = if sd > 0.0 { moment(3) / sd.powi(3) } else { 0.0 };
        let harmonic = |k: f64| {
            x.iter().enumerate().fold((0.0, 0.0), |(re, im), (i, x)| {
                let (sin, cos) = (TAU * k * i as f64 / n).sin_cos();
                (re + 2.0 / n * (x - mean) * cos, im - 2.0 / n * (x - mean) * sin)
            })
        };
        let extent = (quantile(x.iter().copied(), 0.01), quantile(x.iter().copied(), 0.99));
        Self { mean, range: range(x), extent, skewness, harmonics: strides.map(|s| [harmonic(s), harmonic(2.0 * s)]) }
    }

    pub(super) fn phase(&self) -> Option<f64> {
        self.harmonics.map(|[one, _]| one.1.atan2(one.0) / TAU)
    }

    pub(super) fn bump(&self) -> Option<f64> {
        self.harmonics.map(|[one, two]| two.0.hypot(two.1) / one.0.hypot(one.1))
    }

    pub(super) fn bump_phase(&self) -> Option<f64> {
        self.harmonics.map(|[one, two]| two.1.atan2(two.0) / TAU - 2.0 * one.1.atan2(one.0) / TAU)
    }

    pub(super) fn negate(&mut self) {
        self.mean = -self.mean;
        self.extent = (-self.extent.1, -self.extent.0);
        self.skewness = -self.skewness;
        self.harmonics = self.harmonics.map(|both| both.map(|(re, im)| (-re, -im)));
    }

    /// +1 flexion positive, -1 negative, 0 contradictory.
    pub(super) fn knee_sign(&self) -> i32 {
        let sign = |x: f64, beyond: f64| if x.abs() > beyond { x.signum() as i32 } else { 0 };
        let bump = match (self.bump(), self.bump_phase()) {
            (Some(bump), Some(phase)) if bump >= KNEE_BUMP => sign((TAU * phase).cos(), 0.3),
            _ => 0,
        };
        let majority = (bump + sign(self.mean, KNEE_MEAN_DEG) + sign(self.skewness, KNEE_SKEWNESS)).signum();
        if bump != 0 && majority != bump { 0 } else { majority }
    }

    /// As [`Self::knee_sign`], for a hip.
    pub(super) fn hip_sign(&self) -> i32 {
        match (self.bump(), self.bump_phase()) {
            (Some(bump), Some(phase)) if bump >= HIP_BUMP => {
                let off = apart(phase, HIP_BUMP_PHASE);
                if off < 0.2 {
                    1
                } else if off > 0.3 {
                    -1
                } else {
                    0
                }
            }
            _ => 0,
        }
    }
}

/// Distance of two phases in cycles, 0 to 0.5.
pub(super) fn apart(a: f64, b: f64) -> f64 {
    let d = (a - b).rem_euclid(1.0);
    d.min(1.0 - d)
}
