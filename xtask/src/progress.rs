//! Runs `cargo build` commands side by side and shows on one line what each of them compiles.
//!
//! Cargo's own progress bar is for one cargo on one terminal. Here the line is rewritten several times a second on a terminal, and
//! printed every ten seconds elsewhere. Warnings and errors pass through as cargo writes them.

use std::collections::BTreeMap;
use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use serde_json::Value;

use crate::shell::{self, Stream};

const TERMINAL_INTERVAL: Duration = Duration::from_millis(200);
const LOG_INTERVAL: Duration = Duration::from_secs(10);

/// The width of a terminal that does not report its own.
const USUAL_WIDTH: usize = 80;

/// A `cargo build`, and the names of the executables that it makes.
#[derive(Debug)]
pub(crate) struct Build {
    /// A short name for messages.
    pub(crate) label: &'static str,
    pub(crate) cargo: Command,
    pub(crate) executables: &'static [&'static str],
}

/// What one cargo is doing.
#[derive(Debug, Default)]
struct Activity {
    /// Crates in work, and the order in which they were started.
    running: BTreeMap<usize, String>,
    started: usize,
    finished: usize,
    downloading: bool,
    executables: BTreeMap<String, PathBuf>,
}

impl Activity {
    /// Takes a line of cargo's messages: one JSON object.
    fn message(&mut self, line: &str) {
        let Ok(message) = serde_json::from_str::<Value>(line) else { return };
        let kinds = message["target"]["kind"].as_array().map_or(&[][..], Vec::as_slice);
        if message["reason"] != "compiler-artifact" || kinds.iter().any(|kind| kind == "custom-build") {
            return;
        }
        if let (Some(path), Some(name)) = (message["executable"].as_str(), message["target"]["name"].as_str()) {
            self.executables.insert(name.to_owned(), path.into());
        }
        let file = message["manifest_path"].as_str().unwrap_or_default();
        let done = self.running.iter().find(|(_, name)| is_of_package(file, name)).map(|(&number, _)| number);
        if let Some(number) = done {
            self.running.remove(&number);
            self.finished += 1;
        }
    }

    /// Takes a line of cargo's standard error; whether it only reports progress.
    fn error(&mut self, line: &str) -> bool {
        let plain = without_colours(line);
        let Some((verb, rest)) = plain.trim().split_once(' ') else { return false };
        match verb {
            "Compiling" => {
                // "name v1.2.3 (path)"
                self.running.insert(self.started, rest.split(" (").next().unwrap_or(rest).to_owned());
                self.started += 1;
                self.downloading = false;
                true
            }
            "Downloading" | "Downloaded" | "Updating" | "Locking" | "Adding" => {
                self.downloading = true;
                true
            }
            "Finished" | "Fresh" | "Blocking" => true,
            _ => false,
        }
    }

    /// "unicorn-engine-sys (31)": the crate that has been in work for the longest time, and the number of those that are done.
    fn describe(&self) -> String {
        let oldest = self.running.values().next().and_then(|name| name.split(' ').next());
        match oldest {
            Some(name) => format!("{name} ({})", self.finished),
            None if self.downloading => "downloads crates".to_owned(),
            None => "starts".to_owned(),
        }
    }
}

/// Whether a manifest lies in the folder of the package "name v1.2.3": `name-1.2.3` in the registry, `name` in a workspace.
fn is_of_package(manifest: &str, package: &str) -> bool {
    let folder = manifest.rsplit(['/', '\\']).nth(1).unwrap_or_default();
    // The folder of `compiler_builtins` is `compiler-builtins`.
    let (folder, package) = (folder.replace('_', "-"), package.replace('_', "-"));
    let (name, version) = package.split_once(" v").unwrap_or((&package, ""));
    folder == name || folder.strip_prefix(name).and_then(|rest| rest.strip_prefix('-')) == Some(version)
}

fn without_colours(line: &str) -> String {
    let mut text = String::new();
    let mut characters = line.chars();
    while let Some(character) = characters.next() {
        if character == '\u{1b}' {
            // A colour ends with the letter m.
            characters.by_ref().find(|&character| character == 'm');
        } else {
            text.push(character);
        }
    }
    text
}

/// Builds all of them at the same time; returns the executables of each, in the order of its list.
///
/// # Errors
/// One cannot be started or fails: the others are waited for, because a cargo that is killed leaves its compilers behind.
pub(crate) fn build(builds: Vec<Build>) -> Result<Vec<Vec<PathBuf>>> {
    let colours = std::io::stderr().is_terminal();
    let (sender, lines) = channel();
    let mut children = Vec::new();
    let mut labels = Vec::new();
    for (index, mut build) in builds.into_iter().enumerate() {
        let cargo = build.cargo.arg("--message-format=json-render-diagnostics");
        if colours && std::env::var_os("CARGO_TERM_COLOR").is_none() {
            cargo.env("CARGO_TERM_COLOR", "always");
        }
        let child = cargo.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
        let mut child = child.with_context(|| format!("starting cargo for {}", build.label))?;
        let streams = (child.stdout.take(), child.stderr.take());
        let (Some(messages), Some(errors)) = streams else { bail!("cargo for {} has no output to read", build.label) };
        shell::forward(messages, (index, Stream::Output), &sender);
        shell::forward(errors, (index, Stream::Error), &sender);
        labels.push(build.label);
        children.push((build.label, build.executables, child));
    }
    drop(sender);
    let activities = follow(&labels, &lines, colours);
    let results = children
        .into_iter()
        .zip(activities)
        .map(|((label, executables, child), activity)| finish(label, executables, child, &activity));
    // Every child is waited for before the first error counts.
    results.collect::<Vec<_>>().into_iter().collect()
}

fn finish(label: &str, names: &[&str], mut child: Child, activity: &Activity) -> Result<Vec<PathBuf>> {
    let status = child.wait().with_context(|| format!("waiting for the build of {label}"))?;
    if !status.success() {
        bail!("building {label} failed ({status})");
    }
    let path = |name: &&str| activity.executables.get(*name).cloned().with_context(|| format!("cargo built no {name}"));
    names.iter().map(path).collect()
}

/// Shows what happens until every stream has ended.
fn follow(labels: &[&str], lines: &Receiver<((usize, Stream), String)>, terminal: bool) -> Vec<Activity> {
    let mut activities: Vec<Activity> = labels.iter().map(|_| Activity::default()).collect();
    let started = Instant::now();
    let interval = if terminal { TERMINAL_INTERVAL } else { LOG_INTERVAL };
    let mut due = started + interval;
    // Nobody may be reading; the build goes on all the same.
    let write = |text: &str| drop(write!(std::io::stderr(), "{text}"));
    let width = if terminal { terminal_width() - 1 } else { usize::MAX };
    let clear = if terminal { "\r\u{1b}[K" } else { "" };
    loop {
        match lines.recv_timeout(due.saturating_duration_since(Instant::now())) {
            Ok(((index, Stream::Output), line)) => activities[index].message(&line),
            Ok(((index, Stream::Error), line)) => {
                if !activities[index].error(&line) {
                    write(&format!("{clear}{line}\n"));
                }
            }
            Err(RecvTimeoutError::Disconnected) => break,
            Err(RecvTimeoutError::Timeout) => {}
        }
        if Instant::now() >= due {
            due = Instant::now() + interval;
            let status = status(labels, &activities, started.elapsed(), width);
            write(&if terminal { format!("{clear}{status}") } else { format!("{status}\n") });
        }
    }
    write(clear);
    activities
}

/// Columns of the terminal, from `stty size`, which writes "24 80".
fn terminal_width() -> usize {
    let size = || {
        let terminal = std::fs::File::open("/dev/tty").ok()?;
        let output = shell::command("stty").arg("size").stdin(terminal).output().ok()?;
        String::from_utf8_lossy(&output.stdout).split_whitespace().nth(1)?.parse().ok()
    };
    size().filter(|&columns: &usize| columns > 1).unwrap_or(USUAL_WIDTH)
}

/// "build 1:05  firmware: embassy-stm32 (40), footfall: clap (12)", cut at this width: a line that wraps could not be rewritten.
fn status(labels: &[&str], activities: &[Activity], elapsed: Duration, width: usize) -> String {
    let parts = labels.iter().zip(activities).map(|(label, activity)| format!("{label}: {}", activity.describe()));
    let seconds = elapsed.as_secs();
    let text = format!("build {}:{:02}  {}", seconds / 60, seconds % 60, parts.collect::<Vec<_>>().join(", "));
    text.chars().take(width).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn artifact(name: &str, folder: &str, kind: &str, executable: Option<&str>) -> String {
        serde_json::json!({
            "reason": "compiler-artifact",
            "manifest_path": format!("/registry/{folder}/Cargo.toml"),
            "target": { "name": name, "kind": [kind] },
            "executable": executable,
        })
        .to_string()
    }

    #[test]
    fn the_oldest_crate_in_work_is_shown() {
        let mut activity = Activity::default();
        assert_eq!(activity.describe(), "starts");
        assert!(activity.error("  Downloaded syn v2.0.1"));
        assert_eq!(activity.describe(), "downloads crates");
        assert!(activity.error("\u{1b}[1m\u{1b}[32m   Compiling\u{1b}[0m syn v2.0.1"));
        assert!(activity.error("   Compiling footfall v0.1.0 (/project/tools/footfall)"));
        assert_eq!(activity.describe(), "syn (0)");
        activity.message(&artifact("build-script-build", "syn-2.0.1", "custom-build", None));
        assert_eq!(activity.describe(), "syn (0)");
        activity.message(&artifact("syn", "syn-2.0.1", "lib", None));
        assert_eq!(activity.describe(), "footfall (1)");
    }

    #[test]
    fn warnings_and_errors_are_not_progress() {
        let mut activity = Activity::default();
        for line in ["warning: unused variable", "error[E0308]: mismatched types", "", "  --> src/lib.rs:1:1"] {
            assert!(!activity.error(line), "{line}");
        }
    }

    #[test]
    fn executables_are_found_among_the_messages() {
        let mut activity = Activity::default();
        activity.message(&artifact("footfall", "footfall", "lib", None));
        activity.message("not json");
        activity.message(&artifact("footfall", "footfall", "bin", Some("/t/footfall")));
        assert_eq!(activity.executables["footfall"], PathBuf::from("/t/footfall"));
    }

    #[test]
    fn a_package_is_recognised_by_its_folder() {
        assert!(is_of_package("/r/syn-2.0.1/Cargo.toml", "syn v2.0.1"));
        assert!(is_of_package("/project/tools/footfall/Cargo.toml", "footfall v0.1.0"));
        assert!(is_of_package("/lib/compiler-builtins/compiler-builtins/Cargo.toml", "compiler_builtins v0.1.160"));
        assert!(!is_of_package("/r/syn-1.0.1/Cargo.toml", "syn v2.0.1"));
        assert!(!is_of_package("/r/serde_json-1.0.0/Cargo.toml", "serde v1.0.0"));
    }

    #[test]
    fn the_status_fits_a_line() {
        let activities = [Activity::default(), Activity::default()];
        let text = status(&["firmware", "host"], &activities, Duration::from_secs(65), USUAL_WIDTH);
        assert_eq!(text, "build 1:05  firmware: starts, host: starts");
        assert_eq!(status(&["firmware", "host"], &activities, Duration::from_secs(65), 10).len(), 10);
    }

    #[cfg(unix)]
    fn script(label: &'static str, executables: &'static [&'static str], text: &str) -> Build {
        let mut cargo = Command::new("sh");
        cargo.args(["-c", text]);
        Build { label, cargo, executables }
    }

    /// Each waits for the other: one after the other they would never end.
    #[cfg(unix)]
    #[test]
    fn builds_run_side_by_side() {
        let folder = std::env::temp_dir().join(format!("xtask-builds-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let of = |name: &str, other: &str| {
            format!(
                "cd {}; touch {name}; n=0; until [ -e {other} ]; do n=$((n+1)); [ $n -lt 600 ] || exit 1; sleep 0.05; done; echo '{}'",
                folder.display(),
                artifact(name, name, "bin", Some(&format!("/t/{name}")))
            )
        };
        let built = build(vec![script("a", &["one"], &of("one", "two")), script("b", &["two"], &of("two", "one"))]);
        std::fs::remove_dir_all(&folder).unwrap();
        assert_eq!(built.unwrap(), [[PathBuf::from("/t/one")], [PathBuf::from("/t/two")]]);
    }

    #[cfg(unix)]
    #[test]
    fn a_failed_build_is_named() {
        let message = build(vec![script("good", &[], "true"), script("bad", &[], "exit 101")]).unwrap_err().to_string();
        assert!(message.contains("building bad failed") && message.contains("101"), "{message}");
        let message = build(vec![script("empty", &["one"], "true")]).unwrap_err().to_string();
        assert_eq!(message, "cargo built no one");
    }
}
