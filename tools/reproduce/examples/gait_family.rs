//! Fits the gaits of `cpg_core::gait::family` to recordings and judges them on recordings that were not fitted.
//!
//! `cargo run -p reproduce --example gait_family` prints the errors; with `-- --write` it also writes the numbers into `cpg-core`. The recordings are read from the folder that `FOOTFALL_TRACES` names.

use std::path::Path;
use std::process::ExitCode;

use reproduce::gait_family::page::{numbers, tables};
use reproduce::gait_family::study::study;
use test_suite::traces_folder;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("{why}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), String> {
    let options: Vec<String> = std::env::args().skip(1).collect();
    let write = options.first().is_some_and(|option| option == "--write");
    if options.len() > usize::from(write) {
        return Err(format!("{options:?}: allowed is --write, or nothing"));
    }
    let study = study(&traces_folder())?;
    print!("{}", tables(&study));
    if write {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cpg-core/src/gait/family/numbers.rs");
        std::fs::write(&path, numbers(&study)).map_err(|error| format!("{}: {error}", path.display()))?;
        eprintln!("wrote {}", path.display());
    }
    Ok(())
}
