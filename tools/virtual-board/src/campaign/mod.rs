//! A campaign of faults: the run is brought into each state once, and continues from there in a process of its own for each fault and phase.

mod file;
mod groups;

pub(crate) use file::{Campaign, Expected, Fault, Press, Reaction};
