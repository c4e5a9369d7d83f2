//! Decimal numbers with a point, with the bits that the standard library gives them, in less time.

/// Most characters without a sign: the digits as a whole number fit into 64 bits.
const MOST: usize = 17;
/// Up to there every whole number is one of f64.
const EXACT: u64 = 1 << 53;
const POWERS: [f64; MOST + 1] =
    [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17];

/// A finite number with a decimal point, as most fields have it. Every other number is none here.
pub(crate) fn decimal(field: &str) -> Option<f64> {
    few_digits(field).or_else(|| field.parse().ok().filter(|value: &f64| value.is_finite()))
}

/// A number of few digits without exponent: the whole field.
pub(crate) fn few_digits(field: &str) -> Option<f64> {
    leading(field.as_bytes()).and_then(|(value, length)| (length == field.len()).then_some(value))
}

/// The number of few digits without exponent that a text begins with, and its length: the digits as a whole number and the power of ten are
/// exact, so that their quotient is rounded once (Clinger, "How to read floating point numbers accurately", 1990).
#[inline(always)]
pub(crate) fn leading(text: &[u8]) -> Option<(f64, usize)> {
    let negative = text.first() == Some(&b'-');
    let characters = &text[usize::from(negative)..];
    let (mut whole, mut rest) = digits(0, characters);
    let mut count = characters.len() - rest.len();
    let (mut decimals, mut length) = (0, count);
    if let Some((b'.', behind)) = rest.split_first() {
        (whole, rest) = digits(whole, behind);
        decimals = behind.len() - rest.len();
        (count, length) = (count + decimals, length + 1 + decimals);
    }
    if count == 0 || length > MOST || whole > EXACT {
        return None;
    }
    // Signed whole numbers are converted by one instruction.
    let value = whole as i64 as f64 / POWERS[decimals];
    let sign = u64::from(negative) << 63;
    Some((f64::from_bits(value.to_bits() | sign), length + usize::from(negative)))
}

/// A whole number with the digits behind it that a text begins with, and the rest of the text. Only up to 19 digits are the number.
///
/// Where the digits end is found by jumps, which a processor foresees in a column of like numbers: what is behind them need not wait.
#[inline(always)]
fn digits(mut whole: u64, mut text: &[u8]) -> (u64, &[u8]) {
    // Four at a time where there are as many: the upper half of each byte is 3, and still is with 6 added.
    while let Some((four, rest)) = text.split_first_chunk::<4>() {
        let word = u32::from_le_bytes(*four);
        const UPPER: u32 = 0xf0f0_f0f0;
        if (word & UPPER) | ((word.wrapping_add(0x0606_0606) & UPPER) >> 4) != 0x3333_3333 {
            break;
        }
        // Two numbers of two digits, then one of four.
        let pairs = ((word & 0x0f0f_0f0f).wrapping_mul(1 + (10 << 8)) >> 8) & 0x00ff_00ff;
        let number = pairs.wrapping_mul(1 + (100 << 16)) >> 16;
        whole = whole.wrapping_mul(10_000).wrapping_add(u64::from(number));
        text = rest;
    }
    while let Some((first, rest)) = text.split_first() {
        let digit = first.wrapping_sub(b'0');
        if digit >= 10 {
            break;
        }
        whole = whole.wrapping_mul(10).wrapping_add(u64::from(digit));
        text = rest;
    }
    (whole, text)
}

#[cfg(test)]
mod tests {
    use super::*;

    proptest::proptest! {
        /// Nothing is taken that the standard library refuses, and the bits are the same.
        #[test]
        fn numbers_are_those_of_the_standard_library(text in "[-+]?[0-9]{0,25}[.]?[0-9]{0,25}([eE][-+]?[0-9]{0,4})?|[-+0-9.eEinfaINFANty_ x]{0,9}") {
            if let Some(value) = decimal(&text) {
                proptest::prop_assert_eq!(text.parse::<f64>().map(f64::to_bits), Ok(value.to_bits()), "{}", text);
            }
        }

        #[test]
        fn every_number_is_read_back(bits in proptest::prelude::any::<u64>()) {
            let value = f64::from_bits(bits);
            if value.is_finite() {
                proptest::prop_assert_eq!(decimal(&format!("{value:e}")).map(f64::to_bits), Some(bits));
                proptest::prop_assert_eq!(decimal(&value.to_string()).map(f64::to_bits), Some(bits));
            }
        }

        /// What stands behind a number of few digits changes nothing, and all of up to 15 digits are found: each is below 2^53.
        #[test]
        fn a_number_ends_where_its_characters_end(number in "-?[0-9]{1,9}([.][0-9]{0,6})?", behind in "([^0-9.].{0,20})?|[^0-9.]") {
            let found = leading(format!("{number}{behind}").as_bytes());
            let expected = number.parse::<f64>().map(f64::to_bits).unwrap();
            proptest::prop_assert_eq!(found.map(|(value, length)| (value.to_bits(), length)), Some((expected, number.len())));
        }
    }

    #[test]
    fn the_limits_of_few_digits_are_kept() {
        for (text, is_few) in [
            ("9007199254740992", true),
            ("9007199254740993", false),
            ("0.000000000000001", true),
            ("0.0000000000000001", false),
            ("-0.000000000000001", true),
            ("00000000000000000", true),
            ("000000000000000000", false),
            ("123456789012345678901234567890", false),
            ("18446744073709551617", false),
            ("-0", true),
            ("5.", true),
            (".5", true),
            (".", false),
            ("-", false),
            ("-.", false),
            ("", false),
            ("1.5.", false),
            ("--1", false),
        ] {
            let value = few_digits(text);
            assert_eq!(value.is_some(), is_few, "{text}");
            assert!(value.is_none_or(|value| Ok(value.to_bits()) == text.parse::<f64>().map(f64::to_bits)), "{text}");
        }
    }
}
