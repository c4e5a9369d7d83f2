//! Configuration of the loop, its sensors and its defaults.

pub(crate) mod config;
pub mod default_loop;
pub(crate) mod sensors;
