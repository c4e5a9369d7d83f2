//! `footfall defaults`: prints a file with the default values, as a template for a file of one's own.

use clap::{Args, ValueEnum};
use generator_file::file::GeneratorFile;
use generator_file::network_file::NetworkFile;
use generator_file::robot_file::RobotFile;

use crate::board::default_loop;
use crate::failure::Failure;
use crate::file::calibration_file;
use crate::output;

/// Options of `footfall defaults`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// Which file
    #[arg(value_enum)]
    pub file: File,
}

/// The files that have defaults.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum File {
    /// A sensor file: the calibration of the gait sensor
    Sensor,
    /// A robot file: servos, limits, park pose and least supply of the default robot
    Robot,
    /// A generator file: the default walk of the board
    Generator,
    /// A generator file: the thesis' network, Table 1 and set S
    Thesis,
    /// A generator file of hips, knees and ankles, for the host
    SixJoints,
    /// A generator file of hips, knees, ankles and shoulders, for the host
    EightJoints,
}

/// Runs the command.
///
/// # Errors
/// Standard output cannot be written.
pub fn run(options: &Options) -> Result<(), Failure> {
    let text = match options.file {
        File::Sensor => calibration_file::to_text(&default_loop::wired_sensor().map_err(Failure::run)?, None),
        File::Robot => RobotFile::default_biped().to_toml(),
        File::Generator => generator("phase-coupled")?,
        File::Thesis => generator("thesis")?,
        File::SixJoints => network("six-joints")?,
        File::EightJoints => network("eight-joints")?,
    };
    output::print(&text)
}

fn generator(name: &str) -> Result<String, Failure> {
    GeneratorFile::default_of(name).map(|file| file.to_toml()).ok_or_else(|| no_default(name))
}

fn network(name: &str) -> Result<String, Failure> {
    NetworkFile::default_of(name).map(|file| file.to_toml()).ok_or_else(|| no_default(name))
}

fn no_default(name: &str) -> Failure {
    Failure::run(format!("there is no default `{name}`"))
}
