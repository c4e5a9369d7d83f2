//! The times of `hazards.toml`: a test that measures a reaction compares it with what the file declares and with what it says was measured.

use std::sync::LazyLock;

use crate::workspace::read;

static FILE: LazyLock<toml::Table> = LazyLock::new(|| read("hazards.toml").parse().expect("TOML"));

/// The longest time of the file may be exceeded by this factor: another compiler makes other instructions. The limit may not.
const MARGIN: f64 = 1.1;

/// Fails if a reaction came later than the limit of this hazard, or a tenth later than the longest time that the file has: the file would claim less
/// than is so.
///
/// # Panics
/// It came later, or before the fault, or the file has no such hazard or no times for it.
pub fn assert_in_time(id: &str, ms: f64, what: &str) {
    let hazards = FILE["hazard"].as_array().expect("a list");
    let hazard = hazards.iter().find(|hazard| hazard["id"].as_str() == Some(id)).unwrap_or_else(|| panic!("no {id}"));
    let [limit, longest] = ["limit_ms", "longest_ms"].map(|key| {
        let value = hazard.get(key).unwrap_or_else(|| panic!("{id} has no {key}"));
        value.as_float().or_else(|| value.as_integer().map(|ms| ms as f64)).expect("a number")
    });
    assert!((0.0..=limit).contains(&ms), "{id}: {ms} ms, the limit is {limit} ms: {what}");
    assert!(ms <= longest * MARGIN, "{id}: {ms} ms, and the longest in hazards.toml is {longest} ms: {what}");
}
