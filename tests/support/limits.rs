//! The time limits of `hazards.toml`: a test that measures a reaction compares it with what the file declares.

use crate::workspace::read;

/// Longest time from the fault to the start of the reaction, ms, of the hazard with this number.
///
/// # Panics
/// The file has no such hazard, or declares no limit for it.
#[must_use]
pub fn limit_ms(id: &str) -> f64 {
    let file: toml::Table = read("hazards.toml").parse().expect("TOML");
    let hazards = file["hazard"].as_array().expect("a list");
    let hazard = hazards.iter().find(|hazard| hazard["id"].as_str() == Some(id)).unwrap_or_else(|| panic!("no {id}"));
    let limit = hazard.get("limit_ms").unwrap_or_else(|| panic!("{id} has no limit_ms"));
    limit.as_float().or_else(|| limit.as_integer().map(|ms| ms as f64)).expect("a number")
}
