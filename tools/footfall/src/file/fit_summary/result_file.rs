//! The file of a result in a folder, and the warnings in it.

use std::path::Path;

use gait_trace::Level;
use serde_json::{Value, json};

use crate::file::bounded;

/// Most bytes of a result.
pub const MOST_BYTES: u64 = 64 << 20;

/// Reads a result, or the reason why a file was skipped. A file that is neither is a recording that failed, with the reason: it is one row of
/// the summary, and ends nothing.
pub(super) fn read(path: &Path) -> Value {
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
    result(path).unwrap_or_else(|why| {
        json!({ "recording": name, "error": format!("{}: {why}; allowed is a file that `footfall fit` wrote", path.display()) })
    })
}

fn result(path: &Path) -> Result<Value, String> {
    let bytes = bounded::regular(path, MOST_BYTES).map_err(|why| why.to_string())?;
    let outcome: Value = serde_json::from_slice(&bytes).map_err(|error| error.to_string())?;
    let ended = ["error", "generator", "skipped"].into_iter().any(|key| outcome[key].is_string());
    if outcome["recording"].is_string() && ended { Ok(outcome) } else { Err("is no result of a fit".into()) }
}

/// The warnings among the findings of a result.
pub(crate) fn warnings(outcome: &Value) -> Vec<&str> {
    let findings = outcome["findings"].as_array().into_iter().flatten();
    findings
        .filter(|finding| finding["level"] == Level::Warning.name())
        .filter_map(|finding| finding["text"].as_str())
        .collect()
}
