//! Records in printed logs: the firmware logs each one as the message `wire {=[u8]:02x}`, which decoders of defmt and `probe-rs run`
//! print as `wire [05, 07, 05, 01, 00]`, the latter with time, level and place around it.

use core::fmt;

use heapless::Vec;

use crate::MAX_BYTES;

const BEGIN: &str = "wire [";
const END: char = ']';

/// A printed record that is damaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum TextError {
    /// The closing bracket is missing: the line was cut.
    Open,
    /// A number, counted from 0, is not two hexadecimal digits.
    Digits {
        /// Its place.
        at: usize,
    },
    /// More bytes than the longest record has.
    Long,
}

impl fmt::Display for TextError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Open => f.write_str("printed record without its closing bracket: the line is cut"),
            Self::Digits { at } => {
                write!(f, "printed record: byte {at} is not two hexadecimal digits; allowed is `wire [05, 07, ...]`")
            }
            Self::Long => write!(f, "printed record of more than {MAX_BYTES} bytes; allowed are 1 to {MAX_BYTES}"),
        }
    }
}

impl core::error::Error for TextError {}

/// The bytes of the record in a line of a printed log; `None` where the line holds none.
///
/// ```
/// use wire::bytes_in;
/// let line = "1.204 [INFO ] wire [05, 07, 05, 01, 00] (firmware src/tasks/telemetry.rs:93)";
/// assert_eq!(bytes_in(line).unwrap().unwrap(), [5, 7, 5, 1, 0]);
/// assert_eq!(bytes_in("1.204 [INFO ] ready"), None);
/// ```
///
/// # Errors
/// [`TextError`]: the line holds the beginning of a record, but no whole one.
pub fn bytes_in(line: &str) -> Option<Result<Vec<u8, MAX_BYTES>, TextError>> {
    let (_, after) = line.split_once(BEGIN)?;
    Some(parse(after))
}

fn parse(after: &str) -> Result<Vec<u8, MAX_BYTES>, TextError> {
    let (numbers, _) = after.split_once(END).ok_or(TextError::Open)?;
    let mut bytes = Vec::new();
    if numbers.is_empty() {
        return Ok(bytes);
    }
    for (at, number) in numbers.split(',').enumerate() {
        let byte = match number.trim_start().as_bytes() {
            [high, low] => digit(*high).zip(digit(*low)).map(|(high, low)| high * 16 + low),
            _ => None,
        };
        bytes.push(byte.ok_or(TextError::Digits { at })?).map_err(|_| TextError::Long)?;
    }
    Ok(bytes)
}

/// The value of a hexadecimal digit.
const fn digit(character: u8) -> Option<u8> {
    match (character as char).to_digit(16) {
        Some(value) => Some(value as u8),
        None => None,
    }
}
