//! The certificate of a parameter set: measured properties of the generator, and whether it is accepted.
//!
//! | question | how it is measured |
//! |---|---|
//! | oscillation, period, amplitudes | 100 strides from the built state, then 20 by upward crossings of the first joint |
//! | convergence | random states within ±[`START_BOX`] amplitudes: how many are on the orbit after [`START_STRIDES`] strides |
//! | stability | 100 starts beside the orbit, each state changed by up to 8 percent at random: none may diverge, and [`RETURN_SHARE`] of them must be back on the orbit after [`RETURN_STRIDES`] strides |
//! | settling time | the velocity of the first joint is changed by half its amplitude; time until the state stays within 5 percent of the orbit |
//! | contraction | Floquet multipliers: eigenvalues of the differential of the map over one period |
//! | entrainment | a link from a master oscillator at three strengths; frequencies of the master that lock it 1:1 (see [`crate::entrainment`]) |
//! | following | only a follower: lock times, lock range, steady phase error (see [`crate::following`]) |
//! | largest stable step | longest control period in f32 at which the period is right within 1 percent |
//! | peaks | largest rate and acceleration of each joint over five strides in f32 at 1 ms, against the gate's limits |
//!
//! A distance is the largest difference of a state from the nearest point of the orbit, in amplitudes of that state.
//!
//! A set is accepted if it oscillates, no perturbed start diverges, and enough of them come back; a follower, if every start of its lock
//! grid locks soon and on the right phase. [`CertificateStatus`] is the first condition that is not met.

use joint_loop::{GeneratorConfig, LoopConfig};
use joint_units::Period;
use serde::Serialize;

use crate::entrainment::{self, Tongue};
use crate::file::GeneratorSet;
use crate::following::{Following, following};
use crate::model::model;
use crate::orbit::{STEP_MICROS, limit_cycle, multipliers, perturb, scatter, settle};
use crate::single_precision::{largest_step, peaks};

pub use crate::orbit::{Diverged, RETURN_SHARE, RETURN_STRIDES, START_BOX, START_STRIDES};
pub use crate::single_precision::JointPeaks;

/// Accepted, or the first condition that is not met; spelled as in the JSON.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CertificateStatus {
    /// All conditions are met.
    Accepted,
    /// From its own start it does not settle on an oscillation.
    DoesNotOscillate,
    /// In f32 at 1 ms a state reaches its bound.
    LeavesItsBound,
    /// A perturbed start reaches its bound or loses the size of the orbit.
    PerturbedStartsDiverge,
    /// No perturbed start diverges, but too few come back to the orbit: the phases between joints are not held.
    PerturbedStartsDoNotComeBack,
    /// A follower that does not lock from every start.
    DoesNotLock,
}

impl CertificateStatus {
    /// A phrase for messages.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Accepted => "accepted",
            Self::DoesNotOscillate => "it does not oscillate from its own start",
            Self::LeavesItsBound => "in f32 at 1 ms it leaves its bound",
            Self::PerturbedStartsDiverge => "perturbed starts diverge",
            Self::PerturbedStartsDoNotComeBack => "perturbed starts do not come back",
            Self::DoesNotLock => "it does not lock on its person from every start",
        }
    }
}

/// The certificate.
#[derive(Debug, Clone, Serialize)]
pub struct Certificate {
    /// Kind of the generator.
    pub generator: &'static str,
    /// Whether it settles on an oscillation.
    pub oscillates: bool,
    /// Period on the limit cycle, seconds.
    pub period_s: f64,
    /// Random starts that were tried; 0 if the only state is a phase, because every start is then on the cycle.
    pub starts: u32,
    /// Those on the orbit after [`START_STRIDES`] strides.
    pub converged: u32,
    /// Those that reached their bound or lost the amplitude of the orbit.
    pub diverged: u32,
    /// Perturbed starts that were tried.
    pub perturbed: u32,
    /// The perturbed starts that diverged: one is enough to refuse the set.
    pub perturbed_diverged: Vec<Diverged>,
    /// Perturbed starts that came back to the orbit: amplitudes and phases.
    pub perturbed_locked: u32,
    /// Settling time, seconds; none if it is longer than [`RETURN_STRIDES`] strides.
    pub settling_s: Option<f64>,
    /// Absolute values of the Floquet multipliers without the trivial one, largest first.
    pub multipliers: Vec<f64>,
    /// Lowest and highest frequency of a master that locks it 1:1 at the strongest forcing, Hz; none if no frequency locks it.
    pub entrainment_hz: Option<[f64; 2]>,
    /// The same for every strength of forcing, the weakest first: an Arnold tongue. Empty if the phase itself is an input.
    pub entrainment: Vec<Tongue>,
    /// The input that entrains it, in words.
    pub entrainment_by: String,
    /// How it locks on a person; none if it is no follower.
    pub following: Option<Following>,
    /// Longest control period in `f32` at which the stride period is right within 1 percent, milliseconds.
    pub largest_step_ms: f64,
    /// The joints.
    pub joints: Vec<JointPeaks>,
    /// The first condition that is not met, or accepted.
    pub status: CertificateStatus,
    /// Whether the status is [`CertificateStatus::Accepted`].
    pub accepted: bool,
    /// Why it was not accepted.
    pub refused_because: Option<String>,
}

/// Measures a set. `starts`: number of random starts (1000 for a certificate); `progress` is called with the name of each measurement.
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
    let Some(model) = model(set, step)? else {
        // The only state is a phase that advances by a constant: every start is on the cycle.
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
    let Some(orbit) = limit_cycle(model.as_ref(), set.stride_guess_s()) else {
        return Ok(certificate.judged(None));
    };
    certificate.oscillates = f32_sound;
    certificate.period_s = orbit.period_s;

    progress("perturbed starts");
    let perturbed = perturb(model.as_ref(), &orbit);
    certificate.perturbed = perturbed.tried;
    certificate.perturbed_locked = perturbed.back;
    certificate.perturbed_diverged = perturbed.diverged;
    progress("random starts");
    (certificate.converged, certificate.diverged) = scatter(model.as_ref(), &orbit, starts);
    progress("push");
    certificate.settling_s = settle(model.as_ref(), &orbit);
    progress("Floquet multipliers");
    certificate.multipliers = multipliers(model.as_ref(), &orbit);
    progress("entrainment");
    certificate.entrainment = entrainment::tongues(model.as_ref(), &orbit);
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
    /// Fills in the fields that follow from the status.
    fn judged(mut self, why: Option<String>) -> Self {
        self.accepted = self.status == CertificateStatus::Accepted;
        self.refused_because = (!self.accepted).then(|| match why {
            Some(why) => format!("{}: {why}", self.status.words()),
            None => self.status.words().into(),
        });
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::entrainment::STRENGTHS;
    use crate::file::{Coefficients, FollowSet, GeneratorFile, ShapeJoint, ShapeSet};
    use crate::model::Model;
    use crate::orbit::run;
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
        // No start diverges, but the phase between hip and knee does not come back.
        assert!(got.perturbed_diverged.is_empty());
        assert_eq!((got.status, got.accepted), (CertificateStatus::PerturbedStartsDoNotComeBack, false));
        let because = got.refused_because.unwrap();
        assert!(because.starts_with("perturbed starts do not come back: 0 of 100"), "{because}");
    }

    /// The only state is a phase: there is nothing to perturb, and it follows any stride in its range.
    #[test]
    fn a_shape_is_accepted_and_reports_its_input() {
        let joint = ShapeJoint { mean_deg: 10.0, cos_deg: coefficients(&[20.0]), sin_deg: coefficients(&[0.0]) };
        let joints = std::array::from_fn(|_| joint.clone());
        let got = certificate(&GeneratorSet::Shape(ShapeSet { stride_s: 1.1, joints }), 10);
        assert!(got.accepted && (got.starts, got.perturbed) == (0, 0) && got.entrainment.is_empty());
        assert_eq!(got.following, None);
        assert_eq!(got.entrainment_hz, Some([0.05, 5.0]));
        assert!(got.entrainment_by.contains("0.050 to 5.000 Hz"), "{}", got.entrainment_by);
    }

    /// A follower is measured while it follows its own person; one that does not lock is refused.
    #[test]
    fn a_follower_is_certified_on_its_person() {
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
        assert!(because.starts_with("it does not lock on its person from every start: "), "{because}");
    }

    /// Difference links that pull into phase, and a start in antiphase: the antiphase orbit exists, but it is not stable.
    #[test]
    fn diverging_perturbed_starts_are_refused_with_the_start() {
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
        // The reported start diverges in a separate run too.
        let mut model = model(&set, Period::from_micros(STEP_MICROS).unwrap()).unwrap().unwrap();
        assert!(model.set_state(&first.state));
        let sizes = |model: &mut dyn Model| {
            let mut sizes = [0.0f64; 4];
            for _ in 0..300 {
                model.step();
                for (size, x) in sizes.iter_mut().zip(model.state()) {
                    *size = size.max(x.abs());
                }
            }
            sizes
        };
        let before = sizes(model.as_mut());
        run(model.as_mut(), 100.0 * 220.0);
        let after = sizes(model.as_mut());
        assert!(before.iter().zip(after).any(|(a, b)| b > 1.4 * a || b < 0.6 * a), "{before:?} {after:?}");
    }

    /// The stronger the link, the wider the range, at both ends; it begins at the generator's own frequency.
    #[test]
    fn the_range_of_the_default_walk_is_a_tongue() {
        let set: GeneratorSet = GeneratorFile::default_of("phase-coupled").unwrap().set;
        let got = certificate(&set, 1);
        assert_eq!(got.entrainment.len(), STRENGTHS.len());
        let mut inner = [1.0, 1.0];
        for (tongue, strength) in got.entrainment.iter().zip(STRENGTHS) {
            let (low, high) = (tongue.low.unwrap(), tongue.high.unwrap());
            assert!(tongue.strength == strength && low < inner[0] - 0.003 && high > inner[1] + 0.003, "{tongue:?}");
            assert!((tongue.low_hz.unwrap() * got.period_s - low).abs() < 1e-9);
            inner = [low, high];
        }
        assert_eq!(got.entrainment_hz, got.entrainment.last().unwrap().range_hz());
    }
}
