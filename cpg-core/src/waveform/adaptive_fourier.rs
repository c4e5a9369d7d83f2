//! Adaptive Fourier series: learns frequency, phase and N harmonics of a signal while it runs.
//!
//! ```text
//! q = a_0 + sum_k a_k cos k phi + b_k sin k phi,   e = P - q
//! phi' = w - K e sin phi,   w' = -K e sin phi,   a_0' = eta e,   a_k' = eta e cos k phi,   b_k' = eta e sin k phi
//! ```
//! P is the taught signal in units of its own amplitude (about ±1: un-normalised radians learn about ten times slower), phi in radians,
//! w in radians per second. From a first frequency with an error of a fifth it reaches the least-squares error of its N harmonics in about
//! ten strides. With [`AdaptiveFourier::play`] it repeats the learned signal.
//!
//! The coefficient laws are a gradient descent: with the squared error E = e^2 / 2, `-dE/da_k = e cos k phi` and `-dE/db_k = e sin k phi`.
//! The laws of phase and frequency are those of an adaptive-frequency oscillator that is driven by e (Righetti, Buchli and Ijspeert, Physica
//! D 216, 2006: a Hopf oscillator in polar coordinates has `phi' = w - (K/r) e sin phi` and `w' = -K e sin phi`, here with r = 1). The
//! combination of one such oscillator with a Fourier series is that of Petric, Gams, Ijspeert and Zlajpah, "On-line frequency adaptation
//! and movement imitation for rhythmic robotic tasks", Int. J. Robotics Research 30, 2011.

use joint_units::{Period, Phase, RadPerSec, Radians};

use crate::error::in_range;
use crate::joints::features::{Features, fill, harmonics};
use crate::math::trig::sin_cos;
use crate::waveform::shape::FourierShape;
use crate::{BuildError, Field, Generator, StateFault};

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

impl AdaptiveFourierConfig {
    /// Validates the configuration for a control period; all coefficients start at 0, at the guessed frequency.
    ///
    /// # Errors
    /// Names the field that is out of range.
    pub fn build<const H: usize>(&self, period: Period) -> Result<AdaptiveFourier<H>, BuildError> {
        in_range(self.coupling, Field::of("coupling"), 0.0, 20.0)?;
        in_range(self.learning, Field::of("learning"), 0.0, 20.0)?;
        in_range(self.frequency_hz, Field::of("frequency_hz"), 0.05, 5.0)?;
        Ok(AdaptiveFourier {
            config: *self,
            period_s: period.seconds(),
            phase: Phase(0),
            frequency: core::f32::consts::TAU * self.frequency_hz,
            mean: 0.0,
            cos: [0.0; H],
            sin: [0.0; H],
        })
    }
}

impl<const H: usize> AdaptiveFourier<H> {
    /// One control period with the taught signal; returns the error e. A sample that is not a finite number is ignored (the phase runs
    /// on), so that one bad sample does not change the learned series.
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
        // The learned frequency is limited to the range of a person's strides.
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
        self.phase += Phase::from_cycles(cycles);
    }

    /// The signal q at the current phase.
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

    /// The slope of q per radian at the current phase.
    #[must_use]
    pub fn slope(&self) -> f32 {
        let (s1, c1) = sin_cos(self.phase);
        let (mut s, mut c, mut order, mut slope) = (s1, c1, 1.0, 0.0);
        for (&a, &b) in self.cos.iter().zip(&self.sin) {
            slope += order * (b * c - a * s);
            order += 1.0;
            (s, c) = (s * c1 + c * s1, c * c1 - s * s1);
        }
        slope
    }

    /// The current phase.
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

/// N joints that share one phase, learned from the first joint; each learns its own series. It learns a walk from recorded or measured
/// angles.
///
/// ```
/// use cpg_core::Generator;
/// use cpg_core::gait::named::Gait;
/// use cpg_core::waveform::adaptive_fourier::{AdaptiveFourierConfig, AdaptiveWalkConfig};
/// use joint_units::Period;
/// // A person walks at a stride of 1.084 s; the generator starts with zero coefficients, a tenth too slow.
/// let mut person = Gait::NaturalWalk.build(1.0, Period::MILLISECOND)?;
/// let config = AdaptiveFourierConfig { frequency_hz: 0.83, ..AdaptiveFourierConfig::default() };
/// let mut walk = AdaptiveWalkConfig { learner: config, unit: 0.5 }.build::<6, 4>(Period::MILLISECOND)?;
/// for _ in 0..60_000 {
///     walk.learn(person.angles());
///     person.step();
/// }
/// for _ in 0..5000 {
///     person.step();
///     walk.step();
///     let [_, _, knee, _] = walk.angles();
///     assert!((knee.0 - person.angles()[2].0).abs() < 0.04);
/// }
/// # Ok::<(), cpg_core::BuildError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptiveWalk<const H: usize, const N: usize> {
    joints: [AdaptiveFourier<H>; N],
    start: [AdaptiveFourier<H>; N],
    /// rad per unit of the series.
    unit: f32,
}

/// Gains and unit of an [`AdaptiveWalk`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptiveWalkConfig {
    /// Gains and first frequency of every joint.
    pub learner: AdaptiveFourierConfig,
    /// Amplitude in rad that learns at the configured rates, 0.01 to 3.
    pub unit: f32,
}

impl AdaptiveWalkConfig {
    /// Validates the configuration for a control period; all coefficients start at 0.
    ///
    /// # Errors
    /// Names the field that is out of range.
    pub fn build<const H: usize, const N: usize>(&self, period: Period) -> Result<AdaptiveWalk<H, N>, BuildError> {
        in_range(self.unit, Field::of("unit"), 0.01, 3.0)?;
        let joints = [self.learner.build(period)?; N];
        Ok(AdaptiveWalk { joints, start: joints, unit: self.unit })
    }
}

impl<const H: usize, const N: usize> AdaptiveWalk<H, N> {
    /// Begins with these series as if it had learned them; a reset returns to them.
    #[must_use]
    pub fn taught(mut self, shapes: &[FourierShape<H>; N]) -> Self {
        let per_unit = 1.0 / self.unit;
        for (joint, shape) in self.joints.iter_mut().zip(shapes) {
            let (mean, cos, sin) = shape.coefficients();
            (joint.mean, joint.cos, joint.sin) =
                (mean * per_unit, cos.map(|a| a * per_unit), sin.map(|b| b * per_unit));
        }
        self.start = self.joints;
        self
    }

    /// One control period with the taught joints.
    pub fn learn(&mut self, taught: [Radians; N]) {
        let per_unit = 1.0 / self.unit;
        for (joint, angle) in self.joints.iter_mut().zip(taught) {
            joint.learn(angle.0 * per_unit);
        }
        // Every other joint takes phase and frequency from the first, in place of its own.
        if let Some(first) = self.joints.first().copied() {
            for joint in &mut self.joints {
                (joint.phase, joint.frequency) = (first.phase, first.frequency);
            }
        }
    }

    /// The learned frequency in cycles per second.
    #[must_use]
    pub fn frequency_hz(&self) -> f32 {
        self.joints.first().map_or(0.0, AdaptiveFourier::frequency_hz)
    }
}

impl<const H: usize, const N: usize> Generator<N> for AdaptiveWalk<H, N> {
    fn step(&mut self) {
        for joint in &mut self.joints {
            joint.play();
        }
    }

    fn angles(&self) -> [Radians; N] {
        self.joints.map(|joint| Radians(self.unit * joint.value()))
    }

    fn rates(&self) -> [RadPerSec; N] {
        self.joints.map(|joint| RadPerSec(self.unit * joint.frequency * joint.slope()))
    }

    /// That of the series: 0 where the first joint is most flexed if it was set so; arbitrary if it began with zero coefficients.
    fn phase(&self) -> Phase {
        self.joints.first().map_or(Phase(0), AdaptiveFourier::phase)
    }

    fn amplitude(&self) -> f32 {
        1.0
    }

    fn check(&self) -> Result<(), StateFault> {
        let finite = |joint: &AdaptiveFourier<H>| joint.value().is_finite() && joint.slope().is_finite();
        match self.joints.iter().position(|joint| !finite(joint)) {
            Some(joint) => Err(StateFault::NotFinite { state: Field::at("joints.coefficients", joint) }),
            None => Ok(()),
        }
    }

    fn reset(&mut self) {
        self.joints = self.start;
    }
}

/// As those of a [`FourierShape`].
impl<const H: usize, const N: usize> Features for AdaptiveWalk<H, N> {
    const COUNT: usize = 2 * H;

    fn features(&self, out: &mut [f32]) {
        fill(out, harmonics(self.phase(), H as u32));
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
            let mut learner = config.build::<3>(Period::MILLISECOND).unwrap();
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

    /// The learned signal continues, and one bad sample does not change it.
    #[test]
    fn plays_on_and_shrugs_off_bad_samples() {
        let mut learner = AdaptiveFourierConfig::default().build::<3>(Period::MILLISECOND).unwrap();
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
            AdaptiveFourierConfig { coupling, learning, frequency_hz }.build::<2>(Period::MILLISECOND)
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
