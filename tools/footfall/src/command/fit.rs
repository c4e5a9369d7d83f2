//! `footfall fit`: fits a generator to recordings of a person.
//!
//! One recording gives a generator file, a report and a JSON object. Several recordings, or a folder of them, give a folder of these with
//! a summary; such a run can be interrupted and resumed, and divided among computers.
//!
//! Each recording takes the same way: read, fit, judge on strides that were not fitted, write.

mod batch;
pub(crate) mod job;
mod outcome;
mod recordings;
mod six_joints;

use clap::Args;
use cpg_core::entrainment::EventSource;
use gait_fit::fit::{Fit, Kind, Settings};
use gait_trace::{LowPass, Rules};
use joint_loop::SERIES_HARMONICS;
use joint_units::Joint;
use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::failure::Failure;
use crate::messages;
use crate::options::overwrite::Overwrite;
use crate::options::reading::Reading;
use crate::options::robot::RobotArgument;
use crate::options::value::{number, one_of};
use crate::output;
use crate::spinner;
use batch::Batch;
use job::Job;
use outcome::Outcome;

/// Options of `footfall fit`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// Recordings in any format of docs/formats.md (CSV, OpenSim, C3D, TRC, Vicon, Visual3D, GCD, MVNX, MCAP, oscilloscope CSV), or folders of
    /// them. In folders, files that have no time or no joint are skipped
    #[arg(required = true, value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    /// The generator file to write; for several recordings, the folder to write to [default: standard output; `fits`]
    #[arg(short, long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Write a page with numbers and pictures; for several recordings, the folder of the pages
    #[arg(long, value_name = "HTML")]
    pub report: Option<PathBuf>,
    /// Print the result as one JSON object instead of the generator file
    #[arg(long)]
    pub json: bool,
    /// Write a generator too that does not come back to its orbit, does not walk on the robot or is refused as a follower; the exit code
    /// stays 1
    #[arg(long)]
    pub force_write: bool,
    /// What is fitted
    #[command(flatten)]
    pub method: Method,
    /// How many joints: 4 (hips, knees), or 6 (and ankles) of one recording with --kind phase-coupled, for the host
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = joints)]
    pub joints: usize,
    /// Columns of the ankles, by name or by number from 1 [default: those of OpenSim, Plug-in Gait, or left_ankle_deg and right_ankle_deg]
    #[arg(long, value_name = "LEFT,RIGHT", value_parser = pair)]
    pub ankles: Option<(String, String)>,
    /// The robot that it is for
    #[command(flatten)]
    pub robot: RobotArgument,
    /// How files are read
    #[command(flatten)]
    pub reading: Reading,
    /// Fit no recording with a warning: its exit code is 1
    #[arg(long)]
    pub strict: bool,
    /// Whether files may be replaced; what an earlier run for several recordings wrote is replaced anyway
    #[command(flatten)]
    pub overwrite: Overwrite,
    /// For several recordings: how many at a time [default: the number of cores]
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub jobs: Option<u16>,
    /// For several recordings: only share I of N, as in 2/8; `footfall merge` writes the summary when all shares are done
    #[arg(long, value_name = "I/N", value_parser = shard)]
    pub shard: Option<(u32, u32)>,
}

/// What is fitted.
#[derive(Debug, Clone, Args)]
pub struct Method {
    /// The kind of generator: shape (phase and Fourier series), phase-coupled (R1) or thesis
    #[arg(long, value_name = "KIND", default_value = "shape", value_parser = one_of(Kind::ALL, Kind::name))]
    pub kind: Kind,
    /// Make a follower of the shape, with the gait sensor on this joint: left_hip, right_hip, left_knee, right_knee
    #[arg(long, value_name = "JOINT", value_parser = one_of(Joint::ALL, Joint::name))]
    pub follow: Option<Joint>,
    /// Events of the stride that the follower uses beside the angle: none, peak (of that joint; useful for a knee) or foot_switch
    #[arg(
        long,
        value_name = "SOURCE",
        default_value = "none",
        requires = "follow",
        value_parser = one_of(EventSource::ALL, EventSource::name)
    )]
    pub events: EventSource,
    /// Give the follower the mean stride only: do not learn to correct its joints by what the sensor shows of each stride
    #[arg(long, requires = "follow")]
    pub no_corrections: bool,
    /// Harmonics of the shape [default: 6, or up to 8 if needed for an error below 0.4 degrees at the hips and 0.5 at the knees]
    #[arg(long, value_name = "N", value_parser = number(1..=SERIES_HARMONICS, ""))]
    pub harmonics: Option<usize>,
    /// Scale and shift the joints of the fit, as little as possible, until no limit of the robot changes them
    #[arg(long)]
    pub fit_limits: bool,
    /// Seed of the search for the thesis' parameters
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Networks that the search may simulate
    #[arg(long, value_name = "N", default_value_t = 60_000, value_parser = number(1_000..=100_000_000_usize, ""))]
    pub evaluations: usize,
}

impl Method {
    /// The settings of the fit; `rules` are those of the recording, `compare` fits the other generators too.
    fn settings(self, rules: Rules, compare: bool) -> Result<Settings, Failure> {
        let option = if self.harmonics.is_some() { "--harmonics" } else { "--follow" };
        if self.kind != Kind::Shape && (self.harmonics.is_some() || self.follow.is_some()) {
            return Err(Failure::input(format!(
                "{option} with --kind {}: allowed is {option} with --kind shape only",
                self.kind.name()
            )));
        }
        if self.kind == Kind::Thesis && self.fit_limits {
            return Err(Failure::input(
                "--fit-limits with the thesis' network, whose joints cannot be scaled one by one: allowed is it with shape or phase-coupled",
            ));
        }
        Ok(Settings {
            generator: self.kind,
            harmonics: self.harmonics,
            seed: self.seed,
            evaluations: self.evaluations,
            rules,
            compare,
            follow: self.follow,
            events: self.events,
            corrections: !self.no_corrections,
            fit_limits: self.fit_limits,
            ..Settings::default()
        })
    }
}

fn joints(text: &str) -> Result<usize, String> {
    match text {
        "4" => Ok(4),
        "6" => Ok(6),
        "8" => Err("no recording has arms, so eight joints are not fitted; allowed is 4 or 6, and `footfall defaults eight-joints` prints a generator file of eight".into()),
        _ => Err("allowed is 4 or 6".into()),
    }
}

fn pair(text: &str) -> Result<(String, String), String> {
    let named = |column: &str| !column.trim().is_empty() && !column.contains(',');
    let (left, right) = text
        .split_once(',')
        .filter(|(left, right)| named(left) && named(right))
        .ok_or("allowed is LEFT,RIGHT, the names or numbers of two columns")?;
    Ok((left.trim().into(), right.trim().into()))
}

fn shard(text: &str) -> Result<(u32, u32), String> {
    let allowed = || "allowed is I/N with I from 1 to N, as in 2/8".to_string();
    let (i, n) = text.split_once('/').ok_or_else(allowed)?;
    let (i, n) = (i.parse().map_err(|_| allowed())?, n.parse().map_err(|_| allowed())?);
    if (1..=n).contains(&i) { Ok((i, n)) } else { Err(allowed()) }
}

/// Runs the command.
///
/// # Errors
/// Wrong input, a file that cannot be written, or, of several recordings, some that could not be fitted. A file in a folder that has no
/// time or no joint is no recording of gait, and no failure.
pub fn run(options: Options) -> Result<(), Failure> {
    if options.joints == six_joints::COUNT {
        return six_joints::run(of_six_joints(options)?);
    }
    if options.ankles.is_some() {
        return Err(Failure::input("--ankles with --joints 4: allowed is --ankles with --joints 6"));
    }
    let Options {
        recordings,
        out,
        report,
        json,
        force_write,
        method,
        robot,
        reading,
        strict,
        overwrite,
        jobs,
        shard,
        ..
    } = options;
    let reading = reading.settings(LowPass::Customary)?;
    let fit = Settings { robot: robot.read()?, ..method.settings(reading.rules(), report.is_some())? };
    let job = Job { reading, fit, robot: robot.robot, strict };
    match recordings.as_slice() {
        [one] if !one.is_dir() && shard.is_none() && jobs.is_none() => {
            single(&job, one, &Outputs { out, report, json, force_write, overwrite })
        }
        _ => batch::run(
            &job,
            &recordings,
            &Batch { out: out.unwrap_or_else(|| "fits".into()), report, json, force_write, jobs, shard, overwrite },
        ),
    }
}

/// Refuses the options that are for four joints only.
fn of_six_joints(options: Options) -> Result<six_joints::Options, Failure> {
    let Options { method, recordings, .. } = &options;
    let refused =
        |option: &str, allowed: &str| Err(Failure::input(format!("{option} with --joints 6: allowed is {allowed}")));
    if method.kind != Kind::PhaseCoupled {
        return refused(&format!("--kind {}", method.kind.name()), "--kind phase-coupled");
    }
    let four_only = [
        ("--harmonics", method.harmonics.is_some()),
        ("--follow", method.follow.is_some()),
        ("--fit-limits", method.fit_limits),
        ("--robot", options.robot.robot.is_some()),
        ("--report", options.report.is_some()),
        ("--jobs", options.jobs.is_some()),
        ("--shard", options.shard.is_some()),
    ];
    if let Some((option, _)) = four_only.into_iter().find(|(_, given)| *given) {
        return refused(option, &format!("{option} with four joints only"));
    }
    let [recording] = recordings.as_slice() else {
        return refused(&format!("{} recordings", recordings.len()), "one");
    };
    Ok(six_joints::Options {
        recording: recording.clone(),
        ankles: options.ankles.map(|(left, right)| [left, right]),
        reading: options.reading,
        strict: options.strict,
        out: options.out,
        overwrite: options.overwrite,
        json: options.json,
        force_write: options.force_write,
    })
}

/// Where the result of one recording goes.
struct Outputs {
    out: Option<PathBuf>,
    report: Option<PathBuf>,
    json: bool,
    force_write: bool,
    overwrite: Overwrite,
}

fn single(job: &Job, path: &Path, outputs: &Outputs) -> Result<(), Failure> {
    outputs.check(path, job)?;
    let bar = spinner::begin();
    let began = Instant::now();
    let fitted = job
        .read(path, &job::name_of(path))
        .and_then(|input| Ok(job.fit(&input, &mut |what| bar.set_message(what.to_owned()))?));
    bar.finish_and_clear();
    let fitted = fitted?;
    let outcome = Outcome::of(&fitted, began.elapsed().as_secs_f64());
    outcome.print_notes();
    messages::status(format_args!("walks: {}", outcome.walks()));
    let generator = fitted.file.to_toml();
    let not_used = fitted.not_used_because();
    let write = not_used.is_none() || outputs.force_write;
    if let Some(file) = outputs.out.as_ref().filter(|_| write) {
        output::write_text(file, &generator, outputs.overwrite)?;
        messages::written(file);
    }
    if let Some(file) = &outputs.report {
        output::write_text(file, &job.page(&fitted, path), outputs.overwrite)?;
        messages::written(file);
    }
    match (outputs.json, &outputs.out) {
        (true, _) => output::print(&(outcome.to_json()? + "\n"))?,
        (false, None) if write => output::print(&generator)?,
        _ => messages::status(outcome.line()),
    }
    if let Some(why) = &not_used {
        return Err(Failure::run(not_used_in_words(why, remedy(&fitted), write)));
    }
    if let Some(file) = &outputs.out {
        let shadow = if job.fit.follow.is_some() { "--shadow " } else { "" };
        let command = format!("cargo xtask run {shadow}--generator {}", gait_trace::shell_word(file));
        messages::next("run it on the virtual board", command);
    }
    Ok(())
}

/// The options that change that a generator is not used, and what they do.
fn remedy(fitted: &Fit) -> &'static str {
    match (&fitted.refused, fitted.certificate.drive.walks) {
        (Some(_), _) => "--kind shape fits another kind, --seed and --evaluations search elsewhere",
        (None, true) => "--follow or --events chooses another sensor or its events",
        (None, false) => "--fit-limits fits it into the limits",
    }
}

/// What a fit ends with that is not used.
fn not_used_in_words(why: &str, remedy: &str, written: bool) -> String {
    let what = if written { "the generator is written all the same" } else { "no generator is written" };
    format!("{why}; {what}; {remedy}, --force-write writes it as it is")
}

impl Outputs {
    /// Refuses output files that exist, cannot be made, are inputs, or are the same file twice.
    fn check(&self, recording: &Path, job: &Job) -> Result<(), Failure> {
        let files: Vec<&Path> = [&self.out, &self.report].into_iter().flatten().map(PathBuf::as_path).collect();
        let calibration = job.reading.calibration.as_ref().map(|calibration| calibration.path.as_path());
        output::check_apart(
            files.iter().copied(),
            [Some(recording), calibration, job.robot.as_deref()].into_iter().flatten(),
        )?;
        files.into_iter().try_for_each(|file| output::check(file, self.overwrite))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_is_one_of_a_number_of_shares() {
        assert_eq!(shard("2/8"), Ok((2, 8)));
        for bad in ["", "0/8", "9/8", "2", "2/", "a/b", "-1/2"] {
            assert!(shard(bad).unwrap_err().contains("allowed"), "{bad}");
        }
    }

    #[test]
    fn wrong_options_are_refused_with_what_is_allowed() {
        let refused = |arguments: &[&str]| {
            let command = <Options as Args>::augment_args(clap::Command::new("fit"));
            command.try_get_matches_from([&["fit", "a.csv"], arguments].concat()).unwrap_err().to_string()
        };
        assert!(refused(&["--follow", "left_hip", "--events", "heel"]).contains("none, peak, foot_switch"));
        assert!(refused(&["--kind", "fourier"]).contains("shape, phase-coupled, thesis"));
        assert!(refused(&["--harmonics", "9"]).contains("allowed is 1 to 8"));
        assert!(refused(&["--stride", "nan"]).contains("allowed is 0.2 to 20 seconds"));
    }
}
