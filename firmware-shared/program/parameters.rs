//! Reads the board's parameters: generator, sensors and robot, each from a flash sector of its own. Where the sector is erased,
//! they are the built-in ones. The built-in robot fits few: the board says that it runs it, in the log, in its records and by its lamp.

use crate::board::{GENERATOR_SECTOR, ROBOT_SECTOR, SECTOR_BYTES, SENSORS_SECTOR};
use joint_loop::setup::default_loop::{BoardLoopError, Parameters};
use joint_loop::store::{generator_record, robot_record, sensor_record};
use joint_loop::{GeneratorConfig, RecordName, RobotConfig};
use static_cell::StaticCell;
use wire::{RecordId, Subject};

use crate::clocks;

const _: () = assert!(
    generator_record::MAX_BYTES <= SECTOR_BYTES
        && sensor_record::MAX_BYTES <= SECTOR_BYTES
        && robot_record::MAX_BYTES <= SECTOR_BYTES
);

/// What the board runs, and what identifies it.
pub(crate) struct Loaded {
    pub(crate) parameters: &'static Parameters,
    pub(crate) generator: RecordId,
    pub(crate) sensors: RecordId,
    pub(crate) robot: RecordId,
    /// The third sector is erased: the robot is [`RobotConfig::default_biped`].
    pub(crate) built_in_robot: bool,
    /// Check sums of the generator's and the robot's parameters, whatever their records are called: of records with the name `built-in`.
    pub(crate) unnamed: [u32; 2],
}

/// Why the board has no parameters.
pub(crate) enum NoParameters {
    /// The first sector is neither erased nor a generator record.
    Generator(generator_record::GeneratorRecordError),
    /// The second sector is neither erased nor a sensor record.
    Sensors(sensor_record::SensorRecordError),
    /// The third sector is neither erased nor a robot record.
    Robot(robot_record::RobotRecordError),
    /// The built-in parameters are refused.
    BuiltIn(BoardLoopError),
}

impl Loaded {
    /// Whether the robot demands a brown-out reset, and it is off: the board does not arm.
    pub(crate) fn lacks_brown_out_reset(&self) -> bool {
        self.parameters.robot.require_brown_out_reset && clocks::brown_out().level == 0
    }
}

impl NoParameters {
    /// What is refused.
    pub(crate) fn subject(&self) -> Subject {
        match self {
            Self::Generator(_) => Subject::GeneratorRecord,
            Self::Sensors(_) => Subject::SensorRecord,
            Self::Robot(_) => Subject::RobotRecord,
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
            Self::BuiltIn(refusal) => write!(f, "{refusal}"),
        }
    }
}

/// Reads the three sectors; `place` gets the parameters. Only a sector that is erased from end to end selects what is built in;
/// one with other contents is an error, because this board was set up for others.
///
/// Each part is read by a function that is not inlined and written to its place at once: the parameters are large, and copies of them would
/// take more of the stack than everything else. This function is not inlined either: its copies would stay while the loop is built.
#[inline(never)]
pub(crate) fn read(place: &'static StaticCell<Parameters>) -> Result<Loaded, NoParameters> {
    let (robot_config, stored_robot) = read_robot()?;
    let parameters = place.init(built_in(robot_config)?);
    let stored = read_generator(&mut parameters.generator)?;
    let unnamed = [unnamed_generator(&parameters.generator), unnamed_robot(&parameters.robot)];
    let generator = stored.unwrap_or_else(|| id(&RecordName::BUILT_IN, unnamed[0]));
    let sensors = read_sensors(parameters)?;
    let built_in_robot = stored_robot.is_none();
    let robot = stored_robot.unwrap_or_else(|| id(&RecordName::BUILT_IN, unnamed[1]));
    Ok(Loaded { parameters, generator, sensors, robot, built_in_robot, unnamed })
}

fn id(name: &RecordName, crc: u32) -> RecordId {
    RecordId::new(name.as_str(), crc)
}

#[inline(never)]
fn built_in(robot: RobotConfig) -> Result<Parameters, NoParameters> {
    Parameters::with_defaults(None, None, robot).map_err(NoParameters::BuiltIn)
}

#[inline(never)]
fn read_robot() -> Result<(RobotConfig, Option<RecordId>), NoParameters> {
    let stored = robot_record::read(sector(ROBOT_SECTOR)).map_err(NoParameters::Robot)?;
    Ok(stored.map_or((RobotConfig::default_biped(), None), |stored| (stored.robot, Some(id(&stored.name, stored.crc)))))
}

#[inline(never)]
fn read_generator(place: &mut GeneratorConfig) -> Result<Option<RecordId>, NoParameters> {
    let stored = generator_record::read(sector(GENERATOR_SECTOR)).map_err(NoParameters::Generator)?;
    Ok(stored.map(|stored| {
        *place = stored.config;
        id(&stored.name, stored.crc)
    }))
}

#[inline(never)]
fn unnamed_generator(generator: &GeneratorConfig) -> u32 {
    generator_record::record_of(generator, &RecordName::BUILT_IN).crc()
}

#[inline(never)]
fn unnamed_robot(robot: &RobotConfig) -> u32 {
    robot_record::record_of(robot, &RecordName::BUILT_IN).crc()
}

#[inline(never)]
fn read_sensors(parameters: &mut Parameters) -> Result<RecordId, NoParameters> {
    let (sensors, named) = match sensor_record::read(sector(SENSORS_SECTOR)).map_err(NoParameters::Sensors)? {
        Some(stored) => (stored.sensors, Some(id(&stored.name, stored.crc))),
        None => (Parameters::default_sensors(&parameters.generator).map_err(NoParameters::BuiltIn)?, None),
    };
    parameters.sensors = sensors;
    let built_in = || sensor_record::record_of(&parameters.sensors, &RecordName::BUILT_IN).crc();
    Ok(named.unwrap_or_else(|| id(&RecordName::BUILT_IN, built_in())))
}

/// A whole sector.
fn sector(address: u32) -> &'static [u8] {
    flash(address, SECTOR_BYTES)
}

/// Bytes of the flash.
#[cfg(target_os = "none")]
pub(crate) fn flash(address: u32, bytes: usize) -> &'static [u8] {
    // SAFETY: flash, mapped and readable from reset on (RM0090 table 5); the program writes no flash.
    unsafe { core::slice::from_raw_parts(address as *const u8, bytes) }
}

/// The host has no flash.
#[cfg(not(target_os = "none"))]
pub(crate) fn flash(_address: u32, _bytes: usize) -> &'static [u8] {
    &[0xFF; SECTOR_BYTES]
}
