//! The board as a trim sees it: requests and their outcomes, its state, and the pulse of the joint's servo.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use joint_loop::tuning::{Action, Outcome, Request};
use joint_loop::{Cause, SupervisorState};
use joint_units::{Joint, PulseMicros};
use wire::{Answered, Record};

use crate::board::serial::{Port, Records, is_other_version};
use crate::failure::Failure;
use crate::file::capture::rtt::Came;

/// Longest time to an answer, and longest silence.
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
    records: Records,
    interrupt: &'a AtomicBool,
    number: u16,
    answer: Option<Answered>,
    seen: Option<Seen>,
    heard: Instant,
}

impl<'a> Board<'a> {
    pub(super) fn open(path: &Path, interrupt: &'a AtomicBool) -> Result<Self, Failure> {
        let place = path.display().to_string();
        let port =
            Port::open(path, true).map_err(|error| Failure::input(format!("{place}: cannot be opened: {error}")))?;
        let (records, heard) = (Records::default(), Instant::now());
        Ok(Self { place, port, records, interrupt, number: 0, answer: None, seen: None, heard })
    }

    fn receive(&mut self, within: Duration) -> Result<(), Failure> {
        let place = &self.place;
        let bytes = match self.port.next_within(within) {
            Came::Bytes(bytes) => bytes,
            Came::Nothing if self.heard.elapsed() < PATIENCE => return Ok(()),
            Came::Nothing => {
                return Err(Failure::run(format!(
                    "{place}: the board is silent; check that it runs and that this is its port, 2 Mbaud"
                )));
            }
            Came::End => return Err(Failure::run(format!("{place}: the port was closed"))),
            Came::Broken(error) => return Err(Failure::run(format!("{place}: the port failed: {error}"))),
        };
        self.heard = Instant::now();
        for record in self.records.push(&bytes) {
            match record {
                Ok(Record::Frame(frame)) => {
                    let pulses = frame.pulses_us.map(PulseMicros);
                    self.seen = Some(Seen { tick: frame.tick, state: frame.state, cause: frame.cause, pulses });
                }
                Ok(Record::Answered(answer)) if answer.number == self.number => self.answer = Some(answer),
                Err(error) if is_other_version(&record) => return Err(Failure::run(format!("{place}: {error}"))),
                _ => {}
            }
        }
        Ok(())
    }
}

impl Trimmed for Board<'_> {
    fn ask(&mut self, action: Action) -> Result<Outcome, Failure> {
        self.number = self.number.wrapping_add(1);
        self.answer = None;
        let place = &self.place;
        self.port
            .send(&Request { number: self.number, action })
            .map_err(|error| Failure::run(format!("{place}: does not take the request: {error}")))?;
        let until = Instant::now() + PATIENCE;
        loop {
            self.receive(MOMENT)?;
            if let Some(answer) = self.answer {
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
