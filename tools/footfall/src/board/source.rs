//! Where the bytes of a board that runs come from: its serial port, or its log from a debug probe.

use serde_json::{Value, json};
use std::path::PathBuf;
use std::time::Duration;
use std::{fmt, io};

use crate::board::image::Image;
use crate::board::serial::Port;
use crate::board::transport::Transport;
use crate::file::capture::rtt::{Came, Source, Stream};

/// Where the bytes come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Origin {
    /// The raw bytes of the log.
    Log(Source),
    /// The lines of the log, as `probe-rs` prints them.
    Lines(Source),
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
            Self::Log(source) | Self::Lines(source) => Stream::open(source).map(Opened::Stream),
            Self::Serial(path) => Port::open(path, send).map(Opened::Serial),
        }
    }

    /// What finds the records in its bytes. The image is that of [`Origin::Log`], which nothing is read from without it.
    #[must_use]
    pub fn transport<'t>(&self, image: Option<&'t Image>) -> Transport<'t> {
        match (self, image) {
            (Self::Log(_), Some(image)) => Transport::log(image),
            (Self::Log(_) | Self::Lines(_), _) => Transport::lines(),
            (Self::Serial(_), _) => Transport::serial(),
        }
    }

    /// Whether it can come back after its end: a server or a port, not a file.
    #[must_use]
    pub const fn comes_back(&self) -> bool {
        matches!(self, Self::Serial(_) | Self::Log(Source::Tcp(_)) | Self::Lines(Source::Tcp(_)))
    }

    /// Whether the bytes are those of a chip: from a port of hardware, or from what reads a log through a debug probe, which a virtual board does not serve. A
    /// pseudo-terminal is mostly that of a virtual board, and a file can be of both.
    #[must_use]
    pub fn is_of_a_chip(&self) -> bool {
        match self {
            Self::Serial(path) => {
                let place = path.canonicalize().unwrap_or_else(|_| path.clone());
                let is_pseudo =
                    ["/dev/pts/", "/dev/ttys"].iter().any(|begin| place.to_string_lossy().starts_with(begin));
                !is_pseudo && !place.is_file()
            }
            Self::Log(source) | Self::Lines(source) => !matches!(source, Source::File(_)),
        }
    }

    /// Whether it is standard input.
    #[must_use]
    pub const fn is_stdin(&self) -> bool {
        matches!(self, Self::Log(Source::Stdin) | Self::Lines(Source::Stdin))
    }

    /// What to check when no byte comes.
    #[must_use]
    pub const fn to_check(&self) -> &'static str {
        match self {
            Self::Serial(_) => {
                "check that the board runs (a board that stays off sends nothing: see its lamps) and that this is its port, 1 Mbaud"
            }
            Self::Log(_) => {
                "check that the board runs, that the probe's program is attached and has found the RTT control block, and that this is channel 0"
            }
            Self::Lines(_) => {
                "check that the board runs, and the messages of probe-rs: is it attached, has it found the RTT control block"
            }
        }
    }

    /// As an object, for the file beside a capture.
    #[must_use]
    pub fn about(&self, secs: Option<f64>) -> Value {
        match self {
            Self::Log(source) => json!({ "rtt": source.to_string(), "secs": secs }),
            Self::Lines(source) => json!({ "rtt_lines": source.to_string(), "secs": secs }),
            Self::Serial(port) => json!({ "serial": port, "secs": secs }),
        }
    }
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Log(source) | Self::Lines(source) => source.fmt(f),
            Self::Serial(path) => path.display().fmt(f),
        }
    }
}

/// The same, open.
#[derive(Debug)]
pub enum Opened {
    /// A log.
    Stream(Stream),
    /// A serial port.
    Serial(Port),
}

impl Opened {
    /// Waits at most this long for bytes.
    #[must_use]
    pub fn next(&self, patience: Duration) -> Came {
        match self {
            Self::Stream(stream) => stream.next(patience),
            Self::Serial(port) => port.next_within(patience),
        }
    }

    /// The port that takes requests, if it is one.
    pub fn port(&mut self) -> Option<&mut Port> {
        match self {
            Self::Serial(port) if port.takes_requests() => Some(port),
            Self::Stream(_) | Self::Serial(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pseudo_terminal_or_a_file_can_be_of_a_virtual_board() {
        let file = tempfile::NamedTempFile::new().expect("a file");
        let serial = |path: &str| Origin::Serial(path.into());
        for either in [
            serial("/dev/pts/7"),
            serial(file.path().to_str().expect("a path")),
            Origin::Log(Source::File("walk.rtt".into())),
        ] {
            assert!(!either.is_of_a_chip(), "{either:?}");
        }
        for chip in [serial("/dev/ttyACM0"), Origin::Lines(Source::Stdin), Origin::Log(Source::Tcp("a:1".into()))] {
            assert!(chip.is_of_a_chip(), "{chip:?}");
        }
    }
}
