//! A host at the serial port of a board: what it has read so far, and what it asks for.

use footfall::board::serial::{Port, Records};
use footfall::file::capture::rtt::Came;
use joint_loop::SupervisorState;
use joint_loop::tuning::{Action, Outcome, Request};
use std::path::Path;
use std::time::Duration;
use wire::{Answered, Record};

/// A port, and what has come from it.
pub struct Host {
    port: Port,
    records: Records,
    /// The answers so far.
    pub answers: Vec<Answered>,
    /// Tick of the last frame.
    pub tick: u32,
    /// State in the last frame.
    pub state: SupervisorState,
    /// Frames that came.
    pub frames: u32,
    /// Bytes that came.
    pub bytes: u32,
    /// The last counters of the port.
    pub counts: wire::Port,
}

impl Host {
    /// Opens the port.
    ///
    /// # Panics
    /// It cannot be opened.
    #[must_use]
    pub fn open(path: &Path) -> Self {
        let port = Port::open(path, true).expect("the board's port");
        let (records, answers) = (Records::default(), Vec::new());
        let (state, counts) = (SupervisorState::Boot, wire::Port::default());
        Self { port, records, answers, tick: 0, state, frames: 0, bytes: 0, counts }
    }

    /// Reads on until something holds, half a minute of the board at most.
    ///
    /// # Panics
    /// It does not hold in that time, or the port ends.
    pub fn until(&mut self, what: &str, done: impl Fn(&Self) -> bool) {
        // From the first frame on that comes: the board may have run for long when the port is opened.
        let mut last = None;
        while !done(self) {
            assert!(last.is_none_or(|last| self.tick < last), "{what}: not within half a minute, tick {}", self.tick);
            let Came::Bytes(bytes) = self.port.next_within(Duration::from_secs(60)) else { panic!("{what}: no bytes") };
            self.bytes += bytes.len() as u32;
            for record in bytes.into_iter().filter_map(|byte| self.records.push(byte)) {
                match record {
                    Ok(Record::Frame(frame)) => {
                        (self.tick, self.state) = (frame.tick, frame.state);
                        self.frames += 1;
                        last.get_or_insert(frame.tick + 30_000);
                    }
                    Ok(Record::Answered(answer)) => self.answers.push(answer),
                    Ok(Record::Port(counts)) => self.counts = counts,
                    Ok(_) | Err(_) => {}
                }
            }
        }
    }

    /// Reads on for so many ticks of the board.
    ///
    /// # Panics
    /// The port ends.
    pub fn wait(&mut self, ticks: u32) {
        let until = self.tick + ticks;
        self.until("frames", |host| host.tick >= until);
    }

    /// Sends a request.
    ///
    /// # Panics
    /// The port does not take it.
    pub fn ask(&mut self, number: u16, action: Action) {
        self.port.send(&Request { number, action }).expect("sent");
    }

    /// Whether the request of this number has had this outcome.
    #[must_use]
    pub fn answered(&self, number: u16, outcome: Outcome) -> bool {
        self.answers.iter().any(|answer| answer.number == number && answer.outcome == outcome)
    }
}
