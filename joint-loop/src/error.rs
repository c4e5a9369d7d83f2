//! The error of a refused configuration, and the checks of single values that every stage uses.

use core::fmt;
use joint_units::{Joint, Period};

/// Why a configuration was refused. Each variant is one rule. Angles are in degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum LoopError {
    /// A number is infinite or NaN.
    NotFinite {
        /// Path of the field in [`crate::LoopConfig`].
        field: &'static str,
        /// The joint, if the field is an array over the joints.
        joint: Option<Joint>,
    },
    /// A number is outside its range.
    OutOfRange {
        /// Path of the field in [`crate::LoopConfig`].
        field: &'static str,
        /// The joint, if the field is an array over the joints.
        joint: Option<Joint>,
        /// The given value, in `unit`.
        value: f32,
        /// Least allowed value, in `unit`.
        least: f32,
        /// Greatest allowed value, in `unit`.
        most: f32,
        /// Unit of the three values.
        unit: &'static str,
    },
    /// The least value of a range is not below the greatest.
    Inverted {
        /// Path of the field in [`crate::LoopConfig`].
        field: &'static str,
        /// The joint, if the field is an array over the joints.
        joint: Option<Joint>,
    },
    /// The joint's range needs pulses outside the limits of its servo.
    BeyondPulses {
        /// The joint.
        joint: Joint,
        /// Pulse that one end of the range needs, in microseconds.
        micros: f32,
        /// Shortest pulse of the servo, in microseconds.
        shortest: u16,
        /// Longest pulse of the servo, in microseconds.
        longest: u16,
    },
    /// A pose limit names one joint twice.
    SameJoint {
        /// Index in `gate.pose`.
        index: usize,
    },
    /// The park pose is not strictly inside a pose limit, so no motion could start from it.
    ParkOutsidePose {
        /// Index in `gate.pose`.
        index: usize,
    },
    /// The park pose is outside a range or a pose limit of the gate.
    Park,
    /// `monitor.sensor_required` is set, but there is no sensor.
    NoSensor,
    /// The generator does not pass its own check.
    Generator,
    /// A joint has feedback, but no sensor.
    FeedbackWithoutSensor {
        /// The joint.
        joint: Joint,
        /// Its share.
        share: f32,
    },
    /// A joint has feedback, but its sensor is on the person whom the generator follows.
    FeedbackOfPerson {
        /// The joint.
        joint: Joint,
        /// Its share.
        share: f32,
    },
}

/// Index of an array over the joints, as text: `[left_knee]`.
struct Of(Option<Joint>);

impl fmt::Display for Of {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(joint) => write!(f, "[{}]", joint.name()),
            None => Ok(()),
        }
    }
}

/// A number to a thousandth, so that degrees do not show the rounding error of their conversion from radians.
struct Rounded(f32);

impl fmt::Display for Rounded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let thousands = self.0 * 1000.0;
        if thousands.abs() < 0.5 || thousands.abs() > 16_000_000.0 {
            return self.0.fmt(f);
        }
        let whole = (thousands + 0.5_f32.copysign(thousands)) as i32;
        (whole as f32 / 1000.0).fmt(f)
    }
}

impl fmt::Display for LoopError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NotFinite { field, joint } => write!(f, "{field}{} is not a finite number", Of(joint)),
            Self::OutOfRange { field, joint, value, least, most, unit } => {
                let [value, least, most] = [value, least, most].map(Rounded);
                let space = if unit.is_empty() { "" } else { " " };
                write!(f, "{field}{} is {value}{space}{unit}; allowed are {least} to {most}{space}{unit}", Of(joint))
            }
            Self::Inverted { field, joint } => {
                write!(f, "{field}{}: the least must be below the most", Of(joint))
            }
            Self::BeyondPulses { joint, micros, shortest, longest } => write!(
                f,
                "gate.range[{0}] needs a pulse of {1} us; servos[{0}] allows {shortest} to {longest} us",
                joint.name(),
                Rounded(micros)
            ),
            Self::SameJoint { index } => write!(f, "gate.pose[{index}] must name two different joints"),
            Self::ParkOutsidePose { index } => write!(f, "blend.park must be strictly inside gate.pose[{index}]"),
            Self::Park => f.write_str("blend.park must be inside gate.range and gate.pose"),
            Self::NoSensor => f.write_str("monitor.sensor_required is set, so at least one sensor must be given"),
            Self::Generator => f.write_str("the generator does not pass its own check before its first step"),
            Self::FeedbackWithoutSensor { joint, share } => write!(
                f,
                "robot.feedback[{0}] is {1}, but {0} has no sensor; allowed without one is 0: connect and pack a sensor of {0}, or leave `feedback` of {0} out of the robot file",
                joint.name(),
                Rounded(share)
            ),
            Self::FeedbackOfPerson { joint, share } => write!(
                f,
                "robot.feedback[{0}] is {1}, but the generator follows the sensor of {0}, which is on a person; allowed is 0: leave `feedback` of {0} out of the robot file, or take a generator that does not follow {0}",
                joint.name(),
                Rounded(share)
            ),
        }
    }
}

impl core::error::Error for LoopError {}

/// Returns `value` if it is finite and inside `least..=most`.
pub(crate) fn inside(
    field: &'static str,
    joint: Option<Joint>,
    value: f32,
    least: f32,
    most: f32,
    unit: &'static str,
) -> Result<f32, LoopError> {
    if !value.is_finite() {
        Err(LoopError::NotFinite { field, joint })
    } else if value < least || value > most {
        Err(LoopError::OutOfRange { field, joint, value, least, most, unit })
    } else {
        Ok(value)
    }
}

/// `seconds` in whole periods, rounded to the nearest, at least 1. Refuses values outside `least..=most` seconds.
pub(crate) fn ticks(
    field: &'static str,
    seconds: f32,
    least: f32,
    most: f32,
    period: Period,
) -> Result<u32, LoopError> {
    let seconds = inside(field, None, seconds, least, most, "s")?;
    Ok(((seconds / period.seconds() + 0.5) as u32).max(1))
}
