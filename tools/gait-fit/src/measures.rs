//! What a gait laboratory reports of a recording: cadence, stride time and its variability, range of motion by joint, left against right.

use gait_trace::stride::cut::FEWEST_TO_ALIGN;
use gait_trace::stride::cycle::{Cycle, POINTS};
use gait_trace::stride::strides::Strides;
use joint_units::Joint;
use serde::Serialize;

use crate::contact::CycleStart;

/// Least and greatest angle of one joint in the mean stride.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Motion {
    /// Name of the joint, as [`Joint::name`].
    pub name: &'static str,
    /// Least angle of the mean stride, degrees.
    pub min_deg: f64,
    /// Where it is, percent of the leg's own cycle.
    pub min_at_percent: f64,
    /// Greatest angle of the mean stride, degrees.
    pub max_deg: f64,
    /// Where it is, percent of the leg's own cycle.
    pub max_at_percent: f64,
    /// Greatest minus least, degrees.
    pub range_deg: f64,
    /// Standard deviation of that range over the strides, degrees; `None` if there is only one stride.
    pub range_sd_deg: Option<f64>,
    /// Greatest minus least angle of the generator, degrees.
    pub generator_range_deg: f64,
}

/// Left minus right of one pair of joints, degrees.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Difference {
    /// `hip` or `knee`.
    pub name: &'static str,
    /// Of the least angles.
    pub min_deg: f64,
    /// Of the greatest angles.
    pub max_deg: f64,
    /// Of the ranges.
    pub range_deg: f64,
}

/// The measures of a recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measures {
    /// Steps a minute, two a stride; `None` if the recording has no seconds.
    pub cadence_steps_per_min: Option<f64>,
    /// Mean stride time, seconds; `None` if the recording has no seconds.
    pub stride_time_s: Option<f64>,
    /// Standard deviation of the stride time, seconds; `None` without seconds, and of fewer than [`FEWEST_TO_ALIGN`] strides: their ends are
    /// not found on their own, so that their times hardly differ.
    pub stride_time_sd_s: Option<f64>,
    /// The same as a percentage of the mean: the coefficient of variation.
    pub stride_time_cv_percent: Option<f64>,
    /// Where the cycle of each leg begins.
    pub cycle_start: CycleStart,
    /// The joints, in the order of [`Joint::ALL`].
    pub motion: [Motion; Joint::COUNT],
    /// Left minus right: hip, knee.
    pub left_minus_right: [Difference; 2],
}

impl Measures {
    /// Of the strides of a recording. `generator` is aligned with the mean stride; `in_seconds` is false for a recording whose time axis is a
    /// cycle.
    #[must_use]
    pub fn of(strides: &Strides, generator: &Cycle, in_seconds: bool) -> Self {
        let stride_time_s = in_seconds.then_some(strides.period_s);
        let cadence_steps_per_min = stride_time_s.map(|seconds| 120.0 / seconds);
        let stride_time_sd_s = (in_seconds && strides.cycles().len() >= FEWEST_TO_ALIGN).then(|| strides.period_sd_s());
        let mean = strides.mean();
        let cycle_start = CycleStart::of(&mean, cadence_steps_per_min);
        let motion = Joint::ALL.map(|joint| {
            let own = cycle_start.own_cycle(&mean, joint);
            let [(min_deg, low), (max_deg, high)] = ends(&own);
            let ranges: Vec<f64> = strides.cycles().iter().map(|stride| range(&stride.0[joint as usize])).collect();
            let percent = |k: usize| 100.0 * k as f64 / POINTS as f64;
            Motion {
                name: joint.name(),
                min_deg,
                min_at_percent: percent(low),
                max_deg,
                max_at_percent: percent(high),
                range_deg: max_deg - min_deg,
                range_sd_deg: sample_sd(&ranges),
                generator_range_deg: range(&generator.0[joint as usize]),
            }
        });
        let left_minus_right = [("hip", 0), ("knee", 2)].map(|(name, left)| {
            let (left, right) = (&motion[left], &motion[left + 1]);
            Difference {
                name,
                min_deg: left.min_deg - right.min_deg,
                max_deg: left.max_deg - right.max_deg,
                range_deg: left.range_deg - right.range_deg,
            }
        });
        Self {
            cadence_steps_per_min,
            stride_time_s,
            stride_time_sd_s,
            stride_time_cv_percent: stride_time_sd_s.map(|sd| 100.0 * sd / strides.period_s),
            cycle_start,
            motion,
            left_minus_right,
        }
    }
}

/// Least and greatest value, each with its index.
fn ends(points: &[f64; POINTS]) -> [(f64, usize); 2] {
    let indexed = || points.iter().copied().zip(0..POINTS);
    [indexed().min_by(|a, b| a.0.total_cmp(&b.0)), indexed().max_by(|a, b| a.0.total_cmp(&b.0))]
        .map(|end| end.unwrap_or((f64::NAN, 0)))
}

/// Greatest minus least value.
#[must_use]
pub fn range(points: &[f64; POINTS]) -> f64 {
    let [(least, _), (greatest, _)] = ends(points);
    greatest - least
}

/// Standard deviation of a sample, with n - 1; `None` of fewer than two values.
///
/// ```
/// assert_eq!(gait_fit::measures::sample_sd(&[1.0, 3.0]), Some(f64::sqrt(2.0)));
/// assert_eq!(gait_fit::measures::sample_sd(&[1.0]), None);
/// ```
#[must_use]
pub fn sample_sd(values: &[f64]) -> Option<f64> {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (values.len() > 1).then(|| (squares / (n - 1.0)).sqrt())
}
