//! What can be wrong with a recording's file: which file, which line, which column, what was found and what is allowed.

use crate::recording::{Quantity, RecordingError};
use std::fmt;

/// What is wrong. The text of each says what is allowed.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    /// The file cannot be opened or read.
    #[error("cannot be read: {0}")]
    Io(#[source] std::io::Error),
    /// More bytes than any recording has.
    #[error("is larger than {most} bytes; allowed is up to that")]
    TooLarge {
        /// The limit.
        most: u64,
    },
    /// Bytes that are no text.
    #[error("is not text (byte {byte:#04x}); allowed is UTF-8 text: comma-separated values")]
    NotText {
        /// The first such byte.
        byte: u8,
    },
    /// No line at all.
    #[error("is empty; allowed is a header `time_s,left_knee_deg,...` and rows of numbers below it")]
    Empty,
    /// Too few rows below the header.
    #[error("{rows} rows of numbers; allowed are 2 or more")]
    TooFewRows {
        /// How many there are.
        rows: usize,
    },
    /// The header has no such column.
    #[error(
        "column `{wanted}` is missing{hint}; allowed is a header such as `time_s,left_hip_deg,right_hip_deg,left_knee_deg,right_knee_deg`"
    )]
    MissingColumn {
        /// What is missing.
        wanted: &'static str,
        /// What may be the cause.
        hint: &'static str,
    },
    /// Nothing but a time column.
    #[error("no channel beside `time_s`; allowed are 1 or more, such as `left_knee_deg`")]
    NoChannels,
    /// A heading that says neither joint angle nor pin.
    #[error(
        "unknown heading; allowed are `time_s`, angles in degrees such as `left_knee_deg`, and volts at a pin such as `PA1`"
    )]
    UnknownColumn,
    /// A heading that is there twice.
    #[error("the heading is there twice; allowed is once")]
    DuplicateColumn,
    /// A row with more or fewer fields than the header.
    #[error("{found} fields; allowed are {wanted}, as in the header")]
    FieldCount {
        /// How many there are.
        found: usize,
        /// How many headings there are.
        wanted: usize,
    },
    /// A field that is no number.
    #[error("`{text}` is not a number; allowed is a decimal number such as -12.5")]
    NotANumber {
        /// The field.
        text: String,
    },
    /// A field that is not finite.
    #[error("`{text}` is not finite; allowed is a decimal number such as -12.5")]
    NotFinite {
        /// The field.
        text: String,
    },
    /// A number that is so large that the unit must be wrong.
    #[error("{value} {unit}: wrong unit? allowed is {least} to {most} {unit}", unit = .quantity.unit(), least = .quantity.allowed().0, most = .quantity.allowed().1)]
    Magnitude {
        /// The number.
        value: f64,
        /// What it should be.
        quantity: Quantity,
    },
    /// The table as a whole breaks a rule.
    #[error("{0}")]
    Table(#[source] RecordingError),
    /// A time that is not after the one before.
    #[error("time {value} s after {before} s; allowed is a later time in each row")]
    TimeOrder {
        /// The time.
        value: f64,
        /// The time of the row before.
        before: f64,
    },
    /// Bytes that are no text, with their place in the file.
    #[error("byte {byte:#04x} at offset {offset} is not text{hint}; allowed is UTF-8 text")]
    Bytes {
        /// The first such byte.
        byte: u8,
        /// Where it is, counted from 0.
        offset: usize,
        /// What the file may be instead.
        hint: &'static str,
    },
    /// Content that no reader knows.
    #[error(
        "is of no known format: {why}; allowed are CSV, OpenSim .mot and .sto, C3D, MCAP, and CSV exports of Rigol, Siglent, Tektronix and Keysight oscilloscopes"
    )]
    UnknownFormat {
        /// What was seen.
        why: String,
    },
    /// A header announces something that is not what follows.
    #[error(
        "`{field}` promises {promised}, found {found}: truncated, or two files in one? allowed is what is promised"
    )]
    Promised {
        /// The header's word.
        field: String,
        /// What it says.
        promised: String,
        /// What there is.
        found: String,
    },
    /// A field of a header that cannot be used.
    #[error("`{field}` is {found}; allowed is {allowed}")]
    HeaderField {
        /// The field.
        field: String,
        /// What it says.
        found: String,
        /// What it may say.
        allowed: String,
    },
    /// A field of a binary file that cannot be used.
    #[error("byte {offset}: {field} is {found}; allowed is {allowed}")]
    Binary {
        /// Where, counted from 0.
        offset: usize,
        /// The field.
        field: String,
        /// What it says.
        found: String,
        /// What it may say.
        allowed: String,
    },
    /// A record of an MCAP file that cannot be used.
    #[error("up to byte {offset}: {what}")]
    Mcap {
        /// How far the file was read.
        offset: u64,
        /// What is wrong, and what is allowed.
        what: String,
    },
    /// A quote that opens and does not close on its line.
    #[error("a quote opens and does not close on this line; allowed are pairs of \"")]
    OpenQuote,
    /// A line that no table has.
    #[error("a line of {bytes} bytes; allowed are up to {most}")]
    LongLine {
        /// Its length.
        bytes: usize,
        /// The limit.
        most: usize,
    },
    /// More rows than any recording has.
    #[error("more than {most} rows; allowed are up to that: cut the recording, or thin it out")]
    TooManyRows {
        /// The limit.
        most: usize,
    },
    /// More columns than any recording has.
    #[error("{found} columns; allowed are up to {most}")]
    TooManyColumns {
        /// How many there are.
        found: usize,
        /// The limit.
        most: usize,
    },
    /// The header again, below rows of numbers.
    #[error("a second header; allowed is one, at the top: are these two recordings in one file?")]
    SecondHeader,
    /// No column can be taken for the time.
    #[error(
        "no column is the time{hint}; the columns are {have}; allowed is one called `time`, `time_s`, `t`, `Time (s)` or `time_ms`, or `--map time=COLUMN`"
    )]
    NoTime {
        /// What there is.
        have: String,
        /// What may be the cause.
        hint: &'static str,
    },
    /// No column can be taken for a joint.
    #[error(
        "no column is a joint; there are {have}; allowed are names such as `left_hip_deg`, `hip_flexion_l`, `LKneeAngles`, or `--map left_hip=COLUMN,...`"
    )]
    NoJoints {
        /// What there is.
        have: String,
    },
    /// The map names a column that is not there.
    #[error(
        "the map takes `{joint}` from `{wanted}`; the file has {have}; allowed is one of these, or its number from 1"
    )]
    MapColumn {
        /// The joint, or `time`.
        joint: &'static str,
        /// What was asked for.
        wanted: String,
        /// What there is.
        have: String,
    },
    /// Two columns for one joint.
    #[error("`{first}` and `{second}` both look like `{joint}`; allowed is one: choose with `--map {joint}=COLUMN`")]
    TwoColumns {
        /// The joint, or `time`.
        joint: &'static str,
        /// The one.
        first: String,
        /// The other.
        second: String,
    },
    /// Nothing says whether the angles are degrees or radians.
    #[error(
        "the unit of the angles is not said{why}; allowed are a suffix `_deg` or `_rad`, `[deg]` or `(rad)`, or `--unit degrees|radians`"
    )]
    NoUnit {
        /// Why the numbers do not tell.
        why: String,
    },
    /// The unit that the file names does not fit its numbers.
    #[error(
        "the file says {said}, but no angle in {values} values is beyond {largest:.3}: radians? allowed is `--unit degrees|radians` to say which"
    )]
    UnitDoubt {
        /// What the file says.
        said: &'static str,
        /// How many numbers there are.
        values: usize,
        /// The largest of them.
        largest: f64,
    },
    /// The time's steps are those of another unit.
    #[error("the time's median step is {step}: milliseconds? allowed is to name the column `time_ms` or `time_s`")]
    TimeUnit {
        /// The median step.
        step: f64,
    },
    /// Volts without a table that makes angles of them.
    #[error("`{channel}` is in volts; allowed is with a calibration table (`--calibration`) that makes angles of them")]
    NoCalibration {
        /// The channel.
        channel: String,
    },
    /// Channels of an oscilloscope of which nothing says which joint they are.
    #[error("nothing says which joint a channel is; the file has {have}; allowed is `--map left_knee=CHANNEL,...`")]
    NoChannelMap {
        /// What there is.
        have: String,
    },
    /// A column without a single number.
    #[error("no row has a number; allowed are some gaps, not nothing but gaps")]
    NoValues,
    /// A C3D file without what angles can be made of.
    #[error(
        "neither joint angles nor joint centres: the points are {have}; allowed are angles such as `LHipAngles`, `LKneeAngles`, or trajectories of hip, knee and ankle such as `LHJC`, `LKJC`, `LAJC`"
    )]
    NoTrajectories {
        /// What there is.
        have: String,
    },
    /// Trajectories from which up or forward cannot be told.
    #[error("{what} cannot be told from the trajectories; allowed are {allowed}")]
    NoFrameOfReference {
        /// Up, or forward.
        what: &'static str,
        /// What would do.
        allowed: &'static str,
    },
}

/// A [`Fault`] and where it is.
#[derive(Debug)]
pub struct TraceError {
    /// The file, as the caller named it.
    pub file: String,
    /// The line, counted from 1.
    pub line: Option<u64>,
    /// The column, counted from 1, and its heading.
    pub column: Option<(usize, String)>,
    /// What is wrong.
    pub fault: Box<Fault>,
}

impl TraceError {
    pub(crate) fn new(file: &str, line: Option<u64>, fault: Fault) -> Self {
        Self { file: file.into(), line, column: None, fault: Box::new(fault) }
    }

    pub(crate) fn in_column(mut self, index: usize, heading: &str) -> Self {
        // A heading may be as long as its line; an error is for reading.
        self.column = Some((index + 1, heading.chars().take(80).collect()));
        self
    }
}

impl fmt::Display for TraceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.file)?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        f.write_str(": ")?;
        if let Some((index, heading)) = &self.column {
            write!(f, "column {index} `{heading}`: ")?;
        }
        self.fault.fmt(f)
    }
}

impl std::error::Error for TraceError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match &*self.fault {
            Fault::Io(error) => Some(error),
            Fault::Table(error) => Some(error),
            _ => None,
        }
    }
}
