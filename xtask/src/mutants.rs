//! `cargo xtask mutants`: cargo-mutants changes the code of gate, supervision and flash records in each place; the tests of `joint-loop` must notice.
//!
//! The tests run in two passes, because each mutant is compiled: the short ones of the library first, and all tests for what is left.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use serde_json::Value;

use crate::missing_requirement::MissingRequirement;
use crate::shell;
use crate::workspace::Workspace;

const MISSING: &str =
    "cargo-mutants is missing; it changes the code and runs the tests: `cargo install --locked cargo-mutants`";
/// Files whose code is changed: the gate with its bounds and limits, supervision, and the flash records. They are no part of the configuration of
/// cargo-mutants, which would add those of `--file` to them.
const FILES: [&str; 5] = [
    "joint-loop/src/motion/gate.rs",
    "joint-loop/src/motion/gate/bounds.rs",
    "joint-loop/src/motion/limits.rs",
    "joint-loop/src/control/**/*.rs",
    "joint-loop/src/store/**/*.rs",
];
/// What the two passes run: in words, the programs, and their arguments.
const PASSES: [(&str, &str, &[&str]); 2] =
    [("the short tests in the library", "--lib", &["--", "--", "--skip", LONG_TEST]), ("all tests", "--tests", &[])];
/// A test of the library that takes longer than all the others together.
const LONG_TEST: &str = "bounds_hold_for_any_input_sequence";
/// Exit codes of cargo-mutants: every mutant was noticed, some were not, some tests did not end.
const ENDS: [i32; 3] = [0, 2, 3];

/// Options of `cargo xtask mutants`.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Only files with this path or this pattern, for example `**/gate.rs` (repeat for more)
    #[arg(long, value_name = "GLOB")]
    file: Vec<String>,
    /// One part of the mutants: part K of N, from 0/N on
    #[arg(long, value_name = "K/N", value_parser = shard)]
    shard: Option<String>,
    /// Leave out what the first pass of earlier runs has noticed
    #[arg(long)]
    iterate: bool,
    /// Mutants that are compiled and tested at a time
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=64))]
    jobs: u16,
}

fn shard(text: &str) -> Result<String, String> {
    let numbers =
        text.split_once('/').and_then(|(part, of)| Some((part.parse::<u32>().ok()?, of.parse::<u32>().ok()?)));
    match numbers {
        Some((part, of)) if part < of => Ok(text.to_owned()),
        _ => Err("allowed is K/N with K from 0 to N - 1, for example 0/8".to_owned()),
    }
}

/// Runs both passes and prints the table and the survivors.
pub(crate) fn mutants(options: &Options) -> Result<ExitCode> {
    let workspace = Workspace::open()?;
    if shell::stdout_of(shell::cargo().args(["mutants", "--version"])).is_err() {
        return Err(MissingRequirement(MISSING.to_owned()).into());
    }
    let mut result = Outcomes::default();
    for (place, (what, tests, words)) in PASSES.into_iter().enumerate() {
        eprintln!("mutants: {what}");
        // A folder for each: `--iterate` leaves out what the newest run in the folder has noticed.
        let folder = workspace.target_dir.join("mutants").join(format!("pass-{}", place + 1));
        std::fs::create_dir_all(&folder).with_context(|| format!("making {}", folder.display()))?;
        let outcomes = folder.join("mutants.out/outcomes.json");
        // What an earlier run left is not the result of this one. `--iterate` reads other files.
        match std::fs::remove_file(&outcomes) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                return Err(error).with_context(|| format!("removing {}", outcomes.display()));
            }
            _ => {}
        }
        let mut command = shell::cargo();
        command.args(["mutants", "--package", "joint-loop", "--no-shuffle", "--jobs", &options.jobs.to_string()]);
        command.arg("--output").arg(&folder);
        // Only what the pass runs is compiled, without debug information, and only what changed: most of the time goes into compiling.
        command.args(["--cargo-arg", tests]).env("CARGO_PROFILE_DEV_DEBUG", "0").env("CARGO_INCREMENTAL", "1");
        // In the second pass too: cargo-mutants 27 deletes fields in every file, whatever names it is given.
        let all = FILES.map(str::to_owned);
        for file in if options.file.is_empty() { &all[..] } else { &options.file } {
            command.args(["--file", file]);
        }
        if place == 0 {
            if let Some(shard) = &options.shard {
                // In turn, so that a part is a sample of every file.
                command.args(["--shard", shard, "--sharding", "round-robin"]);
            }
            if options.iterate {
                command.arg("--iterate");
            }
        } else {
            // By name: cargo-mutants takes a part of what is left, which is another part.
            for (_, name) in &result.missed {
                command.args(["--re", &format!("^{}$", regex_syntax::escape(name))]);
            }
        }
        command.args(words);
        let status = shell::each_line(&mut command, |_, line| eprintln!("{line}")).context("cargo mutants")?;
        if !status.code().is_some_and(|code| ENDS.contains(&code)) {
            bail!("cargo mutants failed ({status}): the tests must pass before the code is changed");
        }
        if !outcomes.is_file() {
            if options.iterate || options.shard.is_some() {
                eprintln!("mutants: nothing is left to change");
                break;
            }
            bail!("nothing was tested: `--file` names no code that can be changed");
        }
        result.add(&outcomes)?;
        if result.missed.is_empty() {
            break;
        }
    }
    print!("{result}");
    Ok(if result.missed.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Mutants of a file.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
struct Counts {
    caught: u32,
    /// The tests did not end, which is noticed too.
    timeout: u32,
    unviable: u32,
}

/// What came of the mutants.
#[derive(Debug, Default)]
struct Outcomes {
    files: BTreeMap<String, Counts>,
    /// File and change, of the last pass.
    missed: Vec<(String, String)>,
}

impl Outcomes {
    fn add(&mut self, path: &Path) -> Result<()> {
        let text = std::fs::read_to_string(path).with_context(|| format!("reading {}", path.display()))?;
        self.add_text(&text).with_context(|| format!("{} is not what cargo-mutants writes", path.display()))
    }

    fn add_text(&mut self, text: &str) -> Result<()> {
        let value: Value = serde_json::from_str(text)?;
        // The second pass is about these; fields that it deletes elsewhere belong to the first.
        let before = std::mem::take(&mut self.missed);
        let mut seen = BTreeSet::new();
        for outcome in value["outcomes"].as_array().context("no outcomes")? {
            let mutant = &outcome["scenario"]["Mutant"];
            let (Some(file), Some(name)) = (mutant["file"].as_str(), mutant["name"].as_str()) else { continue };
            if !before.is_empty() && !before.iter().any(|(_, missed)| missed == name) {
                continue;
            }
            seen.insert(name.to_owned());
            let counts = self.files.entry(file.to_owned()).or_default();
            match outcome["summary"].as_str() {
                Some("CaughtMutant") => counts.caught += 1,
                Some("Timeout") => counts.timeout += 1,
                Some("Unviable") => counts.unviable += 1,
                Some("MissedMutant") => self.missed.push((file.to_owned(), name.to_owned())),
                other => bail!("the summary {other:?} of {name}"),
            }
        }
        // One that the second pass did not run has survived.
        self.missed.extend(before.into_iter().filter(|(_, name)| !seen.contains(name)));
        Ok(())
    }
}

impl fmt::Display for Outcomes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "| file | caught | tests did not end | does not compile | survived |\n|---|---|---|---|---|")?;
        for (file, Counts { caught, timeout, unviable }) in &self.files {
            let missed = self.missed.iter().filter(|(of, _)| of == file).count();
            writeln!(f, "| {file} | {caught} | {timeout} | {unviable} | {missed} |")?;
        }
        self.missed.iter().try_for_each(|(_, name)| writeln!(f, "survived: {name}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_pass_replaces_the_survivors_of_the_first() {
        let outcome = |summary: &str, name: &str| {
            format!(r#"{{"scenario":{{"Mutant":{{"file":"a.rs","name":"{name}"}}}},"summary":"{summary}"}}"#)
        };
        let text = |outcomes: &[String]| {
            format!(r#"{{"outcomes":[{{"scenario":"Baseline","summary":"Success"}},{}]}}"#, outcomes.join(","))
        };
        let mut outcomes = Outcomes::default();
        let first = [
            outcome("CaughtMutant", "a.rs:1: one"),
            outcome("MissedMutant", "a.rs:2: two"),
            outcome("MissedMutant", "a.rs:3: three"),
        ];
        outcomes.add_text(&text(&first)).unwrap();
        assert_eq!(outcomes.missed.len(), 2);
        let second = [
            outcome("Timeout", "a.rs:2: two"),
            outcome("MissedMutant", "a.rs:3: three"),
            outcome("Unviable", "a.rs:4: four"),
        ];
        outcomes.add_text(&text(&second)).unwrap();
        let table = outcomes.to_string();
        assert!(table.contains("| a.rs | 1 | 1 | 0 | 1 |") && table.ends_with("survived: a.rs:3: three\n"), "{table}");
        assert!(outcomes.add_text("{}").is_err() && outcomes.add_text(&text(&[outcome("New", "a")])).is_err());
    }

    #[test]
    fn a_part_that_is_none_is_refused() {
        for wrong in ["8/8", "1", "a/b", "-1/2", "0/0"] {
            assert!(shard(wrong).is_err_and(|error| error.contains("allowed is")), "{wrong}");
        }
        assert_eq!(shard("0/8").as_deref(), Ok("0/8"));
    }
}
