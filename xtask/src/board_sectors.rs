//! `cargo xtask board`: shows, saves and erases the parameter records of a connected board.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::{Args, Subcommand};

use crate::board::Board;
use crate::probe::{self, Sector};
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
    /// Erase parameter sectors; the program stays
    Erase {
        #[command(flatten)]
        connected: Connected,
        #[command(flatten)]
        chosen: Chosen,
    },
}

#[derive(Debug, Args)]
pub(crate) struct Connected {
    /// The board that is connected
    #[arg(long, value_enum, default_value_t)]
    board: Board,
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
    /// The robot's: the board then gives no pulse
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
        Action::Read { connected, out, force } => save(connected.board, out, *force),
        Action::Erase { connected, chosen } => erase(connected.board, chosen),
    }
}

/// `footfall check` knows the records. The exit code is its own: 2 where a sector is damaged.
fn info(board: Board) -> Result<ExitCode> {
    let workspace = Workspace::open()?;
    let folder = workspace.target_dir.join("board");
    std::fs::create_dir_all(&folder).with_context(|| format!("making {}", folder.display()))?;
    let mut check = shell::command(workspace.footfall()?);
    check.current_dir(&folder).arg("check");
    for sector in Sector::ALL {
        let file = format!("{}.bin", sector.name());
        let path = folder.join(&file);
        std::fs::write(&path, probe::read(board, sector)?).with_context(|| format!("writing {}", path.display()))?;
        check.args(["--record", &file]);
    }
    let status = check.status().context("starting footfall check")?;
    Ok(status.code().and_then(|code| u8::try_from(code).ok()).map_or(ExitCode::FAILURE, ExitCode::from))
}

fn save(board: Board, folder: &PathBuf, force: bool) -> Result<ExitCode> {
    let paths = Sector::ALL.map(|sector| folder.join(sector.name()).with_extension("bin"));
    if let Some(path) = paths.iter().find(|path| !force && path.exists()) {
        bail!("{} exists; choose another folder, or --force", path.display());
    }
    // All are read before one is written.
    let contents = Sector::ALL.iter().map(|sector| probe::read(board, *sector)).collect::<Result<Vec<_>>>()?;
    std::fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))?;
    for (path, content) in paths.iter().zip(contents) {
        std::fs::write(path, content).with_context(|| format!("writing {}", path.display()))?;
        eprintln!("written: {}", path.display());
    }
    eprintln!("next: see what it holds: cargo footfall check --record {}", paths[0].display());
    Ok(ExitCode::SUCCESS)
}

fn erase(board: Board, chosen: &Chosen) -> Result<ExitCode> {
    let workspace = Workspace::open()?;
    let folder = workspace.target_dir.join("board");
    std::fs::create_dir_all(&folder).with_context(|| format!("making {}", folder.display()))?;
    for sector in Sector::ALL.into_iter().filter(|sector| chosen.has(*sector)) {
        probe::erase(board, sector, &folder.join("erased.bin"))?;
        eprintln!("{} sector: erased; {}", sector.name(), sector.when_erased());
    }
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
