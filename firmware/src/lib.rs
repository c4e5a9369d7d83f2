//! The part of the firmware that uses no register, so that host tests and tools can use it; the registers are in the program (`main.rs`).
//!
//! - [`board`]: pins, clock, supply and flash sectors of each board.
//! - [`crystal`]: how the crystal is measured before the clock is started from it.
//! - [`interrupts`]: which interrupts are enabled, with their priorities.
//! - [`seal`]: the check sum of the program in flash.
//! - [`timing`]: when scans are triggered, and what counts as late.
#![cfg_attr(target_os = "none", no_std)]
#![forbid(unsafe_code)]

pub mod board;
pub mod crystal;
pub mod interrupts;
pub mod seal;
pub mod timing;
