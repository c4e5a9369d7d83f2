//! Value parsers of options: numbers in a range, and names from a list.

use std::fmt::Display;
use std::ops::RangeInclusive;
use std::str::FromStr;

/// A parser of numbers in a range; `unit` follows the range in the error text, with a space in front (" seconds"), or is empty.
pub fn number<T>(range: RangeInclusive<T>, unit: &'static str) -> impl Fn(&str) -> Result<T, String> + Clone
where
    T: FromStr + PartialOrd + Display + Clone,
{
    move |text: &str| {
        let allowed = || format!("allowed is {} to {}{unit}", range.start(), range.end());
        text.parse().ok().filter(|number| range.contains(number)).ok_or_else(allowed)
    }
}

/// A parser of names from a list.
pub fn one_of<T: Copy, const N: usize>(
    all: [T; N],
    name: fn(T) -> &'static str,
) -> impl Fn(&str) -> Result<T, String> + Clone {
    move |text: &str| {
        let allowed = || format!("allowed is one of {}", all.map(name).join(", "));
        all.into_iter().find(|&known| name(known) == text).ok_or_else(allowed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use joint_units::Joint;

    #[test]
    fn a_number_outside_of_its_range_is_refused() {
        let parse = number(0.2..=20.0, " seconds");
        assert_eq!(parse("1.1"), Ok(1.1));
        for bad in ["0", "21", "nan", "x", ""] {
            assert_eq!(parse(bad), Err("allowed is 0.2 to 20 seconds".into()), "{bad}");
        }
        let parse = number(1..=8_usize, "");
        assert!(parse("6") == Ok(6) && parse("0").is_err() && parse("9").is_err());
    }

    #[test]
    fn a_name_outside_of_its_list_is_refused() {
        let parse = one_of(Joint::ALL, Joint::name);
        assert_eq!(parse("left_hip"), Ok(Joint::LeftHip));
        assert_eq!(parse("elbow"), Err("allowed is one of left_hip, right_hip, left_knee, right_knee".into()));
    }
}
