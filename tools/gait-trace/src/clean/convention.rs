//! Corrects the sign of each joint and exchanged hip and knee columns, recognised by the shape of the gait. Every change is reported.
//!
//! In the up to five strides with most movement, each joint is described by its mean and two harmonics of the stride,
//! `x = mean + Re c1 e^(i p) + Re c2 e^(2 i p)`. Four numbers have similar values in walking, running and sprinting (measured on 22
//! recordings; in brackets a patient with crouch gait):
//!
//! | number | hip | knee |
//! |---|---|---|
//! | double bump, abs c2 / abs c1 | 0.16 to 0.49 (0.10, 0.18) | 0.51 to 1.32 (0.45, 0.58) |
//! | bump phase, arg(c2 / c1^2), cycles | 0.24 to 0.53 (0.40, 0.46) | -0.09 to 0.15 (-0.02, 0.04) |
//! | knee's lead over the hip of its leg, arg(c1 knee / c1 hip), cycles | 0.19 to 0.29 (0.38, 0.70) | |
//! | left against right, arg(c1 left / c1 right), cycles | 0.47 to 0.52 (0.51) | 0.45 to 0.52 (0.19) |
//!
//! A change of sign shifts the bump phase and the lead by half a cycle. An exchange of hip and knee shows in bump and range, which do
//! not depend on the sign. Where the sign of a hip is known ([`hip_sign`]) its shape changes nothing, and a finding reports what it
//! contradicts; where two indicators of another hip contradict each other, or there are none, it is the same. The sign of the knees is one
//! decision for both ([`knee_sign`]). Angles alone do not show whether left and right are exchanged.

use super::hip_sign::{self, HipSignReason, Shown, TakenHipSign};
use super::knee_sign::{self, AmbiguousKnees, KneeSignReason};
use super::positive_direction::PositiveDirection;
pub use super::shape::LEAST_RANGE_DEG;
use super::shape::{KNEE_BUMP, Shape, apart};
use crate::clean::rules::Rules;
use crate::finding::{Done, FindingKind};
use crate::raw::{SignBasis, SignSource};
use crate::stride::segment::{self, Periodic};
use joint_units::Joint;

/// Range of the knee's lead over the hip, cycles, in which the hip's flexion is positive; half a cycle later it is negative.
pub const LEAD: (f64, f64) = (0.10, 0.40);
/// Largest deviation of the two legs' phase difference from half a cycle, cycles.
pub const OPPOSED: f64 = 0.2;

const STRIDES: u32 = 5;

/// A finding about a joint, or about all (`None`), without its times.
pub(crate) type Untimed = (Option<Joint>, FindingKind, Done);

/// What was done about the convention of a recording.
pub(crate) struct Convention {
    /// What was done and what is doubtful, about the joints after an exchange.
    pub(crate) findings: Vec<Untimed>,
    /// What the sign of each joint rests on.
    pub(crate) signs: [Option<SignBasis>; Joint::COUNT],
    /// Whether the columns of hip and knee of the left and the right leg were exchanged.
    pub(crate) exchanged: [bool; 2],
}

/// Makes flexion positive and exchanges swapped columns. `sources` is what is known about the sign of each joint; the rules have the signs
/// that the caller knows.
///
/// # Errors
/// The sign of the knees does not follow from their angles, and the caller does not know it.
pub(crate) fn apply(
    joints: &mut [Option<Vec<f64>>; Joint::COUNT],
    bad: &[bool],
    rate_hz: f64,
    one_cycle: bool,
    mut sources: [SignSource; Joint::COUNT],
    rules: &Rules,
) -> Result<Convention, AmbiguousKnees> {
    let legs = joints.each_ref().map(|joint| joint.as_deref());
    let samples = bad.len();
    let periodic = if one_cycle {
        // The last point of a normalised cycle repeats the first.
        Some(Periodic::all(samples, (samples - 1) as f64 / rate_hz))
    } else {
        segment::periodic(&legs, bad, rate_hz)
    };
    let stretch = periodic.filter(|found| found.period_s * rate_hz >= 4.0).and_then(|found| {
        let period = found.period_s * rate_hz;
        let lengths = (1..=STRIDES).rev().map(|strides| (f64::from(strides) * period).round() as usize);
        let typical = found.typical(&legs, bad, rate_hz, lengths)?;
        let strides = (typical.len() as f64 / period).round();
        Some((typical, Some(strides)))
    });
    let (typical, strides) = stretch.unwrap_or((0..samples, None));
    let mut shapes = legs.map(|joint| joint.map(|x| Shape::of(&x[typical.clone()], strides)));
    let mut findings: Vec<Untimed> = Vec::new();
    let mut exchanged = [false; 2];
    let mut signs = shapes.each_ref().map(|shape| shape.as_ref().map(|_| SignBasis::Assumed));

    for (side, is_exchanged) in exchanged.iter_mut().enumerate() {
        let (hip, knee) = (side, side + 2);
        if let (Some(h), Some(k)) = (&shapes[hip], &shapes[knee])
            && let (Some(hip_bump), Some(knee_bump)) = (h.bump(), k.bump())
            && hip_bump > KNEE_BUMP.max(1.3 * knee_bump)
        {
            let leg = Some(Joint::ALL[hip]);
            // What is computed from hip, knee and ankle cannot be exchanged.
            if h.range > 1.1 * k.range && sources[hip] != SignSource::Computed {
                joints.swap(hip, knee);
                shapes.swap(hip, knee);
                signs.swap(hip, knee);
                // What the file says of a hip does not hold of the column of a knee.
                (sources[hip], sources[knee]) = (SignSource::Unknown, SignSource::Unknown);
                *is_exchanged = true;
                findings.push((leg, FindingKind::HipIsKnee, Done::Exchanged));
            } else {
                findings.push((leg, FindingKind::HipIsKnee, Done::Reported));
            }
        }
    }

    let mut turn = |shapes: &mut [Option<Shape>; 4], joint: usize| {
        if let Some(shape) = &mut shapes[joint] {
            shape.negate();
        }
        for x in joints[joint].iter_mut().flatten() {
            *x = -*x;
        }
    };
    for (joint, shape) in Joint::ALL.into_iter().zip(&shapes).skip(2) {
        if let Some(Shape { range: range_deg, .. }) = shape.as_ref().filter(|shape| shape.range < LEAST_RANGE_DEG) {
            findings.push((Some(joint), FindingKind::Still { range_deg: *range_deg }, Done::Reported));
        }
    }
    let [_, _, left, right] = &shapes;
    let decided = knee_sign::decide([left.as_ref(), right.as_ref()], rules.knee_sign, [sources[2], sources[3]])?;
    let by_range = |sign| {
        let is = |decision: &knee_sign::Decision| decision.sign == sign && decision.taken.why == KneeSignReason::Range;
        decided.iter().flatten().any(is)
    };
    let knees_extend = by_range(PositiveDirection::Extension) && !by_range(PositiveDirection::Flexion);
    for (decision, knee) in decided.into_iter().zip(2..) {
        let Some(decision) = decision else {
            // A knee that hardly moves, beside another one that does neither or is missing.
            if shapes[knee].is_some() {
                findings.push((Some(Joint::ALL[knee]), FindingKind::SignNotKnown, Done::Reported));
            }
            continue;
        };
        signs[knee] = Some(decision.basis());
        let extension = decision.sign == PositiveDirection::Extension;
        if extension {
            turn(&mut shapes, knee);
        }
        if extension || decision.is_said {
            let done = if extension { Done::Flipped } else { Done::Reported };
            findings.push((Some(Joint::ALL[knee]), FindingKind::KneeSign(decision.taken), done));
        }
    }
    let mut shown = [None; 2];
    for hip in 0..2 {
        let Some(shape) = &shapes[hip] else { continue };
        let (joint, mean_deg, range_deg) = (Some(Joint::ALL[hip]), shape.mean, shape.range);
        let known = hip_sign::known(rules.hip_sign, sources[hip], knees_extend);
        if let Some((PositiveDirection::Extension, _)) = known {
            turn(&mut shapes, hip);
        }
        if range_deg < LEAST_RANGE_DEG {
            findings.push((joint, FindingKind::Still { range_deg }, Done::Reported));
        }
        let shows = if range_deg < LEAST_RANGE_DEG { Shown::Nothing } else { shown_by(&shapes, hip) };
        let known = match (known, shows) {
            (None, Shown::Extension) => {
                turn(&mut shapes, hip);
                Some((PositiveDirection::Extension, HipSignReason::Shape))
            }
            _ => known,
        };
        signs[hip] = Some(match (known, shows) {
            (Some((_, why)), _) => why.basis(),
            (None, Shown::Flexion) => SignBasis::Shape,
            (None, _) => SignBasis::Assumed,
        });
        shown[hip] = Some((known, shows, mean_deg));
    }
    let is_crossed = |hip: usize| matches!(shown[hip], Some((_, Shown::Crossed, _)));
    let are_crossed = is_crossed(0) && is_crossed(1);
    for (joint, shown) in Joint::ALL.into_iter().zip(shown) {
        let Some((known, shows, mean_deg)) = shown else { continue };
        let finding = match known {
            Some((sign, why)) => {
                // Crossed knees are one finding, below.
                let doubt = shows.doubt().filter(|_| !are_crossed && why != HipSignReason::Shape);
                let is_said = doubt.is_some() || why.is_said();
                let done = if sign == PositiveDirection::Extension { Done::Flipped } else { Done::Reported };
                is_said.then_some((FindingKind::HipSign(TakenHipSign { sign, why, doubt, mean_deg }), done))
            }
            None => match shows {
                Shown::Flexion => None,
                Shown::Nothing => Some((FindingKind::SignNotKnown, Done::Reported)),
                _ if are_crossed => None,
                Shown::Extension | Shown::Crossed | Shown::Unclear => Some((FindingKind::SignUnclear, Done::Reported)),
            },
        };
        findings.extend(finding.map(|(what, done)| (Some(joint), what, done)));
    }
    if are_crossed {
        let hips_known = !signs[..2].contains(&Some(SignBasis::Assumed));
        findings.push((None, FindingKind::KneesCrossed { hips_known }, Done::Reported));
    }
    for (sign, joints, what) in
        [(rules.hip_sign, &shapes[..2], FindingKind::NoHips), (rules.knee_sign, &shapes[2..], FindingKind::NoKnees)]
    {
        if sign.is_some() && joints.iter().all(Option::is_none) {
            findings.push((None, what, Done::Reported));
        }
    }
    for left in [0, 2] {
        let (Some(a), Some(b)) = (&shapes[left], &shapes[left + 1]) else { continue };
        if a.range.min(b.range) < LEAST_RANGE_DEG {
            continue;
        }
        if let (Some(a), Some(b)) = (a.phase(), b.phase())
            && apart(a, b) < 0.5 - OPPOSED
        {
            let kind = FindingKind::NotOpposed { cycles: apart(a, b) };
            findings.push((Some(Joint::ALL[left]), kind, Done::Reported));
        }
    }
    Ok(Convention { findings, signs, exchanged })
}

/// What the shape of a hip and the lead of its knee show.
fn shown_by(shapes: &[Option<Shape>; Joint::COUNT], hip: usize) -> Shown {
    let Some(shape) = &shapes[hip] else { return Shown::Nothing };
    let lead = match (&shapes[hip + 2], shape.phase()) {
        (Some(knee), Some(phase)) if knee.range >= LEAST_RANGE_DEG => {
            knee.phase().map(|knee| (knee - phase).rem_euclid(1.0))
        }
        _ => None,
    };
    let by_lead = lead.map(|lead| match lead {
        lead if (LEAD.0..=LEAD.1).contains(&lead) => 1,
        lead if (LEAD.0 + 0.5..=LEAD.1 + 0.5).contains(&lead) => -1,
        _ => 0,
    });
    Shown::of(by_lead, shape.hip_sign())
}
