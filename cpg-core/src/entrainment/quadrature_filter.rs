//! The second-order generalised integrator (SOGI): the fundamental of a periodic signal, its quadrature, and its mean.
//!
//! ```text
//! e = y - m - x,   x' = w (k e - q),   q' = w x,   m' = k0 w e
//! ```
//! y is the signal, w the angular frequency that the filter is tuned to (rad/s), x the fundamental, q its quadrature (a quarter of a
//! cycle behind), m the mean, e the rest (all in the unit of y), k and k0 the gains of [`SogiConfig`] (without unit).
//!
//! At w the gain is 1 and the phase shift 0: y = m + A cos(a) gives x = A cos(a) and q = A sin(a). Harmonic n is attenuated to about
//! `1 / |1 + j (n - 1/n) / k|` in x, and n times more in q ([`settled_gain`] is exact). Disturbances decay as exp(-k w t / 2), with a time
//! constant of 0.35 s at a stride of 1.1 s and k = 1.
//!
//! Discretisation: the trapezoidal rule with pre-warping, c = tan(w T / 2) in place of w T / 2, T the control period in s. The bilinear map
//! takes the imaginary axis onto the unit circle, and pre-warping maps w onto itself: gain 1 and shift 0 at w are exact for every T, and the
//! filter is stable for every T. (w may change from tick to tick; within one it is constant.)
//!
//! The filter is known from the synchronisation of power converters with the grid. The equations are derived here and no paper is followed: with
//! d/dt = s w, x / (y - m) = k s / (s^2 + k s + 1), the band-pass filter of second order with gain 1 at s = j; and m integrates the rest e,
//! so its settled value is the signal's mean. The tests compare the step with a Runge-Kutta integration of these equations.

use crate::BuildError;
use crate::Field;
use crate::error::in_range;
use crate::math::finite::all_finite;

/// Gains of the filter. Its state is a [`Sogi`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SogiConfig {
    /// Bandwidth k relative to the frequency w; 0.1 to 3, default 1.
    pub gain: f32,
    /// Rate k0 at which the mean is learned, relative to the frequency w; 0.01 to 1, default 0.2.
    pub mean_gain: f32,
}

impl Default for SogiConfig {
    /// k = 1 settles in a third of a stride; k0 = 0.2 follows the mean in about one.
    fn default() -> Self {
        Self { gain: 1.0, mean_gain: 0.2 }
    }
}

impl SogiConfig {
    /// Checks the gains against their ranges.
    ///
    /// # Errors
    /// [`BuildError`] names the field that is out of range: `sogi.gain` or `sogi.mean_gain`.
    pub fn validate(&self) -> Result<(), BuildError> {
        in_range(self.gain, Field::of("sogi.gain"), 0.1, 3.0)?;
        in_range(self.mean_gain, Field::of("sogi.mean_gain"), 0.01, 1.0)
    }
}

/// State of the filter, in the unit of the signal.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sogi {
    /// Fundamental x.
    pub fundamental: f32,
    /// Quadrature q of the fundamental.
    pub quadrature: f32,
    /// Mean m.
    pub mean: f32,
    /// The rest e = y - m - x.
    rest: f32,
}

/// Largest w T, in radians a tick; a larger one is limited to it. The tangent is computed by a series up to here.
pub const MAX_TURN: f32 = 0.5;

impl Sogi {
    /// The state after a constant signal of this value.
    #[must_use]
    pub const fn at_rest(mean: f32) -> Self {
        Self { fundamental: 0.0, quadrature: 0.0, mean, rest: 0.0 }
    }

    /// Advances by one control period with the sample `y` at its end, which must be finite. `turn` is w T in radians, limited to 0 to
    /// [`MAX_TURN`].
    ///
    /// ```
    /// use cpg_core::entrainment::quadrature_filter::{Sogi, SogiConfig};
    /// let (mut sogi, turn) = (Sogi::at_rest(0.0), 0.006_f32);
    /// let mut angle = 0.0_f32;
    /// for _ in 0..10_000 {
    ///     angle = (angle + turn) % core::f32::consts::TAU;
    ///     sogi.step(&SogiConfig::default(), 3.0 + 2.0 * angle.cos(), turn);
    /// }
    /// assert!((sogi.fundamental - 2.0 * angle.cos()).abs() < 1e-3 && (sogi.quadrature - 2.0 * angle.sin()).abs() < 1e-3);
    /// assert!((sogi.mean - 3.0).abs() < 1e-3);
    /// ```
    pub fn step(&mut self, config: &SogiConfig, y: f32, turn: f32) {
        let (k, k0) = (config.gain, config.mean_gain);
        let half = 0.5 * turn.clamp(0.0, MAX_TURN);
        let z = half * half;
        let c = half * (1.0 + z * (0.333_333_34 + z * (0.133_333_34 + z * 0.053_968_254)));
        let Sogi { fundamental: x, quadrature: q, mean: m, rest: e } = *self;
        // x+ = x + c (k E - q - q+),  q+ = q + c (x + x+),  m+ = m + c k0 E,  E = e + e+,  e+ = y - m+ - x+, solved for E.
        let shrink = 1.0 / (1.0 + c * c);
        let free = (x * (1.0 - c * c) - 2.0 * c * q) * shrink;
        let sum = (e + y - m - free) / (1.0 + c * k0 + c * k * shrink);
        let next = free + c * k * sum * shrink;
        self.quadrature = q + c * (x + next);
        self.fundamental = next;
        self.mean = m + c * k0 * sum;
        self.rest = y - self.mean - next;
    }

    /// Advances by one control period without a sample, as if the signal were its own fundamental and mean, continued: amplitude and mean stay,
    /// the phase advances by `turn` radians.
    pub fn coast(&mut self, config: &SogiConfig, turn: f32) {
        let (sin, cos) = crate::math::trig::sin_cos(joint_units::Phase::from_cycles(turn / core::f32::consts::TAU));
        let (x, q) = (self.fundamental, self.quadrature);
        let y = self.mean + x * cos - q * sin;
        self.step(config, y, turn);
    }

    /// Amplitude of the fundamental, sqrt(x^2 + q^2), in the unit of the signal.
    #[must_use]
    pub fn amplitude(&self) -> f32 {
        libm::sqrtf(self.fundamental * self.fundamental + self.quadrature * self.quadrature)
    }

    /// Whether every state is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        all_finite([self.fundamental, self.quadrature, self.mean, self.rest])
    }
}

/// Gains of the settled filter for a harmonic of the frequency that it is tuned to: the complex gains (re, im) of x and of q. `harmonic` is n, 1
/// for the fundamental (0 counts as 1).
///
/// From the equations with d/dt = s w, s = j n, for y of amplitude 1: `E = 1 / (1 + k0/s + k s/(s^2+1))`, `X = E k s/(s^2+1)`, `Q = X/s`; at
/// n = 1, `X = 1` and `Q = -j`.
#[must_use]
pub fn settled_gain(config: &SogiConfig, harmonic: u8) -> ((f32, f32), (f32, f32)) {
    if harmonic <= 1 {
        return ((1.0, 0.0), (0.0, -1.0));
    }
    let n = f32::from(harmonic);
    // k s / (s^2 + 1) = j b, k0 / s = -j a.
    let (a, b) = (config.mean_gain / n, config.gain * n / (1.0 - n * n));
    // X = j b / (1 + j (b - a)).
    let d = b - a;
    let size = 1.0 / (1.0 + d * d);
    let (re, im) = (b * d * size, b * size);
    // Divided by j n.
    ((re, im), (im / n, -re / n))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Settles on `amplitude cos(n a)` and gives the largest difference from the predicted response over a cycle.
    fn settled_difference(config: &SogiConfig, harmonic: u8, turn: f32) -> f32 {
        let mut sogi = Sogi::at_rest(0.0);
        let ((xr, xi), (qr, qi)) = settled_gain(config, harmonic);
        let mut worst = 0.0f32;
        let ticks = (400.0 / turn) as u32;
        for tick in 1..=ticks {
            let angle = f64::from(tick) * f64::from(turn) * f64::from(harmonic);
            let (sin, cos) = (angle.sin() as f32, angle.cos() as f32);
            sogi.step(config, cos, turn);
            if f64::from(tick) > f64::from(ticks) * 0.9 {
                worst = worst.max((sogi.fundamental - (xr * cos - xi * sin)).abs());
                worst = worst.max((sogi.quadrature - (qr * cos - qi * sin)).abs());
            }
        }
        worst
    }

    /// At its own frequency the response is exact at every period; harmonics follow the continuous filter at 1 kHz.
    #[test]
    fn the_settled_response_is_the_continuous_one() {
        let config = SogiConfig::default();
        for turn in [0.002, 0.006, 0.06, 0.3] {
            let off = settled_difference(&config, 1, turn);
            assert!(off < 1e-4, "w T = {turn}: {off}");
        }
        for harmonic in 2..=5 {
            let off = settled_difference(&config, harmonic, 0.006);
            assert!(off < 2e-3, "harmonic {harmonic}: {off}");
        }
    }

    /// The step against a fine Runge-Kutta integration of the differential equations, with a frequency that sweeps.
    #[test]
    fn the_step_follows_the_differential_equations() {
        let config = SogiConfig::default();
        let (k, k0) = (f64::from(config.gain), f64::from(config.mean_gain));
        let y = |t: f64| 0.3 + 0.5 * (5.0 * t).cos() + 0.2 * (10.0 * t + 0.4).sin();
        let w = |t: f64| 5.5 + (0.7 * t).sin();
        let slope = |t: f64, s: [f64; 3]| {
            let e = y(t) - s[2] - s[0];
            [w(t) * (k * e - s[1]), w(t) * s[0], k0 * w(t) * e]
        };
        let mut exact = [0.0, 0.0, 0.3];
        let mut sogi = Sogi { mean: 0.3, rest: (y(0.0) - 0.3) as f32, ..Sogi::default() };
        let along = |s: [f64; 3], k: [f64; 3], h: f64| [s[0] + h * k[0], s[1] + h * k[1], s[2] + h * k[2]];
        for tick in 0..20_000 {
            for part in 0..4 {
                let (t, h) = (f64::from(tick) * 1e-3 + f64::from(part) * 0.25e-3, 0.25e-3);
                let a = slope(t, exact);
                let b = slope(t + h / 2.0, along(exact, a, h / 2.0));
                let c = slope(t + h / 2.0, along(exact, b, h / 2.0));
                let d = slope(t + h, along(exact, c, h));
                for (i, s) in exact.iter_mut().enumerate() {
                    *s += h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
                }
            }
            let t = f64::from(tick + 1) * 1e-3;
            sogi.step(&config, y(t) as f32, (w(t - 0.5e-3) * 1e-3) as f32);
            for (state, exact) in [sogi.fundamental, sogi.quadrature, sogi.mean].into_iter().zip(exact) {
                assert!((f64::from(state) - exact).abs() < 2e-5, "tick {tick}: {state} for {exact}");
            }
        }
    }

    #[test]
    fn coasting_turns_on_and_keeps_amplitude_and_mean() {
        let config = SogiConfig::default();
        let mut sogi = Sogi { fundamental: 0.4, quadrature: 0.0, mean: 0.1, rest: 0.0 };
        for _ in 0..10_000 {
            sogi.coast(&config, 0.006);
        }
        assert!((sogi.amplitude() - 0.4).abs() < 1e-3 && (sogi.mean - 0.1).abs() < 1e-4);
        let angle = 60.0f32;
        assert!((sogi.fundamental - 0.4 * angle.cos()).abs() < 2e-3);
    }

    /// Any finite samples, any tuning: bounded output for bounded input.
    #[test]
    fn no_tuning_is_unstable() {
        let mut seed = 7u32;
        let mut random = move || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / 16_777_216.0
        };
        for (gain, mean_gain) in [(0.1, 0.01), (1.0, 0.2), (3.0, 1.0)] {
            let config = SogiConfig { gain, mean_gain };
            assert!(config.validate().is_ok());
            let mut sogi = Sogi::at_rest(0.0);
            for _ in 0..200_000 {
                sogi.step(&config, 2.0 * random() - 1.0, MAX_TURN * random());
                assert!(sogi.is_finite() && sogi.amplitude() < 10.0);
            }
        }
        assert!(SogiConfig { gain: f32::NAN, mean_gain: 0.2 }.validate().unwrap_err().to_string().contains("gain"));
        assert!(SogiConfig { gain: 1.0, mean_gain: 2.0 }.validate().unwrap_err().to_string().contains("mean_gain"));
    }
}
