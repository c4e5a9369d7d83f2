//! What came of a recording, as JSON: what a script wants to know, and what a later run needs to see that it is done.

use gait_fit::fit::{Compared, Fit, Refused};
use gait_fit::judge::{HeldOut, JointFit};
use generator_file::certificate::Certificate;
use serde::Serialize;

use crate::failure::Failure;

/// A recording that was fitted.
#[derive(Debug, Serialize)]
pub(crate) struct Outcome<'a> {
    /// The recording.
    recording: &'a str,
    sha256: &'a str,
    format: &'a str,
    /// What it takes to do it again.
    settings: String,
    made_by: &'a str,
    generator: &'static str,
    period_s: f64,
    strides: usize,
    stride_time_sd_s: f64,
    joints: &'a [JointFit; 4],
    held_out: HeldOut,
    /// Left against right, half a stride apart: hip and knee, degrees.
    asymmetry_deg: [f64; 2],
    asymmetric: bool,
    certificate: &'a Certificate,
    refused: Option<&'a Refused>,
    compared: &'a [Compared],
    /// What was found in the recording and done about it.
    findings: Vec<String>,
    left_out: Vec<String>,
    notes: &'a [String],
    seconds: f64,
}

impl<'a> Outcome<'a> {
    pub(crate) fn of(fit: &'a Fit, seconds: f64) -> Self {
        Self {
            recording: &fit.source.name,
            sha256: &fit.source.sha256,
            format: &fit.format,
            settings: fit.settings.to_string(),
            made_by: &fit.file.provenance.made_by,
            generator: fit.file.set.name(),
            period_s: fit.period_s,
            strides: fit.strides.cycles().len(),
            stride_time_sd_s: fit.strides.period_sd_s(),
            joints: &fit.joints,
            held_out: fit.held_out,
            asymmetry_deg: fit.strides.asymmetry_deg(),
            asymmetric: fit.asymmetric,
            certificate: &fit.certificate,
            refused: fit.refused.as_ref(),
            compared: &fit.compared,
            findings: fit.conditioned.findings.iter().map(ToString::to_string).collect(),
            left_out: fit.strides.left_out.iter().map(ToString::to_string).collect(),
            notes: &fit.notes,
            seconds,
        }
    }

    pub(crate) fn to_json(&self) -> Result<String, Failure> {
        serde_json::to_string(self).map_err(Failure::run)
    }
}

/// A recording that could not be fitted.
#[derive(Debug, Serialize)]
pub(crate) struct Failed<'a> {
    pub(crate) recording: &'a str,
    pub(crate) sha256: &'a str,
    pub(crate) settings: String,
    pub(crate) made_by: &'static str,
    pub(crate) error: String,
}

/// The outcome in one line for a person.
pub(crate) fn line(fit: &Fit) -> String {
    let joints: Vec<String> = fit
        .joints
        .iter()
        .map(|joint| format!("{} {:.2}", joint.name.replace('_', " "), joint.rmse_mean_stride_deg))
        .collect();
    format!(
        "{}: {}, {} strides of {:.3} s, RMSE to the mean stride in degrees: {}",
        fit.source.name,
        fit.file.set.name(),
        fit.strides.cycles().len(),
        fit.strides.period_s,
        joints.join(", ")
    )
}
