//! Sums and products of single-precision numbers for every case, as IEEE 754-2019 has them: rounded to nearest, ties to even, with subnormal numbers.
//!
//! The routines of the program (`float.rs`) compute what a walk consists of, and leave the rest to these: operands that are zero, subnormal, infinite
//! or NaN, and products near the ends of the range. So these are written to be read, not to be fast.
//!
//! A NaN comes back with its sign cleared and its quiet bit set, as from Rust's own routines for this core.

const IMPLICIT: u32 = 1 << 23;
const INFINITY: u32 = 0xFF << 23;
const SIGN: u32 = 1 << 31;
const QUIET: u32 = 1 << 22;
/// Bits below the last one of a result, of which the lowest collects everything below it.
const GUARD: u32 = 6;

/// The bits of a + b.
#[must_use]
pub fn add(a: u32, b: u32) -> u32 {
    let (size_a, size_b) = (a & !SIGN, b & !SIGN);
    if let Some(nan) = nan_of(size_a, size_b) {
        return nan;
    }
    match (size_a == INFINITY, size_b == INFINITY) {
        (true, true) if a != b => return INFINITY | QUIET,
        (true, _) => return a,
        (_, true) => return b,
        _ => {}
    }
    let (large, small) = if size_a >= size_b { (a, b) } else { (b, a) };
    let (exponent, large_fraction) = parts(large);
    let (small_exponent, small_fraction) = parts(small);
    let small_fraction = shifted_right(small_fraction << GUARD, exponent.abs_diff(small_exponent));
    let large_fraction = large_fraction << GUARD;
    if (a ^ b) & SIGN == 0 {
        return rounded(large & SIGN, exponent, large_fraction + small_fraction);
    }
    match large_fraction - small_fraction {
        // Nearest: an exact zero is positive.
        0 => 0,
        fraction => rounded(large & SIGN, exponent, fraction),
    }
}

/// The bits of a * b.
#[must_use]
pub fn multiply(a: u32, b: u32) -> u32 {
    let (size_a, size_b, sign) = (a & !SIGN, b & !SIGN, (a ^ b) & SIGN);
    if let Some(nan) = nan_of(size_a, size_b) {
        return nan;
    }
    let has_zero = size_a == 0 || size_b == 0;
    if size_a == INFINITY || size_b == INFINITY {
        return if has_zero { INFINITY | QUIET } else { sign | INFINITY };
    }
    if has_zero {
        return sign;
    }
    let ((exponent_a, fraction_a), (exponent_b, fraction_b)) = (normal(parts(a)), normal(parts(b)));
    // In 2^46..2^48, of which 2^46 is the leading one of the exponent below.
    let product = u64::from(fraction_a) * u64::from(fraction_b);
    let fraction = (product >> (23 - GUARD)) as u32 | u32::from(product & ((1 << (23 - GUARD)) - 1) != 0);
    let exponent = exponent_a + exponent_b - 127;
    if exponent >= 1 {
        rounded(sign, exponent, fraction)
    } else {
        rounded(sign, 1, shifted_right(fraction, exponent.abs_diff(1)))
    }
}

/// What comes of a NaN.
fn nan_of(size_a: u32, size_b: u32) -> Option<u32> {
    [size_a, size_b].into_iter().find(|size| *size > INFINITY).map(|size| size | QUIET)
}

/// Exponent, biased, and fraction with its leading one; a subnormal number has the exponent 1 and no leading one.
fn parts(bits: u32) -> (i32, u32) {
    match (bits & INFINITY) >> 23 {
        0 => (1, bits & (IMPLICIT - 1)),
        exponent => (exponent as i32, bits & (IMPLICIT - 1) | IMPLICIT),
    }
}

/// With the leading one in its place, of a fraction that is not zero.
fn normal((exponent, fraction): (i32, u32)) -> (i32, u32) {
    let shift = fraction.leading_zeros() - 8;
    (exponent - shift as i32, fraction << shift)
}

/// Shifted, with a one in the lowest place if anything was lost.
fn shifted_right(fraction: u32, places: u32) -> u32 {
    match fraction.checked_shr(places) {
        Some(kept) => kept | u32::from(kept << places != fraction),
        None => u32::from(fraction != 0),
    }
}

/// The number of this exponent, 1 or larger, whose fraction has its leading one at `IMPLICIT << GUARD`, one above it, or anywhere below it.
fn rounded(sign: u32, mut exponent: i32, mut fraction: u32) -> u32 {
    const LEADING: u32 = IMPLICIT << GUARD;
    if fraction >= LEADING << 1 {
        fraction = shifted_right(fraction, 1);
        exponent += 1;
    }
    while fraction < LEADING && exponent > 1 {
        fraction <<= 1;
        exponent -= 1;
    }
    if exponent >= 0xFF {
        return sign | INFINITY;
    }
    // The leading one adds 1 to the exponent's field; a subnormal number has none. A carry of the rounding goes into the field as it has to.
    let number = ((exponent as u32 - 1) << 23) + (fraction >> GUARD);
    let below = fraction & ((1 << GUARD) - 1);
    let half = 1 << (GUARD - 1);
    let up = below > half || (below == half && number & 1 == 1);
    sign | (number + u32::from(up))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Numbers around every border: each exponent that matters, with fractions of few bits and of all.
    fn borders() -> Vec<u32> {
        let exponents =
            [0, 1, 2, 3, 23, 24, 25, 26, 63, 64, 100, 103, 104, 126, 127, 128, 150, 151, 152, 190, 191, 253, 254, 255];
        let fractions =
            [0, 1, 2, 3, 0x20_0000, 0x3F_FFFF, 0x40_0000, 0x40_0001, 0x55_5555, 0x7F_FFFC, 0x7F_FFFE, 0x7F_FFFF];
        let sizes =
            exponents.iter().flat_map(|exponent| fractions.iter().map(move |fraction| exponent << 23 | fraction));
        sizes.flat_map(|size| [size, size | SIGN]).collect()
    }

    /// Equal to the processor's result; a NaN has no payload that must be kept.
    fn equal(bits: u32, number: f32) -> bool {
        if number.is_nan() { f32::from_bits(bits).is_nan() } else { bits == number.to_bits() }
    }

    #[test]
    fn all_pairs_of_borders_are_as_the_processor_has_them() {
        for a in borders() {
            for b in borders() {
                let (x, y) = (f32::from_bits(a), f32::from_bits(b));
                assert!(equal(add(a, b), x + y), "{a:#010x} + {b:#010x}");
                assert!(equal(multiply(a, b), x * y), "{a:#010x} * {b:#010x}");
            }
        }
    }

    #[test]
    fn a_nan_comes_back_quiet_and_positive() {
        for operation in [add, multiply] {
            assert_eq!(operation(0xFF80_0001, 0x7FC0_0002), 0x7FC0_0001);
            assert_eq!(operation(0x3F80_0000, 0xFFC0_0002), 0x7FC0_0002);
        }
        assert_eq!(add(0x7F80_0000, 0xFF80_0000), 0x7FC0_0000);
        assert_eq!(multiply(0x7F80_0000, 0x8000_0000), 0x7FC0_0000);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200_000))]
        #[test]
        fn any_pair_is_as_the_processor_has_it(a: u32, b: u32, near in -30_i32..30) {
            // The second time with exponents next to each other.
            let close = b & !INFINITY | (((a & INFINITY) >> 23) as i32 + near).clamp(0, 255).cast_unsigned() << 23;
            for b in [b, close] {
                let (x, y) = (f32::from_bits(a), f32::from_bits(b));
                prop_assert!(equal(add(a, b), x + y), "{a:#010x} + {b:#010x}");
                prop_assert!(equal(multiply(a, b), x * y), "{a:#010x} * {b:#010x}");
            }
        }
    }
}
