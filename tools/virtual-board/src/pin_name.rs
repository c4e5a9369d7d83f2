//! Pins by their names in TOML files.

use serde::Deserialize;
use stm32f4_model::Pin;

/// The name of a pin, as `PA1`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "String")]
pub(crate) struct PinName(pub(crate) Pin);

impl TryFrom<String> for PinName {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        name.parse().map(PinName).map_err(|error| format!("{error}"))
    }
}
