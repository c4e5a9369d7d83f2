//! A campaign of faults: the run is brought into each state once, and continues from there in a process of its own for each case.

mod driving;
mod fault;
mod file;
mod groups;
mod reports;
mod several;
mod stage;

pub(crate) use driving::Driving;
pub(crate) use fault::{End, Expected, Fault, Reaction};
pub(crate) use file::Campaign;
pub(crate) use reports::{Reports, Status, Totals};
pub(crate) use several::{Draw, Several};
pub(crate) use stage::{Press, Run, Sequence};
