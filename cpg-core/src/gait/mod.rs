//! Named gaits, and every model as a generator of hips and knees.

pub mod catalogue;
pub mod default_walk;
pub mod fitted;
pub mod named;
pub mod six_and_eight_joints;
