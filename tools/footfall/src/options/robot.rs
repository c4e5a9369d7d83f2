//! The option `--robot`: the robot whose limits, servos and park pose hold.

use std::path::PathBuf;

use clap::Args;
use generator_file::robot_file::RobotFile;

use crate::failure::Failure;

/// The robot of a command.
#[derive(Debug, Clone, Default, Args)]
pub struct RobotArgument {
    /// The robot file [default: the default robot, which `footfall defaults robot` prints]
    #[arg(long, value_name = "TOML")]
    pub robot: Option<PathBuf>,
}

impl RobotArgument {
    /// Reads the file; without one, the default robot.
    ///
    /// # Errors
    /// A file that cannot be read or is wrong.
    pub fn read(&self) -> Result<RobotFile, Failure> {
        RobotFile::read_or_default(self.robot.as_deref()).map_err(Failure::input)
    }
}
