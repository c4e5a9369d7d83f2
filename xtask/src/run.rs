//! `cargo xtask run`: runs the image that would be flashed on the virtual board and shows it with `footfall watch`.

use std::process::ExitCode;

use anyhow::Result;
use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, ValueEnum};

use crate::board::{Board, Variant};
use crate::setup::Need;
use crate::shell;
use crate::workspace::{Commands, Workspace};

/// Options of `cargo xtask run`.
#[derive(Debug, Parser)]
#[command(
    name = "cargo xtask run",
    bin_name = "cargo xtask run",
    about = "Run the firmware on the virtual board and show it live",
    after_help = "Examples:\n  cargo xtask run\n  cargo xtask run --secs 10 --disarm --json\n  cargo xtask run --shadow --record out.csv\n  cargo xtask run --robot robot.toml\n  cargo xtask run --board black-pill-f411\n\n\
                  `cargo footfall watch --help` lists the options of footfall watch."
)]
pub(crate) struct Options {
    /// The board: f4-discovery or black-pill-f411, which the virtual board models [default: f4-discovery]
    #[arg(long, value_enum)]
    board: Option<Board>,
    #[command(flatten)]
    variant: Variant,
    /// Every other option goes to `footfall watch`, for example --secs N, --trace FILE, --json
    #[arg(value_name = "OPTIONS OF FOOTFALL WATCH", trailing_var_arg = true, allow_hyphen_values = true)]
    watch: Vec<String>,
}

/// Builds what is needed and becomes `footfall watch`: standard streams, Ctrl-C and exit code are then those of `footfall`.
pub(crate) fn run(options: &Options) -> Result<ExitCode> {
    // Wrong input, as that which clap itself finds.
    let wrong = |why: String| -> ! { Options::command().error(ErrorKind::InvalidValue, why).exit() };
    let Arguments { help, variant, board, watch: arguments } = Arguments::of(options).unwrap_or_else(|why| wrong(why));
    if help {
        Options::command().print_help()?;
        return Ok(ExitCode::SUCCESS);
    }
    if !board.is_modelled() {
        wrong(unknown_board(board.feature()));
    }
    let mut workspace = Workspace::open()?;
    workspace.set_up(&[Need::BoardCompiler, Need::VirtualBoard])?;
    let built = workspace.image_and_host_programs(board, variant, commands(&arguments))?;
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

/// The command line, sorted: `--board`, `--shadow`, `--no-sensor` and `--help` count wherever they stand before `--`; the virtual board's own options follow it.
#[derive(Debug, PartialEq, Eq)]
struct Arguments<'a> {
    help: bool,
    variant: Variant,
    board: Board,
    watch: Vec<&'a str>,
}

impl<'a> Arguments<'a> {
    fn of(options: &'a Options) -> Result<Arguments<'a>, String> {
        let mut words = options.watch.iter().map(String::as_str).enumerate();
        let before_dashes = options.watch.iter().position(|word| word == "--").unwrap_or(options.watch.len());
        let board = options.board.unwrap_or_default();
        let mut arguments = Arguments { help: false, variant: options.variant, board, watch: Vec::new() };
        let named = |name: &str| Board::from_str(name, false).map_err(|_| unknown_board(name));
        while let Some((index, word)) = words.next() {
            match word {
                "--board" if index < before_dashes => {
                    arguments.board = named(words.next().map_or("", |(_, name)| name))?
                }
                _ if index < before_dashes && word.starts_with("--board=") => {
                    arguments.board = named(&word["--board=".len()..])?
                }
                "--shadow" if index < before_dashes => arguments.variant.shadow = true,
                "--no-sensor" if index < before_dashes => arguments.variant.no_sensor = true,
                "--help" | "-h" if index < before_dashes => arguments.help = true,
                _ => arguments.watch.push(word),
            }
        }
        Ok(arguments)
    }
}

fn unknown_board(name: &str) -> String {
    let names: Vec<&str> = Board::ALL.iter().filter(|board| board.is_modelled()).map(|board| board.feature()).collect();
    format!("--board: the virtual board does not model `{name}`; allowed are {}", names.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arguments(words: &str) -> (bool, bool, String) {
        let words = std::iter::once("run").chain(words.split_whitespace());
        let options = Options::try_parse_from(words).unwrap();
        let Arguments { help, variant, watch, .. } = Arguments::of(&options).unwrap();
        (help, variant.shadow, watch.join(" "))
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
        let variant = |words: [&str; 4]| Arguments::of(&Options::try_parse_from(words).unwrap()).unwrap().variant;
        assert_eq!(variant(["run", "--no-sensor", "--json", "--shadow"]), Variant { shadow: true, no_sensor: true });
        assert_eq!(variant(["run", "--json", "--no-sensor", "--pace"]), Variant { no_sensor: true, ..Variant::USUAL });
        assert_eq!(variant(["run", "--json", "--", "--no-sensor"]), Variant::USUAL);
    }

    #[test]
    fn the_board_counts_anywhere_before_the_dashes() {
        let board = |words: &str| {
            let words = std::iter::once("run").chain(words.split_whitespace());
            let options = Options::try_parse_from(words).unwrap();
            Arguments::of(&options).map(|arguments| (arguments.board, arguments.watch.join(" ")))
        };
        assert_eq!(board(""), Ok((Board::F4Discovery, String::new())));
        for words in
            ["--board black-pill-f411 --secs 3", "--secs 3 --board black-pill-f411", "--secs 3 --board=black-pill-f411"]
        {
            assert_eq!(board(words), Ok((Board::BlackPillF411, "--secs 3".into())), "{words}");
        }
        assert_eq!(
            board("--json -- --board f4-discovery"),
            Ok((Board::F4Discovery, "--json -- --board f4-discovery".into()))
        );
        let wrong = board("--json --board bluepill").unwrap_err();
        assert!(wrong.contains("does not model `bluepill`; allowed are black-pill-f411, f4-discovery"), "{wrong}");
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
