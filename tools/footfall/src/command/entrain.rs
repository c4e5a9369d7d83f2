//! `footfall entrain`: plays one sensor of a recorded person to a follower on the host core, and reports how well it follows.
//!
//! One joint of the recording, of any format that `fit` reads, is played at 1 kHz ([`trace`](mod@trace)); the setpoints of all four joints
//! are compared with the recording. The templates are learned from the first steady seconds of the recording, with joints that it lacks
//! taken from the default recording ([`learn`](mod@gait_fit::following::learn)), and corrections of the joints from the strides of the rest
//! ([`corrected`](mod@gait_fit::following::corrected)); or all are read from a generator file.

mod report;
pub mod trace;

use clap::Args;
use cpg_core::entrainment::Corrections;
use cpg_core::entrainment::phase_lock::{TEMPLATE_HARMONICS, Template};
use gait_fit::following::corrected::corrected;
use gait_fit::following::learn::{Learned, learn, learn_without};
use gait_fit::following::possible::Possible;
use gait_fit::following::run::{self, Entrainment, Following, Holes};
use gait_fit::following::tick::{TICKS_PER_S, Tick, phase_error_deg};
use gait_trace::{LowPass, Recording, Rules};
use generator_file::file::{FollowSet, GeneratorFile, GeneratorSet};
use joint_units::{Joint, Radians};
use std::path::PathBuf;

use crate::board::feed;
use crate::failure::Failure;
use crate::file::recording;
use crate::file::svg;
use crate::file::svg::{Curve, Panel};
use crate::messages;
use crate::options::overwrite::Overwrite;
use crate::options::reading::Reading;
use crate::options::value::one_of;
use crate::output;
use report::{CorrectionSource, Report};

/// Length of the window that templates are learned from, s.
const WINDOW_S: f64 = 12.0;

/// Options of `footfall entrain`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// The recording, in any format of docs/formats.md: CSV, OpenSim, C3D, TRC, Vicon, Visual3D, GCD, MVNX, MCAP, oscilloscope CSV
    #[arg(value_name = "TRACE")]
    pub trace: PathBuf,
    /// The joint with the sensor [default: that of the generator file, the recording's only joint, or left_hip]
    #[arg(long, value_name = "JOINT", value_parser = one_of(Joint::ALL, Joint::name))]
    pub sensor: Option<Joint>,
    /// A generator file of the kind `follow` or `shape` with the templates; without it they are learned from 12 s of the recording, and
    /// joints that the recording lacks are those of the default recording
    #[arg(long, value_name = "FILE.toml")]
    pub generator: Option<PathBuf>,
    /// How the recording is read
    #[command(flatten)]
    pub reading: Reading,
    /// Warnings make exit code 1: a recording with one is not played; a joint above what is possible is reported first, unless there are no
    /// corrections
    #[arg(long)]
    pub strict: bool,
    /// Print one JSON object instead of text
    #[arg(long)]
    pub json: bool,
    /// Draw recorded and generated angles, phase error, and amplitude
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
    /// Whether files may be replaced
    #[command(flatten)]
    pub overwrite: Overwrite,
}

/// What is learned from the default recording; it supplies joints that a recording lacks.
///
/// # Errors
/// None; a test reads the recording.
pub fn default_generator(sensor: Joint) -> Result<Learned, Failure> {
    let (_, recording) = feed::default_trace().map_err(Failure::run)?;
    let looped = recording.looped(TICKS_PER_S).map_err(Failure::run)?;
    learn(&looped.recording, sensor, WINDOW_S).map_err(Failure::run)
}

/// Plays the sensor of a recording to a follower, and compares its setpoints with the recording.
///
/// # Errors
/// The recording has no such joint or no gait, or the generator file is wrong.
pub fn entrain(
    recording: &Recording,
    sensor: Joint,
    generator: Option<&GeneratorFile>,
) -> Result<Entrainment, Failure> {
    entrain_without(recording, sensor, &Holes::default(), generator)
}

/// As [`entrain`], for a recording with gaps.
///
/// # Errors
/// As [`entrain`].
pub fn entrain_without(
    recording: &Recording,
    sensor: Joint,
    holes: &Holes,
    generator: Option<&GeneratorFile>,
) -> Result<Entrainment, Failure> {
    let learned = learn_without(recording, sensor, WINDOW_S, &holes.any).map_err(Failure::input)?;
    let mut learned = learned.completed(&default_generator(sensor)?, sensor).map_err(Failure::run)?;
    let (templates, stride_s, corrections, source) = match generator {
        Some(file) => {
            let (templates, stride_s) = of_file(file)?;
            learned.count_as(&templates[sensor as usize], sensor);
            (templates, stride_s, corrections_of(file, sensor), "file".to_owned())
        }
        None => {
            let [Some(a), Some(b), Some(c), Some(d)] = learned.templates else {
                return Err(Failure::run("a template is missing; name a generator file with --generator"));
            };
            let (from, to) = learned.window_s;
            let default =
                Joint::ALL.into_iter().filter(|&joint| joint != sensor && recording.channel(joint.name()).is_err());
            let default: Vec<&str> = default.map(Joint::name).collect();
            let default = if default.is_empty() { String::new() } else { format!("; default {}", default.join(", ")) };
            let templates = [a, b, c, d];
            (templates, learned.stride_s, Corrections::NONE, format!("learned from {from:.1} to {to:.1} s{default}"))
        }
    };
    let follower = run::follower(templates, sensor, stride_s).map_err(Failure::input)?;
    let mut follower = follower.with_corrections(&corrections).map_err(Failure::input)?;
    let samples = run::without(run::samples(recording, sensor).map_err(Failure::input)?, &holes.sensor);
    let ticks = run::run(&mut follower, samples);
    let following = run::judge_without(&ticks, recording, sensor, &learned, &templates.map(Some), &holes.any);
    Ok(Entrainment { learned, templates, source, ticks, following })
}

/// The corrections of a follower's file, if they are for this sensor.
fn corrections_of(file: &GeneratorFile, sensor: Joint) -> Corrections {
    match &file.set {
        GeneratorSet::Follow(set) if set.sensor == sensor => set.in_si_units().corrections,
        _ => Corrections::NONE,
    }
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
/// Wrong input, no lock, a false lock, or a file that cannot be written.
pub fn run(options: Options) -> Result<(), Failure> {
    let Options { trace: path, sensor: asked, generator: generator_path, reading, strict, json, svg, overwrite } =
        options;
    let inputs = [Some(&path), generator_path.as_ref(), reading.calibration.as_ref()];
    output::check_apart(svg.as_deref(), inputs.into_iter().flatten().map(PathBuf::as_path))?;
    svg.iter().try_for_each(|path| output::check(path, overwrite))?;
    let generator = generator_path.as_deref().map(GeneratorFile::read).transpose().map_err(Failure::input)?;
    let mut reading = reading.settings(LowPass::Off)?;
    let of_file = generator.as_ref().and_then(sensor_of);
    reading.sideless = asked.or(of_file);
    let recorded = recording::open(&path)?.parse(&reading)?;
    let recorded_sha256 = recorded.sha256.clone();
    let (low_pass, note) = recorded.low_pass(reading.low_pass)?;
    output::notes(note);
    let trace = trace::trace(
        &recorded.joints.map_err(Failure::input)?,
        asked,
        of_file,
        &Rules { low_pass, ..reading.rules() },
    )?;
    output::notes(&trace.notes);
    output::findings(&trace.findings);
    let name = path.display().to_string();
    if strict {
        recording::no_warning(&name, &trace.findings)?;
    }
    let mut run = entrain_without(&trace.recording, trace.sensor, &trace.holes, generator.as_ref())
        .map_err(|failure| if failure.exit_code() == 2 { failure.at(&name) } else { failure })?;
    if let Some(path) = &generator_path {
        run.source = path.display().to_string();
    }
    let (corrected, source) = match &generator {
        Some(file) => (None, CorrectionSource::of_file(file, trace.sensor, &recorded_sha256)),
        None => match corrected(&trace.recording, trace.sensor, &trace.holes, &run) {
            Ok(corrected) => {
                let source = CorrectionSource::learned(&corrected);
                (Some(corrected), source)
            }
            Err(why) => (None, CorrectionSource::none(why)),
        },
    };
    output::notes(&source.notes);
    let (following, ticks) =
        corrected.as_ref().map_or((&run.following, &run.ticks), |corrected| (&corrected.following, &corrected.ticks));
    if let Some(path) = &svg {
        let title = format!("{} of {name}, host core", trace.sensor.name());
        svg::write(path, &title, &panels(&run.learned, ticks, &trace.recording, trace.sensor), overwrite)?;
    }
    let possible = Possible::of(&trace.recording, trace.sensor, &trace.holes, run.learned.stride_s, following);
    let above = possible.above(following);
    // The bound can be reached with corrections only: without them, being above it is no defect of the follower.
    let (warnings, notes) = if source.is_corrected { (above, vec![]) } else { (vec![], above) };
    output::notes(&notes);
    if let (Some(lock), None) = (run.following.lock_s, run.following.steady_s) {
        messages::note(format_args!(
            "locked at {lock:.1} s, but the recording has no steady part: it begins 3 s after the lock, and in recordings of \
             20 s or more at 15 s"
        ));
    }
    warnings.iter().for_each(messages::warning);
    let report = Report { name: &name, run: &run, corrected: corrected.as_ref(), source: &source, possible: &possible };
    output::print(&if json { format!("{}\n", report.as_json(&trace)) } else { report.as_text(trace.sensor) })?;
    check(&name, trace.sensor, &run.following)?;
    if strict && !warnings.is_empty() {
        return Err(Failure::run(format!("{name}: --strict allows no warning: {}", warnings.join("; "))));
    }
    Ok(())
}

/// The joint whose sensor a follower uses.
fn sensor_of(file: &GeneratorFile) -> Option<Joint> {
    match &file.set {
        GeneratorSet::Follow(set) => Some(set.sensor),
        _ => None,
    }
}

/// Fails without a lock, and with false locks, false stops or phase slips.
fn check(name: &str, sensor: Joint, following: &Following) -> Result<(), Failure> {
    if following.lock_s.is_none() {
        return Err(Failure::run(format!("{name}: no lock on {}", sensor.name())));
    }
    let mut wrong = Vec::new();
    if following.false_locks > 0 {
        wrong.push(format!("{} false locks", following.false_locks));
    }
    if !following.false_stops.is_empty() {
        let times: Vec<String> =
            following.false_stops.iter().map(|stop| format!("{:.1} to {:.1} s", stop.from_s, stop.to_s)).collect();
        wrong.push(format!("{} false stops ({})", times.len(), times.join(", ")));
    }
    if !following.slips.is_empty() {
        let times: Vec<String> = following.slips.iter().map(|slip| format!("{:.1} s", slip.at_s)).collect();
        wrong.push(format!("{} phase slips ({})", times.len(), times.join(", ")));
    }
    if wrong.is_empty() {
        return Ok(());
    }
    Err(Failure::run(format!("{name}: {}; allowed is none", wrong.join(", "))))
}

/// Charts: recorded and generated angle of each joint, phase error, amplitude.
fn panels(learned: &Learned, ticks: &[Tick], recording: &Recording, sensor: Joint) -> Vec<Panel> {
    let every = 10;
    let time = |tick: usize| tick as f64 / TICKS_PER_S;
    let ticks = || ticks.iter().enumerate().step_by(every);
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
    let error = ticks().map(|(n, tick)| (time(n), phase_error_deg(tick, learned.phase_at(time(n))))).collect();
    panels.push(Panel::curves("phase error", "s", "deg", vec![Curve::new("", error)]));
    let amplitude = ticks().map(|(n, tick)| (time(n), f64::from(tick.amplitude))).collect();
    panels.push(Panel::curves("amplitude", "s", "1", vec![Curve::new("", amplitude)]));
    panels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_recording_has_all_joints() {
        let default = default_generator(Joint::LeftKnee).expect("learned");
        assert!(default.templates.iter().all(Option::is_some));
        assert!((default.stride_s - 1.09).abs() < 0.02);
    }

    #[test]
    fn a_generator_file_of_another_kind_is_refused() {
        let network = GeneratorFile::default_of("phase-coupled").expect("a default");
        let failure = of_file(&network).expect_err("no templates");
        assert_eq!(failure.exit_code(), 2);
        assert!(failure.to_string().contains("allowed are `shape` and `follow`"), "{failure}");
    }
}
