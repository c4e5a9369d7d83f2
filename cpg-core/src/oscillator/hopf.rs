//! The Hopf oscillator (normal form of the supercritical Hopf bifurcation), and the one that adapts its frequency to an input.
//!
//! ```text
//! x' = g (m - r^2) x - w y [+ eps F],   y' = g (m - r^2) y + w x,   r^2 = x^2 + y^2,   [w' = -eps F y / r]
//! ```
//! Limit cycle: the circle of radius sqrt(m), period 2 pi / w, reached from every start but the origin:
//! `r(t) = sqrt(m) / sqrt(1 + (m/r0^2 - 1) exp(-2 g m t))`.
//! Source of the adaptive form: Righetti, Buchli and Ijspeert 2006. F is held over a step.
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

/// Parameters; the state is (x, y).
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
    #[inline]
    fn derivative(&self, &[x, y]: &[T; 2]) -> [T; 2] {
        let radial = self.gain * (self.square_radius - (x * x + y * y));
        [radial * x - self.frequency * y, radial * y + self.frequency * x]
    }
}

/// Parameters; the state is (x, y, w): the frequency is learned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptiveHopf<T = f32> {
    /// Rate g at which the radius returns.
    pub gain: T,
    /// Square m of the radius of the limit cycle.
    pub square_radius: T,
    /// Strength eps of the input's pull.
    pub learning: T,
    /// The input F now, in units of the radius: set it before each step.
    pub input: T,
}

impl<T: Scalar> Flow<T, 3> for AdaptiveHopf<T> {
    #[inline]
    fn derivative(&self, &[x, y, w]: &[T; 3]) -> [T; 3] {
        let square = x * x + y * y;
        let radial = self.gain * (self.square_radius - square);
        let pull = self.learning * self.input;
        // At the origin there is no phase to learn from.
        let sine = if square > T::ZERO { y / square.sqrt() } else { T::ZERO };
        [radial * x - w * y + pull, radial * y + w * x, -(pull * sine)]
    }
}
