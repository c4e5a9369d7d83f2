//! The FitzHugh-Nagumo neuron: `v' = v - v^3/3 - w + I`, `w' = eps (v + a - b w)`.
//!
//! Dimensionless membrane potential v and recovery w. With eps = 0.08, a = 0.7, b = 0.8 it fires repeatedly for I from about 0.33
//! to 1.42. Source: FitzHugh 1961, Nagumo et al. 1962.
//!
//! ```
//! use cpg_core::math::first_order::rk4;
//! use cpg_core::oscillator::fitzhugh_nagumo::FitzHughNagumo;
//! let (neuron, mut state, mut highest) = (FitzHughNagumo::standard(0.5), [1.0, 0.0], 0.0f32);
//! for _ in 0..10_000 {
//!     rk4(&neuron, &mut state, 0.02);
//!     highest = highest.max(state[0]);
//! }
//! assert!((highest - 1.852_117).abs() < 1e-3, "{highest}");
//! ```

use crate::Scalar;
use crate::math::first_order::Flow;

/// Parameters; the state is (v, w).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitzHughNagumo<T = f32> {
    /// Slowness eps of the recovery.
    pub slowness: T,
    /// Offset a of the recovery.
    pub offset: T,
    /// Leak b of the recovery.
    pub leak: T,
    /// Input current I.
    pub current: T,
}

impl<T: Scalar> FitzHughNagumo<T> {
    /// The usual constants at an input current.
    #[must_use]
    pub fn standard(current: T) -> Self {
        Self { slowness: T::ratio(8, 100), offset: T::ratio(7, 10), leak: T::ratio(8, 10), current }
    }
}

impl<T: Scalar> Flow<T, 2> for FitzHughNagumo<T> {
    fn derivative(&self, &[v, w]: &[T; 2]) -> [T; 2] {
        [v - v * v * v * T::ratio(1, 3) - w + self.current, self.slowness * (v + self.offset - self.leak * w)]
    }
}
