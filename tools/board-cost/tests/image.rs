//! The cost of the flashed image, from a run on the virtual board.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use board_cost::flash::Prefetched;
use board_cost::program::Program;
use board_cost::replay::{Interrupts, Options, Replay};
use board_cost::statistics::Row;
use board_cost::trace;
use serde_json::Value;
use test_suite::{report, tests};

fn main() -> ExitCode {
    test_suite::run(tests![
        the_firmware_counts_the_same_instructions(Image, Program),
        each_part_of_the_tick_has_a_cost(Image, Program),
        the_trace_of_another_image_is_refused(Image, ShadowImage, Program),
    ])
}

/// Instructions of a function before its stopwatch starts and after it stops, at most: it saves and restores registers.
const AROUND_THE_STOPWATCH: u64 = 60;
const CONTROL_STEP: &str = "firmware::tasks::control::control_step";

fn path(variable: &str) -> PathBuf {
    std::env::var_os(variable).expect(variable).into()
}

/// Runs the image for some virtual seconds; the last line.
fn run(trace: Option<&Path>) -> Value {
    let mut run = Command::new(path("FOOTFALL_BIN"));
    run.args(["watch", "--json", "--secs", "5", "--elf"]).arg(path("FOOTFALL_ELF"));
    run.arg("--virtual-board").arg(path("FOOTFALL_VIRTUAL_BOARD"));
    if let Some(trace) = trace {
        run.args(["--", "--trace-execution"]).arg(trace);
    }
    let output = run.output().expect("footfall runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("text");
    serde_json::from_str(text.lines().last().expect("a line")).expect("the end of the run")
}

/// Follows a trace of an image.
fn follow(image: &str, trace: &Path, options: Options) -> anyhow::Result<Vec<Row>> {
    let elf = std::fs::read(path(image)).expect("the image");
    let program = Program::parse(&elf)?;
    let mut replay = Replay::new(&program, Interrupts::of_firmware(), options)?;
    trace::read(File::open(trace).expect("the trace"), |event| replay.take(event))?;
    replay.finish()
}

/// The firmware measures its tick with the cycle counter, which on the virtual board counts instructions; and the trace changes no bit of the run.
fn the_firmware_counts_the_same_instructions() {
    let folder = tempfile::tempdir().expect("a folder");
    let trace = folder.path().join("trace.bin");
    let (with, without) = (run(Some(&trace)), run(None));
    assert_eq!(with["setpoint_hash"], without["setpoint_hash"]);
    assert_eq!((&with["cost"], &with["ticks"]), (&without["cost"], &without["ticks"]));
    let options = Options { functions: vec![CONTROL_STEP.to_owned()], ..Options::default() };
    let rows = follow("FOOTFALL_ELF", &trace, options).expect("a trace of this image");
    let stopwatch = with["cost"]["longest_cycles"].as_u64().expect("a number");
    let longest = rows[0].instructions.max;
    report!("longest control step: {stopwatch} instructions by the stopwatch, {longest} with what is around it");
    assert!((stopwatch..=stopwatch + AROUND_THE_STOPWATCH).contains(&longest), "{stopwatch} {longest}");
}

/// The stages are the whole tick, and with slower flash it is slower. Prefetched lines in the cache spare waits and take the place of others: what the
/// manual leaves open changes little, in either direction.
fn each_part_of_the_tick_has_a_cost() {
    let folder = tempfile::tempdir().expect("a folder");
    let trace = folder.path().join("trace.bin");
    run(Some(&trace));
    let options = Options { from_ms: 3500, for_ms: Some(1000), ..Options::default() };
    let rows = follow("FOOTFALL_ELF", &trace, options.clone()).expect("a trace of this image");
    let row = |rows: &[Row], part: &str| rows.iter().find(|row| row.part == part).expect("a part").clone();
    let tick = row(&rows, "tick");
    assert!((998..=1000).contains(&tick.count), "{}", tick.count);
    let stages: Vec<&Row> = rows.iter().filter(|row| row.part.starts_with("tick: ")).collect();
    let least: u64 = stages.iter().map(|row| row.instructions.min).sum();
    let most: u64 = stages.iter().map(|row| row.instructions.max).sum();
    assert!(least <= tick.instructions.min && tick.instructions.max <= most, "{least} {tick:?} {most}");
    assert!(stages.iter().all(|row| row.instructions.median > 0 && row.cycles.median > row.instructions.median));
    let cached = Options { prefetched: Prefetched::Cached, ..options.clone() };
    let slower = Options { flash: Some(board_cost::flash::Control::of(0x7)), ..options };
    let median = |options| row(&follow("FOOTFALL_ELF", &trace, options).expect("followed"), "tick").cycles.median;
    let (cached, slower) = (median(cached), median(slower));
    assert!(tick.cycles.median < slower, "{tick:?} {slower}");
    assert!(
        cached != tick.cycles.median && cached.abs_diff(tick.cycles.median) * 20 < tick.cycles.median,
        "{cached} {tick:?}"
    );
}

fn the_trace_of_another_image_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let trace = folder.path().join("trace.bin");
    run(Some(&trace));
    assert!(follow("FOOTFALL_SHADOW_ELF", &trace, Options::default()).is_err());
}
