//! Option groups and value parsers that several commands share.

pub mod at;
pub mod board_supply;
#[cfg(feature = "analysis")]
pub mod cadence;
pub mod manners;
pub mod overwrite;
pub mod played;
pub mod reading;
pub mod record_name;
pub mod robot;
pub mod sensors;
pub mod steps;
#[cfg(feature = "analysis")]
pub mod system;
pub mod terminal;
pub mod value;
