//! The commands, one file each.

pub mod calibrate;
pub mod certify;
pub mod check;
pub mod convert;
pub mod entrain;
pub mod figures;
pub mod fit;
pub mod gait_error;
pub mod hexapod;
pub mod obb;
pub mod pack;
pub mod record;
pub(crate) mod steps;
pub mod sync;
pub mod volts;
pub mod walk;
pub mod watch;
