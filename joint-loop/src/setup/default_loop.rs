//! The default loop of a board: its sensors, a generator and the servos. Firmware and host replay both build it here, so that
//! the same inputs give the same bits.

use core::fmt;
use core::mem::MaybeUninit;

use cpg_core::BuildError;
use hgod_adc::{CalibrationError, ReferenceConfig, ReferenceError, Sensor, SensorError};
use joint_units::{AdcCode, Joint, Period, Volts};

use crate::control::fault_table::FOLLOWER_LOST_MS;
use crate::control::monitor::LONGEST_TOLERANCE_S;
use crate::motion::feedback::FeedbackConfig;
use crate::setup::robot_config::RobotConfig;
use crate::setup::sensors::{JointSensor, JointSensors, JointSensorsError, SENSOR_JOINT, SENSORS};
use crate::{BoardGenerator, GeneratorConfig, JointLoop, LoopConfig, LoopError};

/// The loop that the firmware runs, with any generator of a board.
pub type BoardLoop = JointLoop<BoardGenerator, SENSORS>;

/// Parameters of a board, from its three records.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    /// Generator.
    pub generator: GeneratorConfig,
    /// Sensors.
    pub sensors: JointSensors,
    /// Robot.
    pub robot: RobotConfig,
}

impl Parameters {
    /// Replaces missing records (erased sectors) by defaults: the default walk, and one uncalibrated sensor on the joint that the
    /// generator follows, or on [`SENSOR_JOINT`] if the generator is no follower. A robot has no default: pulses for the servos of another
    /// robot could be beyond their stops.
    ///
    /// # Errors
    /// [`BoardLoopError`] if the default sensor is not allowed; a test shows that it is.
    pub fn with_defaults(
        generator: Option<GeneratorConfig>,
        sensors: Option<JointSensors>,
        robot: RobotConfig,
    ) -> Result<Self, BoardLoopError> {
        let generator = generator.unwrap_or(GeneratorConfig::default_walk());
        let sensors = match sensors {
            Some(sensors) => sensors,
            None => Self::default_sensors(&generator)?,
        };
        Ok(Self { generator, sensors, robot })
    }

    /// The sensors of a board without a record of sensors: one that is not calibrated, on the joint that the generator follows, or on
    /// [`SENSOR_JOINT`] if it is no follower.
    ///
    /// # Errors
    /// As [`Parameters::with_defaults`].
    pub fn default_sensors(generator: &GeneratorConfig) -> Result<JointSensors, BoardLoopError> {
        let joint = generator.follows().unwrap_or(SENSOR_JOINT);
        let one = JointSensor::uncalibrated(joint).map_err(BoardLoopError::Calibration)?;
        JointSensors::build([one]).map_err(BoardLoopError::Sensors)
    }
}

/// Why the loop of a board could not be built.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum BoardLoopError {
    /// The default calibration table is not allowed.
    Calibration(CalibrationError),
    /// The set of sensors is not allowed.
    Sensors(JointSensorsError),
    /// A sensor is not allowed.
    Sensor {
        /// Its joint.
        joint: Joint,
        /// The reason.
        error: SensorError,
    },
    /// The internal reference of the chip, or the least supply, is not allowed.
    Reference(ReferenceError),
    /// The generator follows a joint without a sensor.
    NoSensor(Joint),
    /// The generator is not allowed.
    Generator(BuildError),
    /// The configuration of the loop is not allowed.
    Loop(LoopError),
}

impl fmt::Display for BoardLoopError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            BoardLoopError::Calibration(error) => write!(f, "calibration: {error}"),
            BoardLoopError::Sensors(error) => write!(f, "sensors: {error}"),
            BoardLoopError::Sensor { joint, error } => write!(f, "sensor on {}: {error}", joint.name()),
            BoardLoopError::Reference(error) => write!(f, "{error}"),
            BoardLoopError::NoSensor(joint) => {
                write!(f, "the generator follows {0}, which has no sensor; allowed is a sensor on {0}", joint.name())
            }
            BoardLoopError::Generator(error) => write!(f, "generator: {error}"),
            BoardLoopError::Loop(error) => write!(f, "loop: {error}"),
        }
    }
}

impl core::error::Error for BoardLoopError {}

/// Builds the loop of a board, before its first tick, at a control period of 1 ms.
///
/// `vrefint_cal` is the factory's code of the chip's internal reference, `min_supply` the lowest supply at which a sample can be good, see
/// [`RobotConfig::min_supply_on`]. With `sensor_required` the joints move only while the sensors are good; a follower
/// may lose them for [`FOLLOWER_LOST_MS`], or longer by [`crate::FollowerRules`]. The emergency stop must be tested before the first arming ([`crate::control::stop_test`]), and the
/// clock of the watchdog measured ([`crate::control::watchdog_clock`]).
///
/// ```
/// use joint_loop::setup::default_loop::{Parameters, board_loop};
/// use joint_loop::{RobotConfig, SENSORS, Sample, SupervisorState};
/// use joint_units::{AdcCode, Volts};
/// let default = Parameters::with_defaults(None, None, RobotConfig::default_biped())?;
/// let mut joints = board_loop(&default, AdcCode(1501), Volts(2.7), true)?;
/// // 1.5 V at a supply of 3.0 V: the middle of the potentiometer.
/// let sample = Sample { codes: [AdcCode(2048); SENSORS], vrefint: AdcCode(1651), ..Sample::default() };
/// for _ in 0..100 {
///     assert_eq!(joints.tick(&sample).pulses, None);
/// }
/// assert_eq!(joints.frame().state, SupervisorState::Disarmed);
/// assert!(joints.frame().measured[0].degrees().abs() < 0.5);
/// // Of the four channels, one has a sensor.
/// assert_eq!(joints.frame().validity.map(|validity| validity.is_some()), [true, false, false, false]);
///
/// let error = board_loop(&default, AdcCode(0xFFFF), Volts(2.7), true).unwrap_err();
/// assert_eq!(error.to_string(), "sensor on left_knee: reference.vrefint_cal = 65535: allowed is 1365 to 1613");
/// # Ok::<(), joint_loop::setup::default_loop::BoardLoopError>(())
/// ```
///
/// # Errors
/// [`BoardLoopError`] names the part that is not allowed.
// Inlined into the caller, its temporaries would take the stack of the whole program.
#[inline(never)]
pub fn board_loop(
    parameters: &Parameters,
    vrefint_cal: AdcCode,
    min_supply: Volts,
    sensor_required: bool,
) -> Result<BoardLoop, BoardLoopError> {
    board_loop_with(&board_config(parameters, sensor_required), parameters, vrefint_cal, min_supply)
}

/// [`board_loop`] in the place where the loop stays: it is large, and on the way from one place to another it would take its size of the stack again.
///
/// # Errors
/// [`BoardLoopError`] names the part that is not allowed; nothing is written then.
#[inline(never)]
pub fn board_loop_at<'a>(
    place: &'a mut MaybeUninit<BoardLoop>,
    parameters: &Parameters,
    vrefint_cal: AdcCode,
    min_supply: Volts,
    sensor_required: bool,
) -> Result<&'a mut BoardLoop, BoardLoopError> {
    let parts = parts_of(&board_config(parameters, sensor_required), parameters, vrefint_cal, min_supply)?;
    // Not `map_err`: what it is given and what it returns would both be on the stack.
    match parts.config.build(Period::MILLISECOND, parts.generator, parts.sensors) {
        Ok(built) => Ok(place.write(built)),
        Err(error) => Err(BoardLoopError::Loop(error)),
    }
}

/// The configuration of a board's loop.
fn board_config(parameters: &Parameters, sensor_required: bool) -> LoopConfig {
    let mut config = LoopConfig::of(&parameters.robot);
    config.monitor.sensor_required = sensor_required;
    config.monitor.stop_test_required = true;
    config.monitor.watchdog_clock_required = true;
    if parameters.generator.follows().is_some() {
        // Without a sensor a follower continues for two seconds, then stands, and follows again when the sensor is good before this time. If the robot
        // may walk again later, the time of the stand ends it.
        config.monitor.sensor_tolerance_s = if parameters.robot.follower.walks_again_after_lost_sensor {
            LONGEST_TOLERANCE_S
        } else {
            f32::from(FOLLOWER_LOST_MS) / 1000.0
        };
    }
    config
}

/// Builds the loop of a board with another loop configuration than that of its robot. `gait_sensor` is set to the channel that the generator follows,
/// the channels of `feedback` to those of the sensors, and `supply` to the chip's reference.
///
/// # Errors
/// [`BoardLoopError`] names the part that is not allowed.
pub fn board_loop_with(
    config: &LoopConfig,
    parameters: &Parameters,
    vrefint_cal: AdcCode,
    min_supply: Volts,
) -> Result<BoardLoop, BoardLoopError> {
    let parts = parts_of(config, parameters, vrefint_cal, min_supply)?;
    parts.config.build(Period::MILLISECOND, parts.generator, parts.sensors).map_err(BoardLoopError::Loop)
}

/// What a loop is built of.
struct Parts {
    config: LoopConfig,
    generator: BoardGenerator,
    sensors: [Option<Sensor>; SENSORS],
}

/// Checks the parameters and builds the parts: what both ways to build a loop share.
fn parts_of(
    config: &LoopConfig,
    parameters: &Parameters,
    vrefint_cal: AdcCode,
    min_supply: Volts,
) -> Result<Parts, BoardLoopError> {
    let generator = parameters.generator.build(Period::MILLISECOND).map_err(BoardLoopError::Generator)?;
    let gait_sensor = match parameters.generator.follows() {
        Some(joint) => parameters.sensors.channel_of(joint).ok_or(BoardLoopError::NoSensor(joint))?,
        None => 0,
    };
    let mut sensors: [Option<Sensor>; SENSORS] = [const { None }; SENSORS];
    for (sensor, config) in sensors.iter_mut().zip(parameters.sensors.iter()) {
        let built = config.build(vrefint_cal, min_supply);
        *sensor = Some(built.map_err(|error| BoardLoopError::Sensor { joint: config.joint, error })?);
    }
    let reference = ReferenceConfig { min_supply, ..ReferenceConfig::stm32f4(vrefint_cal) };
    let supply = Some(reference.build().map_err(BoardLoopError::Reference)?);
    let channel = Joint::ALL.map(|joint| parameters.sensors.channel_of(joint));
    let feedback = FeedbackConfig { channel, ..config.feedback };
    Ok(Parts { config: LoopConfig { gait_sensor, feedback, supply, ..*config }, generator, sensors })
}
