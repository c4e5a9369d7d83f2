//! A campaign of faults: the run is brought into each state once, and continues from there in a process of its own for each fault and phase.

mod fault;
mod file;
mod groups;

pub(crate) use fault::{Expected, Fault, Reaction};
pub(crate) use file::{Campaign, Press};
