//! Runs the test programs of the workspace: as many at a time as there are cores.
//!
//! `cargo test` runs one program after the other, and in many of them one test takes longest by far: on two cores, one is then without work.

use std::ffi::OsStr;
use std::io::{BufRead, BufReader, Write};
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use serde_json::Value;

use super::counts::{self, Counts};
use crate::shell;

/// So many programs are named as those that took longest.
const LONGEST: usize = 12;

/// A test program that cargo has built.
#[derive(Debug, PartialEq, Eq)]
struct Program {
    /// The path of its source in the workspace.
    source: String,
    executable: PathBuf,
    /// The folder of its package, in which cargo would run it.
    folder: PathBuf,
    package: String,
}

/// Builds the test programs that `arguments` of `cargo test` select and runs them with `variables`. Shows the output of each when it has ended.
///
/// # Errors
/// A program cannot be built or started. Tests that fail are in the counts.
pub(super) fn run(arguments: &[&str], variables: &[(&str, &OsStr)]) -> Result<Counts> {
    let programs = build(arguments)?;
    let workers = std::thread::available_parallelism().map_or(1, NonZero::get);
    let next = AtomicUsize::new(0);
    let (sender, ended) = channel();
    let work = |sender: Sender<_>| {
        while let Some(program) = programs.get(next.fetch_add(1, Ordering::Relaxed)) {
            // One that hangs is the last to be named here without its output below.
            eprintln!("running {}", program.source);
            let mut shown = Vec::new();
            let started = Instant::now();
            let counts = counts::run(&program.source, program.command().envs(variables.iter().copied()), &mut shown);
            if sender.send((program, counts, shown, started.elapsed())).is_err() {
                return;
            }
        }
    };
    let mut all = Counts::default();
    let mut times = Vec::new();
    std::thread::scope(|scope| {
        for _ in 0..workers {
            let sender = sender.clone();
            scope.spawn(|| work(sender));
        }
        drop(sender);
        for ((program, counts, shown, took), number) in ended.into_iter().zip(1..) {
            // Nobody may be reading; the result counts all the same.
            let _ = writeln!(std::io::stderr(), "\n{} ({number} of {})", program.source, programs.len());
            let _ = std::io::stderr().write_all(&shown);
            all.add(counts?);
            times.push((took, program.source.as_str()));
        }
        eprintln!("\n{}", longest(times));
        Ok(all)
    })
}

/// Names the programs that took longest, which is where a change would make the tests faster.
fn longest(mut times: Vec<(Duration, &str)>) -> String {
    times.sort_unstable_by(|a, b| b.cmp(a));
    let named = times.iter().take(LONGEST).map(|(took, source)| format!("{source} {:.0} s", took.as_secs_f32()));
    format!("longest: {}", named.collect::<Vec<_>>().join(", "))
}

/// Builds the programs and returns them in the order of their sources.
fn build(arguments: &[&str]) -> Result<Vec<Program>> {
    let root = std::env::current_dir().context("finding the working directory, which is the workspace's root")?;
    let mut cargo = shell::cargo();
    cargo.args(["test", "--no-run", "--message-format=json-render-diagnostics"]).args(arguments);
    let mut child = cargo.stdin(Stdio::null()).stdout(Stdio::piped()).spawn().context("starting cargo test")?;
    let messages = BufReader::new(child.stdout.take().context("no standard output to read")?);
    let mut programs = Vec::new();
    for line in messages.lines() {
        let message = serde_json::from_str(&line.context("reading cargo's messages")?);
        programs.extend(program(&message.context("a message of cargo is not JSON")?, &root));
    }
    let status = child.wait().context("waiting for cargo test")?;
    if !status.success() {
        bail!("building the tests failed ({status})");
    }
    programs.sort_by(|a, b| a.source.cmp(&b.source));
    Ok(programs)
}

/// The test program that a message of cargo names; `None` for every other message.
fn program(message: &Value, root: &Path) -> Option<Program> {
    if message["reason"] != "compiler-artifact" || message["profile"]["test"] != true {
        return None;
    }
    let source = Path::new(message["target"]["src_path"].as_str()?);
    let folder = Path::new(message["manifest_path"].as_str()?).parent()?;
    // `path+file:///FOLDER#NAME@VERSION`, without the name where the folder has it.
    let id = message["package_id"].as_str()?.rsplit_once('#')?.1;
    let name = id.split_once('@').map(|(name, _)| name).or_else(|| folder.file_name()?.to_str())?;
    Some(Program {
        source: source.strip_prefix(root).unwrap_or(source).display().to_string(),
        executable: message["executable"].as_str()?.into(),
        folder: folder.to_owned(),
        package: name.to_owned(),
    })
}

impl Program {
    /// The command that cargo would run.
    fn command(&self) -> Command {
        let mut command = shell::command(&self.executable);
        command.current_dir(&self.folder);
        command.env("CARGO", shell::cargo().get_program());
        command.env("CARGO_MANIFEST_DIR", &self.folder).env("CARGO_PKG_NAME", &self.package);
        command
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn message(test: bool) -> Value {
        json!({
            "reason": "compiler-artifact",
            "package_id": "path+file:///home/me/walk/wire#0.1.0",
            "manifest_path": "/home/me/walk/wire/Cargo.toml",
            "target": { "kind": ["test"], "name": "link", "src_path": "/home/me/walk/wire/tests/link.rs" },
            "profile": { "test": test },
            "executable": "/home/me/walk/target/debug/deps/link-0123",
        })
    }

    #[test]
    fn the_longest_are_named_first() {
        let times =
            vec![(Duration::from_secs(1), "a.rs"), (Duration::from_secs(90), "b.rs"), (Duration::from_secs(7), "c.rs")];
        assert_eq!(longest(times), "longest: b.rs 90 s, c.rs 7 s, a.rs 1 s");
    }

    #[test]
    fn test_programs_are_found_among_the_messages() {
        let root = Path::new("/home/me/walk");
        let mut named = message(true);
        named["package_id"] = "path+file:///home/me/walk/wire#wire@0.1.0".into();
        for message in [message(true), named] {
            let found = program(&message, root).unwrap();
            assert_eq!((found.source.as_str(), found.package.as_str()), ("wire/tests/link.rs", "wire"));
            assert_eq!(found.folder, root.join("wire"));
        }
        for other in [message(false), json!({ "reason": "build-finished", "success": true })] {
            assert_eq!(program(&other, root), None);
        }
    }

    #[test]
    fn a_program_runs_as_cargo_would_run_it() {
        let found = program(&message(true), Path::new("/")).unwrap();
        let command = found.command();
        let variable = |name: &str| command.get_envs().find(|(key, _)| *key == name).and_then(|(_, value)| value);
        assert_eq!(variable("CARGO_PKG_NAME").unwrap(), "wire");
        assert_eq!(variable("CARGO_MANIFEST_DIR").unwrap(), "/home/me/walk/wire");
        assert_eq!(command.get_current_dir().unwrap(), "/home/me/walk/wire");
    }
}
