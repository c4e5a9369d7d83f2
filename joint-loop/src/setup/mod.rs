//! Configuration of the loop, its robot and its sensors, and their default values.

pub(crate) mod config;
pub mod default_loop;
pub(crate) mod robot;
pub(crate) mod sensors;
