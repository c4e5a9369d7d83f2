//! Scalars, trigonometry, fixed-step integrators and the braking law.

pub(crate) mod braking;
pub mod first_order;
#[cfg(feature = "fixed-point")]
pub mod fixed_trig;
pub(crate) mod scalar;
pub(crate) mod second_order;
pub mod trig;
