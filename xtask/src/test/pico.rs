//! The step that runs the Pico's image on rp2040js, an emulator that this project did not write.

use std::ffi::OsStr;
use std::path::Path;

use anyhow::{Result, ensure};

use super::state::{CannotRun, State, passed, tests};
use crate::board::Drive;
use crate::pico;
use crate::setup::Need;
use crate::shell;

/// The emulator: a script of ours, and its packages by name and version.
const EMULATOR: &str = "firmware-rp2040/emulator";

/// Installs the emulator, checks its patches, builds the image and runs its tests.
pub(super) fn on_the_emulator(state: &State) -> Result<String> {
    let mut install = shell::command("npm");
    install.args(["ci", "--no-audit", "--no-fund"]).current_dir(EMULATOR);
    match shell::must_succeed(&mut install, "npm ci") {
        // A machine without a network has no packages.
        Err(error) if !state.required.contains(Need::Node) => return Err(CannotRun(format!("{error:#}")).into()),
        installed => installed?,
    }
    ensure!(Path::new(EMULATOR).join("node_modules").is_dir(), "npm ci installed nothing in {EMULATOR}");
    let mut patches = shell::command("node");
    shell::must_succeed(patches.arg("--test").current_dir(EMULATOR), "the checks of the emulator's patches")?;
    let elf = pico::build(&state.workspace, Drive::Servos)?;
    let uf2 = pico::with_default_robot(&state.workspace, &elf)?;
    let variables: [(&str, &OsStr); 2] =
        [("FOOTFALL_PICO_ELF", elf.as_os_str()), ("FOOTFALL_PICO_UF2", uf2.as_os_str())];
    passed(state, tests(state, &["--test", "pico"], &variables)?)
}
