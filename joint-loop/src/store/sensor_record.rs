//! The sensor record: sensors as bytes. A host writes it to the board's second parameter sector, the board reads it at boot.
//!
//! The format is that of [`crate::store::flash_record`] with the magic word "FFSN" and kind 1. Words of each sensor, from
//! channel 1 on:
//! ```text
//! joint          index in Joint::ALL
//! interpolation  0 linear, 1 monotone cubic
//! divider        bits of f32
//! points         2 to 32
//! volts, angle   of each point, bits of f32, in volts and radians
//! ```

use core::fmt;

use hgod_adc::{Calibration, CalibrationError, CalibrationPoint, Interpolation, MAX_POINTS};
use joint_units::{Joint, Radians, Volts};

use crate::setup::sensors::{JointSensor, JointSensors, JointSensorsError, SENSORS};
use crate::store::flash_record::{FlashRecordError, Framed, WordReader, bytes_of, open};
use crate::store::record_name::RecordName;

/// Bytes of the longest record.
pub const MAX_BYTES: usize = bytes_of(MAX_WORDS);

/// First bytes of a record.
pub const MAGIC: [u8; 4] = *b"FFSN";
const SCHEMA: u16 = 2;
const KIND: u16 = 1;
/// Words of a sensor without its points.
const HEAD_WORDS: usize = 4;
const MAX_WORDS: usize = SENSORS * (HEAD_WORDS + 2 * MAX_POINTS);

/// Why bytes are not a sensor record.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum SensorRecordError {
    /// They are not a complete record.
    Frame(FlashRecordError),
    /// A word of a sensor is not allowed.
    Word {
        /// Index of the sensor, from 0.
        sensor: usize,
        /// Name of the word.
        field: &'static str,
        /// The word.
        word: u32,
    },
    /// The divider of a sensor is not within 0.05 to 20.
    Divider {
        /// Index of the sensor, from 0.
        sensor: usize,
        /// Its divider.
        divider: f32,
    },
    /// The calibration table of a sensor is not allowed.
    Calibration {
        /// Index of the sensor, from 0.
        sensor: usize,
        /// The reason.
        error: CalibrationError,
    },
    /// The set of sensors is not allowed.
    Sensors(JointSensorsError),
}

impl fmt::Display for SensorRecordError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Frame(error @ (FlashRecordError::Schema { .. } | FlashRecordError::Kind { .. })) => {
                write!(f, "{error}; make the record again with `footfall pack`")
            }
            Self::Frame(error) => write!(f, "{error}"),
            Self::Word { sensor, field, word } => {
                let allowed = match *field {
                    "joint" => "0 to 3",
                    "interpolation" => "0 or 1",
                    _ => "2 to 32",
                };
                write!(f, "sensor {}: {field} is {word}; allowed is {allowed}", sensor.saturating_add(1))
            }
            Self::Divider { sensor, divider } => {
                write!(f, "sensor {}: divider is {divider}; allowed is 0.05 to 20", sensor.saturating_add(1))
            }
            Self::Calibration { sensor, error } => write!(f, "sensor {}: {error}", sensor.saturating_add(1)),
            Self::Sensors(error) => write!(f, "{error}"),
        }
    }
}

impl core::error::Error for SensorRecordError {}

impl From<FlashRecordError> for SensorRecordError {
    fn from(error: FlashRecordError) -> Self {
        Self::Frame(error)
    }
}

/// A sensor record.
pub type Record = Framed<MAX_BYTES>;

/// Sensors read from a record, with the name and the checksum that identify it.
#[derive(Debug, Clone, PartialEq)]
pub struct Stored {
    /// The sensors.
    pub sensors: JointSensors,
    /// Name of the record.
    pub name: RecordName,
    /// Checksum of the record.
    pub crc: u32,
}

/// Makes the record of sensors.
#[must_use]
pub fn record_of(sensors: &JointSensors, name: &RecordName) -> Record {
    Record::new(MAGIC, SCHEMA, KIND, name, |record| {
        for sensor in sensors.iter() {
            let points = sensor.calibration.points();
            record.push(sensor.joint as u32);
            record.push(match sensor.calibration.interpolation() {
                Interpolation::Linear => 0,
                Interpolation::MonotoneCubic => 1,
            });
            record.floats(&[sensor.divider]);
            record.push(points.len() as u32);
            points.iter().for_each(|point| record.floats(&[point.volts.0, point.angle.0]));
        }
    })
}

/// Reads the record of a sector; `None` if all of the sector is erased.
///
/// ```
/// use joint_loop::store::sensor_record::{read, record_of};
/// use joint_loop::{JointSensor, JointSensors, RecordName};
/// use joint_units::Joint;
/// let sensors = JointSensors::build([JointSensor::uncalibrated(Joint::RightHip).unwrap()]).unwrap();
/// let name = RecordName::new("hip goniometer").unwrap();
/// let record = record_of(&sensors, &name);
/// let stored = read(record.bytes())?.unwrap();
/// assert_eq!((stored.sensors, stored.name, stored.crc), (sensors, name, record.crc()));
/// assert_eq!(read(&[0xFF; 64]), Ok(None));
/// assert!(read(b"FFWK, a generator").unwrap_err().to_string().contains("begins with FFSN"));
/// # Ok::<(), joint_loop::store::sensor_record::SensorRecordError>(())
/// ```
///
/// # Errors
/// [`SensorRecordError`] names the first part that is not allowed.
pub fn read(sector: &[u8]) -> Result<Option<Stored>, SensorRecordError> {
    let is_known = |kind, words: u32| kind == KIND && (1..=MAX_WORDS as u32).contains(&words);
    let Some(mut found) = open(sector, MAGIC, SCHEMA, is_known)? else { return Ok(None) };
    let mut channels = [const { None }; SENSORS];
    for (place, channel) in channels.iter_mut().enumerate() {
        if found.words.is_empty() {
            break;
        }
        *channel = Some(sensor(place, &mut found.words)?);
    }
    if !found.words.is_empty() {
        return Err(SensorRecordError::Sensors(JointSensorsError::Count(SENSORS + 1)));
    }
    let sensors = JointSensors::build(channels.into_iter().flatten()).map_err(SensorRecordError::Sensors)?;
    Ok(Some(Stored { sensors, name: found.name, crc: found.crc }))
}

fn sensor(place: usize, words: &mut WordReader<'_>) -> Result<JointSensor, SensorRecordError> {
    let wrong = |field, word| SensorRecordError::Word { sensor: place, field, word };
    let word = words.word()?;
    let joint = Joint::ALL.get(word as usize).copied().ok_or(wrong("joint", word))?;
    let interpolation = match words.word()? {
        0 => Interpolation::Linear,
        1 => Interpolation::MonotoneCubic,
        word => return Err(wrong("interpolation", word)),
    };
    let divider = words.float()?;
    // NaN is refused too.
    if !(0.05..=20.0).contains(&divider) {
        return Err(SensorRecordError::Divider { sensor: place, divider });
    }
    let count = words.word()?;
    let mut points = [CalibrationPoint::default(); MAX_POINTS];
    let used = points.get_mut(..count as usize).ok_or(wrong("points", count))?;
    for point in used.iter_mut() {
        let [volts, angle] = words.floats()?;
        *point = CalibrationPoint { volts: Volts(volts), angle: Radians(angle) };
    }
    let calibration = Calibration::new(used, interpolation)
        .map_err(|error| SensorRecordError::Calibration { sensor: place, error })?;
    Ok(JointSensor { joint, divider, calibration })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    const NAME: RecordName = RecordName::literal("a test");

    fn four() -> JointSensors {
        let mut sensors = Joint::ALL.map(|joint| JointSensor::uncalibrated(joint).expect("monotone"));
        let points = [(0.5, 1.25), (1.5, 0.1), (2.75, -0.3)];
        let points = points.map(|(volts, angle)| CalibrationPoint { volts: Volts(volts), angle: Radians(angle) });
        sensors[1].calibration = Calibration::new(&points, Interpolation::Linear).expect("falls");
        sensors[1].divider = 1.5;
        JointSensors::build(sensors).expect("four")
    }

    /// A record of these words with a correct checksum.
    fn of_words(words: &[u32]) -> Record {
        Record::new(MAGIC, SCHEMA, KIND, &NAME, |record| words.iter().for_each(|word| record.push(*word)))
    }

    fn words_of(record: &Record) -> Vec<u32> {
        let bytes = record.bytes();
        bytes[36..bytes.len() - 8].chunks(4).map(|word| u32::from_le_bytes(word.try_into().expect("four"))).collect()
    }

    #[test]
    fn sensors_are_read_back_and_a_changed_bit_is_found() {
        let record = record_of(&four(), &NAME);
        let stored = read(record.bytes()).expect("whole").expect("there");
        assert_eq!((&stored.sensors, stored.crc), (&four(), record.crc()));
        let sector = [record.bytes(), &[0xFF; 100]].concat();
        assert_eq!(read(&sector).expect("whole"), Some(stored));
        let bytes = record.bytes();
        for bit in 0..bytes.len() * 8 {
            let mut changed = bytes.to_vec();
            changed[bit / 8] ^= 1 << (bit % 8);
            assert!(read(&changed).is_err(), "bit {bit}");
        }
        for length in 0..bytes.len() {
            assert!(read(&bytes[..length]).is_err(), "{length} bytes");
        }
    }

    /// Wrong words with a correct checksum.
    #[test]
    fn each_wrong_word_is_named() {
        let good = words_of(&record_of(&four(), &NAME));
        let refusal = |place: usize, word: u32| {
            let mut words = good.clone();
            words[place] = word;
            read(of_words(&words).bytes()).expect_err("wrong").to_string()
        };
        assert_eq!(refusal(0, 4), "sensor 1: joint is 4; allowed is 0 to 3");
        assert_eq!(refusal(0, 1), "two sensors on right_hip; allowed is one a joint");
        assert_eq!(refusal(1, 2), "sensor 1: interpolation is 2; allowed is 0 or 1");
        assert_eq!(refusal(2, f32::NAN.to_bits()), "sensor 1: divider is NaN; allowed is 0.05 to 20");
        assert_eq!(refusal(3, 33), "sensor 1: points is 33; allowed is 2 to 32");
        assert!(refusal(3, 1).starts_with("sensor 1: 1 points: allowed is 2 to 32"));
        assert!(refusal(4, f32::NAN.to_bits()).starts_with("sensor 1: points[0].volts: not a finite number"));
        // One more point than the record has: it ends within the last sensor.
        let last = good.len() - 1 - 2 * 17;
        assert_eq!(refusal(last, 18), "damaged: ends before its commit word; write it again");
        let five = [good.clone(), good[..4 + 2 * 17].to_vec()].concat();
        let error = read(of_words(&five[..MAX_WORDS.min(five.len())]).bytes()).expect_err("five");
        assert_eq!(error, SensorRecordError::Sensors(JointSensorsError::Count(5)));
    }

    /// Four sensors with 32 points each are the longest record; none, one word more and another kind are refused by their head.
    #[test]
    fn kinds_and_lengths_that_are_not_known_are_refused() {
        const LONGEST: usize = 4 * (4 + 2 * 32);
        let framed = |kind, words: usize| {
            Framed::<{ bytes_of(LONGEST + 1) }>::new(MAGIC, SCHEMA, kind, &NAME, |record| {
                (0..words).for_each(|_| record.push(0));
            })
        };
        assert_eq!(MAX_BYTES, bytes_of(LONGEST));
        for (kind, words) in [(KIND, 0), (KIND, LONGEST + 1), (KIND + 1, 1), (0, LONGEST)] {
            let unknown = FlashRecordError::Kind { kind, words: words as u32 };
            assert_eq!(read(framed(kind, words).bytes()), Err(SensorRecordError::Frame(unknown)));
        }
    }

    proptest! {
        #[test]
        fn no_words_panic(words in prop::collection::vec(any::<u32>(), 0..80), places in prop::collection::vec((0usize..120, 0u32..40), 0..4)) {
            let _ = read(of_words(&words).bytes());
            let mut near = words_of(&record_of(&four(), &NAME));
            for (place, word) in places {
                near[place] = word;
            }
            let _ = read(of_words(&near).bytes());
        }
    }
}
