//! `cargo xtask run`: runs the image that would be flashed on the virtual board and shows it with `footfall watch`.

use std::process::ExitCode;

use anyhow::Result;
use clap::{CommandFactory, Parser};

use crate::board::{Board, Drive};
use crate::setup::Need;
use crate::shell;
use crate::workspace::{Commands, Workspace};

/// Options of `cargo xtask run`.
#[derive(Debug, Parser)]
#[command(
    name = "cargo xtask run",
    bin_name = "cargo xtask run",
    about = "Run the firmware on the virtual board and show it live",
    after_help = "Examples:\n  cargo xtask run\n  cargo xtask run --secs 10 --disarm --json\n  cargo xtask run --shadow --record out.csv\n  cargo xtask run --robot robot.toml\n\n\
                  `cargo footfall watch --help` lists the options of footfall watch."
)]
pub(crate) struct Options {
    /// Shadow mode: run the image that computes everything and drives nothing
    #[arg(long)]
    shadow: bool,
    /// Every other option goes to `footfall watch`, for example --secs N, --trace FILE, --json
    #[arg(value_name = "OPTIONS OF FOOTFALL WATCH", trailing_var_arg = true, allow_hyphen_values = true)]
    watch: Vec<String>,
}

/// Builds what is needed and becomes `footfall watch`: standard streams, Ctrl-C and exit code are then those of `footfall`.
pub(crate) fn run(options: &Options) -> Result<ExitCode> {
    let Arguments { help, shadow, watch: arguments } = Arguments::of(options);
    if help {
        Options::command().print_help()?;
        return Ok(ExitCode::SUCCESS);
    }
    let mut workspace = Workspace::open()?;
    workspace.set_up(&[Need::BoardCompiler, Need::VirtualBoard])?;
    let built = workspace.image_and_host_programs(Board::F4Discovery, Drive::unless(shadow), commands(&arguments))?;
    eprintln!("image: {}, {}", built.image.elf.display(), built.image.footprint);

    let mut watch = shell::command(built.footfall);
    // File names among the options are relative to where the command was typed, not to the workspace's root.
    watch.current_dir(&workspace.started_in);
    watch.arg("watch").arg("--elf").arg(built.image.elf).arg("--virtual-board").arg(built.virtual_board);
    shell::replace_with(watch.args(arguments))
}

/// A generator from a file is judged before it runs, and Foxglove is served by crates that the small program lacks.
fn commands(watch: &[&str]) -> Commands {
    let words = watch.iter().take_while(|word| **word != "--").map(|word| word.split('=').next().unwrap_or_default());
    let mut names = words.filter(|name| matches!(*name, "--generator" | "--foxglove"));
    if names.next().is_some() { Commands::All } else { Commands::Watch }
}

/// The command line, sorted: `--shadow` and `--help` count wherever they stand before `--`; the virtual board's own options follow it.
#[derive(Debug, PartialEq, Eq)]
struct Arguments<'a> {
    help: bool,
    shadow: bool,
    watch: Vec<&'a str>,
}

impl<'a> Arguments<'a> {
    fn of(options: &'a Options) -> Arguments<'a> {
        let words = options.watch.iter().map(String::as_str);
        let before_dashes = options.watch.iter().position(|word| word == "--").unwrap_or(options.watch.len());
        let mut arguments = Arguments { help: false, shadow: options.shadow, watch: Vec::new() };
        for (index, word) in words.enumerate() {
            match word {
                "--shadow" if index < before_dashes => arguments.shadow = true,
                "--help" | "-h" if index < before_dashes => arguments.help = true,
                _ => arguments.watch.push(word),
            }
        }
        arguments
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arguments(words: &str) -> (bool, bool, String) {
        let words = std::iter::once("run").chain(words.split_whitespace());
        let options = Options::try_parse_from(words).unwrap();
        let Arguments { help, shadow, watch } = Arguments::of(&options);
        (help, shadow, watch.join(" "))
    }

    #[test]
    fn options_of_footfall_watch_keep_their_order() {
        assert_eq!(arguments("--secs 3 --json -x"), (false, false, "--secs 3 --json -x".into()));
        assert_eq!(arguments(""), (false, false, String::new()));
    }

    #[test]
    fn shadow_counts_anywhere_before_the_dashes() {
        assert_eq!(arguments("--shadow --secs 3"), (false, true, "--secs 3".into()));
        assert_eq!(arguments("--secs 3 --shadow --json"), (false, true, "--secs 3 --json".into()));
        assert_eq!(arguments("--json -- --shadow"), (false, false, "--json -- --shadow".into()));
    }

    #[test]
    fn a_generator_from_a_file_and_foxglove_need_every_command() {
        assert_eq!(commands(&["--secs", "3", "--json"]), Commands::Watch);
        assert_eq!(commands(&["--generator", "g.toml"]), Commands::All);
        assert_eq!(commands(&["--generator=g.toml", "--json"]), Commands::All);
        assert_eq!(commands(&["--foxglove"]), Commands::All);
        assert_eq!(commands(&["--foxglove=0.0.0.0"]), Commands::All);
        assert_eq!(commands(&["--udp", "127.0.0.1"]), Commands::Watch);
        assert_eq!(commands(&["--pace", "--", "--foxglove"]), Commands::Watch);
    }

    #[test]
    fn help_counts_anywhere_before_the_dashes() {
        let error = Options::try_parse_from(["run", "--help"]).unwrap_err();
        assert_eq!(error.kind(), clap::error::ErrorKind::DisplayHelp);
        assert!(error.to_string().contains("--shadow") && error.to_string().contains("cargo footfall watch --help"));
        assert!(arguments("--secs 3 --help").0);
        assert!(!arguments("--secs 3 -- --help").0);
    }
}
