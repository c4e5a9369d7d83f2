//! `cargo xtask test`: checks everything that must hold before a change is merged, and stops at the first step that fails.
//!
//! A step whose optional tool is missing is skipped, with the reason at its place and in the table at the end. Steps that keep one core busy run in a
//! second process beside the others ([`beside`]).

mod audits;
mod beside;
mod controls;
mod counts;
mod example;
mod judged;
mod pico;
mod processor;
mod programs;
mod python;
mod state;
mod steps;
mod summary;

use std::num::NonZero;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use clap::builder::PossibleValuesParser;

use crate::setup::{Need, Required};
use crate::workspace::Workspace;
use beside::{BESIDE, Beside};
use state::{CannotRun, State};
use steps::{BY_NAME, STEPS, Step};
use summary::{Outcome, Row};

/// Options of `cargo xtask test`.
#[derive(Debug, Default, clap::Args)]
pub(crate) struct Options {
    /// Only this step (repeat for more)
    #[arg(long, value_name = "STEP", hide_possible_values = true)]
    #[arg(value_parser = PossibleValuesParser::new(STEPS.iter().map(|step| step.name)))]
    only: Vec<String>,
    /// List the steps and stop
    #[arg(long)]
    list: bool,
    /// Write the rows of the table to this file
    #[arg(long, value_name = "FILE", hide = true)]
    results: Option<PathBuf>,
}

/// Runs the steps and prints the table at the end.
pub(crate) fn test(options: &Options) -> Result<ExitCode> {
    if options.list {
        for step in &STEPS {
            let by_name = if BY_NAME.contains(&step.name) { " (only with --only)" } else { "" };
            println!("{:<14} {}{by_name}", step.name, step.claim);
        }
        return Ok(ExitCode::SUCCESS);
    }
    let required = Required::from_environment()?;
    let steps = selected(&options.only);
    let started = Instant::now();
    let mut workspace = Workspace::open()?;
    let missing = workspace.prepare(&needs(&steps), &required)?;
    workspace.strict = true;
    workspace.footfall_of_tests = true;
    let state = State::new(workspace, required);
    let cores = std::thread::available_parallelism().map_or(1, NonZero::get);
    let (apart, mine): (Vec<&Step>, Vec<&Step>) =
        steps.iter().partition(|step| options.only.is_empty() && cores > 1 && BESIDE.contains(&step.name));
    let mut beside = if apart.is_empty() { None } else { Some(Beside::start(&apart, &state.logs())?) };

    let mut rows: Vec<Row> = Vec::new();
    let mut failed = false;
    for (index, step) in mine.iter().enumerate() {
        let stopped = options.results.as_deref().is_some_and(|file| beside::stop_file(file).exists());
        if let Some(beside) = &mut beside {
            failed |= beside.has_failed()?;
        }
        if failed || stopped {
            rows.push(Row { name: step.name, outcome: Outcome::NotRun, took: Duration::ZERO, processor: None });
            continue;
        }
        eprintln!("\n=== step {} of {}: {} ({})", index + 1, mine.len(), step.name, step.claim);
        let (step_started, before) = (Instant::now(), processor::time());
        let outcome = outcome(step, &missing, &state);
        failed = matches!(outcome, Outcome::Failed(_));
        let processor = processor::time().zip(before).map(|(after, before)| after.saturating_sub(before));
        rows.push(Row { name: step.name, outcome, took: step_started.elapsed(), processor });
    }
    if let Some(beside) = beside {
        let (more, counts) = beside.end(failed)?;
        failed |= more.iter().any(|row| matches!(row.outcome, Outcome::Failed(_)));
        rows.extend(more);
        state.counts.borrow_mut().add(counts);
    }
    let rows = beside::in_order(rows, &steps)?;
    if let Some(file) = &options.results {
        let text = beside::written(&rows, &state.counts.borrow());
        std::fs::write(file, text).with_context(|| format!("writing {}", file.display()))?;
    }
    print!("\n{}", summary::table(&rows, &state.counts.borrow(), started.elapsed()));
    Ok(if failed { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

/// The steps that `--only` names, in their usual order; without it all but those that only it runs.
fn selected(only: &[String]) -> Vec<&'static Step> {
    let is_selected = |step: &&Step| match only {
        [] => !BY_NAME.contains(&step.name),
        _ => only.iter().any(|name| name == step.name),
    };
    STEPS.iter().filter(is_selected).collect()
}

/// What the steps need and use, each once.
fn needs(steps: &[&Step]) -> Vec<Need> {
    let mut needs = Vec::new();
    for need in steps.iter().flat_map(|step| step.needs.iter().chain(step.uses)) {
        if !needs.contains(need) {
            needs.push(*need);
        }
    }
    needs
}

/// Runs a step, unless something that it needs is missing.
fn outcome(step: &Step, missing: &[(Need, String)], state: &State) -> Outcome {
    if let Some(reason) = reason_to_skip(step, missing) {
        eprintln!("SKIPPED: {reason}");
        return Outcome::Skipped(reason.to_owned());
    }
    judged((step.run)(state))
}

/// What the result of a step means.
fn judged(result: Result<String>) -> Outcome {
    match result {
        Ok(note) => Outcome::Passed(note),
        Err(error) if error.is::<CannotRun>() => {
            eprintln!("SKIPPED: {error}");
            Outcome::Skipped(error.to_string())
        }
        Err(error) => {
            eprintln!("error: {error:#}");
            Outcome::Failed(format!("{error:#}").lines().next().unwrap_or_default().to_owned())
        }
    }
}

/// Why something that the step needs is missing.
fn reason_to_skip<'a>(step: &Step, missing: &'a [(Need, String)]) -> Option<&'a str> {
    missing.iter().find(|(need, _)| step.needs.contains(need)).map(|(_, reason)| reason.as_str())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_selects_in_the_usual_order() {
        let names = |only: &[&str]| -> Vec<_> {
            let only: Vec<String> = only.iter().map(|&name| name.to_owned()).collect();
            selected(&only).iter().map(|step| step.name).collect()
        };
        assert_eq!(names(&["docs", "format"]), ["format", "docs"]);
        assert_eq!(names(&[]).len(), STEPS.len() - BY_NAME.len());
        assert_eq!(names(&BY_NAME), BY_NAME);
    }

    #[test]
    fn each_need_is_prepared_once() {
        let all = needs(&selected(&[]));
        assert_eq!(all.len(), 8, "{all:?}");
        assert_eq!(needs(&selected(&["format".to_owned()])), []);
    }

    #[test]
    fn a_step_that_finds_no_packages_is_not_passed() {
        assert!(matches!(judged(Ok("3 tests".into())), Outcome::Passed(note) if note == "3 tests"));
        let missing = CannotRun("no network".into());
        assert!(matches!(judged(Err(missing.into())), Outcome::Skipped(reason) if reason == "no network"));
        assert!(matches!(judged(Err(anyhow::anyhow!("broken\nin line 2"))), Outcome::Failed(why) if why == "broken"));
    }

    #[test]
    fn a_step_without_its_tool_is_skipped() {
        let step =
            Step { name: "x", claim: "", needs: &[Need::Node], uses: &[Need::Traces], run: |_| Ok("ran".into()) };
        let missing = |need| [(need, "not here".to_owned())];
        assert_eq!(reason_to_skip(&step, &missing(Need::Node)), Some("not here"));
        assert_eq!(reason_to_skip(&step, &missing(Need::Traces)), None);
        assert_eq!(reason_to_skip(&step, &[]), None);
    }
}
