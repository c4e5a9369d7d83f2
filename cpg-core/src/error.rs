//! Errors of `build`: the field, its value, and what is allowed.

use joint_units::Period;

use crate::Scalar;

/// The place of a value in a configuration or a state, printed as `coupling` or `amplitude[2]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Field {
    /// Name of the field, as in the configuration type.
    pub name: &'static str,
    /// Place in the field where it is an array, counted from 0.
    pub index: Option<usize>,
}

impl Field {
    /// A field that is one value.
    #[must_use]
    pub const fn of(name: &'static str) -> Self {
        Self { name, index: None }
    }

    /// One element of a field that is an array.
    #[must_use]
    pub const fn at(name: &'static str, index: usize) -> Self {
        Self { name, index: Some(index) }
    }
}

impl core::fmt::Display for Field {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self.index {
            None => f.write_str(self.name),
            Some(index) => write!(f, "{}[{index}]", self.name),
        }
    }
}

/// Why a configuration was refused: the field, its value, and what is allowed.
///
/// ```
/// use cpg_core::BuildError;
/// use cpg_core::gait::default_walk::default_config;
/// use cpg_core::network::graph::Biped;
/// use cpg_core::network::phase_coupled::Robust;
/// use joint_units::Period;
/// let mut config = default_config();
/// config.coupling[2] = 3.0;
/// let refused = config.build(Period::MILLISECOND).map(|_: Robust<Biped, 4, 4>| ()).unwrap_err();
/// assert_eq!(refused.to_string(), "coupling[2] = 3: must be from 0 to 2");
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum BuildError {
    /// The value is infinite or not a number; any finite number within the field's range is allowed.
    NotFinite {
        /// Which value.
        field: Field,
        /// The value: NaN or an infinity.
        value: NonFinite,
    },
    /// The value lies outside of `min..=max`.
    OutOfRange {
        /// Which value.
        field: Field,
        /// The value.
        value: f32,
        /// Smallest value allowed.
        min: f32,
        /// Largest value allowed.
        max: f32,
    },
    /// The control period is too long to integrate this configuration safely.
    PeriodTooLong {
        /// The period, in microseconds.
        micros: u32,
        /// Longest period allowed, in microseconds; 0 if no period is.
        max_micros: u32,
    },
}

/// A value that is not a finite number. Not `non_exhaustive`: there are no others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum NonFinite {
    /// Not a number.
    NotANumber,
    /// Infinity.
    Infinite,
    /// Minus infinity.
    MinusInfinite,
}

impl NonFinite {
    fn of(value: f32) -> Self {
        if value.is_nan() {
            Self::NotANumber
        } else if value > 0.0 {
            Self::Infinite
        } else {
            Self::MinusInfinite
        }
    }
}

impl core::fmt::Display for NonFinite {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::NotANumber => "nan",
            Self::Infinite => "inf",
            Self::MinusInfinite => "-inf",
        })
    }
}

impl core::fmt::Display for BuildError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NotFinite { field, value } => write!(f, "{field} = {value}: must be a finite number"),
            Self::OutOfRange { field, value, min, max } => {
                write!(f, "{field} = {value}: must be from {min} to {max}")
            }
            Self::PeriodTooLong { micros, max_micros } => {
                write!(f, "period = {micros} us: must be at most {max_micros} us for this configuration")
            }
        }
    }
}

impl core::error::Error for BuildError {}

/// Accepts a finite value from `min` to `max`.
pub(crate) fn in_range<T: Scalar>(value: T, field: Field, min: f32, max: f32) -> Result<(), BuildError> {
    if !value.is_finite() {
        return Err(BuildError::NotFinite { field, value: NonFinite::of(value.to_f32()) });
    }
    if value < T::from_f32(min) || value > T::from_f32(max) {
        return Err(BuildError::OutOfRange { field, value: value.to_f32(), min, max });
    }
    Ok(())
}

/// Accepts an array of finite values from `min` to `max`.
pub(crate) fn all_in_range<T: Scalar>(
    values: impl IntoIterator<Item = T>,
    name: &'static str,
    min: f32,
    max: f32,
) -> Result<(), BuildError> {
    values.into_iter().enumerate().try_for_each(|(index, value)| in_range(value, Field::at(name, index), min, max))
}

/// Accepts a control period up to `max_micros`.
pub(crate) fn allow_period(period: Period, max_micros: u32) -> Result<(), BuildError> {
    let micros = period.micros();
    if micros > max_micros { Err(BuildError::PeriodTooLong { micros, max_micros }) } else { Ok(()) }
}
