//! Scheduling by edge reversal: gaits of legged animals as integer dynamics (Yang et al. 2014).

pub mod hexapod;
pub mod obb;
pub mod smer;
