//! The board as a trim sees it: requests and their outcomes, its state, and the pulse of the joint's servo.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use joint_loop::tuning::Action;
use joint_loop::{Cause, SupervisorState};
use joint_units::{Joint, PulseMicros};
use wire::{Answered, Record};

use crate::board::at_port::AtPort;
use crate::board::requests::{ANSWER_WITHIN, Requests};
use crate::board::source::Origin;
use crate::failure::Failure;

/// What a board does in a trim.
pub(super) trait Trimmed {
    /// Asks for something; what became of it, and in which tick.
    fn ask(&mut self, action: Action) -> Result<Answered, Failure>;

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

/// A board at its serial port, or at a debug probe.
pub(super) struct Board<'a> {
    port: AtPort<'a>,
    requests: Requests,
    answers: Vec<Answered>,
    seen: Option<Seen>,
}

impl<'a> Board<'a> {
    pub(super) fn open(origin: Origin, interrupt: &'a AtomicBool) -> Result<Self, Failure> {
        let port = AtPort::open(origin, interrupt)?;
        Ok(Self { port, requests: Requests::default(), answers: vec![], seen: None })
    }

    fn receive(&mut self) -> Result<(), Failure> {
        let (seen, answers) = (&mut self.seen, &mut self.answers);
        self.port.receive(|record| match record {
            Record::Frame(frame) => {
                let pulses = frame.pulses_us.map(PulseMicros);
                *seen = Some(Seen { tick: frame.tick, state: frame.state, cause: frame.cause, pulses });
            }
            Record::Answered(answer) => answers.push(answer),
            _ => {}
        })
    }
}

impl Trimmed for Board<'_> {
    fn ask(&mut self, action: Action) -> Result<Answered, Failure> {
        let request = self.requests.ask(action, Instant::now());
        self.port.send(&request)?;
        let until = Instant::now() + ANSWER_WITHIN;
        while Instant::now() < until {
            self.receive()?;
            if let Some(answer) = self.answers.drain(..).find(|answer| answer.number == request.number) {
                return Ok(answer);
            }
        }
        Err(self.port.no_answer())
    }

    fn listen(&mut self) -> Result<Option<Seen>, Failure> {
        self.receive()?;
        Ok(self.seen)
    }
}
