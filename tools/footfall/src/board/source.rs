//! Where the records of a real board come from: its serial port, or a debug probe's RTT channel 1; and the way back for requests.

use joint_loop::tuning::Request;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::time::Duration;
use std::{fmt, io};

use crate::board::serial::{Port, sent};
use crate::file::capture::rtt::{Came, Source, Stream};

/// Where the bytes come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Origin {
    /// RTT channel 1.
    Rtt(Source),
    /// The serial port: a device file.
    Serial(PathBuf),
}

impl Origin {
    /// Opens it; a serial port with `send` also for requests.
    ///
    /// # Errors
    /// The file, server or port does not exist, or may not be opened.
    pub fn open(&self, send: bool) -> io::Result<Opened> {
        match self {
            Self::Rtt(source) => Stream::open(source).map(Opened::Stream),
            Self::Serial(path) => Port::open(path, send).map(Opened::Serial),
        }
    }

    /// Whether it can come back after its end: a server or a port, not a file.
    #[must_use]
    pub const fn comes_back(&self) -> bool {
        matches!(self, Self::Serial(_) | Self::Rtt(Source::Tcp(_) | Source::JLink(_) | Source::TcpListen(_)))
    }

    /// Whether the bytes are those of a chip: from a port of hardware, or through a debug probe. A pseudo-terminal is mostly that of a virtual
    /// board, and a file can be of both.
    #[must_use]
    pub fn is_of_a_chip(&self) -> bool {
        match self {
            Self::Serial(path) => {
                let place = path.canonicalize().unwrap_or_else(|_| path.clone());
                !["/dev/pts/", "/dev/ttys"].iter().any(|begin| place.to_string_lossy().starts_with(begin))
            }
            Self::Rtt(source) => !matches!(source, Source::File(_)),
        }
    }

    /// Whether it is standard input.
    #[must_use]
    pub const fn is_stdin(&self) -> bool {
        matches!(self, Self::Rtt(Source::Stdin))
    }

    /// What to check when no record comes.
    #[must_use]
    pub const fn to_check(&self) -> &'static str {
        match self {
            Self::Serial(_) => {
                "check that the board runs (a board that stays off sends nothing: see its lamps) and that this is its port, 1 Mbaud"
            }
            Self::Rtt(_) => {
                "check that the board runs, that the probe's program is attached and has found the RTT control block, and that this is channel 1"
            }
        }
    }

    /// As an object, for the file beside a capture.
    #[must_use]
    pub fn about(&self, secs: Option<f64>) -> Value {
        match self {
            Self::Rtt(source) => json!({ "rtt": source.to_string(), "secs": secs }),
            Self::Serial(port) => json!({ "serial": port, "secs": secs }),
        }
    }
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Rtt(source) => source.fmt(f),
            Self::Serial(path) => path.display().fmt(f),
        }
    }
}

/// The same, open.
#[derive(Debug)]
pub enum Opened {
    /// RTT channel 1.
    Stream(Stream),
    /// A serial port.
    Serial(Port),
}

impl Opened {
    /// Waits at most this long for bytes.
    #[must_use]
    pub fn next(&mut self, patience: Duration) -> Came {
        match self {
            Self::Stream(stream) => stream.next(patience),
            Self::Serial(port) => port.next_within(patience),
        }
    }

    /// Whether the board can be sent requests.
    #[must_use]
    pub fn takes_requests(&self) -> bool {
        match self {
            Self::Stream(stream) => stream.takes_requests(),
            Self::Serial(port) => port.takes_requests(),
        }
    }

    /// Sends a request.
    ///
    /// # Errors
    /// The port or the server does not take it.
    pub fn send(&mut self, request: &Request) -> io::Result<()> {
        match self {
            Self::Stream(stream) => stream.send(&sent(request)),
            Self::Serial(port) => port.send(request),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pseudo_terminal_or_a_file_can_be_of_a_virtual_board() {
        let serial = |path: &str| Origin::Serial(path.into());
        for either in [serial("/dev/pts/7"), Origin::Rtt(Source::File("walk.rtt".into()))] {
            assert!(!either.is_of_a_chip(), "{either:?}");
        }
        for chip in [serial("/dev/ttyACM0"), Origin::Rtt(Source::Stdin), Origin::Rtt(Source::Tcp("a:1".into()))] {
            assert!(chip.is_of_a_chip(), "{chip:?}");
        }
    }
}
