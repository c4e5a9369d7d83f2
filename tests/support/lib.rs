//! What the tests of this package share.
//!
//! - [`traces`]: recordings that ship, and the folder of many more that may be there or not;
//! - [`walk`]: the loop that ships, fed with a recording, tick by tick on the host;
//! - [`degraded`]: a sensor's codes as they are when something is broken;
//! - [`walkers`]: recorded walkers with their templates and their phase;
//! - [`swings`]: swings and pauses of one joint;
//! - [`statistics`]: what many numbers come to;
//! - [`board`]: the flashed image on the virtual board, where there is one;
//! - [`chain`]: a recorded angle as volts at the pin of that board, and what it made of it;
//! - [`faulty`]: a sensor's faults as volts for it, and when its converter looks at them.
#![forbid(unsafe_code)]

pub mod board;
pub mod chain;
pub mod degraded;
pub mod faulty;
pub mod people;
pub mod statistics;
pub mod swings;
pub mod traces;
pub mod walk;
