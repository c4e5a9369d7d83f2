//! What happens in one control period: tick, supervisor, monitor, button.

pub(crate) mod button;
pub mod fault_table;
pub(crate) mod monitor;
pub mod supervisor;
pub(crate) mod tick;
