//! `footfall trim`: finds the servo map of a joint on the robot itself. The board moves that servo slowly, the user says which angle the joint
//! has, and the map goes into the robot file.

mod board;
mod line;
mod session;
mod solution;

use clap::Args;
use generator_file::robot_file::RobotFile;
use joint_units::Joint;
use std::io::{self, BufReader, IsTerminal};
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use crate::answers::lines;
use crate::failure::Failure;
use crate::messages;
use crate::options::at::At;
use crate::options::overwrite::Overwrite;
use crate::options::value::one_of;
use crate::output;
use board::Board;
use session::Session;

/// Options of `footfall trim`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// The joint whose servo is trimmed
    #[arg(value_name = "JOINT", value_parser = one_of(Joint::ALL, Joint::name))]
    pub joint: Joint,
    /// Where the board is
    #[command(flatten)]
    pub at: At,
    /// The robot file whose record is on the board; `footfall defaults robot` prints that of the default robot
    #[arg(long, value_name = "TOML")]
    pub robot: PathBuf,
    /// Where the robot file with the new servo map is written; with --force it may be the same file. Comments and all else are kept
    #[arg(short, long, value_name = "TOML")]
    pub out: PathBuf,
    /// Whether a file may be replaced
    #[command(flatten)]
    pub overwrite: Overwrite,
}

/// Runs the command. Answers come from standard input, a line each. `interrupt` is set by a signal that asks it to end.
///
/// # Errors
/// Wrong input, a port that cannot be opened or is silent, a board that refuses, or measured points that no servo has.
pub fn run(options: &Options, interrupt: &AtomicBool) -> Result<(), Failure> {
    let Options { joint, at, robot, out, overwrite } = options;
    let read = RobotFile::read(robot).map_err(Failure::input)?;
    let text =
        std::fs::read_to_string(robot).map_err(|error| Failure::input(format!("{}: {error}", robot.display())))?;
    output::check(out, *overwrite)?;
    let board = Board::open(at.origin()?, interrupt)?;
    let (answers, is_script) = (lines(BufReader::new(io::stdin())), !io::stdin().is_terminal());
    let points = Session::new(board, *joint, read.robot, answers, is_script, io::stderr()).run()?;
    let map = solution::solve(&points).map_err(Failure::run)?;
    // The values first: they are not lost if the file is refused.
    output::print(&map.to_string())?;
    let text = map.written_into(&text, *joint).map_err(Failure::run)?;
    RobotFile::parse(&out.display().to_string(), &text).map_err(|error| {
        Failure::run(format!(
            "{error}\nnothing is written: with the servo map above the robot file is not allowed; change what the error names, put the values in by hand"
        ))
    })?;
    output::write_text(out, &text, *overwrite)?;
    messages::written(out);
    messages::next("write it to the board", format_args!("cargo xtask flash --keep --robot {}", out.display()));
    Ok(())
}
