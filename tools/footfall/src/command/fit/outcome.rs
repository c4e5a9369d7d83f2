//! The result of one recording, as JSON for programs and as a line of text.

use gait_fit::fit::{Compared, Fit, Refused};
use gait_fit::judge::{HeldOut, JointFit, held_out_in_words, pooled};
use gait_fit::measures::Measures;
use gait_trace::Finding;
use gait_trace::stride::cycle::{Cycle, POINTS};
use generator_file::certificate::Certificate;
use joint_units::Joint;
use serde::Serialize;

use crate::failure::Failure;
use crate::output;

/// The result of a recording that was fitted.
#[derive(Debug, Serialize)]
pub(super) struct Outcome<'a> {
    #[serde(skip)]
    fit: &'a Fit,
    recording: &'a str,
    sha256: &'a str,
    format: &'a str,
    /// The settings of the fit, in words.
    settings: String,
    made_by: &'a str,
    generator: &'static str,
    period_s: f64,
    strides: usize,
    /// Root mean square error on strides that were not fitted, over the joints, degrees; null for one stride.
    rmse_heldout_deg: Option<f64>,
    joints: &'a [JointFit; 4],
    held_out: HeldOut,
    /// Cadence, stride time, where 0 % is, ranges of motion.
    measures: &'a Measures,
    /// Mean stride and generator over the cycle of the joint's own leg, in the order of the joints.
    curves: [Curves; Joint::COUNT],
    /// Left against right, half a stride apart: hip and knee, degrees.
    asymmetry_deg: [f64; 2],
    asymmetric: bool,
    certificate: &'a Certificate,
    /// What the limits of the robot cost, with `--fit-limits`: root mean square change of each joint, degrees.
    limits_cost_deg: Option<[f64; 4]>,
    refused: Option<&'a Refused>,
    /// Why the generator is written only with `--force-write`: it does not come back to its orbit, does not walk, or is refused as a follower.
    not_used_because: Option<String>,
    compared: &'a [Compared],
    /// Defects of the recording, and how each was handled.
    findings: Vec<Found>,
    left_out: Vec<String>,
    notes: &'a [String],
    /// Computing time, s.
    seconds: f64,
}

impl<'a> Outcome<'a> {
    pub(super) fn of(fit: &'a Fit, seconds: f64) -> Self {
        Self {
            fit,
            recording: &fit.source.name,
            sha256: &fit.source.sha256,
            format: &fit.format,
            settings: fit.settings.to_string(),
            made_by: &fit.file.provenance.made_by,
            generator: fit.file.set.name(),
            period_s: fit.period_s,
            strides: fit.strides.cycles().len(),
            rmse_heldout_deg: pooled(&fit.joints, |joint| joint.rmse_heldout_deg),
            joints: &fit.joints,
            held_out: fit.held_out,
            measures: &fit.measures,
            curves: Joint::ALL.map(|joint| Curves::of(fit, joint)),
            asymmetry_deg: fit.strides.asymmetry_deg(),
            asymmetric: fit.asymmetric,
            certificate: &fit.certificate,
            limits_cost_deg: fit.limits_cost_deg,
            refused: fit.refused.as_ref(),
            not_used_because: fit.not_used_because(),
            compared: &fit.compared,
            findings: fit.conditioned.findings.iter().map(Found::of).collect(),
            left_out: fit.strides.left_out.iter().map(ToString::to_string).collect(),
            notes: &fit.notes,
            seconds,
        }
    }

    /// One JSON object.
    pub(super) fn to_json(&self) -> Result<String, Failure> {
        serde_json::to_string(self).map_err(Failure::run)
    }

    /// Prints notes and findings to standard error.
    pub(super) fn print_notes(&self) {
        output::notes(self.notes);
        output::findings(&self.fit.conditioned.findings);
    }

    /// Whether it walks on the robot, with the errors as driven.
    pub(super) fn walks(&self) -> String {
        let words = self.certificate.drive.in_words();
        let driven: Option<Vec<String>> = self
            .joints
            .iter()
            .map(|joint| Some(format!("{} {:.2}", joint.name.replace('_', " "), joint.rmse_driven_deg?)))
            .collect();
        match driven {
            Some(driven) => format!("{words}; RMSE as driven in degrees: {}", driven.join(", ")),
            None => words,
        }
    }

    /// One line of text.
    pub(super) fn line(&self) -> String {
        format!(
            "{}: {}, {} strides of {:.3} s, {}",
            self.recording,
            self.generator,
            self.strides,
            self.fit.strides.period_s,
            held_out_in_words(self.joints)
        )
    }
}

/// Every how many points of a stride the curves have one.
const EVERY: usize = 4;

/// One joint over the cycle of its leg, in equal steps, for small pictures.
#[derive(Debug, Serialize)]
struct Curves {
    name: &'static str,
    mean_deg: Vec<f64>,
    generator_deg: Vec<f64>,
}

impl Curves {
    fn of(fit: &Fit, joint: Joint) -> Self {
        let thinned = |cycle: &Cycle| {
            let own: [f64; POINTS] = fit.measures.cycle_start.own_cycle(cycle, joint);
            own.iter().step_by(EVERY).map(|angle| (angle * 100.0).round() / 100.0).collect()
        };
        Self { name: joint.name(), mean_deg: thinned(&fit.strides.mean()), generator_deg: thinned(&fit.cycle) }
    }
}

/// A defect of the recording, how it was handled, and how much it matters: `note`, `warning` or `error`.
#[derive(Debug, Serialize)]
struct Found {
    level: &'static str,
    text: String,
}

impl Found {
    fn of(finding: &Finding) -> Self {
        Self { level: finding.level().name(), text: finding.to_string() }
    }
}

/// A recording that could not be fitted.
#[derive(Debug, Serialize)]
pub(super) struct Failed<'a> {
    pub(super) recording: &'a str,
    pub(super) sha256: &'a str,
    pub(super) settings: String,
    pub(super) made_by: &'static str,
    pub(super) error: String,
}

/// A file of a folder that is no recording of gait.
#[derive(Debug, Serialize)]
pub(super) struct Skipped<'a> {
    pub(super) recording: &'a str,
    pub(super) sha256: &'a str,
    pub(super) made_by: &'static str,
    /// The reason.
    pub(super) skipped: &'a str,
}
