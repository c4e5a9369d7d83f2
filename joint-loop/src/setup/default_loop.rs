//! The loop that ships: the worn sensors, a walker and the servos. The firmware and every host replay build it here, so that the
//! same inputs give the same bits.

use core::fmt;

use cpg_core::BuildError;
use hgod_adc::{CalibrationError, Sensor, SensorError};
use joint_units::{AdcCode, Joint, Period, Volts};

use crate::setup::sensors::{JointSensor, JointSensors, JointSensorsError, SENSOR_JOINT, SENSORS};
use crate::{BoardGenerator, GeneratorConfig, JointLoop, LoopConfig, LoopError};

/// The loop that the firmware runs: whichever walker its parameters name, and the sensors.
pub type BoardLoop = JointLoop<BoardGenerator, SENSORS>;

/// What a board is told by its two parameter sectors: everything about it that is not compiled in.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    /// Which walker.
    pub generator: GeneratorConfig,
    /// Which sensors.
    pub sensors: JointSensors,
}

impl Parameters {
    /// What a board does whose sectors are, or one of which is, erased: the default walk; one sensor with the published curve, on the
    /// joint that the walker follows if it follows one, else on [`SENSOR_JOINT`].
    ///
    /// # Errors
    /// None in a program that passes its tests.
    pub fn with_defaults(
        generator: Option<GeneratorConfig>,
        sensors: Option<JointSensors>,
    ) -> Result<Self, BoardLoopError> {
        let generator = generator.unwrap_or(GeneratorConfig::default_walk());
        let sensors = match sensors {
            Some(sensors) => sensors,
            None => {
                let joint = generator.follows().unwrap_or(SENSOR_JOINT);
                let one = JointSensor::uncalibrated(joint).map_err(BoardLoopError::Calibration)?;
                JointSensors::build([one]).map_err(BoardLoopError::Sensors)?
            }
        };
        Ok(Self { generator, sensors })
    }
}

/// Why the shipped configuration was refused: on a chip whose factory values cannot be read, or after a change that does not fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BoardLoopError {
    /// The calibration table that ships.
    Calibration(CalibrationError),
    /// The sensors do not go together.
    Sensors(JointSensorsError),
    /// A sensor.
    Sensor {
        /// The joint that it is worn on.
        joint: Joint,
        /// Why.
        error: SensorError,
    },
    /// The walker follows a joint that no sensor is worn on.
    NoSensor(Joint),
    /// The walk.
    Walk(BuildError),
    /// The loop.
    Loop(LoopError),
}

impl fmt::Display for BoardLoopError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            BoardLoopError::Calibration(error) => write!(f, "calibration: {error}"),
            BoardLoopError::Sensors(error) => write!(f, "sensors: {error}"),
            BoardLoopError::Sensor { joint, error } => write!(f, "sensor on {}: {error}", joint.name()),
            BoardLoopError::NoSensor(joint) => {
                write!(f, "the walker follows {0}, and no sensor is worn on it; allowed is one on {0}", joint.name())
            }
            BoardLoopError::Walk(error) => write!(f, "walk: {error}"),
            BoardLoopError::Loop(error) => write!(f, "loop: {error}"),
        }
    }
}

impl core::error::Error for BoardLoopError {}

/// The loop, disarmed. Without `sensor_required` it walks whatever the sensors say.
///
/// ```
/// use joint_loop::setup::default_loop::{Parameters, board_loop};
/// use joint_loop::{SENSORS, Sample, SupervisorState};
/// use joint_units::{AdcCode, Volts};
/// let default = Parameters::with_defaults(None, None)?;
/// let mut walk = board_loop(&default, AdcCode(1501), Volts(2.7), true)?;
/// // 1.5 V at a supply of 3.0 V: the middle of the potentiometer.
/// let sample = Sample { codes: [AdcCode(2048); SENSORS], vrefint: AdcCode(1651), ..Sample::default() };
/// for _ in 0..100 {
///     assert_eq!(walk.tick(&sample).pulses, None);
/// }
/// assert_eq!(walk.frame().state, SupervisorState::Disarmed);
/// assert!(walk.frame().measured[0].degrees().abs() < 0.5);
/// // Of the four channels, one has a sensor.
/// assert_eq!(walk.frame().validity.map(|verdict| verdict.is_some()), [true, false, false, false]);
///
/// let refusal = board_loop(&default, AdcCode(0xFFFF), Volts(2.7), true).unwrap_err();
/// assert_eq!(refusal.to_string(), "sensor on left_knee: reference.vrefint_cal = 65535: allowed is 1365 to 1613");
/// # Ok::<(), joint_loop::setup::default_loop::BoardLoopError>(())
/// ```
///
/// # Errors
/// [`BoardLoopError`] says what does not fit.
pub fn board_loop(
    parameters: &Parameters,
    vrefint_cal: AdcCode,
    min_supply: Volts,
    sensor_required: bool,
) -> Result<BoardLoop, BoardLoopError> {
    let mut config = LoopConfig::default_biped();
    config.monitor.sensor_required = sensor_required;
    if parameters.generator.follows().is_some() {
        // It goes on without a sensor for two seconds, then stands, and walks again when the sensor is back.
        config.monitor.sensor_tolerance_s = f32::INFINITY;
    }
    board_loop_with(&config, parameters, vrefint_cal, min_supply)
}

/// The same with other parameters of the loop; which sensor the walker listens to is not one of them.
///
/// # Errors
/// [`BoardLoopError`] says what does not fit.
pub fn board_loop_with(
    config: &LoopConfig,
    parameters: &Parameters,
    vrefint_cal: AdcCode,
    min_supply: Volts,
) -> Result<BoardLoop, BoardLoopError> {
    let walk = parameters.generator.build(Period::MILLISECOND).map_err(BoardLoopError::Walk)?;
    let gait_sensor = match parameters.generator.follows() {
        Some(joint) => parameters.sensors.channel_of(joint).ok_or(BoardLoopError::NoSensor(joint))?,
        None => 0,
    };
    let mut sensors: [Option<Sensor>; SENSORS] = [const { None }; SENSORS];
    for (sensor, worn) in sensors.iter_mut().zip(parameters.sensors.iter()) {
        let built = worn.build(vrefint_cal, min_supply);
        *sensor = Some(built.map_err(|error| BoardLoopError::Sensor { joint: worn.joint, error })?);
    }
    LoopConfig { gait_sensor, ..*config }.build(Period::MILLISECOND, walk, sensors).map_err(BoardLoopError::Loop)
}
