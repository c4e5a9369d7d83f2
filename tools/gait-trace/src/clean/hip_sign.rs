//! The sign of a hip: the caller's, else that of the format or of the positions that the angle is computed from, else the shape of the gait.
//!
//! A hip bends to both sides by up to 30 degrees and more, so its angles do not show the sign. The shape of the strides does, but only of
//! a usual gait: backwards in time, as a person who walks backwards moves, the knee leads the hip by half a cycle more or less, and the
//! double bump has another phase. So the shape changes the sign only where nothing else says it; elsewhere it is a doubt, which is reported.

use super::positive_direction::PositiveDirection;
use crate::raw::SignSource;

/// Why a sign was taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HipSignReason {
    /// The caller named it.
    Asked,
    /// The format defines it; with the reason.
    Format(&'static str),
    /// The angle was computed from positions.
    Computed,
    /// The angle was computed from positions with the wrong forward: the knees bend to the other side.
    Knees,
    /// The shape of the strides.
    Shape,
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
    /// Flexion positive, or nothing against it.
    Flexion,
    /// Extension positive.
    Extension,
    /// The knee leads as if extension were positive, the double bump shows flexion: the knee may be that of the other leg.
    Crossed,
    /// Neither.
    Unclear,
}

impl Shown {
    /// `lead` is `None` where there is no knee that moves, or no stride period.
    pub(super) const fn of(lead: Option<i32>, bump: i32) -> Self {
        match (lead, bump) {
            (Some(-1), -1) => Self::Extension,
            (Some(-1), 1) => Self::Crossed,
            (Some(-1), _) | (_, -1) | (Some(0), 0) => Self::Unclear,
            _ => Self::Flexion,
        }
    }

    /// What it says against a sign that was taken, where the angles have been made flexion positive by it.
    pub(super) const fn doubt(self) -> Option<HipSignDoubt> {
        match self {
            Self::Flexion => None,
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
        (Some(sign), _) => Some((sign, HipSignReason::Asked)),
        (None, SignSource::Format(why)) => Some((Flexion, HipSignReason::Format(why))),
        (None, SignSource::Computed) if knees_extend => Some((Extension, HipSignReason::Knees)),
        (None, SignSource::Computed) => Some((Flexion, HipSignReason::Computed)),
        (None, SignSource::Unknown) => None,
    }
}
