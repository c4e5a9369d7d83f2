//! What a run of the image on the virtual board used, from the last line of `footfall watch --json`.

use anyhow::{Context, Result, ensure};
use serde::Deserialize;

/// Numbers of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub struct Run {
    /// Ticks of the run.
    pub ticks: u64,
    /// Ticks that began late.
    pub late_ticks: u64,
    /// Control periods without a tick.
    pub missed_ticks: u64,
    /// Load and reserves by the board.
    pub cost: Cost,
}

/// Load and reserves by the board.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub struct Cost {
    /// Longest tick. The virtual board counts one cycle an instruction.
    pub longest_cycles: u64,
    /// Deepest stack, bytes.
    pub stack_used: u64,
    /// Size of the stack, bytes.
    pub stack_size: u64,
    /// Servo pulses that were cut short.
    pub truncated: u64,
}

impl Run {
    /// Reads the lines of `footfall watch --json`.
    ///
    /// # Errors
    ///
    /// When the last line is not the end of a run, or no tick ran.
    pub fn parse(lines: &str) -> Result<Self> {
        let last = lines.lines().rfind(|line| !line.trim().is_empty()).context("the run has no lines")?;
        let run: Self = serde_json::from_str(last).context("the last line of the run is not its end")?;
        ensure!(run.ticks > 0, "no tick ran");
        Ok(run)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_without_its_end_is_refused() {
        let end = r#"{"type":"end","ticks":9,"late_ticks":1,"missed_ticks":2,
            "cost":{"longest_cycles":3,"stack_used":4,"stack_size":5,"truncated":6,"dropped":0}}"#
            .replace('\n', "");
        let run = Run::parse(&format!("{{\"type\":\"boot\"}}\n{end}\n")).unwrap();
        assert_eq!((run.ticks, run.cost.longest_cycles, run.cost.truncated), (9, 3, 6));
        assert!(Run::parse("{\"type\":\"boot\"}\n").is_err());
        assert!(Run::parse("").is_err());
        assert!(Run::parse(&end.replace("\"ticks\":9", "\"ticks\":0")).is_err());
    }
}
