//! Number types, trigonometry, integrators with a fixed step, and the braking law.
//!
//! The trait [`crate::Scalar`] and the integrators of second order ([`crate::Rk4`], [`crate::SemiImplicitEuler`]) are re-exported at the root of
//! the crate.

pub(crate) mod braking;
pub(crate) mod finite;
pub mod first_order;
#[cfg(feature = "fixed-point")]
pub mod fixed_trig;
pub(crate) mod scalar;
pub(crate) mod second_order;
pub mod trig;
