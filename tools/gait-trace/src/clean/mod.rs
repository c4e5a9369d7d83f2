//! Finds and repairs defects of a recording.

pub mod anatomy;
mod clipped;
pub(crate) mod clock;
pub mod condition;
pub mod condition_error;
pub mod convention;
mod folded;
mod held;
pub mod hip_sign;
pub mod knee_sign;
pub(crate) mod other_leg;
pub mod positive_direction;
mod received;
pub mod repair;
pub mod resample;
pub mod rules;
mod same_leg;
mod shape;
mod too_fast;
mod two_recordings;
mod unit_doubt;
