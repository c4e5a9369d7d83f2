//! `footfall check`: reads files and reports their errors.

use crate::board::feed;
use crate::board::feed::Opened;
use crate::failure::Failure;
use crate::file::{calibration_file, parameter_file};
use clap::Args;
use generator_file::file::GeneratorFile;
use std::path::PathBuf;

/// Options of `footfall check`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// A recording, in any format that `fit` reads
    #[arg(long, value_name = "FILE")]
    pub trace: Vec<PathBuf>,
    /// A sensor file: the calibration of a sensor
    #[arg(long, value_name = "TOML")]
    pub calibration: Vec<PathBuf>,
    /// A parameter file of the control loop
    #[arg(long, value_name = "TOML")]
    pub parameters: Vec<PathBuf>,
    /// A generator file
    #[arg(long, value_name = "TOML")]
    pub generator: Vec<PathBuf>,
}

/// Runs the command: prints one line for each correct file.
///
/// # Errors
/// The errors of all wrong files, one a line.
pub fn run(options: &Options) -> Result<(), Failure> {
    if [&options.trace, &options.calibration, &options.parameters, &options.generator].into_iter().all(Vec::is_empty) {
        return Err(Failure::input(
            "no file named: allowed are --trace, --calibration, --parameters and --generator, each any number of times",
        ));
    }
    let (mut good, mut faults) = (String::new(), Vec::new());
    let mut report = |result: Result<String, String>| match result {
        Ok(line) => good.extend([line.as_str(), "\n"]),
        Err(fault) => faults.push(fault),
    };
    for path in &options.trace {
        report(feed::opened(path).map_err(|error| error.to_string()).map(
            |Opened { recording, format, notes, .. }| {
                for note in &notes {
                    eprintln!("note: {}: {note}", path.display());
                }
                let columns: Vec<String> = recording.channels().iter().map(gait_trace::Channel::column).collect();
                let (rows, seconds) = (recording.time_s().len(), recording.duration_s());
                let format = format.map_or(String::new(), |format| format!("; {format}"));
                format!("{}: good: {rows} rows, {seconds:.3} s, {}{format}", path.display(), columns.join(" "))
            },
        ));
    }
    for path in &options.calibration {
        report(calibration_file::read(path).map_err(|error| error.to_string()).map(|sensor| {
            let (least, most) = sensor.calibration.span();
            let points = sensor.calibration.points().len();
            format!(
                "{}: good: {points} points, {:.1} to {:.1} degrees",
                path.display(),
                least.degrees(),
                most.degrees()
            )
        }));
    }
    for path in &options.parameters {
        report(
            parameter_file::read(path).map_err(|error| error.to_string()).map(|_| format!("{}: good", path.display())),
        );
    }
    for path in &options.generator {
        report(
            GeneratorFile::read(path)
                .map_err(|error| error.to_string())
                .map(|file| format!("{}: good: a {} generator", path.display(), file.set.name())),
        );
    }
    crate::output::print(&good)?;
    if faults.is_empty() { Ok(()) } else { Err(Failure::Input(faults.join("\n"))) }
}
