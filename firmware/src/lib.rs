//! The part of the firmware that uses no register, so that host tests and tools can use it; the registers are in the program (`main.rs`).
//!
//! - [`board`]: pins, clock, supply and flash sectors of each board.
//! - [`crystal`]: how the crystal is measured before the clock is started from it.
//! - [`frame_phase`]: whether the servo frames keep their distance from the clock.
//! - [`interrupts`]: which interrupts are enabled, with their priorities.
//! - [`lamp`]: what the lamps show.
//! - [`pacing`]: which control period a sample belongs to, how many were missed, what counts as late.
//! - [`liveness`]: whether the watchdog may be reloaded, and how long after the last reload it resets.
//! - [`last_outputs`]: how the servo outputs ended, in RAM for the next boot.
//! - [`oscillator`]: how the watchdog's oscillator is measured.
//! - [`post_mortem`]: crash records in RAM for the next boot, and the lock-out of arming after repeated crashes.
//! - [`pulse_check`]: a second look at the pulses, after the loop.
//! - [`seal`]: the check sum of the program in flash.
#![cfg_attr(target_os = "none", no_std)]
#![forbid(unsafe_code)]

pub mod board;
pub mod crystal;
pub mod frame_phase;
pub mod interrupts;
pub mod lamp;
pub mod last_outputs;
pub mod liveness;
pub mod oscillator;
pub mod pacing;
pub mod post_mortem;
pub mod pulse_check;
pub mod seal;
