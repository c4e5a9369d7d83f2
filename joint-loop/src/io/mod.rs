//! Data between the loop and the board: sample, command, frame, conditions, time code.

pub(crate) mod board;
pub(crate) mod conditions;
pub(crate) mod frame;
pub mod time_code;
