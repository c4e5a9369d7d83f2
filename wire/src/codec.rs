//! Encodes records as bytes and decodes them.

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::{
    Answered, Boot, Change, Conditions, Cost, Edge, Environment, Frame, Inputs, Port, Refused, Settings, VERSION,
};

/// Bytes of the longest record: [`Inputs`] of ten calls with four sensors, a measurement and a request each.
pub const MAX_BYTES: usize = 357;

/// A record: its kind, one byte, then its fields in the order of their declaration. The order of the kinds is part of the version,
/// so a further kind is a new version: a host must know every one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[expect(
    clippy::large_enum_variant,
    reason = "one record at a time exists, and without an allocator nothing can be boxed"
)]
pub enum Record {
    /// The board, its image and its parameters, after a reset. Kind 0 in every version.
    Boot(Boot),
    /// Something is refused.
    Refused(Refused),
    /// The supervisor changed its state.
    Change(Change),
    /// The inputs of every call of the loop, ten calls in one record.
    Inputs(Inputs),
    /// What a tick measured and commanded, every tenth tick.
    Frame(Frame),
    /// An edge at the synchronisation input.
    Edge(Edge),
    /// Load and reserves, once a second.
    Cost(Cost),
    /// Conditions of the chip, once a second.
    Environment(Environment),
    /// The loop answers a request.
    Answered(Answered),
    /// Counters of the serial port, once a second.
    Port(Port),
    /// The settings in effect, once a second and after a change.
    Settings(Settings),
    /// What was not as it should be, counted since the boot, once a second.
    Conditions(Conditions),
}

/// The kind of a record: its first byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Kind {
    /// [`Record::Boot`].
    Boot = 0,
    /// [`Record::Refused`].
    Refused = 1,
    /// [`Record::Change`].
    Change = 2,
    /// [`Record::Inputs`].
    Inputs = 3,
    /// [`Record::Frame`].
    Frame = 4,
    /// [`Record::Edge`].
    Edge = 5,
    /// [`Record::Cost`].
    Cost = 6,
    /// [`Record::Environment`].
    Environment = 7,
    /// [`Record::Answered`].
    Answered = 8,
    /// [`Record::Port`].
    Port = 9,
    /// [`Record::Settings`].
    Settings = 10,
    /// [`Record::Conditions`].
    Conditions = 11,
}

impl Kind {
    /// Every kind, in order of its number.
    pub const ALL: [Self; 12] = [
        Self::Boot,
        Self::Refused,
        Self::Change,
        Self::Inputs,
        Self::Frame,
        Self::Edge,
        Self::Cost,
        Self::Environment,
        Self::Answered,
        Self::Port,
        Self::Settings,
        Self::Conditions,
    ];

    /// The word for it in messages.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Boot => "boot",
            Self::Refused => "refused",
            Self::Change => "change",
            Self::Inputs => "inputs",
            Self::Frame => "frame",
            Self::Edge => "edge",
            Self::Cost => "cost",
            Self::Environment => "environment",
            Self::Answered => "answered",
            Self::Port => "port",
            Self::Settings => "settings",
            Self::Conditions => "conditions",
        }
    }
}

impl Record {
    /// Its kind.
    #[must_use]
    pub const fn kind(&self) -> Kind {
        match self {
            Self::Boot(_) => Kind::Boot,
            Self::Refused(_) => Kind::Refused,
            Self::Change(_) => Kind::Change,
            Self::Inputs(_) => Kind::Inputs,
            Self::Frame(_) => Kind::Frame,
            Self::Edge(_) => Kind::Edge,
            Self::Cost(_) => Kind::Cost,
            Self::Environment(_) => Kind::Environment,
            Self::Answered(_) => Kind::Answered,
            Self::Port(_) => Kind::Port,
            Self::Settings(_) => Kind::Settings,
            Self::Conditions(_) => Kind::Conditions,
        }
    }
}

/// Why bytes are not a record of this version.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum DecodeError {
    /// There are no bytes.
    Empty,
    /// The board's image was built with another version of this crate. None of its records can be read.
    Version {
        /// Version of the board.
        board: u16,
    },
    /// This version has no such kind.
    Kind {
        /// The first byte.
        kind: u8,
        /// Number of bytes, the first one included.
        length: usize,
    },
    /// The bytes end inside a field.
    Truncated {
        /// Kind of the record.
        kind: Kind,
        /// Bytes that there are.
        length: usize,
    },
    /// A field holds a value that it cannot have.
    Value {
        /// Kind of the record.
        kind: Kind,
        /// Bytes that there are.
        length: usize,
    },
    /// There are more bytes than the record has.
    Trailing {
        /// Kind of the record.
        kind: Kind,
        /// Bytes that there are.
        length: usize,
        /// Bytes of the record.
        record: usize,
    },
}

impl fmt::Display for DecodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Empty => write!(f, "record of 0 bytes; allowed are 1 to {MAX_BYTES}"),
            Self::Version { board } => write!(
                f,
                "the board sends records of version {board}, this program reads version {VERSION}: flash the image of this checkout, or \
                 use the `footfall` of the checkout that the board's image was built from"
            ),
            Self::Kind { kind, length } => {
                write!(f, "unknown record kind {kind} ({length} bytes); version {VERSION} has the kinds")?;
                for known in Kind::ALL {
                    write!(f, " {} {}{}", known as u8, known.name(), if known == Kind::Conditions { "" } else { "," })?;
                }
                Ok(())
            }
            Self::Truncated { kind, length } => write!(
                f,
                "{} record ends inside a field after {length} bytes; allowed is a whole record of version {VERSION}",
                kind.name()
            ),
            Self::Value { kind, length } => write!(
                f,
                "{} record of {length} bytes holds a value that no field of version {VERSION} can have",
                kind.name()
            ),
            Self::Trailing { kind, length, record } => {
                write!(
                    f,
                    "{} record of {length} bytes; this one ends after {record}, allowed is nothing behind it",
                    kind.name()
                )
            }
        }
    }
}

impl core::error::Error for DecodeError {}

/// Encodes a record into a buffer and returns the written part. A buffer of [`MAX_BYTES`] is enough for every record; `None` if a shorter one
/// is not.
///
/// ```
/// use wire::{Edge, MAX_BYTES, Record, decode, encode};
/// let record = Record::Edge(Edge { tick: 7, offset_us: -3, high: true, lost_before: false });
/// let mut buffer = [0; MAX_BYTES];
/// let bytes = encode(&record, &mut buffer).unwrap();
/// assert_eq!(bytes, [5, 7, 5, 1, 0]);
/// assert_eq!(decode(bytes), Ok(record));
/// ```
pub fn encode<'b>(record: &Record, buffer: &'b mut [u8]) -> Option<&'b [u8]> {
    postcard::to_slice(record, buffer).ok().map(|written| &*written)
}

/// Decodes a record; the bytes must be exactly one record.
///
/// # Errors
/// [`DecodeError`]. A boot record of another version gives [`DecodeError::Version`], whatever its other fields are.
pub fn decode(bytes: &[u8]) -> Result<Record, DecodeError> {
    let (&first, fields) = bytes.split_first().ok_or(DecodeError::Empty)?;
    let length = bytes.len();
    let kind = Kind::ALL.get(usize::from(first)).copied().ok_or(DecodeError::Kind { kind: first, length })?;
    let why = |error| match error {
        postcard::Error::DeserializeUnexpectedEnd => DecodeError::Truncated { kind, length },
        _ => DecodeError::Value { kind, length },
    };
    if kind == Kind::Boot {
        let (board, _) = postcard::take_from_bytes::<u16>(fields).map_err(why)?;
        if board != VERSION {
            return Err(DecodeError::Version { board });
        }
    }
    let (record, rest) = postcard::take_from_bytes::<Record>(bytes).map_err(why)?;
    if rest.is_empty() { Ok(record) } else { Err(DecodeError::Trailing { kind, length, record: length - rest.len() }) }
}
