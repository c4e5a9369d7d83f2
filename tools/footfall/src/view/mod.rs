//! What the user sees: live screens, lines of text, charts.

mod angle_chart;
mod cut;
pub mod keys;
#[cfg(feature = "analysis")]
pub mod live_gait;
pub mod plain;
pub mod screen;
pub mod state;
pub mod tuning;
pub mod warnings;
