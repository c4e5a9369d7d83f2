//! Parses the header of an OpenSim file: title, numbers of rows and columns, unit.

use crate::fault::{Fault, TraceError};
use crate::format::angle_unit::AngleUnit;
use crate::format::text_table::short;

/// `endheader` must be within this many lines.
pub(super) const MAX_HEADER_LINES: usize = 1000;

/// Whether a line ends a header.
pub(super) fn is_end(line: &str) -> bool {
    line.trim().eq_ignore_ascii_case("endheader")
}

/// The parsed header.
#[derive(Default)]
pub(super) struct Header {
    /// The line of `endheader`.
    pub(super) end: u64,
    /// The first line, where it is a title: with its number.
    pub(super) title: Option<(u64, String)>,
    /// Whether a line that is not blank was read.
    begun: bool,
    version: Option<u64>,
    /// Line, key and number.
    pub(super) rows: Option<(u64, String, u64)>,
    pub(super) columns: Option<(u64, String, u64)>,
    in_degrees: Option<bool>,
    /// A sentence about degrees or radians, as version 1 has it.
    remark: Option<AngleUnit>,
}

impl Header {
    pub(super) fn parse<'a>(
        name: &str,
        rows: &mut impl Iterator<Item = Result<(u64, &'a str), TraceError>>,
    ) -> Result<Self, TraceError> {
        let mut header = Self::default();
        let mut last = 1;
        for row in rows.take(MAX_HEADER_LINES) {
            let (line, row) = row?;
            last = line;
            if is_end(row) {
                header.end = line;
                return Ok(header);
            }
            // Some programs write `name walk`; others begin with a key.
            let bare = row.trim();
            if header.title.is_none() && !header.begun && !bare.is_empty() && !bare.contains('=') {
                let words = bare.split_once(char::is_whitespace);
                let named = words.filter(|(key, _)| key.eq_ignore_ascii_case("name")).map(|(_, title)| title.trim());
                header.title = Some((line, named.unwrap_or(bare).to_owned()));
            }
            header.begun |= !bare.is_empty();
            header.take(line, bare).map_err(|fault| TraceError::new(name, Some(line), fault))?;
        }
        let (field, found) = ("endheader".into(), "missing".into());
        let allowed = format!("a line `endheader` within the first {MAX_HEADER_LINES}, and columns and rows below it");
        Err(TraceError::new(name, Some(last), Fault::HeaderField { field, found, allowed }))
    }

    fn take(&mut self, line: u64, row: &str) -> Result<(), Fault> {
        let pair = row.split_once('=').or_else(|| row.split_once(char::is_whitespace));
        let (key, value) = pair.map_or((row, ""), |(key, value)| (key.trim(), value.trim()));
        let bad = |allowed: &str| Fault::HeaderField {
            field: key.into(),
            found: format!("`{}`", short(value)),
            allowed: allowed.into(),
        };
        let count = || value.parse::<u64>().map_err(|_| bad("a whole number"));
        match key.to_ascii_lowercase().as_str() {
            "nrows" | "datarows" => self.rows = Some((line, key.into(), count()?)),
            "ncolumns" | "datacolumns" => self.columns = Some((line, key.into(), count()?)),
            "version" if row.contains('=') => {
                let version = value.parse().ok().filter(|version| (1..=3).contains(version));
                self.version = Some(version.ok_or_else(|| bad("1, 2 or 3"))?);
            }
            "indegrees" => {
                self.in_degrees = Some(match value.to_ascii_lowercase().as_str() {
                    "yes" | "true" | "1" => true,
                    "no" | "false" | "0" => false,
                    _ => return Err(bad("yes or no")),
                });
            }
            "datatype" if !value.eq_ignore_ascii_case("double") => {
                return Err(bad("double: one number a column, such as coordinates have"));
            }
            _ => {
                let row = row.to_ascii_lowercase();
                let says = |unit: &str| row.contains(&format!("angles are in {unit}"));
                self.remark = match (says("degrees"), says("radians")) {
                    (true, false) => Some(AngleUnit::Degrees),
                    (false, true) => Some(AngleUnit::Radians),
                    _ => self.remark,
                };
            }
        }
        Ok(())
    }

    pub(super) fn unit(&self, notes: &mut Vec<String>) -> Option<AngleUnit> {
        let of = |in_degrees| if in_degrees { AngleUnit::Degrees } else { AngleUnit::Radians };
        self.in_degrees.map(of).or_else(|| {
            let words = self.remark?.words();
            notes.push(format!("The header has no `inDegrees`; a remark in it says that angles are in {words}."));
            self.remark
        })
    }

    pub(super) fn version_words(&self) -> String {
        match (self.version, &self.rows) {
            (Some(version), _) => format!("version {version}"),
            (None, Some((_, field, _))) if field.eq_ignore_ascii_case("datarows") => "SIMM header".into(),
            (None, _) => "version not given".into(),
        }
    }
}
