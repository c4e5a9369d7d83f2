//! `cargo xtask bench board`: what each part of the flashed image costs, in instructions and in modelled cycles of a Cortex-M4F.
//!
//! Each set-up is a run of the image on the virtual board, which writes what it executes; the program `board-cost` counts it. The numbers
//! go to `docs/performance.json` with `--write`, and from there to `docs/performance.md`.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};

use super::compared::{self, Counts};
use super::counted::row;
use super::{beside_c, page, pico, qemu};
use crate::board::{Board, Variant};
use crate::emulated::QEMU;
use crate::setup::Need;
use crate::shell;
use crate::workspace::{C_COMPILER, Workspace};

/// Options of `cargo xtask bench board`.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct Options {
    /// One JSON object instead of the page
    #[arg(long)]
    json: bool,
    /// Virtual seconds of walking in each set-up, at least those that `cargo xtask test` compares
    #[arg(long, default_value_t = 60, value_parser = clap::value_parser!(u64).range(compared::SECS..=3600))]
    secs: u64,
    /// Only the comparison with C; the other numbers are those of docs/performance.json
    #[arg(long, conflicts_with = "secs")]
    only_c: bool,
    /// Only the counts of QEMU, as --only-c
    #[arg(long, conflicts_with_all = ["secs", "only_c"])]
    only_qemu: bool,
    /// Write docs/performance.json and docs/performance.md
    #[arg(long, requires = "reason")]
    write: bool,
    /// Why the numbers changed; stands in both files
    #[arg(long, requires = "write", value_parser = clap::builder::NonEmptyStringValueParser::new())]
    reason: Option<String>,
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

/// A board that is measured beside the Discovery: its name on the page, its feature, and the clock of its core.
const OTHER_BOARD: (&str, Board, u64) = ("Black Pill, STM32F411", Board::BlackPillF411, 100_000_000);
/// Set-ups of it, by their places in [`SET_UPS`].
const OTHER_SET_UPS: [usize; 2] = [0, 4];

/// Interrupts that a walk has not.
const RARE: [&str; 3] = ["TIM1_BRK_TIM9", "EXTI9_5", "ADC"];
/// Virtual seconds of the run that has them: a wave at the synchronisation input, with an edge each millisecond, lost conversions, and the emergency
/// stop.
const RARE_SECS: u64 = 9;
/// Its options of the virtual board, but for the wave.
const RARE_OPTIONS: [&str; 12] = [
    "--adc-overrun",
    "4.5",
    "--adc-overrun",
    "5.7",
    "--adc-overrun",
    "6.9",
    "--adc-overrun",
    "8.1",
    "--emergency-stop",
    "0.05:0.03",
    "--emergency-stop",
    "8.5",
];
/// The run takes seconds.
const RARE_DEADLINE: Duration = Duration::from_secs(120);

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
    let only_a_part = options.only_c || options.only_qemu;
    ensure!(
        !options.write || shell::on_path(C_COMPILER).is_some(),
        "no {C_COMPILER} on the path, so the page would lose its comparison with C; Debian has it in gcc-arm-none-eabi. Without --write the other \
         numbers are printed"
    );
    ensure!(
        !options.write || only_a_part || shell::on_path("node").is_some(),
        "no node on the path, so the page would lose the Pico; Debian has it in nodejs and npm. Without --write the other numbers are printed"
    );
    ensure!(
        !options.write || options.only_c || shell::on_path(QEMU).is_some(),
        "no {} on the path, so the page would lose its counts; Debian has it in a package of this name. Without --write the other numbers are printed",
        QEMU
    );
    let mut workspace = Workspace::open()?;
    workspace.set_up(&[Need::BoardCompiler, Need::VirtualBoard])?;
    let (virtual_board, board_cost) = (workspace.virtual_board()?, workspace.board_cost()?);
    let folder = workspace.target_dir.join("bench");
    std::fs::create_dir_all(&folder).with_context(|| format!("making {}", folder.display()))?;
    let (mut result, mut counts) = if only_a_part {
        let before = compared::baseline()?;
        let counts = Counts::of(&before)?;
        (before, counts)
    } else {
        let programs = Programs {
            elf: workspace.firmware(Board::F4Discovery, Variant::USUAL)?.elf,
            virtual_board: virtual_board.clone(),
            footfall: workspace.footfall()?,
            board_cost: board_cost.clone(),
            folder: folder.clone(),
        };
        let mut counts = Counts::default();
        let mut measured = measure(&programs, options.secs, &mut counts)?;
        let other = other_board(&workspace, &programs, options.secs, &mut counts)?;
        measured["boards"] = json!([other, pico::measure(&mut workspace)?]);
        (measured, counts)
    };
    let reason = options.reason.clone().map(Value::from);
    result["reason"] = reason.or_else(|| Some(compared::baseline().ok()?["reason"].clone())).unwrap_or(Value::Null);
    if !options.only_qemu {
        result["beside_c"] = beside_c::measure(&virtual_board, &board_cost, &workspace.beside_c()?, &folder)?;
    }
    if !options.only_c {
        result["qemu"] = qemu::measure(&workspace, &virtual_board, &board_cost, &folder)?;
    }
    for by in [&result["beside_c"]["rust_compiler"], &result["qemu"]["compiler"]] {
        let others = &result["compiler"];
        ensure!(
            by.is_null() || by == others,
            "the steps are by {by}, the other numbers by {others}: measure all, without --only-c and --only-qemu"
        );
    }
    counts.beside_c(&result["beside_c"])?;
    result["compared"] = json!({ "secs": compared::SECS, "instructions": counts.0 });
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

/// Compares an image with docs/performance.json ([`Counts`]): what was compared, or why nothing was, since another compiler makes other instructions.
pub(crate) fn compare(workspace: &Workspace, elf: &Path, virtual_board: &Path, footfall: &Path) -> Result<String> {
    let baseline = compared::baseline()?;
    if let Some(why) = compared::not_comparable(&baseline, elf)? {
        return Ok(format!("instructions not compared: {why}"));
    }
    let mut before = Counts::of(&baseline)?;
    let programs = Programs {
        elf: elf.to_owned(),
        virtual_board: virtual_board.to_owned(),
        footfall: footfall.to_owned(),
        board_cost: workspace.board_cost()?,
        folder: workspace.target_dir.join("bench"),
    };
    std::fs::create_dir_all(&programs.folder).with_context(|| format!("making {}", programs.folder.display()))?;
    let mut counts = Counts::default();
    measure(&programs, compared::SECS, &mut counts)?;
    other_board(workspace, &programs, compared::SECS, &mut counts)?;
    let steps = workspace.beside_c()?;
    let beside_c = beside_c::measure(&programs.virtual_board, &programs.board_cost, &steps, &programs.folder)?;
    counts.beside_c(&beside_c)?;
    let mut without = String::new();
    if beside_c.is_null() {
        before.forget_beside_c();
        without = format!(", without the steps beside C: no {C_COMPILER}");
    }
    let differences = before.differences(&counts);
    ensure!(
        differences.is_empty(),
        "not as in {}, from which a count may differ by {} %:\n{}\nIf that is meant: {}",
        page::JSON,
        compared::MARGIN_PERCENT,
        differences.join("\n"),
        compared::HOW_TO_WRITE
    );
    Ok(format!("instructions of {} parts{without}", before.0.len()))
}

fn measure(programs: &Programs, secs: u64, counts: &mut Counts) -> Result<Value> {
    let (mut set_ups, mut kinds) = (Vec::new(), Vec::new());
    let mut head = json!({});
    for (place, set_up) in SET_UPS.iter().enumerate() {
        eprintln!("bench: {} ({} of {})", set_up.name, place + 1, SET_UPS.len());
        let trace = programs.folder.join("trace.bin");
        let end = programs.run(set_up, secs, &trace)?;
        let counted = programs.count(&trace, secs, &["--image"])?;
        let first = programs.first(&trace, secs, &counted)?;
        if let Some(kind) = set_up.kind {
            kinds.push(json!({ "kind": kind, "cost": row(&counted, GENERATE)? }));
            counts.add(&format!("generator {kind}"), row(&first, GENERATE)?)?;
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
            let rows = |counted: &Value| counted["rows"].as_array().cloned().context("board-cost lists no parts");
            for (first, whole) in rows(&first)?.iter().zip(rows(&counted)?) {
                ensure!(first["part"] == whole["part"], "{}: the first seconds have other parts", set_up.name);
                counts.add_part(set_up.name, first, &whole)?;
            }
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
        "rare_interrupts": rare_interrupts(programs, counts)?,
    });
    if let (Some(result), Some(head)) = (result.as_object_mut(), head.as_object_mut()) {
        result.append(head);
    }
    Ok(result)
}

/// The rows of the interrupts that a walk has not.
fn rare_interrupts(programs: &Programs, counts: &mut Counts) -> Result<Value> {
    eprintln!("bench: interrupts that a walk has not");
    let wave = programs.folder.join("edges.csv");
    let edges = (FROM_MS..RARE_SECS * 1000).map(|ms| format!("{:.4},{}\n", ms as f64 / 1000.0 + 0.000_25, ms % 2));
    let text = "time_s,level\n".to_owned() + &edges.collect::<String>();
    std::fs::write(&wave, text).with_context(|| format!("writing {}", wave.display()))?;
    let trace = programs.folder.join("trace.bin");
    let mut run = programs.watch(RARE_SECS);
    run.arg("--").args(RARE_OPTIONS).arg("--edges").arg(format!("PC6={}", wave.display()));
    run.arg("--trace-execution").arg(&trace);
    // The walk ends with the emergency stop, which `watch` takes for a failure.
    let finished = shell::with_deadline(&mut run, RARE_DEADLINE, &programs.folder.join("rare.log"))?;
    let mut lines = finished.output.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let end = lines.rfind(|line| line["type"] == "end").unwrap_or_default();
    let walked = end["has_armed"] == true && end["cause"] == "break_input";
    ensure!(walked, "the emergency stop does not end the walk\n{}", finished.tail(20));
    let counted = programs.count(&trace, RARE_SECS, &[])?;
    std::fs::remove_file(&trace).with_context(|| format!("removing {}", trace.display()))?;
    let mut rows = Vec::new();
    for name in RARE {
        let part = format!("interrupt: {name}");
        let row = row(&counted, &part)?;
        counts.add(&part, row)?;
        rows.push(row.clone());
    }
    Ok(rows.into())
}

/// A tick of the other board of the family, in two set-ups, and its image.
fn other_board(workspace: &Workspace, discovery: &Programs, secs: u64, counts: &mut Counts) -> Result<Value> {
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
        let first = programs.first(&trace, secs, &counted)?;
        std::fs::remove_file(&trace).with_context(|| format!("removing {}", trace.display()))?;
        let tick = row(&counted, "tick")?;
        counts.add(&format!("{name}: {}: tick", set_up.name), row(&first, "tick")?)?;
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

    /// The counts of the first [`compared::SECS`] of a run, of which `counted` has the first `secs`.
    fn first(&self, trace: &Path, secs: u64, counted: &Value) -> Result<Value> {
        if secs == compared::SECS { Ok(counted.clone()) } else { self.count(trace, compared::SECS, &[]) }
    }

    fn count(&self, trace: &Path, secs: u64, more: &[&str]) -> Result<Value> {
        let mut count = shell::command(&self.board_cost);
        count.arg("--elf").arg(&self.elf).arg("--trace").arg(trace);
        count.args(["--from-ms", &FROM_MS.to_string(), "--for-ms", &(secs * 1000).to_string()]).args(more);
        let text = shell::stdout_of(&mut count)?;
        serde_json::from_str(&text).context("reading the output of board-cost")
    }
}
