//! `footfall watch`: runs the firmware image on the virtual board, fed with a recorded gait, and shows, records and replays the run; or shows
//! what a board sends on its serial port. Either can be sent to other programs while it runs.

mod serial_port;

use clap::Args;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use crate::failure::Failure;
use crate::live::Receivers;
use crate::options::played::Played;
use crate::virtual_run::run;

/// Options of `footfall watch`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// The firmware's ELF file: the one that would be flashed
    #[arg(long, value_name = "FILE", required_unless_present = "serial")]
    pub elf: Option<PathBuf>,
    /// The virtual board's program
    #[arg(long, value_name = "PROGRAM", required_unless_present = "serial")]
    pub virtual_board: Option<PathBuf>,
    /// Listen to a board that runs: its serial port, a device file. --json prints every frame; `footfall set` changes their rate
    #[arg(
        long,
        value_name = "PORT",
        conflicts_with_all = [
            "elf", "virtual_board", "record", "trace", "sensor", "generator", "robot", "press", "disarm", "pace", "board",
            "start_time"
        ]
    )]
    pub serial: Option<PathBuf>,
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
    let Options { elf, virtual_board, serial, record, receivers, played } = options;
    match (serial, elf, virtual_board) {
        (Some(port), ..) => serial_port::run(&port, &receivers, played.secs, played.json, interrupt),
        (None, Some(elf), Some(board)) => {
            let mut settings = played.settings(elf, board, record)?;
            // Who looks at it looks at it in real time.
            settings.pace |= receivers.any();
            settings.receivers = receivers;
            run::run(&settings, interrupt)
        }
        _ => Err(Failure::input("nothing to watch; allowed are --elf with --virtual-board, or --serial")),
    }
}
