//! Values that a file has as words, for serde.

use hgod_adc::Interpolation;
use joint_loop::generator::one_of;
use joint_units::Joint;
use serde::ser::Error;
use serde::{Deserializer, Serializer};

/// A value with a word for it in files.
pub trait Word: Copy + PartialEq + 'static {
    /// The words.
    const WORDS: &'static [&'static str];
    /// The value of each word.
    const VALUES: &'static [Self];
}

impl Word for Joint {
    const WORDS: &'static [&'static str] =
        &[Self::ALL[0].name(), Self::ALL[1].name(), Self::ALL[2].name(), Self::ALL[3].name()];
    const VALUES: &'static [Self] = &Self::ALL;
}

impl Word for Interpolation {
    const WORDS: &'static [&'static str] = &["linear", "monotone_cubic"];
    const VALUES: &'static [Self] = &[Self::Linear, Self::MonotoneCubic];
}

/// Writes the word of a value.
///
/// # Errors
/// The value has no word.
pub fn serialize<T: Word, S: Serializer>(value: &T, serializer: S) -> Result<S::Ok, S::Error> {
    let found = T::WORDS.iter().zip(T::VALUES).find(|(_, of)| *of == value);
    serializer.serialize_str(found.ok_or_else(|| S::Error::custom("a value without a word"))?.0)
}

/// Reads the value of a word.
///
/// # Errors
/// It is something else, with the words that are allowed.
pub fn deserialize<'de, T: Word, D: Deserializer<'de>>(deserializer: D) -> Result<T, D::Error> {
    one_of(deserializer, T::WORDS).map(|place| T::VALUES[place])
}
