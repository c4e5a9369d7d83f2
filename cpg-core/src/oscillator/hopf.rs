//! The Hopf oscillator (normal form of the supercritical Hopf bifurcation), and the one that adapts its frequency to an input.
//!
//! ```text
//! x' = g (m - r^2) x - w y [+ eps F],   y' = g (m - r^2) y + w x,   r^2 = x^2 + y^2,   [w' = -eps F y / r]
//! ```
//! The terms in brackets belong to [`AdaptiveHopf`]. F is the input, held over a step; times are in the model's unit of time, and w in radians
//! per unit of time.
//!
//! Limit cycle without input: the circle of radius sqrt(m), period 2 pi / w, reached from every start but the origin:
//! `r(t) = sqrt(m) / sqrt(1 + (m/r0^2 - 1) exp(-2 g m t))`.
//!
//! Why the frequency adapts: with x = r cos a, y = r sin a the equations are `r' = g (m - r^2) r + eps F cos a`, `a' = w - (eps F / r) sin a` and
//! `w' = -eps F sin a`. For F = A cos theta near its frequency, the mean of -F sin a over a cycle is (A/2) sin(theta - a). So with
//! d = theta - a, v = theta' - w and small d, `d' = v - (eps A / 2r) d`, `v' = -(eps A / 2) d`: both vanish for eps A > 0, and w becomes the
//! frequency of the input. After that it keeps its value without input.
//!
//! Source of the adaptive form: L. Righetti, J. Buchli, A. J. Ijspeert, "Dynamic Hebbian learning in adaptive frequency oscillators", Physica D
//! 216, 2006, 269-281. Its text was not at hand; the equations were compared with a public program that repeats its figure 2 and has them with
//! g = 1 and m = 1. The factor g is our addition.
//!
//! ```
//! use cpg_core::math::first_order::rk4;
//! use cpg_core::oscillator::hopf::Hopf;
//! let flow = Hopf { gain: 8.0, square_radius: 1.0, frequency: core::f32::consts::TAU };
//! let mut state = [0.1f32, 0.0];
//! for _ in 0..100 {
//!     rk4(&flow, &mut state, 1e-3);
//! }
//! // The closed form at 0.1 s: 1 / sqrt(1 + 99 exp(-1.6)).
//! assert!((state[0].hypot(state[1]) - 0.218_281_5).abs() < 1e-5);
//! ```

use crate::Scalar;
use crate::math::first_order::Flow;

/// Parameters of the Hopf oscillator; the state is (x, y). There is no check: any finite values above 0 are useful.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hopf<T = f32> {
    /// Rate g at which the radius returns.
    pub gain: T,
    /// Square m of the radius of the limit cycle.
    pub square_radius: T,
    /// Angular frequency w in radians per unit of time.
    pub frequency: T,
}

impl<T: Scalar> Flow<T, 2> for Hopf<T> {
    fn derivative(&self, &[x, y]: &[T; 2]) -> [T; 2] {
        let radial = self.gain * (self.square_radius - (x * x + y * y));
        [radial * x - self.frequency * y, radial * y + self.frequency * x]
    }
}

/// Parameters of the adaptive oscillator; the state is (x, y, w): the frequency is learned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptiveHopf<T = f32> {
    /// Rate g at which the radius returns.
    pub gain: T,
    /// Square m of the radius of the limit cycle.
    pub square_radius: T,
    /// Strength eps of the input's pull on point and frequency, above 0.
    pub learning: T,
    /// The input F now, in units of the radius: set it before each step.
    pub input: T,
}

impl<T: Scalar> Flow<T, 3> for AdaptiveHopf<T> {
    fn derivative(&self, &[x, y, w]: &[T; 3]) -> [T; 3] {
        let square = x * x + y * y;
        let radial = self.gain * (self.square_radius - square);
        let pull = self.learning * self.input;
        // At the origin there is no phase to learn from.
        let sine = if square > T::ZERO { y / square.sqrt() } else { T::ZERO };
        [radial * x - w * y + pull, radial * y + w * x, -(pull * sine)]
    }
}
