//! The loop that the firmware ships, on the host: what it takes for granted where there is no board to ask.

use hgod_adc::Sensor;
pub use joint_loop::shipped::{Refusal, SENSOR_JOINT, WalkLoop, gait_sensor};
use joint_loop::{LoopConfig, WalkerConfig, shipped};
use joint_units::{AdcCode, Volts};

use crate::calibration_file::WiredSensor;

/// The pin that the gait sensor is wired to, straight.
pub const SENSOR_PIN: &str = "PA1";

/// The factory's reading of the internal reference on a chip whose reference is 1.21 V, at 3.3 V.
pub const TYPICAL_VREFINT_CAL: AdcCode = AdcCode(1502);

/// Supply below which no sample is good on the default board, the STM32F4 Discovery.
pub const TYPICAL_MIN_SUPPLY: Volts = Volts(2.7);

/// The gait sensor of a typical chip.
///
/// # Errors
/// None in a program that passes its tests.
pub fn typical_sensor() -> Result<Sensor, Refusal> {
    gait_sensor(TYPICAL_VREFINT_CAL, TYPICAL_MIN_SUPPLY)
}

/// The gait sensor's calibration and divider.
///
/// # Errors
/// None in a program that passes its tests.
pub fn wired_sensor() -> Result<WiredSensor, Refusal> {
    Ok(WiredSensor { calibration: typical_sensor()?.calibration().clone(), divider: 1.0 })
}

/// The loop of a typical chip as it boots: disarmed, the default walk, the sensor required.
///
/// # Errors
/// None in a program that passes its tests.
pub fn typical_loop() -> Result<WalkLoop, Refusal> {
    loop_with(&LoopConfig::default_biped())
}

/// The shipped walk and sensor in a loop with other parameters.
///
/// # Errors
/// The rule that the parameters break.
pub fn loop_with(config: &LoopConfig) -> Result<WalkLoop, Refusal> {
    shipped::walk_loop_with(config, &WalkerConfig::default_walk(), TYPICAL_VREFINT_CAL, TYPICAL_MIN_SUPPLY)
}
