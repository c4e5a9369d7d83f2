//! Recognises the rows of two or more recordings in one table that no column tells apart: rows of equal times with different angles, and
//! rows that take turns.
//!
//! Where time stamps are coarse, rows of the same time are a step of the joint apart, and the next row with another time is farther away.
//! Where they are of two recordings, the first of them is near the next row of its own recording instead.

use crate::raw::RawJoints;
use crate::series::median;

/// Fewest rows of equal times, or of a table, that are compared.
const FEWEST: usize = 16;
/// Smallest median difference, degrees, of rows that are of two recordings.
const LEAST_DEG: f64 = 2.0;
/// How much farther apart they are than rows of one recording.
const TIMES: f64 = 3.0;
/// Most recordings that take turns.
const MOST: usize = 4;

/// What shows that the rows are of several recordings. `rows` are those with times of their own, `repeated` those with the time of the row
/// before.
pub(crate) fn of(raw: &RawJoints, rows: &[usize], repeated: &[usize]) -> Option<String> {
    let columns: Vec<&[f64]> = raw.joints.iter().flatten().map(|joint| joint.angle_deg.as_slice()).collect();
    let apart = |a: usize, b: usize| {
        let each = columns.iter().map(|column| (column[a] - column[b]).abs()).filter(|apart| apart.is_finite());
        each.reduce(f64::max)
    };
    if repeated.len() >= FEWEST {
        // The first row of the time, the repeated one, and the first row of the next time.
        let places = repeated.iter().filter_map(|&index| {
            let at = rows.partition_point(|&row| row < index);
            Some((*rows.get(at.checked_sub(1)?)?, index, *rows.get(at)?))
        });
        let places: Vec<_> = places.collect();
        let same = median(places.iter().filter_map(|&(first, index, _)| apart(first, index)));
        let next = median(places.iter().filter_map(|&(first, _, next)| apart(first, next)));
        if same > LEAST_DEG.max(TIMES * next) {
            return Some(format!(
                "{} rows have the time of the row before, and other angles, by {same:.1} degrees in the middle",
                repeated.len()
            ));
        }
    }
    if rows.len() < 2 * FEWEST {
        return None;
    }
    let lag = |lag: usize| median(rows.windows(lag + 1).filter_map(|part| apart(part[0], part[lag])));
    let next = lag(1);
    (2..=MOST).find_map(|recordings| {
        let own = lag(recordings);
        (next > LEAST_DEG.max(TIMES * own)).then(|| {
            format!("rows take turns: the angles of a row are {next:.1} degrees from those of the next one, and {own:.1} from those {recordings} rows below")
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raw::RawJoint;

    /// A table of rows of two persons, with these times.
    fn table(time_s: Vec<f64>, angle: impl Fn(usize) -> f64) -> Option<String> {
        let angle_deg = (0..time_s.len()).map(angle).collect();
        let joints = [None, None, Some(RawJoint::degrees("knee", angle_deg)), None];
        let (mut rows, mut repeated) = (vec![], vec![]);
        for (index, time) in time_s.iter().enumerate() {
            if index > 0 && *time == time_s[index - 1] { repeated.push(index) } else { rows.push(index) }
        }
        let raw = RawJoints {
            file: "a".into(),
            format: String::new(),
            time_s,
            received: false,
            joints,
            notes: vec![],
            doubts: vec![],
        };
        of(&raw, &rows, &repeated)
    }

    fn knee(t: f64) -> f64 {
        30.0 + 28.0 * (t * 5.7).sin()
    }

    #[test]
    fn two_persons_are_recognised() {
        let who = |n: usize, t: f64| if n.is_multiple_of(2) { knee(t) } else { 0.7 * knee(t + 0.4) };
        let same: Vec<f64> = (0..800).map(|n| f64::from(n / 2) * 0.01).collect();
        let why = table(same.clone(), |n| who(n, same[n])).unwrap();
        assert!(why.contains("400 rows have the time of the row before"), "{why}");
        let own: Vec<f64> = (0..800).map(|n| f64::from(n) * 0.005).collect();
        let why = table(own.clone(), |n| who(n, own[n])).unwrap();
        assert!(why.contains("rows take turns") && why.contains("2 rows below"), "{why}");
    }

    #[test]
    fn coarse_times_and_noise_are_one_recording() {
        let true_s = |n: usize| n as f64 * 0.005;
        for rows in [2.0, 3.0] {
            let coarse = (0..800).map(|n| (f64::from(n) / rows).floor() * 0.005 * rows).collect();
            assert_eq!(table(coarse, |n| knee(true_s(n))), None);
        }
        // Noise of a degree, as much from row to row as over two rows.
        let noise = |n: usize| ((n * 7919) % 1000) as f64 / 500.0 - 1.0;
        let even: Vec<f64> = (0..800).map(&true_s).collect();
        assert_eq!(table(even, |n| knee(true_s(n)) + 3.0 * noise(n)), None);
        // Ten rows a second, of a fast run.
        let slow: Vec<f64> = (0..80).map(|n| f64::from(n) * 0.1).collect();
        assert_eq!(table(slow.clone(), |n| knee(1.6 * slow[n])), None);
    }
}
