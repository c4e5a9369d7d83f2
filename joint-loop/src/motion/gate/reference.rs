//! The gate without its shortcuts: every bound of every joint is computed in each tick, in 64 bits. The tests compare the gate with it.

use super::*;

impl Gate {
    /// [`Gate::limit`] for finite targets.
    pub(super) fn limit_slowly(
        &self,
        state: &mut GateState,
        target: [Radians; Joint::COUNT],
    ) -> ([Radians; Joint::COUNT], GateStatus) {
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

        // Pose envelope: each of the two joints takes half of the excess.
        let mut goal = aimed;
        for edge in self.edges() {
            let excess = i64::from(edge.sum(&goal)) - i64::from(edge.most);
            if excess > 0 {
                for (joint, sign) in edge.joints.into_iter().zip([1, i64::from(edge.sign)]) {
                    let at = joint as usize & 3;
                    goal[at] = self.joints[at].hold(i64::from(goal[at]) - sign * (excess + 1) / 2);
                }
                status = status.with(GateStatus::POSE);
            }
        }

        // Rate, acceleration and braking: joint by joint, with the new steps of the joints before it.
        let before = *state;
        for joint in Joint::ALL {
            let at = joint as usize & 3;
            let (position, wanted) =
                (i64::from(before.position[at]), i64::from(goal[at]) - i64::from(before.position[at]));
            // Not `clamp`, which can panic: it requires its bounds to be in order.
            let limits = &self.joints[at];
            let drift = (i64::from(goal[at]) - i64::from(before.goal[at]))
                .clamp(-i64::from(limits.rate), i64::from(limits.rate));
            let left = wanted - drift;
            let asked = drift + left.signum() * limits.reach(left.abs());
            let (step, why) = self.admit_slowly(state, &before, joint, asked);
            if step != wanted {
                status = status.with(why);
            }
            state.step[at] = step as i32;
            state.position[at] = (position + step) as i32;
        }
        state.goal = goal;

        // The target itself if the joint is on it, else the position.
        for ((angle, position), aimed) in kept.iter_mut().zip(state.position).zip(aimed) {
            if position != aimed {
                *angle = Radians(position as f32 / STEPS);
            }
        }
        (kept, status)
    }

    /// The viable step nearest to `asked`, and the limit that bounds it.
    ///
    /// In `now` the joints before this one have their state of this tick, the others that of the last.
    fn admit_slowly(&self, now: &GateState, before: &GateState, joint: Joint, asked: i64) -> (i64, GateStatus) {
        let at = joint as usize & 3;
        let (position, last) = (i64::from(before.position[at]), i64::from(before.step[at]));
        let limits = &self.joints[at];
        let a = i64::from(limits.acceleration.get());

        // Lower and upper bound of the step, each with its limit.
        let mut low = (last - a, GateStatus::ACCELERATION);
        let mut high = (last + a, GateStatus::ACCELERATION);
        let mut bound = |sign: i64, most: i64, why| {
            if sign > 0 && most < high.0 {
                high = (most, why);
            } else if sign < 0 && -most > low.0 {
                low = (-most, why);
            }
        };
        for (sign, margin) in [(1, i64::from(limits.most) - position), (-1, position - i64::from(limits.least))] {
            bound(sign, i64::from(limits.rate), GateStatus::RATE);
            bound(sign, limits.reach(margin), GateStatus::RANGE);
        }
        for edge in self.edges() {
            let [first, second] = edge.joints;
            let second_sign = i64::from(edge.sign);
            let [sign, partner_sign] = if joint == first { [1, second_sign] } else { [second_sign, 1] };
            if joint == first || joint == second {
                let partner = if joint == first { second } else { first };
                // A joint later in order has not moved yet: its braking path is reserved.
                let peak = self.peak(now, partner, partner_sign, (partner as usize) > at);
                bound(sign, limits.reach(i64::from(edge.most) - sign * position - peak), GateStatus::POSE);
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
}
