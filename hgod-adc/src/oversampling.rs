//! Oversampling: drops the least and the greatest of the four conversions of a tick and averages the other two.
//!
//! ```text
//! c(1) <= c(2) <= c(3) <= c(4)        the conversions in the order of their size
//! code = (c(2) + c(3)) / 2            a half is rounded to the even code
//! ```
//! Why not the mean: a servo's switching disturbs a single conversion, and the mean would contain a quarter of that spike, which is too small to
//! be recognised as a spike. One wrong conversion of four, of any size, moves the trimmed mean by no more than the spread of
//! the other three. Two wrong ones on the same side are not removed; the rate validity and the median of the filter handle them. The
//! disadvantage is noise: for Gaussian noise its variance is 0.298 of a single conversion's, not 0.25.
//!
//! The result is a 12 bit code like the conversions. Halves are rounded to the even code, up as often as down: always up would make it
//! 0.25 codes too high on average.

use joint_units::AdcCode;

/// Conversions of a channel in a tick.
pub const OVERSAMPLING: usize = 4;

/// One code of four conversions. For codes of 12 bits the result has 12 bits.
///
/// ```
/// use hgod_adc::trimmed_mean;
/// use joint_units::AdcCode;
/// assert_eq!(trimmed_mean([2000, 2004, 2002, 2003].map(AdcCode)), AdcCode(2002));
/// // A spike in one conversion.
/// assert_eq!(trimmed_mean([2000, 4095, 2002, 2003].map(AdcCode)), AdcCode(2002));
/// ```
#[must_use]
pub fn trimmed_mean(conversions: [AdcCode; OVERSAMPLING]) -> AdcCode {
    let [a, b, c, d] = conversions;
    // The greater of the two lesser ones and the lesser of the two greater ones are the middle two.
    let (low, high) = (a.min(b).max(c.min(d)), a.max(b).min(c.max(d)));
    let sum = u32::from(low.0) + u32::from(high.0);
    // The mean of two 16 bit numbers has 16 bits.
    AdcCode(((sum + (sum >> 1 & 1)) >> 1) as u16)
}

/// The codes of two channels at once: each word has a conversion of the one in its lower half and of the other in its upper half, each of at most
/// 15 bits. The same as [`trimmed_mean`] of each, in about half the instructions: a processor of 32 bits compares both by one subtraction.
///
/// ```
/// use hgod_adc::trimmed_means_of_two;
/// use joint_units::AdcCode;
/// let conversions = [(2000, 100), (2004, 103), (4095, 101), (2003, 0)].map(|(low, high)| low | high << 16);
/// assert_eq!(trimmed_means_of_two(conversions), [2004, 100].map(AdcCode));
/// ```
#[must_use]
pub fn trimmed_means_of_two(conversions: [u32; OVERSAMPLING]) -> [AdcCode; 2] {
    const HALVES: u32 = 0x0001_0001;
    // The lesser and the greater of each half.
    let sorted = |a: u32, b: u32| {
        // No half borrows from the other: the bit above the codes is set in `a` only, and stays set where `a` is not the lesser one.
        let is_greater = ((a | HALVES << 15).wrapping_sub(b) >> 15) & HALVES;
        let differ = (a ^ b) & (is_greater << 16).wrapping_sub(is_greater);
        (a ^ differ, b ^ differ)
    };
    let [a, b, c, d] = conversions;
    let ((low_ab, high_ab), (low_cd, high_cd)) = (sorted(a, b), sorted(c, d));
    // The greater of the two lesser ones and the lesser of the two greater ones are the middle two.
    let ((_, low), (high, _)) = (sorted(low_ab, low_cd), sorted(high_ab, high_cd));
    let sum = low.wrapping_add(high);
    let rounded = sum.wrapping_add(sum >> 1 & HALVES);
    // A mean has the bits of a code.
    [AdcCode((rounded as u16) >> 1), AdcCode((rounded >> 17) as u16)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Against one channel at a time: all codes of 15 bits, and close ones.
        #[test]
        fn two_channels_are_each_as_one(
            low in prop::array::uniform4(0_u16..0x8000), high in prop::array::uniform4(0_u16..0x8000), mask in 0_u16..0x8000,
        ) {
            for mask in [0x7FFF, mask, 3, 0] {
                let [low, high] = [low, high].map(|codes| codes.map(|code| code & mask));
                let words = core::array::from_fn(|at| u32::from(low[at]) | u32::from(high[at]) << 16);
                let each = [low, high].map(|codes| trimmed_mean(codes.map(AdcCode)));
                prop_assert_eq!(trimmed_means_of_two(words), each, "{:?} {:?}", low, high);
            }
        }

        /// Against the definition: sort, drop the ends, mean of the rest.
        #[test]
        fn it_is_the_mean_of_the_middle_two(codes: [u16; 4]) {
            let mut sorted = codes;
            sorted.sort_unstable();
            let want = (f64::from(sorted[1]) + f64::from(sorted[2])) / 2.0;
            prop_assert_eq!(f64::from(trimmed_mean(codes.map(AdcCode)).0), want.round_ties_even());
        }

        #[test]
        fn one_wild_conversion_stays_within_the_other_three(good in prop::array::uniform3(0_u16..4096), wild: u16, at in 0_usize..4) {
            let mut codes = good.to_vec();
            codes.insert(at, wild);
            let codes: [u16; 4] = codes.try_into().unwrap();
            let mean = trimmed_mean(codes.map(AdcCode)).0;
            prop_assert!(good.iter().min() <= Some(&mean) && Some(&mean) <= good.iter().max());
        }
    }

    #[test]
    fn noise_falls_as_stated() {
        // Gaussian noise of 20 codes by the sum of twelve uniform numbers (xorshift).
        let mut seed = 88_172_645_463_325_252_u64;
        let mut noisy = || {
            let sum: f64 = (0..12)
                .map(|_| {
                    seed ^= seed << 13;
                    seed ^= seed >> 7;
                    seed ^= seed << 17;
                    (seed >> 11) as f64 / (1_u64 << 53) as f64
                })
                .sum();
            AdcCode((2000.0 + 20.0 * (sum - 6.0)).round() as u16)
        };
        let n = 100_000;
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..n {
            let off = f64::from(trimmed_mean([noisy(), noisy(), noisy(), noisy()]).0) - 2000.0;
            sum += off;
            squares += off * off;
        }
        let mean = sum / f64::from(n);
        let variance = squares / f64::from(n) - mean * mean;
        assert!(mean.abs() < 0.15, "{mean} codes");
        assert!((variance / 400.0 - 0.298).abs() < 0.01, "{}", variance / 400.0);
    }
}
