//! The error with which joints can be estimated from the past of one measured joint: kernel ridge regression, judged on what it was not
//! fitted to.
//!
//! ```text
//! z(t) = [ y(t - k T) sqrt(v_k) ],  k = 0 .. 1.5 strides,  v_k ~ exp(-k T / (stride / 4)),  sum v_k = 1,  y scaled to variance 1
//! a(t) = c_0 + sum_i c_i exp(-|z(t) - z_i|^2 / (2 l^2)),   c minimises  sum_t (a_joint - a)^2 + N r c' K c
//! ```
//! y is the angle of the measured joint, a the estimate of another joint's angle at the same time. The centres z_i are [`CENTRES`] rows at
//! equal distances (Nystroem approximation), K their kernel matrix, N the number of rows. The rows are cut into [`FOLDS`] spans of time; those
//! of a span are estimated with the coefficients of the others, without the rows whose window overlaps the span. Width l and ridge r are those
//! of [`WIDTHS`] and [`RIDGES`] with the smallest error, for each joint by itself.
//!
//! The result is an error that a causal estimator **reaches** which was fitted to other strides of the same recording. So it is an upper
//! estimate of the smallest error, no strict lower bound: a longer recording or a better estimator may come below it. The tests of this file
//! have recordings whose smallest error is known; the estimate is 3 % below to 15 % above it.
//!
//! Sources: kernel ridge regression, Saunders, Gammerman and Vovk 1998 (ICML, 515-521); its approximation by some of the rows, Williams and
//! Seeger 2001 (NIPS 13, 682-688); the past window as the state of a dynamical system, Takens 1981 (Lecture Notes in Mathematics 898,
//! 366-381); cross-validation in spans of time, Burman, Chow and Nolan 1994 (Biometrika 81, 351-358).

use nalgebra::{Cholesky, DMatrix, DVector};
use std::ops::Range;

/// Sampling rate of the series, Hz.
pub const RATE_HZ: f64 = 100.0;
/// Rows from one that is estimated to the next.
const STEP: usize = 2;
/// Length of the past window, strides.
pub const WINDOW_STRIDES: f64 = 1.5;
/// Time constant with which older samples of the window count less, strides.
const MEMORY_STRIDES: f64 = 0.25;
/// Largest number of centres.
pub const CENTRES: usize = 200;
/// Spans of the cross-validation.
pub const FOLDS: usize = 10;
/// Widths l of the kernel, in standard deviations of the measured joint.
pub const WIDTHS: [f64; 3] = [0.25, 0.5, 1.0];
/// Ridges r.
pub const RIDGES: [f64; 4] = [1e-6, 1e-5, 1e-4, 1e-3];
/// Fewest strides of a recording: with fewer the error of the regression is that of a fit to too little.
pub const LEAST_STRIDES: f64 = 20.0;

/// Series of equal time steps at [`RATE_HZ`], all of one length.
#[derive(Debug, Clone, Copy)]
pub struct Past<'a> {
    /// Angle of the measured joint, degrees.
    pub sensor: &'a [f64],
    /// Whether a row was measured, for all joints.
    pub known: &'a [bool],
    /// Mean stride, s.
    pub stride_s: f64,
}

/// The causal errors of other joints, root mean square over the `judged` rows, in the unit of the series; `None` if there are fewer than
/// [`LEAST_STRIDES`] of measured rows with a measured past, none of them is judged, or the sensor does not move.
///
/// ```
/// use gait_fit::causal::{Past, RATE_HZ, causal_errors};
/// // A joint that the sensor's past determines: the same motion, a quarter of a stride later.
/// let turn = |row: f64| (std::f64::consts::TAU * row / (1.1 * RATE_HZ)).cos();
/// let hip: Vec<f64> = (0..4000).map(|row| 20.0 * turn(f64::from(row))).collect();
/// let knee: Vec<f64> = (0..4000).map(|row| 30.0 * turn(f64::from(row) - 27.5)).collect();
/// let past = Past { sensor: &hip, known: &[true; 4000], stride_s: 1.1 };
/// assert!(causal_errors(&past, &[&knee], 1500..4000).unwrap()[0] < 0.1);
/// assert_eq!(causal_errors(&Past { sensor: &hip[..2000], ..past }, &[&knee], 1500..2000), None, "18 strides");
/// ```
#[must_use]
pub fn causal_errors(past: &Past<'_>, joints: &[&[f64]], judged: Range<usize>) -> Option<Vec<f64>> {
    let rows = Rows::of(past)?;
    let judged: Vec<usize> = (0..rows.at.len()).filter(|&n| judged.contains(&rows.at[n])).collect();
    if judged.is_empty() {
        return None;
    }
    let wanted: Vec<DVector<f64>> = joints
        .iter()
        .map(|joint| {
            DVector::from_iterator(
                rows.at.len(),
                rows.at.iter().map(|&row| joint.get(row).copied().unwrap_or(f64::NAN)),
            )
        })
        .collect();
    let mut least = vec![f64::INFINITY; joints.len()];
    for width in WIDTHS {
        let features = Features::of(&rows, width);
        for (least, wanted) in least.iter_mut().zip(&wanted) {
            for estimate in features.estimates(&rows, wanted) {
                let square = |&n: &usize| (estimate[n] - wanted[n]).powi(2);
                let error = (judged.iter().map(square).sum::<f64>() / judged.len() as f64).sqrt();
                *least = least.min(error);
            }
        }
    }
    least.iter().all(|error| error.is_finite()).then_some(least)
}

/// The rows that are estimated, and their squared distances from the centres.
struct Rows {
    /// Places in the series, ascending.
    at: Vec<usize>,
    /// Length of the window in rows.
    window: usize,
    /// Rows that are centres, as places in `at`.
    centres: Vec<usize>,
    /// |z - z_i|^2, a row each.
    squares: DMatrix<f64>,
}

impl Rows {
    fn of(past: &Past<'_>) -> Option<Self> {
        let Past { sensor, known, stride_s } = *past;
        let stride = stride_s * RATE_HZ;
        let window = (WINDOW_STRIDES * stride) as usize;
        // The number of measured rows without a gap, up to each.
        let runs = known.iter().take(sensor.len()).scan(0usize, |run, &known| {
            *run = if known { *run + 1 } else { 0 };
            Some(*run)
        });
        let at: Vec<usize> = runs.enumerate().filter(|(_, run)| *run > window).map(|(row, _)| row).collect();
        if (at.len() as f64) < LEAST_STRIDES * stride {
            return None;
        }
        let at: Vec<usize> = at.into_iter().step_by(STEP).collect();
        let count = at.len() as f64;
        let mean = at.iter().map(|&row| sensor[row]).sum::<f64>() / count;
        let deviation = (at.iter().map(|&row| (sensor[row] - mean).powi(2)).sum::<f64>() / count).sqrt();
        if deviation.is_nan() || deviation < 1e-6 {
            return None;
        }
        let weights: Vec<f64> = (0..=window).map(|k| (-(k as f64) / (MEMORY_STRIDES * stride)).exp()).collect();
        let total = weights.iter().sum::<f64>().sqrt() * deviation;
        let weights: Vec<f64> = weights.iter().map(|weight| weight.sqrt() / total).collect();
        let state = |row: usize| weights.iter().enumerate().map(move |(k, weight)| sensor[row - k] * weight);
        let states: Vec<Vec<f64>> = at.iter().map(|&row| state(row).collect()).collect();
        let number = CENTRES.min(at.len());
        let centres: Vec<usize> = (0..number).map(|i| (2 * i + 1) * at.len() / (2 * number)).collect();
        let distance = |n: usize, i: usize| -> f64 {
            states[n].iter().zip(&states[centres[i]]).map(|(one, other)| (one - other).powi(2)).sum()
        };
        let squares = DMatrix::from_fn(at.len(), number, distance);
        Some(Self { at, window, centres, squares })
    }

    /// For each fold the rows that are estimated and those that must not be fitted, as places in `at`.
    fn folds(&self) -> impl Iterator<Item = (Range<usize>, Range<usize>)> + '_ {
        let rows = self.at.len();
        (0..FOLDS).map(move |fold| {
            let tested = fold * rows / FOLDS..(fold + 1) * rows / FOLDS;
            let (first, last) = (self.at[tested.start], self.at[tested.end - 1]);
            let from = self.at.partition_point(|&row| row + self.window < first);
            let to = self.at.partition_point(|&row| row <= last + self.window);
            (tested, from..to)
        })
    }
}

/// The features of the rows for one width: a constant and the kernels of the centres.
struct Features {
    values: DMatrix<f64>,
    /// The kernel matrix of the centres, with a row and a column of zeros for the constant.
    penalty: DMatrix<f64>,
    /// For each fold the sum of the outer products of the rows that are fitted.
    grams: Vec<DMatrix<f64>>,
}

impl Features {
    fn of(rows: &Rows, width: f64) -> Self {
        let kernel = |square: f64| (-square / (2.0 * width * width)).exp();
        let (count, size) = (rows.at.len(), rows.centres.len() + 1);
        let value = |n: usize, i: usize| if i == 0 { 1.0 } else { kernel(rows.squares[(n, i - 1)]) };
        let values = DMatrix::from_fn(count, size, value);
        let pair = |i: usize, j: usize| if i == 0 { 0.0 } else { value(rows.centres[i - 1], j) };
        let penalty = DMatrix::from_fn(size, size, |i, j| if j == 0 { 0.0 } else { pair(i, j) });
        let all = values.tr_mul(&values);
        let of = |left_out: Range<usize>| {
            let part = values.rows_range(left_out);
            &all - part.tr_mul(&part)
        };
        let grams = rows.folds().map(|(_, left_out)| of(left_out)).collect();
        Self { values, penalty, grams }
    }

    /// The estimates of a joint, one for each ridge that can be solved.
    fn estimates(&self, rows: &Rows, wanted: &DVector<f64>) -> Vec<DVector<f64>> {
        let mean = wanted.mean();
        let wanted = wanted.add_scalar(-mean);
        let all = self.values.tr_mul(&wanted);
        let estimate = |ridge: f64| -> Option<DVector<f64>> {
            let mut estimate = DVector::zeros(wanted.len());
            for ((tested, left_out), gram) in rows.folds().zip(&self.grams) {
                let fitted = (wanted.len() - left_out.len()) as f64;
                let mut normal = gram + &self.penalty * (ridge * fitted);
                // Centres that are almost the same row make it singular to rounding.
                (0..normal.nrows()).for_each(|i| normal[(i, i)] += 1e-9 * fitted);
                let part = self.values.rows_range(left_out.clone());
                let right = &all - part.tr_mul(&wanted.rows_range(left_out));
                let weights = Cholesky::new(normal)?.solve(&right);
                let of_fold = self.values.rows_range(tested.clone()) * weights;
                estimate.rows_range_mut(tested).copy_from(&of_fold);
            }
            Some(estimate.add_scalar(mean))
        };
        RIDGES.into_iter().filter_map(estimate).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::search::Random;
    use std::f64::consts::TAU;

    const STRIDE_S: f64 = 1.1;

    fn hip(phase: f64) -> f64 {
        20.0 * phase.cos() + 3.0 * (2.0 * phase).sin()
    }

    fn hip_slope(phase: f64) -> f64 {
        -20.0 * phase.sin() + 6.0 * (2.0 * phase).cos()
    }

    fn knee(phase: f64) -> f64 {
        30.0 - 20.0 * (phase + 0.5).cos() + 12.0 * (2.0 * phase).cos()
    }

    fn knee_slope(phase: f64) -> f64 {
        20.0 * (phase + 0.5).sin() - 24.0 * (2.0 * phase).sin()
    }

    /// A person for 60 s whose phase wanders randomly, by `wander` rad^2/s, a hip sensor with noise and a knee with noise, degrees.
    fn person(wander: f64, sensor_noise: f64, knee_noise: f64, seed: u64) -> (Vec<f64>, Vec<f64>) {
        let (mut random, mut phase) = (Random::new(seed), 0.0);
        let rows = (0..6000).map(|_| {
            phase += TAU / (STRIDE_S * RATE_HZ) + (wander / RATE_HZ).sqrt() * random.normal();
            (hip(phase) + sensor_noise * random.normal(), knee(phase) + knee_noise * random.normal())
        });
        rows.unzip()
    }

    fn error(sensor: &[f64], joint: &[f64]) -> f64 {
        let known = vec![true; sensor.len()];
        causal_errors(&Past { sensor, known: &known, stride_s: STRIDE_S }, &[joint], 0..sensor.len()).unwrap()[0]
    }

    /// The smallest error of the knee: variance P of the phase by the Riccati recursion of the optimal filter, `P <- P R / (R + h^2 P)` after
    /// `P <- P + Q`, with the slope h of the hip at the phase, until it repeats.
    fn smallest(wander: f64, sensor_noise: f64) -> f64 {
        let steps = (STRIDE_S * RATE_HZ) as u32;
        let (mut variance, mut sum) = (1e-3, 0.0);
        for stride in 0..30 {
            for step in 0..steps {
                let phase = TAU * f64::from(step) / f64::from(steps);
                variance += wander / RATE_HZ;
                let noise = sensor_noise * sensor_noise;
                variance *= noise / (noise + hip_slope(phase).powi(2) * variance);
                if stride == 29 {
                    sum += variance * knee_slope(phase).powi(2);
                }
            }
        }
        (sum / f64::from(steps)).sqrt()
    }

    /// A sensor without noise has the phase, so the knee's own noise is the smallest error.
    #[test]
    fn noise_of_another_joint_is_its_smallest_error() {
        for (noise, seed) in [(0.5, 1), (3.0, 3)] {
            let (sensor, joint) = person(0.002, 0.0, noise, seed);
            let ratio = error(&sensor, &joint) / noise;
            assert!((0.97..1.08).contains(&ratio), "{noise} degrees: {ratio}");
        }
    }

    #[test]
    fn a_phase_that_wanders_is_known_as_well_as_the_optimal_filter_knows_it() {
        for (wander, noise, seed) in [(0.0081, 2.0, 1), (0.0081, 1.0, 2), (0.002, 0.5, 3)] {
            let (sensor, joint) = person(wander, noise, 0.0, seed);
            let ratio = error(&sensor, &joint) / smallest(wander, noise);
            assert!((0.97..1.15).contains(&ratio), "{wander} rad^2/s, {noise} degrees: {ratio}");
        }
    }

    /// A joint that has nothing to do with the sensor is estimated by its mean.
    #[test]
    fn an_independent_joint_has_its_own_deviation() {
        let ((sensor, _), (_, joint)) = (person(0.002, 0.1, 0.0, 1), person(0.3, 0.0, 0.0, 2));
        let mean = joint.iter().sum::<f64>() / joint.len() as f64;
        let deviation = (joint.iter().map(|angle| (angle - mean).powi(2)).sum::<f64>() / joint.len() as f64).sqrt();
        let ratio = error(&sensor, &joint) / deviation;
        assert!((0.9..1.1).contains(&ratio), "{ratio}");
    }

    /// The future of the sensor is not used: a joint that is ahead by a random step cannot be known.
    #[test]
    fn what_the_sensor_shows_later_is_not_used() {
        let (sensor, _) = person(0.02, 0.0, 0.0, 1);
        let ahead: Vec<f64> = sensor[60..].to_vec();
        let behind: Vec<f64> = sensor[..sensor.len() - 60].to_vec();
        let (early, late) = (error(&behind, &ahead), error(&ahead, &behind));
        assert!(early > 5.0 * late, "{early} ahead, {late} behind");
    }

    #[test]
    fn gaps_are_left_out_and_too_little_gives_nothing() {
        let (mut sensor, joint) = person(0.002, 0.0, 1.0, 1);
        let mut known = vec![true; sensor.len()];
        known[2000..2300].fill(false);
        sensor[2000..2300].fill(90.0);
        let past = Past { sensor: &sensor, known: &known, stride_s: STRIDE_S };
        let ratio = causal_errors(&past, &[&joint], 0..6000).unwrap()[0];
        assert!((0.97..1.08).contains(&ratio), "{ratio}");
        assert_eq!(causal_errors(&past, &[&joint], 2000..2300), None, "nothing is judged");
        assert_eq!(causal_errors(&Past { sensor: &sensor[..2000], ..past }, &[&joint], 0..2000), None);
        assert_eq!(causal_errors(&Past { sensor: &[5.0; 6000], ..past }, &[&joint], 0..6000), None);
    }
}
