//! Fits many recordings in parallel, each with its own result on disk as soon as it is fitted.
//!
//! A result that exists already, of the same bytes by the same settings and program, is not computed again: an interrupted run goes on
//! where it stopped, and the shares of several computers do not interfere.

use generator_file::file::GeneratorFile;
use indicatif::{ProgressBar, ProgressStyle};
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::job::{Input, Job, NotFitted};
use super::outcome::{Failed, Outcome, Skipped};
use super::recordings::{Found, Recording, recordings};
use crate::board::image::sha256;
use crate::failure::Failure;
use crate::file::bounded;
use crate::file::fit_summary;
use crate::file::recording;
use crate::messages::{self, Amount};
use crate::options::overwrite::Overwrite;
use crate::output;

/// What a result has: one with less is computed again.
const CONTENT: &str = "curves, measures, warnings, why it is not used";

/// The program that computed a result: another version may fit otherwise.
const MADE_BY: &str = concat!("footfall ", env!("CARGO_PKG_VERSION"));

/// How a batch runs and where its results go.
pub(super) struct Batch {
    /// The folder of the results.
    pub(super) out: PathBuf,
    /// The folder of the report pages.
    pub(super) report: Option<PathBuf>,
    pub(super) json: bool,
    /// Generators that do not walk or are refused are written too.
    pub(super) force_write: bool,
    /// Recordings at a time; `None` for the number of cores.
    pub(super) jobs: Option<u16>,
    /// Share I of N.
    pub(super) shard: Option<(u32, u32)>,
    /// Whether files of others may be replaced.
    pub(super) overwrite: Overwrite,
}

/// How one recording ended.
enum End {
    /// With so many warnings.
    Fitted(usize),
    /// Fitted by an earlier run, with so many warnings.
    Known(usize),
    /// Fitted, but the generator does not walk on the robot, or is refused; with so many warnings.
    NotUsed(String, usize),
    Failed(String),
    /// No recording of gait.
    Skipped(String),
}

/// Fits all recordings under the paths.
pub(super) fn run(job: &Job, paths: &[PathBuf], batch: &Batch) -> Result<(), Failure> {
    let Found { all, others } = recordings(paths, &batch.out)?;
    for folder in std::iter::once(&batch.out).chain(&batch.report) {
        std::fs::create_dir_all(folder)
            .map_err(|error| Failure::input(format!("{}: cannot be made: {error}", folder.display())))?;
    }
    // Before any work: a run of hours must not end at a file that it may not replace.
    all.iter().try_for_each(|recording| Files::of(&recording.name, batch).check(&recording.name, batch.overwrite))?;
    if batch.shard.is_none() {
        fit_summary::check(&batch.out, batch.overwrite)?;
    }
    let ends = fit_all(job, &all, batch)?;
    let skipped = print_counts(&ends, &others, batch)?;
    if batch.shard.is_none() {
        fit_summary::write(&batch.out, batch.overwrite)?;
    }
    if batch.json {
        print_all(&batch.out, &all)?;
    }
    let failed = count(&ends, |end| matches!(end, End::Failed(_)));
    if failed > 0 {
        return Err(Failure::run(format!("{failed} of {} recordings could not be fitted", ends.len() - skipped)));
    }
    let not_used = count(&ends, |end| matches!(end, End::NotUsed(..)));
    if not_used > 0 {
        let of = ends.len() - skipped;
        return Err(Failure::run(format!(
            "{not_used} of {of} generators do not walk on the robot or are refused; allowed are --fit-limits and --force-write"
        )));
    }
    Ok(())
}

fn fit_all(job: &Job, all: &[Recording], batch: &Batch) -> Result<Vec<End>, Failure> {
    let share: Vec<&Recording> = match batch.shard {
        None => all.iter().collect(),
        Some((i, n)) => all.iter().skip(i as usize - 1).step_by(n as usize).collect(),
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(batch.jobs.map_or(0, usize::from)).build();
    let pool = pool.map_err(Failure::run)?;
    let bar = if messages::says(Amount::Usual) { ProgressBar::new(share.len() as u64) } else { ProgressBar::hidden() };
    if let Ok(style) = ProgressStyle::with_template("{elapsed} {bar:30} {pos}/{len} {eta} {msg}") {
        bar.set_style(style);
    }
    // Before the first recording is fitted, which can take minutes, and while the others are.
    let (count, jobs) = (share.len(), pool.current_num_threads().min(share.len()).max(1));
    messages::status(format_args!("fitting {count} recordings, {jobs} at a time"));
    bar.enable_steady_tick(Duration::from_millis(200));
    let calibration_sha256 = match &job.reading.calibration {
        Some(calibration) => sha256(&recording::bytes(&calibration.path)?),
        None => String::new(),
    };
    let asked = format!("{CONTENT}; {job:?}; {calibration_sha256}");
    let one = |recording: &Recording| {
        bar.set_message(recording.name.clone());
        let end = one(job, recording, batch, &asked);
        bar.inc(1);
        // Without a terminal, and with --verbose, one line a recording, so that a log shows the progress.
        let in_lines = bar.is_hidden() || messages::says(Amount::Verbose);
        bar.suspend(|| match &end {
            Ok(End::Fitted(warnings)) if in_lines => {
                messages::status(format_args!("fitted: {}{}", recording.name, recording::and_warnings(*warnings)));
            }
            Ok(End::Known(warnings)) if in_lines => {
                messages::status(format_args!("known: {}{}", recording.name, recording::and_warnings(*warnings)));
            }
            Ok(End::NotUsed(why, _)) => messages::status(format_args!("{}: {why}", recording.name)),
            Ok(End::Failed(why)) => messages::status(format_args!("failed: {why}")),
            Ok(End::Skipped(why)) => messages::status(format_args!("skipped: {why}")),
            _ => {}
        });
        end
    };
    let ends = pool.install(|| share.into_par_iter().map(one).collect());
    bar.finish_and_clear();
    ends
}

fn count(ends: &[End], of: fn(&End) -> bool) -> usize {
    ends.iter().filter(|end| of(end)).count()
}

/// Prints how the recordings ended; gives the number of those that were skipped. The counts add up to the number of files.
fn print_counts(ends: &[End], others: &BTreeMap<String, usize>, batch: &Batch) -> Result<usize, Failure> {
    let fitted = count(ends, |end| matches!(end, End::Fitted(_) | End::NotUsed(..)));
    let known = count(ends, |end| matches!(end, End::Known(_)));
    let failed = count(ends, |end| matches!(end, End::Failed(_)));
    let skipped = count(ends, |end| matches!(end, End::Skipped(_)));
    let no_gait = if skipped == 0 { String::new() } else { format!(", {skipped} skipped as no recording of gait") };
    let (files, out) = (ends.len(), batch.out.display());
    messages::status(format_args!(
        "{fitted} fitted, {known} already known, {failed} failed{no_gait}: {files} files; results in {out}"
    ));
    let is_doubtful = |end: &End| matches!(end, End::Fitted(1..) | End::Known(1..) | End::NotUsed(_, 1..));
    let doubtful = count(ends, is_doubtful);
    if doubtful > 0 {
        let list = match batch.shard {
            None => batch.out.join("summary.html").display().to_string(),
            Some(_) => "the summary of `footfall merge`".into(),
        };
        messages::warning(format_args!(
            "{doubtful} of the fitted recordings have warnings; {list} lists them, --strict refuses such recordings"
        ));
    }
    if !others.is_empty() {
        let kinds: Vec<String> = others.iter().map(|(extension, files)| format!("{extension} {files}")).collect();
        messages::note(format_args!("not read, because recordings have other extensions: {}", kinds.join(", ")));
    }
    if skipped > 0 && skipped == ends.len() && batch.shard.is_none() {
        return Err(Failure::input(format!("none of {skipped} files is a recording of gait; the reasons are above")));
    }
    Ok(skipped)
}

fn is_footfall(made_by: &str) -> bool {
    made_by.starts_with("footfall ")
}

/// The file with the result of a recording.
fn outcome_file(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!("{name}.fit.json"))
}

/// Fits one recording unless its result exists. Only a folder that cannot be written ends the whole run.
fn one(job: &Job, recording: &Recording, batch: &Batch, asked: &str) -> Result<End, Failure> {
    let began = Instant::now();
    let mut content = match recording::open(&recording.path) {
        Ok(content) => content,
        // It may be readable the next time: nothing is kept.
        Err(why) => return Ok(End::Failed(why.to_string())),
    };
    let files = Files::of(&recording.name, batch);
    let hash = content.sha256().to_owned();
    if let Some(end) = files.known(&hash, asked, batch.force_write) {
        return Ok(end);
    }
    let name = recording.name.as_str();
    let parsed = content.parse(&job.reading);
    // The file may be large, and what is read of it is all that the fit needs.
    drop(content);
    if recording.found
        && let Ok(recorded) = &parsed
        && let Some(why) = recorded.other_than_gait()
    {
        return files.skip(name, &hash, why, batch.overwrite);
    }
    let input = parsed.and_then(|recorded| Input::of(recorded, name, job.fit.rules.low_pass));
    let fitted = input.map_err(NotFitted::Failed).and_then(|input| job.fit(&input, &mut |_| ()));
    let fitted = match fitted {
        Err(NotFitted::NoGait(why)) if recording.found => {
            return files.skip(name, &hash, why.to_string(), batch.overwrite);
        }
        other => other.map_err(Failure::from),
    };
    let overwrite = files.overwrite(name, batch.overwrite);
    if files.skipped_before(name) {
        // What cannot be removed would be listed as skipped as well.
        std::fs::remove_file(&files.skipped).map_err(|error| output::cannot_write(&files.skipped, error))?;
    }
    let (value, end) = match &fitted {
        Ok(fitted) => {
            let why_not = fitted.not_used_because();
            if why_not.is_none() || batch.force_write {
                output::write_text(&files.generator, &fitted.file.to_toml(), overwrite)?;
            }
            if let Some(page) = &files.page {
                output::write_text(page, &job.page(fitted, &recording.path), overwrite)?;
            }
            let warnings = recording::warnings(&fitted.conditioned.findings).len();
            let end = why_not.map_or(End::Fitted(warnings), |why| End::NotUsed(why, warnings));
            let value = serde_json::to_value(Outcome::of(fitted, began.elapsed().as_secs_f64())).map(|mut value| {
                value["report"] = files.page.as_ref().and_then(|page| relative(&batch.out, page)).into();
                value
            });
            (value, end)
        }
        Err(why) => {
            files.remove_own(name);
            let failed = Failed {
                recording: &recording.name,
                sha256: &hash,
                settings: job.fit.to_string(),
                made_by: MADE_BY,
                error: why.to_string(),
            };
            (serde_json::to_value(failed), End::Failed(why.to_string()))
        }
    };
    let mut value = value.map_err(Failure::run)?;
    value["asked"] = asked.into();
    // Last: once this file exists, all others do.
    output::write_text(&files.outcome, &(value.to_string() + "\n"), overwrite)?;
    Ok(end)
}

/// The files of one recording.
struct Files {
    outcome: PathBuf,
    generator: PathBuf,
    page: Option<PathBuf>,
    /// Why it was skipped; the others do not exist then.
    skipped: PathBuf,
}

impl Files {
    fn of(name: &str, batch: &Batch) -> Self {
        Self {
            outcome: outcome_file(&batch.out, name),
            skipped: batch.out.join(format!("{name}{}", fit_summary::SKIPPED)),
            generator: batch.out.join(format!("{name}.toml")),
            page: batch.report.as_ref().map(|folder| folder.join(format!("{name}.html"))),
        }
    }

    fn all(&self) -> impl Iterator<Item = &Path> {
        [Some(&self.outcome), Some(&self.generator), self.page.as_ref()].into_iter().flatten().map(PathBuf::as_path)
    }

    /// The outcome of an earlier run.
    fn outcome(&self) -> Option<Value> {
        serde_json::from_slice(&bounded::regular(&self.outcome, fit_summary::MOST_BYTES).ok()?).ok()
    }

    /// An earlier run of a batch wrote these files for this recording: the outcome says so, or, after an interruption before it was
    /// written, the generator file.
    fn are_own(&self, name: &str) -> bool {
        match self.outcome() {
            Some(value) => value["recording"] == name && value["made_by"].as_str().is_some_and(is_footfall),
            None => GeneratorFile::read(&self.generator).is_ok_and(|GeneratorFile { provenance, .. }| {
                provenance.source == name && is_footfall(&provenance.made_by)
            }),
        }
    }

    fn overwrite(&self, name: &str, asked: Overwrite) -> Overwrite {
        if self.are_own(name) { Overwrite::OWN } else { asked }
    }

    /// Refuses to replace a file that is not of an earlier run.
    fn check(&self, name: &str, asked: Overwrite) -> Result<(), Failure> {
        let overwrite = self.overwrite(name, asked);
        self.all().try_for_each(|file| output::check(file, overwrite))
    }

    /// Removes the result of an earlier run, which holds no longer.
    fn remove_own(&self, name: &str) {
        if self.are_own(name) {
            // What cannot be removed is overwritten, or fails there.
            self.all().for_each(|file| drop(std::fs::remove_file(file)));
        }
    }

    /// Leaves only the reason why the file is no recording of gait.
    fn skip(&self, name: &str, hash: &str, why: String, asked: Overwrite) -> Result<End, Failure> {
        self.remove_own(name);
        let skipped = Skipped { recording: name, sha256: hash, made_by: MADE_BY, skipped: &why };
        let text = serde_json::to_string(&skipped).map_err(Failure::run)? + "\n";
        let overwrite = if self.skipped_before(name) { Overwrite::OWN } else { asked };
        output::write_text(&self.skipped, &text, overwrite)?;
        Ok(End::Skipped(why))
    }

    /// An earlier run skipped this recording.
    fn skipped_before(&self, name: &str) -> bool {
        let value: Option<Value> = bounded::regular(&self.skipped, fit_summary::MOST_BYTES)
            .ok()
            .and_then(|bytes| serde_json::from_slice(&bytes).ok());
        value.is_some_and(|value| value["recording"] == name && value["skipped"].is_string())
    }

    /// The end of an earlier run with the same bytes and settings, if its files exist.
    fn known(&self, hash: &str, asked: &str, force_write: bool) -> Option<End> {
        if self.page.as_ref().is_some_and(|page| !page.exists()) {
            return None;
        }
        let value = self.outcome()?;
        if value["sha256"] != hash || value["asked"] != asked || value["made_by"] != MADE_BY {
            return None;
        }
        let warnings = fit_summary::warnings(&value).len();
        match value["error"].as_str() {
            Some(error) => Some(End::Failed(error.into())),
            None => match value["not_used_because"].as_str() {
                Some(why) if self.generator.exists() || !force_write => Some(End::NotUsed(why.into(), warnings)),
                _ => self.generator.exists().then_some(End::Known(warnings)),
            },
        }
    }
}

/// The way from a folder to a file, with `/` between the parts; `None` if there is none, as between two drives.
fn relative(folder: &Path, file: &Path) -> Option<String> {
    let (from, to) = (folder.canonicalize().ok()?, file.canonicalize().ok()?);
    let common = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    let up = from.components().skip(common).map(|_| "..".into());
    let down = to.components().skip(common).map(|part| part.as_os_str().to_string_lossy());
    (common > 0).then(|| up.chain(down).collect::<Vec<_>>().join("/"))
}

/// One object a line, in the order of the names.
fn print_all(folder: &Path, all: &[Recording]) -> Result<(), Failure> {
    // A result that does not exist is of another share, or of a recording that could not be read.
    let text =
        |recording: &Recording| bounded::text(&outcome_file(folder, &recording.name), fit_summary::MOST_BYTES).ok();
    all.iter().filter_map(text).try_for_each(|text| output::print(&text))
}
