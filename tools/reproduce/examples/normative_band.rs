//! Computes the normative band of the reports from recordings.
//!
//! `cargo run -p reproduce --example normative_band` prints the numbers; with `-- --write` it writes them into `gait-fit`. The recordings are
//! read from the folder that `FOOTFALL_TRACES` names.

use std::path::Path;
use std::process::ExitCode;

use reproduce::normative_band::{numbers, study};
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
    let write = options == ["--write"];
    if !options.is_empty() && !write {
        return Err(format!("{options:?}: allowed is --write, or nothing"));
    }
    let text = numbers(&study(&traces_folder())?);
    if write {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../gait-fit/src/normative/numbers.rs");
        std::fs::write(&path, text).map_err(|error| format!("{}: {error}", path.display()))?;
        eprintln!("wrote {}", path.display());
    } else {
        print!("{text}");
    }
    Ok(())
}
