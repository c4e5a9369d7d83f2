//! What was found in a recording and what was done about it, a sentence each that a gait lab understands.

use joint_units::Joint;
use std::fmt;

/// What was found.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum FindingKind {
    /// Times are unevenly spaced.
    UnevenTimes {
        /// 95th percentile of the steps' distance from their median, as a share of it.
        share: f64,
    },
    /// Rows of the same time as the one before.
    RepeatedTimes {
        /// How many.
        rows: usize,
    },
    /// The time axis is a cycle fraction.
    NormalisedCycle,
    /// A low-pass was asked for.
    Unfiltered,
    /// Values are missing.
    Gap,
    /// The angle jumps as no leg does.
    Jump {
        /// Largest distance from what was put in its place, degrees.
        deg: f64,
    },
    /// The angle jumps and does not come back.
    Step {
        /// By how much, degrees.
        deg: f64,
    },
    /// The joint hardly moves.
    Still {
        /// Its range.
        range_deg: f64,
    },
    /// The file counts extension as positive.
    ExtensionPositive {
        /// The file's mean angle.
        mean_deg: f64,
    },
    /// The witnesses of the sign contradict each other.
    SignUnclear,
    /// The columns of hip and knee of a leg look exchanged.
    HipIsKnee,
    /// Each knee goes with the other leg's hip, or both hips count extension as positive.
    KneesCrossed,
    /// Left and right are not half a stride apart.
    NotOpposed {
        /// How far they are.
        cycles: f64,
    },
}

/// What was done about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Done {
    /// Replaced by a cubic.
    Bridged,
    /// Not used: the span is among [`crate::Conditioned::unusable`], or the rows are not there any more.
    LeftOut,
    /// Nothing.
    Reported,
    /// The sign was turned.
    Flipped,
    /// Two columns changed places.
    Exchanged,
    /// Brought to even steps.
    Resampled,
    /// High frequencies were taken out.
    Smoothed {
        /// Cut-off of the low-pass.
        hz: f64,
    },
}

/// Something that a person should know about the recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Finding {
    /// From here, seconds from the first row.
    pub from_s: f64,
    /// To here.
    pub to_s: f64,
    /// Which joint; `None` is all of them.
    pub joint: Option<Joint>,
    /// What.
    pub what: FindingKind,
    /// And what of it.
    pub done: Done,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let joint = self.joint.map_or_else(|| "all joints".into(), |joint| joint.name().replace('_', " "));
        let side = if joint.starts_with("left") { "left" } else { "right" };
        let part = if joint.ends_with("hip") { "hips" } else { "knees" };
        let (from, to) = (self.from_s, self.to_s);
        match self.what {
            FindingKind::UnevenTimes { share } => {
                write!(f, "time stamps are uneven by {:.0} % of a step", 100.0 * share)?;
            }
            FindingKind::RepeatedTimes { rows } => {
                write!(f, "rows with the time of the row before: {rows}, the first at {from:.3} s")?;
            }
            FindingKind::NormalisedCycle => {
                write!(f, "the time axis runs over one cycle whose ends meet: a normalised cycle, not seconds")?;
            }
            FindingKind::Unfiltered => write!(f, "all joints: taken for unfiltered")?,
            FindingKind::Gap => write!(f, "{joint}, {from:.3} s to {to:.3} s: values are missing")?,
            FindingKind::Jump { deg } => {
                write!(f, "{joint}, {from:.3} s to {to:.3} s: a jump of {deg:.1} deg that no leg makes")?;
            }
            FindingKind::Step { deg } => {
                write!(f, "{joint}, {from:.3} s to {to:.3} s: a step of {deg:.1} deg that does not come back")?;
            }
            FindingKind::Still { range_deg } => write!(f, "{joint}: moves by {range_deg:.1} deg only")?,
            FindingKind::ExtensionPositive { mean_deg } => {
                write!(f, "{joint}: extension is positive in the file (mean {mean_deg:.0} deg)")?;
            }
            FindingKind::SignUnclear => {
                write!(f, "{joint}: whether flexion is positive is ambiguous")?;
            }
            FindingKind::HipIsKnee => {
                write!(f, "{side} leg: the column of the hip moves like a knee and that of the knee like a hip")?;
            }
            FindingKind::KneesCrossed => {
                write!(f, "each knee moves with the hip of the other leg: left and right knee may be exchanged")?;
            }
            FindingKind::NotOpposed { cycles } => {
                write!(f, "the {part} are {cycles:.2} of a stride apart, not half: columns may be mixed up")?;
            }
        }
        match (self.what, self.done) {
            (FindingKind::NormalisedCycle, Done::Reported) => Ok(()),
            (FindingKind::RepeatedTimes { .. }, Done::LeftOut) => f.write_str("; dropped"),
            (_, Done::Bridged) => f.write_str("; bridged"),
            (_, Done::LeftOut) => f.write_str("; left out"),
            (_, Done::Reported) => f.write_str("; left as it is"),
            (_, Done::Flipped) => f.write_str("; the sign was turned"),
            (_, Done::Exchanged) => f.write_str("; exchanged"),
            (_, Done::Resampled) => f.write_str("; resampled to even steps"),
            (_, Done::Smoothed { hz }) => write!(f, "; low-pass at {hz} Hz"),
        }
    }
}
