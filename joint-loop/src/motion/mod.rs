//! Conversion of generator angles to servo pulses: blend, feedback, gate, limits, ramp, servo map, start of an arming.

pub(crate) mod blend;
pub mod feedback;
pub(crate) mod gate;
pub(crate) mod limits;
pub(crate) mod ramp;
pub(crate) mod servo;
pub mod start;
