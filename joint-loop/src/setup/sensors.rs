//! The sensors on a person: joint, divider and calibration of each channel.
//!
//! Sensors have channels in order, from channel 1; each board file of the firmware has the pins. A board reads the sensors from
//! its sensor record, see [`crate::store::sensor_record`].

use core::fmt;

use hgod_adc::{
    Calibration, CalibrationError, FilterConfig, HealthConfig, Interpolation, ReferenceConfig, Sensor, SensorConfig,
    SensorError, rk09k,
};
use joint_units::{AdcCode, Joint, Period, Volts};

/// Number of sensor channels of a board.
pub const SENSORS: usize = 4;

/// Joint of the default sensor if the generator is no follower.
pub const SENSOR_JOINT: Joint = Joint::LeftKnee;

/// Supply of the default sensor; its output is a fraction of it.
const SENSOR_SUPPLY: Volts = Volts(3.0);

/// First and last fraction of [`SENSOR_SUPPLY`] in the default table: -52 to 83 degrees, the range of a hip or a knee in
/// walking. The ends are inside the converter's range even at 2.7 V, so that a broken wire differs from an angle.
const SENSOR_FRACTIONS: (f32, f32) = (0.265, 0.86);

/// Points of the default table.
const SENSOR_POINTS: usize = 17;

/// One sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct JointSensor {
    /// Measured joint.
    pub joint: Joint,
    /// Volts at the sensor per volt at the pin, 0.05 to 20, as [`ReferenceConfig::divider`].
    pub divider: f32,
    /// Table from volts at the sensor to the joint's angle.
    pub calibration: Calibration,
}

impl JointSensor {
    /// A potentiometer on the joint's axis with a published curve, for use before a calibration.
    ///
    /// # Errors
    /// [`CalibrationError`] if the table of constants is not allowed; a test shows that it is.
    pub fn uncalibrated(joint: Joint) -> Result<Self, CalibrationError> {
        let (first, last) = SENSOR_FRACTIONS;
        let points = rk09k::points::<SENSOR_POINTS>(SENSOR_SUPPLY, first, last);
        Ok(Self { joint, divider: 1.0, calibration: Calibration::new(&points, Interpolation::MonotoneCubic)? })
    }

    /// Builds the sensor for a chip with this factory reading of its internal reference, and for this least supply.
    ///
    /// # Errors
    /// [`SensorError`] if the factory reading is out of range, or if the ends of the table are too close to the ends of the
    /// converter's range to detect a broken wire.
    pub fn build(&self, vrefint_cal: AdcCode, min_supply: Volts) -> Result<Sensor, SensorError> {
        SensorConfig {
            reference: ReferenceConfig { divider: self.divider, min_supply, ..ReferenceConfig::stm32f4(vrefint_cal) },
            calibration: self.calibration.clone(),
            filter: FilterConfig::default(),
            health: HealthConfig::default(),
        }
        .build(Period::MILLISECOND)
    }
}

/// Why a set of sensors was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum JointSensorsError {
    /// The number is 0 or more than [`SENSORS`].
    Count(usize),
    /// Two sensors are on this joint.
    Twice(Joint),
}

impl fmt::Display for JointSensorsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count(count) => write!(f, "{count} sensors; allowed are 1 to {SENSORS}"),
            Self::Twice(joint) => write!(f, "two sensors on {}; allowed is one a joint", joint.name()),
        }
    }
}

impl core::error::Error for JointSensorsError {}

/// The sensors of a board, from channel 1 on: at least one, at most one for each joint.
#[derive(Debug, Clone, PartialEq)]
pub struct JointSensors {
    channels: [Option<JointSensor>; SENSORS],
}

impl JointSensors {
    /// Checks the sensors and assigns them to channels in order.
    ///
    /// ```
    /// use joint_loop::{JointSensorsError, JointSensor, JointSensors};
    /// use joint_units::Joint;
    /// let [hip, knee] = [Joint::LeftHip, Joint::LeftKnee].map(|joint| JointSensor::uncalibrated(joint).unwrap());
    /// let sensors = JointSensors::build([hip.clone(), knee])?;
    /// assert_eq!((sensors.count(), sensors.channel_of(Joint::LeftKnee)), (2, Some(1)));
    /// assert_eq!(sensors.channel_of(Joint::RightHip), None);
    /// assert_eq!(JointSensors::build([hip.clone(), hip]), Err(JointSensorsError::Twice(Joint::LeftHip)));
    /// # Ok::<(), JointSensorsError>(())
    /// ```
    ///
    /// # Errors
    /// [`JointSensorsError`] for no sensor, more than [`SENSORS`], or two on one joint.
    pub fn build(sensors: impl IntoIterator<Item = JointSensor>) -> Result<Self, JointSensorsError> {
        let mut channels = [const { None }; SENSORS];
        let mut count = 0;
        for sensor in sensors {
            let taken =
                |channel: &Option<JointSensor>| channel.as_ref().is_some_and(|other| other.joint == sensor.joint);
            if channels.iter().any(taken) {
                return Err(JointSensorsError::Twice(sensor.joint));
            }
            if let Some(channel) = channels.get_mut(count) {
                *channel = Some(sensor);
            }
            count = count.saturating_add(1);
        }
        if (1..=SENSORS).contains(&count) { Ok(Self { channels }) } else { Err(JointSensorsError::Count(count)) }
    }

    /// The channels in order; `None` for a channel without a sensor.
    #[must_use]
    pub const fn channels(&self) -> &[Option<JointSensor>; SENSORS] {
        &self.channels
    }

    /// The sensors in order.
    pub fn iter(&self) -> impl Iterator<Item = &JointSensor> {
        self.channels.iter().flatten()
    }

    /// Number of sensors.
    #[must_use]
    pub fn count(&self) -> usize {
        self.iter().count()
    }

    /// Channel of the sensor on a joint, counted from 0; `None` without one.
    #[must_use]
    pub fn channel_of(&self, joint: Joint) -> Option<usize> {
        self.iter().position(|sensor| sensor.joint == joint)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_sensor_accepts_every_factory_value() {
        let config = JointSensor::uncalibrated(Joint::LeftKnee).expect("monotone");
        // The data sheet's range, 1.18 to 1.24 V, at 3.3 V.
        for cal in 1464..=1539 {
            for min_supply in [2.7, 3.0] {
                let sensor = config.build(AdcCode(cal), Volts(min_supply));
                assert!(sensor.is_ok(), "{cal} {min_supply}: {sensor:?}");
            }
        }
    }

    #[test]
    fn one_to_four_sensors_and_one_per_joint_are_allowed() {
        let all = || Joint::ALL.map(|joint| JointSensor::uncalibrated(joint).expect("monotone"));
        let four = JointSensors::build(all()).expect("four");
        assert_eq!((four.count(), four.channel_of(Joint::RightKnee)), (4, Some(3)));
        assert_eq!(JointSensors::build([]), Err(JointSensorsError::Count(0)));
        let five = all().into_iter().chain(all().into_iter().take(1));
        assert_eq!(JointSensors::build(five), Err(JointSensorsError::Twice(Joint::LeftHip)));
        assert_eq!(JointSensorsError::Count(5).to_string(), "5 sensors; allowed are 1 to 4");
        assert_eq!(
            JointSensorsError::Twice(Joint::LeftHip).to_string(),
            "two sensors on left_hip; allowed is one a joint"
        );
    }
}
