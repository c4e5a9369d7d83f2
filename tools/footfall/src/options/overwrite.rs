//! The option that allows a command to replace files.

use clap::Args;

/// Whether files that exist may be replaced.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Args)]
pub struct Overwrite {
    /// Replace files that exist already; without it they are kept, and the command writes nothing
    #[arg(long)]
    pub force: bool,
}

impl Overwrite {
    /// For a file that the same run, or an earlier one of the same batch, has written.
    pub const OWN: Self = Self { force: true };
}
