//! The loop that ships: the gait sensor's curve, a walker and the servos. The firmware and every host replay build it here, so that the
//! same inputs give the same bits.

use core::fmt;

use cpg_core::BuildError;
use hgod_adc::{
    Calibration, CalibrationError, FilterConfig, HealthConfig, Interpolation, ReferenceConfig, Sensor, SensorConfig,
    SensorError, rk09k,
};
use joint_units::{AdcCode, Joint, Period, Volts};

use crate::{JointLoop, LoopConfig, LoopError, Walker, WalkerConfig};

/// Sensor channels: the one place that says how many there are, for firmware, log and host alike. 1 to 4; the first is the gait
/// sensor that the walker follows. All have the shipped calibration, and all must be good. With four the image needs more stack than the
/// 16 KiB of `memory.x` while it boots; 32 are enough.
pub const SENSORS: usize = 1;

/// The loop that the firmware runs: whichever walker its parameters name, and the sensors.
pub type WalkLoop = JointLoop<Walker, SENSORS>;

/// The joint that the gait sensor is worn on.
pub const SENSOR_JOINT: Joint = Joint::LeftKnee;

/// The sensor's own supply, which its volts are a fraction of.
pub const SENSOR_SUPPLY: Volts = Volts(3.0);

/// First and last fraction of [`SENSOR_SUPPLY`] in the table: -52 to 83 degrees, the span of a hip or a knee in walking. The ends stay
/// clear of the converter's even at 2.7 V, so that a broken wire is told from an angle.
pub const SENSOR_FRACTIONS: (f32, f32) = (0.265, 0.86);

/// Points in the table.
pub const SENSOR_POINTS: usize = 17;

/// Why the shipped configuration was refused: on a chip whose factory values cannot be read, or after a change that does not fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Refusal {
    /// The calibration table.
    Calibration(CalibrationError),
    /// The sensor.
    Sensor(SensorError),
    /// The walk.
    Walk(BuildError),
    /// The loop.
    Loop(LoopError),
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Refusal::Calibration(error) => write!(f, "calibration: {error}"),
            Refusal::Sensor(error) => write!(f, "sensor: {error}"),
            Refusal::Walk(error) => write!(f, "walk: {error}"),
            Refusal::Loop(error) => write!(f, "loop: {error}"),
        }
    }
}

impl core::error::Error for Refusal {}

/// The gait sensor: a potentiometer on the joint's axis (a published curve, until somebody calibrates their own).
///
/// # Errors
/// [`Refusal::Sensor`] when the factory's reading of the internal reference cannot be true.
pub fn gait_sensor(vrefint_cal: AdcCode, min_supply: Volts) -> Result<Sensor, Refusal> {
    let (first, last) = SENSOR_FRACTIONS;
    let points = rk09k::points::<SENSOR_POINTS>(SENSOR_SUPPLY, first, last);
    SensorConfig {
        reference: ReferenceConfig { min_supply, ..ReferenceConfig::stm32f4(vrefint_cal) },
        calibration: Calibration::build(&points, Interpolation::MonotoneCubic).map_err(Refusal::Calibration)?,
        filter: FilterConfig::default(),
        health: HealthConfig::default(),
    }
    .build(Period::MILLISECOND)
    .map_err(Refusal::Sensor)
}

/// The loop, disarmed. Without `sensor_required` it walks whatever the sensor says.
///
/// ```
/// use joint_loop::shipped::{SENSORS, walk_loop};
/// use joint_loop::{Sample, State, WalkerConfig};
/// use joint_units::{AdcCode, Volts};
/// let default = WalkerConfig::default_walk();
/// let mut walk = walk_loop(&default, AdcCode(1501), Volts(2.7), true)?;
/// // 1.5 V at a supply of 3.0 V: the middle of the potentiometer.
/// let sample = Sample { codes: [AdcCode(2048); SENSORS], vrefint: AdcCode(1651), ..Sample::default() };
/// for _ in 0..100 {
///     assert_eq!(walk.tick(&sample).pulses, None);
/// }
/// assert_eq!(walk.frame().state, State::Disarmed);
/// assert!(walk.frame().measured[0].degrees().abs() < 0.5);
///
/// let refusal = walk_loop(&default, AdcCode(0xFFFF), Volts(2.7), true).unwrap_err();
/// assert_eq!(refusal.to_string(), "sensor: reference.vrefint_cal = 65535: allowed is 1365 to 1613");
/// # Ok::<(), joint_loop::shipped::Refusal>(())
/// ```
///
/// # Errors
/// [`Refusal`] says what does not fit.
pub fn walk_loop(
    walker: &WalkerConfig,
    vrefint_cal: AdcCode,
    min_supply: Volts,
    sensor_required: bool,
) -> Result<WalkLoop, Refusal> {
    let mut config = LoopConfig::default_biped();
    config.watch.sensor_required = sensor_required;
    if let WalkerConfig::Follow(_) = walker {
        // It goes on without a sensor for two seconds, then stands, and walks again when the sensor is back.
        config.watch.sensor_tolerance_s = f32::INFINITY;
    }
    walk_loop_with(&config, walker, vrefint_cal, min_supply)
}

/// The same with other parameters of the loop.
///
/// # Errors
/// [`Refusal`] says what does not fit.
pub fn walk_loop_with(
    config: &LoopConfig,
    walker: &WalkerConfig,
    vrefint_cal: AdcCode,
    min_supply: Volts,
) -> Result<WalkLoop, Refusal> {
    let walk = walker.build(Period::MILLISECOND).map_err(Refusal::Walk)?;
    let sensor = gait_sensor(vrefint_cal, min_supply)?;
    let sensors = core::array::from_fn(|_| sensor.clone());
    config.build(Period::MILLISECOND, walk, sensors).map_err(Refusal::Loop)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_sensor_is_accepted_over_every_factory_value_of_the_data_sheet() {
        // 1.18 to 1.24 V at 3.3 V.
        for cal in 1464..=1539 {
            for min_supply in [2.7, 3.0] {
                let sensor = gait_sensor(AdcCode(cal), Volts(min_supply));
                assert!(sensor.is_ok(), "{cal} {min_supply}: {sensor:?}");
            }
        }
    }
}
