//! Defects found in a recording and what was done about each, as sentences for the report.

use crate::clean::hip_sign::{HipSignDoubt, HipSignReason, TakenHipSign};
use crate::clean::knee_sign::{KneeSignReason, TakenKneeSign};
use crate::clean::positive_direction::PositiveDirection;
use crate::raw::{Doubt, SignBasis};
use joint_units::Joint;
use std::fmt;

/// The defect.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum FindingKind {
    /// Times are unevenly spaced.
    UnevenTimes {
        /// 95th percentile of the deviation of the time steps from their median, as a fraction of the median.
        share: f64,
    },
    /// The times are those at which messages were received.
    ReceivedTimes {
        /// How much later than others a message may be: the range of the delays without the outermost twentieths, as a fraction of a step.
        share: f64,
    },
    /// Rows with the same time as the row before.
    RepeatedTimes {
        /// Number of such rows.
        rows: usize,
        /// Number of all rows.
        of: usize,
    },
    /// The time axis is a fraction of a cycle, not seconds, and the duration of the cycle is not known.
    NormalisedCycle,
    /// The time axis is a fraction of a cycle of known duration.
    CycleOf {
        /// Duration of the cycle, seconds.
        stride_s: f64,
    },
    /// The time axis has the length of a normalised cycle, but the angles at its ends differ too much for one.
    CycleOrSeconds {
        /// Length of the time axis.
        length: f64,
        /// Largest difference of the ends, degrees.
        apart_deg: f64,
    },
    /// A low-pass was requested, so the data are treated as unfiltered.
    Unfiltered,
    /// Rows repeat the values of a slower sensor.
    Held {
        /// Usual number of equal rows.
        block: usize,
        /// Rate of the different values, Hz.
        rate_hz: f64,
    },
    /// A small part of the angle was folded at a bound.
    Folded {
        /// The bound, degrees.
        at_deg: f64,
        /// Size of the folded parts, degrees.
        deg: f64,
    },
    /// The mean angle of a hip or knee is not that of an upright person.
    Displaced {
        /// The mean, degrees.
        mean_deg: f64,
    },
    /// Values are missing.
    Gap,
    /// Values are missing in many places, each short.
    Gaps {
        /// Number of places.
        count: usize,
        /// Length of the longest, seconds.
        longest_s: f64,
    },
    /// The joint stays at an end of its range: the signal may be clipped.
    Clipped {
        /// The angle, degrees.
        deg: f64,
        /// Share of the recording.
        share: f64,
    },
    /// The mean of the strides moves along a line.
    Drift {
        /// Change over the recording, degrees.
        deg: f64,
    },
    /// The angle jumps faster than a leg can move.
    Jump {
        /// Largest difference from the replacement, degrees.
        deg: f64,
    },
    /// The angle jumps and stays displaced.
    Step {
        /// Displacement, degrees.
        deg: f64,
    },
    /// The joint hardly moves.
    Still {
        /// Range of the angle, degrees.
        range_deg: f64,
    },
    /// The sign of a knee that was taken, and why.
    KneeSign(TakenKneeSign),
    /// The sign of a hip that was taken, and why.
    HipSign(TakenHipSign),
    /// The indicators of the sign of a hip contradict each other, and nothing else says it.
    SignUnclear,
    /// Nothing shows the sign of a joint: it is assumed that flexion is positive.
    SignNotKnown,
    /// The caller names the sign of hips, and the recording has none.
    NoHips,
    /// The caller names the sign of knees, and the recording has none.
    NoKnees,
    /// The columns of hip and knee of one leg appear to be exchanged.
    HipIsKnee,
    /// Each knee moves in the phase of the other leg's hip: exchanged, or of a person who walks backwards, or both hips count extension as
    /// positive.
    KneesCrossed {
        /// Whether the sign of the hips is known, which leaves the first two.
        hips_known: bool,
    },
    /// Left and right are not half a stride apart.
    NotOpposed {
        /// Phase difference of the two, cycles.
        cycles: f64,
    },
    /// What the reader took for granted.
    Guess(Doubt),
    /// The leg that the file does not have is the other one, moved by half a stride, as requested.
    Mirrored {
        /// Half a stride, seconds.
        half_s: f64,
    },
    /// The right leg of a cycle is moved by half of it, as requested.
    OwnCycles,
    /// Strides of a short recording differ, as those of a turn do.
    StridesDiffer {
        /// Largest distance of two strides in a row, root mean square over joints and points, degrees.
        deg: f64,
    },
}

/// More than one row in this many with the time of the row before: the time stamps are too coarse, and dropped rows are lost data.
const MANY_REPEATED: usize = 20;
/// Delays of messages from which equal steps are an assumption that a person should look at, as a fraction of a step.
const LONG_DELAYS: f64 = 0.5;

/// Legs that are less apart, in strides, move together.
const IN_PHASE: f64 = 0.1;

/// How much a finding matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Level {
    /// Good to know: the defect was repaired, or does no harm.
    Note,
    /// The recording may not be what it seems; a person should look at it.
    Warning,
    /// The recording cannot be used.
    Error,
}

impl Level {
    /// Its name: `note`, `warning`, `error`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Note => "note",
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

/// What was done about the defect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Done {
    /// Replaced by a cubic between the good samples on both sides.
    Bridged,
    /// Not used: the span is listed in [`crate::Conditioned::unusable`], or the rows were dropped.
    LeftOut,
    /// Reported only; the data are unchanged.
    Reported,
    /// The sign was changed.
    Flipped,
    /// Two columns were exchanged.
    Exchanged,
    /// Resampled to equal time steps.
    Resampled,
    /// Low-pass filtered.
    Smoothed {
        /// Cut-off frequency, Hz.
        hz: f64,
    },
}

/// A defect of the recording, with its place and what was done about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Finding {
    /// Start of the span, seconds from the first row.
    pub from_s: f64,
    /// End of the span, seconds from the first row.
    pub to_s: f64,
    /// The joint; `None` for all joints.
    pub joint: Option<Joint>,
    /// The defect.
    pub what: FindingKind,
    /// What was done about it.
    pub done: Done,
}

impl Finding {
    /// How much it matters.
    #[must_use]
    pub const fn level(&self) -> Level {
        match self.what {
            FindingKind::Step { .. }
            | FindingKind::Still { .. }
            | FindingKind::SignUnclear
            | FindingKind::SignNotKnown
            | FindingKind::HipIsKnee
            | FindingKind::KneesCrossed { .. }
            | FindingKind::NotOpposed { .. }
            | FindingKind::Clipped { .. }
            | FindingKind::Held { .. }
            | FindingKind::Folded { .. }
            | FindingKind::Displaced { .. }
            | FindingKind::Guess(_)
            | FindingKind::StridesDiffer { .. }
            | FindingKind::Drift { .. } => Level::Warning,
            FindingKind::RepeatedTimes { rows, of } if rows * MANY_REPEATED > of => Level::Warning,
            FindingKind::ReceivedTimes { share } if share > LONG_DELAYS => Level::Warning,
            // What the caller named is certain enough, whatever the shape says.
            FindingKind::HipSign(TakenHipSign {
                why: HipSignReason::Asked | HipSignReason::Converted(SignBasis::Named),
                ..
            }) => Level::Note,
            FindingKind::HipSign(TakenHipSign {
                why:
                    HipSignReason::AskedAgain(_)
                    | HipSignReason::Knees
                    | HipSignReason::Shape
                    | HipSignReason::Converted(SignBasis::Turned),
                ..
            })
            | FindingKind::HipSign(TakenHipSign { doubt: Some(_), .. }) => Level::Warning,
            FindingKind::KneeSign(TakenKneeSign {
                why: KneeSignReason::AskedAgain(_) | KneeSignReason::Converted(SignBasis::Turned),
                ..
            }) => Level::Warning,
            // Neither the format nor the angles of the knees show it: a guess.
            FindingKind::KneeSign(TakenKneeSign { why: KneeSignReason::Shape, .. }) => Level::Warning,
            _ => Level::Note,
        }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let joint = self.joint.map_or_else(|| "all joints".into(), |joint| joint.name().replace('_', " "));
        let side = if joint.starts_with("left") { "left" } else { "right" };
        let part = if joint.ends_with("hip") { "hips" } else { "knees" };
        let (from, to) = (self.from_s, self.to_s);
        match self.what {
            FindingKind::UnevenTimes { share } => {
                write!(f, "the time stamps are uneven by {:.0} % of a time step", 100.0 * share)?;
            }
            FindingKind::ReceivedTimes { share } => {
                let percent = 100.0 * share;
                write!(
                    f,
                    "the times are those at which messages were received, late by up to {percent:.0} % of a time step"
                )?;
            }
            FindingKind::RepeatedTimes { rows, of } => {
                write!(f, "rows with the same time as the row before: {rows} of {of}, the first at {from:.3} s")?;
            }
            FindingKind::NormalisedCycle => {
                write!(
                    f,
                    "the time axis is the fraction of one cycle (0 to 1 or 0 to 100 %), not seconds; `--stride-time S` gives the real duration of the stride"
                )?;
            }
            FindingKind::CycleOf { stride_s } => {
                write!(f, "the time axis is the fraction of one cycle; it lasts {stride_s} s, as requested")?;
            }
            FindingKind::CycleOrSeconds { length, apart_deg } => {
                write!(
                    f,
                    "the time runs from 0 to {length}, as in a normalised cycle, but the ends differ by {apart_deg:.1} deg; it is read as seconds; `--stride-time S` reads it as one stride of S seconds"
                )?;
            }
            FindingKind::Held { block, rate_hz } => {
                let (what, none, rest) = match self.joint {
                    Some(_) => (
                        format!("{joint}: the rows"),
                        ", or have none,",
                        "the angles between them are replaced by a cubic",
                    ),
                    None => ("the rows".into(), "", "the repeated rows are left out"),
                };
                write!(
                    f,
                    "{what} repeat their values{none} in blocks of {block}, as a slower sensor makes them: it gave {rate_hz:.1} values a second; {rest}"
                )?;
            }
            FindingKind::Folded { at_deg, deg } => {
                write!(
                    f,
                    "{joint}: turns back in corners at {at_deg} deg: up to {deg:.1} deg beyond it may be folded to this side"
                )?;
            }
            FindingKind::Displaced { mean_deg } => {
                write!(
                    f,
                    "{joint}: a mean of {mean_deg:.0} deg; an upright stand may have another angle than 0 in the file"
                )?;
            }
            FindingKind::Unfiltered => write!(f, "all joints: treated as unfiltered")?,
            FindingKind::Gap => write!(f, "{joint}, {from:.3} s to {to:.3} s: missing values")?,
            FindingKind::Gaps { count, longest_s } => {
                write!(
                    f,
                    "{joint}, {from:.3} s to {to:.3} s: {count} gaps of missing values, the longest {longest_s:.3} s"
                )?;
            }
            FindingKind::Clipped { deg, share } => {
                let share = 100.0 * share;
                write!(
                    f,
                    "{joint}: at {deg:.1} deg, an end of its range, for {share:.0} % of the time; the signal may be clipped"
                )?;
            }
            FindingKind::Drift { deg } => {
                write!(f, "{joint}, {from:.3} s to {to:.3} s: the mean of the strides drifts by {deg:.1} deg")?;
            }
            FindingKind::Jump { deg } => {
                write!(f, "{joint}, {from:.3} s to {to:.3} s: a jump of {deg:.1} deg, faster than a leg can move")?;
            }
            FindingKind::Step { deg } => {
                write!(f, "{joint}, {from:.3} s to {to:.3} s: a lasting step of {deg:.1} deg")?;
            }
            FindingKind::Still { range_deg } => write!(f, "{joint}: moves by only {range_deg:.1} deg")?,
            FindingKind::KneeSign(taken) => knee_sign(f, &joint, taken)?,
            FindingKind::HipSign(taken) => hip_sign(f, &joint, taken)?,
            FindingKind::SignUnclear => {
                write!(
                    f,
                    "{joint}: it is unclear whether flexion is positive, as the strides are not those of walking forwards; `--hip-sign flexion|extension` names the sign"
                )?;
            }
            FindingKind::SignNotKnown => {
                let option = if joint.ends_with("hip") { "--hip-sign" } else { "--knee-sign" };
                write!(
                    f,
                    "{joint}: neither the file nor the strides show whether flexion is positive, and it is assumed; `{option} flexion|extension` names the sign"
                )?;
            }
            FindingKind::NoHips => write!(f, "`--hip-sign` has no effect: the recording has no hip")?,
            FindingKind::NoKnees => write!(f, "`--knee-sign` has no effect: the recording has no knee")?,
            FindingKind::HipIsKnee => {
                write!(f, "{side} leg: the hip column moves like a knee and the knee column like a hip")?;
            }
            FindingKind::KneesCrossed { hips_known } => {
                let reasons = if hips_known {
                    "left and right knee may be exchanged, or the person walks backwards"
                } else {
                    "left and right knee may be exchanged, the person may walk backwards, or extension of both hips may be positive; flexion is assumed, `--hip-sign flexion|extension` names the sign"
                };
                write!(f, "each knee moves in the phase of the other leg's hip: {reasons}")?;
            }
            FindingKind::NotOpposed { cycles } => {
                let hint = if cycles < IN_PHASE {
                    ", one leg may be in both, or each leg may count from its own step"
                } else {
                    ""
                };
                write!(
                    f,
                    "left and right {part} are {cycles:.2} strides apart, not 0.5: columns may be exchanged{hint}"
                )?;
            }
            FindingKind::Guess(doubt) => doubt.fmt(f)?,
            FindingKind::Mirrored { half_s } => {
                write!(f, "{joint}: that of the other leg, {half_s:.3} s later, half a stride, as requested")?;
            }
            FindingKind::OwnCycles => f.write_str(
                "each leg counts from its own contact, as requested: the right leg is moved by half of the cycle",
            )?,
            FindingKind::StridesDiffer { deg } => {
                write!(
                    f,
                    "{from:.3} s to {to:.3} s: strides differ by {deg:.1} deg (root mean square), as in a turn or where the pace changes"
                )?;
            }
        }
        match (self.what, self.done) {
            (
                FindingKind::Guess(_)
                | FindingKind::Mirrored { .. }
                | FindingKind::OwnCycles
                | FindingKind::NormalisedCycle
                | FindingKind::CycleOf { .. }
                | FindingKind::CycleOrSeconds { .. }
                | FindingKind::NoHips
                | FindingKind::NoKnees,
                Done::Reported,
            ) => Ok(()),
            (FindingKind::ReceivedTimes { .. }, Done::Resampled) => {
                f.write_str("; the rows are put at equal time steps")
            }
            (FindingKind::RepeatedTimes { rows, of }, Done::LeftOut) => {
                f.write_str("; dropped")?;
                if rows * MANY_REPEATED > of {
                    f.write_str(" (if the times are only rounded, `--rate HZ` reads all rows)")?;
                }
                Ok(())
            }
            (FindingKind::Held { .. }, _) => Ok(()),
            (FindingKind::HipSign(TakenHipSign { sign, why: HipSignReason::Shape, .. }), _) => {
                let (found, other) = (sign.name(), sign.opposite().name());
                write!(
                    f,
                    "; the sign was changed; `--hip-sign {found}` confirms that, `--hip-sign {other}` keeps it, for example where the person walks backwards"
                )
            }
            (
                FindingKind::KneeSign(TakenKneeSign {
                    sign: PositiveDirection::Extension,
                    why: KneeSignReason::Shape,
                    ..
                }),
                _,
            ) => f.write_str(
                "; the sign was changed; `--knee-sign extension` confirms that, `--knee-sign flexion` keeps it",
            ),
            (FindingKind::KneeSign(TakenKneeSign { why: KneeSignReason::Shape, .. }), _) => {
                f.write_str("; not changed; `--knee-sign flexion` confirms it, `--knee-sign extension` changes it")
            }
            (
                FindingKind::HipSign(TakenHipSign { why: HipSignReason::Converted(SignBasis::Turned), .. }),
                Done::Reported,
            ) => f.write_str("; not changed; `--hip-sign flexion` confirms it, `--hip-sign extension` changes it"),
            (
                FindingKind::KneeSign(TakenKneeSign { why: KneeSignReason::Converted(SignBasis::Turned), .. }),
                Done::Reported,
            ) => f.write_str("; not changed; `--knee-sign flexion` confirms it, `--knee-sign extension` changes it"),
            (
                FindingKind::HipSign(TakenHipSign { sign, doubt: Some(HipSignDoubt::OtherShape), .. }),
                Done::Reported,
            ) => {
                write!(f, "; not changed; `--hip-sign {}` changes it", sign.opposite().name())
            }
            (_, Done::Bridged) => f.write_str("; replaced by a cubic"),
            (_, Done::LeftOut) => f.write_str("; left out"),
            (_, Done::Reported) => f.write_str("; not changed"),
            (_, Done::Flipped) => f.write_str("; the sign was changed"),
            (_, Done::Exchanged) => f.write_str("; exchanged"),
            (_, Done::Resampled) => f.write_str("; resampled to equal time steps"),
            (_, Done::Smoothed { hz }) => write!(f, "; low-pass at {hz} Hz"),
        }
    }
}

/// Why flexion is positive in a file that `footfall convert` wrote.
const fn converted(basis: SignBasis) -> &'static str {
    match basis {
        SignBasis::Named => "as requested of `footfall convert`",
        SignBasis::Turned => "as `footfall convert` changed it, which was a guess",
        SignBasis::Known | SignBasis::Shape | SignBasis::Assumed => "as `footfall convert` writes it",
    }
}

/// The sign of a knee, and why it was taken.
fn knee_sign(f: &mut fmt::Formatter<'_>, joint: &str, taken: TakenKneeSign) -> fmt::Result {
    let TakenKneeSign { sign, why, least_deg, most_deg } = taken;
    let opposite = if sign == PositiveDirection::Extension { "flexion" } else { "overextension" };
    write!(f, "{joint}: {} is positive in the file ({least_deg:.1} to {most_deg:.1} deg: ", sign.name())?;
    match why {
        KneeSignReason::Range => write!(f, "too far for {opposite} of a knee)"),
        KneeSignReason::OtherKnee => write!(f, "one sign for both knees, and the other one shows it)"),
        KneeSignReason::Shape => write!(f, "by the shape of the strides, which is a guess)"),
        KneeSignReason::Format(why) => {
            write!(f, "{why}), although its angles or its shape are those of the other sign")
        }
        KneeSignReason::Computed => write!(f, "computed from positions)"),
        KneeSignReason::Asked => write!(f, "as requested)"),
        KneeSignReason::AskedAgain(basis) => write!(f, "{})", asked_again(basis)),
        KneeSignReason::Converted(basis) => write!(f, "{})", converted(basis)),
    }
}

/// An option against the sign of a conversion.
fn asked_again(basis: SignBasis) -> String {
    format!(
        "as requested, but the file is a conversion, in which flexion is positive (`{}`); without the option that sign is kept",
        basis.name()
    )
}

/// The sign of a hip, why it was taken, and what speaks against it.
fn hip_sign(f: &mut fmt::Formatter<'_>, joint: &str, taken: TakenHipSign) -> fmt::Result {
    let TakenHipSign { sign, why, doubt, mean_deg } = taken;
    write!(f, "{joint}: {} is positive in the file (", sign.name())?;
    match why {
        HipSignReason::Asked => f.write_str("as requested)"),
        HipSignReason::AskedAgain(basis) => write!(f, "{})", asked_again(basis)),
        HipSignReason::Format(why) => write!(f, "{why})"),
        HipSignReason::Computed => f.write_str("computed from positions)"),
        HipSignReason::Knees => f.write_str(
            "computed from positions with a forward to which the knee does not bend: left and right may be exchanged)",
        ),
        HipSignReason::Shape => write!(f, "by the shape of the strides, with a mean of {mean_deg:.0} deg)"),
        HipSignReason::Converted(basis) => write!(f, "{})", converted(basis)),
    }?;
    match doubt {
        Some(HipSignDoubt::OtherShape) => f.write_str(
            ", but its strides have the shape of the other sign; those of a person who walks backwards may have it too",
        ),
        Some(HipSignDoubt::NoShape) => f.write_str(", but its strides do not have the shape of walking forwards"),
        None => Ok(()),
    }
}
