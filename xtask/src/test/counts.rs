//! Counts the tests that pass, fail and are ignored, from the output of test programs.
//!
//! libtest and libtest-mimic write `test NAME ... ok`, `... FAILED` or `... ignored`, and at the end
//! `test result: ok. 12 passed; 0 failed; 3 ignored; ...`. The reason for an ignored test follows the word (`ignored, REASON`, from the
//! attribute) or is a line of its own on standard error: `ignored: NAME: REASON`.

use std::collections::BTreeMap;
use std::fmt;
use std::io::Write;
use std::process::Command;

use anyhow::{Result, ensure};

use crate::shell::{self, Stream};

/// Tests of one or more programs.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Counts {
    pub(crate) passed: u32,
    /// The names of the tests that failed, and of the programs that ended badly without naming one.
    pub(crate) failed: Vec<String>,
    pub(crate) ignored: u32,
    /// How many tests were ignored for each reason. Those without a reason are not here.
    pub(crate) reasons: BTreeMap<String, u32>,
}

impl Counts {
    /// Adds those of another program.
    pub(crate) fn add(&mut self, other: Counts) {
        self.passed += other.passed;
        self.failed.extend(other.failed);
        self.ignored += other.ignored;
        for (reason, count) in other.reasons {
            *self.reasons.entry(reason).or_default() += count;
        }
    }

    /// The same counts if tests ran and none failed.
    ///
    /// # Errors
    /// Names the tests that failed, or says that no test ran.
    pub(crate) fn without_failures(self) -> Result<Counts> {
        ensure!(self.failed.is_empty(), "{} of the tests failed: {}", self.failed.len(), self.failed.join(", "));
        ensure!(self.passed + self.ignored > 0, "no test ran");
        Ok(self)
    }
}

impl fmt::Display for Counts {
    /// "120 tests passed, 4 ignored (3: no recordings; 1: no reason given)".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} tests passed, {} ignored", self.passed, self.ignored)?;
        if self.ignored == 0 {
            return Ok(());
        }
        let mut parts: Vec<String> = self.reasons.iter().map(|(reason, count)| format!("{count}: {reason}")).collect();
        let with_reason: u32 = self.reasons.values().sum();
        if self.ignored > with_reason {
            parts.push(format!("{}: no reason given", self.ignored - with_reason));
        }
        write!(f, " ({})", parts.join("; "))
    }
}

/// Runs a command that runs tests, and passes its output on to `show`. If it fails and names no test, `name` stands for the test.
///
/// # Errors
/// The command cannot be started. Tests that fail are in the counts.
pub(crate) fn run(name: &str, command: &mut Command, show: &mut dyn Write) -> Result<Counts> {
    let mut counts = Counts::default();
    let status = shell::each_line(command, |stream, line| {
        // Nobody may be reading; the result counts all the same.
        let _ = writeln!(show, "{line}");
        let line = line.trim();
        if let Some(reason) = reason_in(line) {
            *counts.reasons.entry(reason.to_owned()).or_default() += 1;
        }
        if stream == Stream::Output {
            counts.passed += number_in(line, "passed").unwrap_or(0);
            counts.ignored += number_in(line, "ignored").unwrap_or(0);
            counts.failed.extend(failure_in(line).map(str::to_owned));
        }
    })?;
    if counts.failed.is_empty() && !status.success() {
        counts.failed.push(format!("{name} ({status})"));
    }
    Ok(counts)
}

/// The name in `test NAME ... FAILED`.
fn failure_in(line: &str) -> Option<&str> {
    line.strip_prefix("test ")?.strip_suffix(" ... FAILED")
}

/// The number before a word in `test result: ok. 12 passed; 0 failed; 3 ignored; ...`.
fn number_in(line: &str, word: &str) -> Option<u32> {
    let parts = line.strip_prefix("test result: ")?.split_once(". ")?.1.split("; ");
    parts.filter_map(|part| part.split_once(' ')).find(|(_, name)| *name == word)?.0.parse().ok()
}

/// The reason in `ignored: NAME: REASON` or `test NAME ... ignored, REASON`.
fn reason_in(line: &str) -> Option<&str> {
    let own_line = || line.strip_prefix("ignored: ")?.split_once(": ").map(|(_, reason)| reason);
    let of_result = || line.strip_prefix("test ")?.split_once(" ... ignored, ").map(|(_, reason)| reason);
    own_line().or_else(of_result)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_from_the_result_line() {
        let line = "test result: FAILED. 3 passed; 1 failed; 2 ignored; 0 measured; 0 filtered out; finished in 0.1s";
        assert_eq!((number_in(line, "passed"), number_in(line, "ignored")), (Some(3), Some(2)));
        assert_eq!(number_in("test result: ok. 12 passed; 0 failed", "passed"), Some(12));
        assert_eq!(number_in("test tests::the_result ... ok", "passed"), None);
        assert_eq!(number_in("running 4 tests", "passed"), None);
    }

    #[test]
    fn reasons_are_read_in_both_forms() {
        assert_eq!(reason_in("ignored: follow::locks: no recordings: none at all"), Some("no recordings: none at all"));
        assert_eq!(reason_in("test follow::locks ... ignored, takes an hour"), Some("takes an hour"));
        for line in ["test follow::locks ... ignored", "ignored: nothing", "test a ... ok"] {
            assert_eq!(reason_in(line), None, "{line}");
        }
    }

    #[cfg(unix)]
    fn run_script(script: &str) -> (Result<String, String>, String) {
        let mut shown = Vec::new();
        let counts = run("sh", shell::command("sh").args(["-c", script]), &mut shown);
        let counts = counts
            .and_then(Counts::without_failures)
            .map(|counts| counts.to_string())
            .map_err(|error| error.to_string());
        (counts, String::from_utf8(shown).unwrap())
    }

    #[cfg(unix)]
    #[test]
    fn all_programs_of_a_run_are_counted() {
        let (counts, shown) = run_script(
            "echo 'test result: ok. 2 passed; 0 failed; 0 ignored'; echo 'test result: ok. 3 passed; 0 failed; 0 ignored'",
        );
        assert_eq!(counts, Ok("5 tests passed, 0 ignored".to_owned()));
        assert_eq!(shown.lines().count(), 2);
    }

    #[cfg(unix)]
    #[test]
    fn ignored_tests_are_counted_with_their_reasons() {
        let (counts, _) = run_script(
            "echo 'ignored: a: no recordings' >&2; echo 'ignored: b: no recordings' >&2; echo 'test c ... ignored, slow'; \
             echo 'test d ... ignored'; echo 'test result: ok. 2 passed; 0 failed; 4 ignored; 0 measured'",
        );
        let expected = "2 tests passed, 4 ignored (2: no recordings; 1: slow; 1: no reason given)";
        assert_eq!(counts, Ok(expected.to_owned()));
    }

    #[cfg(unix)]
    #[test]
    fn a_failed_test_is_named() {
        let script = "echo 'test gate::holds ... FAILED'; echo 'test result: FAILED. 2 passed; 1 failed'; exit 101";
        assert_eq!(run_script(script).0, Err("1 of the tests failed: gate::holds".to_owned()));
        let script = "echo 'test result: ok. 2 passed; 0 failed'; exit 1";
        assert_eq!(run_script(script).0, Err("1 of the tests failed: sh (exit status: 1)".to_owned()));
        assert_eq!(run_script("echo 'test result: ok. 0 passed; 0 failed'").0, Err("no test ran".to_owned()));
    }

    #[test]
    fn counts_are_added() {
        let one =
            |reason: &str| Counts { passed: 2, ignored: 1, reasons: [(reason.to_owned(), 1)].into(), failed: vec![] };
        let mut sum = one("slow");
        sum.add(one("slow"));
        sum.add(one("no recordings"));
        assert_eq!(sum.to_string(), "6 tests passed, 3 ignored (1: no recordings; 2: slow)");
    }
}
