//! The bounds of a joint's step in a tick, and the step that they admit.

use super::{Gate, GateState, GateStatus};
use crate::motion::limits::Limits;
use joint_units::Joint;

impl Gate {
    /// The joints that an edge of the envelope may bound in this tick: a bit each.
    pub(super) fn near_edges(&self, now: &GateState) -> u8 {
        let mut near = 0;
        for edge in self.edges() {
            if edge.sum(&now.position) > edge.far {
                for joint in edge.joints {
                    near |= 1 << (joint as usize & 3);
                }
            }
        }
        near
    }

    /// [`Gate::admit`] for a joint that is far from each edge of the envelope: only rate and acceleration bound its step, unless it moves
    /// towards an end of its range that is near; then `None`.
    ///
    /// A bound at a distance of the clearance or more allows every step within the rate. A joint that does not move towards an end of
    /// its range is not bounded by it, since it is inside.
    pub(super) fn admit_far(&self, now: &GateState, joint: Joint, asked: i32) -> Option<(i32, GateStatus)> {
        let at = joint as usize & 3;
        let (position, limits) = (now.position[at], &self.joints[at]);
        let (low, high) = own_bounds(limits, now.step[at]);
        let (step, why) = nearest(asked, low, high);
        let distance = match step {
            1.. => limits.most - position,
            0 => return Some((step, why)),
            ..0 => position - limits.least,
        };
        (distance >= limits.clearance).then_some((step, why))
    }

    /// The viable step nearest to `asked`, and the limit that bounds it.
    ///
    /// In `now` the joints before this one have their state of this tick, the others that of the last.
    pub(super) fn admit(&self, now: &GateState, joint: Joint, asked: i32) -> (i32, GateStatus) {
        let at = joint as usize & 3;
        let limits = &self.joints[at];
        let position = i64::from(now.position[at]);
        let (mut low, mut high) = own_bounds(limits, now.step[at]);
        let mut bound = |sign: i64, margin: i64, why| {
            // At more than the clearance, the rate is the stricter bound.
            if margin >= i64::from(limits.clearance) {
                return;
            }
            let most = limits.reach(margin) as i32;
            if sign > 0 && most < high.0 {
                high = (most, why);
            } else if sign < 0 && -most > low.0 {
                low = (-most, why);
            }
        };
        bound(1, i64::from(limits.most) - position, GateStatus::RANGE);
        bound(-1, position - i64::from(limits.least), GateStatus::RANGE);
        for edge in self.edges() {
            let ([first, second], second_sign) = (edge.joints, i64::from(edge.sign));
            let (partner, sign, partner_sign) = match joint {
                joint if joint == first => (second, 1, second_sign),
                joint if joint == second => (first, second_sign, 1),
                _ => continue,
            };
            // A joint later in order has not moved yet: its braking path is reserved.
            let peak = self.peak(now, partner, partner_sign, (partner as usize) > at);
            bound(sign, i64::from(edge.most) - sign * position - peak, GateStatus::POSE);
        }
        nearest(asked, low, high)
    }

    /// The furthest `sign * q` that a joint reaches while it brakes; with `from_next` the braking includes this tick.
    pub(super) fn peak(&self, state: &GateState, joint: Joint, sign: i64, from_next: bool) -> i64 {
        let at = joint as usize & 3;
        let (here, outward) = (sign * i64::from(state.position[at]), sign * i64::from(state.step[at]));
        let limits = &self.joints[at];
        if outward > 0 {
            here + limits.brake(outward)
        } else if from_next {
            here + (outward + i64::from(limits.acceleration.get())).min(0)
        } else {
            here
        }
    }
}

/// A bound of a step, and the limit that it comes from.
type Bound = (i32, GateStatus);

/// Lower and upper bound of a step by acceleration and rate.
fn own_bounds(limits: &Limits, last: i32) -> (Bound, Bound) {
    // At most twice the rate.
    let a = limits.acceleration.get() as i32;
    let low =
        if -limits.rate > last - a { (-limits.rate, GateStatus::RATE) } else { (last - a, GateStatus::ACCELERATION) };
    let high =
        if limits.rate < last + a { (limits.rate, GateStatus::RATE) } else { (last + a, GateStatus::ACCELERATION) };
    (low, high)
}

/// The step nearest to `asked` within the bounds, and the limit of the bound that acts.
fn nearest(asked: i32, low: Bound, high: Bound) -> Bound {
    if asked > high.0 {
        high
    } else if asked < low.0 {
        low
    } else {
        (asked, GateStatus::ACCELERATION)
    }
}
