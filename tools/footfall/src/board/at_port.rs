//! A board at its serial port, for a command that asks it something: requests out, records in, and words for what is wrong.

use joint_loop::SupervisorState;
use joint_loop::tuning::Request;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use wire::{Record, Settings};

use crate::board::serial::Port;
use crate::board::source::Origin;
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
    port: Port,
    transport: Transport<'static>,
    last_byte: Instant,
    interrupt: &'a AtomicBool,
}

impl<'a> AtPort<'a> {
    /// Opens a port, for requests too.
    ///
    /// # Errors
    /// There is no such port, or it may not be opened.
    pub fn open(path: &Path, interrupt: &'a AtomicBool) -> Result<Self, Failure> {
        let origin = Origin::Serial(path.into());
        let port =
            Port::open(path, true).map_err(|error| Failure::input(format!("{origin}: cannot be opened: {error}")))?;
        Ok(Self { origin, port, transport: Transport::serial(), last_byte: Instant::now(), interrupt })
    }

    /// Sends a request.
    ///
    /// # Errors
    /// The port does not take it.
    pub fn send(&mut self, request: &Request) -> Result<(), Failure> {
        let origin = &self.origin;
        self.port.send(request).map_err(|error| Failure::run(format!("{origin}: does not take the request: {error}")))
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
        let bytes = match self.port.next_within(MOMENT) {
            Came::Bytes(bytes) => bytes,
            Came::Nothing if self.last_byte.elapsed() < PATIENCE => return Ok(()),
            Came::Nothing => {
                return Err(Failure::run(format!("{origin}: the board is silent; {}", origin.to_check())));
            }
            Came::End => return Err(Failure::run(format!("{origin}: the port was closed"))),
            Came::Broken(error) => return Err(Failure::run(format!("{origin}: the port failed: {error}"))),
        };
        self.last_byte = Instant::now();
        let pushed = self.transport.push(&bytes, |heard| {
            if let Heard::Record(record) = heard {
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
