//! Sources of the raw bytes of a board's log: RTT up channel 0, as a debug probe's program provides it.
//!
//! | source | meaning |
//! |---|---|
//! | a file or a named pipe | bytes saved by `nc` from a server or by J-Link's RTT Logger |
//! | `-` | standard input |
//! | `tcp:HOST:PORT` | a server of raw bytes: OpenOCD's `rtt server start PORT 0`, J-Link's on port 19021 |
//!
//! A thread reads, so that the disk does not block it; its queue is bounded, and when it is full the source waits. A board whose source
//! waits drops whole frames, which the gaps of its log show.

use std::fs::File;
use std::io::{self, Read};
use std::net::{TcpStream, ToSocketAddrs};
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::thread;
use std::time::Duration;

/// Reads in the queue.
const QUEUE: usize = 1024;

/// Longest time to a connection with one address of a server.
const CONNECT_WITHIN: Duration = Duration::from_secs(3);

/// Bytes of one read.
const BLOCK: usize = 4096;

/// The source of the bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Source {
    /// A file or a named pipe.
    File(PathBuf),
    /// Standard input.
    Stdin,
    /// A server: `HOST:PORT`.
    Tcp(String),
}

impl FromStr for Source {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wanted = || format!("`{text}`: allowed are a file, `-` for standard input, and tcp:HOST:PORT");
        match text.strip_prefix("tcp:") {
            Some(address) => match address.rsplit_once(':') {
                Some((host, port)) if !host.is_empty() && port.parse::<u16>().is_ok_and(|port| port > 0) => {
                    Ok(Self::Tcp(address.into()))
                }
                _ => Err(wanted()),
            },
            None if text == "-" => Ok(Self::Stdin),
            None if text.is_empty() => Err(wanted()),
            None => Ok(Self::File(text.into())),
        }
    }
}

impl std::fmt::Display for Source {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::File(path) => path.display().fmt(f),
            Self::Stdin => f.write_str("standard input"),
            Self::Tcp(address) => write!(f, "tcp:{address}"),
        }
    }
}

/// What was received.
#[derive(Debug)]
pub enum Came {
    /// Bytes.
    Bytes(Vec<u8>),
    /// Nothing within the time limit.
    Nothing,
    /// The source has ended.
    End,
    /// The source failed.
    Broken(io::Error),
}

/// A stream of bytes.
#[derive(Debug)]
pub struct Stream {
    receiver: Receiver<io::Result<Vec<u8>>>,
}

impl Stream {
    /// Opens a source.
    ///
    /// # Errors
    /// The file or server does not exist.
    pub fn open(source: &Source) -> io::Result<Self> {
        Ok(match source {
            Source::File(path) => Self::of(File::open(path)?),
            Source::Stdin => Self::of(io::stdin()),
            Source::Tcp(address) => Self::of(connected(address)?),
        })
    }

    /// The stream of what a thread of its own reads here.
    pub(crate) fn of(mut reader: impl Read + Send + 'static) -> Self {
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
        Self { receiver }
    }

    /// Waits at most this long for bytes.
    #[must_use]
    pub fn next(&self, patience: Duration) -> Came {
        match self.receiver.recv_timeout(patience) {
            Ok(Ok(bytes)) => Came::Bytes(bytes),
            Ok(Err(error)) => Came::Broken(error),
            Err(RecvTimeoutError::Timeout) => Came::Nothing,
            Err(RecvTimeoutError::Disconnected) => Came::End,
        }
    }
}

/// Tries every address of the name, a moment each.
fn connected(address: &str) -> io::Result<TcpStream> {
    let mut why = io::Error::other("the name has no address");
    for address in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, CONNECT_WITHIN) {
            Ok(stream) => return Ok(stream),
            Err(error) => why = error,
        }
    }
    Err(why)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_are_named() {
        assert_eq!("-".parse(), Ok(Source::Stdin));
        assert_eq!("walk.rtt".parse(), Ok(Source::File("walk.rtt".into())));
        assert_eq!("tcp:localhost:9090".parse(), Ok(Source::Tcp("localhost:9090".into())));
        for bad in ["", "tcp:", "tcp:localhost", "tcp::9090", "tcp:localhost:0", "tcp:localhost:port"] {
            let error = bad.parse::<Source>().unwrap_err();
            assert!(error.contains("allowed are"), "{bad}: {error}");
        }
    }
}
