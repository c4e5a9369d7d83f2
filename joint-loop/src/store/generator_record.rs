//! A walker's parameters as bytes: what a host writes into the board's first parameter sector and the board reads at boot.
//!
//! A record as [`crate::store::flash_record`] says, magic word "FFWK"; its kind is 1 robust, 2 thesis, 3 shape or 4 follow, and fixes the number of
//! words: bits of f32, or a phase in 2^-32 of a cycle.
//!
//! Words, in this order: **robust** natural period, nonlinearity, couplings, phases, amplitudes, offsets; **thesis** alpha, p, mu,
//! offset of each joint, difference gains, product gains, phases; **shape** stride, then mean, cosines, sines of each joint; **follow**
//! the sensor's joint as its place in [`Joint::ALL`], the source of events as its place in [`EventSource::ALL`], then as shape. Units as
//! in the configurations themselves.

use core::fmt;

use cpg_core::BuildError;
use cpg_core::entrainment::EventSource;
use cpg_core::network::phase_coupled::RobustConfig;
use cpg_core::network::thesis::ThesisConfig;
use cpg_core::oscillator::rayleigh::RayleighConfig;
use joint_units::{Joint, Period, Phase, Radians};

use crate::generator::board_generator::{FollowConfig, GeneratorConfig, SERIES_HARMONICS, SeriesConfig, ShapeConfig};
use crate::store::flash_record::{FrameError, Framed, Words, bytes_of, open};

/// Bytes of the longest record.
pub const MAX_BYTES: usize = bytes_of(MAX_WORDS);

const MAGIC: [u8; 4] = *b"FFWK";
const SCHEMA: u16 = 1;
const ROBUST: (u16, usize) = (1, 18);
const THESIS: (u16, usize) = (2, 28);
const SHAPE: (u16, usize) = (3, 1 + 4 * (1 + 2 * SERIES_HARMONICS));
const FOLLOW: (u16, usize) = (4, MAX_WORDS);
const MAX_WORDS: usize = 2 + SHAPE.1;
const KINDS: [(u16, usize); 4] = [ROBUST, THESIS, SHAPE, FOLLOW];

/// Why bytes are no walker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum GeneratorRecordError {
    /// They are no whole record.
    Frame(FrameError),
    /// There is no joint of this number.
    Joint(u32),
    /// There is no source of events of this number.
    Events(u32),
    /// A parameter is not allowed.
    Parameter(BuildError),
}

impl fmt::Display for GeneratorRecordError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Frame(error @ FrameError::Kind { .. }) => {
                write!(f, "{error}; allowed is")?;
                for (place, (kind, words)) in KINDS.into_iter().enumerate() {
                    let between = if place == 0 { "" } else { " or" };
                    write!(f, "{between} {kind} with {words}")?;
                }
                Ok(())
            }
            Self::Frame(error) => write!(f, "{error}"),
            Self::Joint(place) => write!(f, "the sensor is on joint {place}; allowed is 0 to 3"),
            Self::Events(place) => write!(f, "the events are of source {place}; allowed is 0 to 2"),
            Self::Parameter(error) => write!(f, "{error}"),
        }
    }
}

impl core::error::Error for GeneratorRecordError {}

impl From<FrameError> for GeneratorRecordError {
    fn from(error: FrameError) -> Self {
        Self::Frame(error)
    }
}

/// A walker that was read, with the check sum that names it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stored {
    /// The parameters: every one of them is allowed.
    pub config: GeneratorConfig,
    /// The record's check sum.
    pub crc: u32,
}

/// A record, ready to be written.
pub type Record = Framed<MAX_BYTES>;

/// The record of a walker.
#[must_use]
pub fn record_of(config: &GeneratorConfig) -> Record {
    let (kind, _) = match config {
        GeneratorConfig::Robust(_) => ROBUST,
        GeneratorConfig::Thesis(_) => THESIS,
        GeneratorConfig::Shape(_) => SHAPE,
        GeneratorConfig::Follow(_) => FOLLOW,
    };
    Record::new(MAGIC, SCHEMA, kind, |record| match config {
        GeneratorConfig::Robust(robust) => {
            record.floats(&[robust.natural_period, robust.nonlinearity]);
            record.floats(&robust.coupling);
            phases(record, &robust.phases);
            record.floats(&robust.amplitudes.map(|angle| angle.0));
            record.floats(&robust.offsets.map(|angle| angle.0));
        }
        GeneratorConfig::Thesis(thesis) => {
            for joint in &thesis.joints {
                record.floats(&[joint.alpha, joint.p, joint.mu, joint.offset]);
            }
            thesis.difference.iter().chain(&thesis.product).for_each(|pair| record.floats(pair));
            phases(record, &thesis.phases);
        }
        GeneratorConfig::Shape(config) => shape(record, config),
        GeneratorConfig::Follow(follow) => {
            record.push(follow.sensor as u32);
            record.push(follow.events as u32);
            shape(record, &follow.shape);
        }
    })
}

fn shape(record: &mut Record, shape: &ShapeConfig) {
    record.floats(&[shape.stride_s]);
    for joint in &shape.joints {
        record.floats(&[joint.mean.0]);
        record.floats(&joint.cos);
        record.floats(&joint.sin);
    }
}

fn phases(record: &mut Record, values: &[Phase]) {
    values.iter().for_each(|value| record.push(value.0));
}

/// Reads the walker at the start of `bytes`; `None` when they are erased flash. What follows the record is not looked at.
///
/// ```
/// use joint_loop::{FrameError, GeneratorConfig};
/// use joint_loop::store::generator_record::{GeneratorRecordError, read, record_of};
/// let record = record_of(&GeneratorConfig::default_walk());
/// let stored = read(record.bytes())?.unwrap();
/// assert_eq!((stored.config, stored.crc), (GeneratorConfig::default_walk(), record.crc()));
/// assert_eq!(read(&[0xFF; 64]), Ok(None));
/// let mut broken = record.bytes().to_vec();
/// broken[20] ^= 1;
/// assert!(matches!(read(&broken), Err(GeneratorRecordError::Frame(FrameError::Crc { .. }))));
/// # Ok::<(), GeneratorRecordError>(())
/// ```
///
/// # Errors
/// [`GeneratorRecordError`]; a parameter that is not allowed at a period of 1 ms is one of them.
pub fn read(bytes: &[u8]) -> Result<Option<Stored>, GeneratorRecordError> {
    let is_known = |kind, words| KINDS.into_iter().any(|known| (known.0, known.1 as u32) == (kind, words));
    let Some(found) = open(bytes, MAGIC, SCHEMA, is_known)? else { return Ok(None) };
    let mut words = found.words;
    let config = match found.kind {
        kind if kind == ROBUST.0 => words.robust()?,
        kind if kind == THESIS.0 => words.thesis()?,
        kind if kind == SHAPE.0 => GeneratorConfig::Shape(words.shape()?),
        _ => {
            let place = words.word()?;
            let sensor = Joint::ALL.get(place as usize).copied().ok_or(GeneratorRecordError::Joint(place))?;
            let place = words.word()?;
            let events = EventSource::ALL.get(place as usize).copied().ok_or(GeneratorRecordError::Events(place))?;
            GeneratorConfig::Follow(FollowConfig { sensor, events, shape: words.shape()? })
        }
    };
    config.build(Period::MILLISECOND).map_err(GeneratorRecordError::Parameter)?;
    Ok(Some(Stored { config, crc: found.crc }))
}

impl Words<'_> {
    fn phases(&mut self) -> Result<[Phase; 4], FrameError> {
        let mut all = [Phase(0); 4];
        for value in &mut all {
            *value = Phase(self.word()?);
        }
        Ok(all)
    }

    fn robust(&mut self) -> Result<GeneratorConfig, FrameError> {
        Ok(GeneratorConfig::Robust(RobustConfig {
            natural_period: self.float()?,
            nonlinearity: self.float()?,
            coupling: self.floats()?,
            phases: self.phases()?,
            amplitudes: self.floats()?.map(Radians),
            offsets: self.floats()?.map(Radians),
        }))
    }

    fn thesis(&mut self) -> Result<GeneratorConfig, FrameError> {
        let mut joints = [RayleighConfig { alpha: 0.0, p: 0.0, mu: 0.0, offset: 0.0 }; 4];
        for joint in &mut joints {
            let [alpha, p, mu, offset] = self.floats()?;
            *joint = RayleighConfig { alpha, p, mu, offset };
        }
        Ok(GeneratorConfig::Thesis(ThesisConfig {
            joints,
            difference: [self.floats()?, self.floats()?],
            product: [self.floats()?, self.floats()?],
            phases: self.phases()?,
        }))
    }

    fn shape(&mut self) -> Result<ShapeConfig, FrameError> {
        let stride_s = self.float()?;
        let mut joints =
            [SeriesConfig { mean: Radians(0.0), cos: [0.0; SERIES_HARMONICS], sin: [0.0; SERIES_HARMONICS] }; 4];
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

    fn shape() -> GeneratorConfig {
        let series =
            |mean| SeriesConfig { mean: Radians(mean), cos: [0.25; SERIES_HARMONICS], sin: [-1e-7; SERIES_HARMONICS] };
        GeneratorConfig::Shape(ShapeConfig { stride_s: 1.234_567, joints: [0.1, 0.2, 0.3, 0.4].map(series) })
    }

    fn all() -> [GeneratorConfig; 4] {
        let GeneratorConfig::Shape(inner) = shape() else { unreachable!() };
        let follow = GeneratorConfig::Follow(FollowConfig {
            sensor: Joint::RightHip,
            events: EventSource::FootSwitch,
            shape: inner,
        });
        [GeneratorConfig::default_walk(), GeneratorConfig::Thesis(ThesisConfig::set_s()), shape(), follow]
    }

    #[test]
    fn every_kind_makes_an_exact_round_trip() {
        for config in all() {
            let record = record_of(&config);
            assert_eq!(read(record.bytes()), Ok(Some(Stored { config, crc: record.crc() })));
            // In flash the record is followed by erased bytes.
            let sector = [record.bytes(), &[0xFF; 100]].concat();
            assert_eq!(read(&sector).unwrap().unwrap().config, config);
        }
    }

    #[test]
    fn a_sensor_on_no_joint_and_events_of_no_source_are_refused() {
        let of = |joint, events| {
            Record::new(MAGIC, SCHEMA, FOLLOW.0, |record| {
                record.push(joint);
                record.push(events);
                (2..FOLLOW.1).for_each(|_| record.push(0));
            })
        };
        assert_eq!(read(of(4, 0).bytes()), Err(GeneratorRecordError::Joint(4)));
        assert_eq!(read(of(0, 3).bytes()), Err(GeneratorRecordError::Events(3)));
        for (place, source) in EventSource::ALL.into_iter().enumerate() {
            assert_eq!(source as usize, place);
        }
    }

    /// A follower without the word for its events, as they were before, is refused by its length.
    #[test]
    fn a_follower_of_the_old_length_is_refused() {
        let old = Record::new(MAGIC, SCHEMA, FOLLOW.0, |record| (1..FOLLOW.1).for_each(|_| record.push(0)));
        let told = read(old.bytes()).unwrap_err();
        assert_eq!(told, GeneratorRecordError::Frame(FrameError::Kind { kind: 4, words: 70 }));
        assert!(told.to_string().ends_with("or 4 with 71"), "{told}");
    }

    #[test]
    fn every_bit_that_flips_is_noticed() {
        for config in all() {
            let record = record_of(&config);
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
        let record = record_of(&shape());
        let told = |bytes: &[u8]| read(bytes).unwrap_err().to_string();
        assert!(told(b"hello, world").contains("allowed is a record that begins with FFWK, or erased flash"));
        assert!(told(&record.bytes()[..200]).contains("ends before"));
        assert!(told(&[]).contains("ends before"));
        let mut other = record.bytes().to_vec();
        other[4] = 9;
        assert_eq!(told(&other), "schema 9; allowed is 1");
        let mut other = record.bytes().to_vec();
        other[6] = 7;
        assert!(told(&other).starts_with("kind 7 with 69 words, which is not known; allowed is 1 with 18"));
        // A right check sum does not make a wrong number right.
        let GeneratorConfig::Shape(mut config) = shape() else { unreachable!() };
        config.stride_s = f32::NAN;
        assert!(told(record_of(&GeneratorConfig::Shape(config)).bytes()).contains("stride_s"));
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
