//! Reads and writes recordings in the project's own CSV.
//!
//! The first line is the header: `time_s`, then angles in degrees (`left_hip_deg`, `right_hip_deg`, `left_knee_deg`,
//! `right_knee_deg`, or any of them, or `knee_deg` alone) or volts at a pin (`PA1`), in any order. Each row below it is a sample.
//! Lines may end in LF or CR LF; a byte order mark before the header, quotes around a heading, blanks around a field and blank
//! lines are ignored.
//! Comments, lines that begin with `#`, may be above the header: `footfall convert` writes there what it did.
//! Everything else is refused: the reader guesses nothing, fills no gap and drops no row.

use crate::fault::{Fault, TraceError};
use crate::format::text_table::is_missing;
use crate::format::whole_file;
use crate::recording::{Channel, Recording, RecordingError};
use std::io::{self, Read, Write};
use std::path::Path;

/// Largest size of a file, bytes: an hour of five channels at 1 kHz has about 160 million.
pub const MAX_BYTES: u64 = 256 << 20;

const TIME: &str = "time_s";

/// Reads a file.
///
/// # Errors
/// The first fault of the file, with line and column.
pub fn read(path: &Path) -> Result<Recording, TraceError> {
    let name = path.display().to_string();
    let file = std::fs::File::open(path).map_err(|error| TraceError::new(&name, None, Fault::Io(error)))?;
    parse(&name, file)
}

/// Reads the text of a file; `name` is the name in errors.
///
/// # Errors
/// As [`read`].
pub fn parse(name: &str, source: impl Read) -> Result<Recording, TraceError> {
    let text = text_of(name, source)?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    // A table of numbers needs no quotes, so each line is a row.
    let rows = (1_u64..).zip(text.lines()).filter(|(_, row)| !row.trim().is_empty());
    let mut rows = rows.skip_while(|(_, row)| row.starts_with('#'));
    let (line, row) = rows.next().ok_or_else(|| TraceError::new(name, None, Fault::Empty))?;
    let header = Header::parse(name, line, row)?;
    let mut time_s: Vec<f64> = Vec::new();
    let mut values = vec![Vec::new(); header.channels.len()];
    let mut last_line = line;
    for (line, row) in rows {
        last_line = line;
        let fields: Vec<&str> = fields(row).collect();
        let fault = |fault| TraceError::new(name, Some(line), fault);
        if fields.len() != header.headings.len() {
            return Err(fault(Fault::FieldCount { found: fields.len(), wanted: header.headings.len() }));
        }
        let at = |column: usize, f: Fault| fault(f).in_column(column, &header.headings[column]);
        let number = |column: usize| number(fields[column]).map_err(|fault| at(column, fault));

        let time = number(header.time)?;
        if let Some(&before) = time_s.last()
            && time <= before
        {
            return Err(at(header.time, Fault::TimeOrder { value: time, before }));
        }
        time_s.push(time);
        for ((column, channel), values) in header.channels.iter().zip(&mut values) {
            let value = number(*column)?;
            let quantity = channel.quantity();
            let (least, most) = quantity.allowed();
            if value < least || value > most {
                return Err(at(*column, Fault::Magnitude { value, quantity }));
            }
            values.push(value);
        }
    }
    let channels = header.channels.into_iter().zip(values);
    let channels =
        channels.map(|((_, channel), values)| Channel::new(channel.name(), channel.quantity(), values)).collect();
    let rows = time_s.len();
    Recording::build(time_s, channels).map_err(|error| match error {
        RecordingError::TooFewRows { .. } => TraceError::new(name, Some(last_line), Fault::TooFewRows { rows }),
        // The rules of single rows were checked above, where the line is known.
        other => TraceError::new(name, None, Fault::Table(other)),
    })
}

/// The parsed header.
struct Header {
    headings: Vec<String>,
    /// Index of the time column.
    time: usize,
    /// Index of each other column, and its channel without values.
    channels: Vec<(usize, Channel)>,
}

impl Header {
    fn parse(name: &str, line: u64, row: &str) -> Result<Self, TraceError> {
        let fault = |fault| TraceError::new(name, Some(line), fault);
        let headings: Vec<String> = fields(row).map(|heading| unquoted(heading).to_owned()).collect();
        let Some(time) = headings.iter().position(|heading| heading == TIME) else {
            let one = headings.len() == 1;
            let hint = match headings.first() {
                Some(first) if one && first.contains(';') => " (the fields are separated by `;`; use `,`)",
                Some(first) if one && first.contains('\t') => " (the fields are separated by tabs; use `,`)",
                Some(first) if number(first).is_ok() => " (the first line is a row of numbers, not a header)",
                _ => "",
            };
            return Err(fault(Fault::MissingColumn { wanted: TIME, hint }));
        };
        let mut channels: Vec<(usize, Channel)> = Vec::new();
        for (index, heading) in headings.iter().enumerate() {
            let at = |f: Fault| fault(f).in_column(index, heading);
            if headings[..index].contains(heading) {
                return Err(at(Fault::DuplicateColumn));
            }
            if index != time {
                let (channel, quantity) = Channel::of_column(heading).ok_or_else(|| at(Fault::UnknownColumn))?;
                channels.push((index, Channel::new(channel, quantity, Vec::new())));
            }
        }
        if channels.is_empty() {
            return Err(fault(Fault::NoChannels));
        }
        Ok(Self { headings, time, channels })
    }
}

/// The fields of a row, without surrounding blanks.
fn fields(row: &str) -> impl Iterator<Item = &str> {
    row.split(',').map(str::trim)
}

/// A heading without surrounding quotes.
fn unquoted(heading: &str) -> &str {
    heading.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')).unwrap_or(heading)
}

/// Whether a file is refused here because a value is missing, which the readers of other programs' files take.
#[must_use]
pub fn is_missing_value(fault: &Fault) -> bool {
    matches!(fault, Fault::NotANumber { text } | Fault::NotFinite { text } if is_missing(text.trim()))
}

/// The source as text.
fn text_of(name: &str, source: impl Read) -> Result<String, TraceError> {
    let fault = |fault| TraceError::new(name, None, fault);
    let mut bytes = Vec::new();
    source.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(|error| fault(Fault::Io(error)))?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(fault(Fault::TooLarge { most: MAX_BYTES }));
    }
    let valid = match std::str::from_utf8(&bytes) {
        Ok(_) => bytes.len(),
        Err(error) => error.valid_up_to(),
    };
    let control = |byte: &u8| byte.is_ascii_control() && !matches!(byte, b'\n' | b'\r' | b'\t');
    let bad = bytes[..valid].iter().position(control).unwrap_or(valid);
    if let Some(&byte) = bytes.get(bad) {
        let line = 1 + bytes[..bad].iter().filter(|&&byte| byte == b'\n').count() as u64;
        return Err(TraceError::new(name, Some(line), Fault::NotText { byte }));
    }
    String::from_utf8(bytes).map_err(|error| fault(Fault::Io(io::Error::other(error))))
}

fn number(text: &str) -> Result<f64, Fault> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        // `1e999` and `inf` parse as infinity.
        Ok(_) => Err(Fault::NotFinite { text: text.into() }),
        Err(_) => Err(Fault::NotANumber { text: text.chars().take(40).collect() }),
    }
}

/// Writes a file completely or not at all. Reading it gives the same bits.
///
/// # Errors
/// The file cannot be written; an existing file at `path` is unchanged.
pub fn write(path: &Path, recording: &Recording) -> io::Result<()> {
    whole_file::write(path, |out| write_to(out, recording))
}

/// Writes the text of a file.
///
/// # Errors
/// Those of the writer.
pub fn write_to(out: &mut dyn Write, recording: &Recording) -> io::Result<()> {
    write!(out, "{TIME}")?;
    for channel in recording.channels() {
        write!(out, ",{}", channel.column())?;
    }
    for (row, time) in recording.time_s().iter().enumerate() {
        write!(out, "\n{time}")?;
        for channel in recording.channels() {
            write!(out, ",{}", channel.values()[row])?;
        }
    }
    writeln!(out)
}
