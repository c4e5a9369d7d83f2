//! Captures: every tick of a run, from the board's records, as a file for other programs.
//!
//! ```text
//! bytes of RTT channel 1 or of the serial port --> records --[samples]--> samples --[csv_rows | mcap_messages]--> file
//! ```
//! A capture has the measured data: the codes of the converter, and what the sensor chain of the same core crates computes from
//! them. A lost sample is a missing row, and is counted; nothing is filled in. [`Recorder`] writes the file and, beside it,
//! `FILE.json` with the data of the whole run.

mod csv_rows;
mod header;
mod mcap_messages;
#[cfg(feature = "analysis")]
pub mod recorded;
pub mod rtt;
pub mod samples;

use crate::board::image::Image;
use crate::board::lines::{BoardLine, RECORDS};
use crate::board::transport::{Heard, Transport, TransportError};
use crate::channel::clock::unix_ns;
use crate::failure::Failure;
use crate::options::overwrite::Overwrite;
use crate::options::sensors::joints;
use crate::output;
use gait_trace::format::whole_file;
use joint_loop::setup::default_loop::Parameters;
use samples::{Booted, Counts, EdgeAt, Sample, Sampler};
use serde_json::{Value, json};
use std::ffi::OsString;
use std::fs::File;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use wire::Record;

pub use header::{SCHEMA, about};

/// The format of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Comma-separated values.
    Csv,
    /// MCAP, with messages in JSON.
    Mcap,
}

impl Format {
    /// From the extension of a file's name.
    ///
    /// # Errors
    /// Another extension, or none.
    pub fn of(path: &Path) -> Result<Self, String> {
        let extension = path.extension().map(|text| text.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("csv") => Ok(Self::Csv),
            Some("mcap") => Ok(Self::Mcap),
            _ => Err(format!("{}: allowed is a name that ends in .csv or .mcap", path.display())),
        }
    }
}

/// Refuses a capture that may not be written: its extension is not that of a format, or a file of it exists and may not be replaced.
///
/// # Errors
/// The capture may not be written.
pub fn check(path: &Path, overwrite: Overwrite) -> Result<(), Failure> {
    Format::of(path).map_err(Failure::input)?;
    // The edges of an earlier capture must not remain beside a new one.
    [path.to_owned(), beside(path), edges_beside(path)].iter().try_for_each(|file| output::check(file, overwrite))
}

/// The counts of a capture in one line.
#[must_use]
pub fn counts_in_words(out: &Path, counts: &Counts) -> String {
    let Counts { samples, lost, before, missed, malformed, edges, .. } = counts;
    let mut text = format!("{}: {samples} samples, {lost} lost, {missed} periods missed by the board", out.display());
    if *before > 0 {
        text +=
            &format!(", the first ones from the board's buffer, {:.1} s before the others", *before as f64 / 1000.0);
    }
    if *edges > 0 {
        text += &format!(", {edges} edges at the synchronisation input in {}", edges_beside(out).display());
    }
    if *malformed > 0 {
        text += &format!(", {malformed} malformed frames");
    }
    if let Some(why) = &counts.why_no_replay {
        text += &format!("; some setpoints are not known: {why}");
    }
    text
}

/// Converts bytes of RTT channel 1, or of the serial port, to samples.
pub struct LogReader {
    transport: Transport,
    /// The image that the board must be running, where it is known: the name of its board is compared.
    image: Option<Image>,
    sampler: Sampler,
    /// Time of the last reset, if known from outside of the board.
    reset_ns: Option<u64>,
}

impl LogReader {
    /// For a board that runs with these parameters, and this image, if it is known.
    #[must_use]
    pub fn new(image: Option<Image>, parameters: Parameters) -> Self {
        Self { transport: Transport::default(), image, sampler: Sampler::new(parameters), reset_ns: None }
    }

    /// The chip left reset; an unfinished frame is discarded.
    pub fn reset(&mut self, t_s: f64) {
        self.transport.restart();
        self.reset_ns = Some((t_s * 1e9).round().max(0.0) as u64);
    }

    /// Takes bytes; returns boots, and appends samples to `out`.
    ///
    /// # Errors
    /// The bytes are not of a board, or of another one than the image's.
    pub fn bytes(&mut self, bytes: &[u8], out: &mut Vec<Sample>) -> Result<Vec<Booted>, TransportError> {
        let Self { transport, image, sampler, reset_ns } = self;
        let (mut boots, mut other) = (Vec::new(), None);
        transport.push(bytes, |heard| match heard {
            Heard::Record(Record::Boot(boot))
                if image.as_ref().is_some_and(|image| !image.is_of_board(&boot.board)) =>
            {
                other = Some(boot.board.as_str().into());
            }
            Heard::Record(_) if other.is_some() => {}
            Heard::Record(record) => boots.extend(sampler.record(record, *reset_ns, out)),
            Heard::Damaged => sampler.malformed(),
        })?;
        other.map_or(Ok(boots), |board| Err(TransportError::OtherBoard { board }))
    }

    /// Appends the samples that are still waiting, at the end of the log.
    pub fn finish(&mut self, out: &mut Vec<Sample>) {
        self.sampler.finish(out);
    }

    /// The counts so far.
    #[must_use]
    pub fn counts(&self) -> &Counts {
        self.sampler.counts()
    }

    /// Edges at the synchronisation input since the last call.
    pub fn edges(&mut self) -> Vec<EdgeAt> {
        self.sampler.edges()
    }
}

enum Sink {
    Csv(csv_rows::Rows),
    Mcap(Box<mcap_messages::Messages>),
}

/// A capture that is being written.
pub struct Recorder {
    path: PathBuf,
    sink: Sink,
    /// The file of the edges at the synchronisation input; made with the first edge.
    edges: Option<File>,
    about: Value,
    /// Unix time of the zero of the axis, ns: as stated, or from the arrival of the first sample.
    zero_ns: Option<u64>,
    /// Whether the file has it.
    has_zero: bool,
    boots: Vec<Value>,
    rows: u64,
}

impl Recorder {
    /// Begins a file, after [`check`]; `about` is what runs, with these parameters. `zero_ns` is the Unix time of the zero of the
    /// capture's axis, in nanoseconds; without it, it follows from the time at which the first sample arrives.
    ///
    /// # Errors
    /// A file cannot be written, or its name has no known extension.
    pub fn begin(path: &Path, parameters: &Parameters, about: Value, zero_ns: Option<u64>) -> io::Result<Self> {
        let joints = &joints(&parameters.sensors);
        let sink = match Format::of(path).map_err(io::Error::other)? {
            Format::Csv => Sink::Csv(csv_rows::Rows::begin(path, joints)?),
            Format::Mcap => {
                Sink::Mcap(Box::new(mcap_messages::Messages::begin(path, joints, &parameters.robot, &about)?))
            }
        };
        // The edges of an earlier capture must not remain.
        match std::fs::remove_file(edges_beside(path)) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let recorder =
            Self { path: path.into(), sink, edges: None, about, zero_ns, has_zero: false, boots: Vec::new(), rows: 0 };
        recorder.write_about(false, &Value::Null, &Value::Null)?;
        Ok(recorder)
    }

    /// Writes a boot.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn boot(&mut self, booted: &Booted) -> io::Result<()> {
        let value = header::boot(booted);
        if let Sink::Mcap(messages) = &mut self.sink {
            messages.boot(&value)?;
        }
        self.boots.push(value);
        // A program that is killed leaves what a replay needs.
        self.write_about(false, &Value::Null, &Value::Null)
    }

    /// Writes samples.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn samples(&mut self, samples: &[Sample]) -> io::Result<()> {
        let Some(first) = samples.first() else { return Ok(()) };
        self.set_zero(first.time_ns)?;
        match &mut self.sink {
            Sink::Csv(rows) => rows.write(samples)?,
            Sink::Mcap(messages) => messages.write(samples)?,
        }
        self.rows += samples.len() as u64;
        Ok(())
    }

    /// Takes the Unix time of the zero of the axis, with the first data, which have this time on the axis.
    fn set_zero(&mut self, time_ns: u64) -> io::Result<()> {
        if self.has_zero {
            return Ok(());
        }
        self.has_zero = true;
        let zero_ns = *self.zero_ns.get_or_insert_with(|| unix_ns().saturating_sub(time_ns));
        match &mut self.sink {
            Sink::Csv(_) => Ok(()),
            Sink::Mcap(messages) => messages.set_zero(zero_ns),
        }
    }

    /// Writes edges at the synchronisation input.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn edges(&mut self, edges: &[EdgeAt]) -> io::Result<()> {
        let Some(first) = edges.first() else { return Ok(()) };
        self.set_zero(first.time_ns)?;
        if let Sink::Mcap(messages) = &mut self.sink {
            edges.iter().try_for_each(|edge| messages.edge(edge))?;
        }
        let mut text = String::new();
        let mut file = match self.edges.take() {
            Some(file) => file,
            None => {
                text.push_str("time_s,level\n");
                output::begin(&edges_beside(&self.path))?
            }
        };
        for edge in edges {
            text.push_str(&format!("{},{}\n", csv_rows::seconds(edge.time_ns), u8::from(edge.high)));
        }
        file.write_all(text.as_bytes())?;
        self.edges = Some(file);
        Ok(())
    }

    /// Ends the file; `result` is the result of the run.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn finish(mut self, counts: &Counts, result: &Value) -> io::Result<u64> {
        let counted = header::counts(counts);
        match &mut self.sink {
            Sink::Csv(rows) => rows.finish()?,
            Sink::Mcap(messages) => messages.finish(&counted)?,
        }
        self.write_about(true, &counted, result)?;
        Ok(self.rows)
    }

    fn write_about(&self, finished: bool, counts: &Value, result: &Value) -> io::Result<()> {
        let about = json!({
            "schema": SCHEMA,
            "recording": self.path.file_name().map(|name| name.to_string_lossy()),
            "finished": finished,
            "rows": self.rows,
            "footfall": env!("CARGO_PKG_VERSION"),
            "about": self.about,
            "clock": { "zero_unix_ns": self.zero_ns },
            "boots": self.boots,
            "counts": counts,
            "result": result,
        });
        whole_file::write(&beside(&self.path), |out| {
            serde_json::to_writer_pretty(&mut *out, &about)?;
            writeln!(out)
        })
    }
}

/// The file beside a capture.
#[must_use]
pub fn beside(capture: &Path) -> PathBuf {
    let mut name = OsString::from(capture);
    name.push(".json");
    name.into()
}

/// The file of the edges at the synchronisation input, beside a capture: the header `time_s,level`, as `footfall sync` reads it. It does not
/// exist without edges.
#[must_use]
pub fn edges_beside(capture: &Path) -> PathBuf {
    let mut name = capture.file_stem().map_or_else(OsString::new, OsString::from);
    name.push(".edges.csv");
    capture.with_file_name(name)
}

/// Why a capture cannot continue.
#[derive(Debug, thiserror::Error)]
pub enum CaptureError {
    /// What comes is not of a board, or of another one.
    #[error(transparent)]
    Log(#[from] TransportError),
    /// The file cannot be written.
    #[error("cannot be written: {0}")]
    Io(#[from] io::Error),
}

/// Writes what a board sends to a file.
pub struct Capture {
    log_reader: LogReader,
    recorder: Recorder,
    samples: Vec<Sample>,
}

impl Capture {
    /// Begins one; see [`Recorder::begin`] and [`LogReader::new`].
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn begin(
        path: &Path,
        about: Value,
        image: Option<Image>,
        parameters: Parameters,
        zero_ns: Option<u64>,
    ) -> io::Result<Self> {
        let recorder = Recorder::begin(path, &parameters, about, zero_ns)?;
        Ok(Self { log_reader: LogReader::new(image, parameters), recorder, samples: Vec::new() })
    }

    /// Takes a line of the virtual board.
    ///
    /// # Errors
    /// The log makes no sense, or the file cannot be written.
    pub fn board_line(&mut self, line: &BoardLine) -> Result<(), CaptureError> {
        match line {
            BoardLine::Boot { t_s, .. } => {
                self.log_reader.reset(*t_s);
                Ok(())
            }
            BoardLine::Rtt { channel: RECORDS, bytes, .. } => self.bytes(bytes),
            _ => Ok(()),
        }
    }

    /// Takes bytes of RTT channel 1, or of the serial port.
    ///
    /// # Errors
    /// The log makes no sense, or the file cannot be written.
    pub fn bytes(&mut self, bytes: &[u8]) -> Result<(), CaptureError> {
        self.samples.clear();
        let heard = self.log_reader.bytes(bytes, &mut self.samples);
        self.recorder.samples(&self.samples)?;
        self.recorder.edges(&self.log_reader.edges())?;
        for booted in heard? {
            self.recorder.boot(&booted)?;
        }
        Ok(())
    }

    /// The counts so far.
    #[must_use]
    pub fn counts(&self) -> &Counts {
        self.log_reader.counts()
    }

    /// Ends the file; `result` is the result of the run.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn finish(mut self, result: &Value) -> io::Result<Counts> {
        self.samples.clear();
        self.log_reader.finish(&mut self.samples);
        self.recorder.samples(&self.samples)?;
        let counts = self.log_reader.counts().clone();
        self.recorder.finish(&counts, result)?;
        Ok(counts)
    }
}
