//! Scalars, trigonometry and fixed-step integrators.

pub mod first_order;
pub mod fixed_trig;
pub(crate) mod scalar;
pub(crate) mod second_order;
pub mod trig;
