//! Whether all of several numbers are finite, by one compare.

/// Whether no number is NaN or infinite.
pub(crate) fn all_finite<const N: usize>(numbers: [f32; N]) -> bool {
    // The exponent of a number that is not finite has all bits: one more carries into the sign.
    let carried = numbers.iter().fold(0, |any, number| any | (number.abs().to_bits() + f32::MIN_POSITIVE.to_bits()));
    carried >> 31 == 0
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn it_is_what_each_number_says(numbers in prop::array::uniform3(prop::num::f32::ANY)) {
            prop_assert_eq!(all_finite(numbers), numbers.iter().all(|number| number.is_finite()));
        }
    }

    #[test]
    fn largest_and_least_numbers_are_finite_and_what_is_beyond_is_not() {
        let (largest, least) = (f32::MAX, f32::from_bits(1));
        assert!(all_finite([largest, -largest, least, -least, 0.0, -0.0]));
        for one in [f32::INFINITY, f32::NEG_INFINITY, f32::NAN, -f32::NAN, f32::from_bits(0x7f80_0001)] {
            assert!(!all_finite([1.0, one, -1.0]) && !all_finite([one]), "{one}");
        }
    }
}
