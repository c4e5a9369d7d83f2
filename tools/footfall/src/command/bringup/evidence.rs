//! The file of a bring-up: every quantity with its value, its limits, where the project states them, and what follows.
//!
//! A file is read back by the rules that wrote it: a value outside of its limits is refused whatever the file says.

use serde::{Deserialize, Serialize};
use std::fmt;

/// Version of the file.
pub const FORMAT: u32 = 1;

/// What was found on one board.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Evidence {
    /// [`FORMAT`].
    pub format: u32,
    /// Name of the board, as its Cargo feature.
    pub board: String,
    /// Name of the chip, as probe-rs writes it.
    pub chip: String,
    /// What tells this board from others of its kind.
    pub chip_id: String,
    /// Day of the measurement by UTC, year-month-day.
    pub date: String,
    /// Where the records came from.
    pub port: Port,
    /// What follows from all quantities.
    pub verdict: Verdict,
    /// What ran.
    pub versions: Versions,
    /// The quantities in the order of the steps.
    #[serde(rename = "quantity")]
    pub quantities: Vec<Quantity>,
}

/// What ran on the board and on the host. The records are those of the boot record: a name, and the check sum in hexadecimal.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Versions {
    /// Version of the program `footfall`.
    pub footfall: String,
    /// Version of the records that board and host exchange.
    pub wire: u16,
    /// Generator record.
    pub generator: Option<String>,
    /// Sensor record.
    pub sensors: Option<String>,
    /// Robot record.
    pub robot: Option<String>,
}

/// Where the records of a board came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Port {
    /// A serial port of hardware.
    Serial,
    /// A pseudo-terminal, which is that of a virtual board: no evidence about hardware.
    PseudoTerminal,
}

/// What follows from all quantities.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Every quantity was measured and is inside of its limits.
    Passed,
    /// A quantity was not measured; the others are inside of their limits.
    Incomplete,
    /// A quantity is outside of its limits.
    Refused,
}

impl Verdict {
    /// Name in the file and in messages.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Passed => "passed",
            Self::Incomplete => "incomplete",
            Self::Refused => "refused",
        }
    }
}

/// What became of one quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// It was measured, and is inside of its limits if it has some.
    Measured,
    /// It was not measured; the quantity says why.
    NotMeasured,
    /// It was measured, and is outside of its limits.
    Refused,
}

impl Status {
    /// Name in messages.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::NotMeasured => "not measured",
            Self::Refused => "refused",
        }
    }
}

/// A value: a number with the unit of the quantity, or a word.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// A number.
    Number(f64),
    /// A word, such as the cause of a reset.
    Word(String),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(f, "{number}"),
            Self::Word(word) => f.write_str(word),
        }
    }
}

/// One quantity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quantity {
    /// Name: what is measured, of what.
    pub name: String,
    /// What became of it.
    pub status: Status,
    /// The value; `None` if it was not measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<Value>,
    /// Unit of value and limits; empty for a count or a word.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
    /// Half the width of the interval in which the true value is; `None` where it is less than the last digit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uncertainty: Option<f64>,
    /// Least value that is allowed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub least: Option<f64>,
    /// Greatest value that is allowed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub most: Option<f64>,
    /// The word that is allowed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub allowed: Option<String>,
    /// Where the project states the limits, and why they are these.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stated: Option<String>,
    /// Why it was not measured, or how the value came about.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

impl Quantity {
    /// A number that was measured; without limits.
    #[must_use]
    pub fn number(name: impl Into<String>, value: f64, unit: &str) -> Self {
        // Six digits behind the point: more than any of the measurements has.
        let value = (value * 1e6).round() / 1e6;
        Self { value: Some(Value::Number(value)), unit: unit.into(), ..Self::empty(name) }.judged()
    }

    /// A word that was found.
    #[must_use]
    pub fn word(name: impl Into<String>, value: &str) -> Self {
        Self { value: Some(Value::Word(value.into())), ..Self::empty(name) }.judged()
    }

    /// One that was not measured, and why.
    #[must_use]
    pub fn not_measured(name: impl Into<String>, why: impl Into<String>) -> Self {
        Self { note: Some(why.into()), ..Self::empty(name) }
    }

    fn empty(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            status: Status::NotMeasured,
            value: None,
            unit: String::new(),
            uncertainty: None,
            least: None,
            most: None,
            allowed: None,
            stated: None,
            note: None,
        }
    }

    /// The same with limits and the place that states them.
    #[must_use]
    pub fn within(self, least: Option<f64>, most: Option<f64>, stated: &str) -> Self {
        Self { least, most, stated: Some(stated.into()), ..self }.judged()
    }

    /// The same with the only word that is allowed and the place that states it.
    #[must_use]
    pub fn allowing(self, word: &str, stated: &str) -> Self {
        Self { allowed: Some(word.into()), stated: Some(stated.into()), ..self }.judged()
    }

    /// The same with an uncertainty.
    #[must_use]
    pub fn uncertain(self, uncertainty: f64) -> Self {
        Self { uncertainty: Some((uncertainty * 1e3).round() / 1e3), ..self }.judged()
    }

    /// The same with a note.
    #[must_use]
    pub fn noted(self, note: impl Into<String>) -> Self {
        Self { note: Some(note.into()), ..self }
    }

    /// The same with the status that follows from value, uncertainty and limits. Where the uncertainty reaches over a limit, the value decides
    /// nothing: it is not measured well enough.
    #[must_use]
    fn judged(self) -> Self {
        let status = match &self.value {
            None => Status::NotMeasured,
            Some(Value::Word(word)) if self.allowed.as_ref().is_some_and(|allowed| allowed != word) => Status::Refused,
            Some(Value::Word(_)) => Status::Measured,
            Some(Value::Number(value)) => {
                let half = self.uncertainty.unwrap_or(0.0);
                let (least, most) = (self.least.unwrap_or(f64::NEG_INFINITY), self.most.unwrap_or(f64::INFINITY));
                if !value.is_finite() || value + half < least || value - half > most {
                    Status::Refused
                } else if value - half < least || value + half > most {
                    Status::NotMeasured
                } else {
                    Status::Measured
                }
            }
        };
        Self { status, ..self }
    }
}

/// A line for people.
impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.name, self.status.name())?;
        if let Some(value) = &self.value {
            write!(f, ", {value}")?;
        }
        if let Some(half) = self.uncertainty {
            write!(f, " +- {half}")?;
        }
        if !self.unit.is_empty() && self.value.is_some() {
            write!(f, " {}", self.unit)?;
        }
        if let Some(limits) = self.limits() {
            write!(f, " (allowed: {limits})")?;
        }
        match &self.note {
            Some(note) if self.status == Status::NotMeasured => write!(f, ": {note}"),
            _ => Ok(()),
        }
    }
}

impl Quantity {
    /// The limits in words; `None` without any.
    #[must_use]
    pub fn limits(&self) -> Option<String> {
        match (self.least, self.most, &self.allowed) {
            (Some(least), Some(most), _) => Some(format!("{least} to {most}")),
            (Some(least), None, _) => Some(format!("{least} or more")),
            (None, Some(most), _) => Some(format!("{most} or less")),
            (None, None, allowed) => allowed.clone(),
        }
    }
}

/// What a session found, without the id of the chip.
#[derive(Debug, Clone)]
pub(super) struct Found {
    pub(super) board: &'static firmware::board::Board,
    pub(super) versions: Versions,
    pub(super) quantities: Vec<Quantity>,
}

impl Evidence {
    pub(super) fn of(found: Found, chip_id: String, port: Port) -> Self {
        let Found { board, versions, quantities } = found;
        let date = time::OffsetDateTime::from(std::time::SystemTime::now()).date();
        Self {
            format: FORMAT,
            board: board.name.into(),
            chip: board.chip.into(),
            chip_id,
            date: format!("{:04}-{:02}-{:02}", date.year(), u8::from(date.month()), date.day()),
            port,
            verdict: verdict(&quantities),
            versions,
            quantities,
        }
    }

    /// Reads a file, and judges its values again.
    ///
    /// # Errors
    /// It is no such file, or its words do not agree with its values.
    pub fn parse(text: &str) -> Result<Self, String> {
        let evidence: Self = toml::from_str(text).map_err(|error| error.to_string())?;
        if evidence.format != FORMAT {
            return Err(format!("format is {}; allowed is {FORMAT}", evidence.format));
        }
        for quantity in &evidence.quantities {
            let judged = quantity.clone().judged();
            if judged.status != quantity.status {
                let (says, is) = (quantity.status.name(), judged.status.name());
                return Err(format!("{}: the file says {says}, and by its value it is {is}", quantity.name));
            }
        }
        let judged = verdict(&evidence.quantities);
        if judged != evidence.verdict {
            let says = evidence.verdict.name();
            return Err(format!("verdict: the file says {says}, and by its quantities it is {}", judged.name()));
        }
        Ok(evidence)
    }

    /// The text of the file.
    ///
    /// # Panics
    /// Never: the types have a form in TOML.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let body = toml::to_string(self).expect("numbers, words and tables");
        format!("# Made by `footfall bringup`. docs/hardware.md says what to do with it.\n{body}")
    }

    /// The quantities that are refused, a line each.
    #[must_use]
    pub fn refused(&self) -> Vec<String> {
        self.quantities.iter().filter(|one| one.status == Status::Refused).map(ToString::to_string).collect()
    }
}

fn verdict(quantities: &[Quantity]) -> Verdict {
    let any = |status| quantities.iter().any(|one| one.status == status);
    if any(Status::Refused) {
        Verdict::Refused
    } else if quantities.is_empty() || any(Status::NotMeasured) {
        Verdict::Incomplete
    } else {
        Verdict::Passed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(quantities: Vec<Quantity>) -> Evidence {
        let found = Found { board: &firmware::board::f4_discovery::BOARD, versions: Versions::default(), quantities };
        Evidence::of(found, "a1".into(), Port::Serial)
    }

    #[test]
    fn a_value_is_judged_by_its_limits_and_its_uncertainty() {
        let ppm = |value, half| {
            Quantity::number("clock", value, "ppm").within(Some(-500.0), Some(500.0), "x").uncertain(half)
        };
        assert_eq!(
            [ppm(20.0, 30.0), ppm(490.0, 30.0), ppm(520.0, 30.0), ppm(540.0, 30.0), ppm(f64::NAN, 1.0)]
                .map(|one| one.status),
            [Status::Measured, Status::NotMeasured, Status::NotMeasured, Status::Refused, Status::Refused]
        );
        let word = |word| Quantity::word("reset", word).allowing("pin", "x").status;
        assert_eq!([word("pin"), word("iwdg")], [Status::Measured, Status::Refused]);
    }

    #[test]
    fn one_refused_value_refuses_the_board() {
        let good = Quantity::number("a", 1.0, "us").within(None, Some(2.0), "x");
        let bad = Quantity::number("b", 3.0, "us").within(None, Some(2.0), "x");
        let none = Quantity::not_measured("c", "skipped");
        assert_eq!(of(vec![good.clone()]).verdict, Verdict::Passed);
        assert_eq!(of(vec![good.clone(), none.clone()]).verdict, Verdict::Incomplete);
        assert_eq!(of(vec![]).verdict, Verdict::Incomplete);
        let refused = of(vec![good, none, bad]);
        assert_eq!((refused.verdict, refused.refused().len()), (Verdict::Refused, 1));
        assert_eq!(refused.refused()[0], "b: refused, 3 us (allowed: 2 or less)");
    }

    #[test]
    fn a_file_is_read_back_and_judged_again() {
        let bad = Quantity::number("pulse", 20.25, "us").within(Some(-2.0), Some(2.0), "timing").noted("100 pulses");
        let evidence = of(vec![bad, Quantity::word("reset", "pin"), Quantity::not_measured("power", "skipped")]);
        let text = evidence.to_toml();
        assert_eq!(Evidence::parse(&text), Ok(evidence));
        for (from, to, words) in [
            ("status = \"refused\"", "status = \"measured\"", "pulse: the file says measured"),
            ("verdict = \"refused\"", "verdict = \"passed\"", "verdict: the file says passed"),
            ("format = 1", "format = 2", "allowed is 1"),
            ("chip_id", "chip_number", "unknown field"),
        ] {
            let error = Evidence::parse(&text.replacen(from, to, 1)).unwrap_err();
            assert!(error.contains(words), "{from}: {error}");
        }
    }
}
