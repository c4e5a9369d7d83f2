//! Matsuoka's neurons with adaptation: mutual inhibition of N neurons, of which the half-centre is the pair.
//!
//! ```text
//! Tr x_i' = -x_i - b v_i - sum_j a_ij y_j + s,   Ta v_i' = -v_i + y_i,   y_i = max(0, x_i)
//! ```
//! x membrane potential, v adaptation, y firing rate, s tonic input; Tr, Ta in the model's unit of time. Two neurons with weight a
//! oscillate iff `a > 1 + Tr/Ta` and `a < 1 + b`. The period scales with (Tr, Ta) together; s scales the amplitude and leaves the
//! period alone. Source: Matsuoka 1985, 1987.
//!
//! ```
//! use cpg_core::math::first_order::rk4;
//! use cpg_core::oscillator::matsuoka::Matsuoka;
//! let (pair, mut state, mut highest) = (Matsuoka::standard([[0.0, 2.5], [2.5, 0.0]]), [0.1, 0.0, 0.0, 0.0], 0.0f32);
//! for tick in 0..20_000 {
//!     rk4(&pair, &mut state, 0.02);
//!     highest = if tick < 10_000 { 0.0 } else { highest.max(state[0]) };
//! }
//! assert!((highest - 0.612_69).abs() < 1e-4, "{highest}");
//! ```

use crate::Scalar;
use crate::math::first_order::Flow;

/// Parameters of N neurons; the state is (x_1 .. x_N, v_1 .. v_N), so `D = 2 N`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Matsuoka<const N: usize, T = f32> {
    /// Rise time constant Tr.
    pub rise: T,
    /// Adaptation time constant Ta.
    pub adaptation: T,
    /// Strength b of the adaptation.
    pub fatigue: T,
    /// Tonic input s.
    pub tonic: T,
    /// How strongly neuron j inhibits neuron i: `inhibition[i][j]`.
    pub inhibition: [[T; N]; N],
    /// Input added to the tonic one, neuron by neuron: feedback from joints.
    pub input: [T; N],
}

impl<const N: usize, T: Scalar> Matsuoka<N, T> {
    /// Tr = 1, Ta = 12, b = 2.5, s = 1, no feedback.
    #[must_use]
    pub fn standard(inhibition: [[T; N]; N]) -> Self {
        let of = T::from_f32;
        Self { rise: T::ONE, adaptation: of(12.0), fatigue: of(2.5), tonic: T::ONE, inhibition, input: [T::ZERO; N] }
    }

    /// Firing rates y of a state.
    #[must_use]
    pub fn rates<const D: usize>(&self, state: &[T; D]) -> [T; N] {
        let mut rates = [T::ZERO; N];
        for (rate, &x) in rates.iter_mut().zip(state) {
            *rate = if x > T::ZERO { x } else { T::ZERO };
        }
        rates
    }

    /// The slopes of potentials and adaptations.
    fn slopes(&self, x: &[T], v: &[T], y: &[T; N]) -> ([T; N], [T; N]) {
        let (mut x_slope, mut v_slope) = ([T::ZERO; N], [T::ZERO; N]);
        let (per_rise, per_adaptation) = (T::ONE / self.rise, T::ONE / self.adaptation);
        let neurons = x.iter().zip(v).zip(y).zip(self.inhibition.iter().zip(&self.input));
        for ((((&x, &v), &y_own), (row, &input)), (dx, dv)) in neurons.zip(x_slope.iter_mut().zip(&mut v_slope)) {
            let inhibited = row.iter().zip(y).fold(T::ZERO, |sum, (&a, &y)| sum + a * y);
            *dx = per_rise * (self.tonic + input - x - self.fatigue * v - inhibited);
            *dv = per_adaptation * (y_own - v);
        }
        (x_slope, v_slope)
    }
}

/// Implements the flow for one number of neurons: stable Rust has no `2 * N` in a type.
macro_rules! flow {
    ($($neurons:literal => $numbers:literal),*) => {$(
        impl<T: Scalar> Flow<T, $numbers> for Matsuoka<$neurons, T> {
            fn derivative(&self, state: &[T; $numbers]) -> [T; $numbers] {
                let (x, v) = state.split_at($neurons);
                let (x_slope, v_slope) = self.slopes(x, v, &self.rates(state));
                let mut out = [T::ZERO; $numbers];
                for (out, slope) in out.iter_mut().zip(x_slope.into_iter().chain(v_slope)) {
                    *out = slope;
                }
                out
            }
        }
    )*};
}
flow!(2 => 4, 3 => 6, 4 => 8, 6 => 12);
