//! The certificate of a parameter set: what the generator does, measured, not assumed.
//!
//! | question | how it is measured |
//! |---|---|
//! | does it oscillate; period, amplitudes | 100 strides from the built state, then 20 by upward crossings of the first joint |
//! | from how many starts | random states within ±[`START_BOX`] amplitudes: how many are on the orbit after [`START_STRIDES`] strides |
//! | does it come back | 100 starts on the orbit, each state off by up to 8 percent, left and right differently: none may diverge, and [`RETURN_SHARE`] of them must be back on the orbit after [`RETURN_STRIDES`] strides |
//! | settling time | velocity of the first joint pushed by half its amplitude; until it stays within 5 percent of the orbit |
//! | contraction | Floquet multipliers: eigenvalues of the differential of the map over one period |
//! | entrainment | a link from a master oscillator at three strengths; frequencies of the master that lock it 1:1 (see [`crate::entrainment`]) |
//! | following | of a generator that a sensor leads: lock times, lock range, steady phase error (see [`crate::following`]) |
//! | largest stable step | longest control period in f32 at which the period is right within 1 percent |
//! | peaks | largest rate and acceleration of each joint over five strides in f32 at 1 ms, against the gate's limits |
//!
//! A distance is the largest difference of a state from the nearest point of the orbit, in amplitudes of that state.
//!
//! A set is accepted if it oscillates, no perturbed start diverges, and enough of them come back; one that follows if every start of its lock
//! grid locks soon and on the right phase. [`CertificateStatus`] names what it lacks first.

use joint_loop::{GeneratorConfig, LoopConfig};
use joint_units::Period;
use nalgebra::DMatrix;
use serde::Serialize;

use crate::entrainment::{self, Tongue};
use crate::file::GeneratorSet;
use crate::following::{Following, following};
use crate::in_single::{largest_step, peaks};
use crate::random::Random;
use crate::specimen::specimen;

/// Size of the box of random starts, in amplitudes.
pub const START_BOX: f64 = 1.5;
/// Strides that a random start is given.
pub const START_STRIDES: u32 = 60;
/// Strides after which a perturbed start must be back.
pub const RETURN_STRIDES: u32 = 100;
/// Share of the perturbed starts that must be back on the orbit, every phase included.
pub const RETURN_SHARE: f64 = 0.95;
/// Points of the orbit that distances are taken to.
const ORBIT_POINTS: usize = 400;
/// Step of the certificate's own simulations, in microseconds.
const STEP_MICROS: u32 = 5_000;

/// A generator in f64 whose states can be read and set, each in parts of its amplitude.
pub trait Specimen {
    /// One step.
    fn step(&mut self);
    /// Every state, displacements first, in amplitudes.
    fn state(&self) -> Vec<f64>;
    /// Sets every state; `false` and no change where one is out of bounds.
    fn set_state(&mut self, state: &[f64]) -> bool;
    /// Whether every state is finite and off its bound.
    fn sound(&self) -> bool;
    /// A copy.
    fn copy(&self) -> Box<dyn Specimen>;
}

/// What was measured of a joint.
#[derive(Debug, Clone, Serialize)]
pub struct JointPeaks {
    /// `left_hip` ...
    pub name: &'static str,
    /// Half the distance of the extremes, degrees.
    pub amplitude_deg: f64,
    /// Largest rate, degrees per second.
    pub peak_velocity_deg_s: f64,
    /// Largest acceleration, degrees per second squared.
    pub peak_acceleration_deg_s2: f64,
    /// Whether both are below the gate's limits.
    pub inside_gate: bool,
}

/// The verdict in a word, as in the JSON.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CertificateStatus {
    /// It oscillates, no perturbed start diverges, and [`RETURN_SHARE`] of them come back.
    Accepted,
    /// From its own start it settles on no oscillation.
    DoesNotOscillate,
    /// In f32 at 1 ms a state reaches its bound.
    LeavesItsBound,
    /// A perturbed start reaches its bound or loses the size of the orbit.
    PerturbedStartsDiverge,
    /// No perturbed start diverges, but too few come back to the orbit: the phases between joints are not held.
    PerturbedStartsDoNotComeBack,
    /// It is to follow a walker, and does not lock from every start.
    DoesNotLock,
}

impl CertificateStatus {
    /// As words for a person.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Accepted => "accepted",
            Self::DoesNotOscillate => "it does not oscillate from its own start",
            Self::LeavesItsBound => "in f32 at 1 ms it leaves its bound",
            Self::PerturbedStartsDiverge => "perturbed starts diverge",
            Self::PerturbedStartsDoNotComeBack => "perturbed starts do not come back",
            Self::DoesNotLock => "it does not lock on its walker from every start",
        }
    }
}

/// A start that diverged.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Diverged {
    /// Its number.
    pub start: u32,
    /// The state that it began in, in amplitudes: displacement of each joint, then velocity of each.
    pub state: Vec<f64>,
}

/// The certificate.
#[derive(Debug, Clone, Serialize)]
pub struct Certificate {
    /// Kind of the generator.
    pub generator: &'static str,
    /// Settles on an oscillation.
    pub oscillates: bool,
    /// Period on the limit cycle, seconds.
    pub period_s: f64,
    /// Random starts that were tried; 0 where the only state is a phase, which every start is on.
    pub starts: u32,
    /// Those on the orbit after [`START_STRIDES`] strides.
    pub converged: u32,
    /// Those that reached their bound or lost the rhythm.
    pub diverged: u32,
    /// Perturbed starts near the orbit that were tried.
    pub perturbed: u32,
    /// The perturbed starts that diverged: one is enough to refuse the set.
    pub perturbed_diverged: Vec<Diverged>,
    /// Perturbed starts that came back to the orbit with every phase, not only the amplitudes.
    pub perturbed_locked: u32,
    /// Seconds until a push is within 5 percent for good; none if it is not within the strides that it was given.
    pub settling_s: Option<f64>,
    /// Absolute values of the Floquet multipliers without the trivial one, largest first.
    pub multipliers: Vec<f64>,
    /// Lowest and highest frequency of a master that locks it 1:1 at the strongest forcing, Hz; none where nothing locks it.
    pub entrainment_hz: Option<[f64; 2]>,
    /// The same for every strength of forcing, the weakest first: an Arnold tongue. Empty where the phase itself is the input.
    pub entrainment: Vec<Tongue>,
    /// What the master does, in words.
    pub entrainment_by: String,
    /// How it locks on a walker; none of a generator that is not led by a sensor.
    pub following: Option<Following>,
    /// Longest control period in f32, milliseconds.
    pub largest_step_ms: f64,
    /// The joints.
    pub joints: Vec<JointPeaks>,
    /// What it lacks first, if anything.
    pub status: CertificateStatus,
    /// Whether the status is [`CertificateStatus::Accepted`].
    pub accepted: bool,
    /// Why it was not.
    pub refused_because: Option<String>,
}

/// The orbit as points in time.
pub(crate) struct Orbit {
    pub(crate) points: Vec<Vec<f64>>,
    pub(crate) period_s: f64,
    /// Length in steps.
    pub(crate) steps: f64,
}

impl Orbit {
    /// Largest difference from the nearest point.
    fn distance(&self, state: &[f64]) -> f64 {
        let to = |point: &Vec<f64>| point.iter().zip(state).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        self.points.iter().map(to).fold(f64::MAX, f64::min)
    }

    /// Largest size of a state on it.
    pub(crate) fn size(&self, index: usize) -> f64 {
        self.points.iter().map(|p| p[index].abs()).fold(0.0, f64::max)
    }
}

/// Measures a set. `starts` random starts (1000 for a certificate); `progress` is told what is being measured.
///
/// # Errors
/// The set cannot be built at the certificate's own step; the text says why.
pub fn certify(
    set: &GeneratorSet,
    starts: u32,
    gate: &LoopConfig,
    progress: &mut dyn FnMut(&str),
) -> Result<Certificate, String> {
    let step = Period::from_micros(STEP_MICROS).ok_or("no such step")?;
    progress("limit cycle");
    let (peaks, f32_sound) = peaks(set, gate)?;
    let mut certificate = Certificate {
        generator: set.name(),
        oscillates: false,
        period_s: f64::NAN,
        starts,
        converged: 0,
        diverged: 0,
        perturbed: 0,
        perturbed_diverged: vec![],
        perturbed_locked: 0,
        settling_s: None,
        multipliers: vec![],
        entrainment_hz: None,
        entrainment: vec![],
        entrainment_by: "not measured: no oscillation to lock".into(),
        following: None,
        largest_step_ms: 0.0,
        joints: peaks,
        status: CertificateStatus::DoesNotOscillate,
        accepted: false,
        refused_because: None,
    };
    let Some(specimen) = specimen(set, step)? else {
        // One phase that advances by a constant: every start is on the cycle, and a push to a joint does not reach the phase.
        certificate.oscillates = f32_sound;
        certificate.period_s = set.stride_guess_s();
        certificate.starts = 0;
        let mut why = None;
        if let GeneratorConfig::Follow(config) = set.config() {
            progress("lock times and lock range");
            let found = following(&config)?;
            why = found.refused_because();
            certificate.entrainment_hz = found.lock_range.map(|range| range.map(|ratio| ratio / certificate.period_s));
            certificate.entrainment_by = entrainment::by_sensor(&found);
            certificate.following = Some(found);
        } else {
            certificate.entrainment_hz = Some(entrainment::BY_PHASE_HZ);
            certificate.entrainment_by = entrainment::by_phase();
        }
        progress("largest step");
        certificate.largest_step_ms = largest_step(set, certificate.period_s);
        certificate.status = match (f32_sound, &why) {
            (false, _) => CertificateStatus::LeavesItsBound,
            (true, Some(_)) => CertificateStatus::DoesNotLock,
            (true, None) => CertificateStatus::Accepted,
        };
        return Ok(certificate.judged(why));
    };
    let Some(orbit) = limit_cycle(specimen.as_ref(), set.stride_guess_s()) else {
        return Ok(certificate.judged(None));
    };
    certificate.oscillates = f32_sound;
    certificate.period_s = orbit.period_s;

    progress("perturbed starts");
    perturb(specimen.as_ref(), &orbit, &mut certificate);
    progress("random starts");
    scatter(specimen.as_ref(), &orbit, &mut certificate);
    progress("push");
    certificate.settling_s = settle(specimen.as_ref(), &orbit);
    progress("Floquet multipliers");
    certificate.multipliers = multipliers(specimen.as_ref(), &orbit);
    progress("entrainment");
    certificate.entrainment = entrainment::tongues(specimen.as_ref(), &orbit);
    certificate.entrainment_hz = certificate.entrainment.last().and_then(Tongue::range_hz);
    certificate.entrainment_by = entrainment::by_link();
    progress("largest step");
    certificate.largest_step_ms = largest_step(set, orbit.period_s);

    let tried = certificate.perturbed;
    let (status, why) = if !certificate.oscillates {
        (CertificateStatus::LeavesItsBound, None)
    } else if let Some(first) = certificate.perturbed_diverged.first() {
        let all = certificate.perturbed_diverged.len();
        let state: Vec<String> = first.state.iter().map(|x| format!("{x:.4}")).collect();
        let why = format!("{all} of {tried}, the first is start {} at {} amplitudes", first.start, state.join(" "));
        (CertificateStatus::PerturbedStartsDiverge, Some(why))
    } else if f64::from(certificate.perturbed_locked) < RETURN_SHARE * f64::from(tried) {
        let why = format!(
            "{} of {tried} are on the orbit after {RETURN_STRIDES} strides; allowed is {:.0} or more",
            certificate.perturbed_locked,
            (RETURN_SHARE * f64::from(tried)).ceil()
        );
        (CertificateStatus::PerturbedStartsDoNotComeBack, Some(why))
    } else {
        (CertificateStatus::Accepted, None)
    };
    certificate.status = status;
    Ok(certificate.judged(why))
}

impl Certificate {
    /// Draws the conclusions from the status.
    fn judged(mut self, why: Option<String>) -> Self {
        self.accepted = self.status == CertificateStatus::Accepted;
        self.refused_because = (!self.accepted).then(|| match why {
            Some(why) => format!("{}: {why}", self.status.words()),
            None => self.status.words().into(),
        });
        self
    }
}

fn steps_per(seconds: f64) -> u32 {
    (seconds * 1e6 / f64::from(STEP_MICROS)).ceil() as u32
}

/// Upward zero crossings of the first displacement, in steps, over so many steps.
fn crossings(specimen: &mut dyn Specimen, steps: u32) -> Vec<f64> {
    let mut marks = vec![];
    let mut before = specimen.state()[0];
    for step in 0..steps {
        specimen.step();
        let now = specimen.state()[0];
        if before < 0.0 && now >= 0.0 {
            marks.push(f64::from(step) - before / (now - before));
        }
        before = now;
    }
    marks
}

fn limit_cycle(built: &dyn Specimen, guess_s: f64) -> Option<Orbit> {
    let mut specimen = built.copy();
    let stride = steps_per(guess_s);
    for _ in 0..stride * 100 {
        specimen.step();
    }
    let mut follower = specimen.copy();
    let marks = crossings(follower.as_mut(), stride * 25);
    let cycles = marks.len().checked_sub(1).filter(|&n| n >= 10)?;
    let steps = (marks[cycles] - marks[0]) / cycles as f64;
    let even = marks.windows(2).all(|w| (w[1] - w[0] - steps).abs() < 0.05 * steps);
    let mut points = vec![];
    let stride = (steps / ORBIT_POINTS as f64).max(1.0);
    let mut next = 0.0;
    for step in 0..steps.ceil() as u32 {
        if f64::from(step) >= next {
            points.push(specimen.state());
            next += stride;
        }
        specimen.step();
    }
    let orbit = Orbit { points, period_s: steps * f64::from(STEP_MICROS) * 1e-6, steps };
    let swings = (0..4).all(|joint| orbit.size(joint) > 0.05);
    (even && swings && specimen.sound()).then_some(orbit)
}

/// Largest displacement of each joint over one period.
fn sizes(specimen: &mut dyn Specimen, orbit: &Orbit) -> Vec<f64> {
    let mut sizes = vec![0.0f64; 4];
    for _ in 0..orbit.steps.ceil() as u32 {
        specimen.step();
        for (size, x) in sizes.iter_mut().zip(specimen.state()) {
            *size = size.max(x.abs());
        }
    }
    sizes
}

/// Whether each joint still swings between half and one and a half times as far as on the orbit.
fn keeps_size(specimen: &mut dyn Specimen, orbit: &Orbit) -> bool {
    let sizes = sizes(specimen, orbit);
    specimen.sound() && sizes.iter().enumerate().all(|(joint, s)| (0.5..1.5).contains(&(s / orbit.size(joint))))
}

fn run(specimen: &mut dyn Specimen, steps: f64) {
    for _ in 0..steps as u32 {
        specimen.step();
    }
}

fn perturb(built: &dyn Specimen, orbit: &Orbit, certificate: &mut Certificate) {
    let mut random = Random(8);
    for start in 0..100u32 {
        let point = &orbit.points[start as usize * orbit.points.len() / 100];
        let state: Vec<f64> = point.iter().map(|x| x + random.within(0.08)).collect();
        let mut specimen = built.copy();
        if !specimen.set_state(&state) {
            continue;
        }
        certificate.perturbed += 1;
        run(specimen.as_mut(), orbit.steps * f64::from(RETURN_STRIDES));
        certificate.perturbed_locked += u32::from(orbit.distance(&specimen.state()) < 0.05);
        if !keeps_size(specimen.as_mut(), orbit) {
            certificate.perturbed_diverged.push(Diverged { start, state });
        }
    }
}

fn scatter(built: &dyn Specimen, orbit: &Orbit, certificate: &mut Certificate) {
    let mut random = Random(1);
    let dimensions = built.state().len();
    for _ in 0..certificate.starts {
        let state: Vec<f64> = (0..dimensions).map(|_| random.within(START_BOX)).collect();
        let mut specimen = built.copy();
        if !specimen.set_state(&state) {
            certificate.diverged += 1;
            continue;
        }
        run(specimen.as_mut(), orbit.steps * f64::from(START_STRIDES));
        if orbit.distance(&specimen.state()) < 0.05 {
            certificate.converged += 1;
        } else if !keeps_size(specimen.as_mut(), orbit) {
            certificate.diverged += 1;
        }
    }
}

fn settle(built: &dyn Specimen, orbit: &Orbit) -> Option<f64> {
    let mut specimen = built.copy();
    let mut state = orbit.points[0].clone();
    let velocity = state.len() / 2;
    *state.get_mut(velocity)? += 0.5;
    if !specimen.set_state(&state) {
        return None;
    }
    let steps = orbit.steps as u32 * RETURN_STRIDES;
    let mut last_outside = 0;
    for step in 0..steps {
        if orbit.distance(&specimen.state()) > 0.05 {
            last_outside = step + 1;
        }
        specimen.step();
    }
    (last_outside < steps).then_some(f64::from(last_outside) * f64::from(STEP_MICROS) * 1e-6)
}

/// Eigenvalues of the map over one period. The fraction of a step that a period leaves is bridged linearly, on both sides alike.
fn multipliers(built: &dyn Specimen, orbit: &Orbit) -> Vec<f64> {
    let n = built.state().len();
    let after = |state: &[f64]| {
        let mut specimen = built.copy();
        specimen.set_state(state);
        run(specimen.as_mut(), orbit.steps.floor());
        let low = specimen.state();
        specimen.step();
        let part = orbit.steps.fract();
        low.iter().zip(specimen.state()).map(|(a, b)| a + part * (b - a)).collect::<Vec<_>>()
    };
    let size = 1e-5;
    let base = &orbit.points[0];
    let mut map = DMatrix::<f64>::zeros(n, n);
    for column in 0..n {
        let (mut plus, mut minus) = (base.clone(), base.clone());
        plus[column] += size;
        minus[column] -= size;
        for (row, (a, b)) in after(&plus).iter().zip(after(&minus)).enumerate() {
            map[(row, column)] = (a - b) / (2.0 * size);
        }
    }
    let mut values: Vec<_> = map.complex_eigenvalues().iter().copied().collect();
    // The trivial multiplier is the one nearest to 1: along the orbit nothing contracts.
    let nearest = |a: &nalgebra::Complex<f64>| (a - nalgebra::Complex::new(1.0, 0.0)).norm();
    if let Some(trivial) = (0..values.len()).min_by(|&a, &b| nearest(&values[a]).total_cmp(&nearest(&values[b]))) {
        values.remove(trivial);
    }
    let mut sizes: Vec<f64> = values.into_iter().map(nalgebra::Complex::norm).collect();
    sizes.sort_by(|a, b| b.total_cmp(a));
    sizes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::file::{Coefficients, FollowSet, GeneratorFile, ShapeJoint, ShapeSet};
    use cpg_core::entrainment::EventSource;
    use joint_units::Joint;

    fn coefficients(numbers: &[f32]) -> Coefficients {
        Coefficients::new(numbers).expect("1 to 8")
    }

    fn certificate(set: &GeneratorSet, starts: u32) -> Certificate {
        certify(set, starts, &LoopConfig::default_biped(), &mut |_| ()).expect("built")
    }

    /// The default walk: the numbers that the literature table of R1 at eps = kap = 0.5 gives.
    #[test]
    fn the_default_walk_is_certified() {
        let got = certificate(&GeneratorFile::default_of("phase-coupled").unwrap().set, 200);
        assert!(got.accepted && got.oscillates);
        assert_eq!((got.converged, got.diverged, got.perturbed, got.perturbed_locked), (200, 0, 100, 100));
        assert!((got.period_s - 1.1).abs() < 1e-4, "{}", got.period_s);
        assert!((got.multipliers[0] - 0.054).abs() < 0.002, "{:?}", got.multipliers);
        assert_eq!(got.multipliers.len(), 7);
        assert!(got.settling_s.unwrap() < 3.0);
        assert!(got.joints.iter().all(|joint| joint.inside_gate));
        assert!((got.joints[0].amplitude_deg - 20.8).abs() < 0.2 && (got.joints[3].amplitude_deg - 31.2).abs() < 0.2);
        assert!(got.largest_step_ms >= 10.0);
    }

    /// The thesis' network oscillates and keeps its size, but its hip-knee phase is not locked: few starts end on the orbit.
    #[test]
    fn the_thesis_network_shows_its_small_basin() {
        let got = certificate(&GeneratorFile::default_of("thesis").unwrap().set, 50);
        assert!(got.oscillates);
        assert!(got.converged < 10, "{}", got.converged);
        assert!(got.perturbed_locked < 60, "{}", got.perturbed_locked);
        assert!((got.period_s - 1.1).abs() < 0.01);
        assert!(got.multipliers[0] > 0.99, "{:?}", got.multipliers);
        // Nothing grows, but hip and knee do not find each other again: no walk to accept.
        assert!(got.perturbed_diverged.is_empty());
        assert_eq!((got.status, got.accepted), (CertificateStatus::PerturbedStartsDoNotComeBack, false));
        let because = got.refused_because.unwrap();
        assert!(because.starts_with("perturbed starts do not come back: 0 of 100"), "{because}");
    }

    /// The table of R1 at w = 2 pi/1.1: period and leading multiplier, from an integration of other make.
    #[test]
    fn period_and_contraction_of_r1_are_those_of_the_table() {
        for (nonlinearity, coupling, period_s, multiplier) in [
            (0.2, 0.1, 1.102_732_28, 0.531),
            (0.2, 0.2, 1.102_703_34, 0.288),
            (0.5, 0.2, 1.116_638_80, 0.268),
            (0.5, 0.5, 1.115_436_42, 0.054),
            (1.0, 0.5, 1.157_577_24, 0.024),
        ] {
            let GeneratorSet::PhaseCoupled(mut set) = GeneratorFile::default_of("phase-coupled").unwrap().set else {
                panic!("R1")
            };
            (set.natural_period_s, set.nonlinearity, set.coupling) = (1.1, nonlinearity, [coupling; 4]);
            let step = Period::from_micros(STEP_MICROS).unwrap();
            let specimen = super::specimen(&GeneratorSet::PhaseCoupled(set), step).unwrap().unwrap();
            let orbit = limit_cycle(specimen.as_ref(), 1.1).unwrap();
            assert!((orbit.period_s - period_s).abs() < 3e-6, "{nonlinearity}, {coupling}: {}", orbit.period_s);
            let found = multipliers(specimen.as_ref(), &orbit)[0];
            assert!((found - multiplier).abs() < 1.5e-3, "{nonlinearity}, {coupling}: {found}");
        }
    }

    /// One phase: nothing to perturb, and it follows any stride that it can be set to.
    #[test]
    fn a_shape_is_accepted_and_says_how_it_is_led() {
        let joint = ShapeJoint { mean_deg: 10.0, cos_deg: coefficients(&[20.0]), sin_deg: coefficients(&[0.0]) };
        let joints = std::array::from_fn(|_| joint.clone());
        let got = certificate(&GeneratorSet::Shape(ShapeSet { stride_s: 1.1, joints }), 10);
        assert!(got.accepted && (got.starts, got.perturbed) == (0, 0) && got.entrainment.is_empty());
        assert_eq!(got.following, None);
        assert_eq!(got.entrainment_hz, Some([0.05, 5.0]));
        assert!(got.entrainment_by.contains("0.050 to 5.000 Hz"), "{}", got.entrainment_by);
    }

    /// A follower is measured while it follows its own walker; one that does not lock is refused.
    #[test]
    fn a_follower_is_certified_on_its_walker() {
        let set = |cos_deg: Vec<f32>| {
            let sin_deg = coefficients(&vec![0.0; cos_deg.len()]);
            let joint = ShapeJoint { mean_deg: 10.0, sin_deg, cos_deg: coefficients(&cos_deg) };
            let shape = ShapeSet { stride_s: 1.1, joints: std::array::from_fn(|_| joint.clone()) };
            GeneratorSet::Follow(FollowSet { sensor: Joint::LeftHip, events: EventSource::None, shape })
        };
        let got = certificate(&set(vec![20.0, -4.0]), 10);
        let found = got.following.clone().expect("a follower");
        assert!(got.accepted && found.late == 0 && got.entrainment_by.contains("sensor on left_hip"));
        assert_eq!(got.entrainment_hz, found.lock_range.map(|range| range.map(|ratio| ratio / got.period_s)));
        assert!((got.joints[0].amplitude_deg - 20.0).abs() < 0.5, "{:?}", got.joints);
        assert!((1.0..=4.2).contains(&got.largest_step_ms), "{} ms", got.largest_step_ms);
        let got = certificate(&set(vec![1.0, 20.0]), 10);
        assert_eq!((got.status, got.accepted), (CertificateStatus::DoesNotLock, false));
        let because = got.refused_because.unwrap();
        assert!(because.starts_with("it does not lock on its walker from every start: "), "{because}");
    }

    /// Difference links that pull into phase, under a start in antiphase: the antiphase orbit is there, but any asymmetry leaves it.
    #[test]
    fn a_set_whose_perturbed_starts_diverge_is_refused_with_the_start() {
        let GeneratorSet::Thesis(mut set) = GeneratorFile::default_of("thesis").unwrap().set else {
            panic!("the thesis")
        };
        set.product_per_deg_s = [[0.0; 2]; 2];
        set.difference_per_s = [[-0.1; 2]; 2];
        for joint in &mut set.joints {
            joint.alpha_per_s = 0.3;
        }
        let set = GeneratorSet::Thesis(set);
        let got = certificate(&set, 5);
        assert!(!got.accepted && got.oscillates);
        let first = got.perturbed_diverged.first().expect("a start");
        assert_eq!(got.status, CertificateStatus::PerturbedStartsDiverge);
        let named = format!("start {} at {:.4} ", first.start, first.state[0]);
        let because = got.refused_because.unwrap();
        assert!(because.contains(&named), "{because}");
        // The start that was named does diverge, in a run of its own.
        let mut specimen = super::specimen(&set, Period::from_micros(STEP_MICROS).unwrap()).unwrap().unwrap();
        assert!(specimen.set_state(&first.state));
        let sizes = |specimen: &mut dyn Specimen| {
            let mut sizes = [0.0f64; 4];
            for _ in 0..300 {
                specimen.step();
                for (size, x) in sizes.iter_mut().zip(specimen.state()) {
                    *size = size.max(x.abs());
                }
            }
            sizes
        };
        let before = sizes(specimen.as_mut());
        run(specimen.as_mut(), 100.0 * 220.0);
        let after = sizes(specimen.as_mut());
        assert!(before.iter().zip(after).any(|(a, b)| b > 1.4 * a || b < 0.6 * a), "{before:?} {after:?}");
    }
}
