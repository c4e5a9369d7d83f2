//! The files that commands read and write.

pub mod bounded;
pub mod calibration_file;
pub mod capture;
#[cfg(feature = "analysis")]
pub mod fit_summary;
#[cfg(feature = "analysis")]
pub mod graph_file;
pub(crate) mod mcap_writer;
pub mod recording;
#[cfg(feature = "analysis")]
pub mod svg;
