//! The file of a result in a folder, and the warnings in it.

use std::path::Path;

use gait_trace::Level;
use serde_json::Value;

use crate::failure::Failure;
use crate::file::bounded;

/// Most bytes of a result.
pub const MOST_BYTES: u64 = 64 << 20;

/// Reads a result, or the reason why a file was skipped.
pub(super) fn read(path: &Path) -> Result<Value, Failure> {
    let wrong =
        |why: String| Failure::input(format!("{}: {why}; allowed is a file that `footfall fit` wrote", path.display()));
    let bytes = bounded::bytes(path, MOST_BYTES).map_err(|why| wrong(why.to_string()))?;
    let outcome: Value = serde_json::from_slice(&bytes).map_err(|error| wrong(error.to_string()))?;
    let ended = ["error", "generator", "skipped"].into_iter().any(|key| outcome[key].is_string());
    if outcome["recording"].is_string() && ended { Ok(outcome) } else { Err(wrong("is no result of a fit".into())) }
}

/// The warnings among the findings of a result.
pub(crate) fn warnings(outcome: &Value) -> Vec<&str> {
    let findings = outcome["findings"].as_array().into_iter().flatten();
    findings
        .filter(|finding| finding["level"] == Level::Warning.name())
        .filter_map(|finding| finding["text"].as_str())
        .collect()
}
