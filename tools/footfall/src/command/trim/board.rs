//! The board as a trim sees it: requests and their outcomes, its state, and the pulse of the joint's servo.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use joint_loop::tuning::{Action, Outcome};
use joint_loop::{Cause, SupervisorState};
use joint_units::{Joint, PulseMicros};
use wire::{Answered, Record};

use crate::board::requests::{ANSWER_WITHIN, Requests};
use crate::board::serial::Port;
use crate::board::transport::{Heard, Transport};
use crate::failure::Failure;
use crate::file::capture::rtt::Came;

/// Longest silence.
const PATIENCE: Duration = Duration::from_secs(5);
/// Time for which one call listens.
const MOMENT: Duration = Duration::from_millis(20);

/// What a board does in a trim.
pub(super) trait Trimmed {
    /// Asks for something; what became of it.
    fn ask(&mut self, action: Action) -> Result<Outcome, Failure>;

    /// Listens for a moment; what the board reported last, nothing before its first report.
    fn listen(&mut self) -> Result<Option<Seen>, Failure>;
}

/// What a board reports of itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Seen {
    /// Control periods since the boot.
    pub(super) tick: u32,
    pub(super) state: SupervisorState,
    pub(super) cause: Cause,
    /// Of all servos, in joint order; 0 is no pulse.
    pub(super) pulses: [PulseMicros; Joint::COUNT],
}

/// A board behind a serial port.
pub(super) struct Board<'a> {
    place: String,
    port: Port,
    transport: Transport<'static>,
    requests: Requests,
    interrupt: &'a AtomicBool,
    answers: Vec<Answered>,
    seen: Option<Seen>,
    heard: Instant,
}

impl<'a> Board<'a> {
    pub(super) fn open(path: &Path, interrupt: &'a AtomicBool) -> Result<Self, Failure> {
        let place = path.display().to_string();
        let port =
            Port::open(path, true).map_err(|error| Failure::input(format!("{place}: cannot be opened: {error}")))?;
        let (transport, requests) = (Transport::serial(), Requests::default());
        Ok(Self { place, port, transport, requests, interrupt, answers: vec![], seen: None, heard: Instant::now() })
    }

    fn receive(&mut self, within: Duration) -> Result<(), Failure> {
        let place = &self.place;
        let bytes = match self.port.next_within(within) {
            Came::Bytes(bytes) => bytes,
            Came::Nothing if self.heard.elapsed() < PATIENCE => return Ok(()),
            Came::Nothing => {
                return Err(Failure::run(format!(
                    "{place}: the board is silent; check that it runs and that this is its port, 2 Mbaud (a board that stays off sends nothing: see its lamps)"
                )));
            }
            Came::End => return Err(Failure::run(format!("{place}: the port was closed"))),
            Came::Broken(error) => return Err(Failure::run(format!("{place}: the port failed: {error}"))),
        };
        self.heard = Instant::now();
        let (seen, answers) = (&mut self.seen, &mut self.answers);
        let pushed = self.transport.push(&bytes, |heard| match heard {
            Heard::Record(Record::Frame(frame)) => {
                let pulses = frame.pulses_us.map(PulseMicros);
                *seen = Some(Seen { tick: frame.tick, state: frame.state, cause: frame.cause, pulses });
            }
            Heard::Record(Record::Answered(answer)) => answers.push(answer),
            _ => {}
        });
        pushed.map_err(|error| Failure::run(format!("{place}: {error}")))
    }
}

impl Trimmed for Board<'_> {
    fn ask(&mut self, action: Action) -> Result<Outcome, Failure> {
        let request = self.requests.ask(action, Instant::now());
        let place = &self.place;
        self.port
            .send(&request)
            .map_err(|error| Failure::run(format!("{place}: does not take the request: {error}")))?;
        let until = Instant::now() + ANSWER_WITHIN;
        loop {
            self.receive(MOMENT)?;
            if let Some(answer) = self.answers.drain(..).find(|answer| answer.number == request.number) {
                return Ok(answer.outcome);
            }
            if Instant::now() >= until {
                return Err(Failure::run(format!("{}: no answer to the request", self.place)));
            }
        }
    }

    fn listen(&mut self) -> Result<Option<Seen>, Failure> {
        if self.interrupt.load(Ordering::Relaxed) {
            return Err(Failure::run("asked to end; nothing is written"));
        }
        self.receive(MOMENT)?;
        Ok(self.seen)
    }
}
