//! What a person sees: live screens, plain lines, summaries.

pub mod live_gait;
pub mod plain;
pub mod screen;
pub mod state;
pub mod summary;
