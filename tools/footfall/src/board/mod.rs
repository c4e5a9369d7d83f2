//! A board or virtual board: process, log, serial port, image, replay.

pub mod at_port;
pub mod counters;
pub mod default_loop;
mod explained;
pub mod feed;
pub mod host_copy;
pub mod image;
pub mod lines;
pub mod process;
pub mod replay;
pub mod requests;
pub mod run;
pub mod run_result;
pub mod serial;
pub mod source;
pub mod transport;
