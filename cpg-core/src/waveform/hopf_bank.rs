//! The programmable CPG: a bank of adaptive-frequency Hopf oscillators, each of which learns one harmonic of a signal.
//!
//! ```text
//! x_i' = g (m - r_i^2) x_i - w_i y_i + eps F + tau sin(R_i - f_i)      (the last term for i > 0)
//! y_i' = g (m - r_i^2) y_i + w_i x_i,   w_i' = -eps F y_i / r_i,   al_i' = eta x_i F
//! f_i' = sin(R_i - th_i - f_i) for i > 0,   R_i = (w_i / w_0) th_0,   th_i = sgn(x_i) acos(-y_i / r_i)
//! F = P - mean - sum_i al_i x_i,   mean' = (eta / 2) F
//! ```
//! P is the signal that is learned and F its error, in units of the signal's amplitude (about ±1). (x_i, y_i) is the point of oscillator i,
//! i = 0 to N - 1, r_i its distance from the origin, w_i its angular frequency in rad/s, al_i the amplitude with which it enters the signal, th_i its
//! phase in rad and f_i its learned phase relative to oscillator 0. g = 8, m = 1 and tau = 2, in 1/s; eps and eta are fields of
//! [`ProgrammableConfig`]. One Runge-Kutta step a control period, with P held.
//!
//! For most purposes use [`crate::waveform::adaptive_fourier`]: it has one phase and reaches the error of a Fourier series in seconds. Here two
//! oscillators may learn the same harmonic, small harmonics take minutes, and small errors of w_i / w_0 remain when learning ends.
//!
//! # Why it learns
//! - *Frequency*: in polar coordinates (x = r cos a, y = r sin a) oscillator i has `a' = w - (eps F / r) sin a` and `w' = -eps F sin a`. For a
//!   component A cos theta of F near its frequency, the mean of -F sin a over a cycle is (A/2) sin(theta - a): phase and frequency are pulled to
//!   those of the component.
//! - *Amplitude*: x_i F then has a positive mean, al_i grows, and the component vanishes from F by the negative feedback. What is left drives the
//!   other oscillators. The mean of P is no oscillation; it is learned by the same law at half of the rate.
//! - *Phase relation*: th_i is the angle whose sine is x_i / r_i (a quarter of a cycle ahead of a). f_i converges to R_i - th_i, the difference
//!   between the phase of oscillator 0, scaled by the ratio of the frequencies, and that of oscillator i.
//! - *Coupling*: `tau sin(R_i - f_i)` drives oscillator i with a sinusoid of its own frequency. In step, R_i - f_i = th_i, so the drive is
//!   tau x_i / r_i, whose mean over a cycle enlarges the radius and leaves the phase as it is. Out of step it pulls th_i towards R_i - f_i. The
//!   drive is continuous if w_i / w_0 is an integer, as th_0 jumps by 2 pi once a cycle.
//!
//! # Sources
//! The structure is that of Righetti and Ijspeert, "Programmable central pattern generators: an application to biped locomotion control", Proc.
//! IEEE ICRA 2006, 1585-1590. The paper itself was not at hand; the equations were compared with two public programs:
//! - One that names this paper has `tau sin(th_i - f_i)` in the coupling, with th_i in place of R_i, for every oscillator, and g = 8, m = 1,
//!   tau = 2, eps = 0.9, eta = 0.5. All its other equations are as above. With th_i the term does not contain oscillator 0 and cannot synchronise.
//! - One that names Plaza et al., "Design of a Modular Exoskeleton...", has `tau sin(R_i - f_i)` as above, for every oscillator, and f_0' = 0.
//!
//! Our own: no coupling of oscillator 0, the learned mean, the defaults eps = 5 and eta = 2, and no use of F and f_i' while playing.
//!
//! ```
//! use cpg_core::waveform::hopf_bank::{ProgrammableConfig, ProgrammableCpg};
//! // Learns a sinusoid of 1 Hz; the first frequency is 0.9 Hz.
//! let config = ProgrammableConfig::<1>::harmonics_of(0.9);
//! let mut bank = config.build(joint_units::Period::MILLISECOND)?;
//! for tick in 0..60_000 {
//!     bank.learn((core::f32::consts::TAU * 1e-3 * (tick % 1000) as f32).sin());
//! }
//! assert!((bank.frequencies_hz()[0] - 1.0).abs() < 0.01 && (bank.amplitudes()[0] - 1.0).abs() < 0.05);
//! # Ok::<(), cpg_core::BuildError>(())
//! ```

use joint_units::{Period, Phase};

use crate::error::{all_in_range, in_range};
use crate::math::trig::{atan2, sin_cos};
use crate::{BuildError, Field, Scalar};

/// Gains and first frequencies of a bank of N oscillators.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProgrammableConfig<const N: usize> {
    /// eps, pull of the error on phase (1/s) and frequency (1/s^2); 0 to 10.
    pub adaptation: f32,
    /// eta, learning rate of the amplitudes in 1/s; 0 to 10.
    pub learning: f32,
    /// First frequency of each oscillator in cycles per second, 0.01 to 20; the first is that of the stride.
    pub frequencies_hz: [f32; N],
}

impl<const N: usize> ProgrammableConfig<N> {
    /// eps = 5, eta = 2, and harmonics 1 to N of a first frequency of the stride in cycles per second.
    #[must_use]
    pub fn harmonics_of(frequency_hz: f32) -> Self {
        let mut frequencies_hz = [frequency_hz; N];
        let mut harmonic = 0.0;
        for f in &mut frequencies_hz {
            harmonic += frequency_hz;
            *f = harmonic;
        }
        Self { adaptation: 5.0, learning: 2.0, frequencies_hz }
    }
}

/// One oscillator of the bank.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Cell {
    x: f32,
    y: f32,
    /// w in radians per second.
    frequency: f32,
    /// al.
    amplitude: f32,
    /// f, the learned phase relative to oscillator 0, rad.
    offset: f32,
}

impl Cell {
    fn along(self, slope: Self, t: f32) -> Self {
        Self {
            x: self.x + t * slope.x,
            y: self.y + t * slope.y,
            frequency: self.frequency + t * slope.frequency,
            amplitude: self.amplitude + t * slope.amplitude,
            offset: self.offset + t * slope.offset,
        }
    }
}

/// A bank of N oscillators that learns and plays one signal. [`crate::joints::from_hopf_bank`] makes joint angles from a bank.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProgrammableCpg<const N: usize> {
    adaptation: f32,
    learning: f32,
    period_s: f32,
    mean: f32,
    cells: [Cell; N],
}

/// g, 1/s: the radius returns to 1 as exp(-2 g t), with a time constant of 1/16 s.
const GAIN: f32 = 8.0;
/// tau, 1/s.
const COUPLING: f32 = 2.0;

impl<const N: usize> ProgrammableConfig<N> {
    /// Validates the configuration for a control period. Every oscillator begins at (1, 0) with the amplitude 0.
    ///
    /// # Errors
    /// [`BuildError`] names the field that is out of range. Any period is allowed; integration needs about 50 ticks in a cycle of the fastest
    /// oscillator and at most 20 ms, as [`BankWalkConfig::build`](crate::joints::from_hopf_bank::BankWalkConfig::build) requires.
    pub fn build(&self, period: Period) -> Result<ProgrammableCpg<N>, BuildError> {
        in_range(self.adaptation, Field::of("adaptation"), 0.0, 10.0)?;
        in_range(self.learning, Field::of("learning"), 0.0, 10.0)?;
        all_in_range(self.frequencies_hz, "frequencies_hz", 0.01, 20.0)?;
        let cell = |hz: f32| Cell { x: 1.0, frequency: hz * core::f32::consts::TAU, ..Cell::default() };
        Ok(ProgrammableCpg {
            adaptation: self.adaptation,
            learning: self.learning,
            period_s: period.seconds(),
            mean: 0.0,
            cells: self.frequencies_hz.map(cell),
        })
    }
}

impl<const N: usize> ProgrammableCpg<N> {
    /// Advances by one control period with the signal P, and learns. Returns the error F before the step. A sample that is not finite counts as
    /// F = 0: the oscillators advance and nothing is learned.
    pub fn learn(&mut self, taught: f32) -> f32 {
        let error = if taught.is_finite() { taught - self.value() } else { 0.0 };
        // No oscillator can learn the mean, which is not periodic; it is learned by the law of al at half of the rate.
        self.mean += self.period_s * 0.5 * self.learning * error;
        self.advance(Some(taught - self.mean).filter(|p| p.is_finite()));
        error
    }

    /// Advances by one control period without a signal: the learned signal continues.
    pub fn play(&mut self) {
        self.advance(None);
    }

    /// The learned signal now, mean + sum of al_i x_i, in the unit of P.
    #[must_use]
    pub fn value(&self) -> f32 {
        self.cells.iter().fold(self.mean, |sum, cell| sum + cell.amplitude * cell.x)
    }

    /// The learned frequencies in cycles per second.
    #[must_use]
    pub fn frequencies_hz(&self) -> [f32; N] {
        self.cells.map(|cell| cell.frequency * (1.0 / core::f32::consts::TAU))
    }

    /// The point (x, y) of each oscillator.
    #[must_use]
    pub fn points(&self) -> [[f32; 2]; N] {
        self.cells.map(|cell| [cell.x, cell.y])
    }

    /// Sets the point of each oscillator; each coordinate is limited to ±2. The limit cycle is the circle of radius 1.
    pub fn set_points(&mut self, points: [[f32; 2]; N]) {
        for (cell, point) in self.cells.iter_mut().zip(points) {
            [cell.x, cell.y] = point.map(|coordinate| coordinate.clamp_to(2.0));
        }
    }

    /// Time derivative of each point without a signal, per second.
    #[must_use]
    pub fn velocities(&self) -> [[f32; 2]; N] {
        self.slopes(&self.cells, None).map(|slope| [slope.x, slope.y])
    }

    /// The learned amplitudes al_i, in the unit of P.
    #[must_use]
    pub fn amplitudes(&self) -> [f32; N] {
        self.cells.map(|cell| cell.amplitude)
    }

    /// One Runge-Kutta step with the signal held.
    fn advance(&mut self, taught: Option<f32>) {
        let h = self.period_s;
        let k1 = self.slopes(&self.cells, taught);
        let k2 = self.slopes(&along(&self.cells, &k1, 0.5 * h), taught);
        let k3 = self.slopes(&along(&self.cells, &k2, 0.5 * h), taught);
        let k4 = self.slopes(&along(&self.cells, &k3, h), taught);
        for (slopes, weight) in [(k1, h / 6.0), (k2, h / 3.0), (k3, h / 3.0), (k4, h / 6.0)] {
            self.cells = along(&self.cells, &slopes, weight);
        }
    }

    fn slopes(&self, cells: &[Cell; N], taught: Option<f32>) -> [Cell; N] {
        let force = taught.map_or(0.0, |p| p - cells.iter().fold(0.0, |sum, c| sum + c.amplitude * c.x));
        let pull = self.adaptation * force;
        let (first_phase, first_frequency) = cells.first().map_or((0.0, 1.0), |c| (phase(c), c.frequency));
        let mut slopes = [Cell::default(); N];
        for (index, (slope, c)) in slopes.iter_mut().zip(cells).enumerate() {
            let square = c.x * c.x + c.y * c.y;
            let radius = libm::sqrtf(square).max(1e-6);
            let radial = GAIN * (1.0 - square);
            let rotated = if first_frequency > 0.0 { c.frequency / first_frequency * first_phase } else { 0.0 };
            // The first oscillator is the reference of the others and has no coupling.
            let coupled = if index == 0 { 0.0 } else { COUPLING * sine(rotated - c.offset) };
            let learns_offset = index > 0 && taught.is_some();
            *slope = Cell {
                x: radial * c.x - c.frequency * c.y + pull + coupled,
                y: radial * c.y + c.frequency * c.x,
                frequency: -pull * c.y / radius,
                amplitude: self.learning * c.x * force,
                offset: if learns_offset { sine(rotated - phase(c) - c.offset) } else { 0.0 },
            };
        }
        slopes
    }
}

/// The cells a time t along the slopes.
fn along<const N: usize>(cells: &[Cell; N], slopes: &[Cell; N], t: f32) -> [Cell; N] {
    let mut out = *cells;
    for (cell, &slope) in out.iter_mut().zip(slopes) {
        *cell = cell.along(slope, t);
    }
    out
}

/// th = sgn(x) acos(-y/r): a quarter of a cycle ahead of the point's own angle, -pi to pi, so that its sine is x/r.
fn phase(cell: &Cell) -> f32 {
    atan2(cell.x, -cell.y)
}

fn sine(radians: f32) -> f32 {
    sin_cos(Phase::from_cycles(radians * (1.0 / core::f32::consts::TAU))).0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hip(cycles: f64) -> f32 {
        let t = core::f64::consts::TAU * cycles;
        (0.2 + 0.8 * t.cos() + 0.3 * (2.0 * t + 0.5).cos() + 0.1 * (3.0 * t - 1.0).sin()) as f32
    }

    /// Three harmonics, all guesses a tenth too fast: five minutes of learning, then half a minute of free play.
    #[test]
    fn learns_the_harmonics_and_plays_them_when_frozen() {
        let config = ProgrammableConfig::<3>::harmonics_of(1.1);
        let mut bank = config.build(Period::MILLISECOND).unwrap();
        let mut square = 0.0;
        for tick in 0..300_000u32 {
            let error = bank.learn(hip(f64::from(tick) * 1e-3));
            if tick >= 290_000 {
                square += f64::from(error * error) / 10_000.0;
            }
        }
        assert!(square.sqrt() < 0.05, "error while learning {}", square.sqrt());
        for (k, hz) in bank.frequencies_hz().into_iter().enumerate() {
            assert!((hz - (k + 1) as f32).abs() < 0.02, "harmonic {}: {hz} Hz", k + 1);
        }
        for (got, want) in bank.amplitudes().into_iter().zip([0.8, 0.3, 0.1]) {
            assert!((got.abs() - want).abs() < 0.03, "{got} against {want}");
        }
        let (mut low, mut high) = (f32::MAX, f32::MIN);
        for _ in 0..30_000 {
            bank.play();
            low = low.min(bank.value());
            high = high.max(bank.value());
        }
        let (want_low, want_high) = (0..1000).fold((f32::MAX, f32::MIN), |(l, h), i| {
            let v = hip(f64::from(i) * 1e-3);
            (l.min(v), h.max(v))
        });
        assert!(
            (low - want_low).abs() < 0.1 && (high - want_high).abs() < 0.1,
            "{low}..{high}, taught {want_low}..{want_high}"
        );
    }

    #[test]
    fn a_bad_sample_changes_little_and_bad_fields_are_named() {
        let mut bank = ProgrammableConfig::<3>::harmonics_of(1.0).build(Period::MILLISECOND).unwrap();
        for _ in 0..100 {
            bank.learn(f32::NAN);
        }
        assert!(bank.value().is_finite());
        let mut bad = ProgrammableConfig::<2>::harmonics_of(1.0);
        bad.frequencies_hz[1] = f32::INFINITY;
        let error = bad.build(Period::MILLISECOND).unwrap_err().to_string();
        assert!(error.contains("frequencies_hz[1]"), "{error}");
    }
}
