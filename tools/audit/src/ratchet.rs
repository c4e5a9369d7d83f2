//! Ratchets: numbers that must not get worse than those in `ratchets.toml`. All of them are better if they are smaller.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use anyhow::{Context, Result, bail, ensure};
use serde::Deserialize;

/// A number as it is now.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Measured {
    /// Its name in the file.
    pub name: String,
    /// The number.
    pub value: u64,
    /// It depends on the compiler of the image: with another one it says nothing.
    pub by_compiler: bool,
}

impl Measured {
    /// A number that the compiler changes.
    #[must_use]
    pub fn compiled(name: &str, value: u64) -> Self {
        Self { name: name.into(), value, by_compiler: true }
    }

    /// A number that does not depend on the compiler.
    #[must_use]
    pub fn always(name: &str, value: u64) -> Self {
        Self { name: name.into(), value, by_compiler: false }
    }
}

/// An entry of the file.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// The number when the entry was last written.
    pub value: u64,
    /// It may be larger by this part of it, percent.
    pub margin_percent: u64,
    /// Why it was last changed.
    pub reason: String,
}

impl Entry {
    fn allowed(&self) -> u64 {
        self.value + self.value * self.margin_percent / 100
    }
}

/// The file.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Baseline {
    /// What the compiler of the image said of itself when the file was last written.
    pub compiler: String,
    /// By name.
    pub ratchets: BTreeMap<String, Entry>,
    /// Those that a test measures and compares, by name.
    #[serde(default)]
    pub in_tests: BTreeMap<String, Entry>,
}

/// How a number compares.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Not above what is allowed.
    Kept,
    /// Above it.
    Worse,
    /// The image has another compiler than the file: not compared.
    OtherCompiler,
    /// The file has no such entry.
    Missing,
}

impl Baseline {
    /// Reads the file.
    ///
    /// # Errors
    ///
    /// With the place of what is wrong in it.
    pub fn parse(text: &str) -> Result<Self> {
        toml::from_str(text).context("reading ratchets.toml")
    }

    /// Compares a number.
    #[must_use]
    pub fn verdict(&self, measured: &Measured, compiler: &str) -> Verdict {
        match self.ratchets.get(&measured.name) {
            None => Verdict::Missing,
            Some(_) if measured.by_compiler && compiler != self.compiler => Verdict::OtherCompiler,
            Some(entry) if measured.value > entry.allowed() => Verdict::Worse,
            Some(_) => Verdict::Kept,
        }
    }

    /// A line for each number, and an error that names those which got worse.
    ///
    /// # Errors
    ///
    /// When a number got worse, has no entry, or an entry has no number.
    pub fn compare(&self, all: &[Measured], compiler: &str) -> Result<String> {
        let mut table = String::new();
        let mut wrong = Vec::new();
        for measured in all {
            let verdict = self.verdict(measured, compiler);
            let entry = self.ratchets.get(&measured.name);
            let (before, allowed) = entry
                .map_or((String::new(), String::new()), |entry| (entry.value.to_string(), entry.allowed().to_string()));
            let word = match verdict {
                Verdict::Kept => "kept",
                Verdict::Worse => "WORSE",
                Verdict::OtherCompiler => "not compared: another compiler",
                Verdict::Missing => "NO ENTRY",
            };
            if matches!(verdict, Verdict::Worse | Verdict::Missing) {
                wrong.push(format!(
                    "{}: {}, allowed {}",
                    measured.name,
                    measured.value,
                    if allowed.is_empty() { "no entry" } else { &allowed }
                ));
            }
            // Writing to a String cannot fail.
            let _ = writeln!(table, "{:<24} {:>8} {before:>8} {allowed:>8}  {word}", measured.name, measured.value);
        }
        for name in self.ratchets.keys().filter(|name| all.iter().all(|measured| measured.name != **name)) {
            wrong.push(format!("{name}: an entry of ratchets.toml that is not measured"));
        }
        let head = format!("{:<24} {:>8} {:>8} {:>8}\n", "", "now", "baseline", "allowed");
        if wrong.is_empty() {
            return Ok(head + &table);
        }
        bail!(
            "{head}{table}got worse:\n  {}\nmend it, or change its entry in ratchets.toml, with the reason",
            wrong.join("\n  ")
        );
    }

    /// Shows that each number can fail: with an entry below it, or itself above an entry of 0, it is worse, and no other is.
    ///
    /// # Errors
    ///
    /// With the number that cannot fail.
    pub fn control(all: &[Measured], compiler: &str) -> Result<()> {
        let entry = |value| Entry { value, margin_percent: 0, reason: String::new() };
        let ratchets = all.iter().map(|measured| (measured.name.clone(), entry(measured.value))).collect();
        let even = Self { compiler: compiler.to_owned(), ratchets, in_tests: BTreeMap::new() };
        for (index, measured) in all.iter().enumerate() {
            let mut lowered = even.clone();
            let mut now = all.to_vec();
            if measured.value > 0 {
                lowered.ratchets.insert(measured.name.clone(), entry(measured.value - 1));
            } else {
                now[index].value = 1;
            }
            let worse: Vec<&str> = now
                .iter()
                .filter(|measured| lowered.verdict(measured, compiler) != Verdict::Kept)
                .map(|measured| measured.name.as_str())
                .collect();
            ensure!(worse == [measured.name.as_str()], "the ratchet {} cannot fail: {worse:?}", measured.name);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all() -> Vec<Measured> {
        vec![Measured::compiled("tick", 1000), Measured::always("late", 0), Measured::always("unsafe", 7)]
    }

    fn baseline() -> Baseline {
        let text = "compiler = \"c 1\"\n[ratchets]\n\
            tick = { value = 1000, margin_percent = 5, reason = \"first\" }\n\
            late = { value = 0, margin_percent = 0, reason = \"first\" }\n\
            unsafe = { value = 7, margin_percent = 0, reason = \"first\" }\n";
        Baseline::parse(text).unwrap()
    }

    #[test]
    fn a_number_above_its_margin_is_worse() {
        let baseline = baseline();
        let verdict = |name: &str, value, compiler: &str| {
            let measured = Measured { value, ..all().into_iter().find(|measured| measured.name == name).unwrap() };
            baseline.verdict(&measured, compiler)
        };
        assert_eq!((verdict("tick", 1050, "c 1"), verdict("tick", 1051, "c 1")), (Verdict::Kept, Verdict::Worse));
        assert_eq!(verdict("tick", 9000, "c 2"), Verdict::OtherCompiler);
        assert_eq!((verdict("late", 0, "c 2"), verdict("late", 1, "c 2")), (Verdict::Kept, Verdict::Worse));
        assert_eq!((verdict("unsafe", 7, "c 1"), verdict("unsafe", 8, "c 1")), (Verdict::Kept, Verdict::Worse));
    }

    #[test]
    fn what_is_not_measured_or_not_listed_is_an_error() {
        let baseline = baseline();
        assert!(baseline.compare(&all(), "c 1").unwrap().contains("kept"));
        let error = baseline.compare(&all()[..2], "c 1").unwrap_err().to_string();
        assert!(error.contains("unsafe: an entry of ratchets.toml that is not measured"), "{error}");
        let mut more = all();
        more.push(Measured::always("new", 1));
        assert!(baseline.compare(&more, "c 1").unwrap_err().to_string().contains("new: 1, allowed no entry"));
    }

    #[test]
    fn each_number_can_fail() {
        assert!(Baseline::control(&all(), "c 1").is_ok());
        // Two of one name: one of them hides the other.
        let double = [Measured::always("a", 1), Measured::always("a", 1)];
        assert!(Baseline::control(&double, "c 1").is_err());
    }
}
