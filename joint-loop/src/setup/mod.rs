//! Configuration of the loop, its robot and its sensors, and their default values.

pub(crate) mod config;
pub mod default_loop;
pub(crate) mod robot;
pub mod robot_config;
pub(crate) mod sensors;
