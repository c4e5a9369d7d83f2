//! A line for each judged run in one file, so that `cargo xtask test` counts the runs of all programs and finds each violation.

use std::io::Write;

use anyhow::{Context as _, Result};
use serde::Serialize;

use super::Judged;

/// Environment variable with the name of the file.
const FILE: &str = "FOOTFALL_JUDGED";

/// A file that is appended to by every run.
#[derive(Debug, Clone)]
pub(crate) struct JudgeLog {
    file: Option<std::ffi::OsString>,
    /// Why violations are expected.
    violates: Option<String>,
}

/// A line.
#[derive(Serialize)]
struct Line<'a> {
    #[serde(flatten)]
    judged: &'a Judged,
    violates: Option<&'a str>,
}

impl JudgeLog {
    /// The file of the environment, if it names one. `violates`: why violations are expected.
    pub(crate) fn of_environment(violates: Option<String>) -> Self {
        JudgeLog { file: std::env::var_os(FILE), violates }
    }

    /// Appends a line.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn append(&self, judged: &Judged) -> Result<()> {
        let Some(file) = &self.file else { return Ok(()) };
        let mut line = serde_json::to_vec(&Line { judged, violates: self.violates.as_deref() })?;
        line.push(b'\n');
        let mut open = std::fs::OpenOptions::new();
        let mut out = open.append(true).create(true).open(file).with_context(|| format!("cannot write {file:?}"))?;
        // One write: lines of several processes do not mix.
        out.write_all(&line).with_context(|| format!("cannot write {file:?}"))
    }
}
