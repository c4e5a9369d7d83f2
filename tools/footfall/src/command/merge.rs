//! `footfall merge`: writes one summary of all fits in a folder.

use clap::Args;
use std::path::PathBuf;

use crate::failure::Failure;
use crate::file::fit_summary;
use crate::options::overwrite::Overwrite;

/// Options of `footfall merge`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// The folder with the results of `footfall fit`
    #[arg(value_name = "FOLDER")]
    pub folder: PathBuf,
    /// Whether files may be replaced; earlier summaries are replaced anyway
    #[command(flatten)]
    pub overwrite: Overwrite,
}

/// Runs the command.
///
/// # Errors
/// The folder has no results, the summary cannot be written, or it has recordings that failed.
pub fn run(options: &Options) -> Result<(), Failure> {
    match fit_summary::write(&options.folder, options.overwrite)? {
        0 => Ok(()),
        failed => Err(Failure::run(format!("recordings that failed: {failed}; the summary says why of each"))),
    }
}
