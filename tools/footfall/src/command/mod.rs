//! The commands, one file each: options and `run`.

pub mod calibrate;
pub mod certify;
pub mod check;
pub mod convert;
pub mod defaults;
pub mod entrain;
pub mod figures;
pub mod fit;
pub mod gait_error;
pub mod hexapod;
pub mod merge;
pub mod obb;
pub mod pack;
pub mod record;
pub mod sync;
pub mod volts;
pub mod walk;
pub mod watch;
