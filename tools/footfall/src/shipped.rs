//! The loop that the firmware ships, built on the host: the same sensor, walk and servos, so that a replay gives the same bits.

use hgod_adc::Sensor;
use joint_loop::LoopConfig;
use joint_loop::shipped;
pub use joint_loop::shipped::{Refusal, SENSOR_JOINT, WalkLoop};
use joint_units::{AdcCode, Volts};

use crate::calibration_file::WiredSensor;

/// The pin that the gait sensor is wired to, straight.
pub const SENSOR_PIN: &str = "PA1";

/// The factory's reading of the internal reference on a chip whose reference is 1.21 V, at 3.3 V.
pub const TYPICAL_VREFINT_CAL: AdcCode = AdcCode(1502);

/// What differs between boards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Board {
    /// Name in the board's log.
    pub name: &'static str,
    /// Supply below which no sample is good.
    pub min_supply: Volts,
}

/// The boards that the firmware knows, the default one first.
pub const BOARDS: [Board; 2] =
    [Board { name: "f4-discovery", min_supply: Volts(2.7) }, Board { name: "nucleo-f446re", min_supply: Volts(3.0) }];

/// The gait sensor.
///
/// # Errors
/// The factory's reading of the internal reference cannot be true.
pub fn gait_sensor(vrefint_cal: AdcCode, board: &Board) -> Result<Sensor, Refusal> {
    shipped::gait_sensor(vrefint_cal, board.min_supply)
}

/// The gait sensor's calibration and divider.
///
/// # Errors
/// None in a program that passes its tests.
pub fn wired_sensor() -> Result<WiredSensor, Refusal> {
    let sensor = gait_sensor(TYPICAL_VREFINT_CAL, &BOARDS[0])?;
    Ok(WiredSensor { calibration: sensor.calibration().clone(), divider: 1.0 })
}

/// The loop as it boots: disarmed.
///
/// # Errors
/// The factory's reading of the internal reference cannot be true.
pub fn walk_loop(vrefint_cal: AdcCode, board: &Board) -> Result<WalkLoop, Refusal> {
    shipped::walk_loop(vrefint_cal, board.min_supply, LoopConfig::default_biped().watch.sensor_required)
}

/// The shipped walk and sensor in a loop with other parameters.
///
/// # Errors
/// The rule that the parameters break.
pub fn loop_with(config: &LoopConfig) -> Result<WalkLoop, Refusal> {
    shipped::walk_loop_with(config, TYPICAL_VREFINT_CAL, BOARDS[0].min_supply)
}
