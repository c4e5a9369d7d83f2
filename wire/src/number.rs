//! Serde for the enums of the cores: one byte, the variant's place in the enum's list `ALL`. Their crates need no serde for it.

use cpg_core::entrainment::{Lock, SensorFault};
use hgod_adc::Validity;
use joint_loop::tuning::Outcome;
use joint_loop::{Cause, SupervisorState};
use serde::de::{Error, Unexpected};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// An enum with a list of all its variants.
pub(crate) trait Numbered: Copy + PartialEq + 'static {
    /// Every variant.
    const ALL: &'static [Self];
}

macro_rules! numbered {
    ($($name:ty)*) => { $(impl Numbered for $name { const ALL: &'static [Self] = &<$name>::ALL; })* };
}

numbered!(Cause Lock Outcome SensorFault SupervisorState Validity);

fn place<T: Numbered>(value: T) -> u8 {
    // Every variant is in the list; what were not would be refused by the reader.
    T::ALL.iter().position(|listed| *listed == value).and_then(|place| place.try_into().ok()).unwrap_or(u8::MAX)
}

fn at<T: Numbered, E: Error>(place: u8) -> Result<T, E> {
    let found = T::ALL.get(usize::from(place)).copied();
    found.ok_or_else(|| E::invalid_value(Unexpected::Unsigned(place.into()), &"a place in the list of variants"))
}

pub(crate) fn serialize<T: Numbered, S: Serializer>(value: &T, to: S) -> Result<S::Ok, S::Error> {
    place(*value).serialize(to)
}

pub(crate) fn deserialize<'de, T: Numbered, D: Deserializer<'de>>(from: D) -> Result<T, D::Error> {
    u8::deserialize(from).and_then(at)
}

/// The same for an enum that may be absent.
pub(crate) mod option {
    use super::{Deserialize, Deserializer, Numbered, Serialize, Serializer, at, place};

    pub(crate) fn serialize<T: Numbered, S: Serializer>(value: &Option<T>, to: S) -> Result<S::Ok, S::Error> {
        value.map(place).serialize(to)
    }

    pub(crate) fn deserialize<'de, T: Numbered, D: Deserializer<'de>>(from: D) -> Result<Option<T>, D::Error> {
        Option::<u8>::deserialize(from)?.map(at).transpose()
    }
}
