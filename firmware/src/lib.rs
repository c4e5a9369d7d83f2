//! What of the firmware needs no register, so that the host can test and read it; the registers are in the program (`main.rs`).
//!
//! - [`board`]: pins, clock, supply and flash sectors of each board.
//! - [`pacing`]: which control period a sample belongs to, how many were missed, what counts as late.
//! - [`liveness`]: whether the watchdog may be reloaded, and how long after the last reload it resets.
//! - [`post_mortem`]: what a crash leaves in RAM for the next boot, and when repeated crashes lock arming out.
#![cfg_attr(target_os = "none", no_std)]
#![forbid(unsafe_code)]

pub mod board;
pub mod liveness;
pub mod pacing;
pub mod post_mortem;
