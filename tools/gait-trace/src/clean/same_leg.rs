//! Recognises two columns of one leg: the joint of the left leg has the numbers of the right one, row for row.
//!
//! The legs of a person differ in every row by noise alone. Equal columns are one leg that was exported twice, or one column that two names
//! denote. Rows in which one of them has no value are not compared.

use crate::series::{range, root_mean_square};
use joint_units::Joint;

/// Largest difference (root mean square) as a share of the joint's range.
const SHARE: f64 = 1e-3;
/// A joint that moves less, degrees, is not judged.
const LEAST_RANGE_DEG: f64 = 5.0;

/// Smallest share of the rows that can be compared.
const COMPARED: f64 = 0.5;

/// The left joint whose numbers are those of the right one, but for an offset. `missing` are the samples that the file does not have.
pub(crate) fn of(
    joints: &[Option<Vec<f64>>; Joint::COUNT],
    missing: &[Vec<(usize, usize)>; Joint::COUNT],
) -> Option<Joint> {
    [Joint::LeftHip, Joint::LeftKnee].into_iter().find(|&left| {
        let (left, right) = (left as usize, left as usize + 1);
        let (Some(a), Some(b)) = (&joints[left], &joints[right]) else { return false };
        let mut is_there = vec![true; a.len().min(b.len())];
        for &(from, to) in missing[left].iter().chain(&missing[right]) {
            is_there.iter_mut().take(to).skip(from).for_each(|there| *there = false);
        }
        let there =
            |x: &[f64]| -> Vec<f64> { x.iter().zip(&is_there).filter(|(_, is)| **is).map(|(x, _)| *x).collect() };
        let (a, b) = (there(a), there(b));
        let size = range(&a).min(range(&b));
        let mean = a.iter().zip(&b).map(|(a, b)| a - b).sum::<f64>() / a.len() as f64;
        let apart: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b - mean).collect();
        let is_enough = a.len() as f64 >= COMPARED * is_there.len() as f64;
        is_enough && size >= LEAST_RANGE_DEG && root_mean_square(&apart) <= SHARE * size
    })
}
