//! Tells gait from movements in which both legs do the same, such as squats and jumps.
//!
//! In walking and running the legs are half a stride apart. The first harmonic dominates at the hips, so the angles of left and right hip
//! run against each other: over a stride their correlation is -0.96 to -0.60 in the 23 recordings of `tests/shared_traces.rs`. The knee has
//! two bumps a stride and leads its hip by a quarter of a stride: the correlation of the knees is at most 0.27, and that of hip and knee at
//! most 0.33 in size in one of the legs.
//!
//! Feet that stay on the ground, or leave it together, tie all joints to the height of the trunk: hips and knees of both legs flex and
//! extend at the same time. All four correlations are then near 1 in size.
//!
//! A recording of which one leg is half a stride off (each leg counted from its own heel strike) has correlated hips too, but in each leg
//! the knee leads the hip as in gait: that is a finding ([`crate::FindingKind::NotOpposed`]), not this.

use crate::series::{correlation, median, range};
use crate::stride::segment::Joints;
use crate::stride::spans::{Span, Together};

/// Correlation of left and right from which the legs move together.
pub const TOGETHER: f64 = 0.5;
/// Correlation of hip and knee of a leg, without its sign, from which they move as one.
pub const COUPLED: f64 = 0.7;
/// Below this range, degrees, a joint counts as still, and nothing is concluded from it.
pub const LEAST_RANGE_DEG: f64 = 5.0;

/// The correlations, if the movement in these spans is no gait. Nothing is concluded unless all four joints move.
pub(crate) fn no_gait(joints: &Joints<'_>, spans: &[Span], rate_hz: f64) -> Option<Together> {
    let of = |a: usize, b: usize| -> Option<f64> {
        let (a, b) = (joints[a]?, joints[b]?);
        let strides: Vec<(&[f64], &[f64])> = spans
            .iter()
            .filter_map(|span| {
                let part = (span.start_s * rate_hz).ceil() as usize..(span.end_s * rate_hz).floor() as usize + 1;
                Some((a.get(part.clone())?, b.get(part)?))
            })
            .filter(|(a, b)| range(a).min(range(b)) >= LEAST_RANGE_DEG)
            .collect();
        (!strides.is_empty()).then(|| median(strides.iter().map(|(a, b)| correlation(a, b))))
    };
    let all = Together { hips: of(0, 1)?, knees: of(2, 3)?, left: of(0, 2)?, right: of(1, 3)? };
    let legs = all.hips.min(all.knees) > TOGETHER;
    (legs && all.left.abs().min(all.right.abs()) > COUPLED).then_some(all)
}
