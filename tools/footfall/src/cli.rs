//! The command line: lists the commands and gives the exit code.

use crate::command::{
    calibrate, certify, check, convert, defaults, entrain, figures, fit, gait_error, hexapod, merge, obb, pack, record,
    sync, volts, walk, watch,
};
use crate::failure::Failure;
use crate::interrupt;
use clap::{Parser, Subcommand};
use std::ffi::OsString;

/// Footfall: a recorded or measured gait in, the angles of four joints out.
///
/// The gait sensor is an HGOD: a potentiometer goniometer, the joint-angle sensor of the thesis.
#[derive(Debug, Parser)]
#[command(
    name = "footfall",
    version,
    after_help = "Exit codes: 0 success; 1 the run failed or its result is not sound; 2 wrong input, nothing was written."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run the firmware image on the virtual board, fed with a recorded gait, and show the run
    Watch(Box<watch::Options>),
    /// Record every tick of a board as CSV or MCAP: the virtual board, or a real board through RTT
    Record(Box<record::Options>),
    /// Convert a recorded gait to the semi-synthetic volts of a sensor: CSV with the header time_s,PA1
    Volts(volts::Options),
    /// Check files: each error names file, line, field and what is allowed
    Check(Box<check::Options>),
    /// Show a default gait on the host core, with changes during the run: live on a terminal, else CSV, JSON or a picture
    Walk(walk::Options),
    /// Print the firing word of an oscillatory building block, one letter a step: F flexor, E extensor
    Obb(obb::Options),
    /// Draw the figures of the two papers, computed by the core
    Figures(figures::Options),
    /// Print the difference between each generator and the mean stride of a healthy adult
    GaitError(gait_error::Options),
    /// Print which legs of the hexapod swing at each step, or the angles of its legs
    Hexapod(hexapod::Options),
    /// Measure a generator and write its certificate; refuse it if perturbed starts diverge or do not return
    Certify(certify::Options),
    /// Fit a generator to a recorded gait: parameters, a report, and the error on strides that were not fitted
    Fit(Box<fit::Options>),
    /// Write any recording as CSV or as OpenSim .mot: degrees, flexion positive, equal time steps
    Convert(convert::Options),
    /// Write one summary of all fits in a folder, wherever they were computed
    Merge(merge::Options),
    /// Let the host core follow one sensor of a recorded person with four joints, and report how well it does
    Entrain(Box<entrain::Options>),
    /// Make the calibration of a sensor from known angles and the sensor's readings there
    Calibrate(Box<calibrate::Options>),
    /// Fit another recorder's clock to the board's, from the edges of the synchronisation output or of a line that both recorded
    Sync(sync::Options),
    /// Convert a generator file or sensor files to a flash record of the board, or a generator file to a Rust constant
    Pack(pack::Options),
    /// Print a file with the default values, as a template
    Defaults(defaults::Options),
}

/// Parses the arguments (the first is the program's name), runs the command, prints its error, and returns the exit code.
pub fn main(arguments: impl Iterator<Item = OsString>) -> u8 {
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(usage) => {
            // There is no other place to report that standard error is closed.
            let _ = usage.print();
            return if usage.use_stderr() { 2 } else { 0 };
        }
    };
    match execute(cli) {
        Ok(()) => 0,
        Err(failure) => {
            for line in failure.to_string().lines() {
                eprintln!("error: {line}");
            }
            failure.exit_code()
        }
    }
}

/// Parses the arguments (the first is the program's name) and runs the command, without printing its error.
///
/// # Errors
/// Wrong arguments are wrong input; otherwise the failure of the command.
pub fn call(arguments: impl Iterator<Item = OsString>) -> Result<(), Failure> {
    execute(Cli::try_parse_from(arguments).map_err(Failure::input)?)
}

fn execute(cli: Cli) -> Result<(), Failure> {
    match cli.command {
        Command::Watch(options) => watch::run(*options, &*interrupt::flag()?),
        Command::Record(options) => record::run(*options, &*interrupt::flag()?),
        Command::Volts(options) => volts::run(&options),
        Command::Entrain(options) => entrain::run(*options),
        Command::Sync(options) => sync::run(&options),
        Command::Check(options) => check::run(*options),
        Command::Walk(options) => walk::run(options),
        Command::Figures(options) => figures::run(&options),
        Command::GaitError(options) => gait_error::run(&options),
        Command::Obb(options) => obb::run(&options),
        Command::Hexapod(options) => hexapod::run(&options),
        Command::Certify(options) => certify::run(&options),
        Command::Fit(options) => fit::run(*options),
        Command::Convert(options) => convert::run(options),
        Command::Merge(options) => merge::run(&options),
        Command::Calibrate(options) => calibrate::run(*options),
        Command::Pack(options) => pack::run(&options),
        Command::Defaults(options) => defaults::run(&options),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn help_succeeds_and_a_wrong_option_is_wrong_input() {
        let code = |arguments: &[&str]| main(arguments.iter().map(OsString::from));
        assert_eq!(code(&["footfall", "--version"]), 0);
        assert_eq!(code(&["footfall", "watch", "--no-such-option"]), 2);
        assert_eq!(code(&["footfall", "watch", "--elf", "a", "--virtual-board", "b", "--secs", "-1"]), 2);
        assert_eq!(code(&["footfall", "watch", "--elf", "a", "--virtual-board", "b", "--disarm"]), 2);
        assert_eq!(code(&["footfall", "check"]), 2);
    }
}
