//! The format of a record in a parameter sector of a board's flash: magic word, schema, kind, name, words, checksum, commit word.
//!
//! All numbers are little-endian:
//! ```text
//! 0    magic word, four letters
//! 4    schema, u16                   any other schema is refused
//! 6    kind, u16                     meaning of the words
//! 8    number of words, u32
//! 12   name, 24 bytes of UTF-8, the rest zero
//! 36   the words, u32
//! ...  CRC-32 (ISO-HDLC) of all bytes before it
//! ...  commit word "DONE"
//! ...  0xFF to the end of the sector
//! ```
//! A sector is *erased* only if every byte of it is 0xFF. It has a *record* only if all of the above holds; the commit word is its last
//! word and is written last, so a write that was interrupted leaves it incomplete. Everything else is *damaged*, and an error: a sector
//! that somebody has written to never stands for the values of an erased one.

use core::fmt;

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use joint_units::Phase;

use crate::store::record_name::RecordName;

/// Bytes before the words.
const HEAD: usize = 12 + RecordName::MAX_BYTES;

/// Bytes of checksum and commit word.
const TAIL: usize = 8;

/// A word of erased flash.
const ERASED: u32 = 0xFFFF_FFFF;

/// The last word of a record. No byte of it is 0xFF, which a byte has before it is written.
const COMMIT: u32 = u32::from_le_bytes(*b"DONE");

/// Without a lookup table: a boot reads only a few hundred bytes.
const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// Bytes of a record with this number of words.
pub(crate) const fn bytes_of(words: usize) -> usize {
    HEAD + 4 * words + TAIL
}

/// Why a sector has no complete record, although it is not erased.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FlashRecordError {
    /// It does not begin with the magic word.
    Magic {
        /// The expected magic word.
        wanted: [u8; 4],
    },
    /// It ends before the end of the record.
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
    /// The commit word is not there: a write was interrupted.
    Commit {
        /// The word at its place.
        found: u32,
    },
    /// The checksum is wrong: the record was changed.
    Crc {
        /// Checksum in the record.
        written: u32,
        /// Checksum computed from the record.
        computed: u32,
    },
    /// The name is no text.
    Name,
    /// The sector is not erased after the record.
    Rest,
}

impl fmt::Display for FlashRecordError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Magic { wanted } => {
                let word = core::str::from_utf8(wanted).unwrap_or("");
                write!(f, "damaged: not all erased; allowed is that, or a record that begins with {word}")
            }
            Self::Short => f.write_str("damaged: ends before its commit word; write it again"),
            // A record of another version has these two; so has one whose write was interrupted in its first words.
            Self::Schema { found, known } => write!(f, "schema {found}; allowed is {known}"),
            Self::Kind { kind, words } => write!(f, "unknown record kind {kind} ({words} words)"),
            Self::Commit { found } => {
                write!(f, "damaged: commit word {found:08x}, its write was interrupted; write it again")
            }
            Self::Crc { written, computed } => {
                write!(f, "damaged: check sum {computed:08x}, written is {written:08x}; write it again")
            }
            Self::Name => f.write_str("damaged: its name is no text; write it again"),
            Self::Rest => f.write_str("damaged: not erased after the record; erase the sector and write it again"),
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
    pub(crate) fn new(
        magic: [u8; 4],
        schema: u16,
        kind: u16,
        name: &RecordName,
        fill: impl FnOnce(&mut WordWriter<'_>),
    ) -> Self {
        let mut record = Self { bytes: [0; BYTES], length: 0 };
        let mut writer = WordWriter { bytes: &mut record.bytes, length: 0 };
        writer.push(u32::from_le_bytes(magic));
        writer.push(u32::from(schema) | u32::from(kind) << 16);
        writer.push(0);
        name.padded().as_chunks().0.iter().for_each(|word| writer.push(u32::from_le_bytes(*word)));
        fill(&mut writer);
        let length = writer.length;
        let words = (length.saturating_sub(HEAD) / 4) as u32;
        WordWriter { bytes: &mut record.bytes, length: 8 }.push(words);
        record.length = length;
        let crc = CRC.checksum(record.bytes());
        let mut writer = WordWriter { bytes: &mut record.bytes, length };
        writer.push(crc);
        writer.push(COMMIT);
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
        let tail = self.bytes().last_chunk::<TAIL>().and_then(|tail| tail.first_chunk::<4>());
        tail.map_or(0, |bytes| u32::from_le_bytes(*bytes))
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
    pub(crate) name: RecordName,
    pub(crate) words: WordReader<'a>,
    pub(crate) crc: u32,
}

impl Found<'_> {
    /// Number of words not yet read.
    pub(crate) const fn words_left(&self) -> u32 {
        (self.words.0.len() / 4) as u32
    }
}

/// Opens the record of a sector; `None` if all of the sector is erased. `is_known` checks kind and number of words, so that a wrong length
/// is refused before it is used.
pub(crate) fn open(
    sector: &[u8],
    magic: [u8; 4],
    known: u16,
    is_known: impl FnOnce(u16, u32) -> bool,
) -> Result<Option<Found<'_>>, FlashRecordError> {
    let mut head = WordReader(sector);
    if head.word()? != u32::from_le_bytes(magic) {
        return if is_erased(sector) { Ok(None) } else { Err(FlashRecordError::Magic { wanted: magic }) };
    }
    let (schema_kind, count) = (head.word()?, head.word()?);
    if schema_kind == ERASED || count == ERASED {
        return Err(FlashRecordError::Commit { found: ERASED });
    }
    let (found, kind) = (schema_kind as u16, (schema_kind >> 16) as u16);
    if found != known {
        return Err(FlashRecordError::Schema { found, known });
    }
    if !is_known(kind, count) {
        return Err(FlashRecordError::Kind { kind, words: count });
    }
    let (name, after) = head.0.split_first_chunk::<{ RecordName::MAX_BYTES }>().ok_or(FlashRecordError::Short)?;
    let (words, rest) =
        (count as usize).checked_mul(4).and_then(|end| after.split_at_checked(end)).ok_or(FlashRecordError::Short)?;
    let mut tail = WordReader(rest);
    let (written, commit) = (tail.word()?, tail.word()?);
    if commit != COMMIT {
        return Err(FlashRecordError::Commit { found: commit });
    }
    let covered = sector.get(..HEAD.saturating_add(words.len())).ok_or(FlashRecordError::Short)?;
    let computed = CRC.checksum(covered);
    if written != computed {
        return Err(FlashRecordError::Crc { written, computed });
    }
    if !is_erased(tail.0) {
        return Err(FlashRecordError::Rest);
    }
    let name = RecordName::read(name).ok_or(FlashRecordError::Name)?;
    Ok(Some(Found { kind, name, words: WordReader(words), crc: written }))
}

/// Whether every byte is that of erased flash; a word at a time, because a sector has 16 KiB.
fn is_erased(bytes: &[u8]) -> bool {
    let (words, rest) = bytes.as_chunks();
    words.iter().all(|word| u32::from_le_bytes(*word) == ERASED) && rest.iter().all(|byte| *byte == 0xFF)
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

/// Why the words of a record are not the parameters of its kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum WordError {
    /// The record ends too early.
    Record(FlashRecordError),
    /// The word of this field must be from 0 to `most`.
    Choice { field: &'static str, word: u32, most: u32 },
}

impl From<FlashRecordError> for WordError {
    fn from(error: FlashRecordError) -> Self {
        Self::Record(error)
    }
}

/// Reads a word that is the index of a value in a list.
pub(crate) fn choice<T: Copy>(words: &mut WordReader<'_>, field: &'static str, all: &[T]) -> Result<T, WordError> {
    let word = words.word()?;
    let most = all.len().saturating_sub(1) as u32;
    all.get(word as usize).copied().ok_or(WordError::Choice { field, word, most })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_the_standard_one() {
        // The check value of CRC-32/ISO-HDLC.
        assert_eq!(CRC.checksum(b"123456789"), 0xCBF4_3926);
    }

    const NAME: RecordName = RecordName::literal("a test");

    #[test]
    fn words_are_read_back_and_a_wrong_length_is_short() {
        let record = Framed::<{ bytes_of(2) }>::new(*b"FFXX", 3, 7, &NAME, |record| record.floats(&[1.5, -0.0]));
        assert_eq!(record.bytes().len(), bytes_of(2));
        let mut found = open(record.bytes(), *b"FFXX", 3, |kind, words| (kind, words) == (7, 2)).unwrap().unwrap();
        assert_eq!((found.kind, found.crc, found.words.floats().unwrap()), (7, record.crc(), [1.5, -0.0]));
        assert!(found.words.is_empty() && found.name == NAME);
        let mut long = record.bytes().to_vec();
        long[8..12].copy_from_slice(&(u32::MAX - 1).to_le_bytes());
        assert!(matches!(open(&long, *b"FFXX", 3, |_, _| true), Err(FlashRecordError::Short)));
        let known = open(record.bytes(), *b"FFXX", 2, |_, _| true).map(|_| ());
        assert_eq!(known, Err(FlashRecordError::Schema { found: 3, known: 2 }));
    }

    /// One byte that is not 0xFF, wherever it is, is neither an erased sector nor the rest of a record.
    #[test]
    fn one_written_byte_is_found_everywhere() {
        let refusal = |sector: &[u8]| open(sector, *b"FFXX", 3, |_, _| true).map(|found| found.is_some());
        let record = Framed::<{ bytes_of(2) }>::new(*b"FFXX", 3, 7, &NAME, |record| record.floats(&[1.5, -0.0]));
        let mut sector = [0xFF; 1027];
        assert_eq!(refusal(&sector), Ok(false));
        for place in 0..sector.len() {
            sector[place] = 0x7F;
            assert_eq!(refusal(&sector), Err(FlashRecordError::Magic { wanted: *b"FFXX" }), "{place}");
            sector[place] = 0xFF;
        }
        sector[..record.bytes().len()].copy_from_slice(record.bytes());
        assert_eq!(refusal(&sector), Ok(true));
        for place in record.bytes().len()..sector.len() {
            sector[place] = 0;
            assert_eq!(refusal(&sector), Err(FlashRecordError::Rest), "{place}");
            sector[place] = 0xFF;
        }
        assert_eq!(refusal(&[]), Err(FlashRecordError::Short));
    }

    /// Each of the words that come before the name may be the last that was written.
    #[test]
    fn a_write_that_ended_in_the_first_words_is_named() {
        let record = Framed::<{ bytes_of(2) }>::new(*b"FFXX", 3, 7, &NAME, |record| record.floats(&[1.5, -0.0]));
        for erased in [4..8, 8..12, 4..12] {
            let mut bytes = record.bytes().to_vec();
            bytes[erased].fill(0xFF);
            let found = open(&bytes, *b"FFXX", 3, |_, _| true).map(|_| ());
            assert_eq!(found, Err(FlashRecordError::Commit { found: ERASED }));
        }
    }

    #[test]
    fn a_name_that_is_no_text_is_refused() {
        let mut record = Framed::<{ bytes_of(0) }>::new(*b"FFXX", 3, 7, &NAME, |_| {});
        record.bytes[12] = 0xC3;
        let crc = CRC.checksum(&record.bytes[..HEAD]).to_le_bytes();
        record.bytes[HEAD..HEAD + 4].copy_from_slice(&crc);
        let found = open(record.bytes(), *b"FFXX", 3, |_, _| true).map(|_| ());
        assert_eq!(found, Err(FlashRecordError::Name));
    }
}
