//! `cargo xtask pico`: builds the image for the Raspberry Pi Pico as a UF2 file, with the parameter records in it, and copies it to the drive that
//! the Pico shows while its BOOTSEL button is held at power-on. No probe and no other program is needed.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, anyhow, ensure};

use crate::board::Drive;
use crate::image::{self, Part};
use crate::missing_requirement::MissingRequirement;
use crate::probe::{SECTOR_BYTES, Sector};
use crate::progress::{self, Build};
use crate::record;
use crate::setup::Need;
use crate::toolchain::SMALLEST_TARGET;
use crate::uf2;
use crate::workspace::Workspace;

/// First addresses of the sectors, as `firmware-rp2040/src/board.rs` has them; a test compares the two.
const GENERATOR_SECTOR: u32 = 0x1010_0000;
const SENSORS_SECTOR: u32 = 0x1010_4000;
const ROBOT_SECTOR: u32 = 0x1010_8000;

/// What the drive of the boot loader has, and no other drive.
const INFO_FILE: &str = "INFO_UF2.TXT";

/// Options of `cargo xtask pico`.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Put a generator's parameters into the image; a follower is refused by the board [default: erase them; the board runs the built-in walk]
    #[arg(long, value_name = "TOML")]
    generator: Option<PathBuf>,
    /// Put the sensors into the image: for each its joint and its calibration, from channel 1 on, up to three [default: erase them; the
    /// board has one sensor with the published curve]
    #[arg(long, value_name = "JOINT[=TOML]")]
    sensor: Vec<String>,
    /// Put the robot into the image: servos, limits, park pose [default: the default robot]
    #[arg(long, value_name = "TOML")]
    robot: Option<PathBuf>,
    /// Leave the records on the board that no option names as they are, whoever's they are
    #[arg(long)]
    keep: bool,
    /// Shadow mode: run everything, drive nothing
    #[arg(long)]
    shadow: bool,
    /// Copy the file to the Pico: the folder of its drive RPI-RP2
    #[arg(long, value_name = "FOLDER")]
    copy: Option<PathBuf>,
}

/// Builds the file, prints where it is, and copies it if asked to.
pub(crate) fn pico(options: &Options) -> Result<ExitCode> {
    let mut workspace = Workspace::open()?;
    let drive = options.copy.as_ref().map(|folder| workspace.started_in.join(folder));
    if let Some(folder) = &drive {
        require_drive(folder)?;
    }
    ensure!(options.sensor.len() <= 3, "{} sensors; the Pico has inputs for 3", options.sensor.len());
    workspace.set_up(&[Need::BoardCompiler])?;
    let elf = build(&workspace, Drive::unless(options.shadow))?;
    let mut parts = program(&elf)?;
    parts.extend(records(&workspace, options)?);
    let file = elf.with_extension("uf2");
    write(&file, &uf2::blocks(&parts))?;
    println!("{}", file.display());
    match drive {
        Some(folder) => {
            let to = folder.join("footfall.uf2");
            std::fs::copy(&file, &to).with_context(|| format!("copying the image to {}", to.display()))?;
            eprintln!("copied to {}: the Pico restarts with it", to.display());
        }
        None => eprintln!(
            "next: hold BOOTSEL while you plug the Pico in, then copy this file to its drive RPI-RP2, or give --copy FOLDER"
        ),
    }
    Ok(ExitCode::SUCCESS)
}

/// Builds the program, checks it, and copies its ELF file under a name of its own.
pub(crate) fn build(workspace: &Workspace, drive: Drive) -> Result<PathBuf> {
    workspace.toolchain()?.ready_for(SMALLEST_TARGET)?;
    let (name, options): (_, &[&str]) = match drive {
        Drive::Servos => ("firmware-pico", &[]),
        Drive::Nothing => ("firmware-pico-shadow", &["--features", "shadow"]),
    };
    eprintln!("build: {name}");
    let cargo = workspace.smallest_build("firmware-rp2040", options)?;
    let built =
        progress::build(vec![Build { label: "firmware for the Pico", cargo, executables: &["firmware-rp2040"] }])?;
    let built = built.into_iter().flatten().next().context("the build made no program")?;
    let elf = read(&built)?;
    let wrong = |wrong: &'static str| anyhow!("{}: {wrong}", built.display());
    // Half of a tick would be gone with a few of them.
    let double = image::double_precision(&elf).map_err(wrong)?;
    ensure!(double.is_empty(), "{} computes in double precision: {double:?}", built.display());
    let footprint = image::footprint(&elf).map_err(wrong)?;
    let images = workspace.target_dir.join("images");
    std::fs::create_dir_all(&images).with_context(|| format!("making {}", images.display()))?;
    let copy = images.join(name).with_extension("elf");
    write(&copy, &elf)?;
    eprintln!("image: {}, {footprint}", copy.display());
    Ok(copy)
}

/// The UF2 file of an image with the default robot and nothing else, for the tests.
pub(crate) fn with_default_robot(workspace: &Workspace, elf: &Path) -> Result<PathBuf> {
    let mut parts = program(elf)?;
    parts.extend(records(
        workspace,
        &Options { generator: None, sensor: Vec::new(), robot: None, keep: false, shadow: false, copy: None },
    )?);
    let file = elf.with_extension("uf2");
    write(&file, &uf2::blocks(&parts))?;
    Ok(file)
}

/// What the program has in flash.
fn program(elf: &Path) -> Result<Vec<Part>> {
    image::loaded(&read(elf)?).map_err(|wrong| anyhow!("{}: {wrong}", elf.display()))
}

/// The sectors of the records. A sector without an option is erased, so that nothing of an earlier person stays on a board, unless it is asked for.
fn records(workspace: &Workspace, options: &Options) -> Result<Vec<Part>> {
    let generator = options.generator.as_ref().map(|file| vec![file.into()]);
    let sensors: Vec<OsString> = options.sensor.iter().flat_map(|sensor| ["--sensor".into(), sensor.into()]).collect();
    let robot = options.robot.as_ref().map(|file| vec!["--robot".into(), file.into()]);
    let mut parts = Vec::new();
    for (sector, address, given) in [
        (Sector::Generator, GENERATOR_SECTOR, generator),
        (Sector::Sensors, SENSORS_SECTOR, (!sensors.is_empty()).then_some(sensors)),
        (Sector::Robot, ROBOT_SECTOR, robot),
    ] {
        let name = sector.name();
        let file = workspace.target_dir.join("images").join(format!("pico-{name}.bin"));
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

fn require_drive(folder: &Path) -> Result<()> {
    if folder.join(INFO_FILE).is_file() {
        return Ok(());
    }
    Err(MissingRequirement(format!(
        "{} is not the drive of a Pico's boot loader: it has no {INFO_FILE}. Hold BOOTSEL while you plug the Pico in, and name the \
         folder of the drive RPI-RP2",
        folder.display()
    ))
    .into())
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

    #[test]
    fn only_the_drive_of_a_boot_loader_is_written() {
        let folder = std::env::temp_dir().join(format!("footfall-pico-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let words = require_drive(&folder).unwrap_err().to_string();
        assert!(words.contains("BOOTSEL") && words.contains(INFO_FILE), "{words}");
        std::fs::write(folder.join(INFO_FILE), "UF2 Bootloader v3.0\n").unwrap();
        require_drive(&folder).unwrap();
        std::fs::remove_dir_all(&folder).unwrap();
    }

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
