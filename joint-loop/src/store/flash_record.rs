//! The format of a record in a parameter sector of a board's flash: magic word, schema, kind, length, words, checksum.
//!
//! All numbers are little-endian:
//! ```text
//! 0    magic word, four letters      0xFFFFFFFF: erased flash, no record
//! 4    schema, u16                   any other schema is refused
//! 6    kind, u16                     meaning of the words
//! 8    number of words, u32
//! 12   the words, u32
//! ...  CRC-32 (ISO-HDLC) of all bytes before it
//! ```

use core::fmt;

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use joint_units::Phase;

/// Bytes before the words.
const HEAD: usize = 12;

const ERASED: u32 = 0xFFFF_FFFF;

/// Without a lookup table: a boot reads only a few hundred bytes.
const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// Bytes of a record with this number of words.
pub(crate) const fn bytes_of(words: usize) -> usize {
    HEAD + 4 * words + 4
}

/// Why bytes are not a complete record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FlashRecordError {
    /// They do not begin with the magic word and are not erased flash.
    Magic {
        /// The expected magic word.
        wanted: [u8; 4],
    },
    /// They end before the end of the record.
    Short,
    /// The schema is not the expected one.
    Schema {
        /// Schema of the record.
        found: u16,
        /// Expected schema.
        known: u16,
    },
    /// The kind is unknown, or it has another number of words.
    Kind {
        /// Kind of the record.
        kind: u16,
        /// Number of words of the record.
        words: u32,
    },
    /// The checksum is wrong: the record is incomplete or was changed.
    Crc {
        /// Checksum in the record.
        written: u32,
        /// Checksum computed from the record.
        computed: u32,
    },
}

impl fmt::Display for FlashRecordError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Magic { wanted } => {
                let word = core::str::from_utf8(wanted).unwrap_or("");
                write!(f, "begins with something else; allowed is a record that begins with {word}, or erased flash")
            }
            Self::Short => f.write_str("ends before its check sum"),
            Self::Schema { found, known } => write!(f, "schema {found}; allowed is {known}"),
            Self::Kind { kind, words } => write!(f, "unknown record kind {kind} ({words} words)"),
            Self::Crc { written, computed } => write!(f, "check sum {computed:08x}, written is {written:08x}"),
        }
    }
}

impl core::error::Error for FlashRecordError {}

/// A record of at most `BYTES` bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Framed<const BYTES: usize> {
    bytes: [u8; BYTES],
    length: usize,
}

impl<const BYTES: usize> Framed<BYTES> {
    /// Makes a record with the words that `fill` writes. `BYTES` must be [`bytes_of`] the largest number of words.
    pub(crate) fn new(magic: [u8; 4], schema: u16, kind: u16, fill: impl FnOnce(&mut WordWriter<'_>)) -> Self {
        let mut record = Self { bytes: [0; BYTES], length: 0 };
        let mut writer = WordWriter { bytes: &mut record.bytes, length: 0 };
        writer.push(u32::from_le_bytes(magic));
        writer.push(u32::from(schema) | u32::from(kind) << 16);
        writer.push(0);
        fill(&mut writer);
        let length = writer.length;
        let words = (length.saturating_sub(HEAD) / 4) as u32;
        WordWriter { bytes: &mut record.bytes, length: 8 }.push(words);
        record.length = length;
        let crc = CRC.checksum(record.bytes());
        let mut writer = WordWriter { bytes: &mut record.bytes, length };
        writer.push(crc);
        record.length = writer.length;
        record
    }

    /// Bytes of the record.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or(&[])
    }

    /// Checksum, which identifies the record in the board's log.
    #[must_use]
    pub fn crc(&self) -> u32 {
        let end = self.bytes().last_chunk::<4>();
        end.map_or(0, |bytes| u32::from_le_bytes(*bytes))
    }
}

/// Appends words to a record. Words beyond its capacity are dropped.
pub(crate) struct WordWriter<'a> {
    bytes: &'a mut [u8],
    length: usize,
}

impl WordWriter<'_> {
    pub(crate) fn push(&mut self, word: u32) {
        if let Some(place) = self.bytes.get_mut(self.length..).and_then(|rest| rest.first_chunk_mut::<4>()) {
            *place = word.to_le_bytes();
            self.length += 4;
        }
    }

    pub(crate) fn floats(&mut self, values: &[f32]) {
        values.iter().for_each(|value| self.push(value.to_bits()));
    }

    pub(crate) fn phases(&mut self, values: &[Phase]) {
        values.iter().for_each(|value| self.push(value.0));
    }
}

/// A complete record that was found.
pub(crate) struct Found<'a> {
    pub(crate) kind: u16,
    pub(crate) words: WordReader<'a>,
    pub(crate) crc: u32,
}

impl Found<'_> {
    /// Number of words not yet read.
    pub(crate) const fn words_left(&self) -> u32 {
        (self.words.0.len() / 4) as u32
    }
}

/// Opens the record at the start of `bytes`; `None` if they are erased flash. Bytes after the record are ignored. `is_known`
/// checks kind and number of words, so that a wrong length is refused before it is used.
pub(crate) fn open(
    bytes: &[u8],
    magic: [u8; 4],
    known: u16,
    is_known: impl FnOnce(u16, u32) -> bool,
) -> Result<Option<Found<'_>>, FlashRecordError> {
    let mut head = WordReader(bytes);
    match head.word()? {
        ERASED => return Ok(None),
        word if word == u32::from_le_bytes(magic) => {}
        _ => return Err(FlashRecordError::Magic { wanted: magic }),
    }
    let schema_kind = head.word()?;
    let (found, kind) = (schema_kind as u16, (schema_kind >> 16) as u16);
    if found != known {
        return Err(FlashRecordError::Schema { found, known });
    }
    let count = head.word()?;
    if !is_known(kind, count) {
        return Err(FlashRecordError::Kind { kind, words: count });
    }
    let (words, rest) =
        (count as usize).checked_mul(4).and_then(|end| head.0.split_at_checked(end)).ok_or(FlashRecordError::Short)?;
    let written = WordReader(rest).word()?;
    let covered = bytes.get(..HEAD.saturating_add(words.len())).ok_or(FlashRecordError::Short)?;
    let computed = CRC.checksum(covered);
    if written != computed {
        return Err(FlashRecordError::Crc { written, computed });
    }
    Ok(Some(Found { kind, words: WordReader(words), crc: written }))
}

/// Reads the words of a record in order.
pub(crate) struct WordReader<'a>(&'a [u8]);

impl WordReader<'_> {
    pub(crate) fn word(&mut self) -> Result<u32, FlashRecordError> {
        let (word, rest) = self.0.split_first_chunk::<4>().ok_or(FlashRecordError::Short)?;
        self.0 = rest;
        Ok(u32::from_le_bytes(*word))
    }

    pub(crate) fn float(&mut self) -> Result<f32, FlashRecordError> {
        self.word().map(f32::from_bits)
    }

    pub(crate) fn floats<const N: usize>(&mut self) -> Result<[f32; N], FlashRecordError> {
        let mut all = [0.0; N];
        for value in &mut all {
            *value = self.float()?;
        }
        Ok(all)
    }

    pub(crate) fn phases<const N: usize>(&mut self) -> Result<[Phase; N], FlashRecordError> {
        let mut all = [Phase(0); N];
        for value in &mut all {
            *value = Phase(self.word()?);
        }
        Ok(all)
    }

    pub(crate) const fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_the_standard_one() {
        // The check value of CRC-32/ISO-HDLC.
        assert_eq!(CRC.checksum(b"123456789"), 0xCBF4_3926);
    }

    #[test]
    fn words_are_read_back_and_a_wrong_length_is_short() {
        let record = Framed::<{ bytes_of(2) }>::new(*b"FFXX", 3, 7, |record| record.floats(&[1.5, -0.0]));
        assert_eq!(record.bytes().len(), bytes_of(2));
        let mut found = open(record.bytes(), *b"FFXX", 3, |kind, words| (kind, words) == (7, 2)).unwrap().unwrap();
        assert_eq!((found.kind, found.crc, found.words.floats().unwrap()), (7, record.crc(), [1.5, -0.0]));
        assert!(found.words.is_empty());
        let mut long = record.bytes().to_vec();
        long[8..12].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(matches!(open(&long, *b"FFXX", 3, |_, _| true), Err(FlashRecordError::Short)));
        let known = open(record.bytes(), *b"FFXX", 2, |_, _| true).map(|_| ());
        assert_eq!(known, Err(FlashRecordError::Schema { found: 3, known: 2 }));
    }
}
