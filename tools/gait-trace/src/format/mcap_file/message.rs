//! A message: its length, and the JSON object in it.

use serde_json::{Map, Value};

/// Longest message with joints, bytes.
const MAX_MESSAGE: usize = 64 * 1024;

pub(super) fn check_length(message: &[u8]) -> Result<(), String> {
    if message.len() > MAX_MESSAGE {
        return Err(format!("{} bytes; allowed are up to {MAX_MESSAGE}", message.len()));
    }
    Ok(())
}

/// The object of a JSON message.
pub(super) fn object_of(message: &[u8]) -> Result<Map<String, Value>, String> {
    check_length(message)?;
    serde_json::from_slice(message).map_err(|error| {
        format!("is not a JSON object ({error}); allowed is an object such as {{\"left_knee_deg\": 12.5}}")
    })
}
