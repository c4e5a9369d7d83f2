//! Searches for the parameters of the oscillator networks, from a recorded stride.
//!
//! | module | content |
//! |---|---|
//! | [`fit_thesis`], [`orbit_check`] | the thesis' network, fitted so that its orbit is stable |
//! | [`fit_phase_coupled`], [`fit_network`] | R1, the phase-coupled network, of four joints and of any number |
//! | [`cma_es`] | CMA-ES with IPOP or BIPOP restarts |
//! | [`levenberg`] | Levenberg-Marquardt in the unit box, a Jacobian in one batch |
//! | [`network`], [`lanes`] | the thesis' network, eqs 13-16, for many individuals in SIMD vectors |
//! | [`batch`] | a generation on all threads, without sleep between two |
//! | [`Evaluator`] | counts evaluations and keeps the best point |
//!
//! Everything random comes from a seed and is drawn on one thread: the same seed gives the same bits, on any number of threads.

pub mod batch;
pub mod cma_es;
mod evaluator;
pub mod lanes;
pub mod levenberg;
pub mod network;
pub mod orbit_check;
mod phase_coupled;
mod random;
mod settle;
mod side_by_side;
mod thesis;
mod waveform;

pub use evaluator::{Evaluator, Progress};
pub use network::{Network, NetworkState, Oscillator};
pub use phase_coupled::{Curves, Dynamics, FittedNetwork, NetworkFit, PhaseCoupledFit, fit_network, fit_phase_coupled};
pub use random::Random;
pub use thesis::{SearchSettings, ThesisFit, fit_thesis};
