//! The self-test of the Cortex-M4F core (exceptions, FPU frames, IT blocks, exclusive access) on the virtual board and on QEMU:
//! two independent emulators that must both pass, and faults on purpose that must not.
//!
//! The self-test ends by semihosting, with status 0 or the number of the first check that failed.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;

use crate::shell::{self, Ended};

/// Parts of the exception model that the virtual board leaves out for `--break`: each is a trap of its emulator that had to be closed.
pub(crate) const FAULTS: [&str; 3] = ["no-fpu-frame", "no-clrex", "stale-flags"];

/// The test takes a fraction of a second; a core that is broken may spin for ever.
const DEADLINE: Duration = Duration::from_secs(60);

/// The program and where its output is kept.
#[derive(Debug)]
pub(crate) struct SelfTest<'a> {
    pub(crate) elf: &'a Path,
    pub(crate) log: PathBuf,
}

impl SelfTest<'_> {
    /// On QEMU's STM32F405, whose core and interrupt controller are complete (its peripherals are not).
    pub(crate) fn on_qemu(&self) -> Result<String> {
        let mut qemu = shell::command("qemu-system-arm");
        qemu.args(["-machine", "netduinoplus2", "-nographic", "-monitor", "none", "-serial", "none"]);
        qemu.args(["-semihosting-config", "enable=on,target=native", "-kernel"]).arg(self.elf);
        let ended = shell::with_deadline(&mut qemu, DEADLINE, &self.log)?;
        if !ended.success() {
            bail!("the self-test fails on QEMU ({}: the number of the check)\n{}", ended.how(), ended.tail(20));
        }
        Ok("status 0".to_owned())
    }

    /// On the virtual board as it is.
    pub(crate) fn on_virtual_board(&self, virtual_board: &Path) -> Result<String> {
        let ended = self.run(virtual_board, None)?;
        let verdict = verdict(&ended)?;
        ensure!(ended.success() && verdict == Verdict::Passed, "the self-test fails: {verdict}\n{}", ended.tail(20));
        Ok("status 0".to_owned())
    }

    /// On a virtual board that was broken on purpose, where passing would be the failure. How the fault was noticed.
    pub(crate) fn notices(&self, virtual_board: &Path, fault: &str) -> Result<String> {
        let ended = self.run(virtual_board, Some(fault))?;
        let verdict = verdict(&ended)?;
        ensure!(
            !ended.success() && verdict != Verdict::Passed,
            "--break {fault}: the self-test passes on a broken core"
        );
        Ok(verdict.to_string())
    }

    fn run(&self, virtual_board: &Path, fault: Option<&str>) -> Result<Ended> {
        let mut command = shell::command(virtual_board);
        command.args(["--self-test-exit", "semihosting", "--secs", "5"]);
        if let Some(fault) = fault {
            command.args(["--break", fault]);
        }
        shell::with_deadline(command.arg(self.elf), DEADLINE, &self.log)
    }
}

/// What the virtual board's last line tells.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Verdict {
    Passed,
    /// This check failed.
    Check(u64),
    /// It did not reach its end: `lockup`, `time`, ...
    Lost(String),
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Verdict::Passed => f.write_str("it passed"),
            Verdict::Check(number) => write!(f, "check {number} failed"),
            Verdict::Lost(reason) => write!(f, "it did not reach its end ({reason})"),
        }
    }
}

/// Without an `end` line the virtual board itself has failed, which is no verdict on anything.
fn verdict(ended: &Ended) -> Result<Verdict> {
    let mut lines = ended.said.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let end = lines.rfind(|line| line["type"] == "end");
    let end = end.with_context(|| format!("the virtual board told of no end ({})\n{}", ended.how(), ended.tail(20)))?;
    let reason = end["reason"].as_str().context("the virtual board's end has no reason")?;
    match (reason, end["status"].as_u64()) {
        ("semihosting", Some(0)) => Ok(Verdict::Passed),
        ("semihosting", Some(check)) => Ok(Verdict::Check(check)),
        (reason, _) => Ok(Verdict::Lost(reason.to_owned())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(said: &str) -> Ended {
        Ended { status: None, said: said.to_owned() }
    }

    #[test]
    fn the_last_line_is_the_verdict() {
        let end = |rest: &str| said(&format!("{{\"type\":\"boot\"}}\n{{\"type\":\"end\",{rest}}}\n"));
        assert_eq!(verdict(&end(r#""reason":"semihosting","status":0"#)).unwrap(), Verdict::Passed);
        assert_eq!(verdict(&end(r#""reason":"semihosting","status":9"#)).unwrap(), Verdict::Check(9));
        assert_eq!(verdict(&end(r#""reason":"lockup""#)).unwrap(), Verdict::Lost("lockup".to_owned()));
    }

    #[test]
    fn a_board_that_could_not_start_gives_no_verdict() {
        let message = verdict(&said("virtual-board: no such file\n")).unwrap_err().to_string();
        assert!(message.contains("no such file"), "{message}");
        assert!(verdict(&said("{\"type\":\"boot\"}\n")).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn a_control_that_passes_is_a_failure() {
        use std::os::unix::fs::PermissionsExt;
        let folder = std::env::temp_dir().join(format!("xtask-selftest-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let board = folder.join("board");
        // Passes whatever is asked of it, but for one fault.
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
