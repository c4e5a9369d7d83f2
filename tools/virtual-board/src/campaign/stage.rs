//! What leads a run from state to state before the faults, and sequences of gestures and faults that begin in a state.

use serde::{Deserialize, Deserializer};

use crate::script::Inject;

/// A run of the board: gestures and other inputs from power-on, and the states that it passes through.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Run {
    /// Name.
    pub(crate) name: String,
    /// Presses of the button.
    #[serde(rename = "press", default)]
    pub(crate) presses: Vec<Press>,
    /// Presses of the emergency stop: its test.
    #[serde(rename = "emergency_stop", default)]
    pub(crate) emergency_stops: Vec<Press>,
    /// Bytes on the serial port, in the order of time.
    #[serde(default)]
    pub(crate) serial: Vec<Serial>,
    /// Faults on the way.
    #[serde(rename = "inject", default)]
    pub(crate) injects: Vec<InjectAt>,
    /// The states.
    #[serde(rename = "state")]
    pub(crate) states: Vec<State>,
}

/// A state of a run.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct State {
    /// Name.
    pub(crate) name: String,
    /// When the run is in it, s.
    pub(crate) at_s: f64,
    /// Whether the outputs are on in it; a run in which they are not as stated is an error.
    pub(crate) outputs: bool,
    /// State and cause that the board reports in it, such as `walking (none)`; a run in which it reports another one is an error.
    pub(crate) says: String,
}

/// A press of a button.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Press {
    /// When it begins, s.
    pub(crate) at_s: f64,
    /// How long it lasts, s.
    pub(crate) hold_s: f64,
}

/// Bytes that a host sends.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Serial {
    /// When, s.
    pub(crate) at_s: f64,
    /// The bytes; in the file as hexadecimal digits.
    #[serde(deserialize_with = "hex")]
    pub(crate) bytes: Vec<u8>,
}

/// What happens at a time.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct InjectAt {
    /// When, s.
    pub(crate) at_s: f64,
    /// What.
    pub(crate) what: Inject,
}

/// Gestures and faults that begin in a state. Its times count from there. The pulses are judged; whoever reads the
/// result compares the times at which the servos were driven with the gestures.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Sequence {
    /// Name.
    pub(crate) name: String,
    /// The state.
    pub(crate) state: String,
    /// How long it is watched, s.
    pub(crate) lasts_s: f64,
    /// Presses of the button.
    #[serde(rename = "press", default)]
    pub(crate) presses: Vec<Press>,
    /// Presses of the emergency stop.
    #[serde(rename = "emergency_stop", default)]
    pub(crate) emergency_stops: Vec<Press>,
    /// Bytes on the serial port, in the order of time.
    #[serde(default)]
    pub(crate) serial: Vec<Serial>,
    /// Faults.
    #[serde(rename = "inject", default)]
    pub(crate) injects: Vec<InjectAt>,
    /// Add the log since the last boot to the result.
    #[serde(default)]
    pub(crate) log: bool,
}

fn hex<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<u8>, D::Error> {
    let text = String::deserialize(from)?;
    let bytes = text.as_bytes().chunks(2).map(|pair| {
        let pair = std::str::from_utf8(pair).ok().filter(|pair| pair.len() == 2)?;
        u8::from_str_radix(pair, 16).ok()
    });
    bytes.collect::<Option<_>>().ok_or_else(|| {
        serde::de::Error::custom(format!("`{text}` is no list of bytes; allowed are pairs of hexadecimal digits"))
    })
}
