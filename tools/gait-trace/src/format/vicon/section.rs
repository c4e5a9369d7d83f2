//! Finds the sections of an ASCII export of Vicon Nexus, and parses the five lines that begin one.

use crate::fault::{Fault, TraceError};
use crate::format::outputs::Output;
use crate::format::text_table::{Delimiter, bare_lines, finite, short};
use std::borrow::Cow;

/// The section that is read.
pub(super) const MODEL: &str = "Model Outputs";
/// Titles of the sections that Nexus writes.
const TITLES: [&str; 6] = [MODEL, "Devices", "Joints", "Segments", "Trajectories", "Events"];
/// Slowest and fastest rate, Hz.
const RATES: std::ops::RangeInclusive<f64> = 0.1..=1e6;

/// Whether the text begins with a section: a title, and a rate below it. A section of model outputs needs no rate to be recognised.
pub(super) fn begins(text: &str) -> bool {
    let mut rows = bare_lines(text).filter(|row| !is_blank(row));
    let Some(title) = rows.next().and_then(title_of) else { return false };
    title == MODEL || rows.next().and_then(only_field).is_some_and(|rate| finite(rate, true).is_ok())
}

/// Whether a line has no character but delimiters: spreadsheets fill blank lines with them.
pub(super) fn is_blank(row: &str) -> bool {
    row.trim_matches([',', ';', '\t', ' ', '"']).is_empty()
}

/// The first field of a line without other fields.
fn only_field(row: &str) -> Option<&str> {
    let field = row.trim_end_matches([',', ';', '\t', ' ']).trim_matches(['"', ' ']);
    (!field.is_empty() && !field.contains([';', '\t', '"'])).then_some(field)
}

/// The title of a section, if the line is one.
pub(super) fn title_of(row: &str) -> Option<&'static str> {
    let field = only_field(row)?;
    TITLES.into_iter().find(|title| field.eq_ignore_ascii_case(title))
}

/// The lines between the title and the rows of numbers.
pub(super) struct Head<'a> {
    /// The line with the names of the outputs.
    pub(super) line: u64,
    pub(super) rate_hz: f64,
    pub(super) delimiter: Delimiter,
    pub(super) outputs: Vec<Output>,
    /// The component that each column holds.
    pub(super) components: Vec<String>,
    /// The unit of each column; empty if the file has no row of units.
    pub(super) units: Vec<String>,
    /// The first row of numbers, if it is in the place of the units.
    pub(super) first_row: Option<(u64, &'a str)>,
}

impl<'a> Head<'a> {
    /// Parses the head below its title, which is in line `title`.
    pub(super) fn parse(
        name: &str,
        title: u64,
        rows: &mut impl Iterator<Item = Result<(u64, &'a str), TraceError>>,
    ) -> Result<Self, TraceError> {
        let mut next = |field: &str| {
            rows.next().unwrap_or_else(|| {
                let allowed = "four lines below `Model Outputs`: the rate, names, `Frame, Sub Frame, X, Y, Z`, units";
                let fault =
                    Fault::HeaderField { field: field.into(), found: "missing".into(), allowed: allowed.into() };
                Err(TraceError::new(name, Some(title), fault))
            })
        };
        let (rate_line, rate) = next("the rate")?;
        let (line, names) = next("the names of the outputs")?;
        let (components_line, components) = next("the names of the components")?;
        let (units_line, units) = next("the row of units")?;
        let delimiter = Delimiter::of_header(components);
        let split = |line, row| delimiter.fields(row).map_err(|fault| TraceError::new(name, Some(line), fault));
        let rate_hz = rate_in(rate).map_err(|fault| TraceError::new(name, Some(rate_line), fault))?;
        let names = split(line, names)?;
        let mut components: Vec<String> = split(components_line, components)?.iter().map(ToString::to_string).collect();
        while components.last().is_some_and(String::is_empty) {
            components.pop();
        }
        for (index, wanted) in ["frame", "subframe"].into_iter().enumerate() {
            let found = components.get(index).map_or("", String::as_str);
            let plain: String = found.to_lowercase().chars().filter(|c| c.is_alphanumeric()).collect();
            if plain != wanted {
                let (field, found) = (format!("column {}", index + 1), format!("`{}`", short(found)));
                let fault =
                    Fault::HeaderField { field, found, allowed: "`Frame`, `Sub Frame`, then X, Y, Z, ...".into() };
                return Err(TraceError::new(name, Some(components_line), fault));
            }
        }
        let fields = split(units_line, units)?;
        let is_row = fields.first().is_some_and(|field| finite(field, false).is_ok());
        let first_row = is_row.then_some((units_line, units));
        let units = if is_row { Vec::new() } else { fields.iter().map(ToString::to_string).collect() };
        let outputs = outputs(&names, &components);
        Ok(Self { line, rate_hz, delimiter, outputs, components, units, first_row })
    }
}

/// The rate that a line gives, Hz.
fn rate_in(row: &str) -> Result<f64, Fault> {
    let field = only_field(row).unwrap_or(row.trim());
    match finite(field, true) {
        Ok(rate) if RATES.contains(&rate) => Ok(rate),
        _ => {
            let (field, found) = ("the rate below Model Outputs".into(), format!("`{}`", short(field)));
            let allowed = format!("a number of frames a second from {} to {}", RATES.start(), RATES.end());
            Err(Fault::HeaderField { field, found, allowed })
        }
    }
}

/// The outputs: a name is above its first component, and its columns go on to the next name.
fn outputs(names: &[Cow<'_, str>], components: &[String]) -> Vec<Output> {
    let starts: Vec<usize> = (0..names.len()).filter(|&index| !names[index].is_empty()).collect();
    let ends = starts.iter().skip(1).copied().chain([components.len()]);
    let output = |(&start, end): (&usize, usize)| {
        let (group, name) = names[start].rsplit_once(':').unwrap_or(("", &names[start]));
        let column = |axis: &str| (start..end).find(|&index| components[index].eq_ignore_ascii_case(axis));
        let is_angle = name.to_ascii_lowercase().contains("angle");
        let (group, name) = (group.trim().into(), name.trim().into());
        Output { group, name, is_angle, columns: ["x", "y", "z"].map(column) }
    };
    starts.iter().zip(ends.map(|end| end.min(components.len()))).map(output).collect()
}
