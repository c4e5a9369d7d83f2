//! Whether the angles of hips and knees are possible for a person, after signs were decided: flexion positive, standing upright 0.
//!
//! A knee bends by up to 160 degrees and overextends by up to 25, a hip bends by up to 125 (140 with the pelvis) and extends by up to 30. The
//! bounds leave a margin for offsets of the zero.

use super::convention::Untimed;
use super::knee_sign::{KNEE_DEG, MOST_MEAN_DEG};
use crate::finding::{Done, FindingKind};
use crate::series::quantile;
use joint_units::Joint;

/// Smallest and largest angle of a hip, degrees, without the outermost hundredths; that of a knee is [`KNEE_DEG`].
pub const HIP_DEG: (f64, f64) = (-70.0, 150.0);
/// Means of a hip that are possible at all, degrees.
pub const HIP_MOST_MEAN_DEG: (f64, f64) = (-60.0, 110.0);
/// Means of a hip in a gait of any kind, degrees; beyond them the zero of the angle is probably not an upright stand.
pub const HIP_MEAN_DEG: (f64, f64) = (-40.0, 80.0);

/// Largest mean of a knee in a gait of any kind, degrees, of which the same holds: patients in crouch gait have up to 75.
pub const KNEE_MOST_MEAN_DEG: f64 = 90.0;

/// An angle that no person has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Impossible {
    /// The joint.
    pub joint: Joint,
    /// What is out of bounds, in words: the angle, or its mean.
    pub what: &'static str,
    /// The angle, degrees.
    pub found_deg: f64,
    /// Smallest and largest allowed angle, degrees.
    pub allowed_deg: (f64, f64),
}

/// What is doubtful about the angles.
///
/// # Errors
/// The first joint with an angle that no person has.
pub(crate) fn check(joints: &[Option<Vec<f64>>; Joint::COUNT], unusable: &[bool]) -> Result<Vec<Untimed>, Impossible> {
    let mut findings = Vec::new();
    for (joint, x) in Joint::ALL.into_iter().zip(joints) {
        let Some(x) = x else { continue };
        let good: Vec<f64> = x.iter().zip(unusable).filter(|(_, bad)| !**bad).map(|(x, _)| *x).collect();
        if good.is_empty() {
            continue;
        }
        let is_knee = matches!(joint, Joint::LeftKnee | Joint::RightKnee);
        let bounds = if is_knee { KNEE_DEG } else { HIP_DEG };
        let mean = good.iter().sum::<f64>() / good.len() as f64;
        let ends = [quantile(good.iter().copied(), 0.01), quantile(good, 0.99)];
        let beyond = |deg: f64, (least, most): (f64, f64)| !(least..=most).contains(&deg);
        if let Some(found_deg) = ends.into_iter().find(|end| beyond(*end, bounds)) {
            return Err(Impossible { joint, what: "reaches", found_deg, allowed_deg: bounds });
        }
        let means = if is_knee { (bounds.0, MOST_MEAN_DEG) } else { HIP_MOST_MEAN_DEG };
        if beyond(mean, means) {
            return Err(Impossible { joint, what: "has a mean of", found_deg: mean, allowed_deg: means });
        }
        if (is_knee && mean > KNEE_MOST_MEAN_DEG) || (!is_knee && beyond(mean, HIP_MEAN_DEG)) {
            findings.push((Some(joint), FindingKind::Displaced { mean_deg: mean }, Done::Reported));
        }
    }
    Ok(findings)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(joint: Joint, values: Vec<f64>, unusable: &[bool]) -> Result<Vec<Untimed>, Impossible> {
        let mut joints: [Option<Vec<f64>>; Joint::COUNT] = Default::default();
        joints[joint as usize] = Some(values);
        check(&joints, unusable)
    }

    /// Angles of 10 and 50 degrees, and others in the first rows.
    fn values(first: &[f64]) -> Vec<f64> {
        first.iter().copied().chain((first.len()..1000).map(|n| if n % 2 == 0 { 10.0 } else { 50.0 })).collect()
    }

    #[test]
    fn a_few_values_and_unusable_ones_do_not_count() {
        for joint in Joint::ALL {
            assert_eq!(one(joint, values(&[190.0; 5]), &[false; 1000]), Ok(vec![]));
            let error = one(joint, values(&[190.0; 50]), &[false; 1000]).unwrap_err();
            assert_eq!((error.joint, error.what, error.found_deg), (joint, "reaches", 190.0));
            let unusable: Vec<bool> = (0..1000).map(|n| n < 50).collect();
            assert_eq!(one(joint, values(&[190.0; 50]), &unusable), Ok(vec![]));
        }
    }

    #[test]
    fn bounds_and_means_of_hip_and_knee_differ() {
        let (hip, knee) = (Joint::LeftHip, Joint::RightKnee);
        let around = |mean: f64| values(&[]).into_iter().map(|x| x - 30.0 + mean).collect::<Vec<_>>();
        let what = |joint, mean| one(joint, around(mean), &[false; 1000]).map_err(|error| error.what);
        assert_eq!((what(hip, -55.0), what(knee, -35.0)), (Err("reaches"), Err("reaches")));
        assert_eq!((what(hip, 115.0), what(knee, 125.0)), (Err("has a mean of"), Err("has a mean of")));
        assert_eq!((what(hip, 135.0), what(knee, 155.0)), (Err("reaches"), Err("reaches")));
        for (joint, mean, count) in [(hip, 85.0, 1), (hip, -45.0, 1), (knee, 95.0, 1), (hip, 75.0, 0), (knee, 85.0, 0)]
        {
            assert_eq!(what(joint, mean).map(|doubts| doubts.len()), Ok(count), "{joint:?} {mean}");
        }
    }
}
