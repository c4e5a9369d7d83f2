//! What the user sees: live screens, lines of text, charts.

pub mod gait_charts;
pub mod live_gait;
pub mod plain;
pub mod screen;
pub mod state;
