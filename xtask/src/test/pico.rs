//! The step that runs the Pico's image on rp2040js, an emulator that this project did not write.

use std::ffi::OsStr;

use anyhow::Result;

use super::state::{CannotRun, State, passed, tests};
use crate::bench;
use crate::board::Variant;
use crate::pico;
use crate::setup::Need;
use crate::shell;

/// Pairs at random for each routine of floating-point numbers; a longer run is a command of its own (docs/pico.md).
const PAIRS: &str = "50000";

/// Installs the emulator, checks its patches, builds the image, checks its routines for floating-point numbers, runs its tests, and compares the
/// cycles of a tick with docs/performance.json.
pub(super) fn on_the_emulator(state: &State) -> Result<String> {
    match pico::install_emulator() {
        // A machine without a network has no packages.
        Err(error) if !state.required.contains(Need::Node) => return Err(CannotRun(format!("{error:#}")).into()),
        installed => installed?,
    }
    let mut patches = shell::command("node");
    shell::must_succeed(patches.arg("--test").current_dir(pico::EMULATOR), "the checks of the emulator's patches")?;
    let elf = pico::build(&state.workspace, Variant::USUAL)?;
    let uf2 = pico::with_default_robot(&state.workspace, &elf)?;
    let mut floats = shell::command("node");
    floats.arg("float.mjs").args([&uf2, &elf]).arg(PAIRS).current_dir(pico::EMULATOR);
    shell::must_succeed(&mut floats, "the check of the image's routines for floating-point numbers")?;
    let variables: [(&str, &OsStr); 2] =
        [("FOOTFALL_PICO_ELF", elf.as_os_str()), ("FOOTFALL_PICO_UF2", uf2.as_os_str())];
    let tests = passed(state, tests(state, &["--test", "pico"], &variables)?)?;
    Ok(format!("{tests}, {}", bench::compare_pico(&uf2, &elf)?))
}
