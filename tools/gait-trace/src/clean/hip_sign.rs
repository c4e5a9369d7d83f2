//! The sign of a hip: the caller's, else that of the format or of the positions that the angle is computed from, else the shape of the gait.
//!
//! A hip bends to both sides by up to 30 degrees and more, so its angles do not show the sign. The shape of the strides does, but only of
//! a usual gait: backwards in time, as a person who walks backwards moves, the knee leads the hip by half a cycle more or less, and the
//! double bump has another phase. So the shape changes the sign only where nothing else says it, with a warning; elsewhere it is a doubt,
//! which is reported. Where the shape shows nothing either, the sign of the file is an assumption, and that is reported too.

use super::positive_direction::PositiveDirection;
use crate::raw::{SignBasis, SignSource};

/// Why a sign was taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HipSignReason {
    /// The caller named it.
    Asked,
    /// The caller named extension, but the file is a conversion, in which flexion is positive by this. The option was right for the file before.
    AskedAgain(SignBasis),
    /// The format defines it; with the reason.
    Format(&'static str),
    /// The angle was computed from positions.
    Computed,
    /// The angle was computed from positions with the wrong forward: the knees bend to the other side.
    Knees,
    /// The shape of the strides.
    Shape,
    /// `footfall convert` made flexion positive, which rested on this.
    Converted(SignBasis),
}

impl HipSignReason {
    /// Whether it is reported where nothing speaks against it.
    pub(super) const fn is_said(self) -> bool {
        match self {
            Self::Asked | Self::AskedAgain(_) | Self::Knees | Self::Shape => true,
            Self::Format(_) | Self::Computed => false,
            Self::Converted(basis) => matches!(basis, SignBasis::Turned),
        }
    }

    /// What the sign rests on, in the angles that have been made flexion positive.
    pub(super) const fn basis(self) -> SignBasis {
        match self {
            Self::Asked | Self::AskedAgain(_) => SignBasis::Named,
            Self::Format(_) | Self::Computed => SignBasis::Known,
            Self::Knees | Self::Shape => SignBasis::Turned,
            Self::Converted(basis) => basis,
        }
    }
}

/// What speaks against a sign that was taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HipSignDoubt {
    /// The strides have the shape of the other sign.
    OtherShape,
    /// The shape of the strides shows no sign, or contradicts itself.
    NoShape,
}

/// The sign that was taken for a hip, and why.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TakenHipSign {
    /// The sign of the file.
    pub sign: PositiveDirection,
    /// Why.
    pub why: HipSignReason,
    /// What speaks against it.
    pub doubt: Option<HipSignDoubt>,
    /// Mean angle in the file, degrees.
    pub mean_deg: f64,
}

/// What the two indicators of a hip show, each with 1 for flexion positive, -1 for extension and 0 for neither.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shown {
    /// Flexion positive.
    Flexion,
    /// Extension positive.
    Extension,
    /// The knee leads as if extension were positive, the double bump shows flexion: the knee may be that of the other leg.
    Crossed,
    /// They contradict each other, or one of them is between both signs.
    Unclear,
    /// There are none: less than a stride, no knee and no double bump, or a joint that hardly moves.
    Nothing,
}

impl Shown {
    /// `lead` is `None` where there is no knee that moves, or no stride period.
    pub(super) const fn of(lead: Option<i32>, bump: i32) -> Self {
        match (lead, bump) {
            (Some(-1), -1) => Self::Extension,
            (Some(-1), 1) => Self::Crossed,
            (Some(-1), _) | (_, -1) | (Some(0), 0) => Self::Unclear,
            (None, 0) => Self::Nothing,
            _ => Self::Flexion,
        }
    }

    /// What it says against a sign that was taken, where the angles have been made flexion positive by it.
    pub(super) const fn doubt(self) -> Option<HipSignDoubt> {
        match self {
            Self::Flexion | Self::Nothing => None,
            Self::Extension => Some(HipSignDoubt::OtherShape),
            Self::Crossed | Self::Unclear => Some(HipSignDoubt::NoShape),
        }
    }
}

/// The sign that is known without the shape. `knees_extend` is whether the knees count extension as positive by what a knee
/// can do: where the angles are computed, forward was then the other way, for the hips too.
pub(super) fn known(
    asked: Option<PositiveDirection>,
    source: SignSource,
    knees_extend: bool,
) -> Option<(PositiveDirection, HipSignReason)> {
    use PositiveDirection::{Extension, Flexion};
    match (asked, source) {
        (Some(Extension), SignSource::Converted(basis)) if basis.is_sure() => {
            Some((Extension, HipSignReason::AskedAgain(basis)))
        }
        (Some(sign), _) => Some((sign, HipSignReason::Asked)),
        (None, SignSource::Format(why)) => Some((Flexion, HipSignReason::Format(why))),
        (None, SignSource::Computed) if knees_extend => Some((Extension, HipSignReason::Knees)),
        (None, SignSource::Computed) => Some((Flexion, HipSignReason::Computed)),
        (None, SignSource::Converted(basis)) => Some((Flexion, HipSignReason::Converted(basis))),
        (None, SignSource::Unknown | SignSource::Model) => None,
    }
}
