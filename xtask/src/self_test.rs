//! Runs the self-test of the Cortex-M4F core (exceptions, FPU frames, IT blocks, exclusive access) on the virtual board and on QEMU:
//! two independent emulators that must both pass. With a fault on purpose the virtual board must fail.
//!
//! The self-test ends by semihosting, with status 0 or the number of the first check that failed.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;

use crate::emulated;
use crate::shell::{self, Finished};

/// Parts of the exception model that the virtual board leaves out for `--break`: each is a known defect of its emulator that the board
/// corrects.
pub(crate) const FAULTS: [&str; 3] = ["no-fpu-frame", "no-clrex", "stale-flags"];

/// The test takes a fraction of a second; a broken core may never end.
const DEADLINE: Duration = Duration::from_secs(60);

/// The program and where its output is kept.
#[derive(Debug)]
pub(crate) struct SelfTest<'a> {
    pub(crate) elf: &'a Path,
    pub(crate) log: PathBuf,
}

impl SelfTest<'_> {
    /// On QEMU.
    pub(crate) fn on_qemu(&self) -> Result<String> {
        let mut qemu = emulated::qemu("");
        let finished = shell::with_deadline(qemu.arg("-kernel").arg(self.elf), DEADLINE, &self.log)?;
        if !finished.success() {
            bail!("the self-test fails on QEMU ({}: the number of the check)\n{}", finished.how(), finished.tail(20));
        }
        Ok("status 0".to_owned())
    }

    /// On the virtual board, unchanged.
    pub(crate) fn on_virtual_board(&self, virtual_board: &Path) -> Result<String> {
        let finished = self.run(virtual_board, None)?;
        let conclusion = conclusion(&finished)?;
        ensure!(
            finished.success() && conclusion == Conclusion::Passed,
            "the self-test fails: {conclusion}\n{}",
            finished.tail(20)
        );
        Ok("status 0".to_owned())
    }

    /// On a virtual board with a fault on purpose, where passing is the failure. Returns how the self-test ended.
    pub(crate) fn notices(&self, virtual_board: &Path, fault: &str) -> Result<String> {
        let finished = self.run(virtual_board, Some(fault))?;
        let conclusion = conclusion(&finished)?;
        ensure!(
            !finished.success() && conclusion != Conclusion::Passed,
            "--break {fault}: the self-test passes on a broken core"
        );
        Ok(conclusion.to_string())
    }

    fn run(&self, virtual_board: &Path, fault: Option<&str>) -> Result<Finished> {
        let mut command = shell::command(virtual_board);
        command.args(["--self-test-exit", "semihosting", "--secs", "5"]);
        if let Some(fault) = fault {
            command.args(["--break", fault]);
        }
        shell::with_deadline(command.arg(self.elf), DEADLINE, &self.log)
    }
}

/// How the self-test ended, from the virtual board's last line.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Conclusion {
    Passed,
    /// This check failed.
    Check(u64),
    /// It did not reach its end: `lockup`, `time`, ...
    Incomplete(String),
}

impl std::fmt::Display for Conclusion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Conclusion::Passed => f.write_str("it passed"),
            Conclusion::Check(number) => write!(f, "check {number} failed"),
            Conclusion::Incomplete(reason) => write!(f, "it did not reach its end ({reason})"),
        }
    }
}

/// Without an `end` line the virtual board itself has failed: then there is no conclusion.
fn conclusion(finished: &Finished) -> Result<Conclusion> {
    let mut lines = finished.output.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let end = lines.rfind(|line| line["type"] == "end");
    let end = end.with_context(|| {
        format!("the virtual board wrote no `end` line ({})\n{}", finished.how(), finished.tail(20))
    })?;
    let reason = end["reason"].as_str().context("the virtual board's `end` line has no reason")?;
    match (reason, end["status"].as_u64()) {
        ("semihosting", Some(0)) => Ok(Conclusion::Passed),
        ("semihosting", Some(check)) => Ok(Conclusion::Check(check)),
        (reason, _) => Ok(Conclusion::Incomplete(reason.to_owned())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn finished(output: &str) -> Finished {
        Finished { status: None, output: output.to_owned() }
    }

    #[test]
    fn the_last_line_gives_the_conclusion() {
        let end = |rest: &str| finished(&format!("{{\"type\":\"boot\"}}\n{{\"type\":\"end\",{rest}}}\n"));
        assert_eq!(conclusion(&end(r#""reason":"semihosting","status":0"#)).unwrap(), Conclusion::Passed);
        assert_eq!(conclusion(&end(r#""reason":"semihosting","status":9"#)).unwrap(), Conclusion::Check(9));
        assert_eq!(conclusion(&end(r#""reason":"lockup""#)).unwrap(), Conclusion::Incomplete("lockup".to_owned()));
    }

    #[test]
    fn a_board_that_does_not_start_has_no_conclusion() {
        let message = conclusion(&finished("virtual-board: no such file\n")).unwrap_err().to_string();
        assert!(message.contains("no such file"), "{message}");
        assert!(conclusion(&finished("{\"type\":\"boot\"}\n")).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn a_broken_core_that_passes_is_a_failure() {
        use std::os::unix::fs::PermissionsExt;
        let folder = std::env::temp_dir().join(format!("xtask-selftest-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let board = folder.join("board");
        // Passes always, except with one fault.
        let script = r#"#!/bin/sh
case "$*" in *no-clrex*) echo '{"type":"end","reason":"semihosting","status":9}'; exit 9;; esac
echo '{"type":"end","reason":"semihosting","status":0}'
"#;
        std::fs::write(&board, script).unwrap();
        std::fs::set_permissions(&board, std::fs::Permissions::from_mode(0o755)).unwrap();
        let test = SelfTest { elf: Path::new("any.elf"), log: folder.join("log") };
        let passes = test.on_virtual_board(&board);
        let noticed = test.notices(&board, "no-clrex");
        let missed = test.notices(&board, "stale-flags");
        std::fs::remove_dir_all(&folder).unwrap();
        assert!(passes.is_ok(), "{passes:?}");
        assert_eq!(noticed.unwrap(), "check 9 failed");
        assert!(missed.unwrap_err().to_string().contains("stale-flags"));
    }
}
