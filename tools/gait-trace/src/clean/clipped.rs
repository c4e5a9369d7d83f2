//! Joints that stay at an end of their range, as behind a converter whose input is too large.
//!
//! A joint turns around at the ends of its range, a few degrees further or less in each stride. Samples that are equal to the last digit at
//! the largest or the smallest angle, several in a row and in stride after stride, are no turning of a leg.

use crate::finding::{Done, Finding, FindingKind};
use crate::series::runs;
use joint_units::Joint;

/// Fewest equal samples in a row.
const ROW: usize = 4;
/// Fewest such rows.
const ROWS: usize = 3;
/// Smallest share of all samples.
const SHARE: f64 = 0.02;
/// A joint that moves less, degrees, is not judged.
const LEAST_RANGE_DEG: f64 = 5.0;

/// The ends of its range at which a joint is clipped, and the samples `from..to` that it stays there; `x` has equal steps, and samples that
/// the file does not have are `gaps`.
pub(crate) fn clipped(
    joint: Joint,
    x: &[f64],
    gaps: &[(usize, usize)],
    rate_hz: f64,
) -> Vec<(Finding, Vec<(usize, usize)>)> {
    let (least, most) = x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
    if most - least < LEAST_RANGE_DEG {
        return vec![];
    }
    let measured = |n: usize| !gaps.iter().any(|(from, to)| (*from..*to).contains(&n));
    let at = |end: f64| {
        let held: Vec<_> =
            runs(x.len(), |n| x[n] == end && measured(n)).into_iter().filter(|(from, to)| to - from >= ROW).collect();
        let share = held.iter().map(|(from, to)| to - from).sum::<usize>() as f64 / x.len() as f64;
        let (first, last) = (held.first()?.0, held.last()?.1);
        let finding = Finding {
            from_s: first as f64 / rate_hz,
            to_s: last as f64 / rate_hz,
            joint: Some(joint),
            what: FindingKind::Clipped { deg: end, share },
            done: Done::Reported,
        };
        (held.len() >= ROWS && share >= SHARE).then_some((finding, held))
    };
    [least, most].into_iter().filter_map(at).collect()
}
