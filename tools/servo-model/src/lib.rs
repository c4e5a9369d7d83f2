//! Hobby servos, modelled at their two connectors: the pulses and the supply go in, the angle of the shaft comes out.
//!
//! ```
//! use servo_model::{DataSheet, Kind, Servo};
//! // Mounted so that 1500 us are 0 degrees and 11.1 us more are one degree more.
//! let mut servo = Servo::new(&DataSheet::FT_7235, 1000.0 / 90.0, 0.0);
//! servo.set_supply(0.0, true);
//! // It takes no pulse in its first 0.2 s.
//! servo.pulse(0.2015, 1600.0);
//! servo.advance(0.4);
//! assert!((servo.angle() - 9.0).abs() < 0.4);
//! ```
//!
//! Limits of [`Servo`]: no load, no inertia: the shaft turns at the speed of the data sheet or not at all, so that an angle is an upper bound of what
//! a free shaft turns. No back-drive without torque. No overshoot.
//!
//! [`LoadedServo`] is a servo in a body that is simulated elsewhere: the body gives the angle and the speed of the shaft, the servo its torque.
//! Limits: no heat, no limit of the current, no play in the gear, no drop of the supply, no time to start.
#![forbid(unsafe_code)]

mod data_sheet;
mod drive;
mod load_sheet;
mod loaded;
mod servo;

pub use data_sheet::{DataSheet, Kind};
pub use load_sheet::{LoadSheet, SupplyPoint};
pub use loaded::{LoadedServo, Strength, SupplyError};
pub use servo::Servo;
