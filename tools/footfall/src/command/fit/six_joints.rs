//! `footfall fit --joints 6`: fits a network of hips, knees and ankles to one recording, for the host.

use gait_fit::fit::{Kind, Source};
use gait_fit::judge::HeldOut;
pub(super) use gait_fit::six_joints::COUNT;
use gait_fit::six_joints::{NetworkJointFit, SixJointsFit, fit_six_joints};
use gait_trace::ankles::Ankles;
use gait_trace::{LowPass, Rules, shell_word};
use generator_file::network_certificate::NetworkCertificate;
use serde::Serialize;
use std::path::{Path, PathBuf};

use crate::failure::Failure;
use crate::file::recording;
use crate::messages;
use crate::options::overwrite::Overwrite;
use crate::options::reading::Reading;
use crate::output;
use crate::spinner;

/// What `footfall fit --joints 6` takes.
pub(super) struct Options {
    /// The recording.
    pub(super) recording: PathBuf,
    /// Columns of the ankles, left and right.
    pub(super) ankles: Option<[String; 2]>,
    pub(super) reading: Reading,
    /// Refuse a recording with a warning.
    pub(super) strict: bool,
    pub(super) out: Option<PathBuf>,
    pub(super) overwrite: Overwrite,
    pub(super) json: bool,
    /// Write a network that is refused too.
    pub(super) force_write: bool,
}

/// The result as one JSON object.
#[derive(Serialize)]
struct Outcome<'a> {
    recording: &'a str,
    sha256: &'a str,
    generator: &'static str,
    period_s: f64,
    strides: usize,
    /// The columns of the ankles, left and right.
    ankles: &'a [String; 2],
    joints: &'a [NetworkJointFit; COUNT],
    held_out: HeldOut,
    certificate: &'a NetworkCertificate,
    /// Defects of the recording, and how each was handled.
    findings: Vec<String>,
}

/// Random starts of the certificate.
const STARTS: u32 = 1000;

/// Fits the recording and writes the generator file.
pub(super) fn run(options: Options) -> Result<(), Failure> {
    let Options { recording: path, ankles, reading, strict, out, overwrite, json, force_write } = options;
    let reading = reading.settings(LowPass::Customary)?;
    if let Some(out) = &out {
        let calibration = reading.calibration.as_ref().map(|calibration| calibration.path.as_path());
        output::check_apart([out.as_path()], [path.as_path()].into_iter().chain(calibration))?;
        output::check(out, overwrite)?;
    }
    let bytes = recording::bytes(&path)?;
    let recorded = recording::parse(&path, &bytes, &reading)?;
    let (low_pass, note) = recorded.low_pass(reading.low_pass)?;
    let raw = recorded.joints.map_err(Failure::input)?;
    let feet = Ankles::read(&recorded.name, &bytes, &reading.options()?, ankles.as_ref()).map_err(Failure::input)?;
    let rules = Rules { low_pass, ..reading.rules() };
    let source = Source { name: name_of(&path), sha256: recorded.sha256 };
    let bar = spinner::begin();
    let mut progress = |what: &str| bar.set_message(what.to_owned());
    let fitted = fit_six_joints(&source, &raw, &feet, &rules, STARTS, &mut progress);
    bar.finish_and_clear();
    let fitted = fitted.map_err(Failure::input)?;
    if strict {
        recording::no_warning(&source.name, &fitted.findings)?;
    }
    output::notes(&raw.notes);
    note.iter().for_each(messages::note);
    output::findings(&fitted.findings);
    messages::status(summary(&fitted));

    let refused = fitted.certificate.refused_because.as_ref().filter(|_| !fitted.certificate.status.comes_back());
    let write = refused.is_none() || force_write;
    let generator = fitted.file.to_toml();
    if let Some(file) = out.as_ref().filter(|_| write) {
        output::write_text(file, &generator, overwrite)?;
        messages::written(file);
    }
    if json {
        output::print(&(to_json(&source, &fitted)? + "\n"))?;
    } else if out.is_none() && write {
        output::print(&generator)?;
    }
    match (refused, &out) {
        (Some(why), _) => {
            let what = if write { "the network is written all the same" } else { "no network is written" };
            Err(Failure::run(format!("refused: {why}; {what}; --force-write writes it as it is")))
        }
        (None, Some(file)) => {
            messages::next(
                "see it move",
                format_args!("footfall walk --generator {} --svg walk.svg", shell_word(file)),
            );
            Ok(())
        }
        (None, None) => Ok(()),
    }
}

/// The name of a file without its folder.
fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// Errors by joint, and what the certificate says.
fn summary(fitted: &SixJointsFit) -> String {
    let mut text = format!(
        "{} strides of {:.3} s, ankles from {}; {}\n{:<12} {:>9} {:>9} {:>9}  recorded, deg\n",
        fitted.strides,
        fitted.period_s,
        fitted.ankles.join(" and "),
        fitted.held_out.words(),
        "RMSE, deg",
        "mean",
        "held-out",
        "floor"
    );
    let degrees = |value: Option<f64>| value.map_or("-".into(), |value| format!("{value:.2}"));
    for joint in &fitted.joints {
        let [least, most] = joint.recorded_deg;
        text += &format!(
            "{:<12} {:>9.2} {:>9} {:>9}  {least:.1} to {most:.1}\n",
            joint.name,
            joint.rmse_mean_stride_deg,
            degrees(joint.rmse_heldout_deg),
            degrees(joint.heldout_floor_deg)
        );
    }
    let accepted =
        fitted.certificate.refused_because.as_ref().map_or("accepted".into(), |why| format!("not accepted: {why}"));
    text + &format!("certificate: {accepted}")
}

fn to_json(source: &Source, fitted: &SixJointsFit) -> Result<String, Failure> {
    let outcome = Outcome {
        recording: &source.name,
        sha256: &source.sha256,
        generator: Kind::PhaseCoupled.name(),
        period_s: fitted.period_s,
        strides: fitted.strides,
        ankles: &fitted.ankles,
        joints: &fitted.joints,
        held_out: fitted.held_out,
        certificate: &fitted.certificate,
        findings: fitted.findings.iter().map(ToString::to_string).collect(),
    };
    serde_json::to_string(&outcome).map_err(Failure::run)
}
