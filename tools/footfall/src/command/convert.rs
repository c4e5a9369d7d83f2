//! `footfall convert`: writes any recording as CSV or as OpenSim .mot: joint angles in degrees, flexion positive, equal time steps.
//!
//! It invents nothing: gaps stay empty, jumps stay as they are, and nothing is filtered unless an option asks for it. What was changed is
//! recorded in the file ([`gait_trace::format::converted`]), so that no other command filters it a second time. What is impossible for a person is
//! refused by the words of `fit`, and what `fit` will refuse is said.

use clap::Args;
use gait_trace::format::converted::{self, Conversion, Format};
use gait_trace::stride::strides;
use gait_trace::{Done, FindingKind, Level, LowPass, RawJoints, Rules, condition};
use joint_units::Joint;
use std::path::{Path, PathBuf};

use crate::failure::Failure;
use crate::file::recording::{self, ReadSettings};
use crate::messages;
use crate::options::overwrite::Overwrite;
use crate::options::reading::Reading;
use crate::output;

/// Options of `footfall convert`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// A recording in any format of docs/formats.md: CSV, OpenSim, C3D, TRC, Vicon, Visual3D, GCD, MVNX, MCAP, oscilloscope CSV
    #[arg(value_name = "RECORDING")]
    pub recording: PathBuf,
    /// The file to write; its extension, .csv or .mot, gives the format
    #[arg(short, long, value_name = "FILE")]
    pub out: PathBuf,
    /// How it is read
    #[command(flatten)]
    pub reading: Reading,
    /// Convert no recording with a warning: the exit code is 1, and nothing is written
    #[arg(long)]
    pub strict: bool,
    /// Whether files may be replaced
    #[command(flatten)]
    pub overwrite: Overwrite,
}

/// Runs the command.
///
/// # Errors
/// Wrong input, an output that is the input or exists, another extension, a warning with --strict, or a file that cannot be written.
pub fn run(options: Options) -> Result<(), Failure> {
    let Options { recording: path, out, reading, strict, overwrite } = options;
    let extension = out.extension().and_then(|extension| extension.to_str()).map(str::to_ascii_lowercase);
    let format = match extension.as_deref() {
        Some("csv") => Format::Csv,
        Some("mot") => Format::Mot,
        _ => return Err(Failure::input(format!("{}: allowed are the extensions .csv and .mot", out.display()))),
    };
    let inputs = [Some(&path), reading.calibration.as_ref()].into_iter().flatten();
    output::check_apart([out.as_path()], inputs.map(PathBuf::as_path))?;
    output::check(&out, overwrite)?;
    let settings = reading.settings(LowPass::Off)?;
    let recorded = recording::open(&path)?.parse(&settings)?;
    let (low_pass, note) = recorded.low_pass(settings.low_pass)?;
    let raw = recorded.joints.map_err(Failure::input)?;
    // A jump is what was measured, whatever made it.
    let rules = Rules { low_pass, jump_bend_deg: f64::INFINITY, ..settings.rules() };
    let joints = condition(&raw, &rules).map_err(Failure::input)?;
    output::notes(raw.notes.iter().chain(&note));
    let fit_refuses = refusal_of_fit(&raw, &rules, &settings);

    let before = recorded.conversion.unwrap_or_default();
    let mut conversion = Conversion {
        version: env!("CARGO_PKG_VERSION").into(),
        source: name_of(&path),
        source_sha256: recorded.sha256,
        options: in_words(&settings),
        low_pass_hz: before.low_pass_hz,
        changes: before.changes,
    };
    if !before.source.is_empty() {
        conversion.source += &format!(", converted from {}", before.source);
    }
    if joints.start_s != 0.0 {
        conversion.changes.push(format!("time 0 is {} s in {}", joints.start_s, name_of(&path)));
    }
    conversion.changes.extend(raw.notes);
    for joint in Joint::ALL.into_iter().filter(|joint| joints.joint(*joint).is_none()) {
        let text =
            format!("{}: not in {}; the output has no such column", joint.name().replace('_', " "), name_of(&path));
        output::levelled(Level::Note, &text);
        conversion.changes.push(text);
    }
    for finding in &joints.findings {
        let text = match finding.done {
            Done::Smoothed { hz } => {
                conversion.low_pass_hz = Some(hz);
                format!("all joints: low-pass at {hz} Hz")
            }
            // What is bridged for a fit stays empty here.
            _ if matches!(finding.what, FindingKind::Gap | FindingKind::Gaps { .. }) => {
                let text = finding.to_string();
                format!("{}; left empty", text.rsplit_once("; ").map_or(text.as_str(), |(what, _)| what))
            }
            _ => finding.to_string(),
        };
        output::levelled(finding.level(), &text);
        conversion.changes.push(text);
    }
    if strict {
        recording::no_warning(&name_of(&path), &joints.findings)?;
    }
    output::write(&out, overwrite, |file| converted::write_to(file, format, &joints, &conversion))?;
    messages::written(&out);
    let out = gait_trace::shell_word(&out);
    match fit_refuses {
        Some(why) => messages::note(format_args!("`fit` refuses it: {why}")),
        None => messages::next("see whether `fit` takes it", format!("footfall check --trace {out}")),
    }
    Ok(())
}

/// Why `fit` refuses the recording, if its strides show it; the generator is judged by `check`.
fn refusal_of_fit(raw: &RawJoints, rules: &Rules, settings: &ReadSettings) -> Option<String> {
    let rules = Rules { jump_bend_deg: settings.rules().jump_bend_deg, ..*rules };
    match condition(raw, &rules) {
        Ok(joints) => strides::segment(&joints).err().map(|why| why.to_string()),
        Err(why) => Some(why.to_string()),
    }
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// The options that change what is read.
fn in_words(settings: &ReadSettings) -> String {
    let mut words: Vec<String> = settings.map.iter().map(|map| format!("--map {map}")).collect();
    words.extend(settings.only.iter().map(|rows| format!("--where {rows}")));
    words.extend(settings.unit.map(|unit| format!("--unit {}", unit.words())));
    words.extend(match settings.low_pass {
        LowPass::Off => None,
        LowPass::At(hz) => Some(format!("--low-pass {hz}")),
        LowPass::Customary => Some("--low-pass customary".into()),
    });
    words.extend(settings.rate_hz.map(|hz| format!("--rate {hz}")));
    words.extend(settings.axis.map(|axis| format!("--axis {}", axis.name())));
    words.extend(settings.topic.as_ref().map(|topic| format!("--topic {topic}")));
    words.extend(settings.knee_sign.map(|sign| format!("--knee-sign {}", sign.name())));
    words.extend(settings.hip_sign.map(|sign| format!("--hip-sign {}", sign.name())));
    words.extend(settings.mirror.then(|| "--mirror".to_owned()));
    words.extend(settings.own_cycles.then(|| "--own-cycles".to_owned()));
    words.extend(settings.stride_s.map(|seconds| format!("--stride-time {seconds}")));
    words.extend(
        settings.calibration.as_ref().map(|calibration| format!("--calibration {}", name_of(&calibration.path))),
    );
    if words.is_empty() { "none".into() } else { words.join(" ") }
}
