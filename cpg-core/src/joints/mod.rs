//! Maps from oscillator states to joint angles.

pub mod features;
pub mod from_hopf_bank;
pub mod hexapod_legs;
pub mod linear;
pub mod swing_stance;
