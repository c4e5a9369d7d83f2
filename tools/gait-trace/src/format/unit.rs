//! Units of columns by their names, and numbers in decimal multiples of a unit.

use crate::fault::Fault;
use crate::format::angle_unit::AngleUnit;
use crate::format::number::few_digits;
use crate::format::text_table::{finite, is_missing, number_or_missing};
use crate::format::words::SECONDS;
use crate::recording::{Channel, Quantity};

/// What a file says about the unit of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Said {
    /// Nothing: angles in an unknown unit, or volts.
    Nothing,
    /// The column holds angles, in a unit that is not named.
    Angle,
    /// Angles in this unit.
    Unit(AngleUnit),
    /// Angles in this unit, by the format and not by the file; with the reason.
    Format(AngleUnit, &'static str),
    /// Volts. The values of the column are in volts, whatever multiple the file has.
    Volts,
    /// Degrees that the reader computed from joint centres.
    Computed,
    /// Degrees that were volts.
    Calibrated,
}

impl Said {
    /// Angles in a unit that may be missing.
    pub(crate) fn angle(unit: Option<AngleUnit>) -> Self {
        unit.map_or(Self::Angle, Self::Unit)
    }

    /// The unit of the angles, if the file or its format names one.
    pub(crate) fn unit(self) -> Option<AngleUnit> {
        match self {
            Self::Unit(unit) | Self::Format(unit, _) => Some(unit),
            Self::Computed | Self::Calibrated => Some(AngleUnit::Degrees),
            Self::Nothing | Self::Angle | Self::Volts => None,
        }
    }
}

/// The power of ten of a unit of voltage: 0 for volts, -3 for millivolts.
pub(crate) fn volts_of(unit: &str) -> Option<i32> {
    match unit.trim().trim_matches(['(', ')', '[', ']', '{', '}', ' ']).to_lowercase().as_str() {
        "v" | "volt" | "volts" => Some(0),
        "mv" | "millivolt" | "millivolts" => Some(-3),
        "uv" | "µv" | "μv" | "microvolt" | "microvolts" => Some(-6),
        _ => None,
    }
}

/// The power of ten of a unit of time: 0 for seconds, -3 for milliseconds.
pub(crate) fn seconds_of(unit: &str) -> Option<i32> {
    match unit.trim().trim_matches(['(', ')', '[', ']', '{', '}', ' ']).to_lowercase().as_str() {
        unit if SECONDS.contains(&unit) => Some(0),
        "ms" | "msec" | "msecs" | "millis" | "millisecond" | "milliseconds" => Some(-3),
        "us" | "usec" | "µs" | "μs" | "microsecond" | "microseconds" => Some(-6),
        "ns" | "nsec" | "nanosecond" | "nanoseconds" => Some(-9),
        _ => None,
    }
}

/// The power of ten if a heading is in volts: a pin (`PA1`), a numbered channel (`Volt2`), or a unit at its end (`goniometer (mV)`,
/// `knee_v`, `C1 in V`).
pub(crate) fn volts_in(heading: &str) -> Option<i32> {
    if matches!(Channel::of_column(heading), Some((_, Quantity::PinVolts))) {
        return Some(0);
    }
    let plain = heading.trim_end_matches([']', ')', '}', ' ']);
    let numbered = plain.trim_end_matches(|c: char| c.is_ascii_digit());
    if numbered.len() < plain.len() && matches!(numbered.to_ascii_lowercase().as_str(), "volt" | "volts") {
        return Some(0);
    }
    let (before, unit) = plain.rsplit_once(['_', '[', '(', '{', ' ', '/'])?;
    // A single letter after a blank may be the name of a channel.
    let lone = plain.len() > before.len() && plain[before.len()..].starts_with(' ') && unit.len() == 1;
    if lone && !before.to_ascii_lowercase().ends_with(" in") { None } else { volts_of(unit) }
}

/// A heading without its unit of voltage, which is no word of a joint's name: `knee (mV)` gives `knee `. A lone `_v` may be a speed.
pub(crate) fn without_volts(heading: &str) -> &str {
    let end = heading.trim_end_matches([']', ')', '}', ' ']).rfind(['_', '[', '(', '{', ' ', '/']);
    match (volts_in(heading), end) {
        (Some(_), Some(end)) if !heading[end..].eq_ignore_ascii_case("_v") => &heading[..end],
        _ => heading,
    }
}

/// A number in units of `10^power` as [`scaled`] reads it, or NaN for a missing value.
#[inline]
pub(crate) fn scaled_or_missing(field: &str, comma: bool, power: i32) -> Result<f64, Fault> {
    match plain(field, power) {
        Some(value) => Ok(value),
        None => any_scaled_or_missing(field, comma, power),
    }
}

/// A number as most fields have it: of few digits, in the unit itself. Its errors would take more time than the number.
#[inline]
fn plain(field: &str, power: i32) -> Option<f64> {
    if power == 0 { few_digits(field) } else { None }
}

fn any_scaled_or_missing(field: &str, comma: bool, power: i32) -> Result<f64, Fault> {
    if power == 0 {
        return number_or_missing(field, comma);
    }
    if is_missing(field) { Ok(f64::NAN) } else { scaled(field, comma, power) }
}

/// A finite number in units of `10^power`, rounded once: `12.3` with a power of -3 is the same number as `0.0123`.
#[inline]
pub(crate) fn scaled(field: &str, comma: bool, power: i32) -> Result<f64, Fault> {
    match plain(field, power) {
        Some(value) => Ok(value),
        None => any_scaled(field, comma, power),
    }
}

fn any_scaled(field: &str, comma: bool, power: i32) -> Result<f64, Fault> {
    let value = finite(field, comma)?;
    if power == 0 {
        return Ok(value);
    }
    let (mantissa, exponent) = field.split_once(['e', 'E']).unwrap_or((field, "0"));
    let exponent = exponent.parse::<i32>().unwrap_or_default().saturating_add(power);
    let text = format!("{}e{exponent}", mantissa.trim());
    finite(&text, comma).or(Ok(value * 10_f64.powi(power)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn volts_are_recognised_by_name() {
        for (heading, power) in [
            ("PA1", Some(0)),
            ("goniometer (V)", Some(0)),
            ("knee_mV", Some(-3)),
            ("left knee [mV]", Some(-3)),
            ("Volt3", Some(0)),
            ("C1 in V", Some(0)),
            ("knee (µV)", Some(-6)),
            ("ADC", None),
            ("Channel V", None),
            ("left_knee_deg", None),
            ("v", None),
            ("lev", None),
        ] {
            assert_eq!(volts_in(heading), power, "{heading}");
        }
    }

    #[test]
    fn decimal_multiples_are_rounded_once() {
        for (field, power, value) in [
            ("12.3", -3, 0.0123),
            ("1.1", -3, 0.0011),
            ("-4.35E+01", -3, -0.0435),
            ("7", -9, 7e-9),
            ("0.07", -6, 0.07e-6),
            ("+2.5", 0, 2.5),
        ] {
            assert_eq!(scaled(field, false, power).unwrap(), value, "{field}");
        }
        assert_eq!(scaled("1,5", true, -3).unwrap(), 0.0015);
        assert!(scaled("nan", false, -3).is_err() && scaled("x", false, -3).is_err() && scaled("", false, -3).is_err());
    }
}
