//! Low-pass filter of the angle: a median of three samples, then one pole.
//!
//! ```text
//! m_n = median(x_n, x_n-1, x_n-2)                       removes single spikes, delays by one sample
//! y_n = y_n-1 + a (m_n - y_n-1),   a = 1 - exp(-2 pi f_c T)
//! ```
//! x, m, y in radians, cut-off f_c in Hz, period T in seconds. With this a the step response is that of an analogue one-pole
//! filter at the sampling instants, 1 - exp(-2 pi f_c T n) after the median has let the step through. Stable for every
//! allowed f_c, as 0 < a < 1. At low frequency the delay is [`FilterConfig::delay_s`]: 8.5 ms for 20 Hz at 1 kHz.
//!
//! Sums in `f32` lose increments below half a unit in the last place and would stop before the input's value. The lost part is
//! therefore added to the next sample (W. Kahan, Comm. ACM 8(1), 1965), so that a constant input is reached exactly.
//! y always lies between its last value and m, so the filter cannot leave the range of its inputs.

use crate::range::{RangeError, within};
use core::f32::consts::PI;
use joint_units::order::between;
use joint_units::{Period, Radians};

/// Least cut-off in Hz.
const MIN_CUTOFF_HZ: f32 = 0.01;

/// The parameter of the low-pass filter.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FilterConfig {
    /// Cut-off of the pole in Hz: 0.01 to half the sampling rate. The default is 40 Hz, far above the 6 Hz or so of
    /// joint angles in walking: the delay stays below 5 ms, so that tracking reacts sooner to a change of pace.
    pub cutoff_hz: f32,
}

impl Default for FilterConfig {
    fn default() -> Self {
        Self { cutoff_hz: 40.0 }
    }
}

impl FilterConfig {
    /// Delay of a slowly changing input, in seconds: a sample for the median, (1 - a) / a for the pole,
    /// together T / a, which is 1 / (2 pi f_c) + T / 2 to a part of (2 pi f_c T)^2 / 12.
    ///
    /// ```
    /// use hgod_adc::{FilterConfig, FilterState};
    /// use joint_units::{Period, Radians};
    /// let config = FilterConfig { cutoff_hz: 20.0 };
    /// let delay_s = config.delay_s(Period::MILLISECOND);
    /// assert!((delay_s - 0.00846).abs() < 1e-5);
    /// // A ramp of 1 rad/s lags by this number of radians.
    /// let (filter, mut state) = (config.build(Period::MILLISECOND)?, FilterState::default());
    /// let late = (0..1000).map(|n| n as f32 * 1e-3).map(|t| t - filter.step(&mut state, Radians(t)).0).last();
    /// assert!((late.unwrap() - delay_s).abs() < 2e-5, "{late:?}");
    /// # Ok::<(), hgod_adc::RangeError>(())
    /// ```
    #[must_use]
    pub const fn delay_s(&self, period: Period) -> f32 {
        0.5 * period.seconds() + 1.0 / (2.0 * PI * self.cutoff_hz)
    }

    /// Checks the cut-off and computes the filter's gain for a control period.
    ///
    /// # Errors
    /// [`RangeError`] if the cut-off is out of range.
    pub fn build(&self, period: Period) -> Result<Filter, RangeError> {
        let half_rate = 500_000.0 / period.micros() as f32;
        let cutoff = within("filter.cutoff_hz", self.cutoff_hz, MIN_CUTOFF_HZ, half_rate)?;
        Ok(Filter { gain: -libm::expm1f(-2.0 * PI * cutoff * period.seconds()) })
    }
}

/// A checked [`FilterConfig`] for a control period.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Filter {
    /// a in the equation above.
    gain: f32,
}

/// State of a filter between samples. The default is empty: the first sample is then taken as if the input had been constant before it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FilterState {
    memory: Option<Memory>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Memory {
    /// The last two inputs, newest first.
    inputs: (f32, f32),
    /// The output y.
    output: f32,
    /// The part of y's increments that rounding has lost.
    carry: f32,
}

impl Filter {
    /// Takes one sample and returns the filtered angle.
    ///
    /// A sample that is not finite is ignored: the result is the last output (the sample itself, if there is none yet).
    ///
    /// ```
    /// use hgod_adc::{FilterConfig, FilterState};
    /// use joint_units::{Period, Radians};
    /// let filter = FilterConfig { cutoff_hz: 20.0 }.build(Period::MILLISECOND)?;
    /// let mut state = FilterState::default();
    /// assert_eq!(filter.step(&mut state, Radians(0.5)), Radians(0.5));
    /// assert_eq!(filter.step(&mut state, Radians(2.0)), Radians(0.5)); // a spike
    /// assert_eq!(filter.step(&mut state, Radians(0.5)), Radians(0.5));
    /// # Ok::<(), hgod_adc::RangeError>(())
    /// ```
    pub fn step(&self, state: &mut FilterState, input: Radians) -> Radians {
        let x = input.0;
        let Some(memory) = &mut state.memory else {
            if x.is_finite() {
                state.memory = Some(Memory { inputs: (x, x), output: x, carry: 0.0 });
            }
            return input;
        };
        if x.is_finite() {
            let (newer, older) = memory.inputs;
            let median = between(x, newer, older);
            let last = memory.output;
            let wanted = self.gain * (median - last) + memory.carry;
            let output = between(last + wanted, last, median);
            *memory = Memory { inputs: (x, newer), output, carry: wanted - (output - last) };
        }
        Radians(memory.output)
    }
}
