//! Generators that a board can run.

pub(crate) mod board_generator;
