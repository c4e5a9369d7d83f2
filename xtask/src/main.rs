//! `cargo xtask`: set-up, builds, runs and all checks.
//!
//! This is the only place that contains toolchain details (see `docs/toolchains.md`). Its messages go to standard error, because the
//! standard output of `cargo xtask run` belongs to `footfall`.
//!
//! Exit codes: 0 done, 1 something failed, 2 something required is missing on this computer (the message says what to do) or the
//! command line is wrong.

mod bench;
mod board;
mod board_flags;
mod board_sectors;
mod book;
mod bootsel;
mod bringup;
mod campaign;
mod dfu;
mod dist;
mod emulated;
mod flash;
mod folder;
mod image;
mod live;
mod missing_requirement;
mod option_bytes;
mod pico;
mod probe;
mod progress;
mod record;
mod run;
mod run_image;
mod seal;
mod setup;
mod shell;
mod test;
mod toolchain;
mod uf2;
mod workspace;

use std::process::ExitCode;

use clap::builder::PossibleValuesParser;
use clap::{Parser, Subcommand};

use board::{Board, Variant};
use setup::Need;
use workspace::Workspace;

/// Sets up, builds, runs and checks Footfall
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask", version)]
struct Cli {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Run the firmware on the virtual board and show it live
    Run(run::Options),
    /// Check everything: format, lints, docs, host tests, both firmware images, the virtual board
    Test(test::Options),
    /// Build the firmware and write it to a board: with probe-rs, through USB, or to the drive of a Pico
    Flash(flash::Options),
    /// The runner of `cargo run` for a board: seal what cargo has built, write it and start it
    #[command(hide = true)]
    RunImage(run_image::Options),
    /// Show a connected board live, with its image: through probe-rs, another RTT server, or its serial port
    Watch(live::Options),
    /// Record every tick of a connected board: the same ways, with -o FILE
    Record(live::Options),
    /// Measure a connected board step by step, and write what was found with its limits
    Bringup(bringup::Options),
    /// Show, read, tune or erase the parameter records of a connected board
    Board {
        #[command(subcommand)]
        action: board_sectors::Action,
    },
    /// Build the firmware and print the path and the size of the image
    Build {
        /// The board to build for
        #[arg(long, value_enum, default_value_t)]
        board: Board,
        #[command(flatten)]
        variant: Variant,
    },
    /// Build the firmware for the Raspberry Pi Pico as a file for its USB drive, without a Pico (`flash --board pico` writes it)
    Pico(pico::Options),
    /// Measure and print a table
    Bench {
        #[command(subcommand)]
        bench: bench::Bench,
    },
    /// Inject faults into the flashed image on the virtual board, each in each state at each phase of the servo frame, and print what they lead to
    Campaign(campaign::Options),
    /// Build the book of all pages, and print where its first page is
    Book(book::Options),
    /// Pack a release: images, program, completions, manual pages, documentation, book, samples, check sums
    Dist(dist::Options),
    /// Install what the other commands need, or print the command that installs it
    Setup {
        /// Install this group of tools too (repeat for more)
        #[arg(long, value_name = "GROUP", value_parser = PossibleValuesParser::new(Need::GROUPS.map(Need::name)))]
        with: Vec<String>,
    },
}

fn main() -> ExitCode {
    match perform(Cli::parse().task) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error:#}");
            let is_missing = error.downcast_ref::<missing_requirement::MissingRequirement>().is_some();
            if is_missing { ExitCode::from(2) } else { ExitCode::FAILURE }
        }
    }
}

fn perform(task: Task) -> anyhow::Result<ExitCode> {
    match task {
        Task::Run(options) => run::run(&options),
        Task::Test(options) => test::test(&options),
        Task::Flash(options) => flash::flash(&options),
        Task::RunImage(options) => run_image::run_image(&options),
        Task::Watch(options) => live::live(&options, live::Use::Watch),
        Task::Record(options) => live::live(&options, live::Use::Record),
        Task::Bringup(options) => bringup::bringup(&options),
        Task::Board { action } => board_sectors::board(&action),
        Task::Build { board, variant } => {
            let mut workspace = Workspace::open()?;
            workspace.set_up(&[Need::BoardCompiler])?;
            let built = workspace.firmware(board, variant)?;
            println!("{}: {}, {}", board.feature(), built.elf.display(), built.footprint);
            Ok(ExitCode::SUCCESS)
        }
        Task::Pico(options) => pico::pico(&options),
        Task::Bench { bench } => bench::bench(&bench),
        Task::Campaign(options) => campaign::campaign(&options),
        Task::Book(options) => book::book(&options),
        Task::Dist(options) => dist::dist(&options),
        Task::Setup { with } => {
            let groups: Vec<Need> = with.iter().filter_map(|name| Need::named(name)).collect();
            let missing = Workspace::open()?.install(&groups)?;
            eprintln!("set-up: {}", if missing.is_empty() { "complete" } else { "complete but for what is optional" });
            Ok(ExitCode::SUCCESS)
        }
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
    fn an_unknown_board_is_refused() {
        assert!(Cli::try_parse_from(["cargo xtask", "flash", "--board", "bluepill"]).is_err());
        assert!(Cli::try_parse_from(["cargo xtask", "flash", "--board", "nucleo-f446re"]).is_ok());
        assert!(Cli::try_parse_from(["cargo xtask", "flash", "--board", "pico"]).is_ok());
    }

    #[test]
    fn an_unknown_group_is_refused() {
        assert!(Cli::try_parse_from(["cargo xtask", "setup", "--with", "node", "--with", "probe"]).is_ok());
        let error = Cli::try_parse_from(["cargo xtask", "setup", "--with", "traces"]).err().unwrap().to_string();
        assert!(error.contains("node, python, c++, probe"), "{error}");
    }

    #[test]
    fn an_unknown_step_is_refused() {
        let error = Cli::try_parse_from(["cargo xtask", "test", "--only", "nonsense"]).err().unwrap();
        assert!(error.to_string().contains("format, lints"), "{error}");
        assert_eq!(error.exit_code(), 2);
    }
}
