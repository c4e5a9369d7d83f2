//! Recognises joints whose angle was folded at 0 or at 180 degrees: stored without its sign (|angle|), or as the smaller of two angles.
//!
//! Where such an angle reaches the bound it turns back in a corner: its rate changes its sign from one sample to the next. With the sign put
//! back on one side of the corner the curve is smooth. So the second differences over [`REACH_S`] around each minimum near the bound
//! are compared, of the angle as it is and of the angle with the sign put back. At a corner they differ by a factor of 4 (2 degrees of
//! a knee) to 50 (a hip); at a smooth minimum, with noise or rounding, mostly by less than 2.

use joint_units::Joint;

/// Step of the second differences, seconds.
const REACH_S: f64 = 0.02;
/// Least ratio of the second differences at a corner.
const RATIO: f64 = 3.5;
/// Least second difference at a corner, degrees (root mean square): more than rounding to whole degrees makes.
const LEAST_DEG: f64 = 0.8;
/// Fewest corners of a folded joint, and their smallest share of the minima near the bound.
const FEWEST: usize = 2;
const SHARE: f64 = 0.6;
/// A joint that moves less, degrees, is not judged.
const LEAST_RANGE_DEG: f64 = 5.0;
/// Folded parts up to this size, degrees, are a warning: a knee that overextends a little.
pub(crate) const SMALL_DEG: f64 = 5.0;

/// A folded joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Folded {
    pub(crate) joint: Joint,
    /// The angle at which it is folded, degrees.
    pub(crate) at_deg: f64,
    /// Number of corners.
    pub(crate) corners: usize,
    /// First and last corner, samples.
    pub(crate) span: (usize, usize),
    /// Size of the folded parts, degrees.
    pub(crate) deg: f64,
}

/// The fold of a joint, if it has one; `x` in degrees at equal steps, not a number in gaps.
pub(crate) fn folded(joint: Joint, x: &[f64], rate_hz: f64) -> Option<Folded> {
    // The bound, and the direction in which the angle stays on one side of it.
    [(0.0, 1.0), (0.0, -1.0), (180.0, -1.0), (-180.0, 1.0)].into_iter().find_map(|(at_deg, side)| {
        let z: Vec<f64> = x.iter().map(|x| side * (x - at_deg)).collect();
        let known = || z.iter().copied().filter(|z| z.is_finite());
        let (least, most) = known().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), z| (a.min(z), b.max(z)));
        if least < 0.0 || most - least < LEAST_RANGE_DEG {
            return None;
        }
        let (corners, minima) = corners(&z, ((REACH_S * rate_hz).round() as usize).max(1));
        let span = (*corners.first()?, *corners.last()?);
        let is_folded = corners.len() >= FEWEST && corners.len() as f64 >= SHARE * minima as f64;
        is_folded.then(|| Folded { joint, at_deg, corners: corners.len(), span, deg: size(&z, &corners) })
    })
}

/// The samples at which an angle that is never below 0 turns back in a corner at 0, and the number of all minima near it.
fn corners(z: &[f64], reach: usize) -> (Vec<usize>, usize) {
    let (mut found, mut minima): (Vec<usize>, Vec<usize>) = Default::default();
    for n in 2 * reach..z.len().saturating_sub(2 * reach) {
        let around = &z[n - 2 * reach..=n + 2 * reach];
        let near = &z[n - reach..=n + reach];
        let step = (z[n + 1] - z[n]).abs().max((z[n] - z[n - 1]).abs());
        // A corner at 0 lies within a step of one sample.
        let is_candidate = z[n] <= step && near.iter().all(|other| z[n] <= *other);
        if !is_candidate || minima.last().is_some_and(|last| n - last <= reach) || around.iter().any(|z| !z.is_finite())
        {
            continue;
        }
        minima.push(n);
        let as_it_is = bend(around, reach, 0);
        let smooth = bend(around, reach, 2 * reach).min(bend(around, reach, 2 * reach + 1));
        if as_it_is >= LEAST_DEG && as_it_is >= RATIO * smooth {
            found.push(n);
        }
    }
    (found, minima.len())
}

/// Root mean square of the second differences over `reach` samples, with the sign of the first `turned` samples changed.
fn bend(z: &[f64], reach: usize, turned: usize) -> f64 {
    let at = |n: usize| if n < turned { -z[n] } else { z[n] };
    let places = reach..z.len() - reach;
    let count = places.len() as f64;
    (places.map(|n| (at(n + reach) - 2.0 * at(n) + at(n - reach)).powi(2)).sum::<f64>() / count).sqrt()
}

/// The size of the folded parts: between the corners the angle is on either side in turn, and the smaller side counts as folded.
fn size(z: &[f64], corners: &[usize]) -> f64 {
    let ends: Vec<usize> = std::iter::once(0).chain(corners.iter().copied()).chain([z.len()]).collect();
    let most = |part: &[usize]| z[part[0]..part[1]].iter().copied().filter(|z| z.is_finite()).fold(0.0, f64::max);
    let heights: Vec<f64> = ends.windows(2).map(most).collect();
    let of = |first: usize| crate::series::median(heights.iter().copied().skip(first).step_by(2));
    of(0).min(of(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn hip(rate_hz: f64, noise: f64, mean: f64) -> Vec<f64> {
        let p = |n: usize| n as f64 / rate_hz / 1.1 * std::f64::consts::TAU;
        let noise = |n: usize| noise * (((n * 7919) % 1000) as f64 / 500.0 - 1.0);
        (0..(8.0 * rate_hz) as usize)
            .map(|n| mean + 21.0 * p(n).cos() + 4.6 * (2.0 * p(n) + 2.6).cos() + noise(n))
            .collect()
    }

    proptest! {
        /// A hip without its sign is recognised at every rate; as it is, shifted to touch 0, with noise, or rounded it is not.
        #[test]
        fn a_hip_without_its_sign_is_recognised(rate in 40.0_f64..500.0, noise in 0.0_f64..0.1, mean in -4.0_f64..14.0) {
            let signed = hip(rate, noise, mean);
            prop_assert_eq!(folded(Joint::LeftHip, &signed, rate), None);
            let found = folded(Joint::LeftHip, &signed.iter().map(|x| x.abs()).collect::<Vec<_>>(), rate);
            prop_assert!(found.is_some_and(|found| found.at_deg == 0.0 && found.corners >= 8 && found.deg > SMALL_DEG), "{found:?}");
            let other = folded(Joint::LeftHip, &signed.iter().map(|x| 180.0 - x.abs()).collect::<Vec<_>>(), rate);
            prop_assert!(other.is_some_and(|found| found.at_deg == 180.0), "{other:?}");
            for (at_deg, change) in [(0.0, 0.0), (-180.0, -180.0)] {
                let side = if at_deg < 0.0 { 1.0 } else { -1.0 };
                let other: Vec<f64> = signed.iter().map(|x| change + side * x.abs()).collect();
                let found = folded(Joint::LeftHip, &other, rate);
                prop_assert!(found.is_some_and(|found| found.at_deg == at_deg), "{found:?}");
            }
            let least = signed.iter().copied().fold(f64::INFINITY, f64::min);
            let touching: Vec<f64> = signed.iter().map(|x| x - least).collect();
            prop_assert_eq!(folded(Joint::LeftHip, &touching, rate), None);
            prop_assert_eq!(folded(Joint::LeftHip, &touching.iter().map(|x| x.round()).collect::<Vec<_>>(), rate), None);
        }
    }

    /// A curve that touches 0 in each stride, in some of them in a corner; it moves by `range` degrees.
    fn touching(range: f64, corners: impl Fn(usize) -> bool) -> Vec<f64> {
        let touch = |n: usize| {
            let wave = (n as f64 / 220.0 * std::f64::consts::TAU / 2.0).sin();
            if corners((n + 110) / 220) { wave.abs() } else { wave * wave }
        };
        (0..2200).map(|n| range * touch(n)).collect()
    }

    #[test]
    fn single_corners_and_still_joints_are_no_folds() {
        let corners = |range, corners: fn(usize) -> bool| folded(Joint::LeftHip, &touching(range, corners), 200.0);
        assert!(corners(40.0, |_| true).is_some());
        assert_eq!(corners(40.0, |stride| stride == 4), None);
        assert_eq!(corners(40.0, |stride| stride % 3 == 0), None);
        let still: Vec<f64> = (0..2200).map(|n| 4.8 * (n as f64 * std::f64::consts::PI / 32.0).sin().abs()).collect();
        assert_eq!(folded(Joint::LeftHip, &still, 200.0), None);
        // One corner at the end of a recording.
        assert_eq!(folded(Joint::LeftHip, &touching(40.0, |_| true)[110..330], 200.0), None);
    }

    /// A corner beside a gap is not judged, and does not count against the others.
    #[test]
    fn gaps_at_corners_are_left_out() {
        let mut signed = touching(40.0, |_| true);
        for stride in (1..10).step_by(2) {
            signed[220 * stride + 6] = f64::NAN;
        }
        assert_eq!(folded(Joint::LeftHip, &signed, 200.0).map(|found| found.corners), Some(4));
    }

    /// A knee that overextends by 2 degrees, which were reflected.
    #[test]
    fn a_reflected_overextension_is_small() {
        let p = |n: usize| n as f64 / 200.0 / 1.1 * std::f64::consts::TAU;
        let knee = |n: usize| (23.0 - 25.0 * p(n).cos()).abs();
        let found = folded(Joint::LeftKnee, &(0..1600).map(knee).collect::<Vec<_>>(), 200.0).unwrap();
        assert!(found.deg < SMALL_DEG && found.corners >= 10, "{found:?}");
    }
}
