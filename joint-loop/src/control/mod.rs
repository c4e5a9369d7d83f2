//! Control of one period: tick, supervisor, monitor, fault table, button, test of the emergency stop, trim.

pub mod button;
pub mod fault_table;
pub(crate) mod monitor;
pub mod stop_test;
pub mod supervisor;
pub(crate) mod tick;
pub mod trim;
