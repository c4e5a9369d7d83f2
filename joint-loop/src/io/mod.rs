//! Data between the loop and the board: sample, command, frame, time code.

pub(crate) mod board;
pub(crate) mod frame;
pub mod time_code;
