//! A slow drift of a joint: the mean of each stride moves along a line, as with an inertial sensor or a strap that slips.
//!
//! It is reported from [`LEAST_DEG`] over the recording on, in at least [`FEWEST`] strides whose means the line explains by [`EXPLAINED`].

use crate::finding::{Done, Finding, FindingKind};
use crate::stride::cycle::Cycle;
use crate::stride::spans::Span;
use joint_units::Joint;

/// Fewest strides from which a drift is concluded.
const FEWEST: usize = 5;
/// Smallest change of the mean over the recording, degrees. People who walk faster from stride to stride stay below 5.
const LEAST_DEG: f64 = 8.0;
/// Smallest share of the variance of the means that the line explains.
const EXPLAINED: f64 = 0.7;

/// The joints that drift.
pub(crate) fn drift(cycles: &[Cycle], spans: &[Span]) -> Vec<Finding> {
    let (Some(first), Some(last)) = (spans.first(), spans.last()) else { return vec![] };
    if cycles.len() < FEWEST {
        return vec![];
    }
    let middles: Vec<f64> = spans.iter().map(|span| 0.5 * (span.start_s + span.end_s)).collect();
    let of = |joint: Joint| {
        let means: Vec<f64> = cycles.iter().map(|cycle| mean(&cycle.0[joint as usize])).collect();
        let (slope, explained) = line(&middles, &means);
        let deg = slope * (last.end_s - first.start_s);
        (deg.abs() >= LEAST_DEG && explained >= EXPLAINED).then_some(Finding {
            from_s: first.start_s,
            to_s: last.end_s,
            joint: Some(joint),
            what: FindingKind::Drift { deg },
            done: Done::Reported,
        })
    };
    Joint::ALL.into_iter().filter_map(of).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The slope of the least-squares line, and the share of the variance that it explains.
fn line(x: &[f64], y: &[f64]) -> (f64, f64) {
    let (x0, y0) = (mean(x), mean(y));
    let (xx, yy, xy) = x.iter().zip(y).fold((0.0, 0.0, 0.0), |(xx, yy, xy), (x, y)| {
        let (x, y) = (x - x0, y - y0);
        (xx + x * x, yy + y * y, xy + x * y)
    });
    (xy / xx, xy * xy / (xx * yy))
}
