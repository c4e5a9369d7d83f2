//! What every piece of a soak is run with.

use std::path::PathBuf;
use std::process::Command;

use crate::campaign;
use crate::probe::Sector;
use crate::shell;

/// What every piece is run with.
#[derive(Debug)]
pub(super) struct Bench {
    pub(super) virtual_board: PathBuf,
    pub(super) footfall: PathBuf,
    pub(super) elf: PathBuf,
    pub(super) robot: PathBuf,
}

impl Bench {
    /// A command with the options of the virtual board that every piece has.
    pub(super) fn board_command(&self, secs: f64) -> Command {
        let mut command = shell::command(&self.virtual_board);
        command.arg(&self.elf).args(["--emergency-stop", "0.05:0.05", "--loop", "--volts", campaign::VOLTS]);
        command.arg("--flash").arg(format!("{:#010x}={}", Sector::Robot.address(), self.robot.display()));
        command.args(["--secs", &secs.to_string()]);
        command
    }
}
