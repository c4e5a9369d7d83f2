//! The board's parameters: walker and sensors, each from a flash sector of its own, or built in where that is erased.

use joint_loop::setup::default_loop::{BoardLoopError, Parameters};
use joint_loop::store::{generator_record, sensor_record};

/// Why the board has no parameters.
pub(crate) enum NoParameters {
    /// The first sector holds something else than a walker.
    Generator(generator_record::GeneratorRecordError),
    /// The second sector holds something else than sensors.
    Sensors(sensor_record::SensorRecordError),
    /// What is built in is refused.
    BuiltIn(BoardLoopError),
}

impl core::fmt::Display for NoParameters {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Generator(error) => write!(f, "walker: {error}"),
            Self::Sensors(error) => write!(f, "sensors: {error}"),
            Self::BuiltIn(refusal) => write!(f, "{refusal}"),
        }
    }
}

/// What to walk with, and with which sensors. A sector that holds something else is an error, not a reason for what is built in: somebody
/// meant this board to do another thing.
pub(crate) fn read() -> Result<Parameters, NoParameters> {
    let walker = generator_record::read(sector(generator_record::ADDRESS, generator_record::MAX_BYTES));
    let worn = sensor_record::read(sector(sensor_record::ADDRESS, sensor_record::MAX_BYTES));
    let walker = walker.map_err(NoParameters::Generator)?.map(|stored| stored.config);
    let worn = worn.map_err(NoParameters::Sensors)?.map(|stored| stored.sensors);
    Parameters::with_defaults(walker, worn).map_err(NoParameters::BuiltIn)
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
