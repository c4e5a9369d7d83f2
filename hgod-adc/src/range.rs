//! Range error of a parameter: the field, its value, and the allowed interval.

use core::fmt;

/// A parameter is not a number or lies outside its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RangeError {
    /// Path of the field: `reference.divider`.
    pub field: &'static str,
    /// The value that was refused.
    pub value: f32,
    /// Least value that is allowed.
    pub min: f32,
    /// Greatest value that is allowed.
    pub max: f32,
}

impl fmt::Display for RangeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} = {}: allowed is {} to {}", self.field, self.value, self.min, self.max)
    }
}

impl core::error::Error for RangeError {}

/// The value if it lies in `min..=max`; "not a number" is refused.
pub(crate) fn within(field: &'static str, value: f32, min: f32, max: f32) -> Result<f32, RangeError> {
    if value >= min && value <= max { Ok(value) } else { Err(RangeError { field, value, min, max }) }
}
