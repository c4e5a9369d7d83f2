//! `footfall fit` and `footfall merge`: recordings in, walkers out, each with what is to be said about it.
//!
//! One recording gives a walker's file, a report, an object; a folder of recordings, or several of them, give a folder of all that,
//! with a summary, and can be interrupted, resumed, and spread over computers.

mod batch;
mod outcome;
mod summary;

use clap::Args;
use cpg_core::entrainment::EventSource;
use gait_fit::fit::{Fit, Kind, Settings, Source, fit};
use gait_fit::report;
use gait_trace::clean::condition::{LowPass, Rules};
use gait_trace::format::joint_names::AngleUnit;
use gait_trace::format::open::{ReadOptions, of_bytes};
use gait_trace::format::whole_file;
use gait_trace::{Fault, RawJoints, TraceError};
use indicatif::{ProgressBar, ProgressStyle};
use joint_loop::SERIES_HARMONICS;
use joint_units::Joint;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::board::image::sha256;
use crate::failure::Failure;
use crate::file::calibration_file;
use outcome::Outcome;

/// Options of `footfall fit`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// Recordings: CSV, OpenSim .mot and .sto, C3D, oscilloscope CSV, a capture in MCAP; or folders of them, in which files that hold
    /// no time or no joint are skipped
    #[arg(required = true, value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    /// Where the walker's parameters go; of several recordings, the folder where everything goes [default: standard output; `fits`]
    #[arg(short, long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Write a page with numbers and pictures; of several recordings, the folder where their pages go
    #[arg(long, value_name = "HTML")]
    pub report: Option<PathBuf>,
    /// Print the whole outcome as one JSON object instead of the parameters
    #[arg(long)]
    pub json: bool,
    /// What is fitted
    #[command(flatten)]
    pub method: Method,
    /// How files are read
    #[command(flatten)]
    pub reading: Reading,
    /// Several recordings: so many at a time [default: as many as the computer has cores]
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub jobs: Option<u16>,
    /// Several recordings: only those of share I of N, as in 2/8; `footfall merge` makes the summary when all are done
    #[arg(long, value_name = "I/N", value_parser = shard)]
    pub shard: Option<(u32, u32)>,
}

/// What is fitted.
#[derive(Debug, Clone, Args)]
pub struct Method {
    /// The generator: shape (phase and Fourier series), phase-coupled (R1) or thesis
    #[arg(long, value_name = "KIND", default_value = "shape", value_parser = kind)]
    pub generator: Kind,
    /// Let the shape follow a gait sensor that is worn on this joint: left_hip, right_hip, left_knee, right_knee
    #[arg(long, value_name = "JOINT", value_parser = joint)]
    pub follow: Option<Joint>,
    /// What tells the follower moments of the stride beside the angle: none, peak (of that joint; helps with a knee) or foot_switch
    #[arg(long, value_name = "SOURCE", default_value = "none", requires = "follow", value_parser = events)]
    pub events: EventSource,
    /// Harmonics of the shape [default: 6, or as many more, up to 8, as it takes to come within 0.4 degrees at the hips and 0.5 at
    /// the knees]
    #[arg(long, value_name = "N", value_parser = harmonics)]
    pub harmonics: Option<usize>,
    /// Seed of the search for the thesis' parameters
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Networks that the search may simulate
    #[arg(long, value_name = "N", default_value_t = 60_000, value_parser = evaluations)]
    pub evaluations: usize,
    /// Stride time of a recording whose time axis is a cycle and not seconds
    #[arg(long, value_name = "S", default_value_t = 1.0, value_parser = stride)]
    pub stride: f64,
}

/// How files are read.
#[derive(Debug, Clone, Args)]
pub struct Reading {
    /// Which columns are the joints, by name or number from 1: left_hip=COLUMN,...,time=COLUMN
    #[arg(long, value_name = "MAP")]
    pub map: Vec<String>,
    /// Unit of the angles where the file does not say it: degrees or radians
    #[arg(long, value_name = "UNIT")]
    pub unit: Option<AngleUnit>,
    /// Low-pass before anything else is done: customary (zero-lag Butterworth, 6 Hz for walking, 12 Hz for running), off, or a corner
    /// in Hz [default: customary; of `entrain`: off]
    #[arg(long, value_name = "HOW", value_parser = low_pass)]
    pub low_pass: Option<LowPass>,
    /// Calibration of the sensor, for recordings of volts
    #[arg(long, value_name = "TOML")]
    pub calibration: Option<PathBuf>,
}

impl Reading {
    /// As asked for, else as is customary.
    pub(crate) fn low_pass_or_customary(&self) -> LowPass {
        self.low_pass.unwrap_or(LowPass::Customary)
    }
}

fn kind(text: &str) -> Result<Kind, String> {
    let all = Kind::ALL.map(Kind::name).join(", ");
    Kind::ALL.into_iter().find(|kind| kind.name() == text).ok_or(format!("allowed is one of {all}"))
}

fn joint(text: &str) -> Result<Joint, String> {
    let all = Joint::ALL.map(Joint::name).join(", ");
    Joint::ALL.into_iter().find(|joint| joint.name() == text).ok_or(format!("allowed is one of {all}"))
}

fn events(text: &str) -> Result<EventSource, String> {
    let all = EventSource::ALL.map(EventSource::name).join(", ");
    EventSource::ALL.into_iter().find(|source| source.name() == text).ok_or(format!("allowed is one of {all}"))
}

fn low_pass(text: &str) -> Result<LowPass, String> {
    match (text, text.parse()) {
        ("customary", _) => Ok(LowPass::Customary),
        ("off", _) => Ok(LowPass::Off),
        (_, Ok(hz)) if (1.0..=100.0).contains(&hz) => Ok(LowPass::At(hz)),
        _ => Err("allowed is customary, off, or 1 to 100 Hz".into()),
    }
}

fn harmonics(text: &str) -> Result<usize, String> {
    text.parse()
        .ok()
        .filter(|n| (1..=SERIES_HARMONICS).contains(n))
        .ok_or(format!("allowed is 1 to {SERIES_HARMONICS}"))
}

fn evaluations(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|n| (1_000..=100_000_000).contains(n)).ok_or("allowed is 1000 to 100000000".into())
}

fn stride(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|s| (0.2..=20.0).contains(s)).ok_or("allowed is 0.2 to 20 seconds".into())
}

fn shard(text: &str) -> Result<(u32, u32), String> {
    let wanted = || "allowed is I/N with I from 1 to N, as in 2/8".to_string();
    let (i, n) = text.split_once('/').ok_or_else(wanted)?;
    let (i, n) = (i.parse().map_err(|_| wanted())?, n.parse().map_err(|_| wanted())?);
    if (1..=n).contains(&i) { Ok((i, n)) } else { Err(wanted()) }
}

impl Method {
    /// Refuses what the generator would not heed.
    fn check(&self) -> Result<(), Failure> {
        if self.generator == Kind::Shape {
            return Ok(());
        }
        let option = match (self.harmonics, self.follow) {
            (Some(_), _) => "--harmonics",
            (None, Some(_)) => "--follow",
            (None, None) => return Ok(()),
        };
        Err(Failure::input(format!(
            "{option} with --generator {}: allowed is {option} with --generator shape, which alone heeds it",
            self.generator.name()
        )))
    }

    fn settings(&self, reading: &Reading, compare: bool) -> Settings {
        Settings {
            generator: self.generator,
            harmonics: self.harmonics,
            seed: self.seed,
            evaluations: self.evaluations,
            stride_s: self.stride,
            rules: Rules { low_pass: reading.low_pass_or_customary(), ..Rules::default() },
            compare,
            follow: self.follow,
            events: self.events,
            ..Settings::default()
        }
    }
}

/// Runs the command.
///
/// # Errors
/// Bad input, a file that cannot be written, or, of several recordings, some that could not be fitted. A file in a folder that has no time
/// or no joint is no recording of gait, and no failure.
pub fn run(options: &Options) -> Result<(), Failure> {
    options.method.check()?;
    match options.recordings.as_slice() {
        [one] if !one.is_dir() && options.shard.is_none() && options.jobs.is_none() => single(options, one),
        _ => batch::run(options),
    }
}

/// Makes the summary of a folder of outcomes, wherever they were made.
///
/// # Errors
/// The folder holds none, or the summary cannot be written.
pub fn merge(folder: &Path) -> Result<(), Failure> {
    summary::merge(folder)
}

/// A spinner on a terminal, nothing elsewhere.
fn spinner() -> ProgressBar {
    let bar = ProgressBar::new_spinner();
    if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed} {msg}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(100));
    bar
}

fn single(options: &Options, path: &Path) -> Result<(), Failure> {
    let outputs: Vec<&PathBuf> = [&options.out, &options.report].into_iter().flatten().collect();
    for (n, file) in outputs.iter().enumerate() {
        let wrong = |why: &str| Err(Failure::input(format!("{}: {why}", file.display())));
        if file.is_dir() {
            return wrong("is a folder; allowed is the name of a file, or several recordings");
        }
        if file.parent().is_some_and(|folder| !folder.as_os_str().is_empty() && !folder.is_dir()) {
            return wrong("there is no such folder");
        }
        if same_file(file, path) || options.reading.calibration.as_ref().is_some_and(|input| same_file(file, input)) {
            return wrong("is what is read; allowed is another file");
        }
        if outputs[..n].iter().any(|other| same_file(file, other) || other == file) {
            return wrong("is named twice; allowed are different files for parameters and report");
        }
    }
    let bar = spinner();
    let began = std::time::Instant::now();
    let settings = options.method.settings(&options.reading, options.report.is_some());
    let fitted =
        of_file(path, &name_of(path), &options.reading, &settings, &mut |what| bar.set_message(what.to_owned()));
    bar.finish_and_clear();
    let fitted = fitted?;
    for note in fitted.notes.iter() {
        eprintln!("note: {note}");
    }
    for finding in &fitted.conditioned.findings {
        eprintln!("found: {finding}");
    }
    if let Some(file) = &options.out {
        write(file, &fitted.file.to_toml())?;
    }
    if let Some(file) = &options.report {
        write(file, &page(&fitted, &options.method, &options.reading, path)?)?;
    }
    if options.json {
        let outcome = Outcome::of(&fitted, began.elapsed().as_secs_f64());
        return crate::cli::print(&(outcome.to_json()? + "\n"));
    }
    if options.out.is_none() {
        return crate::cli::print(&fitted.file.to_toml());
    }
    eprintln!("{}", outcome::line(&fitted));
    Ok(())
}

/// Both are there, and are one.
fn same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

fn write(file: &Path, text: &str) -> Result<(), Failure> {
    whole_file::write(file, |out| out.write_all(text.as_bytes()))
        .map_err(|error| Failure::run(format!("{}: cannot be written: {error}", file.display())))
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// The bytes of a file, as far as a recording may be long.
fn bytes_of(path: &Path) -> Result<Vec<u8>, Failure> {
    let wrong = |error: std::io::Error| Failure::input(format!("{}: cannot be read: {error}", path.display()));
    // Opening a pipe would wait for somebody to write into it.
    if !std::fs::metadata(path).map_err(wrong)?.is_file() {
        return Err(Failure::input(format!("{}: is no regular file; allowed is a recording on disk", path.display())));
    }
    let file = std::fs::File::open(path).map_err(wrong)?;
    let most = gait_trace::format::csv_file::MAX_BYTES;
    let too_large =
        || Failure::input(format!("{}: is larger than {} MiB, which is allowed", path.display(), most >> 20));
    if file.metadata().map_err(wrong)?.len() > most {
        return Err(too_large());
    }
    let mut bytes = vec![];
    file.take(most + 1).read_to_end(&mut bytes).map_err(wrong)?;
    if bytes.len() as u64 > most { Err(too_large()) } else { Ok(bytes) }
}

/// Reads and fits one file; `name` is what the outcome calls it.
fn of_file(
    path: &Path,
    name: &str,
    reading: &Reading,
    settings: &Settings,
    progress: &mut dyn FnMut(&str),
) -> Result<Fit, Failure> {
    of_read(path, &bytes_of(path)?, name, reading, settings, progress)
}

/// Reads a recording as it is; `sideless` is the joint of one that does not say its side.
pub(crate) fn raw(path: &Path, reading: &Reading, sideless: Option<Joint>) -> Result<RawJoints, Failure> {
    raw_of(path, &bytes_of(path)?, reading, sideless)
}

fn raw_of(path: &Path, bytes: &[u8], reading: &Reading, sideless: Option<Joint>) -> Result<RawJoints, Failure> {
    read_of(path, bytes, reading, sideless)?.map_err(Failure::input)
}

/// As [`raw_of`], with what is wrong with the recording apart from what is wrong with the options.
fn read_of(
    path: &Path,
    bytes: &[u8],
    reading: &Reading,
    sideless: Option<Joint>,
) -> Result<Result<RawJoints, TraceError>, Failure> {
    let sensor = match &reading.calibration {
        Some(file) => Some(calibration_file::read(file).map_err(Failure::input)?),
        None => None,
    };
    let calibration = sensor.as_ref().map(|sensor| &sensor.calibration);
    let mut how = ReadOptions { unit: reading.unit, calibration, sideless, ..ReadOptions::default() };
    for map in &reading.map {
        how.add_map(map).map_err(Failure::input)?;
    }
    Ok(of_bytes(&path.display().to_string(), bytes, &how))
}

/// Why a file is no recording of gait at all, if it is none: a table of something else, or a text.
fn other_than_gait(path: &Path, bytes: &[u8], reading: &Reading) -> Option<String> {
    let error = read_of(path, bytes, reading, None).ok()?.err()?;
    let other = matches!(*error.fault, Fault::NoTime { .. } | Fault::NoJoints { .. } | Fault::NoTrajectories { .. });
    other.then(|| error.to_string())
}

fn of_read(
    path: &Path,
    bytes: &[u8],
    name: &str,
    reading: &Reading,
    settings: &Settings,
    progress: &mut dyn FnMut(&str),
) -> Result<Fit, Failure> {
    progress("reading");
    let raw = raw_of(path, bytes, reading, None)?;
    let source = Source { name: name.into(), sha256: sha256(bytes) };
    fit(&source, &raw, settings, progress).map_err(Failure::input)
}

fn page(fitted: &Fit, method: &Method, reading: &Reading, path: &Path) -> Result<String, Failure> {
    let mut words: Vec<String> =
        vec!["footfall fit".into(), quoted(&name_of(path)), "--generator".into(), method.generator.name().into()];
    let mut option = |name: &str, value: String| words.extend([format!("--{name}"), quoted(&value)]);
    if let Some(harmonics) = method.harmonics {
        option("harmonics", harmonics.to_string());
    }
    if let Some(joint) = method.follow {
        option("follow", joint.name().into());
        option("events", method.events.name().into());
    }
    match reading.low_pass {
        None | Some(LowPass::Customary) => {}
        Some(LowPass::Off) => option("low-pass", "off".into()),
        Some(LowPass::At(hz)) => option("low-pass", hz.to_string()),
    }
    reading.map.iter().for_each(|map| option("map", map.clone()));
    if let Some(unit) = reading.unit {
        option("unit", unit.words().into());
    }
    if let Some(calibration) = &reading.calibration {
        option("calibration", name_of(calibration));
    }
    option("seed", method.seed.to_string());
    option("evaluations", method.evaluations.to_string());
    option("stride", method.stride.to_string());
    let command = words.join(" ") + " -o walker.toml --report walker.html";
    report::html(fitted, &command).map_err(Failure::run)
}

/// As a shell takes it for one word.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,".contains(c);
    if !word.is_empty() && word.chars().all(plain) { word.into() } else { format!("'{}'", word.replace('\'', r"'\''")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_where_a_shell_would_split_them() {
        assert_eq!(quoted("left_hip=3,time=1"), "left_hip=3,time=1");
        assert_eq!(quoted("my walk.csv"), "'my walk.csv'");
        assert_eq!(quoted("it's"), r"'it'\''s'");
        assert_eq!(quoted(""), "''");
    }

    #[test]
    fn options_that_make_no_sense_are_refused_by_what_is_allowed() {
        assert_eq!(shard("2/8"), Ok((2, 8)));
        for bad in ["", "0/8", "9/8", "2", "2/", "a/b", "-1/2"] {
            assert!(shard(bad).unwrap_err().contains("allowed"), "{bad}");
        }
        assert!(events("heel").unwrap_err().contains("none, peak, foot_switch"));
        assert!(kind("fourier").unwrap_err().contains("shape, phase-coupled, thesis"));
        assert!(harmonics("0").is_err() && harmonics("9").is_err() && harmonics("6") == Ok(6));
        assert_eq!((low_pass("off"), low_pass("8")), (Ok(LowPass::Off), Ok(LowPass::At(8.0))));
        assert!(low_pass("0").is_err() && low_pass("nan").is_err());
        assert!(stride("0").is_err() && stride("nan").is_err() && stride("1.1") == Ok(1.1));
    }
}
