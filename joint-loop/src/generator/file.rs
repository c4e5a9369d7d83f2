//! What a kind of generator needs for the generator file (TOML): a trait, the units of the file and its errors.

use core::fmt;

use cpg_core::BuildError;
use joint_units::{Joint, Period, Phase, Radians};
use serde::de::{DeserializeOwned, Error, Expected, Unexpected, Visitor};
use serde::{Deserializer, Serialize};

use crate::generator::kind::BoardKind;

/// Names of the joints, in the order of [`Joint::ALL`].
pub(crate) const JOINTS: [&str; Joint::COUNT] =
    [Joint::LeftHip.name(), Joint::RightHip.name(), Joint::LeftKnee.name(), Joint::RightKnee.name()];

/// Phase leads of a generator file, degrees of the cycle. Any phase is allowed in a configuration, so the range is here.
const PHASE_DEG: (f32, f32) = (-360.0, 360.0);

/// Implemented by the parameters of a kind in the units of its file.
pub(crate) trait KindSet: Serialize + DeserializeOwned {
    /// The configuration in SI units.
    type Config: BoardKind;
    /// Keys of the configuration's fields in the file.
    const KEYS: &'static [Key];
    /// The `use` lines of a configuration in Rust.
    const RUST_IMPORTS: &'static str;

    /// In SI units.
    fn config(&self) -> Self::Config;
    /// About how long a stride is, seconds.
    fn stride_guess_s(&self) -> f64;
    /// Checks that the configuration cannot make, because it cannot represent the error.
    fn check_form(&self) -> Result<(), SetError> {
        Ok(())
    }
}

/// Checks every parameter, with the ranges of the configuration's build at 1 ms.
pub(crate) fn check<S: KindSet>(set: &S) -> Result<(), SetError> {
    set.check_form()?;
    match set.config().build(Period::MILLISECOND) {
        Ok(_) => Ok(()),
        Err(error) => Err(in_file(error, S::KEYS)),
    }
}

/// Checks the phase leads of the joints, degrees.
pub(crate) fn check_phases(key: &'static str, leads: [f32; Joint::COUNT]) -> Result<(), SetError> {
    let (least, most) = PHASE_DEG;
    match leads.into_iter().zip(JOINTS).find(|(lead, _)| !(least..=most).contains(lead)) {
        None => Ok(()),
        Some((_, joint)) => Err(SetError::Value {
            key: KeyPath::of(key, joint),
            allowed: Allowed::Range { least, most, unit: Unit::PlainDegrees },
        }),
    }
}

/// Key of a configuration's parameter in the generator file.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Key {
    /// Field in [`BuildError`]; `*` stands for a joint's name.
    pub(crate) field: &'static str,
    /// Key in the file's table of the kind; `*` stands for the same name, or for one of `names`.
    pub(crate) key: &'static str,
    /// Names that the index of the field stands for; empty if the index is one in a list of numbers.
    pub(crate) names: &'static [&'static str],
    /// Unit of the file.
    pub(crate) unit: Unit,
}

/// Units of the generator file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// A number without a unit.
    One,
    /// Seconds.
    Seconds,
    /// Degrees; radians in the configuration.
    Degrees,
    /// Degrees, in the configuration too.
    PlainDegrees,
    /// Radians per second.
    RadiansPerSecond,
    /// 1/s.
    PerSecond,
    /// 1/(deg s).
    PerDegreeSecond,
    /// s^2/deg^2.
    SquareSecondsPerSquareDegree,
}

impl Unit {
    /// With a leading space; empty for a number without a unit.
    #[must_use]
    pub const fn suffix(self) -> &'static str {
        match self {
            Self::One => "",
            Self::Seconds => " s",
            Self::Degrees | Self::PlainDegrees => " degrees",
            Self::RadiansPerSecond => " rad/s",
            Self::PerSecond => " 1/s",
            Self::PerDegreeSecond => " 1/(deg s)",
            Self::SquareSecondsPerSquareDegree => " s^2/deg^2",
        }
    }

    /// A number of the configuration in the unit of the file.
    fn of(self, value: f32) -> f32 {
        if self == Self::Degrees { Radians(value).degrees() } else { value }
    }
}

/// Path of a key in the kind's table of a generator file: `left_hip.cos_deg[2]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct KeyPath {
    key: &'static str,
    name: &'static str,
    index: Option<usize>,
}

impl KeyPath {
    /// A key, whose `*` stands for the name.
    pub(crate) const fn of(key: &'static str, name: &'static str) -> Self {
        Self { key, name, index: None }
    }
}

impl fmt::Display for KeyPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.key.split_once('*') {
            Some((before, after)) => write!(f, "{before}{}{after}", self.name)?,
            None => f.write_str(self.key)?,
        }
        self.index.map_or(Ok(()), |index| write!(f, "[{index}]"))
    }
}

/// What is allowed for a value of a generator file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Allowed {
    /// Numbers from `least` to `most`.
    Range {
        /// Least number, in `unit`.
        least: f32,
        /// Greatest number, in `unit`.
        most: f32,
        /// Unit.
        unit: Unit,
    },
    /// Any finite number.
    Finite,
    /// As many numbers as in `cos_deg`.
    Count(usize),
    /// The joint that the follower's sensor is on.
    Sensor(&'static str),
}

impl fmt::Display for Allowed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Range { least, most, unit } => write!(f, "a number from {least} to {most}{}", unit.suffix()),
            Self::Finite => f.write_str("a finite number"),
            Self::Count(count) => write!(f, "as many numbers as in `cos_deg`: {count}"),
            Self::Sensor(joint) => write!(
                f,
                "\"{joint}\", the `sensor` of the follower: learn corrections for it with `footfall fit --follow {joint}`, or leave out the table"
            ),
        }
    }
}

/// Why the parameters of a generator file are refused.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum SetError {
    /// The value of this key is not allowed.
    Value {
        /// The key, in the kind's table.
        key: KeyPath,
        /// What is allowed.
        allowed: Allowed,
    },
    /// A rule of the generator that is not about one key.
    Build(BuildError),
}

impl fmt::Display for SetError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Value { key, allowed } => write!(f, "{key}: allowed is {allowed}"),
            Self::Build(error) => write!(f, "{error}"),
        }
    }
}

impl core::error::Error for SetError {}

/// Converts the error of a configuration to an error of its generator file.
pub(crate) fn in_file(error: BuildError, keys: &[Key]) -> SetError {
    let (field, range) = match error {
        BuildError::NotFinite { field, .. } => (field, None),
        BuildError::OutOfRange { field, min, max, .. } => (field, Some((min, max))),
        _ => return SetError::Build(error),
    };
    let found = keys.iter().find_map(|key| {
        let name = match key.field.strip_prefix('*') {
            None => (key.field == field.name).then_some(""),
            Some(rest) => field.name.strip_suffix(rest),
        }?;
        Some((key, name))
    });
    let Some((key, name)) = found else { return SetError::Build(error) };
    let path = match field.index {
        Some(index) if !key.names.is_empty() => KeyPath::of(key.key, key.names.get(index).copied().unwrap_or("")),
        index => KeyPath { key: key.key, name, index },
    };
    let allowed = range.map_or(Allowed::Finite, |(min, max)| Allowed::Range {
        least: key.unit.of(min),
        most: key.unit.of(max),
        unit: key.unit,
    });
    SetError::Value { key: path, allowed }
}

/// The nearest phase to a lead in degrees of the cycle.
pub(crate) fn phase(degrees: f32) -> Phase {
    let cycles = (f64::from(degrees) / 360.0) % 1.0;
    let scaled = if cycles < 0.0 { cycles + 1.0 } else { cycles } * 4_294_967_296.0;
    let whole = scaled as u64;
    let up = scaled - whole as f64 >= 0.5;
    Phase(whole.wrapping_add(u64::from(up)) as u32)
}

/// Reads one of the words and returns its index in the list.
///
/// # Errors
/// Another word, or no word; both list the words.
pub fn one_of<'de, D: Deserializer<'de>>(deserializer: D, words: &'static [&'static str]) -> Result<usize, D::Error> {
    deserializer.deserialize_str(OneOf(words))
}

struct OneOf(&'static [&'static str]);

impl Visitor<'_> for OneOf {
    type Value = usize;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("one of")?;
        self.0
            .iter()
            .enumerate()
            .try_for_each(|(place, word)| write!(f, "{} \"{word}\"", if place == 0 { "" } else { "," }))
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<usize, E> {
        let found = self.0.iter().position(|word| *word == text);
        found.ok_or_else(|| E::invalid_value(Unexpected::Str(text), &self as &dyn Expected))
    }
}
