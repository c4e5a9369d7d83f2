//! The Terman-Wang relaxation oscillator: `x' = 3x - x^3 + 2 - y + I`, `y' = eps (g (1 + tanh(x/b)) - y)`.
//!
//! Dimensionless. With eps = 0.02, g = 6, b = 0.1 it oscillates for I > 0; the stronger I, the longer the active phase.
//! Source: Terman and Wang 1995 (LEGION).
//!
//! ```
//! use cpg_core::math::first_order::rk4;
//! use cpg_core::oscillator::terman_wang::TermanWang;
//! let (flow, mut state, mut highest) = (TermanWang::standard(0.8), [-1.5, 1.0], 0.0f32);
//! for _ in 0..20_000 {
//!     rk4(&flow, &mut state, 0.02);
//!     highest = highest.max(state[0]);
//! }
//! assert!((highest - 1.983_731).abs() < 1e-3, "{highest}");
//! ```

use crate::Scalar;
use crate::math::first_order::{Flow, Hyperbolic};

/// Parameters; the state is (x, y).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TermanWang<T = f32> {
    /// Slowness eps of y.
    pub slowness: T,
    /// Height g of the recovery's step.
    pub height: T,
    /// Width b of the recovery's step.
    pub width: T,
    /// Input I.
    pub current: T,
}

impl<T: Scalar> TermanWang<T> {
    /// The usual constants at an input.
    #[must_use]
    pub fn standard(current: T) -> Self {
        Self { slowness: T::ratio(2, 100), height: T::from_f32(6.0), width: T::ratio(1, 10), current }
    }
}

impl<T: Hyperbolic> Flow<T, 2> for TermanWang<T> {
    fn derivative(&self, &[x, y]: &[T; 2]) -> [T; 2] {
        let (two, three) = (T::from_f32(2.0), T::from_f32(3.0));
        let recovery = self.height * (T::ONE + (x / self.width).tanh());
        [three * x - x * x * x + two - y + self.current, self.slowness * (recovery - y)]
    }
}
