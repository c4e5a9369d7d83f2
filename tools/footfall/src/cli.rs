//! The command line: what there is to call, and how a call ends.

use crate::board::default_loop;
use crate::command::{calibrate, check, convert, entrain, fit, pack, record, sync, volts, watch};
use crate::command::{certify, figures, gait_error, hexapod, obb, walk};
use crate::failure::Failure;
use crate::file::{calibration_file, parameter_file};
use clap::{Parser, Subcommand, ValueEnum};
use generator_file::file::GeneratorFile;
use joint_loop::LoopConfig;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use std::ffi::OsString;
use std::io::{self, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Footfall: gait in, four joints out.
#[derive(Debug, Parser)]
#[command(
    name = "footfall",
    version,
    after_help = "Exit codes: 0 done and sound, 1 not, 2 bad input and nothing written."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run the firmware's image on the virtual board, fed with a recorded gait, and watch it
    Watch(Box<watch::Options>),
    /// Record what a board measures, every tick of it, as CSV or MCAP: of the virtual board, or of a real one's RTT bytes
    Record(Box<record::Options>),
    /// Turn a recorded gait into the semi-synthetic volts of a sensor: CSV with the header time_s,PA1
    Volts(volts::Options),
    /// Check files: every fault is told with file, line, field and what is allowed
    Check(check::Options),
    /// Show a shipped gait on the host core, with changes on the way: live on a terminal, else CSV, JSON or a picture
    Walk(walk::Options),
    /// Print the firing word of an oscillatory building block, a letter a step: F flexor, E extensor
    Obb(obb::Options),
    /// Draw what the two papers show, as pictures of ours
    Figures(figures::Options),
    /// Print how near each generator comes to a healthy adult's mean stride
    GaitError(gait_error::Options),
    /// Print which legs of the hexapod swing at each step, or the angles of its legs
    Hexapod(hexapod::Options),
    /// Measure what a parameter set does and write its certificate; refuse it if perturbed starts diverge or do not come back
    Certify(certify::Options),
    /// Fit a walker to recorded gait: parameters, a report, and how good they are on strides that were not fitted
    Fit(Box<fit::Options>),
    /// Write any recording as CSV or as an OpenSim .mot: degrees, flexion positive, even steps
    Convert(convert::Options),
    /// Make one summary of a folder of fits, wherever their shares were made
    Merge {
        /// The folder
        #[arg(value_name = "FOLDER")]
        folder: PathBuf,
    },
    /// Let the host core follow one sensor of a recorded walker with four joints, and say how well it does
    Entrain(entrain::Options),
    /// Make a sensor's calibration from known angles and what the sensor said there
    Calibrate(Box<calibrate::Options>),
    /// Fit another recorder's clock to the board's, from the edges of the board's synchronisation output or of a line that both recorded
    Sync(sync::Options),
    /// Turn a walker's parameters into the bytes of the board's parameter sector, or into a constant in Rust
    Pack(pack::Options),
    /// Print a file with the defaults, to begin a file of one's own with
    Defaults {
        /// Which file
        #[arg(value_enum)]
        file: Defaults,
    },
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Defaults {
    /// The gait sensor's calibration
    Calibration,
    /// The loop's parameters
    Parameters,
    /// The default walk, as a walker's file
    Generator,
    /// The thesis' network, Table 1 and set S, as a walker's file
    Thesis,
}

/// Reads the arguments, the program's name first, does what they say, and gives the exit code.
pub fn main(arguments: impl Iterator<Item = OsString>) -> u8 {
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(usage) => {
            // Nobody is left to tell if this fails.
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

/// Reads the arguments, the program's name first, and does what they say: the program without its last words.
///
/// # Errors
/// Arguments that make no sense are bad input; else whatever the command fails with.
pub fn call(arguments: impl Iterator<Item = OsString>) -> Result<(), Failure> {
    execute(Cli::try_parse_from(arguments).map_err(Failure::input)?)
}

fn execute(cli: Cli) -> Result<(), Failure> {
    match cli.command {
        Command::Watch(options) => watch::run(&options, &interrupt()?),
        Command::Record(options) => record::run(&options, &interrupt()?),
        Command::Volts(options) => volts::run(&options),
        Command::Entrain(options) => entrain::run(&options),
        Command::Sync(options) => sync::run(&options),
        Command::Check(options) => check::run(&options),
        Command::Walk(options) => walk::run(&options, interrupt),
        Command::Figures(options) => figures::run(&options),
        Command::GaitError(options) => gait_error::run(&options),
        Command::Obb(options) => obb::run(&options),
        Command::Hexapod(options) => hexapod::run(&options),
        Command::Certify(options) => certify::run(&options),
        Command::Fit(options) => fit::run(&options),
        Command::Convert(options) => convert::run(&options),
        Command::Merge { folder } => fit::merge(&folder),
        Command::Calibrate(options) => calibrate::run(&options),
        Command::Pack(options) => pack::run(&options),
        Command::Defaults { file: Defaults::Calibration } => {
            print(&calibration_file::to_text(&default_loop::wired_sensor().map_err(Failure::run)?))
        }
        Command::Defaults { file: Defaults::Parameters } => {
            print(&parameter_file::to_text(&LoopConfig::default_biped()))
        }
        Command::Defaults { file: Defaults::Generator } => print(&default_generator("phase-coupled")?),
        Command::Defaults { file: Defaults::Thesis } => print(&default_generator("thesis")?),
    }
}

fn default_generator(name: &str) -> Result<String, Failure> {
    let file = GeneratorFile::default_of(name).ok_or_else(|| Failure::run(format!("{name} does not ship")))?;
    Ok(file.to_toml())
}

/// Writes data to standard output. A reader that has read enough is no failure.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(Failure::run(error)),
        _ => Ok(()),
    }
}

/// Set by SIGINT and SIGTERM, which would otherwise end the program before its recording is finished. A second one does.
fn interrupt() -> Result<Arc<AtomicBool>, Failure> {
    let flag = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        // In this order: the first signal finds the flag not set yet.
        flag::register_conditional_shutdown(signal, 128 + signal, Arc::clone(&flag)).map_err(Failure::run)?;
        flag::register(signal, Arc::clone(&flag)).map_err(Failure::run)?;
    }
    Ok(flag)
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
    fn help_is_no_fault_and_a_wrong_option_is_bad_input() {
        let code = |arguments: &[&str]| main(arguments.iter().map(OsString::from));
        assert_eq!(code(&["footfall", "--version"]), 0);
        assert_eq!(code(&["footfall", "watch", "--no-such-option"]), 2);
        assert_eq!(code(&["footfall", "watch", "--elf", "a", "--virtual-board", "b", "--secs", "-1"]), 2);
        assert_eq!(code(&["footfall", "watch", "--elf", "a", "--virtual-board", "b", "--disarm"]), 2);
        assert_eq!(code(&["footfall", "check"]), 2);
    }
}
