//! The van der Pol oscillator, `y'' = mu (1 - y^2) y' - y`, as y' = z, z' = mu (1 - y^2) z - y.
//!
//! Dimensionless; mu > 0 sets the strength of relaxation. The limit cycle attracts every start but the origin; its amplitude is 2 to
//! 2.0235 and its period 2 pi (1 + mu^2/16 ...) for small mu, (3 - 2 ln 2) mu for large.
//! Source: van der Pol 1926. The thesis (eq 2) prints `y'' - mu (y^2 - 1) y' + y0`, whose cycle repels; the sign is corrected here. The
//! velocity of a Rayleigh oscillator ([`crate::oscillator::rayleigh`]) times the square root of 3 obeys this equation.
//!
//! ```
//! use cpg_core::math::first_order::rk4;
//! use cpg_core::oscillator::van_der_pol::VanDerPol;
//! let (flow, mut state, mut highest) = (VanDerPol { mu: 1.0 }, [0.1, 0.0], 0.0f32);
//! for _ in 0..10_000 {
//!     rk4(&flow, &mut state, 0.01);
//!     highest = highest.max(state[0]);
//! }
//! assert!((highest - 2.008_62).abs() < 1e-3, "{highest}");
//! ```

use crate::Scalar;
use crate::math::first_order::Flow;

/// Parameter of the oscillator; the state is (y, z).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VanDerPol<T = f32> {
    /// Strength of relaxation, above 0.
    pub mu: T,
}

impl<T: Scalar> Flow<T, 2> for VanDerPol<T> {
    fn derivative(&self, &[y, z]: &[T; 2]) -> [T; 2] {
        [z, self.mu * (T::ONE - y * y) * z - y]
    }
}
