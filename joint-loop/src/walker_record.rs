//! A walker's parameters as bytes: what a host writes into the board's parameter sector and the board reads at boot.
//!
//! Little-endian, as the chip is:
//! ```text
//! 0    magic "FFWK"
//! 4    schema, u16, 1            another schema is refused, never guessed at
//! 6    kind, u16                 1 robust, 2 thesis, 3 shape, 4 follow
//! 8    number of words, u32      fixed by the kind
//! 12   the words, u32            bits of f32, or a phase in 2^-32 of a cycle
//! ...  CRC-32 (ISO-HDLC) of everything before it
//! ```
//! Words, in this order: **robust** natural period, nonlinearity, couplings, phases, amplitudes, offsets; **thesis** alpha, p, mu,
//! offset of each joint, difference gains, product gains, phases; **shape** stride, then mean, cosines, sines of each joint; **follow**
//! the sensor's joint as its place in [`Joint::ALL`], the source of events as its place in [`EventSource::ALL`], then as shape. Units as in the configurations themselves.

use core::fmt;

use cpg_core::BuildError;
use cpg_core::entrainment::EventSource;
use cpg_core::rayleigh::RayleighConfig;
use cpg_core::robust::RobustConfig;
use cpg_core::thesis::ThesisConfig;
use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use joint_units::{Joint, Period, Phase, Radians};

use crate::walker::{FollowConfig, HARMONICS, SeriesConfig, ShapeConfig, WalkerConfig};

/// First address of the board's parameter sector (16 KiB that the program leaves free, see `memory.x`).
pub const ADDRESS: u32 = 0x0800_4000;

/// Bytes of the longest record.
pub const MAX_BYTES: usize = HEAD + 4 * MAX_WORDS + 4;

const MAGIC: u32 = u32::from_le_bytes(*b"FFWK");
const ERASED: u32 = 0xFFFF_FFFF;
const SCHEMA: u16 = 1;
const HEAD: usize = 12;
const ROBUST: (u16, usize) = (1, 18);
const THESIS: (u16, usize) = (2, 28);
const SHAPE: (u16, usize) = (3, 1 + 4 * (1 + 2 * HARMONICS));
const FOLLOW: (u16, usize) = (4, MAX_WORDS);
const MAX_WORDS: usize = 2 + SHAPE.1;
const KINDS: [(u16, usize); 4] = [ROBUST, THESIS, SHAPE, FOLLOW];

/// Without a table: 300 bytes are read once a boot.
const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// Why bytes are no walker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RecordError {
    /// They do not begin with the magic word, and are not erased either.
    Magic,
    /// They end before the record does.
    Short,
    /// The schema is another one.
    Schema(u16),
    /// There is no such kind, or it has another number of words.
    Kind {
        /// The kind.
        kind: u16,
        /// Its number of words.
        words: u32,
    },
    /// The check sum is wrong: the record was not written to its end, or has changed since.
    Crc {
        /// In the record.
        written: u32,
        /// Of the record.
        computed: u32,
    },
    /// There is no joint of this number.
    Joint(u32),
    /// There is no source of events of this number.
    Events(u32),
    /// A parameter is not allowed.
    Walker(BuildError),
}

impl fmt::Display for RecordError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Magic => f.write_str("begins with something else than a walker; allowed is a walker or erased flash"),
            Self::Short => f.write_str("ends before its check sum"),
            Self::Schema(schema) => write!(f, "schema {schema}; allowed is {SCHEMA}"),
            Self::Kind { kind, words } => write!(
                f,
                "kind {kind} with {words} words; allowed is {} with {}, {} with {}, {} with {} or {} with {}",
                ROBUST.0, ROBUST.1, THESIS.0, THESIS.1, SHAPE.0, SHAPE.1, FOLLOW.0, FOLLOW.1
            ),
            Self::Crc { written, computed } => write!(f, "check sum {computed:08x}, written is {written:08x}"),
            Self::Joint(place) => write!(f, "the sensor is on joint {place}; allowed is 0 to 3"),
            Self::Events(place) => write!(f, "the events are of source {place}; allowed is 0 to 2"),
            Self::Walker(error) => write!(f, "{error}"),
        }
    }
}

impl core::error::Error for RecordError {}

/// A walker that was read, with the check sum that names it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stored {
    /// The parameters: every one of them is allowed.
    pub config: WalkerConfig,
    /// The record's check sum.
    pub crc: u32,
}

/// A record, ready to be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Record {
    bytes: [u8; MAX_BYTES],
    length: usize,
}

impl Record {
    /// The record of a walker.
    #[must_use]
    pub fn of(config: &WalkerConfig) -> Self {
        let mut record = Self { bytes: [0; MAX_BYTES], length: 0 };
        let (kind, words) = match config {
            WalkerConfig::Robust(_) => ROBUST,
            WalkerConfig::Thesis(_) => THESIS,
            WalkerConfig::Shape(_) => SHAPE,
            WalkerConfig::Follow(_) => FOLLOW,
        };
        record.push(MAGIC);
        record.push(u32::from(SCHEMA) | u32::from(kind) << 16);
        record.push(words as u32);
        match config {
            WalkerConfig::Robust(robust) => {
                record.floats(&[robust.natural_period, robust.nonlinearity]);
                record.floats(&robust.coupling);
                record.phases(&robust.phases);
                record.floats(&robust.amplitudes.map(|angle| angle.0));
                record.floats(&robust.offsets.map(|angle| angle.0));
            }
            WalkerConfig::Thesis(thesis) => {
                for joint in &thesis.joints {
                    record.floats(&[joint.alpha, joint.p, joint.mu, joint.offset]);
                }
                thesis.difference.iter().chain(&thesis.product).for_each(|pair| record.floats(pair));
                record.phases(&thesis.phases);
            }
            WalkerConfig::Shape(shape) => record.shape(shape),
            WalkerConfig::Follow(follow) => {
                record.push(follow.sensor as u32);
                record.push(follow.events as u32);
                record.shape(&follow.shape);
            }
        }
        record.push(CRC.checksum(record.bytes()));
        record
    }

    /// The bytes.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or(&[])
    }

    /// The check sum, which names the record in the board's log.
    #[must_use]
    pub fn crc(&self) -> u32 {
        let end = self.bytes().last_chunk::<4>();
        end.map_or(0, |bytes| u32::from_le_bytes(*bytes))
    }

    fn push(&mut self, word: u32) {
        if let Some(place) = self.bytes.get_mut(self.length..).and_then(|rest| rest.first_chunk_mut::<4>()) {
            *place = word.to_le_bytes();
            self.length += 4;
        }
    }

    fn floats(&mut self, values: &[f32]) {
        values.iter().for_each(|value| self.push(value.to_bits()));
    }

    fn shape(&mut self, shape: &ShapeConfig) {
        self.floats(&[shape.stride_s]);
        for joint in &shape.joints {
            self.floats(&[joint.mean.0]);
            self.floats(&joint.cos);
            self.floats(&joint.sin);
        }
    }

    fn phases(&mut self, values: &[Phase]) {
        values.iter().for_each(|value| self.push(value.0));
    }
}

/// Reads the walker at the start of `bytes`; `None` when they are erased flash. What follows the record is not looked at.
///
/// ```
/// use joint_loop::WalkerConfig;
/// use joint_loop::walker_record::{Record, RecordError, read};
/// let record = Record::of(&WalkerConfig::default_walk());
/// let stored = read(record.bytes())?.unwrap();
/// assert_eq!((stored.config, stored.crc), (WalkerConfig::default_walk(), record.crc()));
/// assert_eq!(read(&[0xFF; 64]), Ok(None));
/// let mut broken = record.bytes().to_vec();
/// broken[20] ^= 1;
/// assert!(matches!(read(&broken), Err(RecordError::Crc { .. })));
/// # Ok::<(), RecordError>(())
/// ```
///
/// # Errors
/// [`RecordError`]; a parameter that is not allowed at a period of 1 ms is one of them.
pub fn read(bytes: &[u8]) -> Result<Option<Stored>, RecordError> {
    let mut head = Words(bytes);
    match head.word()? {
        ERASED => return Ok(None),
        MAGIC => {}
        _ => return Err(RecordError::Magic),
    }
    let schema_kind = head.word()?;
    let (schema, kind) = (schema_kind as u16, (schema_kind >> 16) as u16);
    if schema != SCHEMA {
        return Err(RecordError::Schema(schema));
    }
    let words = head.word()?;
    let known = KINDS.into_iter().find(|known| (known.0, known.1 as u32) == (kind, words));
    let Some((_, count)) = known else { return Err(RecordError::Kind { kind, words }) };
    let checked = bytes.get(..HEAD + 4 * count).ok_or(RecordError::Short)?;
    let written = Words(bytes.get(HEAD + 4 * count..).ok_or(RecordError::Short)?).word()?;
    let computed = CRC.checksum(checked);
    if written != computed {
        return Err(RecordError::Crc { written, computed });
    }
    let config = match kind {
        kind if kind == ROBUST.0 => head.robust()?,
        kind if kind == THESIS.0 => head.thesis()?,
        kind if kind == SHAPE.0 => WalkerConfig::Shape(head.shape()?),
        _ => {
            let place = head.word()?;
            let sensor = Joint::ALL.get(place as usize).copied().ok_or(RecordError::Joint(place))?;
            let place = head.word()?;
            let events = EventSource::ALL.get(place as usize).copied().ok_or(RecordError::Events(place))?;
            WalkerConfig::Follow(FollowConfig { sensor, events, shape: head.shape()? })
        }
    };
    config.build(Period::MILLISECOND).map_err(RecordError::Walker)?;
    Ok(Some(Stored { config, crc: written }))
}

/// The words that are left.
struct Words<'a>(&'a [u8]);

impl Words<'_> {
    fn word(&mut self) -> Result<u32, RecordError> {
        let (word, rest) = self.0.split_first_chunk::<4>().ok_or(RecordError::Short)?;
        self.0 = rest;
        Ok(u32::from_le_bytes(*word))
    }

    fn float(&mut self) -> Result<f32, RecordError> {
        self.word().map(f32::from_bits)
    }

    fn floats<const N: usize>(&mut self) -> Result<[f32; N], RecordError> {
        let mut all = [0.0; N];
        for value in &mut all {
            *value = self.float()?;
        }
        Ok(all)
    }

    fn phases(&mut self) -> Result<[Phase; 4], RecordError> {
        let mut all = [Phase(0); 4];
        for value in &mut all {
            *value = Phase(self.word()?);
        }
        Ok(all)
    }

    fn robust(&mut self) -> Result<WalkerConfig, RecordError> {
        Ok(WalkerConfig::Robust(RobustConfig {
            natural_period: self.float()?,
            nonlinearity: self.float()?,
            coupling: self.floats()?,
            phases: self.phases()?,
            amplitudes: self.floats()?.map(Radians),
            offsets: self.floats()?.map(Radians),
        }))
    }

    fn thesis(&mut self) -> Result<WalkerConfig, RecordError> {
        let mut joints = [RayleighConfig { alpha: 0.0, p: 0.0, mu: 0.0, offset: 0.0 }; 4];
        for joint in &mut joints {
            let [alpha, p, mu, offset] = self.floats()?;
            *joint = RayleighConfig { alpha, p, mu, offset };
        }
        Ok(WalkerConfig::Thesis(ThesisConfig {
            joints,
            difference: [self.floats()?, self.floats()?],
            product: [self.floats()?, self.floats()?],
            phases: self.phases()?,
        }))
    }

    fn shape(&mut self) -> Result<ShapeConfig, RecordError> {
        let stride_s = self.float()?;
        let mut joints = [SeriesConfig { mean: Radians(0.0), cos: [0.0; HARMONICS], sin: [0.0; HARMONICS] }; 4];
        for joint in &mut joints {
            *joint = SeriesConfig { mean: Radians(self.float()?), cos: self.floats()?, sin: self.floats()? };
        }
        Ok(ShapeConfig { stride_s, joints })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn shape() -> WalkerConfig {
        let series = |mean| SeriesConfig { mean: Radians(mean), cos: [0.25; HARMONICS], sin: [-1e-7; HARMONICS] };
        WalkerConfig::Shape(ShapeConfig { stride_s: 1.234_567, joints: [0.1, 0.2, 0.3, 0.4].map(series) })
    }

    fn all() -> [WalkerConfig; 4] {
        let WalkerConfig::Shape(inner) = shape() else { unreachable!() };
        let follow = WalkerConfig::Follow(FollowConfig {
            sensor: Joint::RightHip,
            events: EventSource::FootSwitch,
            shape: inner,
        });
        [WalkerConfig::default_walk(), WalkerConfig::Thesis(ThesisConfig::set_s()), shape(), follow]
    }

    #[test]
    fn every_kind_makes_an_exact_round_trip_and_the_check_sum_is_the_standard_one() {
        for config in all() {
            let record = Record::of(&config);
            assert_eq!(read(record.bytes()), Ok(Some(Stored { config, crc: record.crc() })));
            // In flash the record is followed by erased bytes.
            let sector = [record.bytes(), &[0xFF; 100]].concat();
            assert_eq!(read(&sector).unwrap().unwrap().config, config);
        }
        // The check value of CRC-32/ISO-HDLC.
        assert_eq!(CRC.checksum(b"123456789"), 0xCBF4_3926);
    }

    #[test]
    fn a_sensor_on_no_joint_and_events_of_no_source_are_refused() {
        let [.., follow] = all();
        for (place, error) in [(HEAD, RecordError::Joint(4)), (HEAD + 4, RecordError::Events(4))] {
            let mut record = Record::of(&follow);
            record.bytes[place] = 4;
            let end = record.length - 4;
            let sum = CRC.checksum(&record.bytes[..end]);
            record.bytes[end..end + 4].copy_from_slice(&sum.to_le_bytes());
            assert_eq!(read(record.bytes()), Err(error));
        }
        for (place, source) in EventSource::ALL.into_iter().enumerate() {
            assert_eq!(source as usize, place);
        }
    }

    /// A follower without the word for its events, as they were before, is refused by its length.
    #[test]
    fn a_follower_of_the_old_length_is_refused() {
        let [.., follow] = all();
        let mut record = Record::of(&follow);
        record.bytes[8] -= 1;
        let told = read(record.bytes()).unwrap_err();
        assert_eq!(told, RecordError::Kind { kind: 4, words: 70 });
        assert!(told.to_string().ends_with("or 4 with 71"), "{told}");
    }

    #[test]
    fn every_bit_that_flips_is_noticed() {
        for config in all() {
            let record = Record::of(&config);
            for bit in 0..record.bytes().len() * 8 {
                let mut bytes: Vec<u8> = record.bytes().into();
                bytes[bit / 8] ^= 1 << (bit % 8);
                let found = read(&bytes);
                assert!(found.is_err(), "bit {bit}: {found:?}");
            }
        }
    }

    #[test]
    fn what_is_wrong_is_told_with_what_is_allowed() {
        let record = Record::of(&shape());
        let told = |bytes: &[u8]| read(bytes).unwrap_err().to_string();
        assert!(told(b"hello, world").contains("allowed is a walker or erased flash"));
        assert!(told(&record.bytes()[..200]).contains("ends before"));
        assert!(told(&[]).contains("ends before"));
        let mut other = record.bytes().to_vec();
        other[4] = 9;
        assert_eq!(told(&other), "schema 9; allowed is 1");
        let mut other = record.bytes().to_vec();
        other[6] = 7;
        assert!(told(&other).starts_with("kind 7 with 69 words; allowed is 1 with 18"));
        // A right check sum does not make a wrong number right.
        let WalkerConfig::Shape(mut config) = shape() else { unreachable!() };
        config.stride_s = f32::NAN;
        assert!(told(Record::of(&WalkerConfig::Shape(config)).bytes()).contains("stride_s"));
    }

    proptest! {
        #[test]
        fn no_bytes_panic(bytes in prop::collection::vec(any::<u8>(), 0..400), kind in 0u16..5, words in 0u32..80) {
            let mut framed = b"FFWK\x01\x00".to_vec();
            framed.extend(kind.to_le_bytes());
            framed.extend(words.to_le_bytes());
            framed.extend(&bytes);
            prop_assert!(read(&bytes).is_err() || bytes.starts_with(&[0xFF; 4]));
            prop_assert!(read(&framed).is_err());
        }
    }
}
