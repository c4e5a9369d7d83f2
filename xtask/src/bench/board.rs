//! `cargo xtask bench board`: what each part of the flashed image costs, in instructions and in modelled cycles of a Cortex-M4F.
//!
//! Each set-up is a run of the image on the virtual board, which writes what it executes; the program `board-cost` counts it. The numbers
//! go to `docs/performance.json` with `--write`, and from there to `docs/performance.md`.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};

use super::{page, pico};
use crate::board::{Board, Variant};
use crate::setup::Need;
use crate::shell;
use crate::workspace::Workspace;

/// Options of `cargo xtask bench board`.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct Options {
    /// One JSON object instead of the page
    #[arg(long)]
    json: bool,
    /// Virtual seconds of walking in each set-up
    #[arg(long, default_value_t = 60, value_parser = clap::value_parser!(u64).range(1..=3600))]
    secs: u64,
    /// Write docs/performance.json and docs/performance.md
    #[arg(long)]
    write: bool,
}

/// A run of the image.
struct SetUp {
    name: &'static str,
    /// Options of `footfall watch`.
    options: &'static [&'static str],
    /// A generator file that `footfall defaults` prints.
    printed: Option<&'static str>,
    /// Only the stage of the generator is of interest.
    kind: Option<&'static str>,
}

const FOUR: [&str; 8] =
    ["--sensor", "left_hip", "--sensor", "right_hip", "--sensor", "left_knee", "--sensor", "right_knee"];
const FOLLOWER: &str = "samples/follower.toml";

const SET_UPS: [SetUp; 7] = [
    SetUp { name: "default", options: &[], printed: None, kind: Some("phase-coupled (R1)") },
    SetUp { name: "thesis parameters", options: &[], printed: Some("thesis"), kind: Some("thesis") },
    SetUp { name: "four sensors", options: &FOUR, printed: None, kind: None },
    SetUp {
        name: "follower",
        options: &["--generator", FOLLOWER, "--sensor", "left_hip"],
        printed: None,
        kind: Some("follow"),
    },
    SetUp {
        name: "four sensors + follower",
        options: &[
            "--generator",
            FOLLOWER,
            "--sensor",
            "left_hip",
            "--sensor",
            "right_hip",
            "--sensor",
            "left_knee",
            "--sensor",
            "right_knee",
        ],
        printed: None,
        kind: None,
    },
    SetUp {
        name: "Fourier shape",
        options: &["--generator", "samples/generator.toml"],
        printed: None,
        kind: Some("shape"),
    },
    SetUp {
        name: "spline",
        options: &["--generator", "xtask/src/bench/spline.toml"],
        printed: None,
        kind: Some("spline"),
    },
];
/// The first set-ups have a row in the table of ticks.
const WITH_TICK: usize = 5;

/// A board that is measured beside the Discovery: its name on the page, its feature, and the clock of its core.
const OTHER_BOARD: (&str, Board, u64) = ("Black Pill, STM32F411", Board::BlackPillF411, 100_000_000);
/// Set-ups of it, by their places in [`SET_UPS`].
const OTHER_SET_UPS: [usize; 2] = [0, 4];

/// Virtual milliseconds from power-on to the count: the board is armed after 0.6 s, and walks with its whole amplitude 2 s later.
const FROM_MS: u64 = 4000;
/// Of the chip, while it walks.
const HCLK_HZ: u64 = 168_000_000;
/// Control periods a second.
const TICKS_HZ: u64 = 1000;
/// The stage in which the kinds of generators differ.
const GENERATE: &str = "tick: generate";

/// The programs that a run needs.
#[derive(Clone)]
struct Programs {
    elf: PathBuf,
    virtual_board: PathBuf,
    footfall: PathBuf,
    board_cost: PathBuf,
    folder: PathBuf,
}

/// Runs the bench.
pub(crate) fn bench(options: &Options) -> Result<()> {
    ensure!(
        !options.write || shell::on_path("node").is_some(),
        "no node on the path, so the page would lose the Pico; Debian has it in nodejs and npm. Without --write the other numbers are printed"
    );
    let mut workspace = Workspace::open()?;
    workspace.set_up(&[Need::BoardCompiler, Need::VirtualBoard])?;
    let folder = workspace.target_dir.join("bench");
    std::fs::create_dir_all(&folder).with_context(|| format!("making {}", folder.display()))?;
    let programs = Programs {
        elf: workspace.firmware(Board::F4Discovery, Variant::USUAL)?.elf,
        virtual_board: workspace.virtual_board()?,
        footfall: workspace.footfall()?,
        board_cost: workspace.board_cost()?,
        folder,
    };
    let mut result = measure(&programs, options.secs)?;
    let other = other_board(&workspace, &programs, options.secs)?;
    result["boards"] = json!([other, pico::measure(&mut workspace)?]);
    let text = serde_json::to_string_pretty(&result).context("writing the result")? + "\n";
    if options.write {
        for (file, text) in [(page::JSON, &text), (page::PAGE, &page::page(&result)?)] {
            std::fs::write(file, text).with_context(|| format!("writing {file}"))?;
            eprintln!("wrote {file}");
        }
    }
    print!("{}", if options.json { text } else { page::page(&result)? });
    Ok(())
}

fn measure(programs: &Programs, secs: u64) -> Result<Value> {
    let (mut set_ups, mut kinds) = (Vec::new(), Vec::new());
    let mut head = json!({});
    for (place, set_up) in SET_UPS.iter().enumerate() {
        eprintln!("bench: {} ({} of {})", set_up.name, place + 1, SET_UPS.len());
        let trace = programs.folder.join("trace.bin");
        let end = programs.run(set_up, secs, &trace)?;
        let counted = programs.count(&trace, secs, &["--image"])?;
        if let Some(kind) = set_up.kind {
            kinds.push(json!({ "kind": kind, "cost": page::part(&counted, GENERATE)? }));
        }
        if place == 0 {
            let mut image = counted["image"].clone();
            image["stack_used_bytes"] = end["cost"]["stack_used"].clone();
            image["stack_bytes"] = end["cost"]["stack_size"].clone();
            head = json!({ "compiler": counted["compiler"], "image": image });
        }
        if place < WITH_TICK {
            let ticks = secs * TICKS_HZ;
            let cycles = counted["cycles"].as_u64().context("no cycles")? as f64;
            let load = cycles / (ticks * (HCLK_HZ / TICKS_HZ)) as f64;
            set_ups.push(json!({
                "name": set_up.name,
                "late_ticks": end["late_ticks"],
                "missed_ticks": end["missed_ticks"],
                "load_percent": (load * 1e3).round() / 10.0,
                "rows": if place == 0 { counted["rows"].clone() } else { json!([page::part(&counted, "tick")?]) },
            }));
        }
        std::fs::remove_file(&trace).with_context(|| format!("removing {}", trace.display()))?;
    }
    let mut result = json!({
        "secs": secs,
        "hclk_hz": HCLK_HZ,
        "set_ups": set_ups,
        "generators": kinds,
    });
    if let (Some(result), Some(head)) = (result.as_object_mut(), head.as_object_mut()) {
        result.append(head);
    }
    Ok(result)
}

/// A tick of the other board of the family, in two set-ups, and its image.
fn other_board(workspace: &Workspace, discovery: &Programs, secs: u64) -> Result<Value> {
    let (name, board, hclk_hz) = OTHER_BOARD;
    let programs = Programs { elf: workspace.firmware(board, Variant::USUAL)?.elf, ..discovery.clone() };
    let mut ticks = Vec::new();
    let mut image = Value::Null;
    for place in OTHER_SET_UPS {
        let set_up = &SET_UPS[place];
        eprintln!("bench: {name}, {}", set_up.name);
        let trace = programs.folder.join("trace.bin");
        programs.run(set_up, secs, &trace)?;
        let counted = programs.count(&trace, secs, &["--image"])?;
        std::fs::remove_file(&trace).with_context(|| format!("removing {}", trace.display()))?;
        let tick = page::part(&counted, "tick")?;
        ticks.push(json!({ "set_up": set_up.name, "instructions": tick["instructions"], "cycles": tick["cycles"] }));
        image = counted["image"].clone();
    }
    Ok(json!({ "name": name, "hclk_hz": hclk_hz, "ticks": ticks, "image": image }))
}

impl Programs {
    /// `footfall watch` of the image for a time.
    fn watch(&self, secs: u64) -> Command {
        let mut watch = shell::command(&self.footfall);
        watch.args(["watch", "--json", "--elf"]).arg(&self.elf).arg("--virtual-board").arg(&self.virtual_board);
        watch.arg("--secs").arg(secs.to_string());
        watch
    }

    /// Runs a set-up; returns the last line of the run.
    fn run(&self, set_up: &SetUp, secs: u64, trace: &Path) -> Result<Value> {
        let mut run = self.watch(FROM_MS / 1000 + secs + 1);
        run.args(set_up.options);
        if let Some(printed) = set_up.printed {
            let text = shell::stdout_of(shell::command(&self.footfall).args(["defaults", printed]))?;
            let file = self.folder.join("generator.toml");
            std::fs::write(&file, text).with_context(|| format!("writing {}", file.display()))?;
            run.arg("--generator").arg(file);
        }
        run.args(["--", "--trace-execution"]).arg(trace);
        let lines = shell::stdout_of(&mut run).with_context(|| format!("running {}", set_up.name))?;
        let end: Value = serde_json::from_str(lines.lines().last().unwrap_or_default())
            .context("the last line of the run is not its end")?;
        ensure!(end["state"] == "walking", "{}: the board does not walk at the end of the run: {end}", set_up.name);
        Ok(end)
    }

    fn count(&self, trace: &Path, secs: u64, more: &[&str]) -> Result<Value> {
        let mut count = shell::command(&self.board_cost);
        count.arg("--elf").arg(&self.elf).arg("--trace").arg(trace);
        count.args(["--from-ms", &FROM_MS.to_string(), "--for-ms", &(secs * 1000).to_string()]).args(more);
        let text = shell::stdout_of(&mut count)?;
        serde_json::from_str(&text).context("reading the output of board-cost")
    }
}
