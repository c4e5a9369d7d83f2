//! `footfall convert`: writes any recording as CSV or as OpenSim .mot: joint angles in degrees, flexion positive, equal time steps; gaps
//! and jumps are bridged or reported.

use clap::Args;
use gait_trace::format::{csv_file, opensim};
use gait_trace::{LowPass, condition};
use std::path::PathBuf;

use crate::failure::Failure;
use crate::file::recording;
use crate::options::reading::Reading;
use crate::output;

/// Options of `footfall convert`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// A recording: CSV, OpenSim .mot and .sto, C3D, oscilloscope CSV
    #[arg(value_name = "RECORDING")]
    pub recording: PathBuf,
    /// The file to write; its extension, .csv or .mot, gives the format
    #[arg(short, long, value_name = "FILE")]
    pub out: PathBuf,
    /// How it is read
    #[command(flatten)]
    pub reading: Reading,
}

/// Runs the command.
///
/// # Errors
/// Wrong input, another extension, or a file that cannot be written.
pub fn run(options: Options) -> Result<(), Failure> {
    let Options { recording, out, reading } = options;
    let extension = out.extension().and_then(|extension| extension.to_str()).map(str::to_ascii_lowercase);
    let write = match extension.as_deref() {
        Some("csv") => csv_file::write,
        Some("mot") => opensim::write,
        _ => return Err(Failure::input(format!("{}: allowed are the extensions .csv and .mot", out.display()))),
    };
    let reading = reading.settings(LowPass::Customary)?;
    let raw = recording::read(&recording, &reading)?;
    let conditioned = condition(&raw, &reading.rules()).map_err(Failure::input)?;
    output::notes(&raw.notes);
    output::notes(&conditioned.findings);
    write(&out, &conditioned.recording).map_err(|error| output::cannot_write(&out, error))
}
