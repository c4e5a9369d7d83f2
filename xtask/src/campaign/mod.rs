//! `cargo xtask campaign`: injects faults into the flashed image on the virtual board, and prints what each led to.

mod page;
mod table;

use std::io::BufRead as _;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::board::{Board, Variant};
use crate::probe::Sector;
use crate::record;
use crate::setup::Need;
use crate::shell;
use crate::workspace::Workspace;
use table::Table;

/// The campaign that is run without an option.
const FAULTS: &str = "tests/campaign/faults.toml";
/// Runs of it in which faults are injected; the generator of the last is [`FOLLOWER`].
const RUNS: [&str; 5] = ["walk", "trim", "untested", "crashes", "follower"];
/// Bits of the general registers of the core.
const REGISTERS: &str = "tests/campaign/registers.toml";
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
    /// The faults of another file of the project instead: bits of the general registers of the core, which are no part of the campaign
    #[arg(long, conflicts_with_all = ["faults", "several", "write"])]
    registers: bool,
    /// Frequency of the watchdog's oscillator, Hz [default: 32000]
    #[arg(long, value_name = "HZ", conflicts_with = "write")]
    lsi_hz: Option<u32>,
    /// Also run N of the cases each on its own, from power-on, and compare the processor time
    #[arg(long, value_name = "N", default_value_t = 0, conflicts_with_all = ["several", "only"])]
    alone: usize,
    /// Write what came of it, with the commit, to docs/campaign.md
    #[arg(long, conflicts_with_all = ["only", "several", "faults"])]
    write: bool,
    /// Write each case, a JSON object a line, to this file
    #[arg(long, value_name = "FILE")]
    cases: Option<PathBuf>,
}

/// Builds what is needed, runs the campaign, and prints its table.
pub(crate) fn campaign(options: &Options) -> Result<ExitCode> {
    let mut workspace = Workspace::open()?;
    workspace.set_up(&[Need::BoardCompiler, Need::VirtualBoard])?;
    let image = workspace.firmware(Board::F4Discovery, Variant::USUAL)?;
    let own = if options.registers { REGISTERS } else { FAULTS };
    let faults = options.faults.as_ref().map_or_else(|| PathBuf::from(own), |file| workspace.started_in.join(file));
    let board = CampaignBoard::new(&workspace)?;
    let command_for = |run: &str| {
        let mut command = board.command(&image.elf, &faults, run);
        command.args(options.lsi_hz.iter().flat_map(|hz| ["--lsi-hz".to_owned(), hz.to_string()]));
        command
    };
    let (mut table, mut kept) = (Table::default(), String::new());
    for run in RUNS {
        let mut command = command_for(run);
        command.args(["--every", &options.every.to_string()]);
        command.args(options.only.iter().flat_map(|only| ["--only", only]));
        if let Some(several) = options.several {
            command.args(["--several", &several.to_string(), "--seed", &options.seed.to_string()]);
        }
        eprintln!("run: {run}");
        take_cases(&mut command, &mut table, &mut kept)?;
    }
    if let Some(file) = &options.cases {
        let path = workspace.started_in.join(file);
        std::fs::write(&path, &kept).with_context(|| format!("writing {}", path.display()))?;
    }
    print!("{table}");
    if options.several.is_some() {
        println!("seed {}", options.seed);
    }
    if options.alone > 0 {
        println!("{}", alone(options.alone, &kept, command_for)?);
    }
    if options.write {
        page::write(&table, options.every)?;
    }
    Ok(if table.wrong == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// What the virtual board needs for a campaign besides the image.
struct CampaignBoard {
    virtual_board: PathBuf,
    robot: PathBuf,
    follower: PathBuf,
}

impl CampaignBoard {
    fn new(workspace: &Workspace) -> Result<Self> {
        let robot = record::path_of(workspace, Sector::Robot);
        record::pack_default_robot(workspace, &robot)?;
        let follower = record::path_of(workspace, Sector::Generator);
        record::pack(workspace, &[std::path::absolute(FOLLOWER)?.into()], &follower)?;
        Ok(Self { virtual_board: workspace.virtual_board()?, robot, follower })
    }

    fn command(&self, elf: &Path, faults: &Path, run: &str) -> Command {
        let mut command = shell::command(self.virtual_board.clone());
        command.arg(elf).args(["--loop", "--volts", VOLTS]);
        command.arg("--flash").arg(flashed(Sector::Robot, &self.robot));
        if run == "follower" {
            command.arg("--flash").arg(flashed(Sector::Generator, &self.follower));
        }
        command.arg("--campaign").arg(faults).args(["--run", run]);
        command
    }
}

/// Runs the faults whose name contains a text on another image: how many cases, and how many of them are wrong.
pub(crate) fn of_image(workspace: &Workspace, elf: &Path, only: &str) -> Result<(usize, usize)> {
    let board = CampaignBoard::new(workspace)?;
    let (mut table, mut kept) = (Table::default(), String::new());
    for run in RUNS {
        let mut command = board.command(elf, Path::new(FAULTS), run);
        take_cases(command.args(["--only", only]), &mut table, &mut kept)?;
    }
    let cases = kept.lines().filter(|line| line.contains("\"type\":\"case\"")).count();
    Ok((cases, table.wrong as usize))
}

/// Runs some of the faults each from power-on in a process of its own, one case of each, and compares their processor time with that of the same cases
/// as copies.
fn alone(count: usize, kept: &str, command_for: impl Fn(&str) -> Command) -> Result<String> {
    let mut names: Vec<String> = Vec::new();
    for line in kept.lines() {
        let case: Value = serde_json::from_str(line).context("a line of a campaign")?;
        // A name that is part of another one chooses both.
        if let Some(name) = case["name"].as_str().filter(|name| !names.iter().any(|known| known == name)) {
            names.push(name.to_owned());
        }
    }
    let unique: Vec<&String> =
        names.iter().filter(|name| names.iter().filter(|other| other.contains(name.as_str())).count() == 1).collect();
    let step = unique.len().div_ceil(count).max(1);
    let (mut boots, mut copies) = (Table::default(), String::new());
    for name in unique.into_iter().step_by(step) {
        for run in RUNS {
            let mut command = command_for(run);
            command.args(["--jobs", "1", "--every", "1000000", "--only", name]);
            take_cases(&mut command, &mut boots, &mut copies)?;
        }
    }
    Ok(boots.alone())
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
