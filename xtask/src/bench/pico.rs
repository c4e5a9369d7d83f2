//! `cargo xtask bench pico`: the size of the Pico's image, and where the cycles of a tick go, on rp2040js.

use anyhow::Result;

use crate::board::Variant;
use crate::pico;
use crate::setup::Need;
use crate::shell;
use crate::workspace::Workspace;

/// Builds the image, walks with it on the emulator and prints what the script `profile.mjs` counts. The build prints the size.
pub(super) fn bench() -> Result<()> {
    let mut workspace = Workspace::open()?;
    workspace.set_up(&[Need::BoardCompiler, Need::Node])?;
    pico::install_emulator()?;
    let elf = pico::build(&workspace, Variant::USUAL)?;
    let uf2 = pico::with_default_robot(&workspace, &elf)?;
    let mut profile = shell::command("node");
    profile.arg("profile.mjs").args([&uf2, &elf]).current_dir(pico::EMULATOR);
    print!("{}", shell::stdout_of(&mut profile)?);
    Ok(())
}
