//! `footfall record`: what a board measures, every tick of it, as CSV or MCAP.
//!
//! The board is the virtual one, or a real one whose RTT bytes a debug probe's program hands on.

use crate::board::image::Image;
use crate::cli;
use crate::command::watch;
use crate::command::watch::{Played, output_file};
use crate::failure::Failure;
use crate::file::capture;
use crate::file::capture::rtt::{Came, Source, Stream};
use crate::file::capture::samples::Counts;
use crate::file::capture::{Capture, about_sensors};
use clap::Args;
use joint_loop::setup::default_loop::Parameters;
use joint_loop::store::{generator_record, sensor_record};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Options of `footfall record`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// Where it goes: a name that ends in .csv or .mcap; what belongs to the whole run goes to FILE.json
    #[arg(short, long, value_name = "FILE")]
    pub out: PathBuf,
    /// The firmware's ELF file: the one that runs on the board
    #[arg(long, value_name = "FILE")]
    pub elf: PathBuf,
    /// Record the virtual board: its program
    #[arg(long, value_name = "PROGRAM", required_unless_present = "rtt")]
    pub virtual_board: Option<PathBuf>,
    /// Record a real board: the raw bytes of its RTT up channel 0, from a file, `-` (standard input) or tcp:HOST:PORT. Reset the
    /// board after this has begun: what it says at its boot makes volts of codes
    #[arg(
        long,
        value_name = "SOURCE",
        conflicts_with_all = ["virtual_board", "trace", "press", "disarm", "pace", "plain", "board"]
    )]
    pub rtt: Option<Source>,
    /// What is played, and how it is shown
    #[command(flatten)]
    pub played: Played,
}

/// Runs the command. `interrupt` is set by a signal that asks it to end.
///
/// # Errors
/// Bad input, a board or a source that cannot be reached, a file that cannot be written, or a run that was not sound.
pub fn run(options: &Options, interrupt: &Arc<AtomicBool>) -> Result<(), Failure> {
    match (&options.rtt, &options.virtual_board) {
        (Some(source), _) => from_rtt(options, source, interrupt),
        (None, Some(board)) => {
            let watched = watch::Options {
                elf: options.elf.clone(),
                virtual_board: board.clone(),
                record: Some(options.out.clone()),
                played: options.played.clone(),
            };
            watch::run(&watched, interrupt)
        }
        (None, None) => Err(Failure::input("nothing to record; allowed is --virtual-board or --rtt")),
    }
}

fn from_rtt(options: &Options, source: &Source, interrupt: &AtomicBool) -> Result<(), Failure> {
    let image = Image::read(&options.elf).map_err(Failure::input)?;
    let parameters = options.played.parameters()?;
    let Parameters { generator, sensors } = &parameters;
    output_file(&options.out)?;
    let stream =
        Stream::open(source).map_err(|error| Failure::input(format!("{source}: cannot be opened: {error}")))?;
    let about = json!({
        "elf": options.elf,
        "elf_sha256": image.sha256,
        "rtt": source.to_string(),
        "params": options.played.params,
        "generator": generator.name(),
        "generator_crc": format!("{:08x}", generator_record::record_of(generator).crc()),
        "sensors": about_sensors(sensors),
        "sensors_crc": format!("{:08x}", sensor_record::record_of(sensors).crc()),
        "secs": options.played.secs,
    });
    let writing = |error| Failure::run(format!("{}: cannot be written: {error}", options.out.display()));
    let mut capture = Capture::begin(&options.out, about, &image, parameters.clone()).map_err(writing)?;
    let ended = listen(&mut capture, &stream, source, options.played.secs, interrupt);
    // Whatever happened, what has come is a finished file.
    let counts =
        capture.finish(&json!({ "ended": ended.as_ref().map_or_else(ToString::to_string, ToString::to_string) }));
    let counts = counts.map_err(writing)?;
    if options.played.json {
        let object = json!({
            "type": "end", "samples": counts.samples, "lost_samples": counts.lost, "missed_periods": counts.missed,
            "dropped_by_the_board": counts.board_dropped, "confirmed_ticks": counts.confirmed,
            "different_ticks": counts.different, "malformed_frames": counts.malformed, "no_replay": counts.why_no_replay,
        });
        cli::print(&format!("{object}\n"))?;
    }
    ended?;
    sound(&options.out, &counts)
}

/// Takes what comes until it ends, enough has come, or somebody asks for the end. Gives the reason.
fn listen(
    capture: &mut Capture<'_>,
    stream: &Stream,
    source: &Source,
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
            Came::Broken(error) => return Err(Failure::run(format!("{source}: broke off: {error}"))),
        }
        for line in capture.talk() {
            eprintln!("board: {line}");
        }
    }
}

/// What the capture came to in a line; a failure if board and host differ or nothing came.
fn sound(out: &Path, counts: &Counts) -> Result<(), Failure> {
    eprintln!("{}", told(out, counts));
    if counts.samples == 0 {
        return Err(Failure::run("no sample came: does the board run, and is this its RTT channel 0?"));
    }
    if counts.different > 0 {
        let words: Vec<String> = counts.differences.iter().map(ToString::to_string).collect();
        return Err(Failure::run(format!("board and host differ: {}", words.join("; "))));
    }
    Ok(())
}

/// What a capture came to, in a line.
#[must_use]
pub fn told(out: &Path, counts: &Counts) -> String {
    let Counts { samples, lost, missed, malformed, edges, .. } = counts;
    let mut text = format!("{}: {samples} samples, {lost} lost, {missed} periods missed by the board", out.display());
    if *edges > 0 {
        text += &format!(", {edges} edges at the synchronisation input in {}", capture::edges_beside(out).display());
    }
    if *malformed > 0 {
        text += &format!(", {malformed} frames without sense");
    }
    if let Some(why) = &counts.why_no_replay {
        text += &format!("; setpoints are not known throughout: {why}");
    }
    text
}
