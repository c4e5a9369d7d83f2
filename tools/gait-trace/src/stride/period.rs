//! Finds the stride period of a recording from its self-similarity.
//!
//! A recording with period T resembles itself shifted by T. The likeness at a shift is
//! ```text
//! r(T) = 1 - mean over channels of  < (x(t + T) - x(t))^2 > / (2 var x)
//! ```
//! It is 1 for perfect repetition and about 0 for two unrelated parts. The period is the shortest shift at which r has a local
//! maximum within [`SLACK`] of the highest one (a shift of two strides fits as well as one, so the highest alone is not enough). Left
//! and right legs are half a stride apart, so half a stride is not a maximum with channels of both, nor with one knee.
//!
//! Units: seconds. Search range: [`SHORTEST_S`] to [`USUAL_S`], as long as [`OVERLAP_S`] of the recording overlap. [`find_slow`] goes on to
//! [`LONGEST_S`] and asks for two strides: over a short overlap a long shift is soon alike by chance.

use crate::recording::Recording;
use crate::series::varying;

/// Shortest stride, seconds: sprinters take 0.45 s.
pub const SHORTEST_S: f64 = 0.4;
/// Longest stride that a single stride and [`OVERLAP_S`] show, seconds: slow walking of healthy people takes 2 s.
pub const USUAL_S: f64 = 2.5;
/// Longest stride, seconds: people after a stroke take 3 s and more.
pub const LONGEST_S: f64 = 4.0;
/// Longest repetition that is looked for to name the reason of a refusal, seconds.
pub(crate) const TOO_LONG_S: f64 = 12.0;
/// Shortest overlap of the recording with its shifted copy, seconds.
pub const OVERLAP_S: f64 = 0.2;
/// Smallest likeness that counts as repetition.
pub const LEAST_LIKENESS: f64 = 0.7;
/// The same where many parts of a recording are searched, of which one may repeat by chance.
pub(crate) const SURE_LIKENESS: f64 = 0.9;
/// Largest deficit of a shorter shift against the highest likeness.
pub const SLACK: f64 = 0.1;

/// What the search for slow strides examines beyond the ends of their range, seconds.
const EDGE_S: f64 = 0.05;

/// Sample rate of the search, Hz; a parabola then places the maximum between samples.
const RATE_HZ: f64 = 100.0;

/// A stride period and its likeness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stride {
    /// Length of a stride, seconds.
    pub period_s: f64,
    /// Likeness r at this shift.
    pub likeness: f64,
}

/// Finds the stride period; `None` if the recording is too short or not periodic.
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
    find_in(recording, SHORTEST_S, USUAL_S, |_| OVERLAP_S)
}

/// As [`find`], where half of the recording and more repeats, and surely.
pub(crate) fn find_surely(recording: &Recording) -> Option<Stride> {
    find_in(recording, SHORTEST_S, USUAL_S, |shift_s| 0.5 * shift_s).filter(|stride| stride.likeness >= SURE_LIKENESS)
}

/// As [`find`], for strides of [`USUAL_S`] to [`LONGEST_S`] in a recording of two of them or more.
#[must_use]
pub fn find_slow(recording: &Recording) -> Option<Stride> {
    // A maximum at an end of the range needs a neighbour beyond it.
    find_in(recording, USUAL_S - EDGE_S, LONGEST_S + EDGE_S, |shift_s| shift_s - EDGE_S)
}

/// The repetition after more than [`LONGEST_S`], which is no stride.
pub(crate) fn find_too_slow(recording: &Recording) -> Option<Stride> {
    find_in(recording, LONGEST_S, TOO_LONG_S, |shift_s| shift_s)
}

/// Likeness of some series, each with its variance, and of themselves a shift later; not a number for no series.
pub(crate) fn likeness(series: &[(&[f64], f64)], shift: usize) -> f64 {
    let unlike = |(x, variance): &(&[f64], f64)| {
        let squares: f64 = x.iter().zip(&x[shift..]).map(|(a, b)| (b - a) * (b - a)).sum();
        squares / (x.len() - shift) as f64 / (2.0 * variance)
    };
    1.0 - series.iter().map(unlike).sum::<f64>() / series.len() as f64
}

/// The period between two shifts in seconds, where the recording and its shifted copy overlap by `overlap_s` of the shift.
fn find_in(recording: &Recording, from_s: f64, to_s: f64, overlap_s: impl Fn(f64) -> f64) -> Option<Stride> {
    let even = recording.resample(RATE_HZ).ok()?;
    let samples = even.time_s().len();
    let channels = varying(even.channels());
    if channels.is_empty() {
        return None;
    }
    let in_samples = |seconds: f64| (seconds * RATE_HZ).round() as usize;
    let first = in_samples(from_s);
    let fits = |shift: &usize| shift + in_samples(overlap_s(*shift as f64 / RATE_HZ)) <= samples;
    let last = (first..=in_samples(to_s)).rev().find(fits)?;
    if last < first + 2 {
        return None;
    }
    let r: Vec<f64> = (first..=last).map(|shift| likeness(&channels, shift)).collect();
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
    fn a_recording_without_repetition_has_no_period() {
        assert_eq!(find(&record(10.0, 100.0, |_| 12.0)), None, "standing");
        assert_eq!(find(&record(10.0, 100.0, |t| 5.0 * t)), None, "a ramp");
        assert_eq!(find(&record(0.5, 100.0, |t| knee(t / 1.1))), None, "too short");
        assert_eq!(find(&record(1.0, 100.0, |t| knee(t / 1.1))), None, "less than a stride");
    }

    proptest! {
        #[test]
        fn a_known_period_is_found(
            period in 0.5_f64..2.0, strides in 1.8_f64..6.0, phase in 0.0_f64..1.0, rate in 50.0_f64..1000.0,
        ) {
            let walk = record(period * strides, rate, |t| knee(t / period + phase));
            let found = find(&walk).expect("periodic").period_s;
            prop_assert!((found - period).abs() < 0.01, "{found} for {period}");
        }
    }
}
