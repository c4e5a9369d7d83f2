//! Fits a phase-coupled network of six joints to a recording of hips, knees and ankles.
//!
//! Hips and knees are conditioned and cut into strides as for four joints ([`crate::fit`]); the ankles are cut at the same strides
//! ([`gait_trace::ankles`]). The errors are those of the limit cycle in f64. Arms are not fitted: no recording has them.

use cpg_core::gait::six_and_eight_joints::WithAnkles;
use gait_trace::ankles::{Ankles, AnklesError};
use gait_trace::stride::strides::segment;
use gait_trace::{ConditionError, Finding, RawJoints, Rules, StrideError, condition};
use generator_file::file::Provenance;
use generator_file::network_certificate::{NetworkCertificate, certify_network};
use generator_file::network_file::{JOINTS, NetworkFile, NetworkJoint, NetworkSet, default_range_deg};
use serde::Serialize;

use crate::fit::{LINKED, Source};
use crate::judge::{HeldOut, held_out_of, mean_of, spread};
use crate::search::{Curves, NetworkFit, fit_network};

/// Number of joints.
pub const COUNT: usize = 6;

/// Why there is no fit.
#[derive(Debug, thiserror::Error)]
pub enum SixJointsError {
    /// Hips and knees cannot be conditioned. The reason names the file.
    #[error("{0}")]
    Condition(ConditionError),
    /// The recording has no strides.
    #[error("{file}: {why}")]
    Strides {
        /// The recording.
        file: String,
        /// The reason.
        why: StrideError,
    },
    /// The time axis is a cycle.
    #[error("{0}: the time axis is a cycle, not seconds; allowed for six joints is a recording in seconds")]
    Cycle(String),
    /// The ankles cannot be cut.
    #[error("{0}")]
    Ankles(AnklesError),
    /// The fitted parameters are not a valid network.
    #[error("{file}: the fitted parameters are not a valid network: {why}")]
    Network {
        /// The recording.
        file: String,
        /// The rule that they break.
        why: String,
    },
}

/// The errors of one joint.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NetworkJointFit {
    /// Name of the joint.
    pub name: &'static str,
    /// Root mean square error of the limit cycle against the mean stride, degrees.
    pub rmse_mean_stride_deg: f64,
    /// Root mean square error on strides that were not fitted, degrees; `None` if there is only one stride.
    pub rmse_heldout_deg: Option<f64>,
    /// The same error of the mean of the fitted strides, degrees: the person's own variability.
    pub heldout_floor_deg: Option<f64>,
    /// Standard deviation of the strides about the mean stride, degrees; `None` if there is only one stride.
    pub stride_sd_deg: Option<f64>,
    /// Smallest and largest angle of all strides, degrees.
    pub recorded_deg: [f64; 2],
}

/// The result of a fit.
#[derive(Debug, Clone)]
pub struct SixJointsFit {
    /// The generator file, ready to be written.
    pub file: NetworkFile,
    /// The columns of the ankles, left and right.
    pub ankles: [String; 2],
    /// Stride period, seconds.
    pub period_s: f64,
    /// Number of strides.
    pub strides: usize,
    /// The errors.
    pub joints: [NetworkJointFit; COUNT],
    /// Choice of the strides that were not fitted.
    pub held_out: HeldOut,
    /// The certificate.
    pub certificate: NetworkCertificate,
    /// Defects of hips and knees, and what was done about each.
    pub findings: Vec<Finding>,
}

/// Fits six joints. `starts`: random starts of the certificate; `progress` is called with the name of each step.
///
/// # Errors
/// The recording cannot be fitted; the error names the file and the reason.
pub fn fit_six_joints(
    source: &Source,
    raw: &RawJoints,
    ankles: &Ankles,
    rules: &Rules,
    starts: u32,
    progress: &mut dyn FnMut(&str),
) -> Result<SixJointsFit, SixJointsError> {
    let file = || source.name.clone();
    progress("strides");
    let mut conditioned = condition(raw, rules).map_err(SixJointsError::Condition)?;
    if conditioned.normalised_cycle {
        return Err(SixJointsError::Cycle(file()));
    }
    let strides = segment(&conditioned).map_err(|why| SixJointsError::Strides { file: file(), why })?;
    conditioned.findings.extend(strides.drift().into_iter().chain(strides.differ()));
    let feet = ankles.cycles(&strides.spans, conditioned.start_s, rules.longest_bridge_s);
    let feet = feet.map_err(SixJointsError::Ankles)?;
    let curves: Vec<Curves<COUNT>> = strides
        .cycles()
        .iter()
        .zip(&feet)
        .map(|(legs, feet)| std::array::from_fn(|joint| *legs.0.get(joint).unwrap_or_else(|| &feet[joint - 4])))
        .collect();

    progress("network");
    let mean = mean_of(&curves);
    let fitted = fitted(&mean, strides.period_s);
    let network = fitted.network;
    let joint = |joint: usize| {
        let (amplitude_deg, offset_deg, phase_deg) = network.joints[joint];
        let (name, range_deg) = (JOINTS[joint].into(), default_range_deg(joint));
        NetworkJoint { name, amplitude_deg, offset_deg, phase_deg, range_deg }
    };
    let set = NetworkSet {
        natural_period_s: network.natural_period_s,
        nonlinearity: network.nonlinearity,
        coupling: vec![network.coupling; NetworkSet::links(COUNT).len()],
        joints: (0..COUNT).map(joint).collect(),
    };
    progress("held-out strides");
    let (way, errors, floor) = held_out_of(&curves, |some| self::fitted(some, strides.period_s).best_cycle);
    let certificate = certify_network(&set, starts, &mut |what| progress(&format!("certificate: {what}")));
    let certificate = certificate.map_err(|why| SixJointsError::Network { file: file(), why })?;
    let sd = (curves.len() > 1).then(|| spread(&curves, |_| mean));
    let provenance = Provenance {
        source: source.name.clone(),
        source_sha256: source.sha256.clone(),
        made_by: concat!("footfall ", env!("CARGO_PKG_VERSION")).into(),
        settings: format!(
            "generator phase-coupled, six joints, Levenberg-Marquardt; ankles {}; {} strides; range_deg of the default robot and, for ankles, of people in general",
            ankles.columns().join(" and "),
            curves.len()
        ),
    };
    Ok(SixJointsFit {
        file: NetworkFile { provenance, set },
        ankles: ankles.columns().map(str::to_owned),
        period_s: fitted.period_s,
        strides: curves.len(),
        joints: std::array::from_fn(|joint| NetworkJointFit {
            name: JOINTS[joint],
            rmse_mean_stride_deg: fitted.rmse_deg[joint],
            rmse_heldout_deg: errors.map(|errors| errors[joint]),
            heldout_floor_deg: floor.map(|floor| floor[joint]),
            stride_sd_deg: sd.map(|sd| sd[joint]),
            recorded_deg: extent(curves.iter().flat_map(|stride| stride[joint])),
        }),
        held_out: way,
        certificate,
        findings: conditioned.findings,
    })
}

fn fitted(mean: &Curves<COUNT>, period_s: f64) -> NetworkFit<COUNT> {
    fit_network::<WithAnkles, COUNT, 7>(mean, period_s, LINKED, &mut |_| ())
}

/// Smallest and largest of some values.
fn extent(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::MAX, f64::MIN], |[least, most], value| [least.min(value), most.max(value)])
}
