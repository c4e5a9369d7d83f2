//! The system of an analysis, its parameters, and the files of the result: what `phase-response`, `tongue`, `basin` and `bifurcation` share.

use clap::Args;
use dynamics::oscillator::{KINDS, Kind};
use dynamics::system::{PREFIX, System};
use generator_file::subject::Subject;
use indicatif::{ProgressBar, ProgressStyle};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use crate::failure::Failure;
use crate::messages::{self, Amount};
use crate::options::overwrite::Overwrite;
use crate::output;

/// What is analysed.
#[derive(Debug, Clone, Args)]
pub struct SystemArgument {
    /// `oscillator:NAME`, a generator file, or the name of a default, a gait or a model of the catalogue (see --list)
    #[arg(value_name = "SYSTEM", required_unless_present = "list")]
    pub system: Option<String>,
    /// Another value of a parameter, as mu=2, or coupling.hips=0.2 of a generator file; may be repeated
    #[arg(long, value_name = "PARAMETER=VALUE")]
    pub set: Vec<Assignment>,
    /// Print every name, one a line, with the states and parameters of the oscillators
    #[arg(long, conflicts_with_all = ["system", "set"])]
    pub list: bool,
}

/// Where the result goes.
#[derive(Debug, Clone, Args)]
pub struct ResultFiles {
    /// Write every value as CSV
    #[arg(short, long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Draw the result
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
    /// Print one JSON object instead of the table
    #[arg(long)]
    pub json: bool,
    /// Whether files may be replaced
    #[command(flatten)]
    pub overwrite: Overwrite,
}

/// NAME=VALUE.
#[derive(Debug, Clone, PartialEq)]
pub struct Assignment {
    /// Before the equals sign.
    pub name: String,
    /// Behind it.
    pub value: f64,
}

impl FromStr for Assignment {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('=').and_then(|(name, value)| Some((name.trim(), finite(value)?)));
        let (name, value) = parts.ok_or("allowed is NAME=NUMBER, such as mu=2")?;
        Ok(Self { name: name.to_owned(), value })
    }
}

/// NAME=FROM..TO.
#[derive(Debug, Clone, PartialEq)]
pub struct Span {
    /// Before the equals sign.
    pub name: String,
    /// First value.
    pub from: f64,
    /// Last value, above the first.
    pub to: f64,
}

impl FromStr for Span {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('=').and_then(|(name, range)| Some((name.trim(), range_of(range)?)));
        let (name, (from, to)) =
            parts.ok_or("allowed is NAME=FROM..TO with FROM below TO, such as current=0.2..0.5")?;
        Ok(Self { name: name.to_owned(), from, to })
    }
}

/// FROM..TO with FROM below TO.
///
/// # Errors
/// Says what is allowed.
pub fn range(text: &str) -> Result<(f64, f64), String> {
    range_of(text).ok_or_else(|| "allowed is FROM..TO with FROM below TO, such as 0.4..2.2".into())
}

fn range_of(text: &str) -> Option<(f64, f64)> {
    let (from, to) = text.split_once("..")?;
    Some((finite(from)?, finite(to)?)).filter(|(from, to)| from < to)
}

fn finite(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|value: &f64| value.is_finite())
}

impl SystemArgument {
    /// The system, with its parameters; none if the list was printed instead.
    ///
    /// # Errors
    /// There is no such system or parameter, or a value is not allowed.
    pub fn read(&self) -> Result<Option<System>, Failure> {
        let Some(name) = self.system.as_ref().filter(|_| !self.list) else {
            output::print(&list())?;
            return Ok(None);
        };
        let system = System::read(name).map_err(Failure::input)?;
        let set = |system: System, of: &Assignment| {
            system
                .with(&of.name, of.value)
                .map_err(|why| Failure::input(format!("--set {}={}: {why}", of.name, of.value)))
        };
        self.set.iter().try_fold(system, set).map(Some)
    }

    /// What is analysed, in words.
    #[must_use]
    pub fn in_words(&self) -> String {
        let values: Vec<String> = self.set.iter().map(|of| format!("{} = {}", of.name, of.value)).collect();
        let name = self.system.as_deref().unwrap_or_default();
        if values.is_empty() { name.to_owned() } else { format!("{name}, {}", values.join(", ")) }
    }

    fn file(&self) -> Option<&Path> {
        self.system.as_ref().map(Path::new).filter(|path| path.exists())
    }
}

impl ResultFiles {
    /// Refuses files that may not be written, before any work.
    ///
    /// # Errors
    /// A file exists, is an input, or is named twice.
    pub fn check(&self, system: &SystemArgument) -> Result<(), Failure> {
        let outputs = || [&self.out, &self.svg].into_iter().flatten().map(PathBuf::as_path);
        output::check_apart(outputs(), system.file())?;
        outputs().try_for_each(|path| output::check(path, self.overwrite))
    }

    /// Writes the CSV and prints the result: the object, or the rows of the table.
    ///
    /// # Errors
    /// A file or standard output cannot be written.
    pub fn write(
        &self,
        csv: impl FnOnce() -> String,
        object: &serde_json::Value,
        rows: &[(String, String)],
    ) -> Result<(), Failure> {
        if let Some(path) = &self.out {
            output::write_text(path, &csv(), self.overwrite)?;
            messages::written(path);
        }
        let table = || rows.iter().map(|(name, value)| format!("{name:<24} {value}\n")).collect();
        output::print(&if self.json { format!("{object}\n") } else { table() })
    }
}

/// A bar that shows how much of a long computation is done.
#[must_use]
pub fn progress(count: usize) -> ProgressBar {
    let bar = if messages::says(Amount::Usual) { ProgressBar::new(count as u64) } else { ProgressBar::hidden() };
    if let Ok(style) = ProgressStyle::with_template("{elapsed} {bar:30} {pos}/{len} {eta}") {
        bar.set_style(style);
    }
    bar
}

/// So many even values from the first to the last.
#[must_use]
pub fn even(from: f64, to: f64, count: usize) -> Vec<f64> {
    (0..count).map(|k| from + (to - from) * k as f64 / (count - 1).max(1) as f64).collect()
}

/// The middles of so many cells between two borders.
#[must_use]
pub fn middles(from: f64, to: f64, count: usize) -> Vec<f64> {
    (0..count).map(|k| from + (to - from) * (k as f64 + 0.5) / count as f64).collect()
}

fn list() -> String {
    let oscillator = |kind: &Kind| {
        let parameters: Vec<String> =
            kind.parameters.iter().map(|p| format!("{}={} ({} to {})", p.name, p.default, p.least, p.most)).collect();
        let (states, parameters) = (kind.variables.join(", "), parameters.join(", "));
        format!("{PREFIX}{:<18} {}; states {states}; parameters {parameters}\n", kind.name, kind.what)
    };
    let generators = Subject::names().into_iter().map(|(name, what)| format!("{name:<29} {what}\n"));
    KINDS.iter().map(oscillator).chain(generators).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn assignments_and_spans_are_parsed_or_refused_with_what_is_allowed() {
        assert_eq!("mu=2".parse(), Ok(Assignment { name: "mu".into(), value: 2.0 }));
        assert_eq!("V=-50..40".parse(), Ok(Span { name: "V".into(), from: -50.0, to: 40.0 }));
        assert_eq!(range("0.4..2.2"), Ok((0.4, 2.2)));
        for bad in ["mu", "mu=", "mu=inf", "mu=x"] {
            assert!(bad.parse::<Assignment>().unwrap_err().contains("allowed"), "{bad}");
        }
        for bad in ["V=1", "V=2..1", "V=1..nan", "1..2"] {
            assert!(bad.parse::<Span>().unwrap_err().contains("allowed"), "{bad}");
        }
    }

    #[test]
    fn values_are_even() {
        assert_eq!((even(0.0, 1.0, 3), middles(0.0, 1.0, 2)), (vec![0.0, 0.5, 1.0], vec![0.25, 0.75]));
    }
}
