//! Checked limits of single joints and of pairs of joints, in the gate's units: steps of 2^-28 rad, and ticks.
//!
//! Limits are rounded to the stricter side, so a limit in steps never exceeds the same limit in radians.

use crate::error::{LoopError, inside};
use crate::setup::robot::{GateConfig, PoseLimit, PoseSense, anatomy};
use core::num::NonZeroU32;
use joint_units::{Joint, Period, Radians};

/// Steps in a radian.
pub(crate) const STEPS: f32 = 268_435_456.0;

/// Limits of one joint: its range, its largest step in a tick, and the largest change of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Limits {
    pub(crate) least: i32,
    pub(crate) most: i32,
    /// At most 18 rad/s for 10 ms, so well within an `i32`.
    pub(crate) rate: i32,
    pub(crate) acceleration: NonZeroU32,
    /// Both ends of the range, rad.
    pub(crate) ends: [f32; 2],
    /// `rate + brake(rate)`: with so much clearance or more, a bound allows every step that the rate allows. Braking takes at most 90 degrees.
    pub(crate) clearance: i32,
    /// Positions from which a step within the rate that raises, or lowers, them is allowed by the range, and ends inside of it.
    pub(crate) may_rise: i32,
    pub(crate) may_fall: i32,
}

/// Bound on two joints: `q[joints[0]] + sign q[joints[1]] <= most`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Edge {
    pub(crate) joints: [Joint; 2],
    /// 1 or -1.
    pub(crate) sign: i32,
    pub(crate) most: i32,
    /// Up to this sum, the edge bounds no step of its joints: `most` less the clearance of both.
    pub(crate) far: i32,
}

impl Limits {
    pub(crate) fn build(joint: Joint, config: &GateConfig, period: Period) -> Result<Self, LoopError> {
        let at = joint as usize & 3;
        let (range, whole) = (&config.range[at], anatomy::range(joint));
        let (least, most) = (whole.least.degrees(), whole.most.degrees());
        inside("gate.range.least", Some(joint), range.least.degrees(), least, most, "deg")?;
        inside("gate.range.most", Some(joint), range.most.degrees(), least, most, "deg")?;
        // Rounded inward to whole steps. The degrees above are rounded, so the radians are bounded by the anatomy again.
        let low = range.least.0.max(whole.least.0) * STEPS;
        let high = range.most.0.min(whole.most.0) * STEPS;
        let (least, most) = (low as i32, high as i32);
        let (least, most) = (least + i32::from((least as f32) < low), most - i32::from(most as f32 > high));
        if least >= most {
            return Err(LoopError::Inverted { field: "gate.range", joint: Some(joint) });
        }

        let degrees = |radians: f32| Radians(radians).degrees();
        let (rate, acceleration, dt) = (config.rate[at].0, config.acceleration[at].0, period.seconds());
        let (slowest, fastest) = (degrees(8.0 / STEPS / dt).max(1.0), degrees(anatomy::RATE.0));
        inside("gate.rate", Some(joint), at_bound(degrees(rate), slowest, fastest), slowest, fastest, "deg/s")?;
        // Braking from full speed takes rate^2 / (2 acceleration), which must be at most 90 degrees. The acceleration must be
        // at least 8 steps per tick squared, so that rounding it down has little effect.
        let weakest = degrees((rate * rate / core::f32::consts::PI).max(8.0 / STEPS / (dt * dt)));
        let strongest = degrees(anatomy::ACCELERATION.0);
        let asked = at_bound(degrees(acceleration), weakest, strongest);
        inside("gate.acceleration", Some(joint), asked, weakest, strongest, "deg/s^2")?;

        // Truncated to the stricter side. An acceleration of more than twice the rate in one tick has no effect.
        let rate = (rate * dt * STEPS) as u32;
        let acceleration = ((acceleration * dt * dt * STEPS) as u32).min(rate.saturating_mul(2));
        let acceleration = NonZeroU32::new(acceleration).unwrap_or(NonZeroU32::MIN);
        let mut limits = Self {
            least,
            most,
            rate: rate as i32,
            acceleration,
            ends: [least, most].map(|end| end as f32 / STEPS),
            clearance: 0,
            may_rise: 0,
            may_fall: 0,
        };
        limits.clearance = (i64::from(limits.rate) + limits.brake(i64::from(limits.rate))) as i32;
        // One more than the rate, so that the goal is not at the end itself, where the angle in single precision may be beyond it.
        let margin = limits.clearance.max(limits.rate.saturating_add(1));
        (limits.may_rise, limits.may_fall) = (most.saturating_sub(margin), least.saturating_add(margin));
        Ok(limits)
    }

    /// Whether rate, acceleration and range allow this step at this position, whatever follows. False also where more than these would have to be
    /// computed to know.
    pub(crate) fn allow(&self, position: i32, last: i32, step: i32) -> bool {
        if step.unsigned_abs() > self.rate.unsigned_abs() || (step - last).unsigned_abs() > self.acceleration.get() {
            return false;
        }
        let is_clear = if step < 0 { position >= self.may_fall } else { position <= self.may_rise };
        is_clear || self.can_stop(position, step)
    }

    /// Whether the joint can brake before the end of its range after this step, which is within the rate; false also if it then stops at the end itself.
    fn can_stop(&self, position: i32, step: i32) -> bool {
        let distance = if step < 0 { position - self.least } else { self.most - position };
        let v = step.unsigned_abs();
        // Braking takes at most 90 degrees, so twice that fits.
        let n = v / self.acceleration;
        let brake = n * v - self.acceleration.get() * (n * (n + 1) / 2);
        v + brake < distance.unsigned_abs()
    }

    /// Nearest position in range.
    pub(crate) fn hold(&self, position: i64) -> i32 {
        position.max(i64::from(self.least)).min(i64::from(self.most)) as i32
    }

    /// brake(v) of the gate's documentation, for v > 0.
    pub(crate) fn brake(&self, v: i64) -> i64 {
        let n = i64::from(v as u32 / self.acceleration);
        n * v - i64::from(self.acceleration.get()) * n * (n + 1) / 2
    }

    /// The greatest v with v + brake(v) <= margin; the margin itself if it is negative.
    pub(crate) fn reach(&self, margin: i64) -> i64 {
        let Ok(margin) = u32::try_from(margin) else { return margin.min(i64::from(u32::MAX)) };
        let a = self.acceleration;
        if margin < a.get() {
            return i64::from(margin);
        }
        // v + brake(v) is A n (n + 1) / 2 at v = n A, and grows by n + 1 for every step of v from there.
        let n = ((margin / a).saturating_mul(8).saturating_add(1).isqrt() - 1) / 2;
        let whole = a.get() * (n * (n + 1) / 2);
        i64::from(n * a.get() + (margin - whole) / NonZeroU32::MIN.saturating_add(n))
    }
}

/// A value in degrees that was one in radians; where it is a bound but for the rounding of both, the bound.
fn at_bound(value: f32, least: f32, most: f32) -> f32 {
    const ROUNDING: f32 = 4.0 * f32::EPSILON;
    [least, most].into_iter().find(|bound| (value - bound).abs() <= ROUNDING * bound.abs()).unwrap_or(value)
}

impl Edge {
    /// Fills the places that the envelope leaves free.
    pub(crate) const NONE: Self =
        Self { joints: [Joint::LeftHip, Joint::RightHip], sign: 1, most: i32::MAX, far: i32::MAX };

    pub(crate) fn build(index: usize, limit: &PoseLimit, joints: &[Limits; Joint::COUNT]) -> Result<Self, LoopError> {
        if limit.first == limit.second {
            return Err(LoopError::SameJoint { index });
        }
        let most = inside("gate.pose.most", None, limit.most.0, -4.5, 4.5, "rad")? * STEPS;
        let whole = most as i32;
        let most = whole - i32::from(whole as f32 > most);
        let sign = match limit.sense {
            PoseSense::Sum => 1,
            PoseSense::Difference => -1,
        };
        let pair = [limit.first, limit.second];
        let [first, second] = pair.map(|joint| joints[joint as usize & 3]);
        let far = most.saturating_sub(first.clearance).saturating_sub(second.clearance);
        Ok(Self { joints: pair, sign, most, far })
    }

    /// The sum that the edge bounds, in steps. Within the ranges of the joints it is at most 5 rad, so it fits.
    pub(crate) fn sum(&self, position: &[i32; Joint::COUNT]) -> i32 {
        let [first, second] = self.joints.map(|joint| position[joint as usize & 3]);
        first + self.sign * second
    }
}
