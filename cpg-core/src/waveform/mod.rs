//! Generators with one phase and a stored or learned waveform per joint.

pub mod adaptive_fourier;
pub(crate) mod clock;
#[cfg(feature = "fixed-point")]
pub mod fixed;
pub mod hopf_bank;
pub mod shape;
