//! `footfall entrain`: one sensor of a recorded walker, the core that follows on the host, and how well it does.
//!
//! The recording, of any format that `fit` takes, is played to the core at 1 kHz, one joint of it ([`trace`](mod@trace)); the setpoints of
//! all four are compared with what the walker did. The templates are learned from the recording's first steady seconds, joints that it
//! lacks lent by the walker that ships ([`learn`](mod@learn)), or all are read from a walker's file.

pub mod learn;
pub mod run;
pub mod trace;

use clap::{Args, ValueEnum};
use cpg_core::entrainment::phase_lock::{TEMPLATE_HARMONICS, Template};
use gait_trace::Recording;
use generator_file::file::{FollowSet, GeneratorFile, GeneratorSet};
use joint_units::{Joint, Radians};
use serde_json::json;
use std::fmt::Write as _;
use std::path::PathBuf;

use crate::board::feed;
use crate::command::fit;
use crate::command::fit::Reading;
use crate::failure::Failure;
use crate::file::svg;
use crate::file::svg::{Curve, Panel};
use learn::{Learned, learn, learn_without};
use run::{Holes, Tick, Verdict};
use trace::Trace;

/// Seconds that templates are learned from.
const WINDOW_S: f64 = 12.0;

/// Options of `footfall entrain`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// The recording: CSV, OpenSim .mot and .sto, C3D, oscilloscope CSV, a capture of `footfall record` in CSV or MCAP
    #[arg(value_name = "TRACE")]
    pub trace: PathBuf,
    /// The joint that wears the sensor [default: that of the walker's file, the recording's only joint, or left_hip]
    #[arg(long, value_enum, value_name = "JOINT")]
    pub sensor: Option<Sensor>,
    /// A walker's file of the kind `follow` or `shape` with the templates; without it they are learned from 12 s of the recording, and
    /// joints that it lacks are those of the walker that ships
    #[arg(long, alias = "template", value_name = "FILE.toml")]
    pub walker: Option<PathBuf>,
    /// How the recording is read
    #[command(flatten)]
    pub reading: Reading,
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
pub fn default_generator(sensor: Joint) -> Result<Learned, Failure> {
    let (_, recording) = feed::default_trace().map_err(Failure::run)?;
    let looped = recording.looped(run::TICKS_PER_S).map_err(Failure::run)?;
    learn(&looped.recording, sensor, WINDOW_S).map_err(Failure::run)
}

/// Plays a recording's sensor to the core and judges what comes.
///
/// # Errors
/// The recording has no such joint, does not walk, or the walker's file is not as it must be.
pub fn entrain(recording: &Recording, sensor: Joint, walker: Option<&GeneratorFile>) -> Result<Entrainment, Failure> {
    entrain_without(recording, sensor, &Holes::default(), walker)
}

/// As [`entrain`], of a recording with holes.
///
/// # Errors
/// As [`entrain`].
pub fn entrain_without(
    recording: &Recording,
    sensor: Joint,
    holes: &Holes,
    walker: Option<&GeneratorFile>,
) -> Result<Entrainment, Failure> {
    let learned = learn_without(recording, sensor, WINDOW_S, &holes.any).map_err(Failure::input)?;
    let mut learned = learned.completed(&default_generator(sensor)?, sensor).map_err(Failure::run)?;
    let (templates, stride_s, source) = match walker {
        Some(file) => {
            let (templates, stride_s) = of_file(file)?;
            learned.count_as(&templates[sensor as usize], sensor);
            (templates, stride_s, "file".to_owned())
        }
        None => {
            let [Some(a), Some(b), Some(c), Some(d)] = learned.templates else {
                return Err(Failure::run("a template is missing"));
            };
            let (from, to) = learned.window_s;
            let lent =
                Joint::ALL.into_iter().filter(|&joint| joint != sensor && recording.channel(joint.name()).is_err());
            let lent: Vec<&str> = lent.map(Joint::name).collect();
            let lent = if lent.is_empty() { String::new() } else { format!("; shipped {}", lent.join(", ")) };
            ([a, b, c, d], learned.stride_s, format!("learned from {from:.1} to {to:.1} s{lent}"))
        }
    };
    let mut legs = run::legs(templates, sensor, stride_s).map_err(Failure::input)?;
    let samples = run::without(run::samples(recording, sensor).map_err(Failure::input)?, &holes.sensor);
    let ticks = run::run(&mut legs, samples);
    let verdict = run::judge_without(&ticks, recording, sensor, &learned, &holes.any);
    Ok(Entrainment { learned, templates, source, ticks, verdict })
}

fn of_file(file: &GeneratorFile) -> Result<([Template; Joint::COUNT], f64), Failure> {
    let (GeneratorSet::Shape(set) | GeneratorSet::Follow(FollowSet { shape: set, .. })) = &file.set else {
        let kind = file.set.name();
        return Err(Failure::input(format!(
            "generator: kind `{kind}` has no templates; allowed are `shape` and `follow`"
        )));
    };
    let mut templates = Vec::with_capacity(Joint::COUNT);
    for joint in &set.joints {
        let series = |list: &[f32]| -> [f32; TEMPLATE_HARMONICS] {
            std::array::from_fn(|n| list.get(n).copied().unwrap_or(0.0).to_radians())
        };
        let mean = Radians::from_degrees(joint.mean_deg);
        templates.push(Template::new(mean, series(&joint.cos_deg), series(&joint.sin_deg)).map_err(Failure::input)?);
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
    let walker = options.walker.as_deref().map(GeneratorFile::read).transpose().map_err(Failure::input)?;
    let worn = walker.as_ref().and_then(|file| match &file.set {
        GeneratorSet::Follow(set) => Some(set.sensor),
        _ => None,
    });
    let asked = options.sensor.map(Sensor::joint);
    let raw = fit::raw(&options.trace, &options.reading, asked.or(worn))?;
    let mut trace = trace::trace(&raw, asked, worn, options.reading.low_pass)?;
    let sensor = trace.sensor;
    if let Some(worn) = worn.filter(|worn| *worn != sensor) {
        trace.notes.push(format!("The walker's file follows {}; played is {}.", worn.name(), sensor.name()));
    }
    for note in &trace.notes {
        eprintln!("note: {note}");
    }
    let recording = &trace.recording;
    let mut run =
        entrain_without(recording, sensor, &trace.holes, walker.as_ref()).map_err(|failure| match failure {
            Failure::Input(why) => Failure::Input(format!("{name}: {why}")),
            other => other,
        })?;
    if let Some(path) = &options.walker {
        run.source = path.display().to_string();
    }
    let verdict = &run.verdict;
    if let Some(path) = &options.svg {
        svg::write(path, &format!("{} of {name}, host core", sensor.name()), &panels(&run, recording, sensor))?;
    }
    if let (Some(lock), None) = (verdict.lock_s, verdict.steady_s) {
        eprintln!(
            "note: locked at {lock:.1} s, and no steady part to judge: it begins 3 s later, and in recordings of 20 s at 15 s"
        );
    }
    let out = if options.json { format!("{}\n", as_json(&name, &trace, &run)) } else { as_text(&name, sensor, &run) };
    crate::cli::print(&out)?;
    match verdict.lock_s {
        None => Err(Failure::run(format!("{name}: no lock on {}", sensor.name()))),
        Some(_) if verdict.false_locks > 0 => {
            Err(Failure::run(format!("{name}: {} false locks; allowed is none", verdict.false_locks)))
        }
        Some(_) => Ok(()),
    }
}

fn as_json(name: &str, trace: &Trace, run: &Entrainment) -> serde_json::Value {
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
        "format": trace.format,
        "notes": trace.notes,
        "core": "host",
        "sensor": trace.sensor.name(),
        "template": run.source,
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

fn as_text(name: &str, sensor: Joint, run: &Entrainment) -> String {
    let verdict = &run.verdict;
    let number = |value: Option<f64>, places: usize| value.map_or("-".to_owned(), |value| format!("{value:.places$}"));
    let mut out = format!("trace {name}\nsensor {}\ntemplate {}\n", sensor.name(), run.source);
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
        let shipped = default_generator(Joint::LeftKnee).expect("learned");
        assert!(shipped.templates.iter().all(Option::is_some));
        assert!((shipped.stride_s - 1.09).abs() < 0.02);
    }

    #[test]
    fn a_file_of_another_kind_is_refused_by_what_is_allowed() {
        let robust = GeneratorFile::default_of("phase-coupled").expect("ships");
        let failure = of_file(&robust).expect_err("no templates");
        assert_eq!(failure.exit_code(), 2);
        assert!(failure.to_string().contains("allowed are `shape` and `follow`"), "{failure}");
    }
}
