//! The number type of a model: `f32` in general, `f64` for reference computations on a host.
//!
//! The trait asks only for what exact, portable arithmetic can give, so that host and board agree bit for bit: the four operations
//! (division at build time only), one correctly rounded square root, and sine and cosine of a [`Phase`]. No float-only method is
//! in it, so a fixed-point type can implement it too; such a type wants an integrator that keeps the step apart from the state
//! (see [`crate::Integrator`]).

use core::fmt::Debug;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use joint_units::Phase;

/// A number type in which models can be computed: `f32`, and `f64` with the feature `f64`.
pub trait Scalar:
    Copy
    + Debug
    + PartialEq
    + PartialOrd
    + Add<Output = Self>
    + AddAssign
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// The full circle, 2 pi.
    const TAU: Self;

    /// The number nearest to `value`.
    fn from_f32(value: f32) -> Self;

    /// `numerator / denominator`, rounded once where both are below 2^24. A zero denominator gives what the type's division gives.
    fn ratio(numerator: u32, denominator: u32) -> Self;

    /// The nearest `f32`.
    fn to_f32(self) -> f32;

    /// The square root, correctly rounded; NaN for a number below 0.
    fn sqrt(self) -> Self;

    /// Sine and cosine of an angle that is given as a fraction of the circle.
    fn sin_cos(phase: Phase) -> (Self, Self);

    /// The angle of the point (`x`, `y`) as a fraction of the circle, anticlockwise from the x axis; 0 at the origin.
    fn angle(y: Self, x: Self) -> Phase;

    /// Whether it is a number and not infinite.
    fn is_finite(self) -> bool;

    /// Whether the value is between `-limit` and `limit`, without the ends; false for NaN.
    fn is_within(self, limit: Self) -> bool {
        self < limit && self > -limit
    }

    /// The value limited to `-limit` to `limit`; NaN stays NaN, so that a check finds it.
    #[must_use]
    fn clamp_to(self, limit: Self) -> Self {
        if self > limit {
            limit
        } else if self < -limit {
            -limit
        } else {
            self
        }
    }
}

impl Scalar for f32 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    const TAU: Self = core::f32::consts::TAU;

    fn from_f32(value: f32) -> Self {
        value
    }

    fn ratio(numerator: u32, denominator: u32) -> Self {
        numerator as f32 / denominator as f32
    }

    fn to_f32(self) -> f32 {
        self
    }

    fn sqrt(self) -> Self {
        libm::sqrtf(self)
    }

    fn sin_cos(phase: Phase) -> (Self, Self) {
        crate::math::trig::sin_cos(phase)
    }

    fn angle(y: Self, x: Self) -> Phase {
        crate::math::trig::angle(y, x)
    }

    fn is_finite(self) -> bool {
        Self::is_finite(self)
    }

    fn is_within(self, limit: Self) -> bool {
        // One compare: the processor has the magnitude in one instruction.
        self.abs() < limit
    }
}

/// For reference computations on a host. A core with a single-precision floating-point unit computes `f64` in software, about fifty times
/// slower than `f32`.
#[cfg(feature = "f64")]
impl Scalar for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    const TAU: Self = core::f64::consts::TAU;

    fn from_f32(value: f32) -> Self {
        Self::from(value)
    }

    fn ratio(numerator: u32, denominator: u32) -> Self {
        Self::from(numerator) / Self::from(denominator)
    }

    fn to_f32(self) -> f32 {
        self as f32
    }

    fn sqrt(self) -> Self {
        libm::sqrt(self)
    }

    fn sin_cos(phase: Phase) -> (Self, Self) {
        let angle = Self::from(phase.0) * (Self::TAU / 4_294_967_296.0);
        (libm::sin(angle), libm::cos(angle))
    }

    fn angle(y: Self, x: Self) -> Phase {
        let cycles = libm::atan2(y, x) / Self::TAU;
        Phase((cycles * 4_294_967_296.0) as i64 as u32)
    }

    fn is_finite(self) -> bool {
        Self::is_finite(self)
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

        /// One compare of the magnitude decides as the two compares do, and clamping leaves the bits that the compares alone leave.
        #[test]
        fn within_is_between_both_ends(value in any::<f32>(), limit in any::<f32>(), pick in 0_usize..8) {
            let value = [value, limit, -limit, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0, -0.0][pick];
            prop_assert_eq!(value.is_within(limit), value < limit && value > -limit, "{} {}", value, limit);
            let clamped = if value > limit { limit } else if value < -limit { -limit } else { value };
            prop_assert_eq!(value.clamp_to(limit).to_bits(), clamped.to_bits(), "{} {}", value, limit);
        }
    }

    #[test]
    fn clamping_keeps_the_sign_and_what_is_not_a_number() {
        for (value, want) in [(0.5, 0.5), (2.0, 1.0), (-2.0, -1.0), (-1.0, -1.0), (f32::INFINITY, 1.0)] {
            assert_eq!(value.clamp_to(1.0), want);
        }
        assert!(f32::NAN.clamp_to(1.0).is_nan());
    }

    #[test]
    fn ratios_are_rounded_once() {
        assert_eq!((f32::ratio(2010, 10_000), f64::ratio(2010, 10_000)), (0.201_f32, 0.201_f64));
    }
}
