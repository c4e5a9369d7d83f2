//! Scheduling by edge reversal: which leg swings in which step, computed with integers (Yang et al. 2014).
//!
//! These modules compute sequences of steps, not angles. [`crate::joints::swing_stance`] and [`crate::joints::hexapod_legs`] make joint angles of
//! them.
//!
//! | to | see |
//! |---|---|
//! | schedule two neurons, flexor and extensor | [`obb`] |
//! | schedule the six legs of a hexapod | [`hexapod`] |
//! | choose one of the hexapod's 98 live orientations | [`ladder`] |
//! | schedule any graph | [`smer`] |

pub mod hexapod;
pub mod ladder;
pub mod obb;
pub mod smer;
