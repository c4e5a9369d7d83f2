//! One phase and a Fourier series that learn a signal on line: frequency, phase and N harmonics together.
//!
//! ```text
//! q = a_0 + sum_k a_k cos k phi + b_k sin k phi,   e = P - q
//! phi' = w - K e sin phi,   w' = -K e sin phi,   a_0' = eta e,   a_k' = eta e cos k phi,   b_k' = eta e sin k phi
//! ```
//! P is the taught signal in units of its own amplitude (about ±1: un-normalised radians learn some ten times slower), phi in radians,
//! w in radians per second. From a frequency wrong by a fifth it reaches the least-squares error of its N harmonics in some ten
//! strides. Freeze it with a learning rate of 0: it plays the learned signal for ever.
//! Source: the adaptive-oscillator-with-Fourier-series form of Petric, Gams and Ijspeert 2011 (from memory of the literature).

use joint_units::{Period, Phase};

use crate::error::in_range;
use crate::trig::sin_cos;
use crate::{BuildError, Field};

/// Gains and start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptiveFourierConfig {
    /// K, pull of the error on phase and frequency, 0 to 20 per second.
    pub coupling: f32,
    /// eta, learning rate of the coefficients, 0 to 20 per second.
    pub learning: f32,
    /// First guess of the frequency in cycles per second, 0.05 to 5.
    pub frequency_hz: f32,
}

impl Default for AdaptiveFourierConfig {
    /// K = 4, eta = 1, 0.9 cycles per second.
    fn default() -> Self {
        Self { coupling: 4.0, learning: 1.0, frequency_hz: 0.9 }
    }
}

/// Learns and plays a signal of H harmonics.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptiveFourier<const H: usize> {
    config: AdaptiveFourierConfig,
    period_s: f32,
    phase: Phase,
    /// Radians per second.
    frequency: f32,
    mean: f32,
    cos: [f32; H],
    sin: [f32; H],
}

impl<const H: usize> AdaptiveFourier<H> {
    /// Starts from silence at the guessed frequency.
    ///
    /// # Errors
    /// Names the field that is out of range.
    pub fn build(config: AdaptiveFourierConfig, period: Period) -> Result<Self, BuildError> {
        in_range(config.coupling, Field::of("coupling"), 0.0, 20.0)?;
        in_range(config.learning, Field::of("learning"), 0.0, 20.0)?;
        in_range(config.frequency_hz, Field::of("frequency_hz"), 0.05, 5.0)?;
        Ok(Self {
            config,
            period_s: period.seconds(),
            phase: Phase(0),
            frequency: core::f32::consts::TAU * config.frequency_hz,
            mean: 0.0,
            cos: [0.0; H],
            sin: [0.0; H],
        })
    }

    /// One control period with the taught signal; returns the error e. A sample that is not a finite number is ignored (the phase runs
    /// on), so that one bad sample can't poison what was learned.
    pub fn learn(&mut self, taught: f32) -> f32 {
        let error = if taught.is_finite() { taught - self.value() } else { 0.0 };
        let (s1, c1) = sin_cos(self.phase);
        let pull = self.config.coupling * error * s1;
        let rate = self.config.learning * error * self.period_s;
        self.mean += rate;
        let (mut s, mut c) = (s1, c1);
        for (a, b) in self.cos.iter_mut().zip(&mut self.sin) {
            *a += rate * c;
            *b += rate * s;
            (s, c) = (s * c1 + c * s1, c * c1 - s * s1);
        }
        self.advance(self.frequency - pull);
        // The learned frequency keeps to what a person can walk or run.
        let (slowest, fastest) = (0.05 * core::f32::consts::TAU, 5.0 * core::f32::consts::TAU);
        self.frequency = (self.frequency - pull * self.period_s).max(slowest).min(fastest);
        error
    }

    /// One control period without a signal: plays what it has learned.
    pub fn play(&mut self) {
        self.advance(self.frequency);
    }

    fn advance(&mut self, radians_per_second: f32) {
        let cycles = radians_per_second * self.period_s * (1.0 / core::f32::consts::TAU);
        self.phase = Phase(self.phase.0.wrapping_add(Phase::from_cycles(cycles).0));
    }

    /// The signal q at the phase now.
    #[must_use]
    pub fn value(&self) -> f32 {
        let (s1, c1) = sin_cos(self.phase);
        let (mut s, mut c, mut q) = (s1, c1, self.mean);
        for (&a, &b) in self.cos.iter().zip(&self.sin) {
            q += a * c + b * s;
            (s, c) = (s * c1 + c * s1, c * c1 - s * s1);
        }
        q
    }

    /// The phase now.
    #[must_use]
    pub const fn phase(&self) -> Phase {
        self.phase
    }

    /// The learned frequency in cycles per second.
    #[must_use]
    pub fn frequency_hz(&self) -> f32 {
        self.frequency * (1.0 / core::f32::consts::TAU)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A hip-like signal of three harmonics about ±1, plus a fourth that three harmonics cannot follow.
    fn hip(cycles: f64, fourth: f64) -> f32 {
        let t = core::f64::consts::TAU * cycles;
        (0.2 + 0.8 * t.cos() + 0.15 * (2.0 * t + 0.5).cos() + 0.06 * (3.0 * t - 1.0).sin() + fourth * (4.0 * t).cos())
            as f32
    }

    /// From a fifth too slow or too fast: the error falls to the floor of the missing harmonic within 10 s, the frequency is right.
    #[test]
    fn reaches_the_floor_of_its_harmonics_within_ten_strides() {
        for start in [0.8, 0.9, 1.1, 1.2] {
            let config = AdaptiveFourierConfig { frequency_hz: start, ..AdaptiveFourierConfig::default() };
            let mut learner = AdaptiveFourier::<3>::build(config, Period::MILLISECOND).unwrap();
            let mut square = 0.0;
            for tick in 0..12_000u32 {
                let error = learner.learn(hip(f64::from(tick) * 1e-3, 0.02));
                if tick >= 10_000 {
                    square += f64::from(error * error) / 2000.0;
                }
            }
            let floor = 0.02 / 2f64.sqrt();
            assert!(square.sqrt() < 1.3 * floor, "from {start}: {} against {floor}", square.sqrt());
            assert!(square.sqrt() > 0.9 * floor, "no better than its harmonics allow");
            assert!((learner.frequency_hz() - 1.0).abs() < 0.01);
        }
    }

    /// What was learned plays on, and one bad sample does not change it.
    #[test]
    fn plays_on_and_shrugs_off_bad_samples() {
        let mut learner = AdaptiveFourier::<3>::build(AdaptiveFourierConfig::default(), Period::MILLISECOND).unwrap();
        for tick in 0..30_000u32 {
            let taught = if tick % 1000 == 999 {
                [f32::NAN, f32::INFINITY][tick as usize / 1000 % 2]
            } else {
                hip(f64::from(tick) * 1e-3, 0.0)
            };
            learner.learn(taught);
        }
        let mut worst = 0.0f32;
        for tick in 30_000..32_000u32 {
            worst = worst.max((learner.value() - hip(f64::from(tick) * 1e-3, 0.0)).abs());
            learner.play();
        }
        assert!(worst < 0.03, "{worst}");
    }

    #[test]
    fn bad_fields_are_named() {
        let build = |coupling, learning, frequency_hz| {
            AdaptiveFourier::<2>::build(AdaptiveFourierConfig { coupling, learning, frequency_hz }, Period::MILLISECOND)
        };
        for (result, name) in [
            (build(-1.0, 1.0, 1.0), "coupling"),
            (build(1.0, 21.0, 1.0), "learning"),
            (build(1.0, 1.0, f32::NAN), "frequency_hz"),
        ] {
            assert!(result.unwrap_err().to_string().contains(name));
        }
    }
}
