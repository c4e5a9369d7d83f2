//! Fixed-step integration of oscillators in the form x' = v, v' = a(x, v), on arrays, without a division or a heap.
//!
//! A model is built in the *time unit of its integrator*: [`Integrator::UNITS`] units make one control period. Velocities are
//! then displacements per unit and accelerations displacements per unit squared, so the step itself holds no period and no
//! product with it: a model folds its constants once, at build.
//!
//! The error of each method is measured in `tests/integrators.rs`. On the four-joint R1 network at 1 ms, the stride is off after 60 s by a few
//! microseconds with Runge-Kutta, and by 38.6 ms with semi-implicit Euler: an error of the frequency, which a limit cycle does not correct. So
//! Runge-Kutta is the default; semi-implicit Euler is for weakly damped networks and for comparison.
//!
//! ```
//! use cpg_core::{Integrator, Rk4, SecondOrder};
//! /// x'' = -x with half a step of 0.01 s as the time unit: accelerations are x'' times its square.
//! struct Spring;
//! impl SecondOrder<f64, 1> for Spring {
//!     fn acceleration(&self, &[x]: &[f64; 1], _: &[f64; 1]) -> [f64; 1] {
//!         [-x * 0.005 * 0.005]
//!     }
//! }
//! let (mut x, mut v) = ([1.0], [0.0]);
//! for _ in 0..100 {
//!     Rk4::advance(&Spring, &mut x, &mut v);
//! }
//! assert!((x[0] - 1f64.cos()).abs() < 1e-9 && (v[0] / 0.005 + 1f64.sin()).abs() < 1e-9);
//! ```

use crate::Scalar;

/// A system of `N` second-order equations x' = v, v' = a(x, v): implement it to make a model of [`crate::Oscillators`].
pub trait SecondOrder<T, const N: usize> {
    /// Acceleration of each coordinate, in displacements per squared time unit of the integrator.
    fn acceleration(&self, x: &[T; N], v: &[T; N]) -> [T; N];
}

/// A method that advances a [`SecondOrder`] system by one step.
pub trait Integrator {
    /// Number of time units in one step (control period).
    const UNITS: u32;

    /// Largest product of step and decay rate that models accept: at least a tenth below that at which the method diverges.
    const LONGEST_DECAY: f32;

    /// Advances displacement and velocity of a system by one step.
    fn advance<T: Scalar, S: SecondOrder<T, N>, const N: usize>(system: &S, x: &mut [T; N], v: &mut [T; N]);
}

/// The classical fourth-order Runge-Kutta method.
///
/// With velocity as the derivative of displacement, the four stages of displacement collapse into sums of accelerations (Nystrom);
/// with half a step as the time unit, all their weights but 1/3 and 2/3 become additions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Rk4;

impl Integrator for Rk4 {
    const UNITS: u32 = 2;
    const LONGEST_DECAY: f32 = 2.5;

    fn advance<T: Scalar, S: SecondOrder<T, N>, const N: usize>(system: &S, x: &mut [T; N], v: &mut [T; N]) {
        // In units of h/2, with k the acceleration at each stage:
        //   stage 2: x + v,           v + k1
        //   stage 3: x + v + k1,      v + k2
        //   stage 4: x + 2 (v + k2),  v + 2 k3
        //   x <- x + 2 v + (k1 + k2 + k3) 2/3,   v <- v + (k1 + 2 k2 + 2 k3 + k4) / 3
        let sum = |a: T, b: T| a + b;
        let twice = |a: T, b: T| a + b + b;
        let (third, two_thirds) = (T::ratio(1, 3), T::ratio(2, 3));

        let k1 = system.acceleration(x, v);
        let x2 = zip(x, v, sum);
        let k2 = system.acceleration(&x2, &zip(v, &k1, sum));
        let v3 = zip(v, &k2, sum);
        let k3 = system.acceleration(&zip(&x2, &k1, sum), &v3);
        let k4 = system.acceleration(&zip(x, &v3, twice), &zip(v, &k3, twice));

        let middle = zip(&k2, &k3, sum);
        let first = zip(&k1, &middle, sum);
        let all = zip(&zip(&first, &middle, sum), &k4, sum);
        *x = zip(&zip(x, v, twice), &first, |x, k| x + k * two_thirds);
        *v = zip(v, &all, |v, k| v + k * third);
    }
}

/// Semi-implicit (symplectic) Euler: velocity first, then displacement with the new velocity. First order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SemiImplicitEuler;

impl Integrator for SemiImplicitEuler {
    const UNITS: u32 = 1;
    const LONGEST_DECAY: f32 = 1.8;

    fn advance<T: Scalar, S: SecondOrder<T, N>, const N: usize>(system: &S, x: &mut [T; N], v: &mut [T; N]) {
        *v = zip(v, &system.acceleration(x, v), |v, a| v + a);
        *x = zip(x, v, |x, v| x + v);
    }
}

/// Longest step in radians of the natural cycle: 62 steps a cycle.
const MAX_STEP: f32 = 0.1;

/// Longest control period in microseconds for an oscillator of natural frequency `mu` in rad/s in which a velocity, anywhere inside
/// the bounds of its state, decays at a rate of at most `steepest` in 1/s.
pub(crate) fn longest_period<T: Scalar, I: Integrator>(mu: T, steepest: T) -> u32 {
    let seconds = (MAX_STEP / mu.to_f32()).min(I::LONGEST_DECAY / steepest.to_f32());
    (seconds * 1e6) as u32
}

/// `f` of each pair.
fn zip<T: Scalar, const N: usize>(a: &[T; N], b: &[T; N], f: impl Fn(T, T) -> T) -> [T; N] {
    let mut out = *a;
    for (out, b) in out.iter_mut().zip(b) {
        *out = f(*out, *b);
    }
    out
}
