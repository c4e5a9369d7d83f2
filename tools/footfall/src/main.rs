//! The program `footfall`. Its code is in the library, so that tests can call it.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(footfall::cli::main(std::env::args_os()))
}
