//! Records of the board's log: [`wire::Record`], found in the text that `defmt` prints.

use wire::{DecodeError, Record, TextError, bytes_in, decode};

/// A line that should be a record and is none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum RecordError {
    /// The line is damaged.
    #[error(transparent)]
    Text(#[from] TextError),
    /// The bytes are no record of this version.
    #[error(transparent)]
    Bytes(#[from] DecodeError),
}

/// The record in a line of the log; `None` in a line for people.
///
/// ```
/// use footfall::board::telemetry::record_in;
/// use wire::{Edge, Record};
/// let edge = Record::Edge(Edge { tick: 7, offset_us: -3, high: true, lost_before: false });
/// assert_eq!(record_in("wire [05, 07, 05, 01, 00]"), Some(Ok(edge)));
/// assert_eq!(record_in("disarmed, cause none"), None);
/// let error = record_in("wire [05, 07]").unwrap().unwrap_err();
/// assert!(error.to_string().starts_with("edge record ends inside a field after 2 bytes"));
/// ```
#[must_use]
pub fn record_in(line: &str) -> Option<Result<Record, RecordError>> {
    let bytes = bytes_in(line)?;
    Some(bytes.map_err(RecordError::from).and_then(|bytes| Ok(decode(&bytes)?)))
}

/// A record as `defmt` prints it.
#[must_use]
pub fn printed(record: &Record) -> String {
    let mut buffer = [0; wire::MAX_BYTES];
    let bytes = wire::encode(record, &mut buffer).unwrap_or_default();
    let bytes: Vec<String> = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    format!("wire [{}]", bytes.join(", "))
}
