//! The table at the end of `cargo xtask test`.

use std::fmt::Write as _;
use std::time::Duration;

use super::counts::Counts;

/// How a step ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Outcome {
    /// With a number for the table.
    Passed(String),
    /// With the first line of the error.
    Failed(String),
    /// Something optional is missing: which, and why.
    Skipped(String),
    /// A step before it failed.
    NotRun,
}

/// A step and its outcome.
#[derive(Debug)]
pub(super) struct Row {
    pub(super) name: &'static str,
    pub(super) outcome: Outcome,
    pub(super) took: Duration,
    /// Processor time of the programs that it ran; `None` where the system does not say it.
    pub(super) processor: Option<Duration>,
}

/// A line for each step, one for the tests in them if any ran, and a last line that counts the steps.
pub(super) fn table(rows: &[Row], counts: &Counts, total: Duration) -> String {
    let mut text = String::new();
    let (mut passed, mut failed, mut skipped) = (0, 0, 0);
    for Row { name, outcome, took, processor } in rows {
        let (word, note) = match outcome {
            Outcome::Passed(note) => {
                passed += 1;
                ("passed", note.as_str())
            }
            Outcome::Failed(error) => {
                failed += 1;
                ("FAILED", error.as_str())
            }
            Outcome::Skipped(reason) => {
                skipped += 1;
                ("SKIPPED", reason.as_str())
            }
            Outcome::NotRun => {
                skipped += 1;
                ("not run", "a step before it failed")
            }
        };
        // Writing to a String cannot fail.
        let processor = processor.map_or_else(|| "-".to_owned(), |time| format!("{:.1}", time.as_secs_f32()));
        let _ =
            writeln!(text, "{name:<14} {word:<8} {:>7.1} s, {processor:>7} of processor  {note}", took.as_secs_f32());
    }
    let all: Duration = rows.iter().filter_map(|row| row.processor).sum();
    let _ = writeln!(
        text,
        "{:<14} {:<8} {:>7.1} s, {:>7.1} of processor",
        "all",
        "",
        total.as_secs_f32(),
        all.as_secs_f32()
    );
    if *counts != Counts::default() {
        let _ = writeln!(text, "{counts}");
    }
    let _ = writeln!(text, "{passed} passed, {failed} failed, {skipped} skipped");
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(name: &'static str, outcome: Outcome) -> Row {
        Row { name, outcome, took: Duration::from_millis(1500), processor: Some(Duration::from_millis(2600)) }
    }

    #[test]
    fn the_last_line_counts_the_steps() {
        let rows = [
            row("format", Outcome::Passed("5 files".into())),
            row("pico", Outcome::Skipped("node not found".into())),
            row("lints", Outcome::Failed("cargo clippy failed".into())),
            row("docs", Outcome::NotRun),
        ];
        let counts = Counts { passed: 12, ..Counts::default() };
        let text = table(&rows, &counts, Duration::from_secs(5));
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "format         passed       1.5 s,     2.6 of processor  5 files");
        assert_eq!(lines[1], "pico           SKIPPED      1.5 s,     2.6 of processor  node not found");
        assert_eq!(lines[2], "lints          FAILED       1.5 s,     2.6 of processor  cargo clippy failed");
        assert_eq!(lines[3], "docs           not run      1.5 s,     2.6 of processor  a step before it failed");
        assert_eq!(lines[5..], ["12 tests passed, 0 ignored", "1 passed, 1 failed, 2 skipped"]);
    }

    #[test]
    fn without_tests_there_is_no_line_for_them() {
        let text = table(&[row("format", Outcome::Passed(String::new()))], &Counts::default(), Duration::ZERO);
        assert_eq!(text.lines().count(), 3);
        assert_eq!(text.lines().last(), Some("1 passed, 0 failed, 0 skipped"));
    }
}
