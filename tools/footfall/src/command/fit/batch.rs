//! Many recordings: all that a folder holds, so many at a time, each with its own outcome on disk the moment it is there.
//!
//! An outcome that is there already, of the same bytes by the same settings and program, is not made again: a run that was
//! interrupted goes on where it was, and shares of a run on several computers do not meet.

use rayon::iter::{IntoParallelIterator, ParallelIterator};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};

use super::outcome::{Failed, Outcome};
use super::{Options, bytes_of, of_read, page, summary, write};
use crate::board::image::sha256;
use crate::failure::Failure;

/// Endings of files that may be recordings.
const ENDINGS: [&str; 6] = ["csv", "mot", "sto", "c3d", "mcap", "txt"];

/// Who made an outcome: another version may fit otherwise.
const MADE_BY: &str = concat!("footfall ", env!("CARGO_PKG_VERSION"));

/// How one recording ended.
enum End {
    Fitted,
    Known,
    Failed(String),
    /// No recording of gait.
    Skipped(String),
}

/// A recording and the name that its files get.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Recording {
    /// The way to it within the folder that was named, with `__` between the parts.
    name: String,
    path: PathBuf,
    /// Found in a folder, not named.
    found: bool,
}

pub(crate) fn run(options: &Options) -> Result<(), Failure> {
    let folder = options.out.clone().unwrap_or_else(|| "fits".into());
    let all = recordings(&options.recordings, &folder)?;
    let share: Vec<&Recording> = match options.shard {
        None => all.iter().collect(),
        Some((i, n)) => all.iter().skip(i as usize - 1).step_by(n as usize).collect(),
    };
    for folder in std::iter::once(&folder).chain(&options.report) {
        std::fs::create_dir_all(folder)
            .map_err(|error| Failure::run(format!("{}: cannot be made: {error}", folder.display())))?;
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.jobs.map_or(0, usize::from)).build();
    let pool = pool.map_err(Failure::run)?;
    let bar = ProgressBar::new(share.len() as u64);
    if let Ok(style) = ProgressStyle::with_template("{elapsed} {bar:30} {pos}/{len} {eta} {msg}") {
        bar.set_style(style);
    }
    let one = |recording: &Recording| {
        let end = one(recording, options, &folder);
        bar.inc(1);
        bar.set_message(recording.name.clone());
        // Not on a terminal: a line each, so that a log shows how far it is.
        match &end {
            Ok(End::Fitted) if bar.is_hidden() => eprintln!("fitted: {}", recording.name),
            Ok(End::Known) if bar.is_hidden() => eprintln!("known: {}", recording.name),
            Ok(End::Failed(why)) => bar.suspend(|| eprintln!("failed: {why}")),
            Ok(End::Skipped(why)) => bar.suspend(|| eprintln!("skipped: {why}")),
            _ => {}
        }
        end
    };
    let ends = pool.install(|| share.into_par_iter().map(one).collect::<Result<Vec<End>, Failure>>());
    bar.finish_and_clear();
    let ends = ends?;
    let count = |of: fn(&End) -> bool| ends.iter().filter(|end| of(end)).count();
    let (fitted, known) = (count(|end| matches!(end, End::Fitted)), count(|end| matches!(end, End::Known)));
    let skipped = count(|end| matches!(end, End::Skipped(_)));
    let failed = ends.len() - fitted - known - skipped;
    let no_gait = if skipped == 0 { String::new() } else { format!(", {skipped} skipped as no recording of gait") };
    eprintln!("{fitted} fitted, {known} already known, {failed} failed{no_gait}, in {}", folder.display());
    if skipped > 0 && skipped == ends.len() && options.shard.is_none() {
        return Err(Failure::input(format!("none of {skipped} files is a recording of gait; each says why above")));
    }
    if options.shard.is_none() {
        summary::merge(&folder)?;
    }
    if options.json {
        print_all(&folder, &all)?;
    }
    if failed == 0 {
        Ok(())
    } else {
        Err(Failure::run(format!("{failed} of {} recordings could not be fitted", ends.len() - skipped)))
    }
}

/// Every recording under the paths, by name; never the same file twice.
fn recordings(paths: &[PathBuf], out: &Path) -> Result<Vec<Recording>, Failure> {
    let mut all = vec![];
    for path in paths {
        if path.is_dir() {
            walk(path, path, out, &mut all)?;
        } else if path.exists() {
            all.push(Recording { name: super::name_of(path), path: path.clone(), found: false });
        } else {
            return Err(Failure::input(format!("{}: there is no such file or folder", path.display())));
        }
    }
    all.sort();
    all.dedup();
    if all.is_empty() {
        let paths: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
        let endings = ENDINGS.join(", .");
        return Err(Failure::input(format!("{}: no recording there; looked for are .{endings}", paths.join(", "))));
    }
    apart(&mut all);
    Ok(all)
}

/// Gives recordings of one name names of their own, by the order of their paths, and says so; one file by two paths is one recording.
fn apart(all: &mut Vec<Recording>) {
    let real = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_owned());
    all.dedup_by(|later, first| later.name == first.name && real(&later.path) == real(&first.path));
    let mut taken: BTreeSet<String> = all.iter().map(|recording| recording.name.clone()).collect();
    for n in 1..all.len() {
        if all[..n].iter().any(|before| before.name == all[n].name) {
            let (stem, ending) = all[n].name.rsplit_once('.').unwrap_or((&all[n].name, ""));
            let free = (2..).map(|k| format!("{stem}~{k}.{ending}")).find(|name| !taken.contains(name));
            let name = free.unwrap_or_default();
            eprintln!("note: {} is called {name}: there are two of its name", all[n].path.display());
            taken.insert(name.clone());
            all[n].name = name;
        }
    }
}

fn walk(folder: &Path, top: &Path, out: &Path, all: &mut Vec<Recording>) -> Result<(), Failure> {
    let wrong = |error: std::io::Error| Failure::input(format!("{}: cannot be read: {error}", folder.display()));
    for entry in std::fs::read_dir(folder).map_err(wrong)? {
        let entry = entry.map_err(wrong)?;
        let path = entry.path();
        // A link to a folder may lead back to where it stands; a link to a file is a recording by another name.
        if entry.file_type().map_err(wrong)?.is_symlink() && path.is_dir() {
            continue;
        }
        if path.is_dir() {
            // What an earlier run wrote is no recording.
            if path.canonicalize().ok() != out.canonicalize().ok() || !out.exists() {
                walk(&path, top, out, all)?;
            }
        } else if path.extension().is_some_and(|ending| ENDINGS.iter().any(|known| ending.eq_ignore_ascii_case(known)))
        {
            let within = path.strip_prefix(top).unwrap_or(&path);
            let parts: Vec<_> = within.iter().map(|part| part.to_string_lossy()).collect();
            all.push(Recording { name: parts.join("__"), path, found: true });
        }
    }
    Ok(())
}

/// Where the outcome of a recording is.
fn outcome_file(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!("{name}.fit.json"))
}

/// Fits one recording unless that has been done. Only a folder that cannot be written ends the whole run.
fn one(recording: &Recording, options: &Options, folder: &Path) -> Result<End, Failure> {
    let began = Instant::now();
    let bytes = match bytes_of(&recording.path) {
        Ok(bytes) => bytes,
        // Perhaps readable the next time: nothing is kept.
        Err(why) => return Ok(End::Failed(why.to_string())),
    };
    let (hash, file) = (sha256(&bytes), outcome_file(folder, &recording.name));
    let walker = folder.join(format!("{}.toml", recording.name));
    let report = options.report.as_ref().map(|folder| folder.join(format!("{}.html", recording.name)));
    let calibration = match &options.reading.calibration {
        // One that cannot be read is an error of every recording.
        Some(path) => std::fs::read(path).map_or_else(|error| error.to_string(), |bytes| sha256(&bytes)),
        None => String::new(),
    };
    let asked = format!("{:?}; {:?}; {calibration}", options.method, options.reading);
    if report.as_ref().is_none_or(|page| page.exists())
        && let Some(known) = known(&file, &hash, &asked)
    {
        return Ok(match known {
            Some(error) => End::Failed(error),
            None if walker.exists() => End::Known,
            None => return fit_and_keep(recording, options, &bytes, &asked, began, folder),
        });
    }
    if recording.found
        && let Some(why) = super::other_than_gait(&recording.path, &bytes, &options.reading)
    {
        return Ok(End::Skipped(why));
    }
    fit_and_keep(recording, options, &bytes, &asked, began, folder)
}

/// What an earlier run found for the same bytes and the same wishes: its error, if it was one.
fn known(file: &Path, hash: &str, asked: &str) -> Option<Option<String>> {
    let value: Value = serde_json::from_slice(&std::fs::read(file).ok()?).ok()?;
    let same = value["sha256"] == hash && value["asked"] == asked && value["made_by"] == MADE_BY;
    same.then(|| value["error"].as_str().map(str::to_owned))
}

fn fit_and_keep(
    recording: &Recording,
    options: &Options,
    bytes: &[u8],
    asked: &str,
    began: Instant,
    folder: &Path,
) -> Result<End, Failure> {
    let settings = options.method.settings(&options.reading, options.report.is_some());
    let fitted = of_read(&recording.path, bytes, &recording.name, &options.reading, &settings, &mut |_| ());
    let (value, end) = match &fitted {
        Ok(fitted) => {
            write(&folder.join(format!("{}.toml", recording.name)), &fitted.file.to_toml())?;
            if let Some(pages) = &options.report {
                let page = page(fitted, &options.method, &options.reading, &recording.path)?;
                write(&pages.join(format!("{}.html", recording.name)), &page)?;
            }
            (serde_json::to_value(Outcome::of(fitted, began.elapsed().as_secs_f64())), End::Fitted)
        }
        Err(why) => {
            let failed = Failed {
                recording: &recording.name,
                sha256: &sha256(bytes),
                settings: settings.to_string(),
                made_by: MADE_BY,
                error: why.to_string(),
            };
            (serde_json::to_value(failed), End::Failed(why.to_string()))
        }
    };
    let mut value = value.map_err(Failure::run)?;
    value["asked"] = asked.into();
    // Last, and whole or not at all: once it is there, everything else is.
    write(&outcome_file(folder, &recording.name), &(value.to_string() + "\n"))?;
    Ok(end)
}

/// One object a line, in the order of the names.
fn print_all(folder: &Path, all: &[Recording]) -> Result<(), Failure> {
    let mut text = String::new();
    for recording in all {
        // Not there: another share's, or one that could not be read.
        if let Ok(outcome) = std::fs::read_to_string(outcome_file(folder, &recording.name)) {
            text += &outcome;
        }
    }
    crate::cli::print(&text)
}
