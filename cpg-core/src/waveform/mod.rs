//! Generators with one phase and a stored or learned waveform per joint.

pub mod adaptive_fourier;
pub(crate) mod clock;
pub mod fixed;
pub mod hopf_bank;
pub mod shape;
