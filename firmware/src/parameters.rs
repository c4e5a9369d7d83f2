//! Reads the board's parameters: generator, sensors and robot, each from a flash sector of its own. Where the sector is erased, generator and
//! sensors are the built-in ones; there is no built-in robot.

use firmware::board::{GENERATOR_SECTOR, ROBOT_SECTOR, SECTOR_BYTES, SENSORS_SECTOR};
use joint_loop::RecordName;
use joint_loop::setup::default_loop::{BoardLoopError, Parameters};
use joint_loop::store::{generator_record, robot_record, sensor_record};
use wire::{RecordId, Subject};

const _: () = assert!(
    generator_record::MAX_BYTES <= SECTOR_BYTES
        && sensor_record::MAX_BYTES <= SECTOR_BYTES
        && robot_record::MAX_BYTES <= SECTOR_BYTES
);

/// What the board runs, and what identifies it.
pub(crate) struct Loaded {
    pub(crate) parameters: Parameters,
    pub(crate) generator: RecordId,
    pub(crate) sensors: RecordId,
    pub(crate) robot: RecordId,
}

/// Why the board has no parameters.
pub(crate) enum NoParameters {
    /// The first sector is neither erased nor a generator record.
    Generator(generator_record::GeneratorRecordError),
    /// The second sector is neither erased nor a sensor record.
    Sensors(sensor_record::SensorRecordError),
    /// The third sector is neither erased nor a robot record.
    Robot(robot_record::RobotRecordError),
    /// The third sector is erased.
    NoRobot,
    /// The built-in parameters are refused.
    BuiltIn(BoardLoopError),
}

impl NoParameters {
    /// What is refused.
    pub(crate) fn subject(&self) -> Subject {
        match self {
            Self::Generator(_) => Subject::GeneratorRecord,
            Self::Sensors(_) => Subject::SensorRecord,
            Self::Robot(_) | Self::NoRobot => Subject::RobotRecord,
            Self::BuiltIn(_) => Subject::Configuration,
        }
    }
}

impl core::fmt::Display for NoParameters {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Generator(error) => write!(f, "{error}"),
            Self::Sensors(error) => write!(f, "{error}"),
            Self::Robot(error) => write!(f, "{error}"),
            Self::NoRobot => f.write_str("no robot record; `cargo xtask flash` writes one"),
            Self::BuiltIn(refusal) => write!(f, "{refusal}"),
        }
    }
}

/// Reads the three sectors. Only a sector that is erased from end to end selects the built-in generator or sensors; one with other contents
/// is an error, because this board was set up for others.
pub(crate) fn read() -> Result<Loaded, NoParameters> {
    let generator = generator_record::read(sector(GENERATOR_SECTOR)).map_err(NoParameters::Generator)?;
    let sensors = sensor_record::read(sector(SENSORS_SECTOR)).map_err(NoParameters::Sensors)?;
    let robot = robot_record::read(sector(ROBOT_SECTOR)).map_err(NoParameters::Robot)?.ok_or(NoParameters::NoRobot)?;
    let id = |name: &RecordName, crc| RecordId::new(name.as_str(), crc);
    let generator_id = generator.as_ref().map(|stored| id(&stored.name, stored.crc));
    let sensors_id = sensors.as_ref().map(|stored| id(&stored.name, stored.crc));
    let (generator, sensors) = (generator.map(|stored| stored.config), sensors.map(|stored| stored.sensors));
    let parameters = Parameters::with_defaults(generator, sensors, robot.robot).map_err(NoParameters::BuiltIn)?;
    let built_in = &RecordName::BUILT_IN;
    Ok(Loaded {
        generator: generator_id
            .unwrap_or_else(|| id(built_in, generator_record::record_of(&parameters.generator, built_in).crc())),
        sensors: sensors_id
            .unwrap_or_else(|| id(built_in, sensor_record::record_of(&parameters.sensors, built_in).crc())),
        robot: id(&robot.name, robot.crc),
        parameters,
    })
}

/// A whole sector.
#[cfg(target_os = "none")]
fn sector(address: u32) -> &'static [u8] {
    // SAFETY: flash, mapped and readable from reset on (RM0090 table 5); the program is linked around these sectors (memory.x) and writes no
    // flash.
    unsafe { core::slice::from_raw_parts(address as *const u8, SECTOR_BYTES) }
}

/// The host has no flash.
#[cfg(not(target_os = "none"))]
fn sector(_address: u32) -> &'static [u8] {
    &[0xFF; SECTOR_BYTES]
}
