//! Runs some steps in a second process beside the others, because each of them keeps one core busy for most of its time.
//!
//! The process is this program with `--only` and `--results`. Its output goes to a file, which is shown when it has ended; its rows of the table
//! come back as JSON.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, ExitStatus, Stdio};
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};
use serde_json::{Value, json};

use super::counts::Counts;
use super::steps::{STEPS, Step};
use super::summary::{Outcome, Row};
use crate::shell;

/// The steps that run beside the others, in their usual order: the linker's optimisation, the emulator of the Pico and Python's tests have one thread.
pub(super) const BESIDE: [&str; 9] = [
    "images",
    "cores-thumb",
    "example",
    "panic-free",
    "image-audit",
    "pico",
    "python-readers",
    "python",
    "python-board",
];

/// The second process.
pub(super) struct Beside {
    child: Child,
    ended: Option<ExitStatus>,
    results: PathBuf,
    log: PathBuf,
}

impl Beside {
    /// Starts the steps; `folder` is for the files.
    pub(super) fn start(steps: &[&Step], folder: &Path) -> Result<Beside> {
        std::fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))?;
        let (results, log) = (folder.join("beside.json"), folder.join("beside.log"));
        for file in [&results, &stop_file(&results)] {
            if file.exists() {
                std::fs::remove_file(file).with_context(|| format!("removing {}", file.display()))?;
            }
        }
        let output = File::create(&log).with_context(|| format!("writing {}", log.display()))?;
        let mut command = shell::command(std::env::current_exe().context("finding this program")?);
        command.arg("test").arg("--results").arg(&results);
        command.args(steps.iter().flat_map(|step| ["--only", step.name]));
        command.stdin(Stdio::null()).stdout(output.try_clone().context("sharing the log")?).stderr(output);
        let names: Vec<&str> = steps.iter().map(|step| step.name).collect();
        eprintln!("\n=== beside the other steps: {}; their output is in {}", names.join(", "), log.display());
        let child = command.spawn().context("starting the steps beside the others")?;
        Ok(Beside { child, ended: None, results, log })
    }

    /// Whether one of the steps has failed so far.
    pub(super) fn has_failed(&mut self) -> Result<bool> {
        if self.ended.is_none() {
            self.ended = self.child.try_wait().context("looking after the steps beside the others")?;
        }
        Ok(self.ended.is_some_and(|status| !status.success()))
    }

    /// Waits for the end, shows the output, and returns the rows and the tests in them. `stop` lets only the present step end.
    pub(super) fn end(mut self, stop: bool) -> Result<(Vec<Row>, Counts)> {
        if stop {
            let file = stop_file(&self.results);
            std::fs::write(&file, "").with_context(|| format!("writing {}", file.display()))?;
        }
        if !self.has_failed()? && self.ended.is_none() {
            eprintln!("\n=== waiting for the steps beside the others");
            self.child.wait().context("waiting for the steps beside the others")?;
        }
        let output = std::fs::read(&self.log).with_context(|| format!("reading {}", self.log.display()))?;
        eprintln!("\n=== beside the other steps:\n{}", String::from_utf8_lossy(&output));
        let text = std::fs::read_to_string(&self.results)
            .context("the steps beside the others ended without results; their output is above")?;
        read(&text)
    }
}

/// The file whose presence lets the second process end after its present step.
pub(super) fn stop_file(results: &Path) -> PathBuf {
    results.with_extension("stop")
}

/// The rows and the tests in them, as JSON.
pub(super) fn written(rows: &[Row], counts: &Counts) -> String {
    let millis = |time: Duration| u64::try_from(time.as_millis()).unwrap_or(u64::MAX);
    let rows = rows.iter().map(|row| {
        let (outcome, note) = match &row.outcome {
            Outcome::Passed(note) => ("passed", note.as_str()),
            Outcome::Failed(why) => ("failed", why.as_str()),
            Outcome::Skipped(why) => ("skipped", why.as_str()),
            Outcome::NotRun => ("not run", ""),
        };
        json!({
            "name": row.name,
            "outcome": outcome,
            "note": note,
            "took_ms": millis(row.took),
            "processor_ms": row.processor.map(millis),
        })
    });
    let Counts { passed, failed, ignored, reasons } = counts;
    let tests = json!({ "passed": passed, "failed": failed, "ignored": ignored, "reasons": reasons });
    json!({ "rows": rows.collect::<Vec<_>>(), "tests": tests }).to_string()
}

/// Reads what [`written`] wrote.
fn read(text: &str) -> Result<(Vec<Row>, Counts)> {
    let results: Value = serde_json::from_str(text).context("the results of the steps beside the others")?;
    let rows = results["rows"].as_array().context("no rows")?.iter().map(row).collect::<Result<_>>()?;
    let tests = &results["tests"];
    let number = |name: &str| tests[name].as_u64().and_then(|number| u32::try_from(number).ok()).context("no number");
    let mut counts = Counts { passed: number("passed")?, ignored: number("ignored")?, ..Counts::default() };
    for name in tests["failed"].as_array().context("no tests that failed")? {
        counts.failed.push(name.as_str().context("a name")?.to_owned());
    }
    for (reason, count) in tests["reasons"].as_object().context("no reasons")? {
        counts.reasons.insert(reason.clone(), count.as_u64().unwrap_or(0).try_into()?);
    }
    Ok((rows, counts))
}

fn row(row: &Value) -> Result<Row> {
    let text = |name: &str| row[name].as_str().with_context(|| format!("no {name} in {row}"));
    let name = text("name")?;
    let step = STEPS.iter().find(|step| step.name == name).with_context(|| format!("there is no step {name}"))?;
    let note = text("note")?.to_owned();
    let outcome = match text("outcome")? {
        "passed" => Outcome::Passed(note),
        "failed" => Outcome::Failed(note),
        "skipped" => Outcome::Skipped(note),
        "not run" => Outcome::NotRun,
        other => bail!("a step ended as {other}"),
    };
    let took = Duration::from_millis(row["took_ms"].as_u64().context("no time")?);
    Ok(Row { name: step.name, outcome, took, processor: row["processor_ms"].as_u64().map(Duration::from_millis) })
}

/// In the order of the steps; each must be there once.
pub(super) fn in_order(mut rows: Vec<Row>, steps: &[&Step]) -> Result<Vec<Row>> {
    let place = |row: &Row| steps.iter().position(|step| step.name == row.name);
    rows.sort_by_key(place);
    let same = rows.len() == steps.len() && rows.iter().zip(steps).all(|(row, step)| row.name == step.name);
    ensure!(same, "of {} steps there are {} results", steps.len(), rows.len());
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(name: &'static str, outcome: Outcome) -> Row {
        Row { name, outcome, took: Duration::from_millis(1500), processor: Some(Duration::from_millis(2600)) }
    }

    #[test]
    fn rows_and_tests_are_read_as_they_were_written() {
        let rows = [
            row("images", Outcome::Passed("199.6 KiB".into())),
            row("pico", Outcome::Skipped("node is missing".into())),
            Row { processor: None, ..row("python", Outcome::Failed("no test \"ran\"".into())) },
            row("example", Outcome::NotRun),
        ];
        let counts = Counts {
            passed: 12,
            failed: vec!["a::b".into()],
            ignored: 3,
            reasons: [("no recordings".to_owned(), 2)].into(),
        };
        let (read_rows, read_counts) = read(&written(&rows, &counts)).unwrap();
        assert_eq!(read_counts, counts);
        assert_eq!(format!("{read_rows:?}"), format!("{rows:?}"));
    }

    #[test]
    fn results_that_are_not_whole_are_refused() {
        let whole = written(&[row("images", Outcome::NotRun)], &Counts::default());
        assert!(read(&whole).is_ok());
        for (from, to) in
            [("images", "image"), ("not run", "ran"), ("took_ms", "took"), ("\"passed\":0", "\"passed\":-1")]
        {
            let broken = whole.replace(from, to);
            assert!(broken != whole && read(&broken).is_err(), "{broken}");
        }
        assert!(read(&whole[..whole.len() - 1]).is_err());
    }

    #[test]
    fn a_step_without_a_result_is_noticed() {
        let steps: Vec<&Step> = STEPS.iter().filter(|step| ["images", "pico"].contains(&step.name)).collect();
        let both = vec![row("pico", Outcome::NotRun), row("images", Outcome::NotRun)];
        let ordered = in_order(both, &steps).unwrap();
        assert_eq!(ordered.iter().map(|row| row.name).collect::<Vec<_>>(), ["images", "pico"]);
        assert!(in_order(vec![row("pico", Outcome::NotRun)], &steps).is_err());
        let twice = vec![row("pico", Outcome::NotRun), row("pico", Outcome::NotRun)];
        assert!(in_order(twice, &steps).is_err());
    }

    #[test]
    fn every_step_beside_the_others_is_a_step() {
        assert!(BESIDE.iter().all(|name| STEPS.iter().any(|step| step.name == *name)));
    }
}
