//! The gate: limits target angles to range, pose envelope, rate and acceleration at every tick.
//!
//! ```text
//! target --> finite? --> range --> pose envelope --> rate, acceleration, braking --> setpoint --> pulse
//! ```
//! Positions are integers in steps of 2^-28 rad, so the limits hold exactly, without rounding errors, and the state is always
//! finite. A setpoint that no limit changes is the target itself, bit for bit.
//!
//! # Braking
//! With p the position and v the last step (motion in one tick), a joint that brakes at its largest deceleration (A per tick)
//! still moves by
//! ```text
//! brake(v) = sum over k >= 1 of max(v - k A, 0) = n v - A n (n + 1) / 2,   n = floor(v / A)
//! ```
//! A state is *viable* if p + brake(v) is within the range in the direction of v, and if for each edge of the pose envelope
//! `s1 q1 + s2 q2 <= c` the sum of the furthest s q that both joints reach while braking is at most c. Braking does not change
//! p + brake(v), so braking leads from a viable state to a viable state. The gate takes the step nearest to the requested one
//! among those that lead to a viable state. Its first state is viable (at rest, inside), so by induction all states are.
//!
//! # Tracking
//! A target that moves by w in this tick is approached relative to its motion: the joint steps by w + u, with the largest u
//! that can be braked within the remaining distance. So it reaches the target without overshoot and then stays on it exactly.

mod bounds;
mod status;

pub use status::GateStatus;

use crate::error::LoopError;
use crate::motion::limits::{Edge, Limits, STEPS};
use crate::setup::robot::{GateConfig, POSE_LIMITS};
use joint_units::{Joint, Period, Radians};

/// Error of a target that is infinite or NaN. The state of the gate is unchanged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NonFinite {
    /// The first joint with such a target.
    pub joint: Joint,
}

/// Gate for one period: a checked [`GateConfig`] in steps and ticks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gate {
    joints: [Limits; Joint::COUNT],
    /// The first `edge_count` make the envelope.
    edges: [Edge; POSE_LIMITS],
    edge_count: usize,
}

/// State of the gate, in steps: position of every joint, motion in the last tick, last goal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GateState {
    position: [i32; Joint::COUNT],
    step: [i32; Joint::COUNT],
    goal: [i32; Joint::COUNT],
}

/// A target inside the range and the pose envelope.
struct Allowed {
    /// The targets inside the range.
    kept: [Radians; Joint::COUNT],
    /// The same in steps.
    aimed: [i32; Joint::COUNT],
    /// The same inside the pose envelope.
    goal: [i32; Joint::COUNT],
    /// Limits that acted.
    status: GateStatus,
}

impl GateState {
    /// The same pose at rest.
    #[must_use]
    pub(crate) const fn at_rest(self) -> Self {
        Self { step: [0; Joint::COUNT], goal: self.position, ..self }
    }
}

impl Gate {
    /// Checks the configuration and converts it to steps and ticks.
    ///
    /// # Errors
    /// [`LoopError`] names the first field that is not allowed.
    pub fn build(config: &GateConfig, period: Period) -> Result<Self, LoopError> {
        let joint = |joint: Joint| Limits::build(joint, config, period);
        let joints =
            [joint(Joint::LeftHip)?, joint(Joint::RightHip)?, joint(Joint::LeftKnee)?, joint(Joint::RightKnee)?];

        let mut gate = Self { joints, edges: [Edge::NONE; POSE_LIMITS], edge_count: 0 };
        let limits = config.pose.iter().enumerate().filter_map(|(index, limit)| Some((index, limit.as_ref()?)));
        for (edge, (index, limit)) in gate.edges.iter_mut().zip(limits) {
            *edge = Edge::build(index, limit, &joints)?;
            gate.edge_count += 1;
        }
        Ok(gate)
    }

    /// State at rest in a pose; `None` unless the pose is finite, in range and in the envelope. An end of a range is in it: its position is the last step
    /// that the range has.
    #[must_use]
    pub fn rest(&self, pose: [Radians; Joint::COUNT]) -> Option<GateState> {
        let mut position = pose.map(|angle| (angle.0 * STEPS) as i32);
        for (position, limits) in position.iter_mut().zip(&self.joints) {
            let held = limits.hold(i64::from(*position));
            if held.abs_diff(*position) <= 1 {
                *position = held;
            }
        }
        let state = GateState { position, step: [0; Joint::COUNT], goal: position };
        let in_range = position.iter().zip(&self.joints).all(|(p, limits)| (limits.least..=limits.most).contains(p));
        // In this order: only sums of positions in range fit.
        let in_envelope = || self.edges().iter().all(|edge| edge.sum(&position) <= edge.most);
        (pose.iter().all(|angle| angle.0.is_finite()) && in_range && in_envelope()).then_some(state)
    }

    /// State at rest in the allowed pose that is next to this one; `None` if an angle is not finite or no pose near it is allowed.
    #[must_use]
    pub fn rest_near(&self, pose: [Radians; Joint::COUNT]) -> Option<GateState> {
        if pose.iter().any(|angle| !angle.0.is_finite()) {
            return None;
        }
        let Allowed { goal: mut position, .. } = self.allowed(pose);
        // A limit in single precision may be some steps beyond it.
        for (position, limits) in position.iter_mut().zip(&self.joints) {
            *position = limits.hold(i64::from(*position));
        }
        let in_envelope = self.edges().iter().all(|edge| edge.sum(&position) <= edge.most);
        in_envelope.then_some(GateState { position, step: [0; Joint::COUNT], goal: position })
    }

    /// Angles of a state.
    #[must_use]
    pub fn pose(&self, state: &GateState) -> [Radians; Joint::COUNT] {
        state.position.map(|position| Radians(position as f32 / STEPS))
    }

    /// Limits a target pose: returns the setpoints of this tick and the limits that acted.
    ///
    /// # Errors
    /// [`NonFinite`] if a target is not finite. The board must then get no command.
    pub fn limit(
        &self,
        state: &mut GateState,
        target: [Radians; Joint::COUNT],
    ) -> Result<([Radians; Joint::COUNT], GateStatus), NonFinite> {
        // All later steps need finite targets.
        for (joint, angle) in Joint::ALL.into_iter().zip(target) {
            if !angle.0.is_finite() {
                return Err(NonFinite { joint });
            }
        }
        let Allowed { mut kept, aimed, goal, mut status } = self.allowed(target);

        // Rate, acceleration and braking: joint by joint, with the new steps of the joints before it.
        let near = self.near_edges(state);
        for joint in Joint::ALL {
            let at = joint as usize & 3;
            // Each of these is a difference of two positions in range, so it fits.
            let wanted = goal[at] - state.position[at];
            let is_on_goal = state.position[at] == state.goal[at];
            let is_free = near & 1 << at == 0;
            let step = if is_free && is_on_goal && self.joints[at].allow(state.position[at], state.step[at], wanted) {
                wanted
            } else {
                let (step, why) = self.step(state, joint, goal[at], is_free);
                if step != wanted {
                    status = status.with(why);
                }
                step
            };
            state.step[at] = step;
            state.position[at] += step;
            state.goal[at] = goal[at];
        }

        // The target itself if the joint is on it, else the position.
        for ((angle, position), aimed) in kept.iter_mut().zip(state.position).zip(aimed) {
            if position != aimed {
                *angle = Radians(position as f32 / STEPS);
            }
        }
        Ok((kept, status))
    }

    /// The step of a joint towards its goal, and the limit that bounds it. `is_free`: no edge of the envelope bounds it.
    fn step(&self, now: &GateState, joint: Joint, goal: i32, is_free: bool) -> (i32, GateStatus) {
        let at = joint as usize & 3;
        let limits = &self.joints[at];
        let wanted = goal - now.position[at];
        // Not `clamp`, which can panic: it requires its bounds to be in order.
        let drift = (goal - now.goal[at]).max(-limits.rate).min(limits.rate);
        let left = wanted - drift;
        let asked = drift + left.signum() * limits.reach(i64::from(left.abs())) as i32;
        match self.admit_far(now, joint, asked) {
            Some(admitted) if is_free => admitted,
            _ => self.admit(now, joint, asked),
        }
    }

    /// The edges of the pose envelope.
    fn edges(&self) -> &[Edge] {
        self.edges.get(..self.edge_count).unwrap_or(&self.edges)
    }

    /// Range and pose envelope of finite targets.
    fn allowed(&self, target: [Radians; Joint::COUNT]) -> Allowed {
        let mut status = GateStatus::NONE;

        // Range.
        let mut kept = target;
        for (angle, limits) in kept.iter_mut().zip(&self.joints) {
            let [least, most] = limits.ends;
            if angle.0 < least {
                *angle = Radians(least);
                status = status.with(GateStatus::RANGE);
            } else if angle.0 > most {
                *angle = Radians(most);
                status = status.with(GateStatus::RANGE);
            }
        }
        let aimed = kept.map(|angle| (angle.0 * STEPS) as i32);

        // Pose envelope: each of the two joints takes half of the excess.
        let mut goal = aimed;
        for edge in self.edges() {
            let sum = edge.sum(&goal);
            if sum > edge.most {
                let half = (i64::from(sum) - i64::from(edge.most) + 1) / 2;
                for (joint, sign) in edge.joints.into_iter().zip([1, i64::from(edge.sign)]) {
                    let at = joint as usize & 3;
                    goal[at] = self.joints[at].hold(i64::from(goal[at]) - sign * half);
                }
                status = status.with(GateStatus::POSE);
            }
        }
        Allowed { kept, aimed, goal, status }
    }
}

#[cfg(test)]
mod reference;
#[cfg(test)]
mod tests;
