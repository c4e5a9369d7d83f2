//! Fits a generator to a recording: conditioning, strides, fit, judgement, certificate, generator file.
//!
//! ```text
//! RawJoints --condition--> joints --segment--> strides --fit--> set --one stride--> judged against the strides
//!                                                         \--certify--> accepted, or refused with the reason
//! ```
//! The parameters are fitted to the mean of all kept strides. The errors on strides that were not fitted come from
//! separate fits to some of the strides by the same method ([`crate::judge::HeldOut`]).

use std::fmt;

use crate::corrections;
use cpg_core::entrainment::EventSource;
use gait_trace::stride::cycle::Cycle;
use gait_trace::stride::strides::segment;
use gait_trace::{ConditionError, Conditioned, LowPass, RawJoints, Rules, StrideError, Strides, condition};
use generator_file::certificate::{Certificate, certify};
use generator_file::file::{CorrectionsSet, FollowSet, GeneratorFile, GeneratorSet, Provenance};
use generator_file::inside_limits::inside_limits;
use generator_file::returns::comes_back;
use generator_file::robot_file::RobotFile;
use joint_loop::store::robot_record;
use joint_loop::{LoopConfig, SERIES_HARMONICS};
use joint_units::Joint;
use serde::Serialize;

use crate::generator_cycle::{aligned, cycle_of, generator_cycle};
use crate::judge::{HeldOut, JointFit, held_out, judge};
use crate::measures::Measures;
use crate::search::{Dynamics, SearchSettings, fit_phase_coupled, fit_thesis};
use crate::series::{self, Series};

/// Difference of the legs, as a fraction of the range of motion, beyond which a gait counts as asymmetric.
pub const ASYMMETRIC: f64 = 0.15;

/// Default number of harmonics of phase and shape, enough for nearly every person.
pub const LEAST_HARMONICS: usize = 6;

/// Least range of the joint with the sensor, degrees: a joint that does not move shows no phase.
pub const LEAST_RANGE_DEG: f64 = 1.0;

/// Random starts of a generator that is only compared, as in the check of the thesis' network; the certificate has more.
const COMPARED_STARTS: u32 = 100;

/// The search for a thesis network simulates this part of the networks if it is only compared: on 17 recordings its error was 0.98 times the
/// error of the whole search in the mean, 0.80 to 1.13 times.
const COMPARED_PART: usize = 3;

/// Goal for the error of hip and knee against the mean stride, degrees.
pub const GOAL_DEG: [f64; 2] = [0.4, 0.5];

/// Nonlinearity and coupling of R1: those of the default walk, which returns to its gait within a few strides of a disturbance.
pub(crate) const LINKED: Dynamics = Dynamics::Fixed(0.5, 0.5);

/// Which generator is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Phase and shape: one phase, one Fourier series per joint.
    Shape,
    /// R1: four coupled oscillators with bounded states and nearly sinusoidal angles.
    PhaseCoupled,
    /// The thesis' network.
    Thesis,
}

impl Kind {
    /// All kinds, the most exact first.
    pub const ALL: [Self; 3] = [Self::Shape, Self::PhaseCoupled, Self::Thesis];

    /// The name in generator files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Shape => "shape",
            Self::PhaseCoupled => "phase-coupled",
            Self::Thesis => "thesis",
        }
    }
}

/// Settings of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The generator.
    pub generator: Kind,
    /// Harmonics of phase and shape, 1 to [`joint_loop::SERIES_HARMONICS`]; `None` uses [`LEAST_HARMONICS`], or more if needed to be
    /// within [`GOAL_DEG`] of the mean stride.
    pub harmonics: Option<usize>,
    /// Seed of the search.
    pub seed: u64,
    /// Largest number of networks that the search for the thesis' parameters simulates.
    pub evaluations: usize,
    /// Random starts of the certificate.
    pub starts: u32,
    /// Stride period for a recording whose time axis is a cycle, seconds.
    pub stride_s: f64,
    /// Thresholds of the conditioning.
    pub rules: Rules,
    /// Whether the other generators are fitted too, for comparison.
    pub compare: bool,
    /// Joint whose sensor the fitted phase and shape follows; `None` for no follower.
    pub follow: Option<Joint>,
    /// Source of stride events for a follower, besides the angle.
    pub events: EventSource,
    /// Whether corrections of a follower are learned ([`crate::corrections`]).
    pub corrections: bool,
    /// The robot that the generator is for.
    pub robot: RobotFile,
    /// Whether the joints are scaled and shifted into the limits of the robot.
    pub fit_limits: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            generator: Kind::Shape,
            harmonics: None,
            seed: 1,
            evaluations: 60_000,
            starts: 1000,
            stride_s: 1.0,
            // Customary for marker trajectories; every fit reports it.
            rules: Rules { low_pass: LowPass::Customary, ..Rules::default() },
            compare: false,
            follow: None,
            events: EventSource::None,
            corrections: true,
            robot: RobotFile::default_biped(),
            fit_limits: false,
        }
    }
}

impl fmt::Display for Settings {
    /// The settings in words, for the generator file.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "generator {}", self.generator.name())?;
        match self.generator {
            Kind::Shape => match self.harmonics {
                Some(harmonics) => write!(f, ", {harmonics} harmonics, least squares"),
                None => write!(f, ", as many harmonics as it takes, least squares"),
            },
            Kind::PhaseCoupled => write!(f, ", Levenberg-Marquardt"),
            Kind::Thesis => write!(f, ", CMA-ES, {} evaluations, seed {}", self.evaluations, self.seed),
        }?;
        if self.fit_limits {
            write!(f, ", joints fitted into the limits")?;
        }
        let RobotFile { name, robot } = &self.robot;
        if *robot != RobotFile::default_biped().robot {
            write!(f, ", robot \"{name}\" {:08x}", robot_record::record_of(robot, name).crc())?;
        }
        match self.follow {
            Some(joint) => {
                let corrections = if self.corrections { "" } else { ", no corrections" };
                write!(f, ", follows {}, events {}{corrections}", joint.name(), self.events.name())
            }
            None => Ok(()),
        }
    }
}

/// The file of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Source {
    /// Its name without folders.
    pub name: String,
    /// SHA-256 of its bytes, in hex.
    pub sha256: String,
}

/// Why there is no fit.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitError {
    /// The joints cannot be conditioned. The reason names the file.
    #[error("{why}")]
    Condition {
        /// The recording.
        file: String,
        /// The reason.
        why: ConditionError,
    },
    /// The recording has no strides.
    #[error("{file}: {why}")]
    Strides {
        /// The recording.
        file: String,
        /// The reason.
        why: StrideError,
    },
    /// The joint that is to be followed does not move.
    #[error(
        "{file}: {joint} does not move (range {range_deg:.2} degrees), so its sensor shows no phase; allowed is --follow with a joint that moves by {LEAST_RANGE_DEG} degree or more"
    )]
    Still {
        /// The recording.
        file: String,
        /// The joint.
        joint: &'static str,
        /// Range of its mean stride, degrees.
        range_deg: f64,
    },
    /// The fitted parameters are not a valid generator: the stride period is out of range, for instance.
    #[error("{file}: the fitted parameters are not a valid generator: {why}")]
    Generator {
        /// The recording.
        file: String,
        /// The rule that they break.
        why: String,
    },
}

/// Why a fitted generator is refused: it does not come back to its orbit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Refused {
    /// Its kind.
    pub generator: &'static str,
    /// The reason.
    pub because: String,
    /// Its root mean square error against the mean stride, degrees, in the order of the joints.
    pub rmse_deg: [f64; Joint::COUNT],
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b, c, d] = self.rmse_deg;
        write!(
            f,
            "the {} generator is refused, with an RMSE of {a:.2} {b:.2} {c:.2} {d:.2} degrees (left hip, right hip, left knee, right knee): {}",
            self.generator, self.because
        )
    }
}

/// Another generator fitted to the same strides, for comparison.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Compared {
    /// Its name in words.
    pub name: String,
    /// Root mean square error against the mean stride, degrees, in the order of the joints.
    pub rmse_deg: [f64; 4],
    /// Whether kicks and random starts come back to the orbit; `None` for a generator without states.
    pub holds: Option<bool>,
}

/// The result of a fit.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The recording.
    pub source: Source,
    /// Its format in words.
    pub format: String,
    /// The settings.
    pub settings: Settings,
    /// The conditioned joints and the findings, those of the strides included.
    pub conditioned: Conditioned,
    /// The strides.
    pub strides: Strides,
    /// The generator file, ready to be written.
    pub file: GeneratorFile,
    /// Stride period of the generator, seconds.
    pub period_s: f64,
    /// The generator's cycle, aligned with the mean stride.
    pub cycle: Cycle,
    /// The cycle of the setpoints after the limits of the robot, aligned with the mean stride; `None` if it does not walk there.
    pub driven: Option<Cycle>,
    /// The errors of the joints.
    pub joints: [JointFit; 4],
    /// Cadence, stride time and ranges of motion.
    pub measures: Measures,
    /// Choice of the strides that were not fitted.
    pub held_out: HeldOut,
    /// The certificate of the generator in the file; it has whether the generator walks on the robot.
    pub certificate: Certificate,
    /// Root mean square change of each joint that the limits of the robot cost, degrees; `None` if the fit was not asked to keep them.
    pub limits_cost_deg: Option<[f64; 4]>,
    /// Why the generator in the file is refused; `None` if it comes back to its orbit.
    pub refused: Option<Refused>,
    /// The other generators, if a comparison was requested.
    pub compared: Vec<Compared>,
    /// Evaluations at which the search for the thesis' parameters improved, with the error in degrees; empty without a search.
    pub history: Vec<(usize, f64)>,
    /// Whether the difference of the legs is beyond [`ASYMMETRIC`].
    pub asymmetric: bool,
    /// Notes for the user, one sentence each.
    pub notes: Vec<String>,
}

impl Fit {
    /// Why the generator is written only on request: it does not come back to its orbit, it does not walk on the robot, or it is refused as
    /// a follower.
    #[must_use]
    pub fn not_used_because(&self) -> Option<String> {
        if let Some(refused) = &self.refused {
            return Some(refused.to_string());
        }
        let walks = self.certificate.drive.why_not.as_ref().map(|why| format!("walks: no: {why}"));
        walks.or_else(|| Some(format!("refused as a follower: {}", self.certificate.refused_as_follower()?)))
    }
}

/// Fits a generator to a recording. `progress` is called with the name of each step.
///
/// ```
/// use gait_fit::fit::{Settings, Source, fit};
/// use gait_trace::ReadOptions;
/// use gait_trace::format::open::of_bytes;
/// let mut csv = String::from("time_s,left_hip_deg,right_hip_deg,left_knee_deg,right_knee_deg\n");
/// for row in 0..700 {
///     let t = f64::from(row) * 0.01;
///     let hip = |lead: f64| { let p = std::f64::consts::TAU * (t / 1.1 + lead); 8.0 + 21.0 * p.cos() - 4.0 * (2.0 * p).cos() };
///     let knee = |lead: f64| { let p = std::f64::consts::TAU * (t / 1.1 + lead) + 1.5; 24.0 + 20.0 * p.cos() + 15.0 * (2.0 * p).cos() };
///     csv += &format!("{t},{},{},{},{}\n", hip(0.0), hip(0.5), knee(0.0), knee(0.5));
/// }
/// let raw = of_bytes("walk.csv", csv.as_bytes(), &ReadOptions::default())?;
/// let source = Source { name: "walk.csv".into(), sha256: String::new() };
/// let fitted = fit(&source, &raw, &Settings::default(), &mut |_| ())?;
/// assert!((fitted.period_s - 1.1).abs() < 1e-3);
/// assert!(fitted.joints.iter().all(|joint| joint.rmse_mean_stride_deg < 0.05));
/// assert!(fitted.certificate.accepted && !fitted.asymmetric);
/// // For a follower of a sensor, the certificate has the time to lock.
/// let settings = Settings { follow: Some(joint_units::Joint::LeftHip), ..Settings::default() };
/// let follower = fit(&source, &raw, &settings, &mut |_| ())?;
/// assert!(follower.certificate.following.is_some_and(|lock| lock.lock_worst_s.is_some_and(|worst| worst < 4.0)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// The recording cannot be fitted; the error names the file and the reason.
pub fn fit(
    source: &Source,
    raw: &RawJoints,
    settings: &Settings,
    progress: &mut dyn FnMut(&str),
) -> Result<Fit, FitError> {
    let file = || source.name.clone();
    progress("strides");
    let mut conditioned = condition(raw, &settings.rules).map_err(|why| FitError::Condition { file: file(), why })?;
    let strides = segment(&conditioned).map_err(|why| FitError::Strides { file: file(), why })?;
    conditioned.findings.extend(strides.drift().into_iter().chain(strides.differ()));
    let mut notes: Vec<String> = raw.notes.clone();
    let period_s = if conditioned.normalised_cycle && settings.rules.stride_s.is_none() {
        notes.push(format!(
            "the time axis is a cycle, not seconds: a stride of {} s is assumed (set it with --stride-time)",
            settings.stride_s
        ));
        settings.stride_s
    } else {
        strides.period_s
    };

    let mean = strides.mean();
    if let Some(joint) = settings.follow {
        let range_deg = range(&mean.0[joint as usize]);
        if range_deg < LEAST_RANGE_DEG {
            return Err(FitError::Still { file: file(), joint: joint.name(), range_deg });
        }
    }
    // The other generators are fitted on another core meanwhile.
    let (found, mut checked, compared) = std::thread::scope(|scope| {
        let others = settings.compare.then(|| scope.spawn(|| compare(&mean, period_s, settings)));
        let found = of_kind(settings.generator, &mean, period_s, settings, progress);
        let checked = check(&found.set, settings, progress);
        (found, checked, others.map(joined))
    });
    let Found { mut set, history, refused_because } = found;
    let (compared, others) = compared.unwrap_or_default();
    let because = refused_because.or_else(|| does_not_come_back(&checked));
    let limits_cost_deg = if settings.fit_limits {
        progress("limits of the robot");
        let inside = inside_limits(&set, &LoopConfig::of(&settings.robot.robot))
            .map_err(|why| FitError::Generator { file: file(), why })?;
        if inside.set != set {
            set = inside.set;
            checked = check(&set, settings, progress);
        }
        Some(inside.cost_deg)
    } else {
        None
    };
    let mut certificate = checked.map_err(|why| FitError::Generator { file: file(), why })?;
    let own = generator_cycle(&set).map_err(|why| FitError::Generator { file: file(), why })?;
    let (cycle, _) = aligned(&own.cycle, &mean);
    let refused = because.map(|because| Refused {
        generator: settings.generator.name(),
        because,
        rmse_deg: cycle.rmse_deg(&mean),
    });

    progress("held-out strides");
    // Fitted into limits, the generator itself is judged.
    let moved = limits_cost_deg.is_some_and(|cost| cost != [0.0; 4]);
    let again = |some: &Cycle| if moved { cycle.clone() } else { refitted(&set, some, period_s) };
    let (way, errors, floor) = held_out(&strides, again);
    let asymmetric = is_asymmetric(&strides);
    if asymmetric {
        let [hip, knee] = strides.asymmetry_deg();
        notes.push(format!(
            "asymmetric: left and right, shifted by half a stride, differ by {hip:.1} degrees at the hip and {knee:.1} at the knee"
        ));
    }
    if let GeneratorSet::Shape(shape) = &set
        && settings.harmonics.is_none()
        && shape.joints[0].cos_deg.len() > LEAST_HARMONICS
    {
        let [hip, knee] = GOAL_DEG;
        notes.push(format!(
            "{} harmonics: with {LEAST_HARMONICS} the error would be more than {hip} degrees at a hip or {knee} at a knee",
            shape.joints[0].cos_deg.len()
        ));
    }
    let history = if history.is_empty() { others } else { history };
    let used = match &set {
        GeneratorSet::Shape(shape) => {
            Settings { generator: Kind::Shape, harmonics: Some(shape.joints[0].cos_deg.len()), ..settings.clone() }
        }
        other => Settings { generator: kind_of(other), ..settings.clone() },
    };
    // The errors are those of the shape itself; as a follower it also depends on its phase, and the certificate measures the locking.
    let set = match (set, settings.follow) {
        (GeneratorSet::Shape(shape), Some(sensor)) => {
            let mut set = FollowSet { sensor, events: settings.events, shape, corrections: None };
            if settings.corrections && moved {
                notes.push("no corrections: they would undo what was fitted into the limits of the robot".into());
            } else if settings.corrections {
                progress("corrections");
                match corrections::on_the_board(&set.in_si_units(), raw, &settings.rules) {
                    Ok(learned) => {
                        notes.push(learned.in_words());
                        set.corrections = CorrectionsSet::of(&learned.corrections, sensor);
                    }
                    Err(why) => notes.push(format!("no corrections, so the joints have the mean stride: {why}")),
                }
            }
            let set = GeneratorSet::Follow(set);
            certificate = check(&set, settings, progress).map_err(|why| FitError::Generator { file: file(), why })?;
            notes.extend(
                certificate.refused_because.iter().map(|because| format!("not accepted as a follower: {because}")),
            );
            set
        }
        (set, _) => set,
    };
    let driven = cycle_of(&certificate.drive.strides).map(|driven| aligned(&driven.cycle, &mean).0);
    let joints = judge(&strides, &cycle, driven.as_ref(), errors, floor);
    let in_seconds = !conditioned.normalised_cycle || settings.rules.stride_s.is_some();
    let measures = Measures::of(&strides, &cycle, in_seconds);
    notes.extend(certificate.excesses.iter().map(|excess| format!("beyond the limits of the robot: {excess}")));
    if let Some(cost) = limits_cost_deg.filter(|_| moved) {
        let [a, b, c, d] = cost;
        notes.push(format!(
            "fitted into the limits of the robot: changed by {a:.2} {b:.2} {c:.2} {d:.2} degrees (left hip, right hip, left knee, right knee)"
        ));
    }
    let provenance = Provenance {
        source: source.name.clone(),
        source_sha256: source.sha256.clone(),
        made_by: concat!("footfall ", env!("CARGO_PKG_VERSION")).into(),
        settings: format!("{used}; {} strides", strides.cycles().len()),
    };
    Ok(Fit {
        source: source.clone(),
        format: raw.format.clone(),
        settings: settings.clone(),
        conditioned,
        strides,
        file: GeneratorFile { provenance, set },
        period_s: own.period_s,
        cycle,
        driven,
        joints,
        measures,
        held_out: way,
        certificate,
        limits_cost_deg,
        refused,
        compared,
        history,
        asymmetric,
        notes,
    })
}

struct Found {
    set: GeneratorSet,
    history: Vec<(usize, f64)>,
    refused_because: Option<String>,
}

fn of_kind(kind: Kind, mean: &Cycle, period_s: f64, settings: &Settings, progress: &mut dyn FnMut(&str)) -> Found {
    progress(kind.name());
    match kind {
        Kind::Shape => {
            let set = GeneratorSet::Shape(series::fit(mean, period_s, harmonics(mean, settings)));
            Found { set, history: vec![], refused_because: None }
        }
        Kind::PhaseCoupled => {
            let fitted = fit_phase_coupled(mean, period_s, LINKED, &mut |_| ());
            Found { set: GeneratorSet::PhaseCoupled(fitted.set), history: vec![], refused_because: None }
        }
        Kind::Thesis => {
            let search =
                SearchSettings { seed: settings.seed, evaluations: settings.evaluations, ..SearchSettings::default() };
            let fitted = fit_thesis(mean, period_s, &search, &mut |step| {
                progress(&format!(
                    "thesis: {} of {} networks, {:.2} degrees",
                    step.evaluations, step.budget, step.best
                ));
            });
            Found {
                set: GeneratorSet::Thesis(fitted.set),
                history: fitted.history,
                refused_because: fitted.refused_because,
            }
        }
    }
}

/// The requested number of harmonics, else the smallest one within the goal, else the largest.
fn harmonics(mean: &Cycle, settings: &Settings) -> usize {
    let reaches = |harmonics: &usize| {
        let within = |joint: Joint| {
            let points = &mean.0[joint as usize];
            let goal = if matches!(joint, Joint::LeftHip | Joint::RightHip) { GOAL_DEG[0] } else { GOAL_DEG[1] };
            Series::through(points, *harmonics).rmse(points) <= goal
        };
        Joint::ALL.into_iter().all(within)
    };
    settings.harmonics.unwrap_or_else(|| (LEAST_HARMONICS..SERIES_HARMONICS).find(reaches).unwrap_or(SERIES_HARMONICS))
}

fn kind_of(set: &GeneratorSet) -> Kind {
    match set {
        GeneratorSet::PhaseCoupled(_) => Kind::PhaseCoupled,
        GeneratorSet::Thesis(_) => Kind::Thesis,
        // A follower is made from a fitted shape.
        _ => Kind::Shape,
    }
}

fn check(set: &GeneratorSet, settings: &Settings, progress: &mut dyn FnMut(&str)) -> Result<Certificate, String> {
    let mut report = |what: &str| progress(&format!("certificate: {what}"));
    certify(set, settings.starts, &LoopConfig::of(&settings.robot.robot), &mut report)
}

/// Why a generator does not come back to its orbit. One that exceeds the limits of the robot does, and one that cannot be certified is an
/// error of its own.
fn does_not_come_back(checked: &Result<Certificate, String>) -> Option<String> {
    let certificate = checked.as_ref().ok().filter(|certificate| !certificate.status.comes_back())?;
    Some(certificate.refused_because.clone().unwrap_or_default())
}

/// The cycle of a fit to other strides by the same method. The search for a thesis network is not repeated: its waveform is limited by
/// the equations and hardly depends on the strides, so the same network is judged.
fn refitted(set: &GeneratorSet, some: &Cycle, period_s: f64) -> Cycle {
    let again = match set {
        GeneratorSet::Shape(fitted) => GeneratorSet::Shape(series::fit(some, period_s, fitted.joints[0].cos_deg.len())),
        GeneratorSet::PhaseCoupled(_) => {
            GeneratorSet::PhaseCoupled(fit_phase_coupled(some, period_s, LINKED, &mut |_| ()).set)
        }
        _ => set.clone(),
    };
    // A generator that was fitted once can be stepped; otherwise the mean of the strides is used.
    generator_cycle(&again).map_or_else(|_| some.clone(), |own| aligned(&own.cycle, some).0)
}

fn range(points: &[f64]) -> f64 {
    points.iter().copied().fold(f64::MIN, f64::max) - points.iter().copied().fold(f64::MAX, f64::min)
}

/// The legs differ by more than [`ASYMMETRIC`] of the range of motion, hips or knees.
fn is_asymmetric(strides: &Strides) -> bool {
    let mean = strides.mean();
    let ranges = [0, 2].map(|left| range(&mean.0[left]).max(range(&mean.0[left + 1])));
    strides.asymmetry_deg().iter().zip(ranges).any(|(difference, range)| *difference > ASYMMETRIC * range)
}

/// What a thread found.
fn joined<T>(thread: std::thread::ScopedJoinHandle<'_, T>) -> T {
    thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

/// The other generators fitted to the same mean stride, and the history of the search for the thesis' parameters.
fn compare(mean: &Cycle, period_s: f64, settings: &Settings) -> (Vec<Compared>, Vec<(usize, f64)>) {
    let measured = |name: String, set: &GeneratorSet, holds: Option<bool>| -> Option<Compared> {
        let rmse_deg = aligned(&generator_cycle(set).ok()?.cycle, mean).0.rmse_deg(mean);
        Some(Compared { name, rmse_deg, holds })
    };
    let shape = |harmonics: usize| {
        let set = GeneratorSet::Shape(series::fit(mean, period_s, harmonics));
        let name = match harmonics {
            1 => "one sinusoid per joint".into(),
            _ => format!("phase and shape, {harmonics} harmonics"),
        };
        measured(name, &set, None)
    };
    let coupled = || {
        let found = of_kind(Kind::PhaseCoupled, mean, period_s, settings, &mut |_| ());
        let holds = comes_back(&found.set, COMPARED_STARTS).is_ok();
        measured("R1, the phase-coupled network".into(), &found.set, Some(holds))
    };
    let fewer = Settings { evaluations: settings.evaluations / COMPARED_PART, ..settings.clone() };
    // The search for the thesis network takes longest and waits for its slowest individual; the others hardly use more than one core.
    std::thread::scope(|scope| {
        let others = scope.spawn(|| {
            let shapes = [1, 2, 3, 4, 5, 6, 8].into_iter().filter_map(shape);
            shapes.chain(coupled()).collect::<Vec<Compared>>()
        });
        let thesis = of_kind(Kind::Thesis, mean, period_s, &fewer, &mut |_| ());
        let of_thesis = measured("the thesis' network".into(), &thesis.set, Some(thesis.refused_because.is_none()));
        let all = joined(others).into_iter().chain(of_thesis).collect();
        (all, thesis.history)
    })
}
