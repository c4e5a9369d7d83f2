//! Recognises rows that repeat the values of a slower sensor: a logger wrote every row, and the sensor gave a value every few rows.
//!
//! The steps of such a recording are no motion: a repeated row is left out. Rows of rounded angles are equal too, now and then, and rows of
//! a person who stands; the blocks of a slow sensor are of one length all the time.

use crate::finding::{Done, Finding, FindingKind};
use crate::raw::RawJoints;
use crate::series::upper_median;
use joint_units::Joint;

/// Fewest blocks of equal rows.
const FEWEST: usize = 16;
/// Smallest share of the blocks that have the usual length, or differ from it by one row.
const SHARE: f64 = 0.9;

/// A column of a slower sensor, in a recording whose other columns have a value in every row.
pub(crate) struct Slow {
    /// The rows with new values.
    pub(crate) rows: Vec<usize>,
    /// The usual number of equal rows.
    pub(crate) block: usize,
}

impl Slow {
    pub(crate) fn finding(&self, joint: Joint, to_s: f64) -> Finding {
        let what = FindingKind::Held { block: self.block, rate_hz: (self.rows.len() - 1) as f64 / to_s };
        Finding { from_s: 0.0, to_s, joint: Some(joint), what, done: Done::Bridged }
    }
}

/// The rows of a column that have new values, if it repeats its values in blocks, or is empty between them.
pub(crate) fn column(x: &[f64]) -> Option<Slow> {
    let begins = |n: &usize| x[*n].is_finite() && (*n == 0 || x[*n] != x[*n - 1]);
    let rows: Vec<usize> = (0..x.len()).filter(begins).collect();
    let block = usual_block(&rows)?;
    Some(Slow { rows, block })
}

/// The usual length of blocks that begin at these rows, if nearly all have it.
fn usual_block(first: &[usize]) -> Option<usize> {
    // The first and the last block may be cut off.
    let lengths: Vec<usize> = first.windows(2).skip(1).map(|pair| pair[1] - pair[0]).collect();
    let usual = upper_median(lengths.iter().map(|length| *length as f64)) as usize;
    let regular = lengths.iter().filter(|length| length.abs_diff(usual) <= usize::from(usual > 2)).count();
    (usual >= 2 && lengths.len() >= FEWEST && regular as f64 >= SHARE * lengths.len() as f64).then_some(usual)
}

/// The recording without the repeated rows, and the usual number of equal rows; `None` if no rows are repeated in blocks.
pub(crate) fn released(raw: &RawJoints) -> Option<(RawJoints, usize)> {
    let columns: Vec<&[f64]> = raw.joints.iter().flatten().map(|joint| joint.angle_deg.as_slice()).collect();
    let rows = raw.time_s.len();
    if columns.is_empty() || columns.iter().any(|column| column.len() != rows) {
        return None;
    }
    let same = |a: f64, b: f64| a == b || (a.is_nan() && b.is_nan());
    let begins = |n: &usize| *n == 0 || columns.iter().any(|column| !same(column[*n], column[*n - 1]));
    let first: Vec<usize> = (0..rows).filter(begins).collect();
    let usual = usual_block(&first)?;
    let mut kept = raw.clone();
    kept.time_s = first.iter().map(|&n| raw.time_s[n]).collect();
    for joint in kept.joints.iter_mut().flatten() {
        joint.angle_deg = first.iter().map(|&n| joint.angle_deg[n]).collect();
    }
    Some((kept, usual))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raw::RawJoint;

    fn table(rows: usize, angle: impl Fn(usize) -> f64) -> RawJoints {
        let time_s = (0..rows).map(|n| n as f64 * 0.005).collect();
        let knee = RawJoint::degrees("knee", (0..rows).map(angle).collect());
        let joints = [None, None, Some(knee), None];
        RawJoints {
            file: "a".into(),
            format: String::new(),
            time_s,
            received: false,
            joints,
            notes: vec![],
            doubts: vec![],
        }
    }

    fn knee(t: f64) -> f64 {
        30.0 + 28.0 * (t * 5.7).sin()
    }

    #[test]
    fn blocks_of_a_slow_sensor_are_released() {
        for block in [2, 3, 4, 10] {
            let (kept, usual) = released(&table(800, |n| knee((n / block * block) as f64 * 0.005))).unwrap();
            assert_eq!((kept.time_s.len(), usual), (800_usize.div_ceil(block), block));
            let angles = &kept.joints[2].as_ref().unwrap().angle_deg;
            assert!(kept.time_s.iter().zip(angles).all(|(&t, &angle)| (angle - knee(t)).abs() < 1e-12));
        }
        // 30 values a second in rows of 200 Hz: blocks of 6 and 7 rows.
        let (kept, usual) = released(&table(1600, |n| knee((n as f64 * 0.15).floor() / 30.0))).unwrap();
        assert!(usual == 7 && kept.time_s.len() == 240, "{usual} {}", kept.time_s.len());
    }

    #[test]
    fn rounded_angles_and_a_stand_are_no_blocks() {
        assert_eq!(released(&table(800, |n| knee(n as f64 * 0.005))), None);
        assert_eq!(released(&table(800, |n| knee(n as f64 * 0.005).round())), None);
        assert_eq!(released(&table(800, |n| knee((n.max(400) - 400) as f64 * 0.005))), None);
        assert_eq!(released(&table(800, |_| 12.0)), None);
        // Too few blocks to tell.
        assert_eq!(released(&table(60, |n| knee((n / 4 * 4) as f64 * 0.005))), None);
        for angle in [|n: usize| knee(n as f64 * 0.005), |n| knee(n as f64 * 0.005).round(), |_| 12.0] {
            assert!(column(&(0..800).map(angle).collect::<Vec<_>>()).is_none());
        }
        let slow = column(&(0..800).map(|n| knee((n / 4 * 4) as f64 * 0.005)).collect::<Vec<_>>()).unwrap();
        assert_eq!((slow.block, slow.rows.len(), slow.rows[1]), (4, 200, 4));
        let sparse = |n: usize| if n.is_multiple_of(4) { knee(n as f64 * 0.005) } else { f64::NAN };
        let sparse = column(&(0..800).map(sparse).collect::<Vec<_>>()).unwrap();
        assert_eq!((sparse.block, sparse.rows.len(), sparse.rows[1]), (4, 200, 4));
        assert!(column(&[f64::NAN; 800]).is_none());
    }
}
