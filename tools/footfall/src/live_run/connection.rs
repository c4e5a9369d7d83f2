//! The connection to a board that runs: opened, silent, ended, opened again; always with words for what is wrong with it.

use std::time::{Duration, Instant};

use crate::board::source::{Opened, Origin};
use crate::board::transport::{Heard, Transport};
use crate::failure::Failure;
use crate::file::capture::rtt::Came;

/// Time without a record after which the user is asked to check something. A board sends a record each second at least.
const SILENCE: Duration = Duration::from_secs(5);

/// Time from one attempt to open a source again to the next.
const RETRY: Duration = Duration::from_secs(1);

/// What came.
#[derive(Debug)]
pub(super) enum Received {
    /// What the board sent; nothing within the time limit if it is empty.
    Heard(Vec<Heard>),
    /// A source was opened again: the board may have been reset.
    Again,
    /// The end of the source. It does not come back, or the caller does not wait for it.
    End,
}

/// A connection.
pub(super) struct Connection<'a> {
    origin: &'a Origin,
    transport: Transport,
    opened: Option<Opened>,
    /// The last byte and the last record, or the beginning.
    last_byte: Instant,
    last_record: Instant,
    next_attempt: Instant,
    /// Why it is closed.
    why_closed: String,
    /// It is opened again after its end.
    waits: bool,
}

impl<'a> Connection<'a> {
    /// Opens the source; for requests too, where it takes them. With `waits` a port or a server is opened again after its end.
    pub(super) fn open(origin: &'a Origin, waits: bool) -> Result<Self, Failure> {
        let opened = opened(origin).map_err(|error| Failure::input(format!("{origin}: cannot be opened: {error}")))?;
        let now = Instant::now();
        Ok(Self {
            origin,
            transport: Transport::default(),
            opened: Some(opened),
            last_byte: now,
            last_record: now,
            next_attempt: now,
            why_closed: String::new(),
            waits: waits && origin.comes_back(),
        })
    }

    /// The way to the board, if it takes requests.
    pub(super) fn requests(&mut self) -> Option<&mut Opened> {
        self.opened.as_mut().filter(|opened| opened.takes_requests())
    }

    /// Waits at most this long for what comes next.
    ///
    /// # Errors
    /// The bytes are not of a board or of another version, or the source failed and is not waited for.
    pub(super) fn next(&mut self, patience: Duration) -> Result<Received, Failure> {
        let Some(open) = &mut self.opened else { return Ok(self.retry(patience)) };
        match open.next(patience) {
            Came::Bytes(bytes) => {
                self.last_byte = Instant::now();
                let (origin, mut all) = (self.origin, Vec::new());
                self.transport
                    .push(&bytes, |heard| all.push(heard))
                    .map_err(|error| Failure::run(format!("{origin}: {error}")))?;
                if all.iter().any(|heard| matches!(heard, Heard::Record(_))) {
                    self.last_record = self.last_byte;
                }
                Ok(Received::Heard(all))
            }
            Came::Nothing => Ok(Received::Heard(Vec::new())),
            Came::End if !self.waits => Ok(Received::End),
            Came::Broken(error) if !self.waits => {
                Err(Failure::run(format!("{}: the connection failed: {error}", self.origin)))
            }
            Came::End => Ok(self.close("it has ended".into())),
            Came::Broken(error) => Ok(self.close(error.to_string())),
        }
    }

    fn close(&mut self, why: String) -> Received {
        self.opened = None;
        (self.why_closed, self.next_attempt) = (why, Instant::now() + RETRY);
        Received::Heard(Vec::new())
    }

    fn retry(&mut self, patience: Duration) -> Received {
        std::thread::sleep(patience);
        if Instant::now() < self.next_attempt {
            return Received::Heard(Vec::new());
        }
        match opened(self.origin) {
            Ok(opened) => {
                self.transport.restart();
                (self.opened, self.last_byte) = (Some(opened), Instant::now());
                self.last_record = self.last_byte;
                Received::Again
            }
            Err(error) => self.close(error.to_string()),
        }
    }

    /// What is wrong, in one line.
    pub(super) fn alarm(&self) -> Option<String> {
        let origin = self.origin;
        if self.opened.is_none() {
            return Some(format!("{origin} is closed ({}); tried again every second", self.why_closed));
        }
        let silent = self.last_record.elapsed();
        let what = if self.last_byte.elapsed() >= SILENCE { "byte" } else { "record" };
        (silent >= SILENCE).then(|| format!("no {what} for {} s; {}", silent.as_secs(), origin.to_check()))
    }
}

/// A port that may not be written to is opened for reading alone: its board can be watched.
fn opened(origin: &Origin) -> std::io::Result<Opened> {
    origin.open(true).or_else(|_| origin.open(false))
}
