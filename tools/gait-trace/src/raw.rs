//! The four joints as a file has them: the output of every reader, before any repair, change of sign or cut.

use crate::format::angle_unit::AngleUnit;
use crate::options::Axis;
use joint_units::Joint;
use std::fmt;

/// Where the unit of a joint's values is from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UnitSource {
    /// A heading, a row of units or a header of the file names it.
    Stated(AngleUnit),
    /// The format has this unit by definition; with the reason.
    Format(AngleUnit, &'static str),
    /// The caller named it.
    Requested(AngleUnit),
    /// Nothing names it; the values imply it.
    Inferred(AngleUnit),
    /// The values were volts, and a calibration converted them.
    Calibrated,
    /// The reader computed the angles from positions.
    Computed,
}

impl fmt::Display for UnitSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stated(unit) => write!(f, "{}, stated in the file", unit.words()),
            Self::Format(unit, why) => write!(f, "{}, {why}", unit.words()),
            Self::Requested(unit) => write!(f, "{}, as requested", unit.words()),
            Self::Inferred(unit) => write!(f, "{}, inferred from the values", unit.words()),
            Self::Calibrated => f.write_str("volts, converted by the calibration"),
            Self::Computed => f.write_str("degrees, computed from positions"),
        }
    }
}

/// What it rests on that flexion of a joint is positive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SignBasis {
    /// The caller named the sign.
    Named,
    /// The format defines it, or the angle is computed from positions, or a knee bends farther than it could to the other side.
    Known,
    /// The shape of the strides shows it, and the sign is that of the file.
    Shape,
    /// The sign of the file was changed, by the shape of the strides alone, or because the knees of the same positions bend to the other side.
    Turned,
    /// Nothing, or what contradicts itself: the sign of the file is assumed to be right.
    Assumed,
}

impl SignBasis {
    /// All, in order.
    pub const ALL: [Self; 5] = [Self::Named, Self::Known, Self::Shape, Self::Turned, Self::Assumed];

    /// Whether somebody or something other than the gait says it.
    pub(crate) const fn is_sure(self) -> bool {
        matches!(self, Self::Named | Self::Known)
    }

    /// Its word in the record of a conversion.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Named => "named",
            Self::Known => "known",
            Self::Shape => "shape",
            Self::Turned => "turned",
            Self::Assumed => "assumed",
        }
    }
}

/// What a file or its format says about the sign of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SignSource {
    /// Nothing: each column may have a sign of its own.
    Unknown,
    /// Nothing, but left and right are angles of one model, which has one sign for both.
    Model,
    /// Flexion is positive by definition; with the reason.
    Format(&'static str),
    /// The reader computed the angles from positions, with flexion positive if the person's forward is known.
    Computed,
    /// `footfall convert` made flexion positive, which rested on this.
    Converted(SignBasis),
}

impl SignSource {
    /// [`Self::Format`] with that reason if the format defines the sign, else [`Self::Unknown`].
    pub(crate) const fn by_format(is_defined: bool, why: &'static str) -> Self {
        if is_defined { Self::Format(why) } else { Self::Unknown }
    }
}

/// What a reader took for granted although the file does not say it. Each is a warning: `--strict` refuses it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Doubt {
    /// The columns are angles: neither the title nor another column says so, only the unit.
    Quantity,
    /// The columns are angles in this unit: no heading says that they are angles, and the values imply it.
    Unit(AngleUnit),
    /// Flexion is this component of the angles, which moves most.
    Component(Axis),
    /// Flexion is the first component of the angles, although none clearly moves most.
    NoComponent,
    /// Up is an axis of the laboratory, from which the legs lean by so many degrees in the mean.
    Vertical {
        /// Angle between the axis and the line from ankles to hips, degrees.
        lean_deg: f64,
    },
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Quantity => f.write_str(
                "the columns are read as angles because the header gives their unit in degrees, but neither the title line nor another column says so; `--unit degrees` confirms it",
            ),
            Self::Unit(unit) => write!(
                f,
                "no heading says that the columns are angles, and they are read as {0} because of their values, which is a guess; `--unit {0}` confirms it",
                unit.words()
            ),
            Self::Component(axis) => write!(
                f,
                "flexion is read from component {0} of the angles because it moves most, which is a guess; `--axis {0}` confirms it",
                axis.name()
            ),
            Self::NoComponent => f.write_str(
                "no component of the angles clearly moves like flexion, and x is read, which is a guess; `--axis x` confirms it, `--axis y|z` takes another",
            ),
            Self::Vertical { lean_deg } => write!(
                f,
                "in the mean the legs lean by {lean_deg:.0} deg from the axis of the laboratory that is read as the vertical: if that axis is tilted, the hips are displaced by as much; turn the laboratory upright and export again"
            ),
        }
    }
}

/// One column of a file that was recognised as a joint.
#[derive(Debug, Clone, PartialEq)]
pub struct RawJoint {
    /// The column's name in the file, or the trajectories that the angle was computed from.
    pub column: String,
    /// Where the unit is from. The angles below are in degrees, whatever the file has.
    pub unit: UnitSource,
    /// What is known about its sign.
    pub sign: SignSource,
    /// Angle in degrees with the file's own sign, one value per row; NaN where the file has no value.
    pub angle_deg: Vec<f64>,
}

impl RawJoint {
    /// A column of degrees, as a file states them; nothing says its sign.
    #[must_use]
    pub fn degrees(column: impl Into<String>, angle_deg: Vec<f64>) -> Self {
        Self {
            column: column.into(),
            unit: UnitSource::Stated(AngleUnit::Degrees),
            sign: SignSource::Unknown,
            angle_deg,
        }
    }
}

/// Joint angles as read: times may be uneven, values may be missing, signs are those of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct RawJoints {
    /// The file's name.
    pub file: String,
    /// The file's format in words: `OpenSim motion, version 1, tabs, radians`.
    pub format: String,
    /// Time in seconds, as in the file: finite, but not necessarily increasing.
    pub time_s: Vec<f64>,
    /// Whether the times are those at which messages were received: they are late by delays that differ from row to row.
    pub received: bool,
    /// In the order of [`Joint::ALL`]; `None` where the file has no such joint.
    pub joints: [Option<RawJoint>; Joint::COUNT],
    /// Decisions of the reader that the user should know, one sentence each.
    pub notes: Vec<String>,
    /// Guesses of the reader, which are warnings.
    pub doubts: Vec<Doubt>,
}
