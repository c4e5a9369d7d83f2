//! The square root of an `f32`, correctly rounded, in 32-bit arithmetic: the same bits as the instruction of a processor that has one.
//!
//! The Cortex-M4F has that instruction, but no library offers it to a crate without `unsafe` code: `libm` 0.2.16 computes the root in integers, which
//! takes twice as long as this function (docs/performance.md has both). Special numbers go to `libm`.

use core::hint::cold_path;

/// Bits of the fraction of an `f32`.
const FRACTION: u32 = 23;
/// The bit before the fraction.
const ONE: u32 = 1 << FRACTION;
/// The exponent field of the numbers from 1 to 2.
const BIAS: u32 = 127;
/// Bits of the least normal number, and of infinity.
const NORMAL: core::ops::Range<u32> = ONE..0xff << FRACTION;

/// The square root, rounded to nearest; NaN for a number below 0, and -0 for -0.
///
/// ```
/// use cpg_core::math::square_root::sqrt;
/// assert_eq!(sqrt(2.0), core::f32::consts::SQRT_2);
/// assert_eq!(sqrt(f32::INFINITY), f32::INFINITY);
/// assert!(sqrt(-1.0).is_nan());
/// ```
// Once in the image.
#[inline(never)]
#[must_use]
pub fn sqrt(number: f32) -> f32 {
    let bits = number.to_bits();
    if !NORMAL.contains(&bits) {
        cold_path();
        return libm::sqrtf(number);
    }
    // number = z 4^k with z from 1 to 4, and its root is that of z, times 2^k.
    let odd = ((bits >> FRACTION) + 1) & 1;
    let fraction = bits & (ONE - 1);
    let z = f32::from_bits(fraction | ((BIAS + odd) << FRACTION));
    // 1 / sqrt(z): a line through the logarithm and a step with the constants of J. Kadlec, "Improving the fast inverse square root" (2010): within 7e-4;
    // then one of Newton's method: within 8e-7.
    let guess = f32::from_bits(0x5f1f_fff9 - (z.to_bits() >> 1));
    let guess = 0.703_952_25 * guess * (2.389_244_6 - z * guess * guess);
    let inverse = guess * (1.5 - 0.5 * z * guess * guess);
    // The root in units of its last place, and what is left of the square: it fits 32 bits, since the root errs by less than 20 units.
    let near = (z * inverse * ONE as f32) as u32;
    let square = (fraction | ONE) << (FRACTION + odd);
    let left = |root: u32| square.wrapping_sub(root.wrapping_mul(root)) as i32;
    let step = (left(near) as f32 * inverse * (0.5 / ONE as f32)) as i32;
    let root = near.wrapping_add_signed(step);
    // Nearest, if the rest is above -root and at most root: the square of root + 1/2 is root^2 + root + 1/4.
    let rest = left(root);
    let up = u32::from(rest > root as i32);
    let down = u32::from(rest <= -(root as i32));
    // The bit before the root's fraction adds one to the exponent.
    let exponent = (((bits >> FRACTION) + BIAS) >> 1) - 1;
    f32::from_bits((exponent << FRACTION) + root + up - down)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From 1 to 4 every number, against the processor's own root: beyond, only the exponents differ.
    #[test]
    fn every_fraction_has_the_nearest_root() {
        for bits in 1.0_f32.to_bits()..4.0_f32.to_bits() {
            let number = f32::from_bits(bits);
            assert_eq!(sqrt(number).to_bits(), number.sqrt().to_bits(), "{number}");
        }
    }

    /// Every exponent with some fractions, and both signs: 0, numbers below the normal ones, infinity and NaN are among them.
    #[test]
    fn every_exponent_has_the_nearest_root() {
        let mut specials = 0;
        for bits in (0..=u32::MAX).step_by(4093).chain([0, ONE - 1, ONE, NORMAL.end - 1, NORMAL.end, 1 << 31]) {
            let number = f32::from_bits(bits);
            let (root, exact) = (sqrt(number), number.sqrt());
            assert!(root.to_bits() == exact.to_bits() || (root.is_nan() && exact.is_nan()), "{number}: {root}");
            specials += u32::from(!NORMAL.contains(&bits));
        }
        assert!(specials > 500_000, "{specials}");
    }
}
