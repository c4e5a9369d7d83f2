//! Reads the board's parameters: generator and sensors, each from a flash sector of its own; the built-in ones where that is erased.

use firmware::board::{GENERATOR_SECTOR, SECTOR_BYTES, SENSORS_SECTOR};
use joint_loop::setup::default_loop::{BoardLoopError, Parameters};
use joint_loop::store::{generator_record, sensor_record};
use wire::Subject;

const _: () = assert!(generator_record::MAX_BYTES <= SECTOR_BYTES && sensor_record::MAX_BYTES <= SECTOR_BYTES);

/// Why the board has no parameters.
pub(crate) enum NoParameters {
    /// The first sector is neither erased nor a generator record.
    Generator(generator_record::GeneratorRecordError),
    /// The second sector is neither erased nor a sensor record.
    Sensors(sensor_record::SensorRecordError),
    /// The built-in parameters are refused.
    BuiltIn(BoardLoopError),
}

impl NoParameters {
    /// What is refused.
    pub(crate) fn subject(&self) -> Subject {
        match self {
            Self::Generator(_) => Subject::GeneratorRecord,
            Self::Sensors(_) => Subject::SensorRecord,
            Self::BuiltIn(_) => Subject::Configuration,
        }
    }
}

impl core::fmt::Display for NoParameters {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Generator(error) => write!(f, "{error}"),
            Self::Sensors(error) => write!(f, "{error}"),
            Self::BuiltIn(refusal) => write!(f, "{refusal}"),
        }
    }
}

/// Reads both sectors. A sector with other contents is an error and does not select the built-in parameters, because this board was set up
/// for others.
pub(crate) fn read() -> Result<Parameters, NoParameters> {
    let generator = generator_record::read(sector(GENERATOR_SECTOR, generator_record::MAX_BYTES));
    let sensors = sensor_record::read(sector(SENSORS_SECTOR, sensor_record::MAX_BYTES));
    let generator = generator.map_err(NoParameters::Generator)?.map(|stored| stored.config);
    let sensors = sensors.map_err(NoParameters::Sensors)?.map(|stored| stored.sensors);
    Parameters::with_defaults(generator, sensors).map_err(NoParameters::BuiltIn)
}

/// The start of a sector.
#[cfg(target_os = "none")]
fn sector(address: u32, bytes: usize) -> &'static [u8] {
    // SAFETY: flash, mapped and readable from reset on (RM0090 table 5); both records are shorter than their sector of 16 KiB; the program
    // is linked around them (memory.x) and writes no flash.
    unsafe { core::slice::from_raw_parts(address as *const u8, bytes) }
}

/// The host has no flash.
#[cfg(not(target_os = "none"))]
fn sector(_address: u32, _bytes: usize) -> &'static [u8] {
    &[0xFF; 4]
}
