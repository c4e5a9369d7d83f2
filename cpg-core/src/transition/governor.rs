//! Limits the rate of the output at each tick, so that it stays inside the range of its joint.
//!
//! h is the control period; q and v are the angle and the rate of the output, w and w' those of the motion, d = q - w and d' = v - w' the offset.
//! In a tick q+ = q + h (v + v+) / 2. For the upper end b of the range (the lower one is its mirror image):
//!
//! # States that can stop
//! With an acceleration C the output stops before b if
//! ```text
//! v <= 0   or   v^2 / (2 C) <= b - q                                                               (1)
//! ```
//! From a state of (1) there is a v+ >= v - C h that leads to a state of (1), so (1) can hold for ever:
//! - v <= 0: v+ = v. Then q+ <= q <= b.
//! - v >= C h: v+ = v - C h. Then b - q+ = b - q - h v + C h^2 / 2 >= v^2 / (2 C) - h v + C h^2 / 2 = (v+)^2 / (2 C).
//! - 0 < v < C h and b - q >= h v / 2: v+ = 0. Then b - q+ = b - q - h v / 2 >= 0.
//! - 0 < v < C h and b - q < h v / 2: v+ = 2 (b - q) / h - v. Then q+ = b and v+ < 0; and v - v+ <= 2 v - v^2 / (C h) <= C h by (1).
//!
//! The state after v+ is in (1) if h v+ / 2 + max(v+, 0)^2 / (2 C) <= b - q - h v / 2 =: r. The left side grows with v+, so all rates up to
//! ```text
//! v+ = sqrt((C h / 2)^2 + 2 C r) - C h / 2   if r >= 0,   else 2 r / h                             (2)
//! ```
//! are allowed. The rates above brake towards 0 or, in the third case, to -C h / 4 at most, which the other end allows if the
//! range is wider than C h^2 / 32. So at every tick a rate is allowed by both ends.
//!
//! # States short of the motion
//! If the motion itself stops before b, the output need not, as long as it stops short of the motion: (1) for d, with the bound 0 and the
//! acceleration A of the change. Then q <= w <= b at all later ticks, whatever the motion does. This case keeps rounding errors of (2)
//! away from a joint that is on its motion, or close to it, near the end of its range. "Stops" means w' <= 0 or
//! (w')^2 / (2 B) <= b - w, where B is the acceleration limit of the joint. A motion for which this does not hold leaves the range; it is
//! limited by (2).
//!
//! A rate is allowed if one of the two cases allows it.
//!
//! # Acceleration
//! C is the largest of three: A; the smallest acceleration with which the motion is in (1), if it stops; the smallest with which the present
//! state is in (1). Without the second, an output slightly beyond a motion that brakes with more than A would be pushed off it in every stride,
//! further than it comes back until the next, and the change would not end.
//!
//! The law of a change asks for at most |w''| + A; a rate that is reduced to an allowed one lies between the one asked for and one that brakes
//! with C, or with A relative to the motion. So the acceleration of the output is at most max(|w''| + A, C). While (2) limits, C grows with the
//! need of the motion only. A motion with accelerations up to a <= B that stays in its range, also between ticks, has (w')^2 <= 2 a (b - w);
//! short of it, v = w' + d' <= sqrt(2 a (b - w)) + sqrt(2 A (w - q)) <= sqrt(2 (a + A) (b - q)). So C <= a + A: a change adds at most A to the
//! largest acceleration of the motions, also where it brakes before an end of the range.

use super::limits::JointLimits;
use crate::math::braking::Braking;

/// Angle and rate of a motion or an offset: rad, rad/s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Moving {
    pub(super) angle: f32,
    pub(super) rate: f32,
}

/// What is known of a joint at a tick.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tick {
    /// q, output at the last tick, rad.
    pub(super) before: f32,
    /// w and w' of this tick.
    pub(super) motion: Moving,
    /// d and d' of the last tick.
    pub(super) offset: Moving,
}

/// Whether a motion that moved by `step` to `angle` in a tick is in the range and stops before its end.
pub(super) fn passes(limits: &JointLimits, law: &Braking, before: f32, angle: f32) -> bool {
    let step = angle - before;
    let left = if step > 0.0 { limits.most.0 - angle } else { angle - limits.least.0 };
    let in_range = angle >= limits.least.0 && angle <= limits.most.0;
    in_range && step * step <= 2.0 * limits.acceleration.0 * law.period_s * law.period_s * left
}

/// The allowed rate of the offset that is nearest to the one asked for, rad/s; the one asked for if a value is NaN.
pub(super) fn limit(limits: &JointLimits, law: &Braking, tick: &Tick, asked: f32) -> f32 {
    let half = 0.5 * law.period_s;
    let Tick { before, motion, offset } = *tick;
    // The output after this tick is coast + h v+ / 2. What the generator's rate errs from the derivative of its angle is included.
    let coast = motion.angle + offset.angle + half * (offset.rate - motion.rate);
    let wanted = motion.rate + asked;

    // The common case, without a division or a square root.
    let next = coast + half * wanted;
    let left = if wanted > 0.0 { limits.most.0 - next } else { next - limits.least.0 };
    let in_range = next >= limits.least.0 && next <= limits.most.0;
    if in_range && wanted.abs() <= limits.rate.0 && wanted * wanted <= 2.0 * law.acceleration * left {
        return asked;
    }

    let rate = (coast - before) / half;
    // A rate above the limit, from a motion that is faster by itself, is braked with A.
    let highest = greater(greater(limits.rate.0, motion.rate.abs()), rate.abs() - law.acceleration * law.period_s);
    let mut allowed = if wanted > highest {
        highest
    } else if wanted < -highest {
        -highest
    } else {
        wanted
    };
    for (sign, bound) in [(1.0, limits.most.0), (-1.0, limits.least.0)] {
        let side = Side {
            left: sign * (bound - before),
            margin: sign * (bound - coast),
            rate: sign * rate,
            motion: Moving { angle: sign * (bound - motion.angle), rate: sign * motion.rate },
            offset: Moving { angle: sign * offset.angle, rate: sign * offset.rate },
        };
        allowed = sign * side.limit(limits.acceleration.0, law, sign * allowed);
    }
    if allowed == wanted { asked } else { allowed - motion.rate }
}

/// The greater of two numbers; `a` if `b` is NaN.
fn greater(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}

/// One end of the range: distances to it, and rates towards it.
struct Side {
    /// b - q.
    left: f32,
    /// r = b - q - h v / 2.
    margin: f32,
    /// v.
    rate: f32,
    /// b - w and w'.
    motion: Moving,
    /// d and d'.
    offset: Moving,
}

impl Side {
    /// The largest allowed rate up to `asked`; `asked` if a value is NaN.
    fn limit(&self, motion_acceleration: f32, law: &Braking, asked: f32) -> f32 {
        let (a, half) = (law.acceleration, 0.5 * law.period_s);
        let outward = if asked > 0.0 { asked } else { 0.0 };
        let beyond = half * asked + outward * outward / (2.0 * a) > self.margin;
        if !beyond {
            return asked;
        }
        let (left, rate) = (self.motion.angle, self.motion.rate);
        let stops = left >= 0.0 && (rate <= 0.0 || rate * rate <= 2.0 * motion_acceleration * left);
        let mut needed = a;
        if stops && rate > 0.0 {
            needed = greater(needed, rate * rate / (2.0 * left));
        }
        let braking = self.rate * self.rate;
        if self.rate > 0.0 && braking > 2.0 * needed * self.left {
            needed = braking / (2.0 * self.left);
        }
        let mut most = law.stopping_rate(self.margin, needed);
        if stops {
            most = greater(most, rate + law.stopping_rate(-self.offset.angle - half * self.offset.rate, a));
        }
        if asked > most { most } else { asked }
    }
}
