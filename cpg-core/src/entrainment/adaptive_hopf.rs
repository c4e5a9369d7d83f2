//! Estimates phase and stride frequency with an adaptive-frequency Hopf oscillator: a comparison with [`crate::entrainment::phase_lock`].
//!
//! The input F of [`AdaptiveHopf`] is the measured angle minus its running mean, divided by its running amplitude. For a sinusoid F = cos a the
//! oscillator's angle follows a, because F pulls x towards it; [`crate::oscillator::hopf`] derives why the frequency follows too. The estimator
//! needs no template, uses no harmonics and detects no fault of the sensor. At the default learning rate a frequency that is 20 % off is within
//! 3 % after 5 to 40 s (asserted by the test in this file), where the phase lock takes about 2 s.
//!
//! Source of the oscillator: Righetti, Buchli and Ijspeert 2006, see [`crate::oscillator::hopf`]; the normalisation of the input is our own.

use core::f32::consts::TAU;

use joint_units::{Period, Phase, RadPerSec, Radians};

use crate::error::{allow_period, in_range};
use crate::math::first_order::rk4;
use crate::math::trig::angle;
use crate::oscillator::hopf::AdaptiveHopf;
use crate::{BuildError, Field};

/// Parameters of an [`AdaptiveHopfEstimator`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptiveHopfConfig {
    /// First estimate of the stride time, s; 0.3 to 5, default 1.1. The estimated frequency stays within 0.2 to 4 times that of this stride.
    pub stride_s: f32,
    /// Strength eps of the input's pull on phase (1/s) and frequency (1/s^2); 0.05 to 20, default 0.9.
    pub learning: f32,
    /// Rate g at which the radius returns to 1, 1/s; 0.5 to 50, default 8.
    pub gain: f32,
}

impl Default for AdaptiveHopfConfig {
    /// The default of each field.
    fn default() -> Self {
        Self { stride_s: 1.1, learning: 0.9, gain: 8.0 }
    }
}

/// Estimator of phase and stride frequency. Call [`AdaptiveHopfEstimator::step`] once a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptiveHopfEstimator {
    flow: AdaptiveHopf,
    /// x, y and w in rad/s.
    state: [f32; 3],
    /// Running mean of the angle, rad; `None` before the first sample.
    mean: Option<f32>,
    /// Running mean square about it, rad^2.
    square: f32,
    period_s: f32,
    nominal: f32,
}

/// Time constant of the running mean and amplitude, s.
const LEVEL_S: f32 = 1.5;

impl AdaptiveHopfConfig {
    /// Validates the configuration and builds the estimator at phase 0 with the configured stride time.
    ///
    /// # Errors
    /// [`BuildError`] names the field that is out of range; [`BuildError::PeriodTooLong`] above 20 ms.
    pub fn build(self, period: Period) -> Result<AdaptiveHopfEstimator, BuildError> {
        in_range(self.stride_s, Field::of("stride_s"), 0.3, 5.0)?;
        in_range(self.learning, Field::of("learning"), 0.05, 20.0)?;
        in_range(self.gain, Field::of("gain"), 0.5, 50.0)?;
        allow_period(period, 20_000)?;
        let nominal = TAU / self.stride_s;
        Ok(AdaptiveHopfEstimator {
            flow: AdaptiveHopf { gain: self.gain, square_radius: 1.0, learning: self.learning, input: 0.0 },
            state: [1.0, 0.0, nominal],
            mean: None,
            square: 0.0,
            period_s: period.seconds(),
            nominal,
        })
    }
}

impl AdaptiveHopfEstimator {
    /// Advances by one control period with the measured angle at its end. An angle that is not finite counts as the running mean.
    pub fn step(&mut self, measured: Radians) {
        let share = (self.period_s / LEVEL_S).min(1.0);
        let y = if measured.0.is_finite() { measured.0 } else { self.mean.unwrap_or(0.0) };
        let mean = self.mean.unwrap_or(y);
        let off = y - mean;
        self.mean = Some(mean + off * share);
        self.square += (off * off - self.square) * share;
        // Of a sinusoid of amplitude A the mean square is A^2 / 2.
        let amplitude = libm::sqrtf(2.0 * self.square).max(0.02);
        self.flow.input = (off / amplitude).clamp(-2.0, 2.0);
        rk4(&self.flow, &mut self.state, self.period_s);
        let [x, y, w] = &mut self.state;
        *x = x.clamp(-4.0, 4.0);
        *y = y.clamp(-4.0, 4.0);
        *w = w.max(0.2 * self.nominal).min(4.0 * self.nominal);
    }

    /// Estimated phase of the fundamental, 0 at its greatest flexion.
    #[must_use]
    pub fn phase(&self) -> Phase {
        let [x, y, _] = self.state;
        angle(y, x)
    }

    /// Estimated angular frequency of the stride.
    #[must_use]
    pub const fn frequency(&self) -> RadPerSec {
        let [_, _, w] = self.state;
        RadPerSec(w)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On a sinusoid the estimator learns the frequency, much more slowly than the phase lock.
    #[test]
    fn it_learns_a_frequency_in_tens_of_seconds() {
        for factor in [0.8, 1.2] {
            let config = AdaptiveHopfConfig { stride_s: 1.1 * factor, ..AdaptiveHopfConfig::default() };
            let mut hopf = config.build(Period::MILLISECOND).unwrap();
            let mut learned = 0;
            for tick in 0..60_000u32 {
                let turn = TAU * Phase::from_cycles(tick as f32 * 1e-3 / 1.1).cycles();
                hopf.step(Radians(0.2 + 0.35 * turn.cos()));
                if (hopf.frequency().0 * 1.1 / TAU - 1.0).abs() > 0.03 {
                    learned = tick + 1;
                }
            }
            assert!((5_000..40_000).contains(&learned), "{factor}: {learned} ms");
        }
    }

    #[test]
    fn what_is_not_finite_is_left_out_and_bad_fields_are_named() {
        let mut hopf = AdaptiveHopfConfig::default().build(Period::MILLISECOND).unwrap();
        for tick in 0..5000 {
            hopf.step(Radians(if tick % 7 == 0 { f32::NAN } else { (tick as f32 * 0.006).sin() }));
            assert!(hopf.frequency().0.is_finite());
        }
        let error = |config: AdaptiveHopfConfig| config.build(Period::MILLISECOND).unwrap_err().to_string();
        assert!(error(AdaptiveHopfConfig { learning: 0.0, ..Default::default() }).contains("learning"));
        assert!(error(AdaptiveHopfConfig { gain: f32::NAN, ..Default::default() }).contains("gain"));
        assert!(error(AdaptiveHopfConfig { stride_s: 9.0, ..Default::default() }).contains("stride_s"));
    }
}
