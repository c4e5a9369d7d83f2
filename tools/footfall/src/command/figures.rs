//! `footfall figures`: draws the figures of the two papers for which no search is needed; `footfall reproduce` does everything.

use clap::Args;
use reproduce::papers::figures;
use std::path::PathBuf;

use crate::failure::Failure;
use crate::options::overwrite::Overwrite;
use crate::output;

/// Options of `footfall figures`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// The folder to write to; made if it is not there
    #[arg(short, long, value_name = "DIR")]
    pub out: PathBuf,
    /// Whether files may be replaced
    #[command(flatten)]
    pub overwrite: Overwrite,
}

/// Runs the command.
///
/// # Errors
/// A file exists and may not be replaced, or it cannot be written.
pub fn run(options: &Options) -> Result<(), Failure> {
    let figures = figures().map_err(Failure::run)?;
    let pictures =
        figures.iter().map(|figure| Ok((format!("{}.svg", figure.name), figure.svg("footfall figures -o DIR")?)));
    let pictures: Vec<(String, String)> = pictures.collect::<Result<_, String>>().map_err(Failure::run)?;
    let written = output::write_all(&options.out, &pictures, options.overwrite)?;
    // These are the data of the command.
    output::print(&written.iter().map(|path| format!("{}\n", path.display())).collect::<String>())
}
