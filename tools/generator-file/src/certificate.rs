//! The certificate of a generator: measured properties, whether it is accepted, and whether it walks on a robot.
//!
//! | question | how it is measured |
//! |---|---|
//! | orbit, period | from its own start; the orbit by Newton's method ([`crate::subject`] has the step); without one it is quasi-periodic, irregular or still |
//! | contraction | Floquet multipliers: eigenvalues of the differential of the map over one period, without the trivial one |
//! | return | kicks of half an amplitude of every state at [`KICK_PHASES`] phases, and [`RANDOM_KICKS`] of all states: the distance from the orbit falls to a tenth within [`RETURN_STRIDES`] strides |
//! | settling time | the longest time of these kicks until the distance is and stays below a tenth of the first |
//! | random starts | states within ±[`START_BOX`] amplitudes: how many are on the orbit after [`START_STRIDES`] strides |
//! | motion and limits | range, rate and acceleration of each joint and the pose limits in f32 at 1 ms, from the generator's own start over the whole way to the orbit, and 20 strides of the orbit ([`crate::limits`]) |
//! | walks | the control loop with the robot's limits over the same time ([`crate::drive`]) |
//! | entrainment | a link from a master oscillator at three strengths; frequencies of the master that lock every joint 1:1 ([`crate::entrainment`]) |
//! | following | only a follower: lock times, lock range, steady phase error ([`crate::following`]) |
//! | corrections | only a follower with corrections: their size where the measured joint differs from its template by twice what is usual ([`crate::corrected`]) |
//! | largest stable step | longest control period in f32 at which the period is right within 1 percent |
//!
//! A distance is that from the nearest point of the orbit, all states together: one time shift of all joints, no shift of a single one.
//!
//! [`CertificateStatus`] is the first condition that is not met, in the order of its list, or accepted; `refused_because` names all.

use joint_loop::{GateConfig, GeneratorConfig, LoopConfig};
use serde::Serialize;

use crate::corrected::{Corrected, corrected};
use crate::drive::{Drive, drive};
use crate::entrainment::{self, Tongue};
use crate::file::GeneratorSet;
use crate::following::{Following, following};
use crate::limits::{Excess, JointPeaks, Measured, STILL_DEG, measure};
use crate::orbit::Motion;
use crate::returns::{Return, in_words};
use crate::single_precision::largest_step;
use crate::subject::{Settled, Subject};

pub use crate::returns::{KICK_PHASES, RANDOM_KICKS, RETURN_STRIDES, START_BOX, START_STRIDES};
pub use crate::status::{CertificateStatus, Verdict};

/// The certificate.
#[derive(Debug, Clone, Serialize)]
pub struct Certificate {
    /// Kind of the generator, or name of the gait or model.
    pub generator: &'static str,
    /// Its orbit, and whether it comes back to it.
    #[serde(flatten)]
    pub returns: Return,
    /// Lowest and highest frequency of a master that locks it 1:1 at the strongest forcing, Hz; none if no frequency locks it.
    pub entrainment_hz: Option<[f64; 2]>,
    /// The same for every strength of forcing, the weakest first: an Arnold tongue. Empty if the phase itself is an input.
    pub entrainment: Vec<Tongue>,
    /// The input that entrains it, in words.
    pub entrainment_by: String,
    /// How it locks on a person; none if it is no follower.
    pub following: Option<Following>,
    /// What its corrections do; none without corrections. Every other number of a follower is measured on the template itself, where its
    /// corrections are nearly 0.
    pub corrections: Option<Corrected>,
    /// Longest control period in `f32` at which the stride period is right within 1 percent, milliseconds.
    pub largest_step_ms: f64,
    /// The joints.
    pub joints: Vec<JointPeaks>,
    /// The limits of the robot that the motion exceeds.
    pub excesses: Vec<Excess>,
    /// How it does in the control loop of the robot.
    pub drive: Drive,
    /// The first condition that is not met, or accepted.
    pub status: CertificateStatus,
    /// Whether the status is [`CertificateStatus::Accepted`].
    pub accepted: bool,
    /// Why it was not accepted: every condition that is not met, that of the status first.
    pub refused_because: Option<String>,
    /// The same as data: each condition that is not met, and why in words and numbers where there is more to say than the condition itself.
    #[serde(skip)]
    pub reasons: Vec<Verdict>,
}

/// Measures the set of a generator file, see [`certify_subject`].
///
/// # Errors
/// As [`certify_subject`].
pub fn certify(
    set: &GeneratorSet,
    starts: u32,
    robot: &LoopConfig,
    progress: &mut dyn FnMut(&str),
) -> Result<Certificate, String> {
    certify_subject(&Subject::Set(set.clone()), starts, robot, progress)
}

/// Measures a generator. `starts`: number of random starts (1000 for a certificate); `progress` is called with the name of each
/// measurement.
///
/// # Errors
/// It cannot be built; the text says why.
pub fn certify_subject(
    subject: &Subject,
    starts: u32,
    robot: &LoopConfig,
    progress: &mut dyn FnMut(&str),
) -> Result<Certificate, String> {
    progress("motion and limits");
    let measured = measure(subject, &robot.gate)?;
    progress("control loop");
    let drive = drive(subject, robot, &measured.excesses)?;
    let mut certificate = Certificate {
        generator: subject.kind(),
        returns: Return::default(),
        entrainment_hz: None,
        entrainment: vec![],
        entrainment_by: entrainment::not_measured("it has no orbit"),
        following: None,
        corrections: None,
        largest_step_ms: 0.0,
        joints: measured.joints.clone(),
        excesses: measured.excesses.clone(),
        drive,
        status: CertificateStatus::Accepted,
        accepted: false,
        refused_because: None,
        reasons: vec![],
    };
    progress("orbit");
    let mut reasons = match subject.motion()? {
        None => certificate.phase_only(subject, &measured, &robot.gate, progress)?,
        Some(settled) => certificate.of_model(subject, &settled, starts, &measured, progress),
    };
    reasons.extend(does_not_walk(&certificate.drive, &measured.excesses));
    certificate.status = reasons.first().map_or(CertificateStatus::Accepted, |(status, _)| *status);
    certificate.accepted = reasons.is_empty();
    let words: Vec<String> = reasons.iter().map(in_words).collect();
    certificate.refused_because = (!certificate.accepted).then(|| words.join("; also "));
    certificate.reasons = reasons;
    Ok(certificate)
}

impl Certificate {
    /// Why it is refused as a follower, whatever the robot: it does not lock, or its corrections are at their bound.
    #[must_use]
    pub fn refused_as_follower(&self) -> Option<String> {
        let lock = self.following.as_ref().and_then(Following::refused_because);
        lock.or_else(|| self.corrections.as_ref().and_then(Corrected::refused_because))
    }

    /// The only state is a phase that advances by a constant: every state is on the orbit. Returns the conditions that are not met.
    fn phase_only(
        &mut self,
        subject: &Subject,
        measured: &Measured,
        gate: &GateConfig,
        progress: &mut dyn FnMut(&str),
    ) -> Result<Vec<Verdict>, String> {
        let period_s = subject.stride_guess_s();
        (self.returns.oscillates, self.returns.period_s) = (measured.still().next().is_none(), period_s);
        let (mut lock, mut at_bound) = (None, None);
        let config = if let Subject::Set(set) = subject { Some(set.config()) } else { None };
        match config {
            Some(GeneratorConfig::Follow(config)) => {
                progress("lock times and lock range");
                let found = following(&config)?;
                lock = found.refused_because();
                self.entrainment_hz = found.lock_range.map(|range| range.map(|ratio| ratio / period_s));
                self.entrainment_by = entrainment::by_sensor(&found);
                self.following = Some(found);
                progress("corrections");
                self.corrections = corrected(&config, gate)?;
                at_bound = self.corrections.as_ref().and_then(Corrected::refused_because);
            }
            Some(_) => {
                self.entrainment_hz = Some(entrainment::BY_PHASE_HZ);
                self.entrainment_by = entrainment::by_phase();
            }
            None => self.entrainment_by = entrainment::not_measured("its only state is a phase"),
        }
        progress("largest step");
        self.largest_step_ms = largest_step(subject, period_s);
        let lock = lock.map(|why| (CertificateStatus::DoesNotLock, Some(why)));
        let at_bound = at_bound.map(|why| (CertificateStatus::CorrectionsAtBound, Some(why)));
        Ok([still(measured), unsound(measured), lock, at_bound, beyond(measured, &self.drive)]
            .into_iter()
            .flatten()
            .collect())
    }

    /// Everything that needs the states. Returns the conditions that are not met.
    fn of_model(
        &mut self,
        subject: &Subject,
        settled: &Settled,
        starts: u32,
        measured: &Measured,
        progress: &mut dyn FnMut(&str),
    ) -> Vec<Verdict> {
        let model = settled.model.as_ref();
        self.returns = Return::of(settled, starts, progress);
        let returns = self.returns.verdict();
        if matches!(settled.motion, Motion::Still) {
            return vec![(CertificateStatus::DoesNotOscillate, None)];
        }
        let reasons = [still(measured), unsound(measured), returns, beyond(measured, &self.drive)]
            .into_iter()
            .flatten()
            .collect();
        let Motion::Periodic(orbit) = &settled.motion else { return reasons };
        if model.has_joint_states() {
            progress("entrainment");
            self.entrainment = entrainment::tongues(model, orbit);
            self.entrainment_hz = self.entrainment.last().and_then(Tongue::range_hz);
            self.entrainment_by = entrainment::by_link();
        } else {
            self.entrainment_by = entrainment::not_measured("its states are not those of joints");
        }
        progress("largest step");
        self.largest_step_ms = largest_step(subject, orbit.period_s);
        reasons
    }
}

fn still(measured: &Measured) -> Option<Verdict> {
    let still: Vec<String> =
        measured.still().map(|joint| format!("{} {:.4}", joint.name, joint.amplitude_deg)).collect();
    let why = || format!("amplitude {} degrees; allowed is {STILL_DEG} or more", still.join(", "));
    (!still.is_empty()).then(|| (CertificateStatus::JointsDoNotMove, Some(why())))
}

fn unsound(measured: &Measured) -> Option<Verdict> {
    (!measured.sound).then_some((CertificateStatus::LeavesItsBound, None))
}

fn does_not_walk(drive: &Drive, excesses: &[Excess]) -> Option<Verdict> {
    let why = drive.why_not.as_deref()?;
    // A limit that is exceeded is a reason of its own.
    let known = excesses.iter().find_map(|excess| why.strip_suffix(&format!(": {excess}")));
    Some((CertificateStatus::DoesNotWalk, Some(known.unwrap_or(why).into())))
}

fn beyond(measured: &Measured, drive: &Drive) -> Option<Verdict> {
    let why = match measured.excesses.as_slice() {
        [first] => first.to_string(),
        [first, more @ ..] => format!("{first}, and {} more", more.len()),
        // A pose that is inside its limit can come too near to it too fast.
        [] => {
            let first = drive.first_limited_s?;
            format!(
                "they act in {} of {} ticks in the control loop, first {first:.2} s after arming",
                drive.limited_ticks, drive.ticks
            )
        }
    };
    Some((CertificateStatus::BeyondLimits, Some(why)))
}
