//! `footfall fit`: one recording with certificate and report, and folders of many.

use crate::child::{self, Used};
use crate::extent::Extent;
use crate::peers::{InTurns, Other};
use crate::recordings;
use crate::times::{median, rounded};
use anyhow::{Context, Result};
use serde_json::{Value, json};
use std::io::BufWriter;
use std::path::Path;
use std::process::Command;

/// Rows of a recording a second.
const RATE_HZ: f64 = 100.0;
/// Seconds of the recording that is fitted alone.
const ALONE_S: f64 = 50.0;
/// Seconds of each of many.
const EACH_S: f64 = 20.0;

fn write(path: &Path, seconds: f64, person: usize) -> Result<()> {
    let file = std::fs::File::create(path).with_context(|| format!("writing {}", path.display()))?;
    recordings::csv_of(&mut BufWriter::new(file), (seconds * RATE_HZ) as usize, RATE_HZ, person)
        .with_context(|| format!("writing {}", path.display()))
}

fn numbers(runs: &[Used]) -> Value {
    json!({
        "seconds": rounded(median(runs.iter().map(|used| used.seconds))),
        "processor_s": rounded(median(runs.iter().map(|used| used.processor_s))),
        "peak_bytes": runs.iter().map(|used| used.peak_bytes).max(),
    })
}

/// One recording, with and without a report.
pub(crate) fn one(footfall: &Path, folder: &Path, extent: Extent) -> Result<Value> {
    let recording = folder.join("alone.csv");
    write(&recording, ALONE_S, 0)?;
    let (generator, report) = (folder.join("alone.toml"), folder.join("alone.html"));
    let (mut without, mut with, mut turns) = (Vec::new(), Vec::new(), InTurns::default());
    for _ in 0..extent.runs {
        let fit = || {
            let mut command = Command::new(footfall);
            command.arg("fit").arg(&recording).arg("--out").arg(&generator).arg("--force");
            command
        };
        without.push(child::run(&mut fit())?);
        let used = child::run(fit().arg("--report").arg(&report))?;
        turns.add(used.seconds, (ALONE_S * RATE_HZ) as u64, || Other::run(&["fit"], &recording));
        with.push(used);
    }
    let page = std::fs::metadata(&report).with_context(|| format!("reading {}", report.display()))?.len();
    Ok(json!({
        "recording_s": ALONE_S, "without_report": numbers(&without), "with_report": numbers(&with), "report_bytes": page,
        "other": turns.result(),
    }))
}

/// Folders of more and more recordings, each fitted once from nothing.
pub(crate) fn many(footfall: &Path, folder: &Path, extent: Extent) -> Result<Value> {
    let all = folder.join("many");
    let out = folder.join("many-fits");
    let clear = |folder: &Path| match std::fs::remove_dir_all(folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    };
    clear(&all).with_context(|| format!("removing {}", all.display()))?;
    std::fs::create_dir_all(&all).with_context(|| format!("making {}", all.display()))?;
    let mut written = 0;
    let mut rows = Vec::new();
    for &count in extent.recordings {
        for person in written..count {
            write(&all.join(format!("person-{person:04}.csv")), EACH_S, person)?;
        }
        written = count;
        clear(&out).with_context(|| format!("removing {}", out.display()))?;
        eprintln!("bench: {count} recordings");
        let used = child::run(Command::new(footfall).arg("fit").arg(&all).arg("--out").arg(&out))?;
        let mut row = numbers(std::slice::from_ref(&used));
        row["recordings"] = count.into();
        rows.push(row);
    }
    clear(&all).and_then(|()| clear(&out)).context("removing the recordings")?;
    Ok(json!({ "recording_s": EACH_S, "counts": rows }))
}
