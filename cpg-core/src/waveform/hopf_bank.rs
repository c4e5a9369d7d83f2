//! The programmable CPG: a bank of adaptive-frequency Hopf oscillators, each of which learns one harmonic of a signal.
//!
//! ```text
//! x_i' = g (m - r_i^2) x_i - w_i y_i + eps F + tau sin(R_i - f_i),   y_i' = g (m - r_i^2) y_i + w_i x_i,   w_i' = -eps F y_i / r_i
//! al_i' = eta x_i F,   f_i' = sin(R_i - th_i - f_i),   R_i = (w_i / w_0) th_0,   F = P - sum_i al_i x_i
//! ```
//! with th_i = sgn(x_i) acos(-y_i/r_i). P is the taught signal in units of its own amplitude.
//! Source of the structure: Righetti and Ijspeert, "Programmable central pattern generators: an application to biped locomotion control",
//! Proc. IEEE ICRA 2006. The constants g = 8, m = 1, tau = 2 are chosen here: g is the rate at which the radius returns (time
//! constant an eighth of a second), tau synchronises the oscillators after learning; the tests check that a signal is learned with them.
//!
//! The coupling needs the rotated phase R_i: the oscillators are in step if their phases keep the offset f_i to the first phase scaled by the
//! ratio of frequencies, so the coupling must vanish at R_i = f_i. With th_i in place of R_i it would hold each oscillator at a constant
//! phase.
//!
//! Two oscillators may learn the same harmonic, small harmonics take minutes, and the small errors of w_i/w_0 remain when learning ends. The
//! single-phase [`crate::waveform::adaptive_fourier`] reaches the error of a Fourier series in seconds and is preferred; this model is
//! provided for comparison.
//!
//! ```
//! use cpg_core::waveform::hopf_bank::{ProgrammableConfig, ProgrammableCpg};
//! // Taught a sinusoid of 1 Hz from a first guess of 0.9.
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

/// Gains and start of a bank of N oscillators.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProgrammableConfig<const N: usize> {
    /// eps, pull of the error on phase and frequency, 0 to 10.
    pub adaptation: f32,
    /// eta, learning rate of the amplitudes, 0 to 10.
    pub learning: f32,
    /// First guess of each frequency in cycles per second, 0.01 to 20; the first is the stride's.
    pub frequencies_hz: [f32; N],
}

impl<const N: usize> ProgrammableConfig<N> {
    /// eps = 5, eta = 2, and harmonics 1 to N of a first guess of the stride's frequency.
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
    /// f, the learned phase against the first oscillator.
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

/// A bank of N oscillators.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProgrammableCpg<const N: usize> {
    adaptation: f32,
    learning: f32,
    period_s: f32,
    mean: f32,
    cells: [Cell; N],
}

const GAIN: f32 = 8.0;
const COUPLING: f32 = 2.0;

impl<const N: usize> ProgrammableConfig<N> {
    /// Validates the configuration for a control period; every oscillator starts on its circle with the amplitude 0.
    ///
    /// # Errors
    /// Names the field that is out of range.
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
    /// One control period with the taught signal; returns the error F. A signal that is not finite counts as no error.
    pub fn learn(&mut self, taught: f32) -> f32 {
        let error = if taught.is_finite() { taught - self.value() } else { 0.0 };
        // The mean is not periodic, so no oscillator can learn it; it is learned by the law of al.
        self.mean += self.period_s * 0.5 * self.learning * error;
        self.advance(Some(taught - self.mean).filter(|p| p.is_finite()));
        error
    }

    /// One control period without a signal: plays what it has learned.
    pub fn play(&mut self) {
        self.advance(None);
    }

    /// The signal, mean + sum of al_i x_i.
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

    /// Sets the point of each oscillator, limited to ±2; the circle has radius 1.
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

    /// The learned amplitudes.
    #[must_use]
    pub fn amplitudes(&self) -> [f32; N] {
        self.cells.map(|cell| cell.amplitude)
    }

    /// One Runge-Kutta step with the taught signal held.
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

fn along<const N: usize>(cells: &[Cell; N], slopes: &[Cell; N], t: f32) -> [Cell; N] {
    let mut out = *cells;
    for (cell, &slope) in out.iter_mut().zip(slopes) {
        *cell = cell.along(slope, t);
    }
    out
}

/// sgn(x) acos(-y/r): a quarter cycle ahead of the point's own angle, -pi to pi, so that its sine is x/r.
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
