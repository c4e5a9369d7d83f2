//! A board's serial port: records in, requests out, see [`wire::Unframer`].
//!
//! A port is a terminal's device file: `/dev/ttyACM0` of a Nucleo, `/dev/pts/7` of the virtual board. Nothing else is opened as one: a request
//! would overwrite a file. Saved bytes of a port are read as those of RTT channel 1, which are the same.

use std::fs::File;
use std::io::{self, IsTerminal, Read, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::file::capture::rtt::{Came, Stream};
use joint_loop::tuning::Request;
use wire::{DecodeError, FrameError, MAX_FRAME_BYTES, Record, Unframer, decode_framed, frame_request};

/// Rate of the board's port.
#[cfg(unix)]
const BAUD: u32 = 1_000_000;

/// A frame that holds no record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum LinkError {
    /// The frame is damaged.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// Its bytes are no record of this version.
    #[error(transparent)]
    Record(#[from] DecodeError),
}

/// Finds the records in frames: in bytes of the port, or of RTT channel 1.
#[derive(Debug, Default)]
pub struct Records {
    unframer: Unframer,
    /// What comes before the first zero may be the end of a frame.
    in_step: bool,
}

impl Records {
    /// Takes the next byte; at the end of a frame, its record.
    pub fn push(&mut self, byte: u8) -> Option<Result<Record, LinkError>> {
        let payload = self.unframer.push(byte)?;
        let record = payload.map_err(LinkError::from).and_then(|payload| Ok(decode_framed(payload)?));
        let was_in_step = std::mem::replace(&mut self.in_step, true);
        (was_in_step || record.is_ok() || is_other_version(&record)).then_some(record)
    }
}

/// Whether the board's image was built with another version of the records.
fn is_other_version(record: &Result<Record, LinkError>) -> bool {
    matches!(record, Err(LinkError::Record(DecodeError::Version { .. })))
}

/// The bytes of a request, as a board takes them. The zero in front ends whatever the board has received before.
#[must_use]
pub fn sent(request: &Request) -> Vec<u8> {
    let mut buffer = [0; MAX_FRAME_BYTES];
    [&[0], frame_request(request, &mut buffer).unwrap_or_default()].concat()
}

/// An open port.
#[derive(Debug)]
pub struct Port {
    file: File,
    sends: bool,
    received: Stream,
    closed: Arc<AtomicBool>,
}

impl Port {
    /// Opens a port: raw, at the board's rate, without what it has received so far. With `send` also for writing.
    ///
    /// # Errors
    /// There is no such port, it is no terminal, or it may not be opened.
    pub fn open(path: &Path, send: bool) -> io::Result<Self> {
        let file = opened(path, send)?;
        #[cfg(unix)]
        set_up(&file)?;
        let closed = Arc::new(AtomicBool::new(false));
        let received = Stream::of(Reader { file: file.try_clone()?, closed: closed.clone() });
        Ok(Self { file, sends: send, received, closed })
    }

    /// Whether requests can be sent: it is open for writing, and known to be a terminal, which it always is on Unix.
    #[must_use]
    pub fn takes_requests(&self) -> bool {
        self.sends && self.file.is_terminal()
    }

    /// Sends a request.
    ///
    /// # Errors
    /// The port does not take it.
    pub fn send(&mut self, request: &Request) -> io::Result<()> {
        self.file.write_all(&sent(request))
    }

    /// Waits at most until then for bytes.
    #[must_use]
    pub fn next(&mut self, until: Instant) -> Came {
        self.received.next(until.saturating_duration_since(Instant::now()))
    }

    /// The same with a time limit.
    #[must_use]
    pub fn next_within(&mut self, patience: Duration) -> Came {
        self.received.next(patience)
    }
}

/// A port that is read no more takes no byte from the one that is opened next.
impl Drop for Port {
    fn drop(&mut self) {
        self.closed.store(true, Ordering::Release);
        #[cfg(unix)]
        while !matches!(self.next_within(Duration::from_secs(1)), Came::End | Came::Broken(_)) {}
    }
}

/// What a port receives, until the port is closed here.
#[derive(Debug)]
struct Reader {
    file: File,
    closed: Arc<AtomicBool>,
}

impl Read for Reader {
    fn read(&mut self, block: &mut [u8]) -> io::Result<usize> {
        while !self.closed.load(Ordering::Acquire) {
            #[cfg(unix)]
            if !has_bytes(&self.file)? {
                continue;
            }
            return self.file.read(block);
        }
        Ok(0)
    }
}

/// Waits a moment for bytes, or for the end of the file.
#[cfg(unix)]
fn has_bytes(file: &File) -> io::Result<bool> {
    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    const MOMENT: Timespec = Timespec { tv_sec: 0, tv_nsec: 10_000_000 };
    Ok(poll(&mut [PollFd::new(file, PollFlags::IN)], Some(&MOMENT))? > 0)
}

/// What is no port, in words.
fn no_port(what: &str) -> io::Error {
    io::Error::other(format!(
        "is {what}; allowed is the device file of a serial port, such as /dev/ttyACM0; bytes that were saved are read with --rtt"
    ))
}

/// Opens a terminal and nothing else. What it is, is asked before it is opened: to open a pipe waits, and to open a device may move it.
#[cfg(unix)]
fn opened(path: &Path, send: bool) -> io::Result<File> {
    use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
    use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
    let kind = path.metadata()?.file_type();
    if !kind.is_char_device() {
        return Err(no_port(match () {
            () if kind.is_file() => "a regular file",
            () if kind.is_dir() => "a folder",
            () if kind.is_fifo() => "a named pipe",
            () => "no terminal",
        }));
    }
    // Without waiting for a carrier, and never as the terminal that controls this program.
    let flags = (OFlags::NOCTTY | OFlags::NONBLOCK).bits().cast_signed();
    let file = File::options().read(true).write(send).custom_flags(flags).open(path)?;
    if !file.is_terminal() {
        return Err(no_port("a device and no terminal"));
    }
    fcntl_setfl(&file, fcntl_getfl(&file)? - OFlags::NONBLOCK)?;
    Ok(file)
}

/// Opens a port; a regular file is none.
#[cfg(not(unix))]
fn opened(path: &Path, send: bool) -> io::Result<File> {
    if path.is_file() {
        return Err(no_port("a regular file"));
    }
    File::options().read(true).write(send).open(path)
}

#[cfg(unix)]
fn set_up(file: &File) -> io::Result<()> {
    use rustix::termios::{OptionalActions, QueueSelector, tcflush, tcgetattr, tcsetattr};
    let mut attributes = tcgetattr(file)?;
    attributes.make_raw();
    attributes.set_speed(BAUD)?;
    tcsetattr(file, OptionalActions::Now, &attributes)?;
    Ok(tcflush(file, QueueSelector::IFlush)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(unix)]
    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
    use wire::{Edge, frame_record};

    /// A program may close a port and open it again: the first bytes after that are the second port's.
    #[cfg(unix)]
    #[test]
    fn a_closed_port_takes_nothing_from_the_next() {
        let near = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
        grantpt(&near).and_then(|()| unlockpt(&near)).unwrap();
        let path = ptsname(&near, Vec::new()).unwrap().into_string().unwrap();
        let mut near = File::from(near);
        let _far = File::open(&path).unwrap();
        for round in 0..20 {
            let mut port = Port::open(path.as_ref(), true).unwrap();
            near.write_all(&[round]).unwrap();
            let Came::Bytes(bytes) = port.next_within(Duration::from_secs(5)) else { panic!("round {round}") };
            assert_eq!(bytes, [round]);
        }
    }

    /// A request to `robot.toml` would overwrite its beginning; a named pipe would wait for ever.
    #[cfg(unix)]
    #[test]
    fn what_is_no_terminal_is_refused_and_stays_as_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let [file, link, pipe] = ["robot.toml", "link", "pipe"].map(|name| folder.path().join(name));
        std::fs::write(&file, "park_deg = 0\n").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        rustix::fs::mkfifoat(rustix::fs::CWD, &pipe, rustix::fs::Mode::RWXU).unwrap();
        for (path, words) in [
            (file.as_path(), "is a regular file; allowed is the device file"),
            (&link, "is a regular file"),
            (&pipe, "is a named pipe"),
            (folder.path(), "is a folder"),
            (Path::new("/dev/null"), "is a device and no terminal"),
        ] {
            for send in [false, true] {
                let error = Port::open(path, send).unwrap_err().to_string();
                assert!(error.contains(words) && error.contains("--rtt"), "{}: {error}", path.display());
            }
        }
        assert_eq!(std::fs::read_to_string(&file).unwrap(), "park_deg = 0\n");
    }

    #[test]
    fn records_are_found_from_any_byte_on() {
        let record = |tick| Record::Edge(Edge { tick, offset_us: 0, high: true, lost_before: false });
        let mut bytes = Vec::new();
        for tick in 0..5 {
            let mut buffer = [0; MAX_FRAME_BYTES];
            bytes.extend(frame_record(&record(tick), &mut buffer).unwrap());
        }
        let length = bytes.len() / 5;
        for start in 0..length {
            let mut records = Records::default();
            let found: Vec<_> = bytes[start..].iter().filter_map(|byte| records.push(*byte)).collect();
            let first = u32::from(start > 0);
            assert_eq!(found, (first..5).map(|tick| Ok(record(tick))).collect::<Vec<_>>(), "{start}");
        }
        // Damage in the second frame is reported, and costs no other: any bit but those of the zero at its end.
        for bit in 0..8 * (length - 1) {
            let mut damaged = bytes.clone();
            damaged[length + bit / 8] ^= 1 << (bit % 8);
            let mut records = Records::default();
            let (found, reported): (Vec<_>, Vec<_>) =
                damaged.iter().filter_map(|byte| records.push(*byte)).partition(Result::is_ok);
            assert_eq!(found, [0, 2, 3, 4].map(|tick| Ok(record(tick))), "bit {bit}");
            assert!(!reported.is_empty(), "bit {bit}");
        }
    }
}
