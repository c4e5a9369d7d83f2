//! Installs packages with `apt-get`: as root, without questions, and without removing any package.

use std::cell::Cell;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use crate::shell;

/// Age up to which package lists are used without an update: older ones may name files that the archive no longer has.
const LISTS_STAY_FRESH: Duration = Duration::from_secs(24 * 60 * 60);

/// `apt-get` on this computer.
#[derive(Debug)]
pub(crate) struct Apt {
    program: OsString,
    lists: PathBuf,
    updated: Cell<bool>,
}

/// What to do if a package cannot be installed with the present package lists.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Effort {
    /// Update the lists and try again.
    Required,
    /// The same, but only if the lists are older than a day.
    Optional,
}

impl Apt {
    /// `apt-get`, if it exists and this program runs as root.
    pub(crate) fn usable() -> Option<Apt> {
        let id = shell::stdout_of(shell::command("id").arg("-u")).ok()?;
        (shell::on_path("apt-get").is_some() && id.trim() == "0").then(|| Apt::new("apt-get", "/var/lib/apt/lists"))
    }

    fn new(program: impl Into<OsString>, lists: impl Into<PathBuf>) -> Apt {
        Apt { program: program.into(), lists: lists.into(), updated: Cell::new(false) }
    }

    /// Installs these packages.
    ///
    /// # Errors
    /// The reason in one line. Nothing was changed then, unless the network failed during the installation.
    pub(crate) fn install(&self, packages: &[&str], effort: Effort) -> Result<(), String> {
        if !has_package_lists(&self.lists) {
            self.update();
        }
        if let Err(reason) = self.simulate(packages) {
            let worthwhile = effort == Effort::Required || is_older_than(&self.lists, LISTS_STAY_FRESH);
            if self.updated.get() || !worthwhile {
                return Err(reason);
            }
            self.update();
            self.simulate(packages)?;
        }
        eprintln!("set-up: apt-get install --no-install-recommends {}", packages.join(" "));
        let run = || shell::must_succeed(&mut self.install_command(packages), "apt-get install");
        run()
            .or_else(|error| {
                if self.updated.get() {
                    return Err(error);
                }
                self.update();
                run()
            })
            .map_err(|error| format!("{error:#}; its message is above"))
    }

    /// Simulates the installation, without a change and without output.
    fn simulate(&self, packages: &[&str]) -> Result<(), String> {
        let mut command = self.install_command(packages);
        let output = command.arg("--simulate").stdin(std::process::Stdio::null()).output();
        let output = output.map_err(|error| format!("apt-get does not start: {error}"))?;
        if output.status.success() {
            return Ok(());
        }
        let errors = String::from_utf8_lossy(&output.stderr);
        Err(last_error(&errors).unwrap_or_else(|| format!("apt-get ended with {}", output.status)))
    }

    fn install_command(&self, packages: &[&str]) -> Command {
        let mut command = self.command();
        command.args(["install", "--no-install-recommends", "--no-remove"]).args(packages);
        command
    }

    /// Updates the package lists. A failure is only printed, because the installation after it fails too.
    fn update(&self) {
        self.updated.set(true);
        eprintln!("set-up: apt-get update");
        if let Err(error) = shell::must_succeed(self.command().arg("update"), "apt-get update") {
            eprintln!("set-up: {error:#}");
        }
    }

    fn command(&self) -> Command {
        let mut command = shell::command(&self.program);
        // Waits up to 300 s for another installation that is running.
        command.env("DEBIAN_FRONTEND", "noninteractive").args([
            "-q",
            "-y",
            "-o",
            "DPkg::Lock::Timeout=300",
            "-o",
            "Dpkg::Use-Pty=0",
        ]);
        command
    }
}

/// The last line that `apt-get` marked as an error; without one, its last line.
fn last_error(text: &str) -> Option<String> {
    let lines: Vec<&str> = text.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    let marked = lines.iter().rev().find_map(|line| line.strip_prefix("E: "));
    marked.or(lines.last().copied()).map(str::to_owned)
}

/// Whether there is a package list, compressed or not: `apt-get update` was run before.
fn has_package_lists(folder: &Path) -> bool {
    let names = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.file_name());
    names.into_iter().any(|name| name.to_string_lossy().contains("_Packages"))
}

fn is_older_than(folder: &Path, age: Duration) -> bool {
    let modified = std::fs::metadata(folder).and_then(|metadata| metadata.modified());
    modified.is_ok_and(|time| time.elapsed().is_ok_and(|elapsed| elapsed > age))
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    /// A stand-in for `apt-get` that writes its arguments to the file `calls`; the folder is removed at the end.
    struct StandIn {
        folder: PathBuf,
        apt: Apt,
    }

    impl StandIn {
        fn new(name: &str, script: &str) -> StandIn {
            let folder = std::env::temp_dir().join(format!("xtask-apt-{name}-{}", std::process::id()));
            let lists = folder.join("lists");
            std::fs::create_dir_all(&lists).unwrap();
            std::fs::write(lists.join("archive_Packages"), "").unwrap();
            let program = folder.join("apt-get");
            let text = format!("#!/bin/sh\necho \"$*\" >> {}/calls\n{script}\n", folder.display());
            // Not by this process: a child that another test starts meanwhile would have the file open for writing, and then it cannot be executed.
            let write = "printf %s \"$1\" > \"$2\" && chmod +x \"$2\"";
            let written = Command::new("sh").args(["-c", write, "sh", &text]).arg(&program).status().unwrap();
            assert!(written.success());
            StandIn { apt: Apt::new(program, lists), folder }
        }

        fn calls(&self) -> Vec<String> {
            let text = std::fs::read_to_string(self.folder.join("calls")).unwrap_or_default();
            text.lines().map(str::to_owned).collect()
        }
    }

    impl Drop for StandIn {
        fn drop(&mut self) {
            let _ = std::fs::remove_dir_all(&self.folder);
        }
    }

    #[test]
    fn a_conflict_is_reported_in_one_line() {
        let script = "echo 'Reading package lists...'; echo 'E: Packages need to be removed but remove is disabled.' >&2; exit 100";
        let stand_in = StandIn::new("conflict", script);
        let reason = stand_in.apt.install(&["nodejs"], Effort::Optional).unwrap_err();
        assert_eq!(reason, "Packages need to be removed but remove is disabled.");
        let calls = stand_in.calls();
        assert_eq!(calls.len(), 1, "no update for an optional package: {calls:?}");
        assert!(calls[0].ends_with("nodejs --simulate"), "{calls:?}");
    }

    #[test]
    fn no_package_is_ever_removed() {
        let stand_in = StandIn::new("remove", "");
        stand_in.apt.install(&["cmake", "make"], Effort::Required).unwrap();
        let calls = stand_in.calls();
        assert_eq!(calls.len(), 2);
        assert!(calls.iter().all(|call| call.contains("install --no-install-recommends --no-remove cmake make")));
    }

    #[test]
    fn a_required_package_gets_fresh_lists_once() {
        let script =
            "case \"$*\" in *update*) touch $(dirname $0)/fresh;; esac; [ -e $(dirname $0)/fresh ] || exit 100";
        let stand_in = StandIn::new("fresh", script);
        stand_in.apt.install(&["cmake"], Effort::Required).unwrap();
        let updates = stand_in.calls().iter().filter(|call| call.ends_with("update")).count();
        assert_eq!((updates, stand_in.calls().len()), (1, 4));
        let failing = StandIn::new("failing", "exit 100");
        assert!(failing.apt.install(&["cmake"], Effort::Required).unwrap_err().contains("100"));
        assert!(failing.apt.install(&["make"], Effort::Required).is_err());
        assert_eq!(failing.calls().iter().filter(|call| call.ends_with("update")).count(), 1);
    }

    #[test]
    fn package_lists_are_seen_compressed_or_not() {
        let stand_in = StandIn::new("lists", "");
        assert!(has_package_lists(&stand_in.apt.lists));
        std::fs::remove_file(stand_in.apt.lists.join("archive_Packages")).unwrap();
        assert!(!has_package_lists(&stand_in.apt.lists));
        std::fs::write(stand_in.apt.lists.join("archive_Packages.lz4"), "").unwrap();
        assert!(has_package_lists(&stand_in.apt.lists));
        assert!(!has_package_lists(Path::new("no such folder")));
        assert!(!is_older_than(&stand_in.apt.lists, LISTS_STAY_FRESH));
    }
}
