//! The firmware's default control loop on the host, with typical values where no board reports its own.

use firmware::board::Board;
use firmware::board::f4_discovery::BOARD;
use hgod_adc::Sensor;
pub use joint_loop::SENSOR_JOINT;
use joint_loop::setup::default_loop;
pub use joint_loop::setup::default_loop::{BoardLoop, BoardLoopError, Parameters};
use joint_loop::{JointSensor, RobotConfig, SENSORS};
use joint_units::{AdcCode, Volts};

use crate::file::calibration_file::WiredSensor;

/// The pins of the sensors of the default board, connected without a divider, from channel 1 on.
pub const SENSOR_PINS: [&str; SENSORS] = sensor_pins(&BOARD);

/// The same of a board.
#[must_use]
pub const fn sensor_pins(board: &Board) -> [&'static str; SENSORS] {
    let [one, two, three, four] = board.sensors;
    [one.pin.name, two.pin.name, three.pin.name, four.pin.name]
}

/// The pin of channel 1.
pub const SENSOR_PIN: &str = SENSOR_PINS[0];

/// Factory code of the internal reference (VREFINT at 3.3 V) on a chip whose reference is 1.21 V.
pub const TYPICAL_VREFINT_CAL: AdcCode = AdcCode(1502);

/// Supply below which no sample is good on the default board, the STM32F4 Discovery.
pub const TYPICAL_MIN_SUPPLY: Volts = BOARD.min_supply;

/// The default sensor on a typical chip.
///
/// # Errors
/// None; a test builds it.
pub fn typical_sensor() -> Result<Sensor, BoardLoopError> {
    let sensor = JointSensor::uncalibrated(SENSOR_JOINT).map_err(BoardLoopError::Calibration)?;
    let built = sensor.build(TYPICAL_VREFINT_CAL, TYPICAL_MIN_SUPPLY);
    built.map_err(|error| BoardLoopError::Sensor { joint: SENSOR_JOINT, error })
}

/// Calibration and divider of the default sensor.
///
/// # Errors
/// None; a test builds it.
pub fn wired_sensor() -> Result<WiredSensor, BoardLoopError> {
    let JointSensor { calibration, divider, .. } =
        JointSensor::uncalibrated(SENSOR_JOINT).map_err(BoardLoopError::Calibration)?;
    Ok(WiredSensor { calibration, divider })
}

/// The loop of a typical chip after boot: disarmed, the default walk, the sensor required, the emergency stop not tested yet.
///
/// # Errors
/// None; a test builds it.
pub fn typical_loop() -> Result<BoardLoop, BoardLoopError> {
    let default = Parameters::with_defaults(None, None, RobotConfig::default_biped())?;
    default_loop::board_loop(&default, TYPICAL_VREFINT_CAL, TYPICAL_MIN_SUPPLY, true)
}
