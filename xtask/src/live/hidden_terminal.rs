//! A program that wants a terminal, in a pseudo-terminal that nobody sees.

use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::os::unix::ffi::OsStrExt;
use std::process::{Child, Command};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{Winsize, tcsetwinsize};

/// How long it may take for its end after Ctrl-C.
const ENDS_WITHIN: Duration = Duration::from_secs(3);
/// What a terminal sends for Ctrl-C to a program that reads its keys.
const CTRL_C: [u8; 1] = [3];
/// So many of its last lines are kept.
const KEPT_LINES: usize = 8;

/// The running program.
pub(super) struct Hidden {
    child: Child,
    keys: File,
    output: JoinHandle<Vec<u8>>,
}

impl Hidden {
    /// Starts it. What it writes is read away, its beginning is dropped.
    pub(super) fn start(command: &mut Command) -> Result<Hidden> {
        let near = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).context("making a pseudo-terminal")?;
        grantpt(&near).and_then(|()| unlockpt(&near)).context("making a pseudo-terminal")?;
        let size = Winsize { ws_row: 40, ws_col: 120, ws_xpixel: 0, ws_ypixel: 0 };
        tcsetwinsize(&near, size).context("making a pseudo-terminal")?;
        let name = ptsname(&near, Vec::new()).context("naming the pseudo-terminal")?;
        let path = std::ffi::OsStr::from_bytes(name.to_bytes());
        let far = OpenOptions::new().read(true).write(true).open(path).context("opening the pseudo-terminal")?;
        let copy = || far.try_clone().context("opening the pseudo-terminal");
        command.env("TERM", "xterm").stdin(copy()?).stdout(copy()?).stderr(copy()?);
        let child = command.spawn().context("starting probe-rs")?;
        // The command has copies of the far end: with them open, the reader below would not see the end.
        command.stdin(std::process::Stdio::null()).stdout(std::process::Stdio::null());
        command.stderr(std::process::Stdio::null());
        let keys = File::from(near);
        let mut screen = keys.try_clone().context("opening the pseudo-terminal")?;
        let output = std::thread::spawn(move || {
            let (mut kept, mut piece) = (Vec::new(), [0; 4096]);
            // An error is the end: nobody has the far end open.
            while let Ok(length @ 1..) = screen.read(&mut piece) {
                kept.extend_from_slice(&piece[..length]);
                let surplus = kept.len().saturating_sub(1 << 16);
                kept.drain(..surplus);
            }
            kept
        });
        Ok(Hidden { child, keys, output })
    }

    /// Ends it by Ctrl-C, and kills it where it does not end. Its last lines.
    pub(super) fn end(mut self) -> Result<Vec<String>> {
        // A program that has ended reads no keys; then this fails.
        let _ = self.keys.write_all(&CTRL_C);
        let until = Instant::now() + ENDS_WITHIN;
        while self.child.try_wait().context("waiting for probe-rs")?.is_none() {
            if Instant::now() >= until {
                self.child.kill().context("ending probe-rs")?;
                self.child.wait().context("waiting for probe-rs")?;
                break;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        let output = self.output.join().unwrap_or_default();
        let lines = plain_lines(&String::from_utf8_lossy(&output));
        Ok(lines[lines.len().saturating_sub(KEPT_LINES)..].to_vec())
    }
}

/// The lines with text, without the control sequences of a terminal (ECMA-48 5.4: CSI, parameters, a final byte from 0x40 to 0x7E).
fn plain_lines(text: &str) -> Vec<String> {
    let mut plain = String::new();
    let mut characters = text.chars();
    while let Some(character) = characters.next() {
        if character == '\x1b' {
            if characters.next() == Some('[') {
                characters.find(|character| ('\x40'..='\x7e').contains(character));
            }
        } else if character == '\n' || !character.is_control() {
            plain.push(character);
        }
    }
    plain.lines().map(str::trim).filter(|line| !line.is_empty()).map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_sequences_are_left_out() {
        let text = "\x1b[33m WARN\x1b[0m listing\r\n\r\n\x1b[?1049h       \x1b[1;31mError\x1b[0m no chip\r\n";
        assert_eq!(plain_lines(text), ["WARN listing", "Error no chip"]);
    }

    /// It has a terminal of a size, and its keys end it.
    #[test]
    fn a_program_with_a_terminal_ends_by_its_keys() {
        let mut command = Command::new("sh");
        command.args(["-c", "test -t 0 && test -t 1 && stty size && stty raw -echo && echo ready && dd bs=1 count=1 status=none | od -An -tu1"]);
        let hidden = Hidden::start(&mut command).unwrap();
        std::thread::sleep(Duration::from_millis(500));
        assert_eq!(hidden.end().unwrap(), ["40 120", "ready", "3"]);
    }

    #[test]
    fn a_program_that_does_not_end_is_killed() {
        let mut command = Command::new("sh");
        command.args(["-c", "trap '' INT; echo here; while :; do sleep 1; done"]);
        let started = Instant::now();
        let hidden = Hidden::start(&mut command).unwrap();
        std::thread::sleep(Duration::from_millis(200));
        assert!(hidden.end().unwrap().contains(&"here".to_owned()));
        assert!(started.elapsed() < 2 * ENDS_WITHIN);
    }
}
