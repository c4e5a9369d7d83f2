//! What `board-cost` prints.

use anyhow::{Context, Result};
use serde_json::Value;

/// The row of a part.
pub(super) fn row<'a>(counted: &'a Value, part: &str) -> Result<&'a Value> {
    let rows = counted["rows"].as_array().context("board-cost lists no parts")?;
    rows.iter().find(|row| row["part"] == part).with_context(|| format!("board-cost lists no part `{part}`"))
}
