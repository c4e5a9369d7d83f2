//! A board that runs by itself, shown live: from its serial port, or from its log at a debug probe.

mod connection;
pub mod run;
mod shown;
