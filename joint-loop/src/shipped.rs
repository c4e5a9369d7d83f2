//! The loop that ships: the worn sensors, a walker and the servos. The firmware and every host replay build it here, so that the
//! same inputs give the same bits.

use core::fmt;

use cpg_core::BuildError;
use hgod_adc::{CalibrationError, Sensor, SensorError};
use joint_units::{AdcCode, Joint, Period, Volts};

use crate::worn::{SENSOR_JOINT, SENSORS, WornError, WornSensor, WornSensors};
use crate::{JointLoop, LoopConfig, LoopError, Walker, WalkerConfig};

/// The loop that the firmware runs: whichever walker its parameters name, and the sensors.
pub type WalkLoop = JointLoop<Walker, SENSORS>;

/// What a board is told by its two parameter sectors: everything about it that is not compiled in.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    /// Which walker.
    pub walker: WalkerConfig,
    /// Which sensors.
    pub worn: WornSensors,
}

impl Parameters {
    /// What a board does whose sectors are, or one of which is, erased: the default walk; one sensor with the published curve, on the
    /// joint that the walker follows if it follows one, else on [`SENSOR_JOINT`].
    ///
    /// # Errors
    /// None in a program that passes its tests.
    pub fn or_default(walker: Option<WalkerConfig>, worn: Option<WornSensors>) -> Result<Self, Refusal> {
        let walker = walker.unwrap_or(WalkerConfig::default_walk());
        let worn = match worn {
            Some(worn) => worn,
            None => {
                let joint = walker.follows().unwrap_or(SENSOR_JOINT);
                let one = WornSensor::uncalibrated(joint).map_err(Refusal::Calibration)?;
                WornSensors::build([one]).map_err(Refusal::Worn)?
            }
        };
        Ok(Self { walker, worn })
    }
}

/// Why the shipped configuration was refused: on a chip whose factory values cannot be read, or after a change that does not fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Refusal {
    /// The calibration table that ships.
    Calibration(CalibrationError),
    /// The sensors do not go together.
    Worn(WornError),
    /// A sensor.
    Sensor {
        /// The joint that it is worn on.
        joint: Joint,
        /// Why.
        error: SensorError,
    },
    /// The walker follows a joint that no sensor is worn on.
    NotWorn(Joint),
    /// The walk.
    Walk(BuildError),
    /// The loop.
    Loop(LoopError),
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Refusal::Calibration(error) => write!(f, "calibration: {error}"),
            Refusal::Worn(error) => write!(f, "sensors: {error}"),
            Refusal::Sensor { joint, error } => write!(f, "sensor on {}: {error}", joint.name()),
            Refusal::NotWorn(joint) => {
                write!(f, "the walker follows {0}, and no sensor is worn on it; allowed is one on {0}", joint.name())
            }
            Refusal::Walk(error) => write!(f, "walk: {error}"),
            Refusal::Loop(error) => write!(f, "loop: {error}"),
        }
    }
}

impl core::error::Error for Refusal {}

/// The loop, disarmed. Without `sensor_required` it walks whatever the sensors say.
///
/// ```
/// use joint_loop::shipped::{Parameters, walk_loop};
/// use joint_loop::{SENSORS, Sample, State};
/// use joint_units::{AdcCode, Volts};
/// let default = Parameters::or_default(None, None)?;
/// let mut walk = walk_loop(&default, AdcCode(1501), Volts(2.7), true)?;
/// // 1.5 V at a supply of 3.0 V: the middle of the potentiometer.
/// let sample = Sample { codes: [AdcCode(2048); SENSORS], vrefint: AdcCode(1651), ..Sample::default() };
/// for _ in 0..100 {
///     assert_eq!(walk.tick(&sample).pulses, None);
/// }
/// assert_eq!(walk.frame().state, State::Disarmed);
/// assert!(walk.frame().measured[0].degrees().abs() < 0.5);
/// // Of the four channels, one has a sensor.
/// assert_eq!(walk.frame().verdict.map(|verdict| verdict.is_some()), [true, false, false, false]);
///
/// let refusal = walk_loop(&default, AdcCode(0xFFFF), Volts(2.7), true).unwrap_err();
/// assert_eq!(refusal.to_string(), "sensor on left_knee: reference.vrefint_cal = 65535: allowed is 1365 to 1613");
/// # Ok::<(), joint_loop::shipped::Refusal>(())
/// ```
///
/// # Errors
/// [`Refusal`] says what does not fit.
pub fn walk_loop(
    parameters: &Parameters,
    vrefint_cal: AdcCode,
    min_supply: Volts,
    sensor_required: bool,
) -> Result<WalkLoop, Refusal> {
    let mut config = LoopConfig::default_biped();
    config.watch.sensor_required = sensor_required;
    if parameters.walker.follows().is_some() {
        // It goes on without a sensor for two seconds, then stands, and walks again when the sensor is back.
        config.watch.sensor_tolerance_s = f32::INFINITY;
    }
    walk_loop_with(&config, parameters, vrefint_cal, min_supply)
}

/// The same with other parameters of the loop; which sensor the walker listens to is not one of them.
///
/// # Errors
/// [`Refusal`] says what does not fit.
pub fn walk_loop_with(
    config: &LoopConfig,
    parameters: &Parameters,
    vrefint_cal: AdcCode,
    min_supply: Volts,
) -> Result<WalkLoop, Refusal> {
    let walk = parameters.walker.build(Period::MILLISECOND).map_err(Refusal::Walk)?;
    let gait_sensor = match parameters.walker.follows() {
        Some(joint) => parameters.worn.channel_of(joint).ok_or(Refusal::NotWorn(joint))?,
        None => 0,
    };
    let mut sensors: [Option<Sensor>; SENSORS] = [const { None }; SENSORS];
    for (sensor, worn) in sensors.iter_mut().zip(parameters.worn.iter()) {
        let built = worn.build(vrefint_cal, min_supply);
        *sensor = Some(built.map_err(|error| Refusal::Sensor { joint: worn.joint, error })?);
    }
    LoopConfig { gait_sensor, ..*config }.build(Period::MILLISECOND, walk, sensors).map_err(Refusal::Loop)
}
