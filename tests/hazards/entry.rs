//! The entries of `hazards.toml`, with their types. A key that is not listed here is refused.

use footfall_tests::workspace::read;
use serde::Deserialize;
use std::fmt;

/// The file, relative to the root.
pub(crate) const FILE: &str = "hazards.toml";

/// The whole file.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Hazards {
    #[serde(rename = "hazard")]
    pub(crate) list: Vec<Hazard>,
}

/// One hazard.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Hazard {
    pub(crate) id: Id,
    pub(crate) cause: String,
    pub(crate) effect: String,
    /// How the controller notices it.
    pub(crate) detection: Option<String>,
    /// What the controller does about it, or how it is built so that it cannot happen.
    pub(crate) reaction: Option<String>,
    /// Longest time from the fault to the start of the reaction, ms.
    pub(crate) limit_ms: Option<f64>,
    /// The longest of these times that tests or the campaign measured, rounded up, ms.
    pub(crate) longest_ms: Option<f64>,
    pub(crate) status: Status,
    /// Where a test has shown detection and reaction.
    #[serde(default)]
    pub(crate) shown: Vec<Place>,
    /// Test functions as `FILE::FUNCTION`.
    #[serde(default)]
    pub(crate) tests: Vec<String>,
    /// What these tests measured, in words, with units.
    pub(crate) measured: Option<String>,
    /// What is not handled, or not shown.
    pub(crate) missing: Option<String>,
    /// Why the hazard does not apply.
    pub(crate) why: Option<String>,
    /// Procedure with a board in the hand, in Markdown.
    pub(crate) bench: Option<String>,
}

/// The number of a hazard: `H01`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(try_from = "String")]
pub(crate) struct Id(pub(crate) u32);

impl TryFrom<String> for Id {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let number = text.strip_prefix('H').filter(|digits| digits.len() == 2).and_then(|digits| digits.parse().ok());
        number
            .filter(|number| *number > 0)
            .map(Self)
            .ok_or_else(|| format!("`{text}` is no ID; allowed are H01 to H99"))
    }
}

impl fmt::Display for Id {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "H{:02}", self.0)
    }
}

/// What has been achieved about a hazard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub(crate) enum Status {
    /// Tests show detection and reaction, or that the effect does not come.
    #[serde(rename = "shown")]
    Shown,
    /// Some of it is handled; `missing` says what is not.
    #[serde(rename = "partly")]
    Partly,
    /// Nothing is done about it, or nothing that can be relied on; `missing` says what should be.
    #[serde(rename = "open")]
    Open,
    /// This controller cannot have it.
    #[serde(rename = "does not apply")]
    DoesNotApply,
}

impl Status {
    pub(crate) const ALL: [Self; 4] = [Self::Shown, Self::Partly, Self::Open, Self::DoesNotApply];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Shown => "shown",
            Self::Partly => "partly",
            Self::Open => "open",
            Self::DoesNotApply => "does not apply",
        }
    }
}

/// Where a claim has been shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Place {
    /// By the linker, for the processor of the board.
    Link,
    /// On the computer that runs the tests.
    Host,
    /// By the image that would be flashed, on models of the chip.
    VirtualBoard,
    /// On hardware.
    Bench,
}

impl Place {
    pub(crate) const ALL: [Self; 4] = [Self::Link, Self::Host, Self::VirtualBoard, Self::Bench];

    /// The word of the pages.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Link => "link",
            Self::Host => "host",
            Self::VirtualBoard => "virtual board",
            Self::Bench => "hardware",
        }
    }
}

impl Hazards {
    /// Reads the text of a file.
    ///
    /// # Errors
    /// The message of the parser, with line and key.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        toml::from_str(text).map_err(|error| error.to_string())
    }

    /// The file of the repository.
    ///
    /// # Panics
    /// It cannot be read.
    pub(crate) fn of_repository() -> Self {
        Self::parse(&read(FILE)).unwrap_or_else(|error| panic!("{FILE}: {error}"))
    }
}
