//! The rate that leads a position to a target with bounded acceleration and without overshoot, and the one that stops before a bound.
//!
//! ```text
//! v = w + sign(d) min(k |d|, sqrt(A |d|)),   rate' = clamp(4 k (v - rate), -A, A)
//! ```
//! d is the distance that is left, w the rate of the target. Far off, the speed is one that half of A can brake; close to the target
//! the motion is critically damped with both poles at 2k. [`crate::transition`] and [`crate::entrainment`] use it.

use joint_units::order::{greater, lesser};

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
        let speed = self.speed(distance);
        let wanted = target_rate + if left > 0.0 { speed } else { -speed };
        let pull = 4.0 * self.stiffness * (wanted - rate);
        let pull = lesser(greater(pull, -self.acceleration), self.acceleration);
        rate + pull * self.period_s
    }

    /// `min(k d, sqrt(A d))`. The root is computed only where it may be the lesser of the two: it costs about as much as all the rest.
    fn speed(&self, distance: f32) -> f32 {
        /// Both products are rounded, each by less than 2^-23 of it; far more than that below the other, the first is the lesser one.
        const CLEARLY: f32 = 0.999;
        let (close, square) = (self.stiffness * distance, self.acceleration * distance);
        if close * close < CLEARLY * square { close } else { close.min(libm::sqrtf(square)) }
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// 100,000 cases, or as many as the variable `FOOTFALL_CASES` says.
    fn cases() -> u32 {
        std::env::var("FOOTFALL_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(100_000)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(cases()))]

        /// Without the shortcut, at any distance, and where both terms are nearly equal: at A / k^2.
        #[test]
        fn the_speed_is_the_lesser_of_the_two_to_the_bit(
            stiffness in 0.1_f32..1_000.0, acceleration in 0.01_f32..100_000.0, near in 0.99_f32..1.01, any in any::<f32>(),
        ) {
            let law = Braking { stiffness, acceleration, period_s: 1e-3 };
            let equal = acceleration / (stiffness * stiffness);
            for distance in [any.abs(), equal * near, equal, 0.0, f32::MIN_POSITIVE, 1e-45, f32::INFINITY, f32::NAN] {
                let slowly = (stiffness * distance).min(libm::sqrtf(acceleration * distance));
                prop_assert_eq!(law.speed(distance).to_bits(), slowly.to_bits(), "{}", distance);
            }
        }
    }
}
