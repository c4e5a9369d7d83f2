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
//! Strides of a turn differ from each other, and in a recording of two or three the overlap after two strides is so short that they fit better than one.
//! So what is found is judged by half of it (`is_two_strides`): after half of one stride each leg is like the other one, after half of two it is like
//! itself. With one leg only, two strides count only where the recording has both twice.
//!
//! Units: seconds. Search range: [`SHORTEST_S`] to [`USUAL_S`], as long as [`OVERLAP_S`] of the recording overlap. [`find_slow`] goes on to
//! [`LONGEST_S`] and asks for two strides: over a short overlap a long shift is soon alike by chance.

use crate::recording::{Channel, Recording};
use crate::series::{variance, varying};
use joint_units::Joint;

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

/// How near to half of a shift one stride is, as a fraction of that half: the two strides of a turn may differ by more than a tenth.
const NEAR_HALF: f64 = 0.15;
/// How much more a leg is like itself than like the other one after half of two strides, of 1 for perfect likeness. The same for legs that move together.
const OTHER_LEG: f64 = 0.3;

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
    let mut peak = peaks.iter().copied().find(|&i| r[i] >= LEAST_LIKENESS.max(best - SLACK))?;
    let half = 0.5 * (first + peak) as f64;
    let near_half = peaks.iter().copied().filter(|&i| ((first + i) as f64 - half).abs() <= NEAR_HALF * half);
    if let Some(one) = near_half.max_by(|&a, &b| r[a].total_cmp(&r[b])) {
        let is_two = is_two_strides(even.channels(), first + peak)
            .unwrap_or_else(|| r[one] >= LEAST_LIKENESS && samples < 2 * (first + peak));
        if is_two {
            peak = one;
        }
    }

    let (before, here, after) = (r[peak - 1], r[peak], r[peak + 1]);
    let curvature = before - 2.0 * here + after;
    let fraction = if curvature < 0.0 { 0.5 * (before - after) / curvature } else { 0.0 };
    Some(Stride { period_s: ((first + peak) as f64 + fraction) / RATE_HZ, likeness: here })
}

/// Whether a shift is of two strides, by both legs: after half of it each is more like itself than like the other one. `None` without two legs.
fn is_two_strides(channels: &[Channel], shift: usize) -> Option<bool> {
    let of = |joint: Joint| channels.iter().find(|channel| channel.name() == joint.name()).map(Channel::values);
    let half = shift.div_ceil(2);
    // Mean square difference of two series half a shift apart, without their means.
    let apart = |a: &[f64], b: &[f64]| {
        let off: Vec<f64> = a[half..].iter().zip(b).map(|(late, early)| late - early).collect();
        variance(&off)
    };
    let (mut own, mut other, mut pairs) = (0.0, 0.0, 0);
    for [left, right] in [[Joint::LeftHip, Joint::RightHip], [Joint::LeftKnee, Joint::RightKnee]] {
        let (Some(left), Some(right)) = (of(left), of(right)) else { continue };
        let both = variance(left) + variance(right);
        if both > 0.0 {
            own += (apart(left, left) + apart(right, right)) / (2.0 * both);
            other += (apart(left, right) + apart(right, left)) / (2.0 * both);
            pairs += 1;
        }
    }
    (pairs > 0).then(|| other - own > OTHER_LEG * f64::from(pairs))
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

    /// A walk whose strides differ as in a turn: legs of both hips and knees, or the left knee alone. Strides grow and shrink in turn.
    fn turn(period: f64, strides: f64, start: f64, differ: f64, is_alone: bool) -> Recording {
        let hip = |cycles: f64| 15.0 + 20.0 * (TAU * cycles).cos() + 4.0 * (2.0 * TAU * cycles + 1.0).cos();
        let times: Vec<f64> = (0..(period * strides * 100.0) as usize).map(|n| n as f64 / 100.0).collect();
        let of = |name: &str, x: &dyn Fn(f64) -> f64, side: f64| {
            let value = |t: &f64| {
                let cycles = t / period + start + side;
                let size = 1.0 + differ * (0.5 * TAU * cycles).cos();
                size * x(cycles)
            };
            Channel::new(name, Quantity::Angle, times.iter().map(value).collect())
        };
        let left_knee = of("left_knee", &knee, 0.0);
        let channels = match is_alone {
            true => vec![left_knee],
            false => {
                vec![of("left_hip", &hip, 0.0), of("right_hip", &hip, 0.5), left_knee, of("right_knee", &knee, 0.5)]
            }
        };
        Recording::build(times, channels).unwrap()
    }

    #[test]
    fn a_recording_without_repetition_has_no_period() {
        assert_eq!(find(&record(10.0, 100.0, |_| 12.0)), None, "standing");
        assert_eq!(find(&record(10.0, 100.0, |t| 5.0 * t)), None, "a ramp");
        assert_eq!(find(&record(0.5, 100.0, |t| knee(t / 1.1))), None, "too short");
        assert_eq!(find(&record(1.0, 100.0, |t| knee(t / 1.1))), None, "less than a stride");
    }

    proptest! {
        /// Of two to three strides, of which every other one is larger.
        #[test]
        fn the_period_of_a_turn_is_one_stride(
            period in 0.8_f64..1.3, strides in 2.05_f64..2.9, start in 0.0_f64..2.0, differ in 0.0_f64..0.3, is_alone: bool,
        ) {
            let differ = if is_alone { 0.5 * differ } else { differ };
            let found = find(&turn(period, strides, start, differ, is_alone)).expect("periodic").period_s;
            prop_assert!((found / period - 1.0).abs() < 0.15, "{found} for {period}");
        }

        /// In a longer recording, where two strides come twice and fit better than one, only the two legs tell them apart.
        #[test]
        fn both_legs_tell_one_stride_from_two(
            period in 0.8_f64..1.2, strides in 4.2_f64..7.0, start in 0.0_f64..2.0, differ in 0.2_f64..0.4,
        ) {
            let walk = turn(period, strides, start, differ, false);
            let found = find(&walk).expect("periodic").period_s;
            prop_assert!((found / period - 1.0).abs() < 0.05, "{found} for {period}");
            let even = walk.resample(RATE_HZ).expect("even");
            let shift = |strides: f64| (strides * period * RATE_HZ).round() as usize;
            prop_assert_eq!(is_two_strides(even.channels(), shift(2.0)), Some(true));
            prop_assert_eq!(is_two_strides(even.channels(), shift(1.0)), Some(false));
            prop_assert_eq!(is_two_strides(&even.channels()[2..3], shift(2.0)), None);
        }

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
