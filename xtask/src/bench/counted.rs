//! What `board-cost` prints, and its count of the functions of a program that needs no peripheral.

use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::shell;

/// FLASH_ACR as the firmware sets it: the programs set no clock.
const FLASH_ACR: &str = "0x705";
/// The programs take some seconds.
const DEADLINE: Duration = Duration::from_secs(120);

/// Runs the program on the virtual board, and counts the calls of the functions: its lines by semihosting, and the count.
pub(super) fn functions(
    virtual_board: &Path,
    board_cost: &Path,
    elf: &Path,
    folder: &Path,
    names: &[String],
    more: &[&str],
) -> Result<(Vec<Value>, Value)> {
    let program = elf.file_name().context("a program without a name")?.to_string_lossy();
    let trace = folder.join(format!("{program}.bin"));
    let mut run = shell::command(virtual_board);
    run.args(["--self-test-exit", "semihosting", "--secs", "60", "--trace-execution"]).arg(&trace).arg(elf);
    let finished = shell::with_deadline(&mut run, DEADLINE, &folder.join(format!("{program}.log")))?;
    ensure!(finished.success(), "{program} fails on the virtual board ({})\n{}", finished.how(), finished.tail(20));
    let lines = finished.output.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let lines = lines.filter(|line| line["type"] == "semihosting").collect();
    let mut count = shell::command(board_cost);
    count.arg("--elf").arg(elf).arg("--trace").arg(&trace).args(["--flash-acr", FLASH_ACR]).args(more);
    count.arg("--function").args(names);
    let counted = shell::stdout_of(&mut count);
    // It has a hundred megabytes.
    std::fs::remove_file(&trace).with_context(|| format!("removing {}", trace.display()))?;
    Ok((lines, serde_json::from_str(&counted?).context("reading the output of board-cost")?))
}

/// The row of a part.
pub(super) fn row<'a>(counted: &'a Value, part: &str) -> Result<&'a Value> {
    let rows = counted["rows"].as_array().context("board-cost lists no parts")?;
    rows.iter().find(|row| row["part"] == part).with_context(|| format!("board-cost lists no part `{part}`"))
}
