//! Checked limits of single joints and of pairs of joints, in the gate's unit: steps of 2^-28 rad.
//!
//! Limits are rounded to the stricter side, so a limit in steps never exceeds the same limit in radians.

use crate::error::{LoopError, inside};
use crate::setup::robot::{JointRange, PoseLimit, PoseSense, anatomy};
use joint_units::Joint;

/// Steps in a radian.
pub(crate) const STEPS: f32 = 268_435_456.0;

/// Range of one joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Limits {
    pub(crate) least: i32,
    pub(crate) most: i32,
}

/// Bound on two joints: `signs[0] q[joints[0]] + signs[1] q[joints[1]] <= most`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Edge {
    pub(crate) joints: [Joint; 2],
    pub(crate) signs: [i64; 2],
    pub(crate) most: i64,
}

impl Limits {
    pub(crate) fn build(joint: Joint, range: &JointRange) -> Result<Self, LoopError> {
        let whole = anatomy::range(joint);
        let (least, most) = (whole.least.degrees(), whole.most.degrees());
        inside("gate.range.least", Some(joint), range.least.degrees(), least, most, "deg")?;
        inside("gate.range.most", Some(joint), range.most.degrees(), least, most, "deg")?;
        // Rounded inward to whole steps. The degrees above are rounded, so the radians are bounded by the anatomy again.
        let low = range.least.0.max(whole.least.0) * STEPS;
        let high = range.most.0.min(whole.most.0) * STEPS;
        let (least, most) = (low as i32, high as i32);
        let limits =
            Self { least: least + i32::from((least as f32) < low), most: most - i32::from(most as f32 > high) };
        if limits.least >= limits.most {
            return Err(LoopError::Inverted { field: "gate.range", joint: Some(joint) });
        }
        Ok(limits)
    }

    /// Nearest position in range.
    pub(crate) fn hold(&self, position: i64) -> i32 {
        position.max(i64::from(self.least)).min(i64::from(self.most)) as i32
    }
}

impl Edge {
    pub(crate) fn build(index: usize, limit: &PoseLimit) -> Result<Self, LoopError> {
        if limit.first == limit.second {
            return Err(LoopError::SameJoint { index });
        }
        let most = inside("gate.pose.most", None, limit.most.0, -4.5, 4.5, "rad")? * STEPS;
        let whole = most as i64;
        let second = match limit.sense {
            PoseSense::Sum => 1,
            PoseSense::Difference => -1,
        };
        Ok(Self {
            joints: [limit.first, limit.second],
            signs: [1, second],
            most: whole - i64::from(whole as f32 > most),
        })
    }

    /// Excess of a pose over the bound, in steps; 0 or less inside.
    pub(crate) fn excess(&self, position: &[i32; Joint::COUNT]) -> i64 {
        let [first, second] = self.joints.map(|joint| i64::from(position[joint as usize & 3]));
        self.signs[0] * first + self.signs[1] * second - self.most
    }
}
