//! The step that runs the Pico's image on rp2040js, an emulator that this project did not write.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use clap::Parser;

use super::state::{CannotRun, State, passed, tests};
use crate::bench;
use crate::board::Variant;
use crate::flash;
use crate::pico;
use crate::setup::Need;
use crate::shell;
use crate::workspace::Workspace;

/// Pairs at random for each routine of floating-point numbers; `float.mjs` takes another number.
const PAIRS: &str = "50000";

/// The page whose first commands are run.
const PAGE: &str = "docs/pico.md";
/// What the drive of the boot ROM says; the test program `pico` reads it from the ROM itself.
const INFO: &str = "UF2 Bootloader v2.0\nModel: Raspberry Pi RP2\nBoard-ID: RPI-RP2\n";
/// What the commands that write to a board begin with.
const FLASH: &str = "cargo xtask flash ";

/// Installs the emulator, checks its patches, builds the images, checks their routines for floating-point numbers, runs their tests, and compares the
/// cycles of a tick with docs/performance.json.
pub(super) fn on_the_emulator(state: &State) -> Result<String> {
    match pico::install_emulator(&state.workspace) {
        // A machine without a network has no packages.
        Err(error) if ![Need::Node, Need::Python].iter().all(|need| state.required.contains(*need)) => {
            return Err(CannotRun(format!("{error:#}")).into());
        }
        installed => installed?,
    }
    let mut patches = shell::command("node");
    shell::must_succeed(patches.arg("--test").current_dir(pico::EMULATOR), "the checks of the emulator's patches")?;
    let elf = pico::build(&state.workspace, Variant::USUAL)?;
    let uf2 = pico::with_default_robot(&state.workspace, &elf)?;
    let mut floats = shell::command("node");
    floats.arg("float.mjs").args([&uf2, &elf]).arg(PAIRS).current_dir(pico::EMULATOR);
    shell::must_succeed(&mut floats, "the check of the image's routines for floating-point numbers")?;
    let first_walk = first_walk(&state.workspace)?;
    let variables: [(&str, &OsStr); 3] = [
        ("FOOTFALL_PICO_ELF", elf.as_os_str()),
        ("FOOTFALL_PICO_UF2", uf2.as_os_str()),
        ("FOOTFALL_PICO_FIRST_WALK", first_walk.as_os_str()),
    ];
    let tests = passed(state, tests(state, &["--test", "pico"], &variables)?)?;
    Ok(format!("{tests}, {}", bench::compare_pico(&uf2, &elf)?))
}

/// Runs the commands of the page's first walk, up to the hands, with a folder that plays the drive. Returns the folder with what they have written
/// to it, `shadow.uf2` and `walk.uf2`, each with the ELF file of its program.
fn first_walk(workspace: &Workspace) -> Result<PathBuf> {
    let page = std::fs::read_to_string(PAGE).with_context(|| format!("reading {PAGE}"))?;
    let folder = workspace.target_dir.join("images/pico-first-walk");
    let drive = folder.join("drive");
    std::fs::create_dir_all(&drive).with_context(|| format!("making {}", drive.display()))?;
    let write =
        |file: &Path, text: &[u8]| std::fs::write(file, text).with_context(|| format!("writing {}", file.display()));
    write(&drive.join("INFO_UF2.TXT"), INFO.as_bytes())?;
    let robot = folder.join("robot.toml");
    // Of the reader's files the page names one.
    let words = |line: &str| -> Vec<String> {
        let name = |word: &str| if word == "robot.toml" { robot.display().to_string() } else { word.to_owned() };
        line.split_whitespace().map(name).collect()
    };
    let mut written = Vec::new();
    for line in commands(&page)? {
        if let Some(arguments) = line.strip_prefix("cargo footfall ") {
            if arguments.starts_with("watch") {
                // The port of a board: the test program `pico` reads it.
                continue;
            }
            let (arguments, output) = arguments.split_once('>').unwrap_or((arguments, ""));
            let said = shell::stdout_of(shell::command(workspace.footfall()?).args(words(arguments)))?;
            if let [file] = &words(output)[..] {
                write(Path::new(file), said.as_bytes())?;
            }
        } else if line.starts_with(FLASH) {
            let drive_option = ["--drive".to_owned(), drive.display().to_string()];
            let parsed = Flash::try_parse_from(words(line).into_iter().skip(2).chain(drive_option))
                .with_context(|| format!("{PAGE}: {line}"))?;
            flash::flash(&parsed.options).with_context(|| format!("{PAGE}: {line}"))?;
            let is_shadow = line.contains("--shadow");
            let name = if is_shadow { "shadow" } else { "walk" };
            let elf = if is_shadow { "firmware-pico-shadow-no-sensor.elf" } else { "firmware-pico-no-sensor.elf" };
            let uf2 = drive.join("footfall.uf2");
            for (from, to) in [(uf2, "uf2"), (workspace.target_dir.join("images").join(elf), "elf")] {
                let to = folder.join(name).with_extension(to);
                std::fs::copy(&from, &to).with_context(|| format!("copying {} to {}", from.display(), to.display()))?;
            }
            written.push(name);
        } else {
            bail!("{PAGE}: no test runs `{line}`");
        }
    }
    ensure!(written == ["shadow", "walk"], "{PAGE}: the commands have written {written:?}");
    Ok(folder)
}

/// The command lines of the page's first section.
fn commands(page: &str) -> Result<Vec<&str>> {
    let section = page.split("\n## ").find(|section| section.starts_with("The first walk\n"));
    let section = section.with_context(|| format!("{PAGE} has no section `The first walk`"))?;
    let blocks = section.split("```").skip(1).step_by(2).filter_map(|block| block.strip_prefix("sh\n"));
    let lines = blocks.flat_map(str::lines).map(|line| line.split(" #").next().unwrap_or(line).trim());
    Ok(lines.filter(|line| !line.is_empty()).collect())
}

/// `cargo xtask flash`, as the command line has it.
#[derive(clap::Parser)]
struct Flash {
    #[command(flatten)]
    options: flash::Options,
}
