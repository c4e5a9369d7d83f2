//! The loop that the firmware ships, on the host: what it takes for granted where there is no board to ask.

use hgod_adc::Sensor;
pub use joint_loop::SENSOR_JOINT;
use joint_loop::setup::default_loop;
pub use joint_loop::setup::default_loop::{BoardLoop, BoardLoopError, Parameters};
use joint_loop::{JointSensor, LoopConfig, SENSORS};
use joint_units::{AdcCode, Volts};

use crate::file::calibration_file::WiredSensor;

/// The pins that the sensors are wired to, straight, from channel 1 on.
pub const SENSOR_PINS: [&str; SENSORS] = ["PA1", "PC1", "PB0", "PB1"];

/// The first of them.
pub const SENSOR_PIN: &str = SENSOR_PINS[0];

/// The factory's reading of the internal reference on a chip whose reference is 1.21 V, at 3.3 V.
pub const TYPICAL_VREFINT_CAL: AdcCode = AdcCode(1502);

/// Supply below which no sample is good on the default board, the STM32F4 Discovery.
pub const TYPICAL_MIN_SUPPLY: Volts = Volts(2.7);

/// The sensor that a typical chip has where nothing else is said.
///
/// # Errors
/// None in a program that passes its tests.
pub fn typical_sensor() -> Result<Sensor, BoardLoopError> {
    let worn = JointSensor::uncalibrated(SENSOR_JOINT).map_err(BoardLoopError::Calibration)?;
    let built = worn.build(TYPICAL_VREFINT_CAL, TYPICAL_MIN_SUPPLY);
    built.map_err(|error| BoardLoopError::Sensor { joint: SENSOR_JOINT, error })
}

/// Its calibration and divider.
///
/// # Errors
/// None in a program that passes its tests.
pub fn wired_sensor() -> Result<WiredSensor, BoardLoopError> {
    let JointSensor { calibration, divider, .. } =
        JointSensor::uncalibrated(SENSOR_JOINT).map_err(BoardLoopError::Calibration)?;
    Ok(WiredSensor { calibration, divider })
}

/// The loop of a typical chip as it boots: disarmed, the default walk, the sensor required.
///
/// # Errors
/// None in a program that passes its tests.
pub fn typical_loop() -> Result<BoardLoop, BoardLoopError> {
    loop_with(&LoopConfig::default_biped())
}

/// The shipped walk and sensor in a loop with other parameters.
///
/// # Errors
/// The rule that the parameters break.
pub fn loop_with(config: &LoopConfig) -> Result<BoardLoop, BoardLoopError> {
    default_loop::board_loop_with(
        config,
        &Parameters::with_defaults(None, None)?,
        TYPICAL_VREFINT_CAL,
        TYPICAL_MIN_SUPPLY,
    )
}
