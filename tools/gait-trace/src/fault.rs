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
        self.column = Some((index + 1, heading.into()));
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
