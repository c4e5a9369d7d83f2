//! `cargo xtask bench`: the cost of each part of the flashed image (`board`), and of each generator.
//!
//! `cargo xtask bench oscillators` prints the gait error and the cost of each generator in one table, `cargo xtask bench pico` the cost of a tick on the
//! Raspberry Pi Pico.
//!
//! Two programs give the numbers: `footfall gait-error` the error on the default recording, on the host; `step-cost` the instructions of
//! a step, on the virtual board, which counts one cycle an instruction. None of them is a time: cycles need a chip.

mod board;
mod page;
mod pico;

pub(crate) use pico::compare as compare_pico;

use std::fmt::Write as _;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use serde_json::{Value, json};

use crate::emulated;
use crate::setup::Need;
use crate::shell;
use crate::workspace::Workspace;

/// What to measure.
#[derive(Debug, clap::Subcommand)]
pub(crate) enum Bench {
    /// Every generator: gait error on the default recording, instructions a step on the emulated Cortex-M4F
    Oscillators {
        /// One JSON object instead of the table
        #[arg(long)]
        json: bool,
    },
    /// Every part of the flashed image: instructions, exact, and modelled cycles, in seven set-ups; flash, RAM and stack
    Board(board::Options),
    /// The image of the Raspberry Pi Pico: its size, and the cycles of a tick by function, on rp2040js
    Pico,
}

/// Steps that `step-cost` counts.
const STEPS: f64 = 1000.0;

/// Instructions of a call.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Count {
    least: u64,
    mean: f64,
    most: u64,
}

impl std::fmt::Display for Count {
    /// The mean, and the extremes where there are any.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Count { least, mean, most } = self;
        if least == most { write!(f, "{mean:.0}") } else { write!(f, "{mean:.1} ({least} to {most})") }
    }
}

/// The result of `step-cost` for a generator.
#[derive(Debug, Clone, PartialEq)]
struct Cost {
    name: String,
    step: Count,
    /// Step and four angles.
    tick: Count,
}

/// A line of the table.
#[derive(Debug, Clone, PartialEq)]
struct Row {
    name: String,
    hip_deg: f64,
    knee_deg: f64,
    /// The error that 1 % of noise on each state adds.
    noise_deg: f64,
    as_built_deg: [f64; 2],
    /// Numbers that the read-out fits for each joint.
    weights: u64,
    cost: Cost,
}

/// Runs the bench.
pub(crate) fn bench(bench: &Bench) -> Result<ExitCode> {
    match bench {
        Bench::Oscillators { json } => oscillators(*json)?,
        Bench::Board(options) => board::bench(options)?,
        Bench::Pico => pico::bench()?,
    }
    Ok(ExitCode::SUCCESS)
}

fn oscillators(json: bool) -> Result<()> {
    let mut workspace = Workspace::open()?;
    workspace.set_up(&[Need::BoardCompiler, Need::VirtualBoard])?;
    let costs = costs(&workspace)?;
    let footfall = workspace.footfall()?;
    let errors = shell::stdout_of(shell::command(footfall).args(["gait-error", "--json"]))?;
    let errors: Value = serde_json::from_str(&errors).context("reading the output of footfall gait-error")?;
    // A line with a plus is of something that has no gait error of its own.
    let (also, models): (Vec<Cost>, Vec<Cost>) = costs.into_iter().partition(|cost| cost.name.starts_with('+'));
    let rows = rows(&errors, &models)?;
    print!("{}", if json { object(&rows, &also) + "\n" } else { table(&rows) + "\n" + &also_table(&also) });
    Ok(())
}

fn costs(workspace: &Workspace) -> Result<Vec<Cost>> {
    let (board, elf) = (workspace.virtual_board()?, workspace.step_cost()?);
    let lines = emulated::lines(&board, &elf, &workspace.target_dir.join("xtask-logs/step-cost.log"))?;
    lines.iter().map(|text| cost(text)).collect()
}

/// Reads `name least sum most least sum most`.
fn cost(text: &str) -> Result<Cost> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let [name, numbers @ ..] = words.as_slice() else {
        bail!("step-cost wrote an empty line; expected a name and six numbers")
    };
    let numbers: Vec<u64> = numbers.iter().map_while(|word| word.parse().ok()).collect();
    let &[a, b, c, d, e, f] = numbers.as_slice() else {
        bail!("step-cost wrote `{text}`; expected a name and six numbers")
    };
    let count = |least, sum: u64, most| Count { least, mean: sum as f64 / STEPS, most };
    Ok(Cost { name: (*name).to_owned(), step: count(a, b, c), tick: count(d, e, f) })
}

/// Joins error and cost of each generator; one that has only one of them is missing from a list.
fn rows(errors: &Value, costs: &[Cost]) -> Result<Vec<Row>> {
    let all = errors["generators"].as_array().context("footfall gait-error lists no generators")?;
    let row = |of: &Value| {
        let name = of["name"].as_str().context("a generator without a name")?;
        let number = |key: &str| of[key].as_f64().with_context(|| format!("{name} has no {key}"));
        let cost = costs.iter().find(|cost| cost.name == name);
        Ok(Row {
            name: name.to_owned(),
            hip_deg: number("hip_deg")?,
            knee_deg: number("knee_deg")?,
            noise_deg: number("noise_deg")?,
            as_built_deg: [number("as_built_hip_deg")?, number("as_built_knee_deg")?],
            weights: of["weights"].as_u64().with_context(|| format!("{name} has no weights"))?,
            cost: cost.with_context(|| format!("{name} was not counted on the board"))?.clone(),
        })
    };
    let rows = all.iter().map(row).collect::<Result<Vec<_>>>()?;
    if let Some(cost) = costs.iter().find(|cost| !rows.iter().any(|row| row.name == cost.name)) {
        bail!("{} was counted on the board, but footfall lists no gait error for it", cost.name);
    }
    Ok(rows)
}

/// Markdown.
fn table(rows: &[Row]) -> String {
    let mut text = String::from(
        "| generator | hip / knee, best read-out | 1 % noise adds | weights a joint | hip / knee, as built | instructions a step | step and four angles |\n\
         |---|---|---|---|---|---|---|\n",
    );
    for row in rows {
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "| {} | {:.2} / {:.2} | {:.2} | {} | {:.2} / {:.2} | {} | {} |",
            row.name,
            row.hip_deg,
            row.knee_deg,
            row.noise_deg,
            row.weights,
            row.as_built_deg[0],
            row.as_built_deg[1],
            row.cost.step,
            row.cost.tick
        );
    }
    text
}

/// Markdown.
fn also_table(costs: &[Cost]) -> String {
    let mut text = String::from("| also | instructions a step | step and all angles |\n|---|---|---|\n");
    for Cost { name, step, tick } in costs {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "| {} | {step} | {tick} |", name.trim_start_matches('+'));
    }
    text
}

fn object(rows: &[Row], also: &[Cost]) -> String {
    let count = |count: Count| json!({ "min": count.least, "mean": count.mean, "max": count.most });
    let row = |row: &Row| {
        json!({
            "name": row.name,
            "hip_rmse_deg": row.hip_deg,
            "knee_rmse_deg": row.knee_deg,
            "noise_adds_deg": row.noise_deg,
            "weights_per_joint": row.weights,
            "as_built_hip_rmse_deg": row.as_built_deg[0],
            "as_built_knee_rmse_deg": row.as_built_deg[1],
            "step_instructions": count(row.cost.step),
            "step_and_angles_instructions": count(row.cost.tick),
        })
    };
    let cost = |cost: &Cost| {
        json!({
            "name": cost.name.trim_start_matches('+'),
            "step_instructions": count(cost.step),
            "step_and_angles_instructions": count(cost.tick),
        })
    };
    let also: Vec<Value> = also.iter().map(cost).collect();
    json!({ "generators": rows.iter().map(row).collect::<Vec<_>>(), "also": also }).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn costs() -> Vec<Cost> {
        vec![cost("walk 296 296000 296 350 351500 360").unwrap()]
    }

    #[test]
    fn a_line_of_the_board_is_read_or_refused() {
        let [walk] = costs().try_into().unwrap();
        assert_eq!((walk.step.least, walk.step.mean, walk.tick.mean, walk.tick.most), (296, 296.0, 351.5, 360));
        for bad in ["", "walk", "walk 1 2 3", "walk 1 2 3 4 5 x", "walk 1 2 3 4 5 6 7"] {
            assert!(cost(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn error_and_cost_are_joined_and_a_missing_one_is_named() {
        let walk = json!({
            "name": "walk", "hip_deg": 4.25, "knee_deg": 12.5, "noise_deg": 0.5, "weights": 3,
            "as_built_hip_deg": 5.0, "as_built_knee_deg": 13.0,
        });
        let errors = json!({ "generators": [walk] });
        let rows = rows(&errors, &costs()).unwrap();
        let expected = "| walk | 4.25 / 12.50 | 0.50 | 3 | 5.00 / 13.00 | 296 | 351.5 (350 to 360) |";
        assert!(table(&rows).contains(expected), "{}", table(&rows));
        assert!(also_table(&costs()).contains("| walk | 296 | 351.5 (350 to 360) |"));
        assert!(object(&rows, &costs()).contains(r#""step_instructions":{"max":296,"mean":296.0,"min":296}"#));
        let message = super::rows(&errors, &[]).unwrap_err().to_string();
        assert!(message.contains("walk was not counted"), "{message}");
        let message = super::rows(&json!({ "generators": [] }), &costs()).unwrap_err().to_string();
        assert!(message.contains("walk was counted"), "{message}");
    }
}
