//! Resamples a recording to a fixed rate by linear interpolation.
//!
//! Sample n is at `t0 + n / rate`, computed from n, so that no rounding error accumulates; the last sample is the last one within the
//! recording. Nothing is extrapolated. A signal with content above half the rate needs a low-pass filter first.

use crate::recording::{Channel, Recording};

/// Largest number of samples of a channel: three hours at 1 kHz.
pub const MAX_SAMPLES: usize = 10_800_000;

/// Why a recording cannot be resampled.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ResampleError {
    /// The rate is out of range.
    #[error("rate {rate_hz} Hz; allowed is 1 to 100000 Hz")]
    Rate {
        /// The requested rate, Hz.
        rate_hz: f64,
    },
    /// Fewer than two samples, or more than [`MAX_SAMPLES`].
    #[error("{samples} samples of {duration_s} s at {rate_hz} Hz; allowed are 2 to {MAX_SAMPLES}")]
    Samples {
        /// Number of samples that would result.
        samples: f64,
        /// Length of the recording, seconds.
        duration_s: f64,
        /// The requested rate, Hz.
        rate_hz: f64,
    },
}

impl Recording {
    /// The recording at a fixed rate.
    ///
    /// # Errors
    /// The rate is not 1 to 100,000 Hz, or gives fewer than two samples or too many.
    pub fn resample(&self, rate_hz: f64) -> Result<Self, ResampleError> {
        if !(1.0..=100_000.0).contains(&rate_hz) {
            return Err(ResampleError::Rate { rate_hz });
        }
        let duration_s = self.duration_s();
        // A millionth of a sample more: 0.29 s at 100 Hz end with sample 29, although 0.29 * 100 is a little less in binary.
        let samples = (duration_s * rate_hz + 1e-6).floor() + 1.0;
        if !(2.0..=MAX_SAMPLES as f64).contains(&samples) {
            return Err(ResampleError::Samples { samples, duration_s, rate_hz });
        }
        let start = self.time_s()[0];
        let offsets: Vec<f64> = (0..samples as usize).map(|n| n as f64 / rate_hz).collect();
        let channels = self.channels().iter().map(|channel| {
            let values = offsets.iter().map(|offset| self.at(channel, start + offset)).collect();
            Channel::new(channel.name(), channel.quantity(), values)
        });
        let channels = channels.collect();
        let times = offsets.iter().map(|offset| start + offset).collect();
        Recording::build(times, channels).map_err(|_| ResampleError::Samples { samples, duration_s, rate_hz })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Quantity;
    use proptest::prelude::*;

    fn ramp(times: &[f64]) -> Recording {
        let values = times.iter().map(|t| 3.0 * t - 1.0).collect();
        Recording::build(times.to_vec(), vec![Channel::new("knee", Quantity::Angle, values)]).unwrap()
    }

    #[test]
    fn the_last_sample_is_within_the_recording() {
        assert_eq!(ramp(&[0.0, 0.3]).resample(10.0).unwrap().time_s(), [0.0, 0.1, 0.2, 0.3]);
        assert_eq!(ramp(&[0.0, 0.29]).resample(10.0).unwrap().time_s(), [0.0, 0.1, 0.2]);
        // 0.29 * 100 is a little less than 29 in binary.
        assert_eq!(ramp(&[0.0, 0.29]).resample(100.0).unwrap().time_s().len(), 30);
    }

    #[test]
    fn rates_out_of_range_are_refused() {
        let recording = ramp(&[0.0, 0.3]);
        for rate in [0.0, -5.0, f64::NAN, f64::INFINITY, 1e9, 0.5] {
            assert!(matches!(recording.resample(rate), Err(ResampleError::Rate { .. })), "{rate}");
        }
        assert!(matches!(recording.resample(2.0), Err(ResampleError::Samples { .. })));
        let knee = Channel::new("knee", Quantity::Angle, vec![1.0, 2.0]);
        let years = Recording::build(vec![0.0, 1e9], vec![knee]).unwrap();
        assert!(matches!(years.resample(1000.0), Err(ResampleError::Samples { .. })));
    }

    proptest! {
        /// Straight lines are resampled to themselves, whatever the spacing of the samples.
        #[test]
        fn a_straight_line_stays_one(steps in prop::collection::vec(0.001_f64..0.2, 2..40), rate in 5.0_f64..500.0) {
            let times: Vec<f64> = steps.iter().scan(0.25, |t, step| { *t += step; Some(*t) }).collect();
            let recording = ramp(&times);
            prop_assume!(recording.duration_s() * rate >= 1.0);
            let even = recording.resample(rate).unwrap();
            for (time, value) in even.time_s().iter().zip(even.channels()[0].values()) {
                prop_assert!((value - (3.0 * time - 1.0)).abs() < 1e-9, "{value} at {time}");
            }
            let end = even.time_s()[even.time_s().len() - 1];
            let (last, slack) = (times[times.len() - 1], 1e-6 / rate + 1e-12);
            prop_assert!(end <= last + slack && end + 1.0 / rate > last - slack);
        }
    }
}
