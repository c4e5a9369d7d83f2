//! The readers of recordings: megabytes a second and peak memory of a process that reads one file, over the size of the file.

use crate::child::{self, Used};
use crate::extent::Extent;
use crate::peers::{InTurns, Other};
use crate::recordings::Format;
use crate::times::{median, rounded};
use anyhow::{Context, Result};
use gait_trace::ReadOptions;
use gait_trace::format::open;
use hgod_adc::{Calibration, CalibrationPoint, Interpolation};
use joint_units::{Radians, Volts};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

/// What a child process reads.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct Options {
    /// The recording
    file: PathBuf,
    /// Its channel CH1 has the volts of a goniometer on the left knee
    #[arg(long)]
    volts: bool,
}

/// A file to be written.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct File {
    format: Format,
    /// The file
    file: PathBuf,
    /// About how many bytes it has
    bytes: u64,
}

impl File {
    /// Writes it.
    pub(crate) fn write(&self) -> Result<()> {
        self.format.write(&self.file, self.bytes)
    }
}

/// Parts of the largest file, by which the others are smaller.
const PARTS: [u64; 4] = [8, 4, 2, 1];

/// Reads a file and prints how long that took.
pub(crate) fn read(options: &Options) -> Result<()> {
    let began = Instant::now();
    let rows = rows_of(options)?;
    println!("{}", json!({ "seconds": began.elapsed().as_secs_f64(), "rows": rows }));
    Ok(())
}

fn rows_of(options: &Options) -> Result<usize> {
    let point = |volts, degrees| CalibrationPoint { volts: Volts(volts), angle: Radians::from_degrees(degrees) };
    let calibration = Calibration::new(&[point(0.0, -25.0), point(3.0, 125.0)], Interpolation::Linear)
        .map_err(|error| anyhow::anyhow!("the calibration: {error:?}"))?;
    let mut how = ReadOptions::default();
    if options.volts {
        how.calibration = Some(&calibration);
        how.add_map("left_knee=CH1")?;
    }
    Ok(open::read(&options.file, &how)?.time_s.len())
}

/// The same in this process, whose memory says nothing.
#[cfg(test)]
pub(crate) fn once(options: &Options) -> Result<Used> {
    let began = Instant::now();
    let rows = rows_of(options)?;
    let seconds = began.elapsed().as_secs_f64();
    let output = json!({ "seconds": seconds, "rows": rows }).to_string();
    Ok(Used { seconds, processor_s: seconds, peak_bytes: 0, output })
}

/// Every format in sizes that double.
pub(crate) fn measure(folder: &Path, extent: Extent) -> Result<Value> {
    let program = std::env::current_exe().context("the name of this program")?;
    // By a child, because some are made in memory: the peak of a process counts from the size of the one that starts it.
    let write = |file: &File| {
        let mut command = Command::new(&program);
        command.arg("write").arg(file.format.argument()).arg(&file.file).arg(file.bytes.to_string());
        child::run(&mut command).map(|_| ())
    };
    let one = |options: &Options| {
        let mut command = Command::new(&program);
        command.arg("read").arg(&options.file);
        if options.volts {
            command.arg("--volts");
        }
        child::run(&mut command)
    };
    within(folder, extent, &write, &one, &|format: Format, file: &Path| Other::run(&["read", &format.argument()], file))
}

/// The same, with files written by `write` and read by `one`, the largest in turn with `other`.
pub(crate) fn within(
    folder: &Path,
    extent: Extent,
    write: &dyn Fn(&File) -> Result<()>,
    one: &dyn Fn(&Options) -> Result<Used>,
    other: &dyn Fn(Format, &Path) -> Result<Other, String>,
) -> Result<Value> {
    let mut formats = Vec::new();
    for format in Format::ALL {
        let largest = if format == Format::Scope { extent.largest_scope } else { extent.largest_file };
        let (mut sizes, mut turns) = (Vec::new(), InTurns::default());
        for part in PARTS {
            let file = folder.join(format!("reader.{}", format.extension()));
            write(&File { format, file: file.clone(), bytes: largest / part })?;
            let bytes = std::fs::metadata(&file).with_context(|| format!("reading {}", file.display()))?.len();
            let options = Options { file: file.clone(), volts: format == Format::Scope };
            let (mut runs, mut own) = (Vec::new(), Vec::new());
            for _ in 0..extent.runs {
                let used = one(&options)?;
                let result: Value = serde_json::from_str(&used.output).context("reading a child")?;
                if part == 1 {
                    let number = |key: &str| result[key].as_f64().with_context(|| format!("a child without `{key}`"));
                    turns.add(number("seconds")?, number("rows")? as u64, || other(format, &file));
                }
                runs.push(used);
                own.push(result);
            }
            let seconds = median(own.iter().filter_map(|own| own["seconds"].as_f64()));
            sizes.push(json!({
                "bytes": bytes,
                "rows": own[0]["rows"],
                "seconds": rounded(seconds),
                "mb_per_s": rounded(bytes as f64 / 1e6 / seconds),
                "processor_mb_per_s": rounded(bytes as f64 / 1e6 / median(runs.iter().map(|used| used.processor_s))),
                "peak_bytes": runs.iter().map(|used| used.peak_bytes).max(),
            }));
            std::fs::remove_file(&file).with_context(|| format!("removing {}", file.display()))?;
        }
        formats.push(json!({ "format": format.name(), "sizes": sizes, "other": turns.result() }));
    }
    Ok(Value::Array(formats))
}
