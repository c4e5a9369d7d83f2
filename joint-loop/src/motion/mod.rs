//! Conversion of generator angles to servo pulses: blend, gate, limits, servo map.

pub(crate) mod blend;
pub(crate) mod gate;
pub(crate) mod limits;
pub(crate) mod servo;
