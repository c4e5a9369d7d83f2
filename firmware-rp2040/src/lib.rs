//! The part of the RP2040 firmware that uses no register, so that host tests can use it; the registers are in the program (`main.rs`).
//!
//! - [`board`]: pins and flash sectors of the board.
//! - [`float_special`]: sums and products of what the program's fast routines leave out.
//! - [`timing`]: which tick counts as late, and when a block of samples was converted.
//! - [`watchdog_time`]: the watchdog's time-out, measured, as the loop wants it.
#![cfg_attr(target_os = "none", no_std)]
#![forbid(unsafe_code)]

pub mod board;
pub mod float_special;
pub mod timing;
pub mod watchdog_time;
