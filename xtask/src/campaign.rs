//! `cargo xtask campaign`: injects faults into the flashed image on the virtual board, and prints what each led to.

use std::fmt::Write as _;
use std::io::BufRead as _;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::board::{Board, Drive};
use crate::probe::Sector;
use crate::record;
use crate::setup::Need;
use crate::shell;
use crate::workspace::Workspace;

/// The campaign that is run without an option.
const FAULTS: &str = "tests/campaign/faults.toml";
/// Runs of it in which faults are injected; the generator of the last is [`FOLLOWER`].
const RUNS: [&str; 3] = ["walk", "trim", "follower"];
const FOLLOWER: &str = "tests/campaign/follower.toml";
/// What the gait sensor measures meanwhile: a walk.
pub(crate) const VOLTS: &str = "tests/traces/gaitkit_fukuchi_healthy_left_knee_volts.csv";

/// Options of `cargo xtask campaign`.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// The faults [default: tests/campaign/faults.toml]
    #[arg(long, value_name = "TOML")]
    faults: Option<PathBuf>,
    /// One case of N
    #[arg(long, value_name = "N", default_value_t = 1, conflicts_with = "several")]
    every: u32,
    /// Only faults whose name contains TEXT
    #[arg(long, value_name = "TEXT", conflicts_with = "several")]
    only: Option<String>,
    /// Instead of single faults N cases of 2 to 4 faults each, drawn at random; only the pulses judge them, and that nothing arms by itself
    #[arg(long, value_name = "N")]
    several: Option<u64>,
    /// Seed of the first of them; the next case has the next seed
    #[arg(long, value_name = "SEED", requires = "several", default_value_t = 1)]
    seed: u64,
    /// Write each case, a JSON object a line, to this file
    #[arg(long, value_name = "FILE")]
    cases: Option<PathBuf>,
}

/// Builds what is needed, runs the campaign, and prints its table.
pub(crate) fn campaign(options: &Options) -> Result<ExitCode> {
    let mut workspace = Workspace::open()?;
    workspace.set_up(&[Need::BoardCompiler, Need::VirtualBoard])?;
    let image = workspace.firmware(Board::F4Discovery, Drive::Servos)?;
    let robot = record::path_of(&workspace, Sector::Robot);
    record::pack_default_robot(&workspace, &robot)?;
    let faults = options.faults.as_ref().map_or_else(|| PathBuf::from(FAULTS), |file| workspace.started_in.join(file));
    let follower = record::path_of(&workspace, Sector::Generator);
    record::pack(&workspace, &[std::path::absolute(FOLLOWER)?.into()], &follower)?;
    let (mut table, mut kept) = (Table::default(), String::new());
    for run in RUNS {
        let mut command = shell::command(workspace.virtual_board()?);
        command.arg(&image.elf).args(["--loop", "--volts", VOLTS]);
        command.arg("--flash").arg(flashed(Sector::Robot, &robot));
        if run == "follower" {
            command.arg("--flash").arg(flashed(Sector::Generator, &follower));
        }
        command.arg("--campaign").arg(&faults).args(["--run", run, "--every", &options.every.to_string()]);
        command.args(options.only.iter().flat_map(|only| ["--only", only]));
        if let Some(several) = options.several {
            command.args(["--several", &several.to_string(), "--seed", &options.seed.to_string()]);
        }
        eprintln!("run: {run}");
        take_cases(&mut command, &mut table, &mut kept)?;
    }
    if let Some(file) = &options.cases {
        let path = workspace.started_in.join(file);
        std::fs::write(&path, kept).with_context(|| format!("writing {}", path.display()))?;
    }
    print!("{table}");
    if options.several.is_some() {
        println!("seed {}", options.seed);
    }
    Ok(if table.wrong == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// A record for a sector, as the virtual board takes it.
fn flashed(sector: Sector, record: &Path) -> String {
    format!("{:#010x}={}", sector.address(), record.display())
}

/// Runs the virtual board, and takes the cases of one run into the table; `kept` gets its lines.
fn take_cases(command: &mut Command, table: &mut Table, kept: &mut String) -> Result<()> {
    let mut child =
        command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn().context("starting the virtual board")?;
    let lines = BufReader::new(child.stdout.take().context("no standard output of the virtual board")?).lines();
    table.is_complete = false;
    for line in lines {
        let line = line.context("reading from the virtual board")?;
        let case: Value = serde_json::from_str(&line).with_context(|| format!("`{line}` is no line of a campaign"))?;
        table.add(&case);
        kept.push_str(&line);
        kept.push('\n');
    }
    let status = child.wait().context("waiting for the virtual board")?;
    // It ends with 1 if a case is wrong, which the table shows.
    ensure!(matches!(status.code(), Some(0 | 1)) && table.is_complete, "the virtual board ended with {status}");
    Ok(())
}

/// What came of the faults: those of one register or one part of the memory together.
#[derive(Debug, Default)]
struct Table {
    rows: Vec<Row>,
    wrong: u64,
    cases: u64,
    seconds: f64,
    is_complete: bool,
}

#[derive(Debug, Default)]
struct Row {
    name: String,
    states: Vec<String>,
    cases: u64,
    wrong: u64,
    /// The latest end of the pulses and the latest reset, us.
    off_us: Option<f64>,
    reset_us: Option<f64>,
    why: Vec<String>,
}

impl Table {
    fn add(&mut self, case: &Value) {
        if case["type"] == "end" {
            self.is_complete = true;
            self.seconds += case["seconds"].as_f64().unwrap_or_default();
            return;
        }
        // `TIM1 ARR, bit 3` is one of the bits of a register.
        let name = case["name"].as_str();
        let group =
            name.map_or("several faults", |name| name.split_once(", ").map_or(name, |(group, _)| group)).to_owned();
        let place = self.rows.iter().position(|row| row.name == group).unwrap_or_else(|| {
            self.rows.push(Row { name: group, ..Row::default() });
            self.rows.len() - 1
        });
        let row = &mut self.rows[place];
        let state = case["state"].as_str().unwrap_or_default();
        if !row.states.iter().any(|known| known == state) {
            row.states.push(state.to_owned());
        }
        let latest = |so_far: Option<f64>, key: &str| match (so_far, case[key].as_f64()) {
            (Some(a), Some(b)) => Some(a.max(b)),
            (a, b) => a.or(b),
        };
        (row.off_us, row.reset_us) = (latest(row.off_us, "off_us"), latest(row.reset_us, "reset_us"));
        row.cases += 1;
        self.cases += 1;
        if case["good"] != true {
            row.wrong += 1;
            self.wrong += 1;
            let why = case["why"].as_str().unwrap_or("no reason");
            match (name, &case["seed"]) {
                // One of each row is enough, for many are alike.
                (Some(name), _) => {
                    if row.why.is_empty() {
                        row.why.push(format!("{name}, {state}, phase {}: {why}", case["phase"]));
                    }
                }
                (None, seed) => row.why.push(format!("{why}\n  again: cargo xtask campaign --several 1 --seed {seed}")),
            }
        }
    }
}

impl std::fmt::Display for Table {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let ms = |us: Option<f64>| us.map_or_else(|| "-".to_owned(), |us| format!("{:.1}", us * 1e-3));
        writeln!(f, "| fault | states | cases | wrong | outputs off, ms | reset, ms |\n|---|---|---|---|---|---|")?;
        let mut notes = String::new();
        for Row { name, states, cases, wrong, off_us, reset_us, why } in &self.rows {
            let states = states.join(", ");
            writeln!(f, "| {name} | {states} | {cases} | {wrong} | {} | {} |", ms(*off_us), ms(*reset_us))?;
            for why in why {
                writeln!(notes, "wrong: {why}")?;
            }
        }
        writeln!(f, "\n{} cases, {} wrong, {:.0} s", self.cases, self.wrong, self.seconds)?;
        f.write_str(&notes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_of_a_register_are_one_row() {
        let mut table = Table::default();
        for line in [
            r#"{"type":"case","name":"a panic","state":"walking","phase":0,"good":true,"why":null,"off_us":180.5,"reset_us":1500.0}"#,
            r#"{"type":"case","name":"TIM1 ARR, bit 0","state":"walking","phase":0,"good":true,"why":null,"off_us":60.0,"reset_us":null}"#,
            r#"{"type":"case","name":"TIM1 ARR, bit 1","state":"walking","phase":7,"good":false,"why":"outputs off never","off_us":null,"reset_us":null}"#,
        ] {
            table.add(&serde_json::from_str(line).unwrap());
        }
        table.add(
            &serde_json::from_str(
                r#"{"type":"several","seed":17,"state":"arming","good":false,"why":"PE9 at 1 s: 90 us","faults":[]}"#,
            )
            .unwrap(),
        );
        assert!(!table.is_complete);
        table.add(&serde_json::from_str(r#"{"type":"end","cases":4,"wrong":2,"seconds":2.4}"#).unwrap());
        let text = table.to_string();
        for line in [
            "| a panic | walking | 1 | 0 | 0.2 | 1.5 |",
            "| TIM1 ARR | walking | 2 | 1 | 0.1 | - |",
            "4 cases, 2 wrong, 2 s",
            "wrong: TIM1 ARR, bit 1, walking, phase 7: outputs off never",
            "wrong: PE9 at 1 s: 90 us\n  again: cargo xtask campaign --several 1 --seed 17",
        ] {
            assert!(text.contains(line), "{text}");
        }
        assert!(table.is_complete && text.find("a panic") < text.find("TIM1 ARR"));
    }
}
