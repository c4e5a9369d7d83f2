//! The command line: lists the commands and gives the exit code.

#[cfg(feature = "analysis")]
use crate::command::{
    calibrate, certify, check, convert, defaults, entrain, figures, fit, gait_error, hexapod, merge, obb, pack, smer,
    sync, volts, walk,
};
use crate::command::{record, watch};
use crate::failure::Failure;
use crate::interrupt;
use clap::{Parser, Subcommand};
use std::ffi::OsString;

/// Says that not every command is in this program.
#[cfg(not(feature = "analysis"))]
const BUILT_FOR: &str = "This program was built by `cargo xtask run`, with `watch` and `record` only: `cargo footfall` builds it whole.\n\n";
#[cfg(feature = "analysis")]
const BUILT_FOR: &str = "";
const EXIT_CODES: &str =
    "Exit codes: 0 success; 1 the run failed or its result is not sound; 2 wrong input, nothing was written.";

/// Footfall: a recorded or measured gait in, the angles of four joints out.
///
/// The gait sensor is an HGOD: a potentiometer goniometer, the joint-angle sensor of the thesis.
#[derive(Debug, Parser)]
#[command(
    name = "footfall",
    version,
    after_help = format!("{BUILT_FOR}{EXIT_CODES}")
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
    #[cfg(feature = "analysis")]
    #[command(flatten)]
    Analysis(Analysis),
}

/// The commands that fit, judge, convert and draw.
#[cfg(feature = "analysis")]
#[derive(Debug, Subcommand)]
enum Analysis {
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
    /// Judge a graph of nodes that operate by edge reversal: live or dead, transient, period, operations of each node, concurrency
    Smer(smer::Options),
    /// Measure a generator and write its certificate: does it come back to its orbit, does it walk on the robot
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
    /// Convert a generator file, sensor files or a robot file to a flash record of the board, or a generator file to a Rust constant
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
        #[cfg(feature = "analysis")]
        Command::Analysis(command) => analyse(command),
    }
}

#[cfg(feature = "analysis")]
fn analyse(command: Analysis) -> Result<(), Failure> {
    match command {
        Analysis::Volts(options) => volts::run(&options),
        Analysis::Entrain(options) => entrain::run(*options),
        Analysis::Sync(options) => sync::run(&options),
        Analysis::Check(options) => check::run(*options),
        Analysis::Walk(options) => walk::run(options),
        Analysis::Figures(options) => figures::run(&options),
        Analysis::GaitError(options) => gait_error::run(&options),
        Analysis::Obb(options) => obb::run(&options),
        Analysis::Hexapod(options) => hexapod::run(&options),
        Analysis::Smer(options) => smer::run(&options),
        Analysis::Certify(options) => certify::run(&options),
        Analysis::Fit(options) => fit::run(*options),
        Analysis::Convert(options) => convert::run(options),
        Analysis::Merge(options) => merge::run(&options),
        Analysis::Calibrate(options) => calibrate::run(*options),
        Analysis::Pack(options) => pack::run(&options),
        Analysis::Defaults(options) => defaults::run(&options),
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
