//! Starts child processes with the environment of the user's shell, and reads or passes on their output.

use std::ffi::{OsStr, OsString};
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::mpsc::{Sender, channel};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};

/// A command without the variables that `cargo run` set for us: they would reach build scripts and cause rebuilds.
pub(crate) fn command(program: impl AsRef<OsStr>) -> Command {
    let mut command = Command::new(program);
    for (name, _) in std::env::vars_os() {
        if name.to_str().is_some_and(is_from_cargo_run) {
            command.env_remove(name);
        }
    }
    command
}

/// Variables in which cargo describes the package that a program was built from; settings such as `CARGO_HOME` are not among them.
fn is_from_cargo_run(name: &str) -> bool {
    let prefixes = ["CARGO_PKG_", "CARGO_MANIFEST_", "CARGO_BIN_"];
    let names = ["CARGO_CRATE_NAME", "CARGO_PRIMARY_PACKAGE", "CARGO_TARGET_TMPDIR", "OUT_DIR"];
    names.contains(&name) || prefixes.iter().any(|prefix| name.starts_with(prefix))
}

/// The cargo that runs us.
pub(crate) fn cargo() -> Command {
    command(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
}

/// The first `program` on PATH.
pub(crate) fn on_path(program: &str) -> Option<PathBuf> {
    let file = format!("{program}{}", std::env::consts::EXE_SUFFIX);
    std::env::split_paths(&std::env::var_os("PATH")?).map(|folder| folder.join(&file)).find(|path| path.is_file())
}

/// PATH with `folder` in front.
pub(crate) fn path_with(folder: &Path) -> OsString {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let all = std::iter::once(folder.to_owned()).chain(std::env::split_paths(&path));
    std::env::join_paths(all).unwrap_or(path)
}

/// The version of an installed Debian package.
pub(crate) fn debian_version(package: &str) -> Option<String> {
    let status = stdout_of(command("dpkg-query").args(["-W", "-f=${db:Status-Abbrev}${Version}", package])).ok()?;
    status.strip_prefix("ii ").map(str::to_owned)
}

/// The standard output of a command that must succeed; its standard error goes into the message when it does not.
pub(crate) fn stdout_of(command: &mut Command) -> Result<String> {
    let name = command.get_program().to_string_lossy().into_owned();
    let output = command.stdin(Stdio::null()).output().with_context(|| format!("starting {name}"))?;
    if !output.status.success() {
        bail!("{name} failed ({}): {}", output.status, String::from_utf8_lossy(&output.stderr).trim());
    }
    String::from_utf8(output.stdout).with_context(|| format!("{name} wrote something that is not text"))
}

/// Runs a command that must succeed, with all its output on our standard error.
pub(crate) fn must_succeed(command: &mut Command, what: &str) -> Result<()> {
    let status =
        command.stdin(Stdio::null()).stdout(std::io::stderr()).status().with_context(|| format!("starting {what}"))?;
    if !status.success() {
        bail!("{what} failed ({status})");
    }
    Ok(())
}

/// Where a line of a command's output was written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stream {
    Output,
    Error,
}

/// Runs a command and hands on each line of its output, while it runs.
pub(crate) fn each_line(command: &mut Command, mut line: impl FnMut(Stream, &str)) -> Result<ExitStatus> {
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .context("starting the command")?;
    let (sender, lines) = channel();
    forward(child.stdout.take().context("no standard output to read")?, Stream::Output, &sender);
    forward(child.stderr.take().context("no standard error to read")?, Stream::Error, &sender);
    drop(sender);
    for (stream, text) in lines {
        line(stream, &text);
    }
    child.wait().context("waiting for the command")
}

/// Sends each line of a stream with a mark, until the stream ends.
pub(crate) fn forward<M: Clone + Send + 'static>(
    stream: impl Read + Send + 'static,
    mark: M,
    sender: &Sender<(M, String)>,
) {
    let sender = sender.clone();
    std::thread::spawn(move || {
        for line in BufReader::new(stream).split(b'\n') {
            let Ok(line) = line else { return };
            if sender.send((mark.clone(), String::from_utf8_lossy(&line).into_owned())).is_err() {
                return;
            }
        }
    });
}

/// How a command with a deadline ended, and its output.
#[derive(Debug)]
pub(crate) struct Finished {
    /// `None`: still running at the deadline, and killed.
    pub(crate) status: Option<ExitStatus>,
    /// Standard output and standard error.
    pub(crate) output: String,
}

impl Finished {
    /// It ended by itself with code 0.
    pub(crate) fn success(&self) -> bool {
        self.status.is_some_and(|status| status.success())
    }

    /// How it ended, in words.
    pub(crate) fn how(&self) -> String {
        self.status.map_or_else(|| "still running at its deadline".to_owned(), |status| status.to_string())
    }

    /// The last `count` lines of its output.
    pub(crate) fn tail(&self, count: usize) -> String {
        let lines: Vec<&str> = self.output.lines().collect();
        lines[lines.len().saturating_sub(count)..].join("\n")
    }
}

/// Runs a command to its end or to the deadline. Its output goes through a file: a full pipe would stop it.
pub(crate) fn with_deadline(command: &mut Command, deadline: Duration, log: &Path) -> Result<Finished> {
    if let Some(folder) = log.parent() {
        std::fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))?;
    }
    let file = std::fs::File::create(log).with_context(|| format!("writing {}", log.display()))?;
    let both = file.try_clone().context("opening the log twice")?;
    let name = command.get_program().to_string_lossy().into_owned();
    let mut child =
        command.stdin(Stdio::null()).stdout(file).stderr(both).spawn().with_context(|| format!("starting {name}"))?;
    let end = Instant::now() + deadline;
    let status = loop {
        if let Some(status) = child.try_wait().with_context(|| format!("waiting for {name}"))? {
            break Some(status);
        }
        if Instant::now() >= end {
            // It may have ended by itself in this instant.
            let _ = child.kill();
            child.wait().with_context(|| format!("waiting for {name}"))?;
            break None;
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    let output = String::from_utf8_lossy(&std::fs::read(log).with_context(|| format!("reading {}", log.display()))?)
        .into_owned();
    Ok(Finished { status, output })
}

/// Replaces this process by the command: the terminal's Ctrl-C, the standard streams and the exit code are then the command's.
#[cfg(unix)]
pub(crate) fn replace_with(command: &mut Command) -> Result<std::process::ExitCode> {
    use std::os::unix::process::CommandExt;
    let error = command.exec();
    bail!("starting {}: {error}", command.get_program().to_string_lossy())
}

/// Runs the command with our standard streams and returns its exit code.
#[cfg(not(unix))]
pub(crate) fn replace_with(command: &mut Command) -> Result<std::process::ExitCode> {
    let status = command.status().with_context(|| format!("starting {}", command.get_program().to_string_lossy()))?;
    let code = status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1);
    Ok(std::process::ExitCode::from(code))
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    fn log(name: &str) -> PathBuf {
        std::env::temp_dir().join(format!("xtask-{}-{name}.log", std::process::id()))
    }

    #[test]
    fn settings_stay_and_package_variables_go() {
        for gone in ["CARGO_PKG_NAME", "CARGO_MANIFEST_DIR", "CARGO_MANIFEST_PATH", "CARGO_BIN_NAME", "OUT_DIR"] {
            assert!(is_from_cargo_run(gone), "{gone}");
        }
        for kept in
            ["CARGO", "CARGO_HOME", "CARGO_TARGET_DIR", "CARGO_BUILD_JOBS", "CARGO_TERM_COLOR", "PATH", "DEFMT_LOG"]
        {
            assert!(!is_from_cargo_run(kept), "{kept}");
        }
        // Cargo sets this one for tests as it does for `cargo run`.
        assert!(std::env::var_os("CARGO_PKG_NAME").is_some());
        let seen = stdout_of(command("sh").args(["-c", "echo ${CARGO_PKG_NAME-none}"])).unwrap();
        assert_eq!(seen.trim(), "none");
    }

    #[test]
    fn an_error_contains_the_commands_own_message() {
        let message = stdout_of(command("sh").args(["-c", "echo the reason >&2; exit 3"])).unwrap_err().to_string();
        assert!(message.contains("the reason") && message.contains('3'), "{message}");
    }

    #[test]
    fn every_line_is_seen_and_the_exit_code_kept() {
        let mut lines = Vec::new();
        let mut command = command("sh");
        command.args(["-c", "echo one; echo two >&2; echo three; exit 4"]);
        let status = each_line(&mut command, |stream, line| lines.push((stream, line.to_owned()))).unwrap();
        assert_eq!(status.code(), Some(4));
        let of = |wanted| lines.iter().filter(move |(stream, _)| *stream == wanted).map(|(_, line)| line.as_str());
        assert_eq!(of(Stream::Output).collect::<Vec<_>>(), ["one", "three"]);
        assert_eq!(of(Stream::Error).collect::<Vec<_>>(), ["two"]);
    }

    #[test]
    fn a_deadline_ends_what_hangs() {
        let path = log("hang");
        let started = Instant::now();
        let finished =
            with_deadline(command("sh").args(["-c", "echo alive; exec sleep 60"]), Duration::from_millis(300), &path)
                .unwrap();
        let _ = std::fs::remove_file(path);
        assert!(started.elapsed() < Duration::from_secs(30));
        assert!(!finished.success() && finished.status.is_none());
        assert_eq!(finished.output, "alive\n");
        assert_eq!(finished.how(), "still running at its deadline");
    }

    #[test]
    fn a_command_in_time_keeps_its_code_and_output() {
        let path = log("short");
        let finished = with_deadline(
            command("sh").args(["-c", "echo a; echo b >&2; echo c; exit 7"]),
            Duration::from_secs(30),
            &path,
        )
        .unwrap();
        let _ = std::fs::remove_file(path);
        assert_eq!(finished.status.and_then(|status| status.code()), Some(7));
        assert_eq!(finished.tail(2), "b\nc");
    }
}
