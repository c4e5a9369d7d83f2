//! Why a recording cannot be conditioned: file, row, value and what is allowed.

use crate::clean::anatomy::Impossible;
use crate::clean::positive_direction::PositiveDirection;
use crate::clean::resample::MAX_SAMPLES;
use crate::clean::rules::{FEWEST_ROWS, MOST_CUT_OFF, MOST_DEG_S};
use crate::recording::RecordingError;
use joint_units::Joint;

/// Longest gap between two rows, seconds, in a recording that is shorter without it.
pub(crate) const LONGEST_GAP_S: f64 = 60.0;

/// The option that names the sign of a joint.
const fn option_of_sign(joint: Joint) -> &'static str {
    if matches!(joint, Joint::LeftHip | Joint::RightHip) { "--hip-sign" } else { "--knee-sign" }
}

/// Why a recording cannot be conditioned.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ConditionError {
    /// The file has no joint.
    #[error("{file}: no joint; allowed are 1 to 4 of left and right hip and knee")]
    NoJoints {
        /// The file.
        file: String,
    },
    /// There are too few rows.
    #[error("{file}: {rows} rows; allowed are {FEWEST_ROWS} or more")]
    TooFewRows {
        /// The file.
        file: String,
        /// Number of rows.
        rows: usize,
    },
    /// A joint has more or fewer values than there are times.
    #[error("{file}: {joint} has {found} values; allowed are {wanted}, one per time", joint = .joint.name())]
    Length {
        /// The file.
        file: String,
        /// The joint.
        joint: Joint,
        /// Number of its values.
        found: usize,
        /// Number of times.
        wanted: usize,
    },
    /// A time is not finite.
    #[error("{file}: row {row}: time {value} s; allowed is a finite number")]
    TimeNotFinite {
        /// The file.
        file: String,
        /// The row, counted from 1.
        row: usize,
        /// The time.
        value: f64,
    },
    /// The time decreases.
    #[error(
        "{file}: row {row}: time {value} s after {before} s; allowed are times that increase: {}", if *.begins_again { "the rows may be of several recordings, one below the other; split the file, choose the rows of one (`--where COLUMN=VALUE`), or correct the times if a clock began again" } else { "put the rows in order, or split the file if it has several recordings" }
    )]
    TimeOrder {
        /// The file.
        file: String,
        /// The row, counted from 1.
        row: usize,
        /// The time.
        value: f64,
        /// The time of the row before.
        before: f64,
        /// The time is near that of the first row.
        begins_again: bool,
    },
    /// Rows of several recordings are in one table.
    #[error(
        "{file}: the rows are of several recordings: {why}; allowed is one recording: split the file, or choose the rows of one (`--where COLUMN=VALUE`)"
    )]
    SeveralRecordings {
        /// The file.
        file: String,
        /// What shows it.
        why: String,
    },
    /// The time steps are too long for seconds.
    #[error(
        "{file}: the median time step is {step_s} s, too long for a gait ({likely}?); allowed are times in seconds, or a heading with the right unit, such as {heading}"
    )]
    TimeStep {
        /// The file.
        file: String,
        /// The median time step, seconds.
        step_s: f64,
        /// What the times probably are.
        likely: &'static str,
        /// The heading that says so.
        heading: &'static str,
    },
    /// The time runs as that of a normalised cycle, the ends differ, and the steps are too long for seconds.
    #[error(
        "{file}: the time runs from 0 to {length}, as percent of a cycle does, but the angles at its ends differ by {apart_deg:.1} degrees; its steps are too long for seconds; allowed is `--stride-time S`, which reads it as one stride of S seconds"
    )]
    OpenCycle {
        /// The file.
        file: String,
        /// Length of the time axis.
        length: f64,
        /// Largest difference of the ends, degrees.
        apart_deg: f64,
    },
    /// A gap between two rows is longer than the rest of the recording.
    #[error(
        "{file}: row {row}: time {value} s, {gap_s:.3} s after the row before, and all other rows last {rest_s:.3} s; allowed is a gap of up to {LONGEST_GAP_S} s or as long as the rest: correct the time stamp or delete the row, or split the file there"
    )]
    TimeGap {
        /// The file.
        file: String,
        /// The row, counted from 1.
        row: usize,
        /// Its time.
        value: f64,
        /// Length of the gap before it, seconds.
        gap_s: f64,
        /// Length of the recording without the gap, seconds.
        rest_s: f64,
    },
    /// There would be more samples than the limit; usually a time is wrong.
    #[error("{file}: {duration_s} s at {rate_hz} Hz; allowed are up to {MAX_SAMPLES} samples: is a time stamp wrong?")]
    TooLong {
        /// The file.
        file: String,
        /// Time from the first row to the last, seconds.
        duration_s: f64,
        /// Rate of the time steps, Hz.
        rate_hz: f64,
    },
    /// No joint moves enough: the values are radians, or the person stands.
    #[error(
        "{file}: no joint moves by more than {range:.2} degrees; allowed is {least} degrees or more: if the values are radians, use `--unit radians`"
    )]
    Radians {
        /// The file.
        file: String,
        /// Range of the joint that moves most, degrees.
        range: f64,
        /// Smallest allowed range, degrees.
        least: f64,
    },
    /// The unit is inferred from the values, and the gait would be none.
    #[error(
        "{file}: the unit of the angles is not stated; read as {unit}, which the values imply, the {what} by only {range:.1} degrees, too little for a gait; allowed are a heading with the unit (`left_knee_deg`), `--unit degrees|radians` to confirm it, or `--calibration FILE` for volts"
    )]
    UnitNotStated {
        /// The file.
        file: String,
        /// The unit that was inferred.
        unit: &'static str,
        /// The joints, and that they move or bend.
        what: &'static str,
        /// How far, degrees.
        range: f64,
    },
    /// Nearly all of a joint is gaps and jumps.
    #[error(
        "{file}: {joint} has {values} usable values between gaps and jumps; allowed are {FEWEST_ROWS} or more",
        joint = .joint.name()
    )]
    TooFewValues {
        /// The file.
        file: String,
        /// The joint.
        joint: Joint,
        /// Number of its usable values.
        values: usize,
    },
    /// A joint turns back in corners at a bound.
    #[error(
        "{file}: {joint} turns back in a corner at {at_deg} degrees in {corners} places ({from_s:.3} s to {to_s:.3} s): the angle was folded there, as |angle| or the smaller of two angles is; allowed are angles with their sign: export them again, without the absolute value",
        joint = .joint.name()
    )]
    Folded {
        /// The file.
        file: String,
        /// The joint.
        joint: Joint,
        /// The angle at which it turns back, degrees.
        at_deg: f64,
        /// Number of places.
        corners: usize,
        /// The first of them, seconds.
        from_s: f64,
        /// The last of them, seconds.
        to_s: f64,
    },
    /// The numbers of a left joint are those of the right one.
    #[error(
        "{file}: {left} and {right} have the same numbers in every row; allowed are the angles of both legs: one leg may be exported twice, or `--map` may name one column for both",
        left = .left.name(), right = Joint::ALL[(*left as usize + 1) % Joint::COUNT].name()
    )]
    SameLeg {
        /// The file.
        file: String,
        /// The left joint.
        left: Joint,
    },
    /// A joint has an angle that no person has.
    #[error(
        "{file}: {joint} {what} {found:.1} degrees with flexion positive, which no person has; allowed are {least} to {most}: {named}is the column or its unit another one, or is the zero of the angle not that of an upright stand?{hint}",
        hint = if .named.is_none() && .impossible.found_deg < 0.0 {
            format!(" If the file counts extension as positive, `{} extension` says so.", option_of_sign(.impossible.joint))
        } else {
            String::new()
        },
        named = .named.map_or(String::new(), |sign| format!(
            "is the sign another one than `{} {}`, ", option_of_sign(.impossible.joint), sign.name()
        )),
        joint = .impossible.joint.name(), what = .impossible.what, found = .impossible.found_deg,
        least = .impossible.allowed_deg.0, most = .impossible.allowed_deg.1
    )]
    Impossible {
        /// The file.
        file: String,
        /// The joint and its angle.
        impossible: Impossible,
        /// The sign of the joint that the caller named.
        named: Option<PositiveDirection>,
    },
    /// The sign of the knees does not follow from their angles.
    #[error(
        "{file}: it is unclear whether flexion or extension of the knees is positive ({least_deg:.1} to {most_deg:.1} deg); allowed is `--knee-sign flexion` or `--knee-sign extension`"
    )]
    KneeSign {
        /// The file.
        file: String,
        /// Smallest angle of the knees, degrees.
        least_deg: f64,
        /// Largest angle of the knees, degrees.
        most_deg: f64,
    },
    /// The knees are interior angles.
    #[error(
        "{file}: the knees are at {least_deg:.1} to {most_deg:.1} deg, as the angle between thigh and shank is, of which a straight leg has 180; no sign makes that flexion; allowed are angles of flexion, 0 for a straight leg: subtract the angles from 180 first"
    )]
    InteriorKnees {
        /// The file.
        file: String,
        /// Smallest angle of the knees, degrees.
        least_deg: f64,
        /// Largest angle of the knees, degrees.
        most_deg: f64,
    },
    /// The joints move faster than a leg can: the times are wrong.
    #[error(
        "{file}: {joint} moves at {deg_s:.0} degrees a second for a quarter of the time, and all rows last {duration_s:.4} s: no leg is that fast, of which {most:.0} are allowed; are the times in another unit ({likely}?); allowed are times in seconds under `time_s`, or in milliseconds under `time_ms`",
        joint = .joint.name(), most = MOST_DEG_S
    )]
    TooFast {
        /// The file.
        file: String,
        /// The joint.
        joint: Joint,
        /// Its speed, degrees a second.
        deg_s: f64,
        /// Duration of the recording, seconds.
        duration_s: f64,
        /// What the times probably are.
        likely: &'static str,
    },
    /// The legs of a cycle are in phase.
    #[error(
        "{file}: the curves of one cycle have left and right {part} in phase, as where each leg counts from its own contact, or where one leg was exported twice; allowed is `--own-cycles`, which moves the right leg by half of the cycle, or curves of both legs from one contact"
    )]
    LegsInPhase {
        /// The file.
        file: String,
        /// The joints that show it.
        part: &'static str,
    },
    /// The right leg is to be moved, and should not be.
    #[error(
        "{file}: `--own-cycles` is for curves of one cycle in which each leg counts from its own contact, but {why}; allowed is without it"
    )]
    NoOwnCycles {
        /// The file.
        file: String,
        /// Why.
        why: &'static str,
    },
    /// The missing leg cannot be made from the other one.
    #[error(
        "{file}: `--mirror`: {why}; allowed is a recording of hip or knee of one leg that repeats, or without `--mirror`"
    )]
    NoMirror {
        /// The file.
        file: String,
        /// Why.
        why: &'static str,
    },
    /// The duration of a stride is given and the time axis is not a cycle.
    #[error(
        "{file}: the duration of a stride is given (`--stride-time`), but the time runs from {start} to {end}; allowed is a cycle, from 0 to 1 or from 0 to 100, or without `--stride-time`"
    )]
    NoCycle {
        /// The file.
        file: String,
        /// First time.
        start: f64,
        /// Last time.
        end: f64,
    },
    /// The requested cut-off does not fit the rate.
    #[error(
        "{file}: low-pass at {hz} Hz; allowed is above 0 and below {most:.1} Hz, {MOST_CUT_OFF} of the rate, or `--low-pass off`"
    )]
    LowPass {
        /// The file.
        file: String,
        /// The requested cut-off, Hz.
        hz: f64,
        /// The limit, Hz.
        most: f64,
    },
    /// The result is not a valid table.
    #[error("{file}: {source}")]
    Table {
        /// The file.
        file: String,
        /// The rule that it breaks.
        source: RecordingError,
    },
}
