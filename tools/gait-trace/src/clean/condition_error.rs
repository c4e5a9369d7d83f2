//! Why a recording cannot be conditioned: file, row, value and what is allowed.

use crate::clean::resample::MAX_SAMPLES;
use crate::clean::rules::{FEWEST_ROWS, MOST_CUT_OFF};
use crate::recording::RecordingError;
use joint_units::Joint;

/// Why a recording cannot be conditioned.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ConditionError {
    /// No joint at all.
    #[error("{file}: no joint; allowed are 1 to 4 of left and right hip and knee")]
    NoJoints {
        /// The file.
        file: String,
    },
    /// Too few rows.
    #[error("{file}: {rows} rows; allowed are {FEWEST_ROWS} or more")]
    TooFewRows {
        /// The file.
        file: String,
        /// How many there are.
        rows: usize,
    },
    /// A joint with more or fewer values than there are times.
    #[error("{file}: {joint} has {found} values; allowed are {wanted}, one a time", joint = .joint.name())]
    Length {
        /// The file.
        file: String,
        /// The joint.
        joint: Joint,
        /// Its values.
        found: usize,
        /// The times.
        wanted: usize,
    },
    /// A time that is not finite.
    #[error("{file}: row {row}: time {value} s; allowed is a finite number")]
    TimeNotFinite {
        /// The file.
        file: String,
        /// The row, counted from 1.
        row: usize,
        /// The time.
        value: f64,
    },
    /// Time runs backwards.
    #[error("{file}: row {row}: time {value} s after {before} s; allowed are times that increase")]
    TimeOrder {
        /// The file.
        file: String,
        /// The row, counted from 1.
        row: usize,
        /// The time.
        value: f64,
        /// The time of the row before.
        before: f64,
    },
    /// More samples than any recording has: a time is wrong.
    #[error("{file}: {duration_s} s at {rate_hz} Hz; allowed are {MAX_SAMPLES} samples: is a time stamp wrong?")]
    TooLong {
        /// The file.
        file: String,
        /// From the first row to the last.
        duration_s: f64,
        /// The rate that the steps have.
        rate_hz: f64,
    },
    /// Numbers of angles in radians where degrees were promised, or nobody moves.
    #[error(
        "{file}: no joint moves by more than {range:.2} degrees; are these radians, or does nobody walk? Allowed is {least} degrees or more"
    )]
    Radians {
        /// The file.
        file: String,
        /// Range of the joint that moves most.
        range: f64,
        /// Least range.
        least: f64,
    },
    /// Most of a joint is gaps and jumps.
    #[error("{file}: {share:.0} % of {joint} cannot be used (gaps and jumps too long to bridge); allowed is {most:.0} %", share = 100.0 * .share, joint = .joint.name(), most = 100.0 * .most)]
    MostlyUnusable {
        /// The file.
        file: String,
        /// The joint.
        joint: Joint,
        /// The share of the time.
        share: f64,
        /// The largest that is allowed.
        most: f64,
    },
    /// The cut-off asked for makes no sense at this rate.
    #[error("{file}: low-pass at {hz} Hz; allowed is above 0 and below {most:.0} Hz, {MOST_CUT_OFF} of the rate")]
    LowPass {
        /// The file.
        file: String,
        /// What was asked for.
        hz: f64,
        /// The limit.
        most: f64,
    },
    /// The table that came out is none.
    #[error("{file}: {source}")]
    Table {
        /// The file.
        file: String,
        /// Why.
        source: RecordingError,
    },
}
