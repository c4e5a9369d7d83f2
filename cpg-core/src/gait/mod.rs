//! Default and named gaits, and a catalogue of all models as generators of four joints.

pub mod catalogue;
pub mod default_walk;
pub mod named;
pub mod six_and_eight_joints;
