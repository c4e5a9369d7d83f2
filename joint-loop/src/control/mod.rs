//! Control of one period: tick, supervisor and how its status is kept, monitor with supply and timeliness, fault table, button, test of the emergency stop, trim, clock of the watchdog.

pub(crate) mod burst;
pub mod button;
pub mod fault_table;
pub(crate) mod kept_status;
pub(crate) mod monitor;
pub mod stop_test;
pub mod supervisor;
pub mod supply;
pub(crate) mod tick;
pub mod timeliness;
pub mod trim;
pub mod watchdog_clock;
