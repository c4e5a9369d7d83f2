//! A request: how far the board is to run, and its inputs on the way.

use std::fmt;

use serde::{Deserialize, Deserializer};
use serde_json::Value;
use stm32f4_model::{AdcChannel, Pin};

use super::Refusal;
use super::entries::Entries;
use crate::feed::Contact;
use crate::tables::VoltageColumn;

/// Version of the protocol.
pub(crate) const VERSION: u64 = 1;

/// Longest step, us.
const LONGEST_US: u64 = 10_000_000;
/// Voltages that a pin may be given, V: far more than it bears, so that millivolts are noticed.
const PIN_V: [f64; 2] = [-10.0, 10.0];
/// Supplies, V: the chip bears no more (data sheet, absolute maximum ratings).
const SUPPLY_V: [f64; 2] = [0.0, 4.0];
/// Least analogue supply, V: the converter divides by it.
const LEAST_VDDA_V: f64 = 0.1;
/// Name of the supply of the chip.
const VDD: &str = "VDD";

/// What a program asks for.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Request {
    /// The board runs.
    Step(Step),
    /// The run ends.
    End,
}

/// A piece of time, with the inputs that change at its beginning. All others stay as they are.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Step {
    /// Its length, us.
    pub(crate) us: u64,
    /// What is given.
    pub(crate) given: Vec<Given>,
}

/// An input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Given {
    /// Voltage at the beginning and at the end, V.
    Volts(VoltageColumn, [f64; 2]),
    /// Supply of the chip, V.
    ChipSupply(f64),
    /// Whether a contact is on.
    Contact(Contact, bool),
}

/// The keys of a request, as they come.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    #[serde(default, deserialize_with = "present")]
    version: Option<Value>,
    #[serde(default, deserialize_with = "present")]
    us: Option<Value>,
    #[serde(default)]
    volts: Entries<Value>,
    #[serde(default)]
    levels: Entries<Value>,
    #[serde(default, deserialize_with = "present")]
    button: Option<Value>,
    #[serde(default, deserialize_with = "present")]
    stop: Option<Value>,
    #[serde(default, deserialize_with = "present")]
    end: Option<Value>,
}

/// A key that is there, also with the value `null`, which is none of the allowed ones.
fn present<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Value>, D::Error> {
    Value::deserialize(deserializer).map(Some)
}

impl Request {
    /// Reads a line.
    ///
    /// # Errors
    /// Which key is wrong, and what is allowed.
    pub(crate) fn parse(line: &[u8]) -> Result<Self, Refusal> {
        let refusal = |error: &dyn fmt::Display| {
            let allowed = "allowed is one JSON object a line, for example {\"us\": 1000, \"volts\": {\"PA1\": 1.2}}";
            Refusal::new("", format!("the line is not a request: {error}; {allowed}"))
        };
        // An array would be read as the fields in their order.
        if line.trim_ascii_start().first() == Some(&b'[') {
            return Err(refusal(&"it is an array"));
        }
        let keys: Keys = serde_json::from_slice(line).map_err(|error| refusal(&error))?;
        if let Some(version) = keys.version.filter(|version| version.as_u64() != Some(VERSION)) {
            let text = format!("version {version} is not known; this virtual board has version {VERSION}");
            return Err(Refusal::new("version", text));
        }
        let mut given = volts(&keys.volts.0)?;
        given.extend(levels(&keys.levels.0)?);
        for (key, value, contact) in [("button", keys.button, Contact::Button), ("stop", keys.stop, Contact::Stop)] {
            if let Some(value) = value {
                given.push(Given::Contact(contact, is_true(key, &value)?));
            }
        }
        let ends = keys.end.map(|value| is_true("end", &value)).transpose()?.unwrap_or(false);
        match (ends, keys.us) {
            (true, None) if given.is_empty() => Ok(Request::End),
            (true, _) => Err(Refusal::new("end", "`end` stands alone; send the step first")),
            (false, Some(us)) => Ok(Request::Step(Step { us: micros(&us)?, given })),
            (false, None) => {
                let text = format!("`us` is missing: the length of the step, 1 to {LONGEST_US} microseconds");
                Err(Refusal::new("us", text))
            }
        }
    }
}

fn micros(value: &Value) -> Result<u64, Refusal> {
    value.as_u64().filter(|us| (1..=LONGEST_US).contains(us)).ok_or_else(|| {
        let text = format!("`us` is {value}; allowed is a whole number from 1 to {LONGEST_US}, microseconds");
        Refusal::new("us", text)
    })
}

fn is_true(key: &str, value: &Value) -> Result<bool, Refusal> {
    let text = || Refusal::new(key, format!("`{key}` is {value}; allowed is true or false"));
    value.as_bool().ok_or_else(text)
}

fn volts(entries: &[(String, Value)]) -> Result<Vec<Given>, Refusal> {
    let has_analogue = entries.iter().any(|(name, _)| name == "VDDA");
    let mut given = Vec::new();
    for (name, value) in entries {
        let field = format!("volts.{name}");
        let refuse = |text: String| Refusal::new(&field, text);
        let pair = pair(value).ok_or_else(|| {
            refuse(format!("`{field}` is {value}; allowed is a number, or the first and the last value in brackets"))
        })?;
        let inside = |[least, most]: [f64; 2]| match pair.iter().find(|volts| !(least..=most).contains(*volts)) {
            Some(volts) => Err(refuse(format!("{volts} V at `{field}` is not allowed; must be {least} to {most} V"))),
            None => Ok(()),
        };
        if name == VDD {
            inside(SUPPLY_V)?;
            if pair[0] != pair[1] {
                return Err(refuse(format!(
                    "`{field}` has two values; the supply of the chip is held in a step: send one"
                )));
            }
            given.push(Given::ChipSupply(pair[0]));
            if !has_analogue {
                // It is connected to the other one.
                given.push(Given::Volts(VoltageColumn::Vdda, [pair[0].max(LEAST_VDDA_V); 2]));
            }
            continue;
        }
        let column = VoltageColumn::parse(name)
            .map_err(|error| refuse(format!("{error}; allowed are the pins of the converter, VDDA and VDD")))?;
        match column {
            VoltageColumn::Vdda => inside([LEAST_VDDA_V, SUPPLY_V[1]])?,
            VoltageColumn::Pin(pin) if is_of_converter(pin) => inside(PIN_V)?,
            VoltageColumn::Pin(pin) => {
                let pins = "PA0 to PA7, PB0, PB1, PC0 to PC5 and PF3 to PF10";
                return Err(refuse(format!("{pin} is not a pin of a converter; allowed are {pins}")));
            }
        }
        given.push(Given::Volts(column, pair));
    }
    Ok(given)
}

/// One value that is held, or the first and the last one.
fn pair(value: &Value) -> Option<[f64; 2]> {
    let finite = |value: &Value| value.as_f64().filter(|volts| volts.is_finite());
    match value {
        Value::Number(_) => finite(value).map(|volts| [volts; 2]),
        Value::Array(both) => match both.as_slice() {
            [first, last] => Some([finite(first)?, finite(last)?]),
            _ => None,
        },
        _ => None,
    }
}

fn is_of_converter(pin: Pin) -> bool {
    (1..=3).any(|adc| (0..16).any(|channel| AdcChannel { adc, channel }.pin() == Some(pin)))
}

fn levels(entries: &[(String, Value)]) -> Result<Vec<Given>, Refusal> {
    let level = |(name, value): &(String, Value)| {
        let field = format!("levels.{name}");
        let pin: Pin = name.parse().map_err(|error| Refusal::new(&field, format!("{error}")))?;
        let high = value
            .as_bool()
            .ok_or_else(|| Refusal::new(&field, format!("`{field}` is {value}; allowed is true for high, or false")))?;
        Ok(Given::Contact(Contact::Pin(pin), high))
    };
    entries.iter().map(level).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(line: &str) -> Step {
        match Request::parse(line.as_bytes()).unwrap() {
            Request::Step(step) => step,
            Request::End => panic!("{line} ends"),
        }
    }

    #[test]
    fn a_request_has_its_inputs() {
        let pin = |name: &str| VoltageColumn::Pin(name.parse().unwrap());
        let got = step(
            r#"{"version": 1, "us": 1000, "volts": {"PA1": 1.25, "PC1": [0.1, 2]}, "levels": {"PC5": true}, "button": true, "stop": true}"#,
        );
        assert_eq!(got.us, 1000);
        assert_eq!(
            got.given,
            [
                Given::Volts(pin("PA1"), [1.25; 2]),
                Given::Volts(pin("PC1"), [0.1, 2.0]),
                Given::Contact(Contact::Pin("PC5".parse().unwrap()), true),
                Given::Contact(Contact::Button, true),
                Given::Contact(Contact::Stop, true),
            ]
        );
        assert_eq!(step(r#"{"us": 1}"#).given, []);
        assert_eq!(Request::parse(br#"{"end": true}"#), Ok(Request::End));
    }

    #[test]
    fn the_analogue_supply_follows_that_of_the_chip() {
        let analogue = |volts| Given::Volts(VoltageColumn::Vdda, [volts; 2]);
        assert_eq!(step(r#"{"us": 1, "volts": {"VDD": 2.7}}"#).given, [Given::ChipSupply(2.7), analogue(2.7)]);
        assert_eq!(step(r#"{"us": 1, "volts": {"VDD": 0}}"#).given, [Given::ChipSupply(0.0), analogue(0.1)]);
        let both = step(r#"{"us": 1, "volts": {"VDD": 2.7, "VDDA": 3}}"#).given;
        assert_eq!(both, [Given::ChipSupply(2.7), analogue(3.0)]);
    }

    #[test]
    fn a_wrong_request_names_its_key_and_what_is_allowed() {
        for (line, field, words) in [
            ("hold", "", "allowed is one JSON object a line"),
            ("3", "", "allowed is one JSON object a line"),
            (r#"{"us": 1"#, "", "allowed is one JSON object a line"),
            (r#"{"us": 1} {"us": 1}"#, "", "trailing characters"),
            (r#"{"us": 1, "us": 2}"#, "", "duplicate field `us`"),
            (r#"{"us": 1, "pins": {}}"#, "", "unknown field `pins`, expected one of `version`, `us`, `volts`"),
            (r#"{"version": 2, "us": 1}"#, "version", "version 2 is not known; this virtual board has version 1"),
            ("{}", "us", "`us` is missing"),
            (r#"{"us": 0}"#, "us", "`us` is 0; allowed is a whole number from 1 to 10000000, microseconds"),
            (r#"{"us": -5}"#, "us", "`us` is -5"),
            (r#"{"us": 1.5}"#, "us", "`us` is 1.5"),
            (r#"{"us": 10000001}"#, "us", "allowed is a whole number from 1 to 10000000"),
            (r#"{"us": "1"}"#, "us", "allowed is a whole number"),
            (r#"{"us": null}"#, "us", "`us` is null"),
            (r#"{"us": 1, "volts": true}"#, "", "expected an object of pins"),
            (r#"{"us": 1, "volts": null}"#, "", "expected an object of pins"),
            (r#"{"us": 1, "volts": {"PA1": 1, "PA1": 2}}"#, "", "the key `PA1` comes twice"),
            (
                r#"{"us": 1, "volts": {"PA1": "x"}}"#,
                "volts.PA1",
                "allowed is a number, or the first and the last value",
            ),
            (r#"{"us": 1, "volts": {"PA1": [1, 2, 3]}}"#, "volts.PA1", "the first and the last value in brackets"),
            (r#"{"us": 1, "volts": {"PA1": 1e999}}"#, "volts.PA1", "allowed is a number"),
            (
                r#"{"us": 1, "volts": {"PA1": [1, 1200]}}"#,
                "volts.PA1",
                "1200 V at `volts.PA1` is not allowed; must be -10 to 10 V",
            ),
            (r#"{"us": 1, "volts": {"PX1": 1}}"#, "volts.PX1", "is not the name of a pin"),
            (
                r#"{"us": 1, "volts": {"PE9": 1}}"#,
                "volts.PE9",
                "PE9 is not a pin of a converter; allowed are PA0 to PA7",
            ),
            (r#"{"us": 1, "volts": {"VDDA": 0}}"#, "volts.VDDA", "must be 0.1 to 4 V"),
            (r#"{"us": 1, "volts": {"VDD": 5}}"#, "volts.VDD", "must be 0 to 4 V"),
            (r#"{"us": 1, "volts": {"VDD": [3, 2]}}"#, "volts.VDD", "is held in a step"),
            (r#"{"us": 1, "levels": {"PC5": 1}}"#, "levels.PC5", "allowed is true for high, or false"),
            (r#"{"us": 1, "button": null}"#, "button", "`button` is null"),
            (r#"{"us": 1, "button": 1}"#, "button", "allowed is true or false"),
            (r#"{"us": 1, "end": true}"#, "end", "`end` stands alone"),
        ] {
            let refusal = Request::parse(line.as_bytes()).unwrap_err();
            assert_eq!(refusal.field, field, "{line}: {refusal:?}");
            assert!(refusal.text.contains(words), "{line}: {refusal:?}");
        }
        assert_eq!(Request::parse(b"\xff{}").unwrap_err().field, "");
    }
}
