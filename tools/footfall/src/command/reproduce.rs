//! `footfall reproduce`: computes both papers again: figures, tables, searches, and every claim with its verdict, as a folder of files.

use clap::Args;
use gait_trace::stride::strides::segment;
use gait_trace::{Conditioned, LowPass, ReadOptions, Rules, Strides, condition};
use reproduce::papers::claim::{Claim, to_csv, to_markdown};
use reproduce::papers::page::page;
use reproduce::papers::run as compute;
use reproduce::papers::settings::Settings;
use reproduce::papers::study::Study;
use reproduce::processor;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::board::feed::{DEFAULT_TRACE, DEFAULT_TRACE_NAME};
use crate::failure::Failure;
use crate::messages;
use crate::options::overwrite::Overwrite;
use crate::output;
use crate::spinner;

/// Options of `footfall reproduce`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// The folder to write to; made if it is not there
    #[arg(value_name = "OUT")]
    pub out: PathBuf,
    /// End the searches early: the same figures and claims in seconds, with larger errors of the searches
    #[arg(long)]
    pub quick: bool,
    /// First seed of the searches; they use this one and the nine after it
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Print the content of claims.json instead of the names of the files
    #[arg(long)]
    pub json: bool,
    /// Whether files may be replaced
    #[command(flatten)]
    pub overwrite: Overwrite,
}

/// The content of `claims.json`.
#[derive(Debug, Serialize)]
struct Claims<'a> {
    /// Version of these keys.
    schema: u32,
    /// The program.
    made_by: &'static str,
    /// The command line that makes it again.
    command: &'a str,
    /// First seed.
    seed: u64,
    /// Whether the searches ended early.
    quick: bool,
    claims: &'a [Claim],
}

/// Runs the command.
///
/// # Errors
/// The folder is not empty and may not be written to, or a file cannot be written.
pub fn run(options: &Options) -> Result<(), Failure> {
    prepare(&options.out, options.overwrite)?;
    let (began, before) = (Instant::now(), processor::seconds());
    let bar = spinner::begin();
    let mut progress = |step: &str| {
        if bar.is_hidden() {
            messages::status(format_args!("{:5.1} s: {step}", began.elapsed().as_secs_f64()));
        } else {
            bar.set_message(step.to_owned());
        }
    };
    let settings = Settings { seed: options.seed, quick: options.quick };
    let study = compute(&settings, &strides()?, &mut progress);
    bar.finish_and_clear();
    let study = study.map_err(Failure::run)?;
    let processor_s = before.zip(processor::seconds()).map(|(before, after)| after - before);
    let seconds = (began.elapsed().as_secs_f64(), processor_s);
    let command = command(options);
    let claims = Claims {
        schema: 1,
        made_by: concat!("footfall ", env!("CARGO_PKG_VERSION")),
        command: &command,
        seed: options.seed,
        quick: options.quick,
        claims: &study.claims,
    };
    let claims = serde_json::to_string_pretty(&claims).map_err(Failure::run)? + "\n";
    let files = files(&study, &command, seconds, claims.clone()).map_err(Failure::run)?;
    let written = output::write_all(&options.out, &files, options.overwrite)?;
    let processor = processor_s.map_or_else(String::new, |seconds| format!(", {seconds:.1} s of processor time"));
    messages::status(format_args!("{} files in {:.1} s{processor}", written.len(), seconds.0));
    messages::next("read it in a browser", options.out.join("index.html").display());
    if options.json {
        return output::print(&claims);
    }
    output::print(&written.iter().map(|path| format!("{}\n", path.display())).collect::<String>())
}

/// Makes the folder, before minutes are spent; refuses one that is not empty.
fn prepare(out: &Path, overwrite: Overwrite) -> Result<(), Failure> {
    let wrong = |why: &dyn std::fmt::Display| Failure::input(format!("{}: {why}", out.display()));
    if out.exists() && !out.is_dir() {
        return Err(wrong(&"is a file; allowed is a folder, which is made if it is not there"));
    }
    std::fs::create_dir_all(out).map_err(|error| wrong(&format_args!("cannot be made: {error}")))?;
    let empty = std::fs::read_dir(out).map_err(|error| wrong(&error))?.next().is_none();
    if empty || overwrite.force {
        return Ok(());
    }
    Err(wrong(&"has files in it, which are kept; name another folder, or write into it with --force"))
}

/// The strides of the default recording.
fn strides() -> Result<Strides, Failure> {
    let raw = gait_trace::format::open::of_bytes(DEFAULT_TRACE_NAME, DEFAULT_TRACE.as_bytes(), &ReadOptions::default());
    let rules = Rules { low_pass: LowPass::Customary, ..Rules::default() };
    let conditioned: Conditioned = condition(&raw.map_err(Failure::run)?, &rules).map_err(Failure::run)?;
    segment(&conditioned).map_err(Failure::run)
}

/// The command line that makes the same again.
fn command(options: &Options) -> String {
    let quick = if options.quick { " --quick" } else { "" };
    format!("footfall reproduce OUT --seed {}{quick}", options.seed)
}

/// Names and contents of all files.
fn files(
    study: &Study,
    command: &str,
    seconds: (f64, Option<f64>),
    claims: String,
) -> Result<Vec<(String, String)>, String> {
    let mut files = vec![
        ("index.html".into(), page(study, command, seconds)?),
        ("claims.json".into(), claims),
        ("claims.csv".into(), to_csv(&study.claims)),
        ("claims.md".into(), to_markdown(&study.claims)),
    ];
    for figure in study.figures() {
        files.push((format!("{}.svg", figure.name), figure.svg(command)?));
        files.push((format!("{}.csv", figure.name), figure.csv()));
    }
    files.extend(study.tables().map(|table| (format!("{}.csv", table.name), table.csv())));
    Ok(files)
}
