//! What passes between the loop and the board.

pub(crate) mod board;
pub(crate) mod frame;
pub mod time_code;
