//! Errors of a fit against the recorded strides, compared with the person's own variability.

use gait_trace::stride::cycle::{Cycle, POINTS};
use gait_trace::stride::metrics::rmse;
use gait_trace::stride::strides::Strides;
use joint_units::Joint;
use serde::Serialize;

use crate::search::Curves;
use crate::series::Series;

/// With this many strides or more, a fit to the first half is judged on the second half; with fewer, each stride is judged by a fit to
/// the others.
pub const HALVES_FROM: usize = 10;

/// The errors of one joint.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JointFit {
    /// Name of the joint, as [`Joint::name`].
    pub name: &'static str,
    /// Root mean square error of the generator against the person's mean stride, degrees.
    pub rmse_mean_stride_deg: f64,
    /// The same error of the setpoints, after the limits of the robot, degrees; `None` if it does not walk there.
    pub rmse_driven_deg: Option<f64>,
    /// Root mean square error on strides that were not fitted, degrees; `None` if there is only one stride.
    pub rmse_heldout_deg: Option<f64>,
    /// The same error of the mean of the fitted strides, degrees: the person's own variability. A generator fitted to that mean cannot
    /// be expected to have a smaller one.
    pub heldout_floor_deg: Option<f64>,
    /// Standard deviation of the strides about the mean stride, degrees; `None` if there is only one stride.
    pub stride_sd_deg: Option<f64>,
    /// Largest angle of the fit minus that of the mean stride, degrees.
    pub peak_error_deg: f64,
    /// Time of the fit's largest angle minus that of the mean stride, percent of the gait cycle.
    pub peak_timing_percent: f64,
    /// Phase of the fit's first harmonic minus that of the mean stride, degrees of the cycle; positive means early.
    pub phase_error_deg: f64,
    /// Range of motion of the mean stride, degrees.
    pub range_deg: f64,
}

/// Choice of the strides that are not fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum HeldOut {
    /// Fitted to the first half, judged on the second.
    SecondHalf,
    /// Each judged by a fit to all the others.
    EachByTheOthers,
    /// There is only one stride.
    None,
}

impl HeldOut {
    /// The choice for a number of strides.
    #[must_use]
    pub const fn of(strides: usize) -> Self {
        match strides {
            0 | 1 => Self::None,
            _ if strides < HALVES_FROM => Self::EachByTheOthers,
            _ => Self::SecondHalf,
        }
    }

    /// In words.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::SecondHalf => "fitted to the first half of the strides, judged on the second",
            Self::EachByTheOthers => "each stride judged by a fit to all the others",
            Self::None => "only one stride: none is left for the judgement",
        }
    }
}

/// Errors on held-out strides and their floor, per joint, degrees. `refit` fits the mean of some strides and returns the fitted cycle.
#[must_use]
pub fn held_out(strides: &Strides, refit: impl Fn(&Cycle) -> Cycle) -> (HeldOut, Option<[f64; 4]>, Option<[f64; 4]>) {
    let curves: Vec<Curves<4>> = strides.cycles().iter().map(|cycle| cycle.0).collect();
    held_out_of(&curves, |some| refit(&Cycle(*some)).0)
}

/// As [`held_out`], for strides of `N` joints.
#[must_use]
pub fn held_out_of<const N: usize>(
    strides: &[Curves<N>],
    refit: impl Fn(&Curves<N>) -> Curves<N>,
) -> (HeldOut, Option<[f64; N]>, Option<[f64; N]>) {
    let (n, way) = (strides.len(), HeldOut::of(strides.len()));
    match way {
        HeldOut::None => (way, None, None),
        HeldOut::SecondHalf => {
            let (first, second) = strides.split_at(n / 2);
            let own = mean_of(first);
            let template = refit(&own);
            (way, Some(spread(second, |_| template)), Some(spread(second, |_| own)))
        }
        HeldOut::EachByTheOthers => {
            let mean = mean_of(strides);
            let others = |k: usize| -> Curves<N> {
                let one = &strides[k];
                let (count, rest) = (n as f64, n as f64 - 1.0);
                std::array::from_fn(|j| std::array::from_fn(|i| (mean[j][i] * count - one[j][i]) / rest))
            };
            (way, Some(spread(strides, |k| refit(&others(k)))), Some(spread(strides, others)))
        }
    }
}

/// The mean of one stride or more.
#[must_use]
pub fn mean_of<const N: usize>(strides: &[Curves<N>]) -> Curves<N> {
    let n = strides.len().max(1) as f64;
    std::array::from_fn(|j| std::array::from_fn(|i| strides.iter().map(|stride| stride[j][i]).sum::<f64>() / n))
}

/// Root mean square difference of the strides from the curves that are expected for each, per joint.
#[must_use]
pub fn spread<const N: usize>(strides: &[Curves<N>], expected: impl Fn(usize) -> Curves<N>) -> [f64; N] {
    let mut squares = [0.0; N];
    for (k, stride) in strides.iter().enumerate() {
        let expected = expected(k);
        for (sum, (own, expected)) in squares.iter_mut().zip(stride.iter().zip(&expected)) {
            *sum += rmse(own, expected).unwrap_or(f64::NAN).powi(2);
        }
    }
    squares.map(|sum| (sum / strides.len() as f64).sqrt())
}

/// The errors of all joints. `fitted` is the generator's cycle, `driven` that of its setpoints on the robot; both are aligned with the
/// mean stride.
#[must_use]
pub fn judge(
    strides: &Strides,
    fitted: &Cycle,
    driven: Option<&Cycle>,
    errors: Option<[f64; 4]>,
    floor: Option<[f64; 4]>,
) -> [JointFit; 4] {
    let mean = strides.mean();
    let driven = driven.map(|driven| driven.rmse_deg(&mean));
    let rmse = fitted.rmse_deg(&mean);
    let several = strides.cycles().len() > 1;
    let sd = strides.sd_deg();
    Joint::ALL.map(|joint| {
        let j = joint as usize;
        let (peak, at) = largest(&mean.0[j]);
        let (fit_peak, fit_at) = largest(&fitted.0[j]);
        let least = mean.0[j].iter().copied().fold(f64::MAX, f64::min);
        JointFit {
            name: joint.name(),
            rmse_mean_stride_deg: rmse[j],
            rmse_driven_deg: driven.map(|driven| driven[j]),
            rmse_heldout_deg: errors.map(|errors| errors[j]),
            heldout_floor_deg: floor.map(|floor| floor[j]),
            stride_sd_deg: several.then_some(sd[j]),
            peak_error_deg: fit_peak - peak,
            peak_timing_percent: 100.0 * wrapped(fit_at - at),
            phase_error_deg: 360.0 * wrapped(fundamental(&mean.0[j]) - fundamental(&fitted.0[j])),
            range_deg: peak - least,
        }
    })
}

/// Root mean square of an error over the joints; `None` if a joint has none.
#[must_use]
pub fn pooled(joints: &[JointFit; 4], error: impl Fn(&JointFit) -> Option<f64>) -> Option<f64> {
    let errors: Option<Vec<f64>> = joints.iter().map(error).collect();
    errors.map(|errors| gait_trace::root_mean_square(&errors))
}

/// The errors on strides that were not fitted, over the joints, with their floor.
#[must_use]
pub fn held_out_in_words(joints: &[JointFit; 4]) -> String {
    let heldout = pooled(joints, |joint| joint.rmse_heldout_deg);
    match (heldout, pooled(joints, |joint| joint.heldout_floor_deg)) {
        (Some(heldout), Some(floor)) => format!(
            "RMSE on strides that were not fitted: {heldout:.2} degrees; floor, the error of the person's own mean stride there: {floor:.2}"
        ),
        _ => "RMSE on strides that were not fitted: not known from one stride".into(),
    }
}

/// The largest value and its place in cycles, interpolated by a parabola.
fn largest(points: &[f64; POINTS]) -> (f64, f64) {
    let k = (0..POINTS).max_by(|a, b| points[*a].total_cmp(&points[*b])).unwrap_or(0);
    let [before, top, after] = [POINTS - 1, 0, 1].map(|by| points[(k + by) % POINTS]);
    let bend = before - 2.0 * top + after;
    let part = if bend < 0.0 { 0.5 * (before - after) / bend } else { 0.0 };
    (top - 0.25 * (before - after) * part, (k as f64 + part) / POINTS as f64)
}

/// Place of the first harmonic's maximum, cycles.
fn fundamental(points: &[f64; POINTS]) -> f64 {
    let (cos, sin) = Series::through(points, 1).terms[0];
    sin.atan2(cos) / std::f64::consts::TAU
}

/// A phase difference brought to -1/2 to 1/2 cycles.
fn wrapped(cycles: f64) -> f64 {
    cycles - cycles.round()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn a_late_and_low_peak_is_measured() {
        let bump = |lead: f64, size: f64| -> [f64; POINTS] {
            std::array::from_fn(|k| size * (TAU * (k as f64 / POINTS as f64 - lead)).cos())
        };
        let ((peak, at), (late, later)) = (largest(&bump(0.3, 40.0)), largest(&bump(0.3333, 38.0)));
        assert!((peak - 40.0).abs() < 1e-3 && (late - 38.0).abs() < 1e-3);
        assert!((wrapped(later - at) - 0.0333).abs() < 1e-4);
        assert!((fundamental(&bump(0.3, 40.0)) - 0.3).abs() < 1e-9);
        assert!((wrapped(0.95 - 0.05) + 0.1).abs() < 1e-12);
    }
}
