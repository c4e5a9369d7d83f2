//! A board that takes requests, at its serial port or through a debug probe, for a command that asks it something: requests out, records in, and
//! words for what is wrong.

use joint_loop::SupervisorState;
use joint_loop::tuning::Request;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use wire::{Record, Settings};

use crate::board::source::{Opened, Origin};
use crate::board::transport::{Heard, Transport};
use crate::failure::Failure;
use crate::file::capture::rtt::Came;

/// Longest silence. A board sends a record each second at least.
const PATIENCE: Duration = Duration::from_secs(5);
/// Time for which one call listens.
const MOMENT: Duration = Duration::from_millis(20);

/// What a board reports of itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reported {
    /// The settings in effect.
    pub settings: Settings,
    /// State of its supervisor.
    pub state: SupervisorState,
}

/// The board, and what a signal sets that asks the command to end.
pub struct AtPort<'a> {
    origin: Origin,
    opened: Opened,
    transport: Transport,
    last_record: Instant,
    interrupt: &'a AtomicBool,
}

impl<'a> AtPort<'a> {
    /// Opens a port or a server, for requests too.
    ///
    /// # Errors
    /// There is no such port or server, it may not be opened, or it takes no requests.
    pub fn open(origin: Origin, interrupt: &'a AtomicBool) -> Result<Self, Failure> {
        let opened =
            origin.open(true).map_err(|error| Failure::input(format!("{origin}: cannot be opened: {error}")))?;
        if matches!(origin, Origin::Rtt(_)) && !opened.takes_requests() {
            return Err(Failure::input(format!(
                "{origin}: takes no requests; allowed is a server, tcp:HOST:PORT or jlink:HOST:PORT"
            )));
        }
        Ok(Self { origin, opened, transport: Transport::default(), last_record: Instant::now(), interrupt })
    }

    /// Sends a request.
    ///
    /// # Errors
    /// The port does not take it.
    pub fn send(&mut self, request: &Request) -> Result<(), Failure> {
        let origin = &self.origin;
        self.opened.send(request).map_err(|error| Failure::run(format!("{origin}: does not take the request: {error}")))
    }

    /// Listens for a moment, and passes on the records that come.
    ///
    /// # Errors
    /// The port ends or fails, is silent for seconds, has records of another version, or the command is asked to end.
    pub fn receive(&mut self, mut each: impl FnMut(Record)) -> Result<(), Failure> {
        let origin = &self.origin;
        if self.interrupt.load(Ordering::Relaxed) {
            return Err(Failure::run("asked to end before it was done; nothing is written"));
        }
        if self.last_record.elapsed() > PATIENCE {
            return Err(Failure::run(format!("{origin}: the board is silent; {}", origin.to_check())));
        }
        let bytes = match self.opened.next(MOMENT) {
            Came::Bytes(bytes) => bytes,
            Came::Nothing => return Ok(()),
            Came::End => return Err(Failure::run(format!("{origin}: the port was closed"))),
            Came::Broken(error) => return Err(Failure::run(format!("{origin}: the port failed: {error}"))),
        };
        let last_record = &mut self.last_record;
        let pushed = self.transport.push(&bytes, |heard| {
            if let Heard::Record(record) = heard {
                *last_record = Instant::now();
                each(record);
            }
        });
        pushed.map_err(|error| Failure::run(format!("{origin}: {error}")))
    }

    /// No answer came to a request.
    #[must_use]
    pub fn no_answer(&self) -> Failure {
        Failure::run(format!("{}: no answer to the request; {}", self.origin, self.origin.to_check()))
    }

    /// Waits for the board's next report: it sends one each second.
    ///
    /// # Errors
    /// As [`AtPort::receive`], or no report comes.
    pub fn report(&mut self) -> Result<Reported, Failure> {
        let until = Instant::now() + PATIENCE;
        let (mut settings, mut state) = (None, None);
        while Instant::now() < until {
            self.receive(|record| match record {
                Record::Settings(record) => settings = Some(record),
                Record::Frame(frame) => state = Some(frame.state),
                _ => {}
            })?;
            if let (Some(settings), Some(state)) = (settings, state) {
                return Ok(Reported { settings, state });
            }
        }
        Err(Failure::run(format!("{}: no report of the settings within 5 s; {}", self.origin, self.origin.to_check())))
    }
}
