//! Runs a child process and measures its time, its processor time and its peak memory.

use anyhow::{Context, Result, ensure};
use std::io::Read;
use std::process::{Command, Stdio};
use std::time::Instant;
use wait4::Wait4;

/// What a process used.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Used {
    /// By the clock.
    pub(crate) seconds: f64,
    /// Of all its threads.
    pub(crate) processor_s: f64,
    /// Largest resident set, bytes.
    pub(crate) peak_bytes: u64,
    /// Its standard output.
    pub(crate) output: String,
}

/// Runs a command that must succeed.
pub(crate) fn run(command: &mut Command) -> Result<Used> {
    let name = command.get_program().to_string_lossy().into_owned();
    let began = Instant::now();
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .with_context(|| format!("starting {name}"))?;
    let (mut output, mut errors) = (String::new(), String::new());
    let pipes = (child.stdout.take(), child.stderr.take());
    if let (Some(mut out), Some(mut err)) = pipes {
        // Both at once: a full pipe would stop the process.
        let reader = std::thread::spawn(move || {
            let mut text = Vec::new();
            err.read_to_end(&mut text).map(|_| String::from_utf8_lossy(&text).into_owned())
        });
        out.read_to_string(&mut output).with_context(|| format!("reading the output of {name}"))?;
        errors = reader.join().ok().and_then(Result::ok).unwrap_or_default();
    }
    let ended = child.wait4().with_context(|| format!("waiting for {name}"))?;
    let seconds = began.elapsed().as_secs_f64();
    ensure!(ended.status.success(), "{name} failed ({}): {}", ended.status, errors.trim());
    let processor_s = (ended.rusage.utime + ended.rusage.stime).as_secs_f64();
    Ok(Used { seconds, processor_s, peak_bytes: ended.rusage.maxrss, output })
}
