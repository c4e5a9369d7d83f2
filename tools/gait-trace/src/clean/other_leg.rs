//! The leg that a file does not have, or that counts from its own contact: the other one half a stride later.

use crate::clean::convention::LEAST_RANGE_DEG;
use crate::series::{between, correlation, range};
use crate::stride::segment;
use joint_units::Joint;

/// Correlation of left and right over a cycle from which they are in phase. Hips that are half a stride apart have -0.96 to -0.60, those of which each
/// counts from its own contact 0.9 and more.
const IN_PHASE: f64 = 0.5;

/// A closed cycle, half of it later. The last sample is the first one again.
pub(crate) fn half_a_cycle_later(x: &[f64]) -> Vec<f64> {
    let intervals = x.len().saturating_sub(1).max(1) as f64;
    (0..x.len()).map(|n| between(x, (n as f64 + 0.5 * intervals) % intervals)).collect()
}

/// The joints of a cycle that show that each leg counts from its own contact: the hips, or the knees where a hip is missing.
pub(crate) fn in_phase(joints: &[Option<Vec<f64>>; Joint::COUNT]) -> Option<&'static str> {
    for (left, part) in [(0, "hips"), (2, "knees")] {
        let (Some(a), Some(b)) = (&joints[left], &joints[left + 1]) else { continue };
        if range(a).min(range(b)) >= LEAST_RANGE_DEG {
            return (correlation(a, b) > IN_PHASE).then_some(part);
        }
    }
    None
}

/// Half a stride in samples, by the joints that are there; `None` if they do not repeat.
pub(crate) fn half_a_stride(
    joints: &[Option<Vec<f64>>; Joint::COUNT],
    unusable: &[bool],
    rate_hz: f64,
    is_cycle: bool,
) -> Option<usize> {
    if is_cycle {
        return Some((unusable.len() - 1) / 2);
    }
    let legs = joints.each_ref().map(|joint| joint.as_deref());
    let period_s = segment::periodic(&legs, unusable, rate_hz)?.period_s;
    Some((0.5 * period_s * rate_hz).round() as usize)
}

/// Makes the joints of the leg that is not there: each is that of the other leg `half` a stride later; near the end, half a stride before, with the
/// difference of the two spread evenly, so that nothing jumps. A sample is unusable where the one that it was made from is.
///
/// # Errors
/// Both legs are there, or there is no stride.
pub(crate) fn mirror(
    joints: &mut [Option<Vec<f64>>; Joint::COUNT],
    unusable: &mut [bool],
    half: Option<usize>,
) -> Result<usize, &'static str> {
    let has = |leg: usize| joints[leg].is_some() || joints[leg + 2].is_some();
    if has(0) && has(1) {
        return Err("the recording has joints of both legs");
    }
    let half = half
        .filter(|half| *half > 0 && 2 * half < unusable.len())
        .ok_or("no stride repeats in the leg that is there")?;
    let samples = unusable.len();
    let seam = samples - half;
    let source = |n: usize| if n < seam { n + half } else { n - half };
    for joint in 0..Joint::COUNT {
        let Some(x) = joints[joint ^ 1].clone().filter(|_| joints[joint].is_none()) else { continue };
        let open = x[samples - 1] - x[samples - 1 - 2 * half];
        let made = |n: usize| match n.checked_sub(seam) {
            None => x[source(n)],
            Some(behind) => x[source(n)] + open * (1.0 - (behind + 1) as f64 / half as f64),
        };
        joints[joint] = Some((0..samples).map(made).collect());
    }
    let of_source: Vec<bool> = (0..samples).map(|n| unusable[source(n)]).collect();
    unusable.iter_mut().zip(of_source).for_each(|(bad, other)| *bad |= other);
    Ok(half)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn a_mirrored_leg_is_half_a_stride_apart_and_does_not_jump() {
        let hip = |n: usize| {
            20.0 * (TAU * n as f64 / 110.0).cos() + 5.0 * (2.0 * TAU * n as f64 / 110.0 + 1.0).cos() + 0.01 * n as f64
        };
        let mut joints = [None, Some((0..400).map(hip).collect()), None, None];
        let mut unusable = vec![false; 400];
        unusable[70] = true;
        assert_eq!(mirror(&mut joints, &mut unusable, Some(55)), Ok(55));
        let left = joints[0].clone().unwrap();
        for (n, angle) in left.iter().enumerate() {
            assert!((angle - hip(n + 55)).abs() < 1.2, "{n}: {angle} {}", hip(n + 55));
        }
        assert!(left.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 2.0));
        assert!(joints[2].is_none() && joints[3].is_none());
        assert_eq!((0..400).filter(|n| unusable[*n]).collect::<Vec<_>>(), [15, 70]);
        assert!(mirror(&mut joints, &mut unusable, Some(55)).is_err());
    }

    #[test]
    fn legs_of_their_own_cycles_are_in_phase_and_come_back() {
        let hip = |n: f64| 10.0 + 20.0 * (TAU * n / 100.0).cos() + 4.0 * (2.0 * TAU * n / 100.0 + 1.0).cos();
        let of = |points: usize, lag: f64| -> Vec<f64> {
            (0..points).map(|n| hip(n as f64 * 100.0 / (points - 1) as f64 + lag)).collect()
        };
        for points in [51, 100, 101, 201] {
            let (left, right) = (of(points, 0.0), of(points, 3.0));
            assert_eq!(in_phase(&[Some(left.clone()), Some(right.clone()), None, None]), Some("hips"));
            let moved = half_a_cycle_later(&right);
            assert!(moved.iter().zip(of(points, 53.0)).all(|(a, b)| (a - b).abs() < 0.1), "{points}");
            assert_eq!(in_phase(&[Some(left), Some(moved), None, None]), None);
        }
    }
}
