//! Fits one Fourier series per joint to a cycle, by linear least squares.
//!
//! ```text
//! S(phi) = mean + sum_k  cos_k cos(2 pi k phi) + sin_k sin(2 pi k phi),   k = 1 ... harmonics
//! ```
//! At equally spaced points the normal equations are diagonal, so the least squares solution is the projection
//! `cos_k = 2/n sum_i y_i cos(2 pi k i/n)`, and likewise for the sines. The solution is exact and has no settings.

use std::f64::consts::TAU;

use gait_trace::stride::cycle::{Cycle, POINTS};
use generator_file::file::{ShapeJoint, ShapeSet};
use joint_loop::SERIES_HARMONICS;

/// A joint's series, degrees.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Mean.
    pub mean: f64,
    /// Coefficients of cosine and sine of harmonic 1, 2, ...
    pub terms: Vec<(f64, f64)>,
}

impl Series {
    /// The least squares series through equally spaced points of one period.
    #[must_use]
    pub fn through(points: &[f64], harmonics: usize) -> Self {
        let n = points.len() as f64;
        let mean = points.iter().sum::<f64>() / n;
        let term = |k: usize| {
            points.iter().enumerate().fold((0.0, 0.0), |(c, s), (i, y)| {
                let angle = TAU * (k * i % points.len()) as f64 / n;
                (c + 2.0 / n * y * angle.cos(), s + 2.0 / n * y * angle.sin())
            })
        };
        Self { mean, terms: (1..=harmonics).map(term).collect() }
    }

    /// The value at a phase in cycles.
    #[must_use]
    pub fn at(&self, phase: f64) -> f64 {
        let harmonic = |(k, (c, s)): (usize, &(f64, f64))| {
            let angle = TAU * (k + 1) as f64 * phase;
            c * angle.cos() + s * angle.sin()
        };
        self.mean + self.terms.iter().enumerate().map(harmonic).sum::<f64>()
    }

    /// Root mean square distance from equally spaced points of one period.
    #[must_use]
    pub fn rmse(&self, points: &[f64]) -> f64 {
        let n = points.len() as f64;
        let squares = points.iter().enumerate().map(|(k, y)| (y - self.at(k as f64 / n)).powi(2));
        (squares.sum::<f64>() / n).sqrt()
    }

    /// The same series with its phase counted from `origin`, in cycles.
    #[must_use]
    pub fn from_phase(&self, origin: f64) -> Self {
        let turn = |(k, (c, s)): (usize, &(f64, f64))| {
            let (sin, cos) = (TAU * (k + 1) as f64 * origin).sin_cos();
            (c * cos + s * sin, s * cos - c * sin)
        };
        Self { mean: self.mean, terms: self.terms.iter().enumerate().map(turn).collect() }
    }

    /// The phase of the largest value, in cycles.
    #[must_use]
    pub fn peak(&self) -> f64 {
        let steps = 4000;
        let best = (0..steps).max_by(|a, b| {
            let value = |k: &i32| self.at(f64::from(*k) / f64::from(steps));
            value(a).total_cmp(&value(b))
        });
        f64::from(best.unwrap_or(0)) / f64::from(steps)
    }
}

/// The phase-and-shape set of a cycle: phase 0 where the fitted left hip is most flexed.
///
/// ```
/// use gait_fit::series::fit;
/// use gait_trace::stride::cycle::{Cycle, POINTS};
/// let hip = |lead: f64| std::array::from_fn(|k| 5.0 + 20.0 * (std::f64::consts::TAU * (k as f64 / POINTS as f64 + lead)).cos());
/// let set = fit(&Cycle([hip(0.1), hip(0.6), hip(0.3), hip(0.8)]), 1.1, 6);
/// assert!((set.joints[0].cos_deg[0] - 20.0).abs() < 1e-3 && set.joints[0].sin_deg[0].abs() < 0.05);
/// assert!((set.joints[1].cos_deg[0] + 20.0).abs() < 1e-3);
/// ```
///
/// # Panics
/// `harmonics` beyond what a board takes, [`SERIES_HARMONICS`].
#[must_use]
pub fn fit(cycle: &Cycle, stride_s: f64, harmonics: usize) -> ShapeSet {
    assert!((1..=SERIES_HARMONICS).contains(&harmonics), "allowed are 1 to {SERIES_HARMONICS} harmonics");
    let [left_hip, ..] = &cycle.0;
    let origin = Series::through(left_hip, harmonics).peak();
    let joint = |points: &[f64; POINTS]| {
        let series = Series::through(points, harmonics).from_phase(origin);
        ShapeJoint {
            mean_deg: series.mean as f32,
            cos_deg: series.terms.iter().map(|term| term.0 as f32).collect(),
            sin_deg: series.terms.iter().map(|term| term.1 as f32).collect(),
        }
    };
    ShapeSet { stride_s: stride_s as f32, joints: cycle.0.each_ref().map(joint) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// A series is found again, and what is left over is at right angles to every harmonic: no other coefficients do better.
        #[test]
        fn the_projection_is_the_least_squares_solution(
            terms in prop::collection::vec((-20.0f64..20.0, -20.0f64..20.0), 1..6), mean in -30.0f64..30.0, noise in 0u64..1000,
        ) {
            let truth = Series { mean, terms: terms.clone() };
            let wobble = |k: usize| ((k as u64 * 7919 + noise) % 101) as f64 / 101.0 - 0.5;
            let clean: Vec<f64> = (0..POINTS).map(|k| truth.at(k as f64 / POINTS as f64)).collect();
            let found = Series::through(&clean, terms.len());
            for (a, b) in found.terms.iter().zip(&terms) {
                prop_assert!((a.0 - b.0).abs() < 1e-9 && (a.1 - b.1).abs() < 1e-9);
            }
            let noisy: Vec<f64> = clean.iter().enumerate().map(|(k, y)| y + wobble(k)).collect();
            let fitted = Series::through(&noisy, terms.len());
            let error = |series: &Series| -> f64 {
                noisy.iter().enumerate().map(|(k, y)| (y - series.at(k as f64 / POINTS as f64)).powi(2)).sum()
            };
            for k in 0..terms.len() {
                for by in [-0.01, 0.01] {
                    let mut other = fitted.clone();
                    other.terms[k].0 += by;
                    prop_assert!(error(&other) > error(&fitted));
                    let mut other = fitted.clone();
                    other.terms[k].1 += by;
                    prop_assert!(error(&other) > error(&fitted));
                }
            }
        }

        #[test]
        fn turning_the_origin_turns_the_curve(origin in 0.0f64..1.0, phase in 0.0f64..1.0) {
            let series = Series { mean: 3.0, terms: vec![(10.0, -4.0), (0.5, 2.0), (-1.0, 0.25)] };
            prop_assert!((series.from_phase(origin).at(phase) - series.at(phase + origin)).abs() < 1e-9);
        }
    }
}
