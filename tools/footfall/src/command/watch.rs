//! `footfall watch`: runs the firmware image on the virtual board, fed with a recorded gait, and shows, records and replays the run; or shows
//! what a board sends on its serial port or through a debug probe. Either can be sent to other programs while it runs.

use clap::Args;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use crate::board::source::Origin;
use crate::failure::Failure;
use crate::file::capture::rtt::Source;
use crate::live_run;
use crate::options::played::Played;
use crate::options::terminal::Keys;
use crate::publish::Receivers;
use crate::virtual_run::run;

/// Options that a board which runs already cannot be given.
const OF_THE_VIRTUAL_BOARD: [&str; 11] = [
    "virtual_board",
    "record",
    "trace",
    "sensor",
    "generator",
    "robot",
    "press",
    "disarm",
    "pace",
    "board",
    "start_time",
];

/// Options of `footfall watch`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// The firmware's ELF file: the one that would be flashed, or that was
    #[arg(long, value_name = "FILE")]
    pub elf: Option<PathBuf>,
    /// The virtual board's program
    #[arg(long, value_name = "PROGRAM")]
    pub virtual_board: Option<PathBuf>,
    /// Watch a board that runs: its serial port, a device file. On a terminal, keys change its parameters. --json prints every frame;
    /// `footfall set` changes their rate
    #[arg(
        long,
        value_name = "PORT",
        conflicts_with_all = ["elf", "rtt"],
        conflicts_with_all = OF_THE_VIRTUAL_BOARD
    )]
    pub serial: Option<PathBuf>,
    /// Watch a board that runs: the records in its RTT up channel 1, from a file, `-` (standard input), tcp:HOST:PORT (a server of OpenOCD),
    /// jlink:HOST:PORT or tcp-listen:HOST:PORT (a program that connects). With a server, keys change the board's parameters, as with --serial
    #[arg(
        long,
        value_name = "SOURCE",
        conflicts_with = "elf",
        conflicts_with_all = OF_THE_VIRTUAL_BOARD
    )]
    pub rtt: Option<Source>,
    /// Record every tick: a name that ends in .csv or .mcap; data of the whole run go to FILE.json
    #[arg(long, value_name = "FILE")]
    pub record: Option<PathBuf>,
    /// Where the run is sent while it runs
    #[command(flatten)]
    pub receivers: Receivers,
    /// What is fed to the board, and how the run is shown
    #[command(flatten)]
    pub played: Played,
}

/// Runs the command. `interrupt` is set by a signal that asks it to end.
///
/// # Errors
/// Wrong input, a board that cannot be started or reached, a file that cannot be written, or a run that was not sound.
pub fn run(options: Options, interrupt: &AtomicBool) -> Result<(), Failure> {
    let Options { elf, virtual_board, serial, rtt, record, receivers, played } = options;
    let origin = serial.map(Origin::Serial).or(rtt.map(Origin::Rtt));
    match (origin, elf, virtual_board) {
        (Some(origin), ..) => {
            let show = played.show(if origin.is_stdin() { Keys::Terminal } else { Keys::Stdin });
            let settings = live_run::run::Settings { origin, secs: played.secs, receivers, show };
            live_run::run::run(&settings, interrupt)
        }
        (None, Some(elf), Some(board)) => {
            let mut settings = played.settings(elf, board, record)?;
            // Who looks at it looks at it in real time.
            settings.pace |= receivers.any();
            settings.receivers = receivers;
            run::run(&settings, interrupt)
        }
        (None, elf, board) => Err(no_board(elf.is_some(), board.is_some(), "cargo xtask run")),
    }
}

/// The failure of a command that no board is named to; `xtask` is the command that starts the virtual board for it.
pub(crate) fn no_board(has_elf: bool, has_virtual_board: bool, xtask: &str) -> Failure {
    Failure::input(match (has_elf, has_virtual_board) {
        (true, false) => "--elf without --virtual-board: allowed are both, --serial or --rtt".into(),
        (false, true) => "--virtual-board without --elf: allowed are both, --serial or --rtt".into(),
        _ => format!(
            "name a board: --serial PORT, or --rtt SOURCE through a debug probe; without a board run `{xtask}` in a clone, which starts the virtual board"
        ),
    })
}
