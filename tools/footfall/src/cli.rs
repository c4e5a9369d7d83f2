//! The command line: lists the commands and gives the exit code.

pub mod examples;

#[cfg(feature = "analysis")]
use crate::command::{
    basin, bifurcation, bringup, calibrate, certify, check, completions, convert, defaults, entrain, figures, fit,
    gait_error, hexapod, man, merge, obb, pack, phase_response, replay, reproduce, sample, save, smer, sync, tongue,
    trim, volts, walk,
};
use crate::command::{record, set, watch};
use crate::failure::Failure;
use crate::interrupt;
use crate::messages;
use crate::options::manners::{Manners, colour_asked};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use std::ffi::OsString;
use std::time::Instant;

/// Says that not every command is in this program.
#[cfg(not(feature = "analysis"))]
const BUILT_FOR: &str = "This program was built by `cargo xtask run`, with `watch`, `record` and `set` only:\n`cargo footfall` builds it whole.\n\n";
#[cfg(feature = "analysis")]
const BUILT_FOR: &str = "";
const EXIT_CODES: &str =
    "Exit codes:\n  0  success\n  1  the run failed, or its result is not sound\n  2  wrong input, nothing was written";

/// Footfall: a recorded or measured gait in, the angles of four joints out.
///
/// The gait sensor is an HGOD: a potentiometer goniometer, the joint-angle sensor of the thesis.
#[derive(Debug, Parser)]
#[command(
    name = "footfall",
    version,
    max_term_width = 100,
    after_help = format!("{BUILT_FOR}{EXIT_CODES}")
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    manners: Manners,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run the firmware image on the virtual board, fed with a recorded gait, or watch a board that runs, through its serial port or a debug probe
    Watch(Box<watch::Options>),
    /// Record every tick of a board as CSV or MCAP: the virtual board, or a real board through RTT or its serial port
    Record(Box<record::Options>),
    /// Change a parameter of a running board through its serial port, undo the last change, or stop it
    Set(set::Options),
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
    /// Draw the figures of the two papers for which no search is needed, computed by the core
    Figures(figures::Options),
    /// Compute both papers again: figures, tables, the searches for parameters, and every claim with its verdict
    Reproduce(reproduce::Options),
    /// Print the difference between each generator and the mean stride of a healthy adult
    GaitError(gait_error::Options),
    /// Print which legs of the hexapod swing at each step, or the angles of its legs
    Hexapod(hexapod::Options),
    /// Judge a graph of nodes that operate by edge reversal: live or dead, transient, period, operations of each node, concurrency
    Smer(smer::Options),
    /// Measure a generator and write its certificate: does it come back to its orbit, does it walk on the robot
    Certify(certify::Options),
    /// Measure by how much a kick shifts the phase of an oscillator or generator
    PhaseResponse(phase_response::Options),
    /// Map which periodic inputs lock an oscillator or generator: Arnold tongues
    Tongue(tongue::Options),
    /// Map which attractor each start of an oscillator or generator reaches
    Basin(basin::Options),
    /// Follow the motion of an oscillator or generator along one parameter, and find where it begins to oscillate
    Bifurcation(bifurcation::Options),
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
    /// Find the servo map of a joint on the robot: move the servo slowly, say which angles the joint has
    Trim(trim::Options),
    /// Measure a board step by step with a jumper wire, and write what was found with its limits: pulses, codes, clocks, resets, stops
    Bringup(bringup::Options),
    /// Fit another recorder's clock to the board's, from the edges of the synchronisation output or of a line that both recorded
    Sync(sync::Options),
    /// Run the control loop with the inputs of a capture, and compare every tick with it, bit for bit
    Replay(replay::Options),
    /// Convert a generator file, sensor files or a robot file to a flash record of the board, or a generator file to a Rust constant
    Pack(pack::Options),
    /// Write a generator file with the speed, amplitudes and offsets that were found on a running board
    Save(save::Options),
    /// Print a file with the default values, as a template
    Defaults(defaults::Options),
    /// List the sample files, print one, or write them: one of each kind that the commands take
    Sample(sample::Options),
    /// Print the script with which a shell completes commands and options
    Completions(completions::Options),
    /// Print a manual page, or write all of them
    Man(man::Options),
}

/// Parses the arguments (the first is the program's name), runs the command, prints its error, and returns the exit code.
pub fn main(arguments: impl Iterator<Item = OsString>) -> u8 {
    let cli = match parse(arguments) {
        Ok(cli) => cli,
        Err(usage) => {
            // There is no other place to report that standard error is closed.
            let _ = usage.print();
            return if usage.use_stderr() { 2 } else { 0 };
        }
    };
    let began = Instant::now();
    let result = execute(cli);
    messages::detail(format_args!("took {:.2} s", began.elapsed().as_secs_f64()));
    match result {
        Ok(()) => 0,
        Err(failure) => {
            messages::error(&failure);
            failure.exit_code()
        }
    }
}

/// The whole command line.
#[must_use]
pub fn program() -> clap::Command {
    examples::added(Cli::command())
}

fn parse(arguments: impl Iterator<Item = OsString>) -> Result<Cli, clap::Error> {
    let arguments: Vec<OsString> = arguments.collect();
    // For what is printed before the arguments are known to be correct.
    colour_asked(&arguments).into_iter().for_each(messages::set_colour);
    let mut program = program();
    let mut matches = program.try_get_matches_from_mut(arguments)?;
    Cli::from_arg_matches_mut(&mut matches).map_err(|error| error.format(&mut program))
}

/// Parses the arguments (the first is the program's name) and runs the command, without printing its error.
///
/// # Errors
/// Wrong arguments are wrong input; otherwise the failure of the command.
pub fn call(arguments: impl Iterator<Item = OsString>) -> Result<(), Failure> {
    execute(parse(arguments).map_err(Failure::input)?)
}

fn execute(cli: Cli) -> Result<(), Failure> {
    cli.manners.apply();
    match cli.command {
        Command::Watch(options) => watch::run(*options, &*interrupt::flag()?),
        Command::Record(options) => record::run(*options, &*interrupt::flag()?),
        Command::Set(options) => set::run(&options, &*interrupt::flag()?),
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
        Analysis::Reproduce(options) => reproduce::run(&options),
        Analysis::GaitError(options) => gait_error::run(&options),
        Analysis::Obb(options) => obb::run(&options),
        Analysis::Hexapod(options) => hexapod::run(&options),
        Analysis::Smer(options) => smer::run(&options),
        Analysis::Certify(options) => certify::run(&options),
        Analysis::PhaseResponse(options) => phase_response::run(&options),
        Analysis::Tongue(options) => tongue::run(&options),
        Analysis::Basin(options) => basin::run(&options),
        Analysis::Bifurcation(options) => bifurcation::run(&options),
        Analysis::Fit(options) => fit::run(*options),
        Analysis::Convert(options) => convert::run(options),
        Analysis::Merge(options) => merge::run(&options),
        Analysis::Calibrate(options) => calibrate::run(*options),
        Analysis::Trim(options) => trim::run(&options, &*interrupt::flag()?),
        Analysis::Bringup(options) => bringup::run(&options, &*interrupt::flag()?),
        Analysis::Replay(options) => replay::run(&options),
        Analysis::Pack(options) => pack::run(&options),
        Analysis::Save(options) => save::run(&options, &*interrupt::flag()?),
        Analysis::Defaults(options) => defaults::run(&options),
        Analysis::Sample(options) => sample::run(&options),
        Analysis::Completions(options) => completions::run(&options, program()),
        Analysis::Man(options) => man::run(&options, program()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        program().debug_assert();
    }

    #[cfg(feature = "analysis")]
    #[test]
    fn every_command_has_two_examples_or_more() {
        let program = program();
        let names: Vec<&str> = program.get_subcommands().map(clap::Command::get_name).collect();
        assert_eq!(names, examples::EXAMPLES.iter().map(|(name, _)| *name).collect::<Vec<_>>());
        for (name, of) in examples::EXAMPLES {
            assert!(of.len() >= 2, "{name}");
            let own = format!("footfall {name}");
            assert!(of.iter().any(|(_, line)| format!("{line} ").starts_with(&format!("{own} "))), "{name}");
            let help = program.find_subcommand(name).and_then(clap::Command::get_after_help).expect("help").to_string();
            assert!(of.iter().all(|(_, line)| help.contains(line)), "{name}: {help}");
        }
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
