//! The file of a result in a folder, and its curves, which the summary does not hold.

use std::path::Path;

use serde_json::Value;

use crate::file::bounded;

/// Most bytes of a result or of a summary.
pub const MOST_BYTES: u64 = 64 << 20;

/// Key of the file of a result, in what is kept of it.
pub(super) const FILE: &str = "result_file";

/// The curves of a result, from its file; null if it can no longer be read.
pub(super) fn curves_of(outcome: &Value) -> Value {
    let path = outcome[FILE].as_str().unwrap_or_default();
    let bytes = bounded::bytes(Path::new(path), MOST_BYTES).unwrap_or_default();
    serde_json::from_slice::<Value>(&bytes).map_or(Value::Null, |mut outcome| outcome["curves"].take())
}
