//! The certificate of a network of six or eight joints: whether it comes back to its orbit, and whether its joints stay in their ranges.
//!
//! Orbit, kicks and random starts are measured as in [`crate::certificate`]. No robot is involved: the motion, from its own start over the whole way to
//! its orbit, is compared with the `range_deg` of its generator file. Rates, poses, the control loop and entrainment are not measured.

use cpg_core::Rk4;
use cpg_core::gait::six_and_eight_joints::{WithAnkles, WithArms};
use joint_units::Period;
use serde::Serialize;
use std::f64::consts::TAU;

use crate::limits::STILL_DEG;
use crate::model::{Model, network};
use crate::network_file::{JOINTS, NetworkJoint, NetworkSet};
use crate::orbit::{MOST_STRIDES, Motion, Orbit};
use crate::returns::{Return, in_words};
use crate::status::{CertificateStatus, Verdict};
use crate::subject::settle;

/// Moments of the orbit at which the angles are taken.
const MOMENTS: u32 = 1000;

/// The motion of one joint.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JointRange {
    /// Name of the joint.
    pub name: String,
    /// Smallest angle on the orbit, degrees.
    pub least_deg: f64,
    /// Largest angle on the orbit, degrees.
    pub most_deg: f64,
    /// Smallest and largest angle from its own start on, over the whole way to the orbit, degrees.
    pub way_deg: [f64; 2],
    /// Largest rate on the orbit, degrees per second.
    pub peak_velocity_deg_s: f64,
    /// The range of the generator file, degrees.
    pub range_deg: [f32; 2],
    /// When it leaves that range for the first time, seconds after its start; none if it does not.
    pub leaves_s: Option<f64>,
    /// Whether it does not.
    pub inside: bool,
}

/// The certificate.
#[derive(Debug, Clone, Serialize)]
pub struct NetworkCertificate {
    /// The kind of generator.
    pub generator: &'static str,
    /// Its orbit, and whether it comes back to it.
    #[serde(flatten)]
    pub returns: Return,
    /// The joints; empty without an orbit.
    pub joints: Vec<JointRange>,
    /// The first condition that is not met, or accepted.
    pub status: CertificateStatus,
    /// Whether the status is [`CertificateStatus::Accepted`].
    pub accepted: bool,
    /// Why it was not accepted: every condition that is not met, that of the status first.
    pub refused_because: Option<String>,
    /// The same as data, see [`crate::certificate::Certificate::reasons`].
    #[serde(skip)]
    pub reasons: Vec<Verdict>,
}

/// Measures a network. `starts`: number of random starts; `progress` is called with the name of each measurement.
///
/// # Errors
/// It cannot be built; the text says why.
///
/// ```
/// use generator_file::network_certificate::certify_network;
/// use generator_file::network_file::NetworkFile;
/// let walk = NetworkFile::default_of("six-joints").expect("a default");
/// let certificate = certify_network(&walk.set, 20, &mut |_| ())?;
/// assert!(certificate.accepted, "{:?}", certificate.refused_because);
/// assert!((certificate.returns.period_s - 1.1).abs() < 0.01);
/// # Ok::<(), String>(())
/// ```
pub fn certify_network(
    set: &NetworkSet,
    starts: u32,
    progress: &mut dyn FnMut(&str),
) -> Result<NetworkCertificate, String> {
    progress("orbit");
    let settled = settle(set.stride_guess_s(), |period| model(set, period).map(Some))?.ok_or("it has no states")?;
    let returns = Return::of(&settled, starts, progress);
    let joints = match &settled.motion {
        Motion::Periodic(orbit) => {
            progress("motion and ranges");
            let start = model(set, Period::MILLISECOND)?;
            joints(set, orbit, start)
        }
        _ => vec![],
    };
    let reasons: Vec<Verdict> = [still(&joints), returns.verdict(), beyond(&joints)].into_iter().flatten().collect();
    let words: Vec<String> = reasons.iter().map(in_words_of_ranges).collect();
    Ok(NetworkCertificate {
        generator: "phase-coupled",
        returns,
        joints,
        status: reasons.first().map_or(CertificateStatus::Accepted, |(status, _)| *status),
        accepted: reasons.is_empty(),
        refused_because: (!reasons.is_empty()).then(|| words.join("; also ")),
        reasons,
    })
}

/// The model in f64.
fn model(set: &NetworkSet, period: Period) -> Result<Box<dyn Model>, String> {
    if let Some(config) = set.config::<6, 7>() {
        let built = config.build::<WithAnkles, Rk4>(period).map_err(|error| error.to_string())?;
        return Ok(network(built, std::array::from_fn::<_, 6, _>(|joint| JOINTS[joint])));
    }
    let config = set.config::<8, 10>().ok_or("a network has 6 joints and 7 links, or 8 joints and 10 links")?;
    Ok(network(config.build::<WithArms, Rk4>(period).map_err(|error| error.to_string())?, JOINTS))
}

/// The motion of each joint on the orbit and from its start on. States are a displacement u and a velocity v a joint: a = a0 + A u,
/// a' = w A v.
fn joints(set: &NetworkSet, orbit: &Orbit, mut start: Box<dyn Model>) -> Vec<JointRange> {
    let states: Vec<Vec<f64>> = (0..MOMENTS).map(|k| orbit.at(f64::from(k) / f64::from(MOMENTS))).collect();
    let count = set.joints.len();
    let rate = TAU / f64::from(set.natural_period_s);
    let of_joint = |(index, joint): (usize, &NetworkJoint)| {
        let (size, offset) = (f64::from(joint.amplitude_deg), f64::from(joint.offset_deg));
        let angles = || states.iter().map(|state| offset + size * state[index]);
        let (least_deg, most_deg) = (angles().fold(f64::MAX, f64::min), angles().fold(f64::MIN, f64::max));
        JointRange {
            name: joint.name.clone(),
            least_deg,
            most_deg,
            way_deg: [f64::MAX, f64::MIN],
            peak_velocity_deg_s: states
                .iter()
                .map(|state| rate * size * state[index + count].abs())
                .fold(0.0, f64::max),
            range_deg: joint.range_deg,
            leaves_s: None,
            inside: true,
        }
    };
    let mut joints: Vec<JointRange> = set.joints.iter().enumerate().map(of_joint).collect();
    for tick in 0..=(MOST_STRIDES as f64 * set.stride_guess_s() * 1e3) as u32 {
        let state = start.state();
        for ((found, joint), u) in joints.iter_mut().zip(&set.joints).zip(state) {
            let angle = f64::from(joint.offset_deg) + f64::from(joint.amplitude_deg) * u;
            found.way_deg = [found.way_deg[0].min(angle), found.way_deg[1].max(angle)];
            let [least, most] = joint.range_deg.map(f64::from);
            if !(least..=most).contains(&angle) && found.inside {
                (found.leaves_s, found.inside) = (Some(f64::from(tick) * 1e-3), false);
            }
        }
        start.advance(1);
    }
    joints
}

fn still(joints: &[JointRange]) -> Option<Verdict> {
    let still = joints.iter().filter(|joint| joint.most_deg - joint.least_deg < 2.0 * STILL_DEG);
    let still: Vec<&str> = still.map(|joint| joint.name.as_str()).collect();
    let why = || format!("{}: allowed is an amplitude of {STILL_DEG} degrees or more", still.join(", "));
    (!still.is_empty()).then(|| (CertificateStatus::JointsDoNotMove, Some(why())))
}

fn beyond(joints: &[JointRange]) -> Option<Verdict> {
    let beyond = joints.iter().filter(|joint| !joint.inside);
    let words: Vec<String> = beyond
        .map(|joint| {
            let ([low, high], [least, most]) = (joint.way_deg, joint.range_deg);
            let first = joint.leaves_s.unwrap_or_default();
            format!(
                "{} {low:.1} to {high:.1} degrees, first {first:.2} s after its start, allowed is {least} to {most}",
                joint.name
            )
        })
        .collect();
    (!words.is_empty()).then(|| (CertificateStatus::BeyondLimits, Some(words.join(", "))))
}

/// A verdict in one sentence; the limits are those of the file and of no robot.
fn in_words_of_ranges(verdict: &Verdict) -> String {
    match verdict {
        (CertificateStatus::BeyondLimits, Some(why)) => format!("its motion exceeds a range_deg of its file: {why}"),
        other => in_words(other),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network_file::NetworkFile;

    fn certificate(set: &NetworkSet) -> NetworkCertificate {
        certify_network(set, 40, &mut |_| ()).unwrap()
    }

    #[test]
    fn six_and_eight_joints_come_back_to_their_orbit() {
        for (name, joints) in [("six-joints", 6), ("eight-joints", 8)] {
            let set = NetworkFile::default_of(name).unwrap().set;
            let found = certificate(&set);
            assert!(found.accepted, "{name}: {:?}", found.refused_because);
            // Kicks of every state: a displacement and a velocity a joint.
            assert!(found.returns.multipliers.len() == 2 * joints - 1 && found.returns.kicks > 16 * 2 * joints as u32);
            // The way from the start leads onto the orbit.
            for joint in &found.joints {
                let [low, high] = joint.way_deg;
                assert!(
                    low < joint.least_deg + 0.02 && high > joint.most_deg - 0.02 && joint.leaves_s.is_none(),
                    "{joint:?}"
                );
            }
            let ankle = &found.joints[4];
            assert!((ankle.most_deg - 12.0).abs() < 0.7 && (ankle.least_deg + 12.0).abs() < 0.7, "{ankle:?}");
        }
    }

    /// Without links the phases drift: no difference between the joints becomes smaller.
    #[test]
    fn a_network_without_links_is_refused() {
        let mut set = NetworkFile::default_of("six-joints").unwrap().set;
        set.coupling.fill(0.0);
        let found = certificate(&set);
        assert!(!found.accepted && !found.status.comes_back(), "{:?}", found.status);
    }

    #[test]
    fn a_range_and_a_joint_that_stands_are_named() {
        let mut set = NetworkFile::default_of("eight-joints").unwrap().set;
        set.joints[4].range_deg = [-5.0, 5.0];
        set.joints[7].amplitude_deg = 0.1;
        let found = certificate(&set);
        let why = found.refused_because.unwrap();
        assert!(why.starts_with("joints do not move: right_shoulder: allowed"), "{why}");
        assert!(
            why.contains("a range_deg of its file: left_ankle -12.") && why.ends_with("allowed is -5 to 5"),
            "{why}"
        );
    }
}
