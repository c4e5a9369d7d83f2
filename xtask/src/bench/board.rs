//! `cargo xtask bench board`: what each part of the flashed image costs, in instructions and in modelled cycles of a Cortex-M4F.
//!
//! Each set-up is a run of the image on the virtual board, which writes what it executes; the program `board-cost` counts it. The numbers
//! go to `docs/performance.json` with `--write`, and from there to `docs/performance.md`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};

use super::counted::row;
use super::{beside_c, page};
use crate::board::{Board, Drive};
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
    /// Only the comparison with C; the other numbers are those of docs/performance.json
    #[arg(long, conflicts_with = "secs")]
    only_c: bool,
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
/// The first set-ups have a table of all parts.
const WITH_TABLE: usize = 5;

/// Virtual milliseconds from power-on to the count: the board is armed after 0.6 s, and walks with its whole amplitude 2 s later.
const FROM_MS: u64 = 4000;
/// Of the chip, while it walks.
const HCLK_HZ: u64 = 168_000_000;
/// Control periods a second.
const TICKS_HZ: u64 = 1000;
/// The stage in which the kinds of generators differ.
const GENERATE: &str = "tick: generate";

/// The programs that a run needs.
struct Programs {
    elf: PathBuf,
    virtual_board: PathBuf,
    footfall: PathBuf,
    board_cost: PathBuf,
    folder: PathBuf,
}

/// Runs the bench.
pub(crate) fn bench(options: &Options) -> Result<()> {
    let mut workspace = Workspace::open()?;
    workspace.set_up(&[Need::BoardCompiler, Need::VirtualBoard])?;
    let programs = Programs {
        elf: workspace.firmware(Board::F4Discovery, Drive::Servos)?.elf,
        virtual_board: workspace.virtual_board()?,
        footfall: workspace.footfall()?,
        board_cost: workspace.board_cost()?,
        folder: workspace.target_dir.join("bench"),
    };
    std::fs::create_dir_all(&programs.folder).with_context(|| format!("making {}", programs.folder.display()))?;
    let beside_c = workspace.beside_c()?;
    let mut result = if options.only_c {
        let before = std::fs::read_to_string(page::JSON).with_context(|| format!("reading {}", page::JSON))?;
        serde_json::from_str(&before).with_context(|| format!("reading {}", page::JSON))?
    } else {
        measure(&programs, options.secs)?
    };
    result["beside_c"] = beside_c::measure(&programs.virtual_board, &programs.board_cost, &beside_c, &programs.folder)?;
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
            kinds.push(json!({ "kind": kind, "cost": row(&counted, GENERATE)? }));
        }
        if place == 0 {
            let other = programs.count(&trace, secs, &["--cache-prefetched"])?;
            let mut image = counted["image"].clone();
            image["stack_used_bytes"] = end["cost"]["stack_used"].clone();
            image["stack_bytes"] = end["cost"]["stack_size"].clone();
            head = json!({
                "compiler": counted["compiler"],
                "image": image,
                "tick_if_prefetched_lines_are_cached": row(&other, "tick")?["cycles"],
            });
        }
        if place < WITH_TABLE {
            let ticks = secs * TICKS_HZ;
            let cycles = counted["cycles"].as_u64().context("no cycles")? as f64;
            let load = cycles / (ticks * (HCLK_HZ / TICKS_HZ)) as f64;
            set_ups.push(json!({
                "name": set_up.name,
                "late_ticks": end["late_ticks"],
                "missed_ticks": end["missed_ticks"],
                "load_percent": (load * 1e3).round() / 10.0,
                "rows": counted["rows"],
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

impl Programs {
    /// Runs a set-up; returns the last line of the run.
    fn run(&self, set_up: &SetUp, secs: u64, trace: &Path) -> Result<Value> {
        let mut run = shell::command(&self.footfall);
        run.args(["watch", "--json", "--elf"]).arg(&self.elf).arg("--virtual-board").arg(&self.virtual_board);
        run.arg("--secs").arg((FROM_MS / 1000 + secs + 1).to_string()).args(set_up.options);
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
