//! The other end of the serial port: a pseudo-terminal that a host program opens like the port of a real board.
//!
//! The board's time is not the host's, so it waits for a host that is behind: [`PATIENCE`] at most. From then on bytes that the host does not
//! read are dropped, as on a line, until it reads again. The terminal is raw, and its rate is the one that the chip has set.

use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

/// Longest wait for a host that does not read.
const PATIENCE: Duration = Duration::from_secs(1);
/// Time after which a write is tried again.
const RETRY: Timespec = Timespec { tv_sec: 0, tv_nsec: 10_000_000 };
/// Longest piece that is read at once.
const PIECE: usize = 4096;

/// A pseudo-terminal.
pub(crate) struct SerialPort {
    near: File,
    /// Open, so that a host may close the port and open it again.
    _far: File,
    /// The host did not read within the patience, and has not read since.
    absent: bool,
    /// Name of the host's end.
    pub(crate) name: String,
}

impl SerialPort {
    /// Makes a pseudo-terminal.
    ///
    /// # Errors
    /// The system has none to give.
    pub(crate) fn open() -> Result<Self> {
        let near = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).context("cannot make a pseudo-terminal")?;
        grantpt(&near).and_then(|()| unlockpt(&near)).context("cannot unlock the pseudo-terminal")?;
        let name = ptsname(&near, Vec::new()).context("the pseudo-terminal has no name")?;
        let far = rustix::fs::open(&*name, OFlags::RDWR | OFlags::NOCTTY, Mode::empty())
            .context("cannot open the pseudo-terminal")?;
        let mut attributes = tcgetattr(&far).context("cannot read the modes of the pseudo-terminal")?;
        attributes.make_raw();
        tcsetattr(&far, OptionalActions::Now, &attributes).context("cannot set the pseudo-terminal raw")?;
        rustix::io::ioctl_fionbio(&near, true).context("cannot set the pseudo-terminal non-blocking")?;
        Ok(SerialPort { near: near.into(), _far: far.into(), absent: false, name: name.to_string_lossy().into_owned() })
    }

    /// Hands the host what the chip sent; returns what the host sent.
    ///
    /// # Errors
    /// The pseudo-terminal fails.
    pub(crate) fn exchange(&mut self, sent: &[u8]) -> Result<Vec<u8>> {
        self.send(sent).context("cannot write to the pseudo-terminal")?;
        let mut piece = vec![0; PIECE];
        match self.near.read(&mut piece) {
            Ok(length) => piece.truncate(length),
            Err(error) if error.kind() == ErrorKind::WouldBlock => piece.clear(),
            Err(error) => return Err(error).context("cannot read from the pseudo-terminal"),
        }
        Ok(piece)
    }

    fn send(&mut self, mut bytes: &[u8]) -> std::io::Result<()> {
        let mut waits_until = None;
        while !bytes.is_empty() {
            match self.near.write(bytes) {
                Ok(length) => {
                    bytes = bytes.get(length..).unwrap_or_default();
                    (self.absent, waits_until) = (false, None);
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    let until = *waits_until.get_or_insert_with(|| Instant::now() + PATIENCE);
                    if self.absent || Instant::now() >= until {
                        self.absent = true;
                        return Ok(());
                    }
                    // A host that empties the port without reading it wakes nobody.
                    poll(&mut [PollFd::new(&self.near, PollFlags::OUT)], Some(&RETRY))?;
                }
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_pass_unchanged_in_both_directions() {
        let mut port = SerialPort::open().unwrap();
        let mut host = File::options().read(true).write(true).open(&port.name).unwrap();
        let all: Vec<u8> = (0..=255).collect();
        assert!(port.exchange(&all).unwrap().is_empty());
        let mut read = vec![0; 256];
        host.read_exact(&mut read).unwrap();
        assert_eq!(read, all);
        host.write_all(&all).unwrap();
        let mut got = Vec::new();
        while got.len() < 256 {
            got.extend(port.exchange(&[]).unwrap());
        }
        assert_eq!(got, all);
        // A host that does not read holds nothing up, and one that comes later finds the port.
        drop(host);
        for _ in 0..100 {
            port.exchange(&all).unwrap();
        }
        File::options().read(true).open(&port.name).unwrap();
    }

    /// The board sends in microseconds what takes a line half a second; the host reads now and then.
    #[test]
    fn a_host_that_is_behind_loses_nothing() {
        let mut port = SerialPort::open().unwrap();
        let mut host = File::options().read(true).open(&port.name).unwrap();
        let all: Vec<u8> = (0..200_000_u32).map(|n| (n % 251) as u8).collect();
        let expected = all.clone();
        let reader = std::thread::spawn(move || {
            let mut read = vec![0; expected.len()];
            for piece in read.chunks_mut(10_000) {
                std::thread::sleep(Duration::from_millis(5));
                host.read_exact(piece).unwrap();
            }
            assert!(read == expected);
        });
        for piece in all.chunks(100) {
            port.exchange(piece).unwrap();
        }
        reader.join().unwrap();
    }
}
