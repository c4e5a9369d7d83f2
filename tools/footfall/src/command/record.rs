//! `footfall record`: records every tick of a board as CSV or MCAP.
//!
//! The board is the virtual one, or a real one: through its serial port, or the RTT bytes that a debug probe's program passes on.

use clap::Args;
use joint_loop::setup::default_loop::Parameters;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::board::image::Image;
use crate::board::source::{Opened, Origin};
use crate::failure::Failure;
use crate::file::capture;
use crate::file::capture::Capture;
use crate::file::capture::rtt::{Came, Source};
use crate::file::capture::samples::Counts;
use crate::messages;
use crate::options::overwrite::Overwrite;
use crate::options::played::Played;
use crate::output;
use crate::virtual_run::run;

/// Options that a board which runs already cannot be given.
const OF_THE_VIRTUAL_BOARD: [&str; 7] = ["virtual_board", "trace", "press", "disarm", "pace", "plain", "board"];

/// Options of `footfall record`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// The capture to write: a name that ends in .csv or .mcap; data of the whole run go to FILE.json
    #[arg(short, long, value_name = "FILE")]
    pub out: PathBuf,
    /// The firmware's ELF file: the one that runs on the board
    #[arg(long, value_name = "FILE")]
    pub elf: PathBuf,
    /// Record the virtual board: its program
    #[arg(long, value_name = "PROGRAM", required_unless_present_any = ["rtt", "rtt_lines", "serial"])]
    pub virtual_board: Option<PathBuf>,
    /// Record a real board: the raw bytes of its RTT up channel 0, from a file, `-` (standard input) or tcp:HOST:PORT. Reset the
    /// board after the recording has begun: its boot record has the calibration that converts codes to volts
    #[arg(
        long,
        value_name = "SOURCE",
        conflicts_with_all = OF_THE_VIRTUAL_BOARD
    )]
    pub rtt: Option<Source>,
    /// The same from the lines that probe-rs prints: `probe-rs attach` decodes the log itself and has no raw bytes to give
    #[arg(
        long,
        value_name = "SOURCE",
        conflicts_with = "rtt",
        conflicts_with_all = OF_THE_VIRTUAL_BOARD
    )]
    pub rtt_lines: Option<Source>,
    /// Record a real board through its serial port: a device file. As with --rtt, reset the board after the recording has begun
    #[arg(
        long,
        value_name = "PORT",
        conflicts_with_all = ["rtt", "rtt_lines"],
        conflicts_with_all = OF_THE_VIRTUAL_BOARD
    )]
    pub serial: Option<PathBuf>,
    /// What is fed to the board, and how the run is shown
    #[command(flatten)]
    pub played: Played,
}

/// Runs the command. `interrupt` is set by a signal that asks it to end.
///
/// # Errors
/// Wrong input, a board or a source that cannot be reached, a file that cannot be written, or a run that was not sound.
pub fn run(options: Options, interrupt: &AtomicBool) -> Result<(), Failure> {
    let Options { out, elf, virtual_board, rtt, rtt_lines, serial, played } = options;
    let source = serial.map(Origin::Serial).or(rtt.map(Origin::Log)).or(rtt_lines.map(Origin::Lines));
    match (source, virtual_board) {
        (Some(source), _) => {
            let parameters = played.parameters()?;
            let zero_ns = played.zero_ns();
            let Played { generator, secs, json, overwrite, .. } = played;
            from_board(
                &RealBoard { out, elf, source, parameters, generator, secs, json, zero_ns, overwrite },
                interrupt,
            )
        }
        (None, Some(board)) => run::run(&played.settings(elf, board, Some(out))?, interrupt),
        (None, None) => {
            Err(Failure::input("nothing to record; allowed is --virtual-board, --rtt, --rtt-lines or --serial"))
        }
    }
}

/// A recording of a real board.
struct RealBoard {
    out: PathBuf,
    elf: PathBuf,
    source: Origin,
    parameters: Parameters,
    /// The generator file, if one is in the board's flash.
    generator: Option<PathBuf>,
    secs: Option<f64>,
    json: bool,
    /// Unix time of the zero of the capture's axis, if stated, ns.
    zero_ns: Option<u64>,
    overwrite: Overwrite,
}

fn from_board(settings: &RealBoard, interrupt: &AtomicBool) -> Result<(), Failure> {
    let RealBoard { out, elf, source, parameters, generator, secs, json, zero_ns, overwrite } = settings;
    let image = Image::read(elf).map_err(Failure::input)?;
    capture::check(out, *overwrite)?;
    let stream = source.open(false).map_err(|error| Failure::input(format!("{source}: cannot be opened: {error}")))?;
    let about = capture::about(elf, &image, generator.as_deref(), parameters, source.about(*secs));
    let cannot_write = |error| output::cannot_write(out, error);
    let begun = Capture::begin(out, about, source.transport(Some(&image)), parameters.clone(), *zero_ns);
    let mut capture = begun.map_err(cannot_write)?;
    let ended = receive(&mut capture, &stream, source, *secs, interrupt);
    // Even after an error the samples so far are a finished file.
    let ending = json!({ "ended": ended.as_ref().map_or_else(ToString::to_string, ToString::to_string) });
    let counts = capture.finish(&ending).map_err(cannot_write)?;
    if *json {
        output::print(&format!("{}\n", end_object(&counts)))?;
    }
    ended?;
    report(out, source, &counts)
}

/// Records until the source ends, enough seconds are recorded, or a signal asks for the end. Gives the reason.
fn receive(
    capture: &mut Capture<'_>,
    stream: &Opened,
    source: &Origin,
    secs: Option<f64>,
    interrupt: &AtomicBool,
) -> Result<&'static str, Failure> {
    loop {
        if interrupt.load(Ordering::Relaxed) {
            return Ok("asked to end");
        }
        if secs.is_some_and(|secs| capture.counts().samples as f64 >= secs * 1000.0) {
            return Ok("enough seconds");
        }
        match stream.next(Duration::from_millis(50)) {
            Came::Bytes(bytes) => capture.bytes(&bytes).map_err(Failure::run)?,
            Came::Nothing => {}
            Came::End => return Ok("the source ended"),
            Came::Broken(error) => return Err(Failure::run(format!("{source}: the connection failed: {error}"))),
        }
        for line in capture.messages() {
            messages::status(format_args!("board: {line}"));
        }
    }
}

/// The last JSON object of the output.
fn end_object(counts: &Counts) -> serde_json::Value {
    json!({
        "type": "end", "samples": counts.samples, "lost_samples": counts.lost, "missed_periods": counts.missed,
        "dropped_by_the_board": counts.board_dropped, "confirmed_ticks": counts.confirmed,
        "different_ticks": counts.different, "malformed_frames": counts.malformed, "no_replay": counts.why_no_replay,
    })
}

/// Prints the counts; fails if board and host differ or no sample came.
fn report(out: &Path, source: &Origin, counts: &Counts) -> Result<(), Failure> {
    messages::status(capture::counts_in_words(out, counts));
    if counts.samples == 0 {
        return Err(Failure::run(format!("no sample came; {}", source.to_check())));
    }
    if counts.different > 0 {
        let words: Vec<String> = counts.differences.iter().map(ToString::to_string).collect();
        return Err(Failure::run(format!("board and host differ: {}", words.join("; "))));
    }
    Ok(())
}
