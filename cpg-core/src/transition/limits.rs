//! Limits of a joint: range, rate and acceleration.

use joint_units::{RadPerSec, RadPerSec2, Radians};

use crate::error::in_range;
use crate::{BuildError, Field};

/// Limits of one joint, which every change keeps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointLimits {
    /// Least angle; -1000 to 1000 rad.
    pub least: Radians,
    /// Largest angle; at least 0.01 rad above `least`, at most 1000 rad.
    pub most: Radians,
    /// Highest rate of a change; 0.01 to 10 000 rad/s. A motion that is faster by itself is not slowed.
    pub rate: RadPerSec,
    /// Largest acceleration with which a motion may brake before an end of the range; 0.1 to 100 000 rad/s^2. A motion that would need more
    /// is one that leaves the range, and is limited.
    pub acceleration: RadPerSec2,
}

impl JointLimits {
    /// The widest limits that are allowed, for a joint without end stops.
    pub const WIDEST: Self = Self {
        least: Radians(-FURTHEST),
        most: Radians(FURTHEST),
        rate: RadPerSec(1e4),
        acceleration: RadPerSec2(1e5),
    };

    /// Checks the limits of joint `index`.
    pub(super) fn check(&self, index: usize) -> Result<(), BuildError> {
        let field = |name| Field::at(name, index);
        in_range(self.least.0, field("limits.least"), -FURTHEST, FURTHEST)?;
        in_range(self.most.0, field("limits.most"), self.least.0 + NARROWEST, FURTHEST)?;
        in_range(self.rate.0, field("limits.rate"), 0.01, 1e4)?;
        in_range(self.acceleration.0, field("limits.acceleration"), 0.1, 1e5)
    }

    /// The nearest angle in the range; NaN stays NaN.
    pub(super) fn hold(&self, angle: f32) -> f32 {
        if angle > self.most.0 {
            self.most.0
        } else if angle < self.least.0 {
            self.least.0
        } else {
            angle
        }
    }
}

/// Largest distance of an end of a range from 0, rad.
const FURTHEST: f32 = 1e3;
/// Least width of a range, rad.
const NARROWEST: f32 = 0.01;
