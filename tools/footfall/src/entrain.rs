//! `footfall entrain`: one sensor of a recorded walker, the core that follows on the host, and how well it does.
//!
//! The recording is played to the core at 1 kHz, one joint of it; the setpoints of all four are compared with what the walker did. The
//! templates are learned from the recording's first seconds, or read from a walker's file of the kind `shape`.

pub mod learn;
pub mod run;

use clap::{Args, ValueEnum};
use cpg_core::phase_lock::{HARMONICS, Template};
use gait_trace::{Recording, csv_file};
use joint_units::{Joint, Radians};
use serde_json::json;
use std::fmt::Write as _;
use std::path::PathBuf;
use walker::generator_file::{GeneratorSet, WalkerFile};

use crate::failure::Failure;
use crate::feed;
use crate::rhythm::svg::{self, Curve, Panel};
use learn::{Learned, learn};
use run::{Tick, Verdict};

/// Seconds that templates are learned from.
const WINDOW_S: f64 = 12.0;

/// Options of `footfall entrain`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// The recording: CSV with the header time_s,left_hip_deg,... or time_s,knee_deg
    #[arg(value_name = "TRACE")]
    pub trace: PathBuf,
    /// The joint that wears the sensor; a recording of one joint is taken for that one
    #[arg(long, value_enum, value_name = "JOINT", default_value_t = Sensor::LeftHip)]
    pub sensor: Sensor,
    /// A walker's file of the kind `shape` with the templates; without it they are learned from the first 12 s
    #[arg(long, value_name = "FILE.toml")]
    pub template: Option<PathBuf>,
    /// One JSON object instead of lines for people
    #[arg(long)]
    pub json: bool,
    /// Draw recorded and driven angles, phase error, and amplitude
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
}

/// The joint that wears the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "snake_case")]
#[allow(missing_docs)]
pub enum Sensor {
    LeftHip,
    RightHip,
    LeftKnee,
    RightKnee,
}

impl Sensor {
    /// The joint.
    #[must_use]
    pub const fn joint(self) -> Joint {
        match self {
            Self::LeftHip => Joint::LeftHip,
            Self::RightHip => Joint::RightHip,
            Self::LeftKnee => Joint::LeftKnee,
            Self::RightKnee => Joint::RightKnee,
        }
    }
}

/// A run with all that it was made of.
#[derive(Debug, Clone)]
pub struct Entrainment {
    /// What was learned from the recording: the phase that is judged against.
    pub learned: Learned,
    /// The templates that drove.
    pub templates: [Template; Joint::COUNT],
    /// Where they are from.
    pub source: String,
    /// Every tick.
    pub ticks: Vec<Tick>,
    /// What it came to.
    pub verdict: Verdict,
}

/// The walker that lends joints that a recording lacks: the one that ships.
///
/// # Errors
/// The shipped recording cannot be read; a test sees to it that it can.
pub fn shipped_walker(sensor: Joint) -> Result<Learned, Failure> {
    let (_, recording) = feed::recording(None).map_err(Failure::run)?;
    let looped = recording.looped(run::TICKS_PER_S).map_err(Failure::run)?;
    learn(&looped.recording, sensor, WINDOW_S).map_err(Failure::run)
}

/// Plays a recording's sensor to the core and judges what comes.
///
/// # Errors
/// The recording has no such joint, does not walk, or the template's file is not as it must be.
pub fn entrain(recording: &Recording, sensor: Joint, template: Option<&WalkerFile>) -> Result<Entrainment, Failure> {
    let learned = learn(recording, sensor, WINDOW_S).map_err(Failure::input)?;
    let learned = learned.completed(&shipped_walker(sensor)?, sensor).map_err(Failure::run)?;
    let (templates, stride_s, source) = match template {
        Some(file) => {
            let (templates, stride_s) = of_file(file)?;
            (templates, stride_s, "file".to_owned())
        }
        None => {
            let [Some(a), Some(b), Some(c), Some(d)] = learned.templates else {
                return Err(Failure::run("a template is missing"));
            };
            let window = recording.duration_s().min(WINDOW_S);
            ([a, b, c, d], learned.stride_s, format!("learned from the first {window:.1} s"))
        }
    };
    let mut legs = run::legs(templates, sensor, stride_s).map_err(Failure::input)?;
    let samples = run::samples(recording, sensor).map_err(Failure::input)?;
    let ticks = run::run(&mut legs, samples.into_iter().map(Some));
    let verdict = run::judge(&ticks, recording, sensor, &learned);
    Ok(Entrainment { learned, templates, source, ticks, verdict })
}

fn of_file(file: &WalkerFile) -> Result<([Template; Joint::COUNT], f64), Failure> {
    let GeneratorSet::Shape(set) = &file.set else {
        let kind = file.set.kind();
        return Err(Failure::input(format!("generator: kind `{kind}` has no templates; allowed is `shape`")));
    };
    let mut templates = Vec::with_capacity(Joint::COUNT);
    for joint in &set.joints {
        let series = |list: &[f32]| -> [f32; HARMONICS] {
            std::array::from_fn(|n| list.get(n).copied().unwrap_or(0.0).to_radians())
        };
        let mean = Radians::from_degrees(joint.mean_deg);
        templates.push(Template::build(mean, series(&joint.cos_deg), series(&joint.sin_deg)).map_err(Failure::input)?);
    }
    let templates = templates.try_into().map_err(|_| Failure::input("allowed are four joints"))?;
    Ok((templates, f64::from(set.stride_s)))
}

/// Runs the command.
///
/// # Errors
/// Bad input; a lock that was not found, or was false; a picture that cannot be written.
pub fn run(options: &Options) -> Result<(), Failure> {
    let name = options.trace.display().to_string();
    let recording = csv_file::read(&options.trace).map_err(Failure::input)?;
    let template = options.template.as_deref().map(WalkerFile::read).transpose().map_err(Failure::input)?;
    let sensor = options.sensor.joint();
    let run = entrain(&recording, sensor, template.as_ref()).map_err(|failure| match failure {
        Failure::Input(why) => Failure::Input(format!("{name}: {why}")),
        other => other,
    })?;
    let source = options.template.as_ref().map_or(run.source.clone(), |path| path.display().to_string());
    let verdict = &run.verdict;
    if let Some(path) = &options.svg {
        svg::write(path, &format!("{} of {name}, host core", sensor.name()), &panels(&run, &recording, sensor))?;
    }
    let out = if options.json {
        format!("{}\n", as_json(&name, sensor, &source, &run))
    } else {
        as_text(&name, sensor, &source, &run)
    };
    crate::cli::print(&out)?;
    match verdict.lock_s {
        None => Err(Failure::run(format!("{name}: no lock on {}", sensor.name()))),
        Some(_) if verdict.false_locks > 0 => {
            Err(Failure::run(format!("{name}: {} false locks; allowed is none", verdict.false_locks)))
        }
        Some(_) => Ok(()),
    }
}

fn as_json(name: &str, sensor: Joint, source: &str, run: &Entrainment) -> serde_json::Value {
    let verdict = &run.verdict;
    let rmse: serde_json::Map<String, serde_json::Value> = Joint::ALL
        .into_iter()
        .map(|joint| (joint.name().to_owned(), json!(verdict.steady_rmse_deg[joint as usize])))
        .collect();
    let holds: Vec<_> = verdict
        .holds
        .iter()
        .map(|&(tick, fault)| json!({ "t_s": tick as f64 / run::TICKS_PER_S, "fault": fault.name() }))
        .collect();
    json!({
        "file": name,
        "core": "host",
        "sensor": sensor.name(),
        "template": source,
        "stride_s": run.learned.stride_s,
        "lock_s": verdict.lock_s,
        "steady_s": verdict.steady_s.map(|(from, to)| [from, to]),
        "steady_rmse_deg": rmse,
        "false_locks": verdict.false_locks,
        "holds": verdict.holds.len(),
        "hold_events": holds,
        "cadence_steps_per_min": verdict.cadence_steps_per_min,
        "phase_sd_deg": verdict.phase_sd_deg,
    })
}

fn as_text(name: &str, sensor: Joint, source: &str, run: &Entrainment) -> String {
    let verdict = &run.verdict;
    let number = |value: Option<f64>, places: usize| value.map_or("-".to_owned(), |value| format!("{value:.places$}"));
    let mut out = format!("trace {name}\nsensor {}\ntemplate {source}\n", sensor.name());
    let _ = writeln!(out, "stride_s {:.3}", run.learned.stride_s);
    let _ = writeln!(out, "lock_s {}", number(verdict.lock_s, 3));
    let _ = write!(out, "steady_rmse_deg");
    for joint in Joint::ALL {
        let _ = write!(out, " {} {}", joint.name(), number(verdict.steady_rmse_deg[joint as usize], 2));
    }
    let _ = writeln!(out, "\nfalse_locks {}", verdict.false_locks);
    let _ = writeln!(out, "holds {}", verdict.holds.len());
    let _ = writeln!(out, "cadence_steps_per_min {}", number(verdict.cadence_steps_per_min, 1));
    let _ = writeln!(out, "phase_sd_deg {}", number(verdict.phase_sd_deg, 2));
    out
}

/// Recorded against driven for each joint, phase error, amplitude.
fn panels(run: &Entrainment, recording: &Recording, sensor: Joint) -> Vec<Panel> {
    let every = 10;
    let time = |tick: usize| tick as f64 / run::TICKS_PER_S;
    let ticks = || run.ticks.iter().enumerate().step_by(every);
    let start = recording.time_s()[0];
    let mut panels: Vec<Panel> = Joint::ALL
        .into_iter()
        .map(|joint| {
            let driven = ticks().map(|(n, tick)| (time(n), tick.angles[joint as usize])).collect();
            let mut curves = vec![Curve::new("driven", driven)];
            let channel = if joint == sensor { recording.of_joint(joint) } else { recording.channel(joint.name()) };
            if let Ok(channel) = channel {
                let recorded = ticks().map(|(n, _)| (time(n), recording.at(channel, start + time(n)))).collect();
                curves.push(Curve::new("recorded", recorded));
            }
            Panel::curves(joint.name(), "s", "deg", curves)
        })
        .collect();
    let error = ticks().map(|(n, tick)| (time(n), run::phase_error_deg(tick, run.learned.phase_at(time(n))))).collect();
    panels.push(Panel::curves("phase error", "s", "deg", vec![Curve::new("", error)]));
    let amplitude = ticks().map(|(n, tick)| (time(n), f64::from(tick.amplitude))).collect();
    panels.push(Panel::curves("amplitude", "s", "1", vec![Curve::new("", amplitude)]));
    panels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_walker_has_all_joints() {
        let shipped = shipped_walker(Joint::LeftKnee).expect("learned");
        assert!(shipped.templates.iter().all(Option::is_some));
        assert!((shipped.stride_s - 1.09).abs() < 0.02);
    }

    #[test]
    fn a_file_of_another_kind_is_refused_by_what_is_allowed() {
        let robust = WalkerFile::shipped("robust").expect("ships");
        let failure = of_file(&robust).expect_err("no templates");
        assert_eq!(failure.exit_code(), 2);
        assert!(failure.to_string().contains("allowed is `shape`"), "{failure}");
    }
}
