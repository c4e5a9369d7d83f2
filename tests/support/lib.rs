//! What the tests of this package share.
//!
//! - [`recordings`]: the recordings of the repository;
//! - [`host_loop`]: the default loop, fed with a recording, tick by tick on the host;
//! - [`degraded`]: a sensor's codes as they are when something is broken;
//! - [`people`]: recorded people with their templates and their phase;
//! - [`swings`]: swings and pauses of one joint;
//! - [`statistics`]: what many numbers come to;
//! - [`workspace`]: the files and the packages of this workspace;
//! - [`name_parts`]: names and words in parts;
//! - [`board`]: the flashed image on the virtual board, where there is one;
//! - [`pico`]: the image of the Raspberry Pi Pico on an emulator by others;
//! - [`mod@bench`]: that board as a debug probe with its target;
//! - [`lockstep`]: a conversation that steps that board;
//! - [`campaign`]: campaigns of faults on that board;
//! - [`boot_log`]: what a boot of it says of the run before;
//! - [`chain`]: a recorded angle as volts at the pin of that board, and what it made of it;
//! - [`gestures`]: how its button is pressed;
//! - [`lamps`]: what its lamps show;
//! - [`limits`]: the time limits of the hazards;
//! - [`faults`]: a sensor's faults as volts for it, and when its converter looks at them.
#![forbid(unsafe_code)]

pub mod bench;
pub mod board;
pub mod boot_log;
pub mod campaign;
pub mod chain;
pub mod degraded;
pub mod faults;
pub mod gestures;
pub mod host;
pub mod host_loop;
pub mod lamps;
pub mod limits;
pub mod lockstep;
pub mod name_parts;
pub mod people;
pub mod pico;
pub mod recordings;
pub mod statistics;
pub mod swings;
pub mod workspace;
