//! The judgements of all runs of the virtual board in a step: each run appends a line to one file.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};

/// Environment variable with the name of the file.
pub(super) const FILE: &str = "FOOTFALL_JUDGED";

/// What came of the pulses of all runs.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Judged {
    runs: u64,
    pulses: u64,
    cut: u64,
    /// Number of runs that were meant to violate the limits, by reason.
    violates: BTreeMap<String, u64>,
}

impl Judged {
    /// Reads the file.
    ///
    /// # Errors
    /// It cannot be read, a line is not one of a run, or a run has a pulse that no servo may get, and no reason for it.
    pub(super) fn read(file: &Path) -> Result<Judged> {
        let text = std::fs::read_to_string(file).with_context(|| format!("cannot read {}", file.display()))?;
        Self::parse(&text)
    }

    fn parse(text: &str) -> Result<Judged> {
        let mut judged = Judged::default();
        for line in text.lines() {
            let run: serde_json::Value = serde_json::from_str(line).with_context(|| format!("`{line}` is no run"))?;
            let number = |key: &str| run[key].as_u64().with_context(|| format!("`{line}` has no `{key}`"));
            judged.runs += 1;
            judged.pulses += number("pulses")?;
            judged.cut += number("cut")?;
            match (number("violations")?, run["violates"].as_str()) {
                (0, None) => {}
                (0, Some(reason)) => bail!("a run was meant to violate the limits of the pulses and did not: {reason}"),
                (_, Some(reason)) => *judged.violates.entry(reason.to_owned()).or_default() += 1,
                (violations, None) => bail!("{violations} pulses that no servo may get: {}", run["first"]),
            }
        }
        ensure!(judged.pulses > 0, "no pulse was judged in {} runs", judged.runs);
        Ok(judged)
    }
}

impl fmt::Display for Judged {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} pulses of {} runs judged, {} cut with the supply", self.pulses, self.runs, self.cut)?;
        for (reason, runs) in &self.violates {
            write!(f, "; {runs} meant to violate: {reason}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = r#"{"pulses":100,"cut":1,"trimmed":[],"violations":0,"first":[],"violates":null}"#;

    #[test]
    fn runs_are_added() {
        let meant = r#"{"pulses":5,"cut":0,"trimmed":[],"violations":2,"first":["a","b"],"violates":"why"}"#;
        let judged = Judged::parse(&[GOOD, GOOD, meant].join("\n")).unwrap();
        assert_eq!(judged.to_string(), "205 pulses of 3 runs judged, 2 cut with the supply; 1 meant to violate: why");
    }

    #[test]
    fn a_violation_without_a_reason_and_a_reason_without_one_fail() {
        for (text, words) in [
            (
                GOOD.replace("\"violations\":0,\"first\":[]", "\"violations\":1,\"first\":[\"PE9\"]"),
                "1 pulses that no servo may get: [\"PE9\"]",
            ),
            (GOOD.replace("\"violates\":null", "\"violates\":\"why\""), "and did not: why"),
            (GOOD.replace("100", "0"), "no pulse was judged in 1 runs"),
            (GOOD.replace("\"cut\":1,", ""), "has no `cut`"),
            ("x".into(), "is no run"),
        ] {
            let error = format!("{:#}", Judged::parse(&text).unwrap_err());
            assert!(error.contains(words), "{error}");
        }
    }
}
