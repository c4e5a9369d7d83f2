//! The option `--sensor`: `JOINT` or `JOINT=SENSOR.toml`, once for each sensor, from channel 1 on.

use crate::failure::Failure;
use crate::file::calibration_file;
use joint_loop::{JointSensor, JointSensors};
use joint_units::Joint;
use std::path::PathBuf;
use std::str::FromStr;

/// One sensor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SensorArgument {
    /// The joint with the sensor.
    pub joint: Joint,
    /// The sensor file; `None` for the published curve.
    pub calibration: Option<PathBuf>,
}

impl FromStr for SensorArgument {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, file) = match text.split_once('=') {
            Some((name, file)) => (name, Some(file)),
            None => (text, None),
        };
        let joint = Joint::ALL.into_iter().find(|joint| joint.name() == name).ok_or_else(|| {
            let all = Joint::ALL.map(Joint::name).join(", ");
            format!("`{name}` is no joint; allowed is one of {all}, and `=FILE` with its calibration")
        })?;
        match file {
            Some("") => Err(format!("`{text}`: the name of the calibration's file is missing")),
            file => Ok(Self { joint, calibration: file.map(PathBuf::from) }),
        }
    }
}

impl SensorArgument {
    /// Reads the calibrations of the sensors.
    ///
    /// # Errors
    /// A file is wrong, or there are more than four sensors or two on one joint.
    pub fn read_all(arguments: &[Self]) -> Result<JointSensors, Failure> {
        let read = |argument: &Self| match &argument.calibration {
            Some(path) => {
                let wired = calibration_file::read(path).map_err(Failure::input)?;
                Ok(JointSensor { joint: argument.joint, divider: wired.divider, calibration: wired.calibration })
            }
            None => JointSensor::uncalibrated(argument.joint).map_err(Failure::run),
        };
        let sensors = arguments.iter().map(read).collect::<Result<Vec<_>, Failure>>()?;
        JointSensors::build(sensors).map_err(|error| Failure::input(format!("--sensor: {error}")))
    }
}

/// The joints of the sensors, in the order of the channels.
#[must_use]
pub fn joints(sensors: &JointSensors) -> Vec<Joint> {
    sensors.iter().map(|sensor| sensor.joint).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sensor_is_its_joint_and_perhaps_its_file() {
        let parse = |text: &str| text.parse::<SensorArgument>();
        assert_eq!(parse("left_hip"), Ok(SensorArgument { joint: Joint::LeftHip, calibration: None }));
        let calibrated = SensorArgument { joint: Joint::RightKnee, calibration: Some("a=b.toml".into()) };
        assert_eq!(parse("right_knee=a=b.toml"), Ok(calibrated));
        assert!(parse("elbow").unwrap_err().contains("allowed is one of left_hip, right_hip, left_knee, right_knee"));
        assert!(parse("left_hip=").unwrap_err().contains("is missing"));
        let twice = [parse("left_hip").unwrap(), parse("left_hip").unwrap()];
        let error = SensorArgument::read_all(&twice).unwrap_err().to_string();
        assert!(error.contains("two sensors on left_hip"), "{error}");
    }
}
