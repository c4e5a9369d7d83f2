//! A board's serial port: records in, requests out, see [`wire::Unframer`].
//!
//! A port is a device file: `/dev/ttyACM0` of a Nucleo, `/dev/pts/7` of the virtual board. A file or a named pipe with saved bytes is read like one.

use std::fs::File;
use std::io::{self, Read, Write};
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

use crate::file::capture::rtt::Came;
use joint_loop::tuning::Request;
use wire::{DecodeError, FrameError, MAX_FRAME_BYTES, Record, Unframer, decode_framed, frame_request};

/// Rate of the board's port.
#[cfg(unix)]
const BAUD: u32 = 2_000_000;
/// Reads in the queue, and bytes of one.
const QUEUE: usize = 1024;
const BLOCK: usize = 4096;

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

/// Finds the records in bytes of the port.
#[derive(Debug, Default)]
pub struct Records {
    unframer: Unframer,
    /// What comes before the first zero may be the end of a frame.
    in_step: bool,
}

impl Records {
    /// The records in these bytes, after those before.
    pub fn push(&mut self, bytes: &[u8]) -> Vec<Result<Record, LinkError>> {
        let mut found = Vec::new();
        for byte in bytes {
            let Some(payload) = self.unframer.push(*byte) else { continue };
            let record = payload.map_err(LinkError::from).and_then(|payload| Ok(decode_framed(payload)?));
            if self.in_step || record.is_ok() || is_other_version(&record) {
                found.push(record);
            }
            self.in_step = true;
        }
        found
    }
}

/// Whether the board's image was built with another version of the records.
#[must_use]
pub fn is_other_version(record: &Result<Record, LinkError>) -> bool {
    matches!(record, Err(LinkError::Record(DecodeError::Version { .. })))
}

/// An open port.
#[derive(Debug)]
pub struct Port {
    file: File,
    receiver: Receiver<io::Result<Vec<u8>>>,
}

impl Port {
    /// Opens a port: raw, at the board's rate, without what it has received so far. With `send` also for writing.
    ///
    /// # Errors
    /// There is no such port, or it may not be opened.
    pub fn open(path: &Path, send: bool) -> io::Result<Self> {
        let file = File::options().read(true).write(send).open(path)?;
        #[cfg(unix)]
        set_up(&file)?;
        let mut reader = file.try_clone()?;
        let (sender, receiver) = sync_channel(QUEUE);
        thread::spawn(move || {
            let mut block = vec![0; BLOCK];
            loop {
                let came = match reader.read(&mut block) {
                    Ok(0) => return,
                    Ok(bytes) => Ok(block[..bytes].to_vec()),
                    Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                    Err(error) => Err(error),
                };
                let last = came.is_err();
                if sender.send(came).is_err() || last {
                    return;
                }
            }
        });
        Ok(Self { file, receiver })
    }

    /// Sends a request.
    ///
    /// # Errors
    /// The port does not take it.
    pub fn send(&mut self, request: &Request) -> io::Result<()> {
        let mut buffer = [0; MAX_FRAME_BYTES];
        let frame = frame_request(request, &mut buffer).unwrap_or_default();
        // The zero in front ends whatever the board has received before.
        self.file.write_all(&[&[0], frame].concat())
    }

    /// Waits at most until then for bytes.
    #[must_use]
    pub fn next(&self, until: Instant) -> Came {
        match self.receiver.recv_timeout(until.saturating_duration_since(Instant::now())) {
            Ok(Ok(bytes)) => Came::Bytes(bytes),
            Ok(Err(error)) => Came::Broken(error),
            Err(RecvTimeoutError::Timeout) => Came::Nothing,
            Err(RecvTimeoutError::Disconnected) => Came::End,
        }
    }

    /// The same with a time limit.
    #[must_use]
    pub fn next_within(&self, patience: Duration) -> Came {
        self.next(Instant::now() + patience)
    }
}

#[cfg(unix)]
fn set_up(file: &File) -> io::Result<()> {
    use rustix::termios::{OptionalActions, QueueSelector, isatty, tcflush, tcgetattr, tcsetattr};
    if !isatty(file) {
        return Ok(());
    }
    let mut attributes = tcgetattr(file)?;
    attributes.make_raw();
    attributes.set_speed(BAUD)?;
    tcsetattr(file, OptionalActions::Now, &attributes)?;
    Ok(tcflush(file, QueueSelector::IFlush)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use wire::{Edge, frame_record};

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
            let found = Records::default().push(&bytes[start..]);
            let first = u32::from(start > 0);
            assert_eq!(found, (first..5).map(|tick| Ok(record(tick))).collect::<Vec<_>>(), "{start}");
        }
        // Damage in the second frame is reported, and costs no other: any bit but those of the zero at its end.
        for bit in 0..8 * (length - 1) {
            let mut damaged = bytes.clone();
            damaged[length + bit / 8] ^= 1 << (bit % 8);
            let (found, reported): (Vec<_>, Vec<_>) =
                Records::default().push(&damaged).into_iter().partition(Result::is_ok);
            assert_eq!(found, [0, 2, 3, 4].map(|tick| Ok(record(tick))), "bit {bit}");
            assert!(!reported.is_empty(), "bit {bit}");
        }
    }
}
