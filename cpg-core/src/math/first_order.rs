//! First-order systems s' = f(s) on arrays, and the classical Runge-Kutta step for them.
//!
//! The models of neurons (van der Pol, Hopf, Matsuoka, FitzHugh-Nagumo, Morris-Lecar, Terman-Wang) and the cell networks are of this
//! form; the second-order joint networks have the cheaper [`crate::Integrator`].
//!
//! ```
//! use cpg_core::math::first_order::{Flow, rk4};
//! /// x' = -x.
//! struct Decay;
//! impl Flow<f32, 1> for Decay {
//!     fn derivative(&self, &[x]: &[f32; 1]) -> [f32; 1] {
//!         [-x]
//!     }
//! }
//! let mut state = [1.0];
//! for _ in 0..10 {
//!     rk4(&Decay, &mut state, 0.1);
//! }
//! assert!((state[0] - (-1.0f32).exp()).abs() < 1e-6);
//! ```

use crate::Scalar;

/// A vector field on `D` numbers.
pub trait Flow<T, const D: usize> {
    /// Time derivative of the state, per unit of the model's own time.
    fn derivative(&self, state: &[T; D]) -> [T; D];
}

/// One step of the classical Runge-Kutta method, `dt` in the model's own time.
pub fn rk4<T: Scalar, F: Flow<T, D>, const D: usize>(flow: &F, state: &mut [T; D], dt: T) {
    let half = dt * T::ratio(1, 2);
    let k1 = flow.derivative(state);
    let k2 = flow.derivative(&along(state, &k1, half));
    let k3 = flow.derivative(&along(state, &k2, half));
    let k4 = flow.derivative(&along(state, &k3, dt));
    let sixth = dt * T::ratio(1, 6);
    let slopes = k1.iter().zip(&k2).zip(k3.iter().zip(&k4));
    for (s, ((&a, &b), (&c, &d))) in state.iter_mut().zip(slopes) {
        *s += sixth * (a + d + (b + c) + (b + c));
    }
}

/// The point `t` along a slope.
fn along<T: Scalar, const D: usize>(state: &[T; D], slope: &[T; D], t: T) -> [T; D] {
    let mut out = *state;
    for (s, &k) in out.iter_mut().zip(slope) {
        *s += t * k;
    }
    out
}

/// Scalars with the hyperbolic functions of conductance models. Bit-equal on host and board: libm in `f32` arithmetic, no table.
pub trait Hyperbolic: Scalar {
    /// Hyperbolic tangent.
    fn tanh(self) -> Self;
    /// Hyperbolic cosine.
    fn cosh(self) -> Self;
}

impl Hyperbolic for f32 {
    fn tanh(self) -> Self {
        libm::tanhf(self)
    }
    fn cosh(self) -> Self {
        libm::coshf(self)
    }
}

/// With the feature `f64`, as [`Scalar`].
#[cfg(feature = "f64")]
impl Hyperbolic for f64 {
    fn tanh(self) -> Self {
        libm::tanh(self)
    }
    fn cosh(self) -> Self {
        libm::cosh(self)
    }
}
