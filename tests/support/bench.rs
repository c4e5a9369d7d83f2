//! A virtual board as a debug probe with its target, and the programs that use it: probe-rs as it is released, `cargo xtask`, `cargo run`.

use crate::recordings::default_volts_file;
use serde_json::Value;
use std::ffi::OsString;
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// How long anything may take.
const PATIENCE: Duration = Duration::from_secs(300);

/// The root of the repository.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The flashed image.
pub fn elf() -> OsString {
    std::env::var_os("FOOTFALL_ELF").expect("the image")
}

/// Waits until something holds.
pub fn until(what: &str, mut holds: impl FnMut() -> bool) {
    let started = Instant::now();
    while !holds() {
        assert!(started.elapsed() < PATIENCE, "{what}: not within {PATIENCE:?}");
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// Everything that a stream has said so far.
#[derive(Clone, Default)]
pub struct Said(Arc<Mutex<String>>);

impl Said {
    /// Reads a stream to its end, in a thread of its own.
    pub fn read(stream: impl Read + Send + 'static) -> (Self, JoinHandle<()>) {
        let said = Self::default();
        let text = said.clone();
        let reader = std::thread::spawn(move || {
            let mut lines = BufReader::new(stream);
            let mut line = Vec::new();
            while lines.read_until(b'\n', &mut line).is_ok_and(|length| length > 0) {
                text.0.lock().unwrap().push_str(&String::from_utf8_lossy(&line));
                line.clear();
            }
        });
        (said, reader)
    }

    /// What it has said.
    pub fn text(&self) -> String {
        self.0.lock().unwrap().clone()
    }
}

/// A virtual board as a debug probe with its target, in real time.
pub struct Bench {
    board: Child,
    lines: Said,
    /// Of the probe.
    pub address: String,
    folder: TempDir,
}

impl Bench {
    /// Starts a board with these options. Its sensor is moved by a recorded walk.
    pub fn start<A: AsRef<std::ffi::OsStr>>(options: impl IntoIterator<Item = A>) -> Self {
        let program = std::env::var_os("FOOTFALL_VIRTUAL_BOARD").expect("the virtual board");
        let mut board = Command::new(program)
            .args(["--probe", "127.0.0.1:0", "--pace", "--loop", "--volts"])
            .arg(default_volts_file())
            .args(options)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the virtual board starts");
        let (lines, _) = Said::read(board.stdout.take().expect("piped"));
        let mut bench = Self { board, lines, address: String::new(), folder: tempfile::tempdir().expect("a folder") };
        until("the address of the probe", || !bench.of_kind("probe").is_empty());
        bench.address = bench.of_kind("probe")[0]["address"].as_str().expect("an address").to_owned();
        bench
    }

    /// The image, which walks after a test of the emergency stop and a hold.
    pub fn with_image(options: &[&str]) -> Self {
        Self::start([elf()].into_iter().chain(options.iter().map(OsString::from)))
    }

    /// The lines of the board of this type so far.
    pub fn of_kind(&self, kind: &str) -> Vec<Value> {
        let mark = format!("\"type\":\"{kind}\"");
        let text = self.lines.text();
        text.lines().filter(|line| line.contains(&mark)).map(|line| serde_json::from_str(line).expect("JSON")).collect()
    }

    /// Whether pulses came within the last 200 ms of the board's time.
    pub fn has_pulses(&self) -> bool {
        let last = |kind: &str| self.of_kind(kind).last().and_then(|line| line["t_s"].as_f64());
        last("pulses").is_some_and(|pulses_s| pulses_s > last("status").unwrap_or(0.0) - 0.2)
    }

    /// Gives the board a command.
    pub fn command(&self, line: &str) {
        let mut console = self.board.stdin.as_ref().expect("piped");
        writeln!(console, "{line}").expect("the board reads");
    }

    /// Tests the emergency stop and arms. Where it was tested since the boot, its press is a fault, which the first hold acknowledges. A press
    /// during the boot is not its test: it is pressed again before every third hold.
    pub fn arm(&self) {
        // Of the board's time.
        const AGAIN_S: f64 = 4.0;
        let (mut holds, mut held_s) = (0, f64::NEG_INFINITY);
        until("pulses", || {
            let now_s = self.of_kind("status").last().and_then(|status| status["t_s"].as_f64()).unwrap_or(0.0);
            // The time begins again with the power.
            if now_s > held_s + AGAIN_S || now_s < held_s {
                if holds % 3 == 0 {
                    self.command("stop");
                }
                self.command("hold");
                (holds, held_s) = (holds + 1, now_s);
            }
            self.has_pulses()
        });
    }

    /// Stops a walk.
    pub fn stop(&self) {
        self.command("press");
        // Longer than a bounce.
        until("the end of the walk", || self.of_kind("status").last().is_some_and(|status| status["armed"] == false));
        self.command("release");
    }

    /// A file in the folder of this board.
    pub fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// A command in a folder of the workspace, for which this is the probe.
    pub fn beside(&self, program: impl AsRef<std::ffi::OsStr>, folder: &str) -> Command {
        let mut command = Command::new(program);
        command.current_dir(root().join(folder));
        command.env("PROBE_RS_PROBE", format!("0:0:{}", self.address)).env("PROBE_RS_PROTOCOL", "swd");
        command.env("RUST_LOG", "error");
        command
    }

    /// Exit code, standard output, standard error of `cargo xtask`.
    pub fn xtask(&self, arguments: &str) -> (Option<i32>, String, String) {
        // As a user who names the probe alone: xtask asks for the protocol.
        let mut cargo = self.beside("cargo", "");
        cargo.env_remove("PROBE_RS_PROTOCOL").arg("xtask").args(arguments.split(' '));
        let output = cargo.stdin(Stdio::null()).output().unwrap();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (output.status.code(), text(&output.stdout), text(&output.stderr))
    }

    /// `cargo xtask` that must succeed; what it said.
    pub fn must(&self, arguments: &str) -> String {
        let (code, said, errors) = self.xtask(arguments);
        assert_eq!(code, Some(0), "{arguments}: {said}{errors}");
        said + &errors
    }

    /// The name of its serial port; it was started with `--serial`.
    pub fn port(&self) -> String {
        until("the name of the serial port", || !self.of_kind("serial").is_empty());
        self.of_kind("serial")[0]["port"].as_str().expect("a name").to_owned()
    }

    /// Bytes of the chip's memory, read by probe-rs.
    pub fn memory(&self, address: u32, bytes: usize) -> Vec<u8> {
        let file = self.at("memory.bin");
        let mut read = self.beside(test_suite::probe_rs(), "");
        read.args(["read", "--chip", "STM32F407VGTx", "b32"]).arg(address.to_string()).arg((bytes / 4).to_string());
        let output = read.args(["--format", "binary", "--output"]).arg(&file).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        std::fs::read(file).unwrap()
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.board.kill();
        let _ = self.board.wait();
    }
}

/// A program that shows a log until it is ended.
pub struct Log {
    /// The program.
    pub child: Child,
    /// What it writes to standard output.
    pub said: Said,
    /// What it writes to standard error.
    pub errors: Said,
}

impl Log {
    /// Starts a command.
    pub fn start(command: &mut Command) -> Self {
        // A group of its own, to which Ctrl-C goes in a terminal.
        command.process_group(0).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let (said, _) = Said::read(child.stdout.take().unwrap());
        let (errors, _) = Said::read(child.stderr.take().unwrap());
        Self { child, said, errors }
    }

    /// Waits until the program has written these words to standard output.
    pub fn until(&mut self, words: &str) {
        let (said, errors) = (self.said.clone(), self.errors.clone());
        until(words, || {
            let ended = self.child.try_wait().unwrap();
            assert!(ended.is_none(), "{words}: {ended:?} {}{}", said.text(), errors.text());
            said.text().contains(words)
        });
    }

    /// Ctrl-C. What it said.
    pub fn end(self) -> String {
        self.end_by("-INT")
    }

    /// SIGTERM, for probe-rs: 0.32 does not heed SIGINT where an image has a down channel and no terminal is there.
    pub fn terminate(self) -> String {
        self.end_by("-TERM")
    }

    fn end_by(mut self, signal: &str) -> String {
        assert!(
            Command::new("kill").args([signal, "--", &format!("-{}", self.child.id())]).status().unwrap().success()
        );
        until("the end of the program", || self.child.try_wait().unwrap().is_some());
        self.said.text() + &self.errors.text()
    }
}
