//! The gate: the last stage. Whatever it is asked for, what it lets pass keeps to the range, the pose envelope, the rate and
//! the acceleration, at every tick.
//!
//! ```text
//! target --> finite? --> range --> pose envelope --> rate, acceleration, braking --> setpoint --> pulse
//! ```
//! Positions are integers in steps of 2^-28 rad, so the bounds hold exactly and no rounding can use up a margin; the state
//! cannot be "not a number". What comes out as `f32` is the target itself, bit for bit, wherever the gate does not act.
//!
//! # Braking
//! With p the position and v the last step (motion in one tick), a joint that brakes as hard as it may (by A a tick) goes on by
//! ```text
//! brake(v) = sum over k >= 1 of max(v - k A, 0) = n v - A n (n + 1) / 2,   n = floor(v / A)
//! ```
//! A state is *viable* if p + brake(v) is within the range on the side that v points to, and for each edge of the pose envelope
//! `s1 q1 + s2 q2 <= c` the sum of the furthest s q that both joints reach while braking is at most c. Braking leaves
//! p + brake(v) as it is, so from a viable state "brake" always leads to a viable one; the gate takes the step that is nearest
//! to what is asked for among those that do. It starts viable (at rest, inside), so by induction it always is.
//!
//! # Following
//! A target that moves by w in this tick is approached in its own frame: the joint steps by w + u with the largest u that can
//! still be braked away within the distance left. So it lands on the target without overshoot, and stays on it exactly.

use crate::error::{LoopError, inside};
use crate::motion::limits::{Edge, Limits, STEPS};
use crate::setup::robot::{GateConfig, POSE_LIMITS, anatomy};
use core::num::NonZeroU32;
use joint_units::{Joint, Period, Radians};

/// What held setpoints back from their targets: a set of bits. Limits are a status, not a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct GateStatus(u8);

impl GateStatus {
    /// Nothing.
    pub const NONE: Self = Self(0);
    /// The range of a joint.
    pub const RANGE: Self = Self(1 << 0);
    /// An edge of the pose envelope.
    pub const POSE: Self = Self(1 << 1);
    /// The rate limit.
    pub const RATE: Self = Self(1 << 2);
    /// The acceleration limit, which also acts as the braking distance in front of a target.
    pub const ACCELERATION: Self = Self(1 << 3);

    /// As bits, for the wire.
    #[must_use]
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// Whether anything was.
    #[must_use]
    pub const fn any(self) -> bool {
        self.0 != 0
    }

    /// Whether every one of `other` was.
    #[must_use]
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

/// A target was infinite or not a number: nothing was let pass, and the state is unchanged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NonFinite {
    /// The first joint whose target it was.
    pub joint: Joint,
}

/// A checked [`GateConfig`] for one period, in steps and ticks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gate {
    joints: [Limits; Joint::COUNT],
    pose: [Option<Edge>; POSE_LIMITS],
    rate: i64,
    acceleration: NonZeroU32,
}

/// Where every joint is, how far it moved in the last tick, and what was last asked for, in steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GateState {
    position: [i32; Joint::COUNT],
    step: [i32; Joint::COUNT],
    goal: [i32; Joint::COUNT],
}

impl Gate {
    /// Checks the configuration and turns it into steps and ticks.
    ///
    /// # Errors
    /// The first field that is not as the documentation of [`GateConfig`] says.
    pub fn build(config: &GateConfig, period: Period) -> Result<Self, LoopError> {
        let joint = |joint: Joint| Limits::build(joint, &config.range[joint as usize & 3]);
        let joints =
            [joint(Joint::LeftHip)?, joint(Joint::RightHip)?, joint(Joint::LeftKnee)?, joint(Joint::RightKnee)?];

        let mut pose = [None; POSE_LIMITS];
        for (index, (edge, limit)) in pose.iter_mut().zip(&config.pose).enumerate() {
            *edge = limit.as_ref().map(|limit| Edge::build(index, limit)).transpose()?;
        }

        let degrees = |radians: f32| Radians(radians).degrees();
        let fastest = degrees(anatomy::RATE.0);
        let dt = period.seconds();
        inside("gate.rate", None, degrees(config.rate.0), degrees(8.0 / STEPS / dt).max(1.0), fastest, "deg/s")?;
        // Braking from full speed takes rate^2 / (2 acceleration), which shall be 90 degrees at most; and the acceleration
        // shall be 8 steps a tick squared at least, so that rounding it down is of no account.
        let rate = config.rate.0;
        let least = (rate * rate / core::f32::consts::PI).max(8.0 / STEPS / (dt * dt));
        let greatest = degrees(anatomy::ACCELERATION.0);
        inside("gate.acceleration", None, degrees(config.acceleration.0), degrees(least), greatest, "deg/s^2")?;

        // Truncated towards what is stricter. More than twice the rate in one tick would not be used.
        let rate = (rate * dt * STEPS) as u32;
        let acceleration = ((config.acceleration.0 * dt * dt * STEPS) as u32).min(rate.saturating_mul(2));
        let acceleration = NonZeroU32::new(acceleration).unwrap_or(NonZeroU32::MIN);
        Ok(Self { joints, pose, rate: i64::from(rate), acceleration })
    }

    /// At rest in a pose; `None` unless the pose is finite, in range and in the envelope.
    #[must_use]
    pub fn rest(&self, pose: [Radians; Joint::COUNT]) -> Option<GateState> {
        let position = pose.map(|angle| (angle.0 * STEPS) as i32);
        let state = GateState { position, step: [0; Joint::COUNT], goal: position };
        let in_range = position.iter().zip(&self.joints).all(|(p, limits)| (limits.least..=limits.most).contains(p));
        let in_envelope = self.pose.iter().flatten().all(|edge| edge.excess(&position) <= 0);
        (pose.iter().all(|angle| angle.0.is_finite()) && in_range && in_envelope).then_some(state)
    }

    /// Lets pass what may pass of a target pose: the setpoints of this tick, and what held them back.
    ///
    /// # Errors
    /// A target is not finite. Nothing may be commanded then.
    pub fn limit(
        &self,
        state: &mut GateState,
        target: [Radians; Joint::COUNT],
    ) -> Result<([Radians; Joint::COUNT], GateStatus), NonFinite> {
        // Finite first: every later stage may assume it.
        for (joint, angle) in Joint::ALL.into_iter().zip(target) {
            if !angle.0.is_finite() {
                return Err(NonFinite { joint });
            }
        }
        let mut status = GateStatus::NONE;

        // Range.
        let mut kept = target;
        for (angle, limits) in kept.iter_mut().zip(&self.joints) {
            let inside = angle.0.max(limits.least as f32 / STEPS).min(limits.most as f32 / STEPS);
            if inside != angle.0 {
                *angle = Radians(inside);
                status = status.with(GateStatus::RANGE);
            }
        }
        let aimed = kept.map(|angle| (angle.0 * STEPS) as i32);

        // Pose envelope: both joints give way by half of what is too much.
        let mut goal = aimed;
        for edge in self.pose.iter().flatten() {
            let excess = edge.excess(&goal);
            if excess > 0 {
                for (joint, sign) in edge.joints.into_iter().zip(edge.signs) {
                    let at = joint as usize & 3;
                    goal[at] = self.joints[at].hold(i64::from(goal[at]) - sign * (excess + 1) / 2);
                }
                status = status.with(GateStatus::POSE);
            }
        }

        // Rate, acceleration and braking: joint by joint, each against what the ones before it now do.
        let before = *state;
        for joint in Joint::ALL {
            let at = joint as usize & 3;
            let (position, wanted) =
                (i64::from(before.position[at]), i64::from(goal[at]) - i64::from(before.position[at]));
            // Not `clamp`: that panics on bounds the wrong way round, and no proof would see that these never are.
            let drift = (i64::from(goal[at]) - i64::from(before.goal[at])).max(-self.rate).min(self.rate);
            let left = wanted - drift;
            let asked = drift + left.signum() * self.reach(left.abs());
            let (step, why) = self.admit(state, &before, joint, asked);
            if step != wanted {
                status = status.with(why);
            }
            state.step[at] = step as i32;
            state.position[at] = (position + step) as i32;
        }
        state.goal = goal;

        // Where the joint is on the target, the target itself; else the position.
        for ((angle, position), aimed) in kept.iter_mut().zip(state.position).zip(aimed) {
            if position != aimed {
                *angle = Radians(position as f32 / STEPS);
            }
        }
        Ok((kept, status))
    }

    /// The step nearest to `asked` that leaves everything viable, and what would have stood in the way of a greater one.
    ///
    /// `now` holds the joints before this one as they are in this tick, the others as they were in the last.
    fn admit(&self, now: &GateState, before: &GateState, joint: Joint, asked: i64) -> (i64, GateStatus) {
        let at = joint as usize & 3;
        let (position, last) = (i64::from(before.position[at]), i64::from(before.step[at]));
        let (limits, a) = (&self.joints[at], i64::from(self.acceleration.get()));

        // The bounds of the step below and above, each with its reason.
        let mut low = (last - a, GateStatus::ACCELERATION);
        let mut high = (last + a, GateStatus::ACCELERATION);
        let mut bound = |sign: i64, most: i64, why| {
            if sign > 0 && most < high.0 {
                high = (most, why);
            } else if sign < 0 && -most > low.0 {
                low = (-most, why);
            }
        };
        for (sign, room) in [(1, i64::from(limits.most) - position), (-1, position - i64::from(limits.least))] {
            bound(sign, self.rate, GateStatus::RATE);
            bound(sign, self.reach(room), GateStatus::RANGE);
        }
        for edge in self.pose.iter().flatten() {
            let [first, second] = edge.joints;
            let [sign, partner_sign] = if joint == first { edge.signs } else { [edge.signs[1], edge.signs[0]] };
            if joint == first || joint == second {
                let partner = if joint == first { second } else { first };
                // A joint later in order has not moved yet: reserve for it the path on which it brakes.
                let peak = self.peak(now, partner, partner_sign, (partner as usize) > at);
                bound(sign, self.reach(edge.most - sign * position - peak), GateStatus::POSE);
            }
        }
        if asked > high.0 {
            high
        } else if asked < low.0 {
            low
        } else {
            (asked, GateStatus::ACCELERATION)
        }
    }

    /// The furthest `sign * q` that a joint reaches while it brakes; `from_next` where the braking includes this tick.
    fn peak(&self, state: &GateState, joint: Joint, sign: i64, from_next: bool) -> i64 {
        let at = joint as usize & 3;
        let (here, outward) = (sign * i64::from(state.position[at]), sign * i64::from(state.step[at]));
        if outward > 0 {
            here + self.brake(outward)
        } else if from_next {
            here + (outward + i64::from(self.acceleration.get())).min(0)
        } else {
            here
        }
    }

    /// brake(v) of the module's documentation, for v > 0.
    fn brake(&self, v: i64) -> i64 {
        let n = i64::from(v as u32 / self.acceleration);
        n * v - i64::from(self.acceleration.get()) * n * (n + 1) / 2
    }

    /// The greatest v with v + brake(v) <= room; room itself where the room is negative.
    fn reach(&self, room: i64) -> i64 {
        let Ok(room) = u32::try_from(room) else { return room.min(i64::from(u32::MAX)) };
        // v + brake(v) is A n (n + 1) / 2 at v = n A, and grows by n + 1 for every step of v from there.
        let a = self.acceleration;
        let n = ((room / a).saturating_mul(8).saturating_add(1).isqrt() - 1) / 2;
        let whole = a.get() * (n * (n + 1) / 2);
        i64::from(n * a.get() + (room - whole) / NonZeroU32::MIN.saturating_add(n))
    }
}

#[cfg(test)]
mod tests;
