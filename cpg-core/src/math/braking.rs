//! The rate that leads a position to a target with bounded acceleration and without overshoot, and the one that stops before a bound.
//!
//! ```text
//! v = w + sign(d) min(k |d|, sqrt(A |d|)),   rate' = clamp(4 k (v - rate), -A, A)
//! ```
//! d is the distance that is left, w the rate of the target. Far off, the speed is one that half of A can brake; close to the target
//! the motion is critically damped with both poles at 2k. [`crate::transition`] and [`crate::entrainment`] use it.

/// Stiffness, acceleration and period of the law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Braking {
    /// k, 1/s.
    pub(crate) stiffness: f32,
    /// A, units of the position per second squared.
    pub(crate) acceleration: f32,
    /// Control period, s.
    pub(crate) period_s: f32,
}

impl Braking {
    /// The rate one period later, with `left` to go to a target that moves at `target_rate`.
    pub(crate) fn next_rate(&self, rate: f32, left: f32, target_rate: f32) -> f32 {
        let distance = left.abs();
        let speed = (self.stiffness * distance).min(libm::sqrtf(self.acceleration * distance));
        let wanted = target_rate + if left > 0.0 { speed } else { -speed };
        let pull = (4.0 * self.stiffness * (wanted - rate)).max(-self.acceleration).min(self.acceleration);
        rate + pull * self.period_s
    }

    /// The largest rate v one period h later from which `acceleration` C stops before a bound: h v / 2 + max(v, 0)^2 / (2 C) = `margin`.
    ///
    /// `margin` is the distance to the bound that is left after half a period at the present rate; if it is negative, the position one
    /// period later is the bound.
    pub(crate) fn stopping_rate(&self, margin: f32, acceleration: f32) -> f32 {
        if margin < 0.0 {
            return 2.0 * margin / self.period_s;
        }
        let half = 0.5 * acceleration * self.period_s;
        libm::sqrtf(half * half + 2.0 * acceleration * margin) - half
    }
}
