//! Maps from the states of a model to joint angles.
//!
//! | to | see |
//! |---|---|
//! | weigh the states of any first-order model ([`crate::math::first_order::Flow`]) | [`linear`] |
//! | use one bank of Hopf oscillators for all joints | [`from_hopf_bank`] |
//! | make swing and stance of two legs from an oscillatory building block | [`swing_stance`] |
//! | make swing and stance of six legs from the hexapod's ladder | [`hexapod_legs`] |
//! | read the state of any generator as numbers for a linear fit | [`features`] |

pub mod features;
pub mod from_hopf_bank;
pub mod hexapod_legs;
pub mod linear;
pub mod swing_stance;
