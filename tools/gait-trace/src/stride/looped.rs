//! Cuts a recording to a whole number of strides that can be repeated without a jump.
//!
//! A recording ends in another pose than it begins with. The steps, in order:
//!
//! 1. The stride period T is found ([`crate::stride::period`]) and the recording is resampled to a fixed rate.
//! 2. The number of strides k is the largest that leaves at least a quarter stride for the choice of the cut, but at least one.
//! 3. The cut: of all starts s and lengths n within [`STRETCH`] of k T, the pair whose two ends agree best in value and slope over all
//!    channels, each in units of its standard deviation, slopes in those of a sine of period T:
//!    ```text
//!    sum over channels of  (x(s+n) - x(s))^2 / var x  +  (T / 2 pi)^2 (x'(s+n) - x'(s))^2 / var x
//!    ```
//! 4. The remaining mismatch d = x(s+n) - x(s) is spread evenly over the whole length:
//!    `y(i) = x(s+i) + d (1/2 - i/n)`. The mean does not change, both ends are equal, and no sample moves by more than d / 2.
//!
//! The result has n + 1 samples from time 0 on; the last equals the first and is the start of the next repetition.

use crate::clean::resample::ResampleError;
use crate::recording::{Channel, Recording};
use crate::series::varying;
use crate::stride::period;
use std::f64::consts::TAU;

/// Largest deviation of the cut from k mean strides, as a fraction of one stride.
pub const STRETCH: f64 = 0.1;

/// Part of the recording kept for the choice of the cut, as a fraction of one stride.
const CUT_MARGIN: f64 = 0.25;

/// Why a recording cannot be looped.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LoopError {
    /// No stride period was found.
    #[error(
        "no stride repeats within {duration_s} s; allowed is a periodic recording of at least one stride and {:.1} s more",
        period::OVERLAP_S
    )]
    NoStride {
        /// Length of the recording, seconds.
        duration_s: f64,
    },
    /// There is a period, but no complete stride.
    #[error("{duration_s} s hold no complete stride of {period_s} s; allowed is at least one stride")]
    TooShort {
        /// Length of the recording, seconds.
        duration_s: f64,
        /// The stride period, seconds.
        period_s: f64,
    },
    /// The recording cannot be resampled to the rate.
    #[error(transparent)]
    Rate(#[from] ResampleError),
}

/// A recording that can be repeated, with the cut and the remaining mismatch.
#[derive(Debug, Clone, PartialEq)]
pub struct Looped {
    /// The loop; its last row is its first.
    pub recording: Recording,
    /// Number of strides in it.
    pub strides: usize,
    /// Its start in the source, seconds from the source's first row.
    pub start_s: f64,
    /// Mismatch d of each channel that was spread, in its unit.
    pub mismatch: Vec<f64>,
}

impl Recording {
    /// Cuts the recording to a loop at a fixed rate in Hz.
    ///
    /// # Errors
    /// The recording is not periodic or too short, or the rate is out of range.
    ///
    /// ```
    /// use gait_trace::{Channel, Quantity, Recording};
    /// // 2.3 strides of 1.1 s, drifting by a degree a second.
    /// let times: Vec<f64> = (0..254).map(|n| f64::from(n) * 0.01).collect();
    /// let knee = times.iter().map(|t| 30.0 + t - 25.0 * (t / 1.1 * std::f64::consts::TAU).cos()).collect();
    /// let looped = Recording::build(times, vec![Channel::new("knee", Quantity::Angle, knee)])?.looped(1000.0)?;
    /// assert_eq!(looped.strides, 2);
    /// assert!((looped.recording.duration_s() - 2.2).abs() < 0.05);
    /// let knee = looped.recording.channel("knee")?.values();
    /// assert_eq!(knee.first(), knee.last());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn looped(&self, rate_hz: f64) -> Result<Looped, LoopError> {
        let duration_s = self.duration_s();
        let period_s = period::find(self).ok_or(LoopError::NoStride { duration_s })?.period_s;
        let even = self.resample(rate_hz)?;
        let strides = ((duration_s / period_s - CUT_MARGIN).floor() as usize).max(1);
        let cut = cut(&even, period_s * rate_hz, strides).ok_or(LoopError::TooShort { duration_s, period_s })?;

        let mut mismatch = Vec::new();
        let channels = even.channels().iter().map(|channel| {
            let x = &channel.values()[cut.start..=cut.start + cut.length];
            let d = x[cut.length] - x[0];
            mismatch.push(d);
            let meet = |(i, x): (usize, &f64)| x + d * (0.5 - i as f64 / cut.length as f64);
            let mut values: Vec<f64> = x.iter().enumerate().map(meet).collect();
            // The two ends are equal but for rounding.
            values[cut.length] = values[0];
            Channel::new(channel.name(), channel.quantity(), values)
        });
        let channels = channels.collect();
        let times = (0..=cut.length).map(|i| i as f64 / rate_hz).collect();
        let start_s = cut.start as f64 / rate_hz;
        let recording = Recording::build(times, channels).map_err(|_| LoopError::TooShort { duration_s, period_s })?;
        Ok(Looped { recording, strides, start_s, mismatch })
    }
}

/// A cut, in samples.
struct Cut {
    start: usize,
    length: usize,
}

/// The cut of step 3; `None` if no length fits.
fn cut(even: &Recording, period: f64, strides: usize) -> Option<Cut> {
    let samples = even.time_s().len();
    // A slope needs a sample on each side, so the outermost samples cannot be ends.
    let (mean, stretch) = (period * strides as f64, period * STRETCH);
    let shortest = ((mean - stretch).ceil() as usize).max(2);
    let longest = ((mean + stretch).floor() as usize).min(samples.checked_sub(3)?);
    let scale = period / TAU;
    let channels = varying(even.channels());
    let unlike = |start: usize, end: usize| -> f64 {
        let of_channel = |(x, variance): &(&[f64], f64)| {
            let slope = |i: usize| scale * 0.5 * (x[i + 1] - x[i - 1]);
            let (value, slope) = (x[end] - x[start], slope(end) - slope(start));
            (value * value + slope * slope) / variance
        };
        channels.iter().map(of_channel).sum()
    };
    (shortest..=longest)
        .flat_map(|length| (1..samples - 1 - length).map(move |start| Cut { start, length }))
        .map(|cut| (unlike(cut.start, cut.start + cut.length), cut))
        .min_by(|(a, _), (b, _)| a.total_cmp(b))
        .map(|(_, cut)| cut)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Quantity;
    use proptest::prelude::*;

    fn walk(period: f64, strides: f64, phase: f64, drift: f64) -> Recording {
        let hip = |cycles: f64| 10.0 + 22.0 * (TAU * cycles).cos();
        let knee = |cycles: f64| 25.0 - 18.0 * (TAU * cycles + 0.6).cos() - 15.0 * (2.0 * TAU * cycles).cos();
        let times: Vec<f64> = (0..(period * strides * 150.0) as usize).map(|n| n as f64 / 150.0).collect();
        let of = |name: &str, x: &dyn Fn(f64) -> f64| {
            Channel::new(name, Quantity::Angle, times.iter().map(|t| x(t / period + phase) + drift * t).collect())
        };
        let channels = vec![of("left_hip", &hip), of("right_hip", &|c| hip(c + 0.5)), of("left_knee", &knee)];
        Recording::build(times, channels).unwrap()
    }

    #[test]
    fn too_short_recordings_are_refused() {
        assert!(matches!(walk(1.1, 0.9, 0.0, 0.0).looped(500.0), Err(LoopError::NoStride { .. })));
        assert!(matches!(walk(1.1, 2.4, 0.0, 0.0).looped(0.0), Err(LoopError::Rate(_))));
    }

    #[test]
    fn spreading_keeps_the_mean_and_moves_by_half_the_mismatch() {
        let source = walk(1.1, 2.4, 0.3, 1.5);
        let looped = source.looped(500.0).unwrap();
        for (channel, d) in looped.recording.channels().iter().zip(&looped.mismatch) {
            let original = source.channel(channel.name()).unwrap();
            let moved: Vec<f64> = looped
                .recording
                .time_s()
                .iter()
                .zip(channel.values())
                .map(|(t, value)| value - source.at(original, t + looped.start_s))
                .collect();
            assert!(moved.iter().all(|moved| moved.abs() <= d.abs() / 2.0 + 1e-9), "{}", channel.name());
            assert!(moved.iter().sum::<f64>().abs() / (moved.len() as f64) < 1e-9, "{}", channel.name());
        }
        let most = looped.mismatch.iter().fold(0.0, |most: f64, d| most.max(d.abs()));
        assert!(most > 1.0, "part of the drift of 3.3 degrees over two strides remains to be spread: {most}");
    }

    /// A triangle: slopes are equal over half a stride, so only values distinguish the phases.
    #[test]
    fn equal_slopes_are_not_equal_phase() {
        let times: Vec<f64> = (0..400).map(|n| f64::from(n) * 0.01).collect();
        let triangle = times.iter().map(|t| 80.0 * ((t / 1.1).rem_euclid(1.0) - 0.5).abs()).collect();
        let walk = Recording::build(times, vec![Channel::new("knee", Quantity::Angle, triangle)]).unwrap();
        let looped = walk.looped(1000.0).unwrap();
        assert!(looped.mismatch[0].abs() < 0.1, "{:?}", looped.mismatch);
        assert!((looped.recording.duration_s() / looped.strides as f64 - 1.1).abs() < 0.002);
    }

    /// Largest step and largest bend (second difference) inside a loop, and those over its seam.
    fn steps_and_bends(y: &[f64]) -> [(f64, f64); 2] {
        let step = |w: &[f64]| (w[1] - w[0]).abs();
        let bend = |w: &[f64]| (w[2] - 2.0 * w[1] + w[0]).abs();
        let most = |n: usize, of: &dyn Fn(&[f64]) -> f64| y.windows(n).map(of).fold(0.0, f64::max);
        let (before, after) = (y[y.len() - 2], y[1]);
        let seam = (step(&[before, y[0]]).max(step(&[y[0], after])), bend(&[before, y[0], after]));
        [(most(2, &step), most(3, &bend)), seam]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        /// Repeated, no step over the seam is larger than the largest step inside, even if the recording drifts.
        #[test]
        fn the_seam_has_no_jump(
            period in 0.7_f64..1.6, strides in 1.3_f64..3.4, phase in 0.0_f64..1.0, drift in -2.0_f64..2.0,
        ) {
            let source = walk(period, strides, phase, drift);
            let looped = source.looped(200.0).unwrap();
            let whole = source.duration_s() / period - CUT_MARGIN - looped.strides as f64;
            prop_assert!(whole < 1.02 && (whole > -0.02 || looped.strides == 1), "{} and {whole}", looped.strides);
            let stretched = (looped.recording.duration_s() / looped.strides as f64 / period - 1.0).abs();
            prop_assert!(stretched < 0.03, "{}", stretched);
            for channel in looped.recording.channels() {
                let y = channel.values();
                prop_assert_eq!(y[0], y[y.len() - 1]);
                let [inside, seam] = steps_and_bends(y);
                prop_assert!(seam.0 <= inside.0, "{}: {seam:?} against {inside:?}", channel.name());
            }
        }

        /// Without drift the seam is as smooth as the rest.
        #[test]
        fn the_seam_has_no_kink(period in 0.7_f64..1.6, strides in 1.5_f64..3.4, phase in 0.0_f64..1.0) {
            let looped = walk(period, strides, phase, 0.0).looped(200.0).unwrap();
            prop_assert!(looped.mismatch.iter().all(|d| d.abs() < 1.0), "{:?}", looped.mismatch);
            for channel in looped.recording.channels() {
                let [inside, seam] = steps_and_bends(channel.values());
                prop_assert!(seam.1 <= 1.2 * inside.1, "{}: {seam:?} against {inside:?}", channel.name());
            }
        }
    }
}
