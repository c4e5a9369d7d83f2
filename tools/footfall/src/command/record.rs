//! `footfall record`: records every tick of a board as CSV or MCAP.
//!
//! The board is the virtual one, or a real one: through its serial port, or RTT channel 1, which a debug probe's program passes on.

use clap::Args;
use joint_loop::setup::default_loop::Parameters;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::board::image::Image;
use crate::board::source::{Opened, Origin};
use crate::command::watch::no_board;
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

/// Longest wait for a sample, beside the seconds that are asked for, s.
const PATIENCE_S: f64 = 5.0;

/// Options of `footfall record`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// The capture to write: a name that ends in .csv or .mcap; data of the whole run go to FILE.json
    #[arg(short, long, value_name = "FILE")]
    pub out: PathBuf,
    /// The firmware's ELF file: the one that runs on the board. Of a real board it is only named in FILE.json
    #[arg(long, value_name = "FILE")]
    pub elf: Option<PathBuf>,
    /// Record the virtual board: its program
    #[arg(long, value_name = "PROGRAM")]
    pub virtual_board: Option<PathBuf>,
    /// Record a real board: the records in its RTT up channel 1, from a file, `-` (standard input), tcp:HOST:PORT (a server of OpenOCD),
    /// jlink:HOST:PORT or tcp-listen:HOST:PORT (a program that connects). Reset the board after the recording has begun: its boot record has the
    /// calibration that converts codes to volts
    #[arg(
        long,
        value_name = "SOURCE",
        conflicts_with_all = OF_THE_VIRTUAL_BOARD
    )]
    pub rtt: Option<Source>,
    /// Record a real board through its serial port: a device file. As with --rtt, reset the board after the recording has begun
    #[arg(
        long,
        value_name = "PORT",
        conflicts_with = "rtt",
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
    let Options { out, elf, virtual_board, rtt, serial, played } = options;
    let source = serial.map(Origin::Serial).or(rtt.map(Origin::Rtt));
    match (source, elf, virtual_board) {
        (Some(source), elf, _) => {
            let parameters = played.parameters()?;
            let zero_ns = played.zero_ns();
            let Played { generator, secs, json, overwrite, .. } = played;
            from_board(
                &RealBoard { out, elf, source, parameters, generator, secs, json, zero_ns, overwrite },
                interrupt,
            )
        }
        (None, Some(elf), Some(board)) => run::run(&played.settings(elf, board, Some(out))?, interrupt),
        (None, elf, board) => Err(no_board(elf.is_some(), board.is_some(), "cargo xtask run --record FILE")),
    }
}

/// A recording of a real board.
struct RealBoard {
    out: PathBuf,
    elf: Option<PathBuf>,
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
    let image = elf.as_deref().map(Image::read).transpose().map_err(Failure::input)?;
    capture::check(out, *overwrite)?;
    let mut stream =
        source.open(false).map_err(|error| Failure::input(format!("{source}: cannot be opened: {error}")))?;
    let about = capture::about(elf.as_deref(), image.as_ref(), generator.as_deref(), parameters, source.about(*secs));
    let cannot_write = |error| output::cannot_write(out, error);
    let begun = Capture::begin(out, about, image, parameters.clone(), *zero_ns);
    let mut capture = begun.map_err(cannot_write)?;
    let ended = receive(&mut capture, &mut stream, source, *secs, interrupt);
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
///
/// # Errors
/// The source failed or is not of a board; or so many seconds cannot come any more, because no sample has come for longer.
fn receive(
    capture: &mut Capture,
    stream: &mut Opened,
    source: &Origin,
    secs: Option<f64>,
    interrupt: &AtomicBool,
) -> Result<&'static str, Failure> {
    let (mut last_sample, mut samples) = (Instant::now(), 0);
    loop {
        if interrupt.load(Ordering::Relaxed) {
            return Ok("asked to end");
        }
        let before = std::mem::replace(&mut samples, capture.counts().samples);
        if samples > before {
            last_sample = Instant::now();
        }
        if let Some(secs) = secs {
            if samples as f64 >= secs * 1000.0 {
                return Ok("enough seconds");
            }
            if last_sample.elapsed().as_secs_f64() > secs + PATIENCE_S {
                return Err(Failure::run(format!("{source}: silent; {}", source.to_check())));
            }
        }
        match stream.next(Duration::from_millis(50)) {
            Came::Bytes(bytes) => capture.bytes(&bytes).map_err(Failure::run)?,
            Came::Nothing => {}
            Came::End => return Ok("the source ended"),
            Came::Broken(error) => return Err(Failure::run(format!("{source}: the connection failed: {error}"))),
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
