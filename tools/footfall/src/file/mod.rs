//! Files that the commands read and write.

pub mod calibration_file;
pub mod capture;
pub mod degrees;
pub mod parameter_file;
pub mod sensors;
pub mod svg;
