//! The sign of the knees: the caller's, that of the format or of a conversion, else one decision for both, by what a knee can do or by the shape of the
//! gait.
//!
//! Where the format defines the sign, nothing else changes it: a stiff knee, a locked one and one that overextends have any shape.
//!
//! Else a knee that is beyond -40 degrees and stays below +15 counts extension as positive, one that is beyond +40 and stays above -15
//! counts flexion as positive; so do means beyond 25 degrees: a knee with recurvatum goes to -30 and back to 15, but is not bent that far in the mean.
//! Where the angles of one knee are decisive, they decide for both, also for one that hardly moves. Where each is decisive and they differ, each column
//! has a sign of its own, as two goniometers have; the knees of one model have one sign, that with which both are possible. Where no knee is decisive, the shape of
//! both decides (mean and skewness), which is a guess and a warning; if it is unclear too, the caller must name the sign. Angles that are computed from positions
//! have a known sign, unless the knees show that forward was taken the wrong way.

use super::positive_direction::PositiveDirection;
use super::shape::{LEAST_RANGE_DEG, Shape};
use crate::raw::{SignBasis, SignSource};

/// Beyond this mean angle, degrees, a knee shows on which side it bends.
pub const BENT_MEAN_DEG: f64 = 25.0;
/// Beyond this angle, degrees, it does too, if it stays on that side.
pub const BENT_DEG: f64 = 40.0;
/// Up to this angle, degrees, a knee that bends farther on one side may go to the other side.
pub const OVEREXTENDED_DEG: f64 = 15.0;
/// Smallest and largest angle of a knee, degrees, without the outermost hundredths.
pub const KNEE_DEG: (f64, f64) = (-50.0, 170.0);
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
    /// The format defines it; with the reason.
    Format(&'static str),
    /// The angle was computed from positions.
    Computed,
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
            (Self::Range | Self::OtherKnee | Self::Format(_) | Self::Computed, _) => SignBasis::Known,
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
    /// The mean is that of no flexion: a straight knee is 180 degrees, and neither sign is right.
    pub(crate) is_interior: bool,
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
    let is_interior = knees.iter().flatten().any(|shape| shape.mean.abs() > MOST_MEAN_DEG);
    let is_one_model = sources.iter().any(|source| matches!(source, SignSource::Model | SignSource::Computed));
    let differ = matches!(by_range, [Some(a), Some(b)] if a != b);
    let both_range = if is_one_model && differ { possible_for_all(&all) } else { agreed(by_range) };
    let of_shape = agreed(by_shape);
    let pair = |n: usize| {
        match sources[n] {
            SignSource::Converted(basis) => {
                let differs = [by_range[n], by_shape[n]].contains(&Some(PositiveDirection::Extension));
                let is_said = differs || basis == SignBasis::Turned;
                return decision(all[n], PositiveDirection::Flexion, KneeSignReason::Converted(basis), is_said);
            }
            SignSource::Format(why) => {
                let differs = [by_range[n], by_shape[n]].contains(&Some(PositiveDirection::Extension));
                return decision(all[n], PositiveDirection::Flexion, KneeSignReason::Format(why), differs);
            }
            SignSource::Computed => {
                let (sign, why) = match both_range {
                    Some(both) if by_range[n] == Some(both) => (both, KneeSignReason::Range),
                    Some(both) => (both, KneeSignReason::OtherKnee),
                    None => (PositiveDirection::Flexion, KneeSignReason::Computed),
                };
                return decision(all[n], sign, why, false);
            }
            SignSource::Unknown | SignSource::Model => {}
        }
        let differs = by_shape[n] != both_range || all[n].is_some_and(|shape| shape.mean < 0.0);
        match (by_range[n], both_range) {
            (Some(own), _) if !is_one_model => decision(all[n], own, KneeSignReason::Range, false),
            (own, Some(both)) if own == Some(both) => decision(all[n], both, KneeSignReason::Range, false),
            // The other knee decided, or both together. It is said where this one alone looks different.
            (_, Some(both)) => decision(all[n], both, KneeSignReason::OtherKnee, differs),
            (Some(_), None) => None,
            (None, None) => decision(all[n], of_shape?, KneeSignReason::Shape, true),
        }
    };
    let decided = [pair(0), pair(1)];
    if is_interior || (0..2).any(|n| knees[n].is_some() && decided[n].is_none()) {
        let extents = || knees.iter().flatten().map(|shape| shape.extent);
        let least_deg = extents().map(|extent| extent.0).fold(f64::INFINITY, f64::min);
        let most_deg = extents().map(|extent| extent.1).fold(f64::NEG_INFINITY, f64::max);
        return Err(AmbiguousKnees { least_deg, most_deg, is_interior });
    }
    Ok(decided)
}

/// The only sign with which both knees are possible.
fn possible_for_all(all: &[Option<&Shape>; 2]) -> Option<PositiveDirection> {
    let is_possible = |sign: PositiveDirection| {
        all.iter().flatten().all(|shape| match sign {
            PositiveDirection::Flexion => shape.extent.0 >= KNEE_DEG.0 && shape.mean >= -BENT_MEAN_DEG,
            PositiveDirection::Extension => -shape.extent.1 >= KNEE_DEG.0 && -shape.mean >= -BENT_MEAN_DEG,
        })
    };
    match PositiveDirection::ALL.map(is_possible) {
        [true, false] => Some(PositiveDirection::Flexion),
        [false, true] => Some(PositiveDirection::Extension),
        _ => None,
    }
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
    } else if shape.mean > BENT_MEAN_DEG || (most > BENT_DEG && least > -OVEREXTENDED_DEG) {
        Some(PositiveDirection::Flexion)
    } else if shape.mean < -BENT_MEAN_DEG || (least < -BENT_DEG && most < OVEREXTENDED_DEG) {
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

    /// Recurvatum on one side or on both, of a model that counts flexion as positive and of one that counts extension.
    #[test]
    fn knees_of_one_model_have_one_sign() {
        use PositiveDirection::{Extension, Flexion};
        let of = |left: (f64, f64), right: (f64, f64)| {
            let (left, right) = (knee(left.0, left.1), knee(right.0, right.1));
            let decided = decide([Some(&left), Some(&right)], None, [SignSource::Model; 2]);
            decided.map(|decided| decided.map(|one| one.map(|one| one.sign)))
        };
        let turned = |(least, most): (f64, f64)| (-most, -least);
        for (left, right) in [
            ((-27.0, 14.0), (-3.0, 60.0)),
            ((-45.0, 10.0), (-2.0, 62.0)),
            ((-1.0, 3.0), (0.0, 58.0)),
            ((1.0, 2.0), (5.0, 30.0)),
        ] {
            assert_eq!(of(left, right).unwrap(), [Some(Flexion); 2], "{left:?} {right:?}");
            assert_eq!(of(turned(left), turned(right)).unwrap(), [Some(Extension); 2], "{left:?} {right:?}");
        }
        // No sign makes both possible.
        assert!(of((-65.0, 2.0), (-3.0, 60.0)).is_err());
        // Where the format defines the sign, nothing changes it.
        for (least, most) in [(-27.0, 14.0), (-45.0, 10.0), (-3.0, 0.0), (-30.0, -5.0)] {
            let one = knee(least, most);
            let decided =
                decide([Some(&one), Some(&one)], None, [SignSource::Format("by definition of a test"); 2]).unwrap();
            assert!(decided.iter().flatten().all(|one| one.sign == Flexion && one.basis() == SignBasis::Known));
        }
    }

    /// An overextended knee reaches 30 degrees on the wrong side; with 41 it is bent.
    #[test]
    fn up_to_forty_degrees_a_knee_alone_shows_nothing() {
        use PositiveDirection::{Extension, Flexion};
        for reach in [25.0, 30.0, 39.0] {
            assert_eq!((by_range(&knee(-10.0, reach)), by_range(&knee(-reach, 10.0))), (None, None), "{reach}");
        }
        assert_eq!((by_range(&knee(-10.0, 42.0)), by_range(&knee(-42.0, 10.0))), (Some(Flexion), Some(Extension)));
    }

    #[test]
    fn what_is_ambiguous_is_an_error_with_the_angles() {
        let error = signs((-20.0, 20.0), (-22.0, 21.0)).unwrap_err();
        assert!((error.least_deg + 22.0).abs() < 0.1 && (error.most_deg - 21.0).abs() < 0.1, "{error:?}");
        // A straight knee of 180 degrees cannot be made right by a sign.
        assert!(signs((115.0, 178.0), (118.0, 179.0)).is_err_and(|error| error.is_interior));
        let (left, right) = (knee(-20.0, 20.0), knee(-22.0, 21.0));
        for asked in PositiveDirection::ALL {
            let decided = decide([Some(&left), Some(&right)], Some(asked), UNKNOWN).unwrap();
            assert!(decided.iter().flatten().all(|decision| decision.sign == asked && decision.is_said));
        }
        assert!(matches!(decide([None, None], None, UNKNOWN), Ok([None, None])));
    }
}
