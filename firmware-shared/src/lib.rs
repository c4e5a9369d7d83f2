//! Rules of the firmware that use no register, for every chip family; the host tests them.
//!
//! The numbers of the watchdog's oscillator and time-out ([`oscillator`], [`liveness`]) are those of the STM32F4; the RP2040 makes its time-out equal.
//!
//! Beside this library, `program` has the files that each family compiles in its program: tasks, log, queues, the reading of records.
//!
//! - [`frame_phase`]: whether the servo frames keep their distance from the clock.
//! - [`lamp`]: what the lamps show.
//! - [`last_outputs`]: how the servo outputs ended, in RAM for the next boot.
//! - [`licence`]: the licence to move, which only a hold of the button makes.
//! - [`liveness`]: whether the watchdog may be reloaded, and how long after the last reload it resets.
//! - [`oscillator`]: how the watchdog's oscillator is measured.
//! - [`pacing`]: which control period a sample belongs to, how many were missed.
//! - [`post_mortem`]: crash records in RAM for the next boot, and the lock-out of arming after repeated crashes.
//! - [`pulse_check`]: a second look at the pulses, after the loop.
//! - [`status_line`]: state, angles and supply in a line of the log.
#![cfg_attr(target_os = "none", no_std)]
#![forbid(unsafe_code)]

pub mod frame_phase;
pub mod lamp;
pub mod last_outputs;
pub mod licence;
pub mod liveness;
pub mod oscillator;
pub mod pacing;
pub mod post_mortem;
pub mod pulse_check;
pub mod status_line;
