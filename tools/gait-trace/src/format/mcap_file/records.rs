//! Walks through the records of an MCAP file, also those in chunks.

use crate::fault::{Fault, TraceError};
use crate::format::mcap_file::chunk::Unpacker;
use crate::format::text_table::short;
use mcap::records::{Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, parse_record};

/// Why a walk ends early.
enum Stop {
    /// The bytes end within a record.
    Cut,
    Error(TraceError),
}

/// Calls `take` with each record that a reader of messages needs, and the number of bytes read. Returns whether the file ends without
/// an end record.
///
/// # Errors
/// The first fault of the file, with its place, or that of `take`.
pub fn records(
    name: &str,
    bytes: &[u8],
    mut take: impl FnMut(u64, Record<'_>) -> Result<(), TraceError>,
) -> Result<bool, TraceError> {
    let mut unpacker = Unpacker::default();
    let options = LinearReaderOptions::default().with_emit_chunks(true).with_record_length_limit(bytes.len());
    let end = walk(name, bytes, None, options, |at, record| match record {
        Record::Chunk { header, data } => {
            let fault = |what| TraceError::new(name, None, Fault::Mcap { offset: at, what });
            let records = unpacker.unpack(&header, &data).map_err(fault)?;
            let options = LinearReaderOptions::default()
                .with_emit_chunks(true)
                .with_skip_start_magic(true)
                .with_skip_end_magic(true)
                .with_record_length_limit(records.len());
            match walk(name, &records, Some(at), options, &mut take) {
                Err(Stop::Cut) => Err(fault("a chunk ends within a record; allowed are whole records".into())),
                Err(Stop::Error(error)) => Err(error),
                Ok(()) => Ok(()),
            }
        }
        record => take(at, record),
    });
    match end {
        Ok(()) => Ok(false),
        Err(Stop::Cut) => Ok(true),
        Err(Stop::Error(error)) => Err(error),
    }
}

/// Calls `take` with the records of a file, or of a chunk `inside` which that number of bytes was read.
fn walk(
    name: &str,
    bytes: &[u8],
    inside: Option<u64>,
    options: LinearReaderOptions,
    mut take: impl FnMut(u64, Record<'_>) -> Result<(), TraceError>,
) -> Result<(), Stop> {
    let mut reader = LinearReader::new_with_options(options);
    let mut given = 0;
    loop {
        let at = inside.unwrap_or(given as u64);
        let fault = |what| Err(Stop::Error(TraceError::new(name, None, Fault::Mcap { offset: at, what })));
        match reader.next_event() {
            None => return Ok(()),
            Some(Ok(LinearReadEvent::ReadRequest(wanted))) => {
                let rest = bytes.get(given..).unwrap_or_default();
                let more = wanted.min(rest.len());
                reader.insert(more)[..more].copy_from_slice(&rest[..more]);
                reader.notify_read(more);
                given += more;
            }
            // Others are not needed, and `parse_record` of mcap 0.26 panics on an attachment that is too short.
            Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                if matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE | op::METADATA | op::CHUNK) {
                    match parse_record(opcode, data) {
                        Ok(record) => take(at, record).map_err(Stop::Error)?,
                        Err(error) => return fault(words(&error)),
                    }
                }
            }
            Some(Err(McapError::UnexpectedEof)) => return Err(Stop::Cut),
            Some(Err(McapError::RecordTooLarge { .. } | McapError::ChunkTooLarge(_))) => {
                let whole = if inside.is_some() { "chunk" } else { "file" };
                let allowed = format!("allowed is up to the length of the {whole} (is it cut off?)");
                return fault(format!("a record is longer than the whole {whole}; {allowed}"));
            }
            Some(Err(error)) => return fault(words(&error)),
        }
    }
}

/// The text of a format error, with its cause.
fn words(error: &McapError) -> String {
    match error {
        McapError::Parse(why) => format!("a record cannot be parsed: {}", short(&why.to_string().replace('\n', " "))),
        McapError::Io(why) => format!("a record cannot be read: {why}"),
        error => error.to_string(),
    }
}
