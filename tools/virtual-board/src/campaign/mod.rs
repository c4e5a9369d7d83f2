//! A campaign of faults: the run is brought into each state once, and continues from there in a process of its own for each case.

mod driving;
mod file;
mod kinds;
mod several;
mod stage;

pub(crate) use driving::Driving;
pub(crate) use file::{Campaign, Expected, Fault, Reaction};
pub(crate) use several::{Draw, Several};
pub(crate) use stage::{Press, Run, Sequence};
