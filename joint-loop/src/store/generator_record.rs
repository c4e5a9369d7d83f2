//! The generator record: a generator's parameters as bytes. A host writes it to the board's first parameter sector,
//! the board reads it at boot.
//!
//! The format is that of [`crate::store::flash_record`] with the magic word "FFWK". The number of the kind and its words are in the file of the
//! kind, see [`crate::generator`]. A word is an `f32` as its bits, a phase in 2^-32 of a cycle, or the index of a value in a list.

use core::fmt;

use cpg_core::BuildError;
use joint_units::Period;

use crate::generator::GeneratorConfig;
use crate::store::flash_record::{FlashRecordError, Framed, WordError, bytes_of, open};
use crate::store::record_name::RecordName;

/// Bytes of the longest record.
pub const MAX_BYTES: usize = bytes_of(GeneratorConfig::MAX_WORDS);

/// First bytes of a record.
pub const MAGIC: [u8; 4] = *b"FFWK";
const SCHEMA: u16 = 2;

/// Why bytes are not a generator record.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum GeneratorRecordError {
    /// They are not a complete record, or the kind is unknown.
    Frame(FlashRecordError),
    /// A word that is the index of a value in a list is too large.
    Word {
        /// The parameter.
        field: &'static str,
        /// The word.
        word: u32,
        /// The largest word that is allowed.
        most: u32,
    },
    /// A parameter is not allowed.
    Parameter(BuildError),
}

impl fmt::Display for GeneratorRecordError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Frame(error @ FlashRecordError::Kind { .. }) => {
                write!(f, "{error}; expected")?;
                for (place, (kind, words)) in GeneratorConfig::RECORD_KINDS.iter().enumerate() {
                    write!(f, "{} kind {kind} with {words} words", if place == 0 { "" } else { "," })?;
                }
                f.write_str("; make the record again with `footfall pack`")
            }
            Self::Frame(error @ FlashRecordError::Schema { .. }) => {
                write!(f, "{error}; make the record again with `footfall pack`")
            }
            Self::Frame(error) => write!(f, "{error}"),
            Self::Word { field, word, most } => write!(f, "{field} is {word}; allowed is 0 to {most}"),
            Self::Parameter(error) => write!(f, "{error}"),
        }
    }
}

impl core::error::Error for GeneratorRecordError {}

impl From<FlashRecordError> for GeneratorRecordError {
    fn from(error: FlashRecordError) -> Self {
        Self::Frame(error)
    }
}

impl From<WordError> for GeneratorRecordError {
    fn from(error: WordError) -> Self {
        match error {
            WordError::Record(error) => Self::Frame(error),
            WordError::Choice { field, word, most } => Self::Word { field, word, most },
        }
    }
}

/// Parameters read from a generator record, with the name and the checksum that identify it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stored {
    /// The parameters, checked.
    pub config: GeneratorConfig,
    /// Name of the record.
    pub name: RecordName,
    /// Checksum of the record.
    pub crc: u32,
}

/// A generator record.
pub type Record = Framed<MAX_BYTES>;

/// Makes the record of a generator's parameters.
#[must_use]
pub fn record_of(config: &GeneratorConfig, name: &RecordName) -> Record {
    Record::new(MAGIC, SCHEMA, config.record_kind(), name, |words| config.write(words))
}

/// Reads the record of a sector; `None` if all of the sector is erased.
///
/// ```
/// use joint_loop::{FlashRecordError, GeneratorConfig, RecordName};
/// use joint_loop::store::generator_record::{GeneratorRecordError, read, record_of};
/// let name = RecordName::new("normal walk").unwrap();
/// let record = record_of(&GeneratorConfig::default_walk(), &name);
/// let stored = read(record.bytes())?.unwrap();
/// assert_eq!((stored.config, stored.name, stored.crc), (GeneratorConfig::default_walk(), name, record.crc()));
/// assert_eq!(read(&[0xFF; 64]), Ok(None));
/// let mut broken = record.bytes().to_vec();
/// broken[20] ^= 1;
/// assert!(matches!(read(&broken), Err(GeneratorRecordError::Frame(FlashRecordError::Crc { .. }))));
/// # Ok::<(), GeneratorRecordError>(())
/// ```
///
/// # Errors
/// [`GeneratorRecordError`]; also if a parameter is not allowed at a period of 1 ms.
// Inlined into the caller, its temporaries would add to the caller's stack.
#[inline(never)]
pub fn read(sector: &[u8]) -> Result<Option<Stored>, GeneratorRecordError> {
    let is_known =
        |kind, words| GeneratorConfig::RECORD_KINDS.iter().any(|known| (known.0, known.1 as u32) == (kind, words));
    let Some(mut found) = open(sector, MAGIC, SCHEMA, is_known)? else { return Ok(None) };
    let words = found.words_left();
    let unknown = FlashRecordError::Kind { kind: found.kind, words };
    let config = GeneratorConfig::read(found.kind, &mut found.words).ok_or(unknown)??;
    check(&config).map_err(GeneratorRecordError::Parameter)?;
    Ok(Some(Stored { config, name: found.name, crc: found.crc }))
}

#[inline(never)]
fn check(config: &GeneratorConfig) -> Result<(), BuildError> {
    config.build(Period::MILLISECOND).map(|_| ())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FollowConfig, SERIES_HARMONICS, SeriesConfig, ShapeConfig};
    use cpg_core::entrainment::{Corrections, EventSource};
    use cpg_core::network::thesis::ThesisConfig;
    use joint_units::{Joint, Radians};
    use proptest::prelude::*;
    use std::vec::Vec;

    const FOLLOW: (u16, usize) = (4, 380);
    const NAME: RecordName = RecordName::literal("a test");

    fn shape() -> GeneratorConfig {
        let series =
            |mean| SeriesConfig { mean: Radians(mean), cos: [0.25; SERIES_HARMONICS], sin: [-1e-7; SERIES_HARMONICS] };
        GeneratorConfig::Shape(ShapeConfig { stride_s: 1.234_567, joints: [0.1, 0.2, 0.3, 0.4].map(series) })
    }

    fn all() -> [GeneratorConfig; 4] {
        let GeneratorConfig::Shape(inner) = shape() else { unreachable!() };
        let mut corrections = Corrections { usual_innovation: Radians(0.03), ..Corrections::NONE };
        let gains = corrections.gains.as_flattened_mut().as_flattened_mut();
        gains.iter_mut().zip(0_u16..).for_each(|(gain, n)| *gain = 0.01 * f32::from(n));
        let follow = GeneratorConfig::Follow(FollowConfig {
            sensor: Joint::RightHip,
            events: EventSource::FootSwitch,
            shape: inner,
            corrections,
        });
        [GeneratorConfig::default_walk(), GeneratorConfig::Thesis(ThesisConfig::set_s()), shape(), follow]
    }

    #[test]
    fn every_kind_makes_an_exact_round_trip() {
        for config in all() {
            let record = record_of(&config, &NAME);
            assert_eq!(read(record.bytes()), Ok(Some(Stored { config, name: NAME, crc: record.crc() })));
            // In flash the record is followed by erased bytes.
            let sector = [record.bytes(), &[0xFF; 100]].concat();
            assert_eq!(read(&sector).unwrap().unwrap().config, config);
        }
    }

    #[test]
    fn a_sensor_on_no_joint_and_events_of_no_source_are_refused() {
        let of = |joint, events| {
            Record::new(MAGIC, SCHEMA, FOLLOW.0, &NAME, |record| {
                record.push(joint);
                record.push(events);
                (2..FOLLOW.1).for_each(|_| record.push(0));
            })
        };
        assert_eq!(read(of(4, 0).bytes()), Err(GeneratorRecordError::Word { field: "sensor", word: 4, most: 3 }));
        assert_eq!(read(of(0, 3).bytes()), Err(GeneratorRecordError::Word { field: "events", word: 3, most: 2 }));
        for (place, source) in EventSource::ALL.into_iter().enumerate() {
            assert_eq!(source as usize, place);
        }
    }

    /// A follower of an older version, without corrections or with gains for the cadence, is refused by its length.
    #[test]
    fn a_follower_of_an_old_length_is_refused() {
        for words in [71, 424] {
            let old = Framed::<{ bytes_of(424) }>::new(MAGIC, SCHEMA, FOLLOW.0, &NAME, |record| {
                (0..words).for_each(|_| record.push(0))
            });
            let error = read(old.bytes()).unwrap_err();
            assert_eq!(error, GeneratorRecordError::Frame(FlashRecordError::Kind { kind: 4, words }));
            let text = error.to_string();
            assert!(text.contains("kind 4 with 380 words") && text.ends_with("again with `footfall pack`"), "{text}");
        }
    }

    #[test]
    fn every_flipped_bit_is_detected() {
        for config in all() {
            let record = record_of(&config, &NAME);
            for bit in 0..record.bytes().len() * 8 {
                let mut bytes: Vec<u8> = record.bytes().into();
                bytes[bit / 8] ^= 1 << (bit % 8);
                let found = read(&bytes);
                assert!(found.is_err(), "bit {bit}: {found:?}");
            }
        }
    }

    #[test]
    fn an_error_states_what_is_allowed() {
        let record = record_of(&shape(), &NAME);
        let refusal = |bytes: &[u8]| read(bytes).unwrap_err().to_string();
        assert!(
            refusal(b"hello, world").contains("not all erased; allowed is that, or a record that begins with FFWK")
        );
        assert!(refusal(&record.bytes()[..200]).contains("ends before"));
        assert!(refusal(&[]).contains("ends before"));
        let mut other = record.bytes().to_vec();
        other[4] = 9;
        assert_eq!(refusal(&other), "schema 9; allowed is 2; make the record again with `footfall pack`");
        let mut other = record.bytes().to_vec();
        other[6] = 7;
        assert!(
            refusal(&other)
                .starts_with("unknown record kind 7 (69 words); expected kind 1 with 18 words, kind 2 with 28")
        );
        // A wrong number is refused although the checksum is correct.
        let GeneratorConfig::Shape(mut config) = shape() else { unreachable!() };
        config.stride_s = f32::NAN;
        assert!(refusal(record_of(&GeneratorConfig::Shape(config), &NAME).bytes()).contains("stride_s"));
    }

    proptest! {
        #[test]
        fn no_bytes_panic(bytes in prop::collection::vec(any::<u8>(), 0..400), kind in 0u16..5, words in 0u32..80) {
            let mut framed = b"FFWK\x02\x00".to_vec();
            framed.extend(kind.to_le_bytes());
            framed.extend(words.to_le_bytes());
            framed.extend(&bytes);
            prop_assert!(read(&bytes).is_err() || bytes.iter().all(|byte| *byte == 0xFF));
            prop_assert!(read(&framed).is_err());
        }
    }
}
