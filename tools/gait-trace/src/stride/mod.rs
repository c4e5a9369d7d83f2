//! Cuts recordings into strides and averages them.

pub mod cut;
pub mod cycle;
mod drift;
pub mod gait_check;
pub mod looped;
pub mod metrics;
pub mod period;
pub mod segment;
pub mod spans;
pub mod strides;
