//! The rules of the firmware that need no register, so that the host can test them; the registers are in the program (`main.rs`).
//!
//! - [`pacing`]: which control period a sample belongs to, how many were missed, what counts as late.
//! - [`liveness`]: whether the watchdog may be fed, and how long it bites after the last feed.
//! - [`post_mortem`]: what a crash leaves in RAM for the next boot, and when repeated crashes lock arming out.
#![cfg_attr(target_os = "none", no_std)]
#![forbid(unsafe_code)]

pub mod liveness;
pub mod pacing;
pub mod post_mortem;
