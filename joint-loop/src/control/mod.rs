//! Control of one period: tick, supervisor, monitor, fault table, button, trim.

pub mod button;
pub mod fault_table;
pub(crate) mod monitor;
pub mod supervisor;
pub(crate) mod tick;
pub mod trim;
