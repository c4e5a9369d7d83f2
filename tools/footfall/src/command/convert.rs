//! `footfall convert`: any recording as our CSV or as an OpenSim .mot: joint angles in degrees, flexion positive, even steps, gaps and
//! jumps bridged or told.

use clap::Args;
use gait_trace::format::{csv_file, opensim};
use gait_trace::{Rules, condition};
use std::path::PathBuf;

use crate::command::fit::{Reading, raw};
use crate::failure::Failure;

/// Options of `footfall convert`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// A recording: CSV, OpenSim .mot and .sto, C3D, oscilloscope CSV
    #[arg(value_name = "RECORDING")]
    pub recording: PathBuf,
    /// Where it goes: the ending .csv or .mot says as what
    #[arg(short, long, value_name = "FILE")]
    pub out: PathBuf,
    /// How it is read
    #[command(flatten)]
    pub reading: Reading,
}

/// Runs the command.
///
/// # Errors
/// Bad input, an ending that is neither, or the file cannot be written.
pub fn run(options: &Options) -> Result<(), Failure> {
    let ending = options.out.extension().and_then(|ending| ending.to_str()).map(str::to_ascii_lowercase);
    let write = match ending.as_deref() {
        Some("csv") => csv_file::write,
        Some("mot") => opensim::write,
        _ => {
            return Err(Failure::input(format!("{}: allowed are the endings .csv and .mot", options.out.display())));
        }
    };
    let raw = raw(&options.recording, &options.reading, None)?;
    let rules = Rules { low_pass: options.reading.low_pass_or_customary(), ..Rules::default() };
    let conditioned = condition(&raw, &rules).map_err(Failure::input)?;
    for told in raw.notes.iter().map(ToString::to_string).chain(conditioned.findings.iter().map(ToString::to_string)) {
        eprintln!("note: {told}");
    }
    write(&options.out, &conditioned.recording)
        .map_err(|error| Failure::run(format!("{}: cannot be written: {error}", options.out.display())))
}
