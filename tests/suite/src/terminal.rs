//! A program at a terminal of a certain size: what is on the screen, and keys. The terminal is a pseudo one, made by `script` of util-linux; a
//! terminal emulator reads what the program writes to it.

use std::io::{Read, Write};
use std::num::NonZero;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Longest wait for anything.
const PATIENCE: Duration = Duration::from_secs(60);

/// A program at a terminal.
pub struct Terminal {
    child: Child,
    keys: ChildStdin,
    screen: Arc<Mutex<Screen>>,
}

struct Screen {
    parser: vt100::Parser,
    /// Everything that was written, for a program that leaves the screen.
    written: String,
}

impl Terminal {
    /// Runs a line of a shell at a terminal of so many columns and rows.
    ///
    /// # Panics
    /// The size is 0, or there is no `script`: a test that uses it names [`crate::Need::Terminal`].
    #[must_use]
    pub fn run(line: &str, columns: u16, rows: u16) -> Self {
        let line = format!("stty rows {rows} cols {columns}; {line}");
        let mut script = Command::new("script");
        script.args(["--quiet", "--return", "--flush", "--command", &line, "/dev/null"]).env("SHELL", "/bin/sh");
        script.env("TERM", "xterm-256color").env_remove("NO_COLOR").env_remove("LANG");
        script.env_remove("LC_ALL").env_remove("LC_CTYPE");
        let mut child = script.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("script of util-linux");
        let (keys, mut out) = (child.stdin.take().expect("piped"), child.stdout.take().expect("piped"));
        let size = |cells: u16| NonZero::new(cells).expect("a terminal has cells");
        let parser = vt100::Parser::new(size(rows), size(columns), 0);
        let screen = Arc::new(Mutex::new(Screen { parser, written: String::new() }));
        let shared = Arc::clone(&screen);
        std::thread::spawn(move || {
            let mut bytes = [0; 4096];
            while let Ok(n @ 1..) = out.read(&mut bytes) {
                let mut screen = shared.lock().unwrap_or_else(PoisonError::into_inner);
                screen.parser.process(&bytes[..n]);
                screen.written.push_str(&String::from_utf8_lossy(&bytes[..n]));
            }
        });
        Self { child, keys, screen }
    }

    fn screen(&self) -> MutexGuard<'_, Screen> {
        self.screen.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What is on the screen now.
    #[must_use]
    pub fn shows(&self) -> String {
        self.screen().parser.screen().contents()
    }

    /// Waits until this is on the screen, and gives the screen.
    ///
    /// # Panics
    /// It is not there in time.
    #[must_use]
    pub fn sees(&self, what: &str) -> String {
        self.sees_all(&[what])
    }

    /// Waits until all of these are on the screen at one time, and gives the screen. A frame arrives in parts: what stands below one of the words
    /// may still be that of the frame before.
    ///
    /// # Panics
    /// They are not there in time.
    #[must_use]
    pub fn sees_all(&self, what: &[&str]) -> String {
        let began = Instant::now();
        loop {
            let shown = self.shows();
            let Some(missing) = what.iter().find(|words| !shown.contains(**words)) else { return shown };
            assert!(began.elapsed() < PATIENCE, "never saw `{missing}`:\n{shown}");
            sleep(Duration::from_millis(20));
        }
    }

    /// Presses keys.
    ///
    /// # Panics
    /// The terminal is gone.
    pub fn presses(&mut self, keys: &str) {
        self.keys.write_all(keys.as_bytes()).and_then(|()| self.keys.flush()).expect("a terminal takes keys");
    }

    /// Waits for the end: the exit code, and everything that was written.
    ///
    /// # Panics
    /// The program does not end in time.
    #[must_use]
    pub fn ends(mut self) -> (Option<i32>, String) {
        let began = Instant::now();
        let status = loop {
            if let Some(status) = self.child.try_wait().expect("a status") {
                break status;
            }
            assert!(began.elapsed() < PATIENCE, "it does not end:\n{}", self.shows());
            sleep(Duration::from_millis(20));
        };
        // The thread that reads may be a moment behind.
        sleep(Duration::from_millis(100));
        (status.code(), self.screen().written.clone())
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        // It has ended already, unless the test failed.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
