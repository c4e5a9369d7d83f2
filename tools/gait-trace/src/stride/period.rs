//! How long a stride is, from the recording alone.
//!
//! A recording that repeats after T looks like itself shifted by T. For a shift, the likeness is
//! ```text
//! r(T) = 1 - mean over channels of  < (x(t + T) - x(t))^2 > / (2 var x)
//! ```
//! 1 for perfect repetition, about 0 for two unrelated stretches. The period is the shortest shift at which r has a local
//! maximum that comes within [`SLACK`] of the best one (two strides fit as well as one, so the best alone would not do). Left
//! and right legs are half a stride apart, so with channels of both the half stride is no maximum; nor is it with one knee.
//!
//! Units: seconds. Searched: [`SHORTEST_S`] to [`LONGEST_S`], as far as [`OVERLAP_S`] of the recording are left to compare.

use crate::recording::Recording;
use crate::series::variance;

/// Shortest stride: sprinters take 0.45 s.
pub const SHORTEST_S: f64 = 0.4;
/// Longest stride: slow walking of patients takes 2 s.
pub const LONGEST_S: f64 = 2.5;
/// Least part of the recording that has to be there twice.
pub const OVERLAP_S: f64 = 0.2;
/// Least likeness that counts as repetition.
pub const LEAST_LIKENESS: f64 = 0.7;
/// How much less than the best likeness a shorter shift may have.
pub const SLACK: f64 = 0.1;

/// Strides are searched at this rate; the maximum is then placed between its samples by a parabola.
const RATE_HZ: f64 = 100.0;

/// What was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stride {
    /// Length of a stride.
    pub period_s: f64,
    /// The likeness r at this shift.
    pub likeness: f64,
}

/// The stride period; `None` when the recording is too short or does not repeat itself.
///
/// ```
/// use gait_trace::{Channel, Quantity, Recording};
/// use gait_trace::stride::period;
/// let times: Vec<f64> = (0..300).map(|n| f64::from(n) * 0.01).collect();
/// let knee = times.iter().map(|t| 30.0 - 25.0 * (t / 1.1 * std::f64::consts::TAU).cos()).collect();
/// let walk = Recording::build(times, vec![Channel::new("knee", Quantity::Angle, knee)])?;
/// assert!((period::find(&walk).unwrap().period_s - 1.1).abs() < 0.001);
/// # Ok::<(), gait_trace::RecordingError>(())
/// ```
#[must_use]
pub fn find(recording: &Recording) -> Option<Stride> {
    let even = recording.resample(RATE_HZ).ok()?;
    let samples = even.time_s().len();
    let channels: Vec<(&[f64], f64)> = even
        .channels()
        .iter()
        .map(|channel| (channel.values(), variance(channel.values())))
        .filter(|(_, variance)| *variance > 0.0)
        .collect();
    if channels.is_empty() {
        return None;
    }
    let likeness = |shift: usize| {
        let unlike: f64 = channels
            .iter()
            .map(|(x, variance)| {
                let squares: f64 = x.iter().zip(&x[shift..]).map(|(a, b)| (b - a) * (b - a)).sum();
                squares / (samples - shift) as f64 / (2.0 * variance)
            })
            .sum();
        1.0 - unlike / channels.len() as f64
    };
    let in_samples = |seconds: f64| (seconds * RATE_HZ).round() as usize;
    let first = in_samples(SHORTEST_S);
    let last = in_samples(LONGEST_S).min(samples.checked_sub(in_samples(OVERLAP_S))?);
    if last < first + 2 {
        return None;
    }
    let r: Vec<f64> = (first..=last).map(likeness).collect();
    let peaks: Vec<usize> = (1..r.len() - 1).filter(|&i| r[i] > r[i - 1] && r[i] >= r[i + 1]).collect();
    let best = peaks.iter().map(|&i| r[i]).fold(f64::NEG_INFINITY, f64::max);
    let peak = peaks.into_iter().find(|&i| r[i] >= LEAST_LIKENESS.max(best - SLACK))?;

    let (before, here, after) = (r[peak - 1], r[peak], r[peak + 1]);
    let curvature = before - 2.0 * here + after;
    let fraction = if curvature < 0.0 { 0.5 * (before - after) / curvature } else { 0.0 };
    Some(Stride { period_s: ((first + peak) as f64 + fraction) / RATE_HZ, likeness: here })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{Channel, Quantity};
    use proptest::prelude::*;
    use std::f64::consts::TAU;

    /// A knee of two harmonics: stance flexion and swing flexion.
    fn knee(cycles: f64) -> f64 {
        25.0 - 18.0 * (TAU * cycles + 0.6).cos() - 15.0 * (2.0 * TAU * cycles).cos()
    }

    fn record(seconds: f64, rate: f64, x: impl Fn(f64) -> f64) -> Recording {
        let times: Vec<f64> = (0..(seconds * rate) as usize).map(|n| n as f64 / rate).collect();
        let values = times.iter().map(|&t| x(t)).collect();
        Recording::build(times, vec![Channel::new("knee", Quantity::Angle, values)]).unwrap()
    }

    #[test]
    fn what_does_not_repeat_has_no_stride() {
        assert_eq!(find(&record(10.0, 100.0, |_| 12.0)), None, "standing");
        assert_eq!(find(&record(10.0, 100.0, |t| 5.0 * t)), None, "a ramp");
        assert_eq!(find(&record(0.5, 100.0, |t| knee(t / 1.1))), None, "too short");
        assert_eq!(find(&record(1.0, 100.0, |t| knee(t / 1.1))), None, "less than a stride");
    }

    proptest! {
        #[test]
        fn the_period_that_was_put_in_comes_out(
            period in 0.5_f64..2.0, strides in 1.8_f64..6.0, phase in 0.0_f64..1.0, rate in 50.0_f64..1000.0,
        ) {
            let walk = record(period * strides, rate, |t| knee(t / period + phase));
            let found = find(&walk).expect("periodic").period_s;
            prop_assert!((found - period).abs() < 0.01, "{found} for {period}");
        }
    }
}
