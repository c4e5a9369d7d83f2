//! The settings of a running board: the values of [`joint_loop::tuning::Parameter`].

use joint_loop::tuning::{Parameter, Settings as Values};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// The settings in effect: once a second, and in the round of telemetry after they changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Settings {
    /// A tick in which they were in effect.
    pub tick: u32,
    /// Check sum of the parameters of the board's own generator, whatever its record is called: of the record with the name `built-in`.
    pub generator: u32,
    /// The same of the robot.
    pub robot: u32,
    /// A value for every parameter.
    #[serde(with = "values")]
    pub values: Values,
}

/// The values in the order of the table, thousandths of their units; one that its parameter does not allow is no record.
mod values {
    use super::{Deserialize, Deserializer, Parameter, Serialize, Serializer, Values, de};

    pub(super) fn serialize<S: Serializer>(values: &Values, to: S) -> Result<S::Ok, S::Error> {
        Parameter::ALL.map(|parameter| values.thousandths(parameter)).serialize(to)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Values, D::Error> {
        let sent = <[i32; Parameter::COUNT]>::deserialize(from)?;
        Parameter::ALL.into_iter().zip(sent).try_fold(Values::default(), |values, (parameter, thousandths)| {
            values.with(parameter, thousandths).map_err(|_| {
                de::Error::invalid_value(
                    de::Unexpected::Signed(thousandths.into()),
                    &"a value that the parameter allows",
                )
            })
        })
    }
}
