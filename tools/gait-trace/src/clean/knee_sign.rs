//! The sign of the knees: the caller's, or that of a conversion, else one decision for both, by what a knee can do or by the shape of the gait.
//!
//! A knee bends by up to 160 degrees and overextends by up to 25. So a knee that is beyond -25 degrees and stays below +15 counts
//! extension as positive, one that is beyond +25 and stays above -15 counts flexion as positive; so do means beyond 25 degrees. Where
//! the angles of one knee are decisive, they decide for both. Where each is decisive and they differ, each column has a sign of its
//! own. Where none is, the shape of both decides (mean and skewness), with a warning if it changes the sign; if it is unclear too, the
//! caller must name the sign.

use super::positive_direction::PositiveDirection;
use super::shape::{LEAST_RANGE_DEG, Shape};
use crate::raw::{SignBasis, SignSource};

/// Beyond this angle, degrees, a knee shows on which side it bends.
pub const BENT_DEG: f64 = 25.0;
/// Up to this angle, degrees, a knee may go to the other side.
pub const OVEREXTENDED_DEG: f64 = 15.0;
/// Largest mean, degrees, that an angle of flexion can have; beyond it a straight knee is probably 180 degrees.
pub const MOST_MEAN_DEG: f64 = 120.0;

/// Why a sign was taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KneeSignReason {
    /// The angles are beyond what a knee does on the other side.
    Range,
    /// The other knee decided.
    OtherKnee,
    /// The shape of the strides.
    Shape,
    /// The caller named it.
    Asked,
    /// The caller named extension, but the file is a conversion, in which flexion is positive by this. The option was right for the file before.
    AskedAgain(SignBasis),
    /// `footfall convert` made flexion positive, which rested on this.
    Converted(SignBasis),
}

impl KneeSignReason {
    /// What the sign rests on, in the angles that have been made flexion positive.
    const fn basis(self, sign: PositiveDirection) -> SignBasis {
        match (self, sign) {
            (Self::Asked | Self::AskedAgain(_), _) => SignBasis::Named,
            (Self::Range | Self::OtherKnee, _) => SignBasis::Known,
            (Self::Shape, PositiveDirection::Flexion) => SignBasis::Shape,
            (Self::Shape, PositiveDirection::Extension) => SignBasis::Turned,
            (Self::Converted(basis), _) => basis,
        }
    }
}

/// The sign that was taken for a knee, and why.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TakenKneeSign {
    /// The sign of the file.
    pub sign: PositiveDirection,
    /// Why.
    pub why: KneeSignReason,
    /// Smallest angle in the file, degrees, without the outermost hundredth.
    pub least_deg: f64,
    /// Largest angle in the file, degrees, without the outermost hundredth.
    pub most_deg: f64,
}

/// The sign of a knee that moves, or that is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Decision {
    pub(super) sign: PositiveDirection,
    pub(super) taken: TakenKneeSign,
    /// Whether the decision is reported although nothing changes: the angles of this knee alone do not show it.
    pub(super) is_said: bool,
}

impl Decision {
    /// What the sign rests on.
    pub(super) const fn basis(&self) -> SignBasis {
        self.taken.why.basis(self.sign)
    }
}

/// The sign does not follow from the angles: smallest and largest angle of the knees, degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AmbiguousKnees {
    pub(crate) least_deg: f64,
    pub(crate) most_deg: f64,
}

/// The sign of the left and the right knee; `None` for one that is missing, and for one that is still and whose sign is not known.
pub(super) fn decide(
    all: [Option<&Shape>; 2],
    asked: Option<PositiveDirection>,
    sources: [SignSource; 2],
) -> Result<[Option<Decision>; 2], AmbiguousKnees> {
    let knees = all.map(|knee| knee.filter(|shape| shape.range >= LEAST_RANGE_DEG));
    let by_range = knees.map(|knee| knee.and_then(by_range));
    let is_possible = |shape: &&Shape| shape.mean.abs() <= MOST_MEAN_DEG;
    let by_shape = knees.map(|knee| knee.filter(is_possible).and_then(|shape| of_number(shape.knee_sign())));
    let decision = |knee: Option<&Shape>, sign: PositiveDirection, why: KneeSignReason, is_said: bool| {
        let (least_deg, most_deg) = knee?.extent;
        Some(Decision { sign, taken: TakenKneeSign { sign, why, least_deg, most_deg }, is_said })
    };
    if let Some(sign) = asked {
        return Ok([0, 1].map(|n| {
            let why = match sources[n] {
                SignSource::Converted(basis) if basis.is_sure() && sign == PositiveDirection::Extension => {
                    KneeSignReason::AskedAgain(basis)
                }
                _ => KneeSignReason::Asked,
            };
            decision(all[n], sign, why, true)
        }));
    }
    let any_range = agreed(by_range);
    let pair = |n: usize| {
        if let SignSource::Converted(basis) = sources[n] {
            let differs = [by_range[n], by_shape[n]].contains(&Some(PositiveDirection::Extension));
            let is_said = differs || basis == SignBasis::Turned;
            return decision(all[n], PositiveDirection::Flexion, KneeSignReason::Converted(basis), is_said);
        }
        let knee = knees[n];
        match (by_range[n], any_range) {
            (Some(own), _) => decision(knee, own, KneeSignReason::Range, false),
            // The other knee decided. It is said where this one alone looks different.
            (None, Some(both)) => {
                let differs = by_shape[n] != Some(both) || knee.is_some_and(|shape| shape.mean < 0.0);
                decision(knee, both, KneeSignReason::OtherKnee, differs)
            }
            (None, None) => decision(knee, agreed(by_shape)?, KneeSignReason::Shape, false),
        }
    };
    let decided = [pair(0), pair(1)];
    if (0..2).any(|n| knees[n].is_some() && decided[n].is_none()) {
        let extents = || knees.iter().flatten().map(|shape| shape.extent);
        let least_deg = extents().map(|extent| extent.0).fold(f64::INFINITY, f64::min);
        let most_deg = extents().map(|extent| extent.1).fold(f64::NEG_INFINITY, f64::max);
        return Err(AmbiguousKnees { least_deg, most_deg });
    }
    Ok(decided)
}

/// The sign that a number above or below 0 stands for.
fn of_number(number: i32) -> Option<PositiveDirection> {
    match number {
        0 => None,
        above if above > 0 => Some(PositiveDirection::Flexion),
        _ => Some(PositiveDirection::Extension),
    }
}

/// The one sign of two; `None` if there is none, or if they differ.
fn agreed(signs: [Option<PositiveDirection>; 2]) -> Option<PositiveDirection> {
    match signs {
        [Some(a), Some(b)] => (a == b).then_some(a),
        [a, b] => a.or(b),
    }
}

/// The sign that the angles of a knee show by what a knee can do.
fn by_range(shape: &Shape) -> Option<PositiveDirection> {
    let (least, most) = shape.extent;
    if shape.mean.abs() > MOST_MEAN_DEG {
        None
    } else if shape.mean > BENT_DEG || (most > BENT_DEG && least > -OVEREXTENDED_DEG) {
        Some(PositiveDirection::Flexion)
    } else if shape.mean < -BENT_DEG || (least < -BENT_DEG && most < OVEREXTENDED_DEG) {
        Some(PositiveDirection::Extension)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNKNOWN: [SignSource; 2] = [SignSource::Unknown; 2];

    /// A knee that swings between two angles, without a stride period.
    fn knee(least: f64, most: f64) -> Shape {
        let x: Vec<f64> =
            (0..200).map(|n| 0.5 * (least + most) + 0.5 * (most - least) * (n as f64 * 0.1).sin()).collect();
        Shape::of(&x, None)
    }

    fn signs(left: (f64, f64), right: (f64, f64)) -> Result<Vec<(PositiveDirection, KneeSignReason)>, AmbiguousKnees> {
        let (left, right) = (knee(left.0, left.1), knee(right.0, right.1));
        let decided = decide([Some(&left), Some(&right)], None, UNKNOWN)?;
        Ok(decided.into_iter().flatten().map(|decision| (decision.sign, decision.taken.why)).collect())
    }

    #[test]
    fn what_a_knee_can_do_decides_for_both() {
        use KneeSignReason::{OtherKnee, Range};
        use PositiveDirection::{Extension, Flexion};
        // The walk of which one knee was turned and the other was not.
        assert_eq!(signs((-44.6, -11.4), (-14.9, -7.3)).unwrap(), [(Extension, Range), (Extension, OtherKnee)]);
        // A person who walks with bent knees.
        assert_eq!(signs((51.0, 113.0), (60.0, 110.0)).unwrap(), [(Flexion, Range), (Flexion, Range)]);
        assert_eq!(signs((-2.0, 65.0), (3.0, 14.0)).unwrap(), [(Flexion, Range), (Flexion, OtherKnee)]);
        assert_eq!(signs((-65.0, 2.0), (-60.0, -3.0)).unwrap(), [(Extension, Range), (Extension, Range)]);
        // Two columns with signs of their own: one of them cannot be a knee with the other's sign.
        assert_eq!(signs((-65.0, 2.0), (-3.0, 60.0)).unwrap(), [(Extension, Range), (Flexion, Range)]);
    }

    #[test]
    fn what_is_ambiguous_is_an_error_with_the_angles() {
        let error = signs((-20.0, 20.0), (-22.0, 21.0)).unwrap_err();
        assert!((error.least_deg + 22.0).abs() < 0.1 && (error.most_deg - 21.0).abs() < 0.1, "{error:?}");
        // A straight knee of 180 degrees cannot be made right by a sign.
        assert!(signs((115.0, 178.0), (118.0, 179.0)).is_err());
        let (left, right) = (knee(-20.0, 20.0), knee(-22.0, 21.0));
        for asked in PositiveDirection::ALL {
            let decided = decide([Some(&left), Some(&right)], Some(asked), UNKNOWN).unwrap();
            assert!(decided.iter().flatten().all(|decision| decision.sign == asked && decision.is_said));
        }
        assert!(matches!(decide([None, None], None, UNKNOWN), Ok([None, None])));
    }
}
