//! The three tasks, and the data that passes between them.
//!
//! ```text
//!  interrupt executor                                   thread executor
//!  (above everything that logs)
//!
//!  DMA interrupt --> control (sample, tick, pulses) --> queues ---> telemetry --> RTT, port
//!                       |                                               |
//!                       +---------------- progress --------------------+-------> watchdog --> IWDG
//! ```
//!
//! Data flows from left to right only: the ticks never wait for the thread.

pub(crate) mod control;
mod progress;
pub(crate) mod queues;
pub(crate) mod sensor;
pub(crate) mod telemetry;
pub(crate) mod watchdog;
