//! The study behind `cpg_core::gait::family`: recorded walks and runs as functions of the cadence, and the errors on persons that were not fitted.
//!
//! | module | content |
//! |---|---|
//! | [`recorded`] | which recordings are used, their sources, and what is taken from each |
//! | [`leg`] | hip and knee of one leg as Fourier coefficients |
//! | [`model`] | the coefficients as functions of the cadence: robust least squares, and the mean to compare with |
//! | [`errors`] | every recording predicted without itself, and without its person |
//! | [`start`] | a recorded start and stop, and the phases at which a walk does the same |
//! | [`limits`] | the same motion inside the limits of the default robot |
//! | [`study`](mod@study) | all of it |
//! | [`page`] | the numbers as Rust, the tables |

pub mod errors;
pub mod leg;
pub mod limits;
pub mod model;
pub mod page;
pub mod recorded;
pub mod start;
pub mod study;
