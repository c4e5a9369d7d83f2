//! `cargo xtask`: set-up, builds, runs and the whole check, in one word each.
//!
//! This is the only place that knows toolchain quirks (see `docs/toolchains.md`). Everything it says goes to standard error,
//! because the standard output of `cargo xtask run` belongs to `footfall`.
//!
//! Exit codes: 0 done, 1 something failed, 2 something is missing on this computer (the message says what to do).

mod bench;
mod board;
mod build;
mod core_selftest;
mod flash;
mod image;
mod run;
mod setup;
mod shell;
mod test;
mod toolchain;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use board::{Board, Drive};
use build::Workshop;
use setup::Need;

/// Set-up and chores of Footfall.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask", version)]
struct Cli {
    #[command(subcommand)]
    command: Chore,
}

#[derive(Subcommand)]
enum Chore {
    /// Run the firmware on the virtual board and watch it; every option but --shadow goes to `footfall watch`
    #[command(disable_help_flag = true)]
    Run {
        /// --shadow for the image that drives nothing, and options of `footfall watch`, such as --secs N, --trace FILE, --json
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        options: Vec<String>,
    },
    /// Check everything: format, lints, docs, host tests, both firmware images, the virtual board
    Test(test::Options),
    /// Build the firmware and hand it to probe-rs
    Flash(flash::Options),
    /// Build the firmware and print where the image is and what it takes
    Build {
        /// The board to build for
        #[arg(long, value_enum, default_value_t)]
        board: Board,
        /// Shadow mode: run everything, drive nothing
        #[arg(long)]
        shadow: bool,
    },
    /// Measure and print a table
    Bench {
        #[command(subcommand)]
        bench: bench::Bench,
    },
    /// Install what the other commands need, or say what to install
    Setup,
}

fn main() -> ExitCode {
    match chore(Cli::parse().command) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error:#}");
            if error.downcast_ref::<setup::Incomplete>().is_some() { ExitCode::from(2) } else { ExitCode::FAILURE }
        }
    }
}

fn chore(chore: Chore) -> anyhow::Result<ExitCode> {
    let mut shop = Workshop::open()?;
    match chore {
        Chore::Run { options } => run::run(&mut shop, &options),
        Chore::Test(options) => test::test(shop, &options),
        Chore::Flash(options) => flash::flash(&mut shop, &options),
        Chore::Build { board, shadow } => {
            shop.set_up(&[Need::Thumb])?;
            let built = shop.firmware(board, Drive::unless(shadow))?;
            println!("{}: {}, {}", board.feature(), built.elf.display(), built.footprint);
            Ok(ExitCode::SUCCESS)
        }
        Chore::Bench { bench } => bench::bench(&mut shop, &bench),
        Chore::Setup => {
            shop.set_up(&Need::ALL)?;
            eprintln!("set-up: complete");
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
    fn run_hands_every_option_on_in_order() {
        let cli = Cli::try_parse_from(["cargo xtask", "run", "--secs", "3", "--json", "--help", "-x"]).unwrap();
        let Chore::Run { options } = cli.command else { panic!("not the run command") };
        assert_eq!(options, ["--secs", "3", "--json", "--help", "-x"]);
    }

    #[test]
    fn an_unknown_board_is_refused() {
        assert!(Cli::try_parse_from(["cargo xtask", "flash", "--board", "bluepill"]).is_err());
        assert!(Cli::try_parse_from(["cargo xtask", "flash", "--board", "nucleo-f446re"]).is_ok());
    }
}
