//! The sensors that a person wears: on which joint each is, and its calibration.
//!
//! Channel 1 is the first, and so on; the board's pins of each are in `firmware/src/sampling.rs`. They are parameters like the walker's:
//! [`crate::store::sensor_record`] is how they get onto a board.

use core::fmt;

use hgod_adc::{
    Calibration, CalibrationError, FilterConfig, HealthConfig, Interpolation, ReferenceConfig, Sensor, SensorConfig,
    SensorError, rk09k,
};
use joint_units::{AdcCode, Joint, Period, Volts};

/// Sensor channels of a board.
pub const SENSORS: usize = 4;

/// The joint of the one sensor that is worn where nothing else is said and the walker follows none.
pub const SENSOR_JOINT: Joint = Joint::LeftKnee;

/// The supply of the sensor that ships, which its volts are a fraction of.
const SENSOR_SUPPLY: Volts = Volts(3.0);

/// First and last fraction of [`SENSOR_SUPPLY`] in the table that ships: -52 to 83 degrees, the span of a hip or a knee in walking. The
/// ends stay clear of the converter's even at 2.7 V, so that a broken wire is told from an angle.
const SENSOR_FRACTIONS: (f32, f32) = (0.265, 0.86);

/// Points in that table.
const SENSOR_POINTS: usize = 17;

/// One sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct JointSensor {
    /// Where it is worn.
    pub joint: Joint,
    /// Volts at the sensor for one volt at the pin, as [`ReferenceConfig::divider`].
    pub divider: f32,
    /// Volts at the sensor to the joint's angle.
    pub calibration: Calibration,
}

impl JointSensor {
    /// A potentiometer on the joint's axis: a published curve, until somebody calibrates their own.
    ///
    /// # Errors
    /// None in a program that passes its tests.
    pub fn uncalibrated(joint: Joint) -> Result<Self, CalibrationError> {
        let (first, last) = SENSOR_FRACTIONS;
        let points = rk09k::points::<SENSOR_POINTS>(SENSOR_SUPPLY, first, last);
        Ok(Self { joint, divider: 1.0, calibration: Calibration::new(&points, Interpolation::MonotoneCubic)? })
    }

    /// The chain from code to angle on a chip with this factory value.
    ///
    /// # Errors
    /// [`SensorError`]: the factory's reading of the internal reference cannot be true, or the converter cannot tell the ends of the
    /// table from a broken wire.
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

/// Why sensors were refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointSensorsError {
    /// None, or more than [`SENSORS`].
    Count(usize),
    /// Two are worn on this joint.
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

/// All of them, from channel 1 on: one at least, no two on the same joint.
#[derive(Debug, Clone, PartialEq)]
pub struct JointSensors {
    channels: [Option<JointSensor>; SENSORS],
}

impl JointSensors {
    /// Checks them.
    ///
    /// ```
    /// use joint_loop::{JointSensorsError, JointSensor, JointSensors};
    /// use joint_units::Joint;
    /// let [hip, knee] = [Joint::LeftHip, Joint::LeftKnee].map(|joint| JointSensor::uncalibrated(joint).unwrap());
    /// let worn = JointSensors::build([hip.clone(), knee])?;
    /// assert_eq!((worn.count(), worn.channel_of(Joint::LeftKnee), worn.channel_of(Joint::RightHip)), (2, Some(1), None));
    /// assert_eq!(JointSensors::build([hip.clone(), hip]), Err(JointSensorsError::Twice(Joint::LeftHip)));
    /// # Ok::<(), JointSensorsError>(())
    /// ```
    ///
    /// # Errors
    /// [`JointSensorsError`].
    pub fn build(sensors: impl IntoIterator<Item = JointSensor>) -> Result<Self, JointSensorsError> {
        let mut channels = [const { None }; SENSORS];
        let mut count = 0;
        for sensor in sensors {
            let taken = |channel: &Option<JointSensor>| channel.as_ref().is_some_and(|worn| worn.joint == sensor.joint);
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

    /// The channels in order; `None` where no sensor is.
    #[must_use]
    pub const fn channels(&self) -> &[Option<JointSensor>; SENSORS] {
        &self.channels
    }

    /// The sensors in order.
    pub fn iter(&self) -> impl Iterator<Item = &JointSensor> {
        self.channels.iter().flatten()
    }

    /// How many there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.iter().count()
    }

    /// The channel of the sensor on this joint, counted from 0.
    #[must_use]
    pub fn channel_of(&self, joint: Joint) -> Option<usize> {
        self.iter().position(|worn| worn.joint == joint)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_sensor_is_accepted_over_every_factory_value_of_the_data_sheet() {
        let worn = JointSensor::uncalibrated(Joint::LeftKnee).expect("monotone");
        // 1.18 to 1.24 V at 3.3 V.
        for cal in 1464..=1539 {
            for min_supply in [2.7, 3.0] {
                let sensor = worn.build(AdcCode(cal), Volts(min_supply));
                assert!(sensor.is_ok(), "{cal} {min_supply}: {sensor:?}");
            }
        }
    }

    #[test]
    fn one_to_four_and_one_a_joint() {
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
