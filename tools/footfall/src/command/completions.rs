//! `footfall completions`: prints the script with which a shell completes the commands and options of `footfall`.

use clap::{Args, Command};
use clap_complete::Shell;

use crate::failure::Failure;
use crate::output;

/// Options of `footfall completions`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// The shell
    #[arg(value_name = "SHELL", value_enum)]
    pub shell: Shell,
}

/// Runs the command; `program` is the whole command line.
///
/// # Errors
/// Standard output cannot be written.
pub fn run(options: &Options, mut program: Command) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(options.shell, &mut program, "footfall", &mut script);
    output::print_bytes(&script)
}
