//! Generators with one phase and a stored or learned waveform for each joint.
//!
//! | to | see |
//! |---|---|
//! | play known waveforms: a Fourier series or a spline for each joint, with speed, gain, offset and lead | [`shape`] |
//! | do the same on a chip without a floating-point unit | `fixed` (feature `fixed-point`) |
//! | learn the waveforms from measured angles, in seconds | [`adaptive_fourier`] |
//! | learn one signal with a bank of oscillators, one for each harmonic, in minutes: for comparison | [`hopf_bank`] |
//!
//! The phase of [`shape`] and `fixed` is an integer of 64 bits with an integer step, so it does not drift. All start at phase 0; for a recorded
//! gait that is where the left hip is most flexed.

pub mod adaptive_fourier;
pub(crate) mod clock;
#[cfg(feature = "fixed-point")]
pub mod fixed;
pub mod hopf_bank;
pub mod shape;
