//! Programs that need no peripheral: on the virtual board, with the lines that they print by semihosting.

use std::path::Path;
use std::time::Duration;

use anyhow::{Result, ensure};
use serde_json::Value;

use crate::shell;

/// The programs take seconds; a broken one may never end.
const DEADLINE: Duration = Duration::from_secs(300);

/// Runs the program; its output is kept in the log.
pub(crate) fn lines(virtual_board: &Path, elf: &Path, log: &Path) -> Result<Vec<String>> {
    let mut command = shell::command(virtual_board);
    command.args(["--self-test-exit", "semihosting", "--secs", "60"]).arg(elf);
    let finished = shell::with_deadline(&mut command, DEADLINE, log)?;
    let program = elf.file_name().unwrap_or_default().display();
    ensure!(finished.success(), "{program} fails on the virtual board ({})\n{}", finished.how(), finished.tail(20));
    let lines = finished.output.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let texts = lines.filter(|line| line["type"] == "semihosting");
    Ok(texts.map(|line| line["text"].as_str().unwrap_or_default().to_owned()).collect())
}
