//! `cargo xtask board`: shows, reads, erases the parameter records of a connected board, saves what was tuned while it ran, and sets its brown-out reset.
//!
//! Each action refuses a board whose servo outputs are on. It finds out by attaching, which halts the core for some milliseconds: [`crate::probe`].

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail, ensure};
use clap::{Args, Subcommand};

use crate::board::Board;
use crate::option_bytes;
use crate::probe::{self, Sector};
use crate::record;
use crate::shell;
use crate::workspace::Workspace;

#[derive(Debug, Subcommand)]
pub(crate) enum Action {
    /// Print what the parameter sectors hold: names and check sums of the records, erased, or damaged and why
    Info(Connected),
    /// Save the parameter sectors as files: generator.bin, sensors.bin, robot.bin
    Read {
        #[command(flatten)]
        connected: Connected,
        /// The folder to write to
        #[arg(short, long, value_name = "FOLDER")]
        out: PathBuf,
        /// Replace existing files
        #[arg(long)]
        force: bool,
    },
    /// Write what was tuned while the board ran into its generator's record: the settings come from its serial port, the probe writes
    Save(Tuned),
    /// Erase parameter sectors; the program stays
    Erase {
        #[command(flatten)]
        connected: Connected,
        #[command(flatten)]
        chosen: Chosen,
    },
    /// Set the level of the brown-out reset in the chip's option bytes; the board is reset
    BrownOut {
        #[command(flatten)]
        connected: Connected,
        #[command(flatten)]
        options: option_bytes::Options,
    },
}

#[derive(Debug, Args)]
pub(crate) struct Connected {
    /// The board that is connected
    #[arg(long, value_enum, default_value_t)]
    board: Board,
}

#[derive(Debug, Args)]
pub(crate) struct Tuned {
    #[command(flatten)]
    connected: Connected,
    /// The generator file that the board's record was made from
    #[arg(value_name = "TOML")]
    generator: PathBuf,
    /// The board's serial port
    #[arg(long, value_name = "PORT")]
    serial: PathBuf,
    /// The board's robot file [default: the default robot]
    #[arg(long, value_name = "TOML")]
    robot: Option<PathBuf>,
    /// The generator file with the settings
    #[arg(short, long, value_name = "TOML")]
    out: PathBuf,
    /// Replace an existing file
    #[arg(long)]
    force: bool,
}

/// At least one sector.
#[derive(Debug, Args)]
#[group(required = true, multiple = true)]
pub(crate) struct Chosen {
    /// The generator's: the board then runs the built-in walk
    #[arg(long)]
    generator: bool,
    /// The sensors': the board then has one sensor with the published curve
    #[arg(long)]
    sensors: bool,
    /// The robot's: the board then runs the built-in robot, and warns of it
    #[arg(long)]
    robot: bool,
}

impl Chosen {
    fn has(&self, sector: Sector) -> bool {
        match sector {
            Sector::Generator => self.generator,
            Sector::Sensors => self.sensors,
            Sector::Robot => self.robot,
        }
    }
}

pub(crate) fn board(action: &Action) -> Result<ExitCode> {
    probe::require()?;
    match action {
        Action::Info(connected) => info(connected.board),
        Action::Read { connected, out, force } => read(connected.board, out, *force),
        Action::Save(tuned) => save(tuned),
        Action::Erase { connected, chosen } => erase(connected.board, chosen),
        Action::BrownOut { connected: Connected { board }, options } => {
            let folder = Workspace::open()?.target_dir.join("board");
            probe::require_outputs_off(*board, &folder)?;
            option_bytes::set(*board, options, &folder)?;
            Ok(ExitCode::SUCCESS)
        }
    }
}

/// The bytes of the three sectors of a board whose outputs are off.
fn sectors(board: Board, folder: &Path) -> Result<[Vec<u8>; 3]> {
    probe::require_outputs_off(board, folder)?;
    probe::read_sectors(board, folder)
}

/// `footfall check` knows the records. The exit code is its own: 2 where a sector is damaged.
fn info(board: Board) -> Result<ExitCode> {
    let workspace = Workspace::open()?;
    let folder = workspace.target_dir.join("board");
    let mut check = shell::command(workspace.footfall()?);
    check.current_dir(&folder).arg("check");
    for (sector, content) in Sector::ALL.into_iter().zip(sectors(board, &folder)?) {
        let file = format!("{}.bin", sector.name());
        let path = folder.join(&file);
        std::fs::write(&path, content).with_context(|| format!("writing {}", path.display()))?;
        check.args(["--record", &file]);
    }
    let status = check.status().context("starting footfall check")?;
    Ok(status.code().and_then(|code| u8::try_from(code).ok()).map_or(ExitCode::FAILURE, ExitCode::from))
}

fn read(board: Board, out: &Path, force: bool) -> Result<ExitCode> {
    let workspace = Workspace::open()?;
    let out = workspace.started_in.join(out);
    let paths = Sector::ALL.map(|sector| out.join(sector.name()).with_extension("bin"));
    if let Some(path) = paths.iter().find(|path| !force && path.exists()) {
        bail!("{} exists; choose another folder, or --force", path.display());
    }
    // All are read before one is written.
    let contents = sectors(board, &workspace.target_dir.join("board"))?;
    std::fs::create_dir_all(&out).with_context(|| format!("making {}", out.display()))?;
    for (path, content) in paths.iter().zip(contents) {
        std::fs::write(path, content).with_context(|| format!("writing {}", path.display()))?;
        eprintln!("written: {}", path.display());
    }
    eprintln!("next: see what it holds: cargo footfall check --record {}", paths[0].display());
    Ok(ExitCode::SUCCESS)
}

/// The probe writes only after the file is there, passes its certificate, and the board is at rest.
fn save(tuned: &Tuned) -> Result<ExitCode> {
    let Tuned { connected: Connected { board }, generator, serial, robot, out, force } = tuned;
    let workspace = Workspace::open()?;
    let program = workspace.footfall()?;
    let footfall = |command: &str| {
        let mut footfall = shell::command(&program);
        footfall.current_dir(&workspace.started_in).arg(command);
        footfall
    };
    let with_robot = |mut command: std::process::Command| {
        command.args(robot.iter().flat_map(|robot| ["--robot".as_ref(), robot.as_os_str()]));
        command
    };
    let mut saving = with_robot(footfall("save"));
    saving.arg(generator).arg("--serial").arg(serial).arg("--at-rest").arg("--quiet").arg("--out").arg(out);
    saving.args(force.then_some("--force"));
    probe::done(&mut saving, "footfall save")?;
    eprintln!("written: {}", out.display());
    probe::done(with_robot(footfall("certify")).arg(out), "footfall certify")
        .with_context(|| format!("the board is not written, {} is kept", out.display()))?;
    let folder = workspace.target_dir.join("board");
    std::fs::create_dir_all(&folder).with_context(|| format!("making {}", folder.display()))?;
    let packed = folder.join("tuned.bin");
    record::pack(&workspace, &[out.into()], &packed)?;
    probe::require_outputs_off(*board, &folder)?;
    probe::download(*board, Sector::Generator, &packed)?;
    let record = std::fs::read(&packed).with_context(|| format!("reading {}", packed.display()))?;
    let [generator, ..] = probe::read_sectors(*board, &folder)?;
    ensure!(
        generator.starts_with(&record),
        "the generator's sector reads other bytes than were written; run `cargo xtask board info`, then write it again"
    );
    probe::reset(*board)?;
    eprintln!(
        "generator sector: {}, read back; the board was reset and runs it with the default settings",
        out.display()
    );
    Ok(ExitCode::SUCCESS)
}

fn erase(board: Board, chosen: &Chosen) -> Result<ExitCode> {
    let workspace = Workspace::open()?;
    let folder = workspace.target_dir.join("board");
    std::fs::create_dir_all(&folder).with_context(|| format!("making {}", folder.display()))?;
    probe::require_outputs_off(board, &folder)?;
    for sector in Sector::ALL.into_iter().filter(|sector| chosen.has(*sector)) {
        probe::erase(board, sector, &folder.join("erased.bin"))?;
        eprintln!("{} sector: erased; {}", sector.name(), sector.when_erased());
    }
    // A download leaves the core halted.
    probe::reset(board)?;
    Ok(ExitCode::SUCCESS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Parsed {
        #[command(subcommand)]
        action: Action,
    }

    fn erased(words: &str) -> Option<Vec<Sector>> {
        let words = ["board", "erase"].into_iter().chain(words.split_whitespace());
        let Action::Erase { chosen, .. } = Parsed::try_parse_from(words).ok()?.action else { return None };
        Some(Sector::ALL.into_iter().filter(|sector| chosen.has(*sector)).collect())
    }

    /// Without an option nothing is erased by accident.
    #[test]
    fn erase_names_its_sectors() {
        assert_eq!(erased(""), None);
        assert_eq!(erased("--robot"), Some(vec![Sector::Robot]));
        assert_eq!(erased("--sensors --generator"), Some(vec![Sector::Generator, Sector::Sensors]));
    }
}
