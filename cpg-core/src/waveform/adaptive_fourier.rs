//! Adaptive Fourier series: learns frequency, phase and H harmonics of a periodic signal while it runs, then plays them.
//!
//! ```text
//! q = a_0 + sum_k ( a_k cos k phi + b_k sin k phi ),  k = 1 to H,   e = P - q
//! phi' = w - K e sin phi,   w' = -K e sin phi
//! a_0' = eta e,   a_k' = eta e cos k phi,   b_k' = eta e sin k phi
//! ```
//! P is the signal that is learned, q the learned signal and e the error, all in units of the signal's amplitude: about ±1. phi is the phase in
//! rad, w its angular frequency in rad/s, K the coupling (1/s in phi', 1/s^2 in w'), eta the learning rate in 1/s. The equations are integrated
//! by Euler's method, one step a control period.
//!
//! From a frequency that is a fifth off, the error falls to the least-squares error of the H harmonics within ten strides (asserted by a test in
//! this file). A signal in radians, with an amplitude of 0.1 or so, is learned about ten times slower: divide it by its amplitude, as
//! [`AdaptiveWalkConfig::unit`] does.
//!
//! | to | see |
//! |---|---|
//! | learn and play one signal | [`AdaptiveFourierConfig`], [`AdaptiveFourier`] |
//! | learn the joints of a gait, and use them as a generator | [`AdaptiveWalkConfig`], [`AdaptiveWalk`] |
//!
//! # Why it converges
//! The coefficients follow the gradient of E = e^2 / 2: `-dE/da_k = e cos k phi`, `-dE/db_k = e sin k phi`, `-dE/da_0 = e`.
//!
//! For phase and frequency, average over a cycle (K and eta small against w). Begin with all coefficients 0 and P = A cos theta, theta' = W: then
//! e sin phi has the mean `-(A/2) sin(theta - phi)`, so phi is pulled to theta. Now let the series be that of the signal except for small errors:
//! theta - phi = d, v = W - w, and b the error of b_1, with a_1 = A. To first order the error at the fundamental is u sin phi with
//! u = b - A d, and the means are
//! ```text
//! u' = -(eta + A K) u / 2 - A v,   v' = K u / 2
//! ```
//! of which both eigenvalues have a negative real part for K > 0, eta >= 0 and A > 0: the error u and the frequency error v vanish. With the
//! defaults and A = 1 they are -1.25 ± 0.66 i per second. The other coefficients decay as exp(-eta t / 2), a_0 as exp(-eta t).
//!
//! Only u is determined, not d and b: the zero of phi depends on the start. It is where the cosine of the fundamental has a positive coefficient.
//!
//! # Sources
//! One adaptive-frequency oscillator with a Fourier series in its feedback is due to Petric, Gams, Ijspeert and Zlajpah, "On-line frequency
//! adaptation and movement imitation for rhythmic robotic tasks", Int. J. Robotics Research 30(14), 2011, 1775-1788. The paper itself was not at
//! hand; the equations were compared with a program by its first author (T. Petric, AFS_integrate, Matlab, January 2015). They agree, and both
//! use Euler's method. Differences: that program holds b_1 at 0, which fixes the zero of the phase; its defaults are K = 20, eta = 2 and ten
//! terms (a_0 included); and it has no limits of the frequency, which here stays within 0.05 to 5 Hz. The laws of phase and frequency are
//! those of the adaptive Hopf oscillator of [`crate::oscillator::hopf`] on its limit cycle, with e as the input.

use joint_units::{Period, Phase, RadPerSec, Radians};

use crate::error::in_range;
use crate::joints::features::{Features, fill, harmonics};
use crate::math::trig::sin_cos;
use crate::waveform::shape::FourierShape;
use crate::{BuildError, Field, Generator, StateFault};

/// Gains and first frequency of an [`AdaptiveFourier`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptiveFourierConfig {
    /// K, pull of the error on phase (1/s) and frequency (1/s^2); 0 to 20, default 4.
    pub coupling: f32,
    /// eta, learning rate of the coefficients in 1/s; 0 to 20, default 1.
    pub learning: f32,
    /// First frequency in cycles per second; 0.05 to 5, default 0.9.
    pub frequency_hz: f32,
}

impl Default for AdaptiveFourierConfig {
    /// The default of each field.
    fn default() -> Self {
        Self { coupling: 4.0, learning: 1.0, frequency_hz: 0.9 }
    }
}

/// Learns and plays a signal of H harmonics.
///
/// ```
/// use cpg_core::waveform::adaptive_fourier::AdaptiveFourierConfig;
/// use joint_units::Period;
/// let mut learner = AdaptiveFourierConfig::default().build::<2>(Period::MILLISECOND)?;
/// // A signal of 1 Hz; the first frequency is 0.9 Hz.
/// let signal = |tick: u32| (tick as f32 * 1e-3 * core::f32::consts::TAU).cos();
/// for tick in 0..20_000 {
///     learner.learn(signal(tick % 1000));
/// }
/// assert!((learner.frequency_hz() - 1.0).abs() < 0.01);
/// // Without the signal it continues.
/// for tick in 0..1000 {
///     assert!((learner.value() - signal(tick)).abs() < 0.05);
///     learner.play();
/// }
/// # Ok::<(), cpg_core::BuildError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptiveFourier<const H: usize> {
    config: AdaptiveFourierConfig,
    period_s: f32,
    phase: Phase,
    /// w, rad/s.
    frequency: f32,
    /// a_0.
    mean: f32,
    /// a_1 to a_H.
    cos: [f32; H],
    /// b_1 to b_H.
    sin: [f32; H],
}

impl AdaptiveFourierConfig {
    /// Validates the configuration for a control period and H harmonics. All coefficients and the phase begin at 0.
    ///
    /// # Errors
    /// [`BuildError`] names the field that is out of range. Any period is accepted; Euler's method needs many periods in a cycle, and the tests
    /// run at 1 ms.
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
    /// Advances by one control period with the signal P, and learns. Returns the error e before the step. A sample that is not finite counts as
    /// e = 0: the phase advances and nothing is learned.
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

    /// Advances by one control period without a signal: the learned signal continues.
    pub fn play(&mut self) {
        self.advance(self.frequency);
    }

    fn advance(&mut self, radians_per_second: f32) {
        let cycles = radians_per_second * self.period_s * (1.0 / core::f32::consts::TAU);
        self.phase += Phase::from_cycles(cycles);
    }

    /// The learned signal q at the current phase, in the unit of P.
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

    /// The slope of q at the current phase, per radian of phase.
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

/// A generator of N joints that is learned from measured or recorded angles. All joints have one phase and frequency, learned from the first
/// joint; each joint learns its own series of H harmonics.
///
/// ```
/// use cpg_core::Generator;
/// use cpg_core::gait::named::Gait;
/// use cpg_core::waveform::adaptive_fourier::{AdaptiveFourierConfig, AdaptiveWalkConfig};
/// use joint_units::Period;
/// // A person walks at a stride of 1.084 s; the generator begins with coefficients of 0, a tenth too slow.
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
    /// Radians per unit of the series.
    unit: f32,
}

/// Gains and unit of an [`AdaptiveWalk`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptiveWalkConfig {
    /// Gains and first frequency of every joint.
    pub learner: AdaptiveFourierConfig,
    /// Radians per unit of the learned signal; 0.01 to 3, about the amplitude of the joints. A joint of this amplitude is learned at the
    /// configured rates.
    pub unit: f32,
}

impl AdaptiveWalkConfig {
    /// Validates the configuration for a control period, H harmonics and N joints. All coefficients and the phase begin at 0.
    ///
    /// # Errors
    /// [`BuildError`] names the field that is out of range.
    pub fn build<const H: usize, const N: usize>(&self, period: Period) -> Result<AdaptiveWalk<H, N>, BuildError> {
        in_range(self.unit, Field::of("unit"), 0.01, 3.0)?;
        let joints = [self.learner.build(period)?; N];
        Ok(AdaptiveWalk { joints, start: joints, unit: self.unit })
    }
}

impl<const H: usize, const N: usize> AdaptiveWalk<H, N> {
    /// The generator with these series in place of its own, as if it had learned them; [`Generator::reset`] returns to them.
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

    /// Advances by one control period with the measured angles, and learns; use [`Generator::step`] to advance without learning.
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

    /// The phase phi of the series: 0 where the series of [`AdaptiveWalk::taught`] have it; if they began with coefficients of 0, its zero depends
    /// on the start (see the [module](self)).
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
