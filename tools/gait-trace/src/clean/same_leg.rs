//! Recognises two columns of one leg: the joint of the left leg has the numbers of the right one, row for row.
//!
//! The legs of a person differ in every row by noise alone. Equal columns are one leg that was exported twice, or one column that two names
//! denote.

use crate::series::{range, root_mean_square};
use joint_units::Joint;

/// Largest difference (root mean square) as a share of the joint's range.
const SHARE: f64 = 1e-3;
/// A joint that moves less, degrees, is not judged.
const LEAST_RANGE_DEG: f64 = 5.0;

/// The left joint whose numbers are those of the right one, but for an offset.
pub(crate) fn of(joints: &[Option<Vec<f64>>; Joint::COUNT]) -> Option<Joint> {
    [Joint::LeftHip, Joint::LeftKnee].into_iter().find(|&left| {
        let (Some(a), Some(b)) = (&joints[left as usize], &joints[left as usize + 1]) else { return false };
        let size = range(a).min(range(b));
        let mean = a.iter().zip(b).map(|(a, b)| a - b).sum::<f64>() / a.len() as f64;
        let apart: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b - mean).collect();
        size >= LEAST_RANGE_DEG && root_mean_square(&apart) <= SHARE * size
    })
}
