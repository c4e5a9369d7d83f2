//! Runs the virtual board as a process: start, output, button, end.
//!
//! Two threads read its standard output and standard error until these are closed. Everything arrives in one queue, in order for each
//! of the two; its end is reported after both, so that no message is lost.

use crate::board::lines::{BoardLine, LineError, parse};
use std::ffi::OsString;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::{Duration, Instant};

/// Lines in the queue before the board has to wait.
const QUEUE: usize = 4096;

/// Longest time from the request to end to the end.
const PATIENCE: Duration = Duration::from_secs(10);

/// Output of the process.
#[derive(Debug)]
pub enum Output {
    /// A line of its output.
    Line(BoardLine),
    /// A line of its output with the wrong format.
    Malformed(LineError),
    /// A line of its standard error, for the user.
    Message(String),
    /// Its output and its standard error are closed.
    Closed,
}

/// The process could not be started.
#[derive(Debug, thiserror::Error)]
#[error("cannot start the virtual board {}: {why}", .program.display())]
pub struct StartError {
    /// The program.
    pub program: PathBuf,
    /// The reason of the operating system.
    pub why: std::io::Error,
}

/// A running board. Dropping it ends the process.
#[derive(Debug)]
pub struct BoardProcess {
    child: Child,
    stdin: Option<ChildStdin>,
    output: Receiver<Output>,
}

impl BoardProcess {
    /// Starts a program with its arguments.
    ///
    /// # Errors
    /// The operating system cannot start it.
    pub fn start(program: &Path, arguments: &[OsString]) -> Result<Self, StartError> {
        let mut child = Command::new(program)
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|why| StartError { program: program.into(), why })?;
        let (send, output) = sync_channel(QUEUE);
        if let Some(stdout) = child.stdout.take() {
            let send = send.clone();
            std::thread::spawn(move || read_lines(stdout, &send));
        }
        if let Some(stderr) = child.stderr.take() {
            std::thread::spawn(move || read_messages(stderr, &send));
        }
        let stdin = child.stdin.take();
        Ok(Self { child, stdin, output })
    }

    /// Waits at most this long for the next output.
    pub fn next(&self, patience: Duration) -> Option<Output> {
        match self.output.recv_timeout(patience) {
            Ok(output) => Some(output),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => Some(Output::Closed),
        }
    }

    /// Holds the user button for half a virtual second: its release arms, and a motion stops at once.
    pub fn hold_button(&mut self) {
        self.write("hold");
    }

    /// Presses the emergency stop for a tenth of a virtual second: its test before the first arming after a boot.
    pub fn test_emergency_stop(&mut self) {
        self.write("stop");
    }

    /// Asks the board to end. Its last line follows.
    pub fn quit(&mut self) {
        self.write("quit");
    }

    /// Writes a command. A board that has ended is reported by its closed output, not here.
    fn write(&mut self, word: &str) {
        if let Some(stdin) = &mut self.stdin {
            let written = writeln!(stdin, "{word}").and_then(|()| stdin.flush());
            if written.is_err() {
                self.stdin = None;
            }
        }
    }

    /// Waits for the end of the process, and takes the messages that are left; kills it after the time limit.
    ///
    /// # Errors
    /// The operating system reports no status.
    pub fn wait(&mut self) -> std::io::Result<(ExitStatus, Vec<String>)> {
        self.stdin = None;
        let deadline = Instant::now() + PATIENCE;
        let mut messages = Vec::new();
        // A board whose output is not read would block and never end.
        while Instant::now() < deadline {
            match self.next(Duration::from_millis(50)) {
                Some(Output::Message(text)) => messages.push(text),
                Some(Output::Line(_) | Output::Malformed(_)) | None => {}
                Some(Output::Closed) => break,
            }
        }
        loop {
            if let Some(status) = self.child.try_wait()? {
                return Ok((status, messages));
            }
            if Instant::now() >= deadline {
                self.child.kill()?;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

impl Drop for BoardProcess {
    fn drop(&mut self) {
        self.stdin = None;
        // Both fail only for a process that has already ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn read_lines(stdout: impl Read, send: &SyncSender<Output>) {
    for line in BufReader::new(stdout).lines() {
        let Ok(line) = line else { break };
        let output = match parse(&line) {
            Ok(line) => Output::Line(line),
            Err(error) => Output::Malformed(error),
        };
        if send.send(output).is_err() {
            return;
        }
    }
}

fn read_messages(stderr: impl Read, send: &SyncSender<Output>) {
    for line in BufReader::new(stderr).lines() {
        let Ok(line) = line else { return };
        if send.send(Output::Message(line)).is_err() {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shell(script: &str) -> BoardProcess {
        BoardProcess::start(Path::new("/bin/sh"), &["-c".into(), script.into()]).unwrap()
    }

    #[test]
    fn lines_messages_and_the_end_arrive() {
        let mut board = shell(r#"echo '{"type":"status","t_s":0.1}'; echo junk; echo message >&2; exit 3"#);
        let (mut lines, mut malformed, mut messages) = (0, 0, 0);
        let mut closed = false;
        while !closed {
            match board.next(Duration::from_secs(20)).expect("in time") {
                Output::Line(BoardLine::Status { t_s }) => lines += usize::from(t_s == 0.1),
                Output::Malformed(error) => malformed += usize::from(error.line == "junk"),
                Output::Message(text) => messages += usize::from(text == "message"),
                Output::Closed => closed = true,
                Output::Line(other) => panic!("{other:?}"),
            }
        }
        assert_eq!((lines, malformed, messages, board.wait().unwrap().0.code()), (1, 1, 1, Some(3)));
    }

    #[test]
    fn a_message_after_the_end_of_the_output_is_not_lost() {
        let mut board = shell("exec 1>&-; sleep 0.3; echo late >&2; exit 2");
        let (status, messages) = board.wait().unwrap();
        assert_eq!((status.code(), messages), (Some(2), vec!["late".to_owned()]));
        let board = shell("exec 1>&-; sleep 0.3; echo late >&2");
        assert!(matches!(board.next(Duration::from_secs(20)), Some(Output::Message(text)) if text == "late"));
        assert!(matches!(board.next(Duration::from_secs(20)), Some(Output::Closed)));
    }

    #[test]
    fn the_button_and_the_wish_to_end_are_heard() {
        let mut board = shell(
            r#"while read word; do echo "{\"type\":\"remark\",\"text\":\"$word\"}"; [ "$word" = quit ] && exit 0; done"#,
        );
        board.test_emergency_stop();
        board.hold_button();
        board.quit();
        let mut heard = Vec::new();
        while let Some(Output::Line(BoardLine::Remark { text, .. })) = board.next(Duration::from_secs(20)) {
            heard.push(text);
        }
        assert_eq!(heard.len(), 3);
        assert!(heard[0].contains("stop") && heard[1].contains("hold") && heard[2].contains("quit"));
    }

    #[test]
    fn a_board_that_is_dropped_is_ended_even_if_it_talks_without_end() {
        let started = Instant::now();
        drop(shell(r#"while :; do echo '{"type":"status","t_s":0.1}'; done"#));
        assert!(started.elapsed() < Duration::from_secs(20));
    }

    #[test]
    fn a_program_that_is_not_there_is_named() {
        let error = BoardProcess::start(Path::new("/no/such/board"), &[]).unwrap_err().to_string();
        assert!(error.starts_with("cannot start the virtual board /no/such/board: "), "{error}");
    }
}
