//! Sources of a board's records: RTT channel 1, as a debug probe's program passes it on.
//!
//! | source | meaning |
//! |---|---|
//! | a file or a named pipe | bytes saved by `nc` from a server or by J-Link's RTT Logger |
//! | `-` | standard input |
//! | `tcp:HOST:PORT` | a server of raw bytes: OpenOCD's `rtt server start PORT 1`. What is sent to it goes to the board |
//! | `jlink:HOST:PORT` | the same of J-Link, on port 19021, which is asked for channel 1 |
//! | `tcp-listen:HOST:PORT` | a program that connects here: `cargo embed`, with that address as the `socket` of channel 1 |
//!
//! A thread reads, so that the disk does not block it; its queue is bounded, and when it is full the source waits. A board whose source
//! waits drops whole frames, which the gaps of its records show.

use std::fs::File;
use std::io::{self, Read, Write};
use std::net::{TcpListener, TcpStream, ToSocketAddrs};
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

/// Reads in the queue.
const QUEUE: usize = 1024;

/// Longest time to a connection with one address of a server.
const CONNECT_WITHIN: Duration = Duration::from_secs(3);

/// Silence of a server after which the board is asked to send: it sends no records while a program that shows text has set its log to wait, and
/// one that was killed leaves it so. A zero ends a frame, and is none.
const ASK_AFTER: Duration = Duration::from_secs(1);

/// Asks J-Link for channel 1, within 100 ms of the connection (SEGGER, "J-Link RTT TELNET Channel").
const JLINK_CHANNEL: &[u8] = b"$$SEGGER_TELNET_ConfigStr=RTTCh;1$$";

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
    /// The server of J-Link: `HOST:PORT`.
    JLink(String),
    /// A program that connects to this address, `HOST:PORT`.
    TcpListen(String),
}

impl FromStr for Source {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wanted = || {
            format!(
                "`{text}`: allowed are a file, `-` for standard input, tcp:HOST:PORT for a server, jlink:HOST:PORT for that of J-Link, and \
                 tcp-listen:HOST:PORT for a program that connects"
            )
        };
        let address = |address: &str| match address.rsplit_once(':') {
            Some((host, port)) if !host.is_empty() && port.parse::<u16>().is_ok_and(|port| port > 0) => {
                Ok(address.to_owned())
            }
            _ => Err(wanted()),
        };
        match text.split_once(':') {
            Some(("tcp", server)) => address(server).map(Self::Tcp),
            Some(("jlink", server)) => address(server).map(Self::JLink),
            Some(("tcp-listen", here)) => address(here).map(Self::TcpListen),
            _ if text == "-" => Ok(Self::Stdin),
            _ if text.is_empty() => Err(wanted()),
            _ => Ok(Self::File(text.into())),
        }
    }
}

impl std::fmt::Display for Source {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::File(path) => path.display().fmt(f),
            Self::Stdin => f.write_str("standard input"),
            Self::Tcp(address) => write!(f, "tcp:{address}"),
            Self::JLink(address) => write!(f, "jlink:{address}"),
            Self::TcpListen(address) => write!(f, "tcp-listen:{address}"),
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
    /// The way back to the board.
    server: Option<Server>,
}

/// A server that passes on what it gets.
#[derive(Debug)]
struct Server {
    stream: TcpStream,
    /// When the board is asked to send, if nothing has come by then.
    ask_at: Option<Instant>,
}

impl Stream {
    /// Opens a source.
    ///
    /// # Errors
    /// The file or server does not exist, or the address is not of this computer or is taken.
    pub fn open(source: &Source) -> io::Result<Self> {
        Ok(match source {
            Source::File(path) => Self::of(File::open(path)?),
            Source::Stdin => Self::of(io::stdin()),
            Source::Tcp(address) | Source::JLink(address) => {
                let mut stream = connected(address)?;
                if matches!(source, Source::JLink(_)) {
                    stream.write_all(JLINK_CHANNEL)?;
                }
                let server = Server { stream: stream.try_clone()?, ask_at: Some(Instant::now() + ASK_AFTER) };
                Self { server: Some(server), ..Self::of(stream) }
            }
            Source::TcpListen(address) => Self::of(Awaited { listener: TcpListener::bind(address)?, stream: None }),
        })
    }

    /// Whether bytes can be sent to the board.
    #[must_use]
    pub const fn takes_requests(&self) -> bool {
        self.server.is_some()
    }

    /// Sends bytes to the board.
    ///
    /// # Errors
    /// The source is no server, or does not take them.
    pub fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        let server = self.server.as_mut().ok_or(io::ErrorKind::Unsupported)?;
        server.stream.write_all(bytes)
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
        Self { receiver, server: None }
    }

    /// Waits at most this long for bytes.
    #[must_use]
    pub fn next(&mut self, patience: Duration) -> Came {
        let came = match self.receiver.recv_timeout(patience) {
            Ok(Ok(bytes)) => Came::Bytes(bytes),
            Ok(Err(error)) => Came::Broken(error),
            Err(RecvTimeoutError::Timeout) => Came::Nothing,
            Err(RecvTimeoutError::Disconnected) => Came::End,
        };
        if let Some(Server { stream, ask_at }) = &mut self.server
            && let Some(at) = *ask_at
        {
            let is_silent = matches!(came, Came::Nothing);
            if is_silent && Instant::now() >= at {
                // A server that does not take it sends nothing either, and that is reported.
                let _ = stream.write_all(&[0]);
            }
            *ask_at = (is_silent && Instant::now() < at).then_some(at);
        }
        came
    }
}

/// The first program that connects.
struct Awaited {
    listener: TcpListener,
    stream: Option<TcpStream>,
}

impl Read for Awaited {
    fn read(&mut self, block: &mut [u8]) -> io::Result<usize> {
        let stream = match &mut self.stream {
            Some(stream) => stream,
            none => none.insert(self.listener.accept()?.0),
        };
        stream.read(block)
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
        assert_eq!("tcp-listen:localhost:9090".parse(), Ok(Source::TcpListen("localhost:9090".into())));
        assert_eq!("jlink:localhost:19021".parse(), Ok(Source::JLink("localhost:19021".into())));
        for bad in [
            "",
            "tcp:",
            "tcp:localhost",
            "tcp::9090",
            "tcp:localhost:0",
            "tcp:localhost:port",
            "tcp-listen:9090",
            "tcp-listen:localhost:0",
        ] {
            let error = bad.parse::<Source>().unwrap_err();
            assert!(error.contains("allowed are"), "{bad}: {error}");
        }
    }

    #[test]
    fn a_silent_server_is_asked_once_and_a_request_goes_back() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let source = Source::JLink(listener.local_addr().unwrap().to_string());
        let mut stream = Stream::open(&source).unwrap();
        let (mut board, _) = listener.accept().unwrap();
        let mut asked = [0; JLINK_CHANNEL.len()];
        board.read_exact(&mut asked).unwrap();
        assert_eq!(asked, JLINK_CHANNEL);
        let began = Instant::now();
        while began.elapsed() < ASK_AFTER + Duration::from_millis(300) {
            assert!(matches!(stream.next(Duration::from_millis(10)), Came::Nothing));
        }
        stream.send(b"abc").unwrap();
        let mut got = [9; 4];
        board.read_exact(&mut got).unwrap();
        assert_eq!(&got, b"\0abc");
    }

    #[test]
    fn a_program_that_connects_is_a_source() {
        // A free port, for the moment.
        let address = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
        let mut stream = Stream::open(&Source::TcpListen(address.clone())).unwrap();
        assert!(!stream.takes_requests() && stream.send(b"a").is_err());
        let mut program = TcpStream::connect(&address).unwrap();
        program.write_all(b"abc").unwrap();
        drop(program);
        assert!(matches!(stream.next(Duration::from_secs(5)), Came::Bytes(bytes) if bytes == b"abc"));
        assert!(matches!(stream.next(Duration::from_secs(5)), Came::End));
    }
}
