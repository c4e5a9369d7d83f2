//! Finding and repairing defects of a recording.

pub(crate) mod clock;
pub mod condition;
pub mod convention;
pub mod repair;
pub mod resample;
