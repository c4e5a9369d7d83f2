//! A board that runs by itself, shown live: from its serial port, or through a debug probe.

mod connection;
pub mod run;
mod shown;
