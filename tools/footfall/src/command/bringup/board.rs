//! The board at its serial port. The port of a board that is fed through it goes away with its supply, and comes back.

use joint_loop::SupervisorState;
use joint_loop::tuning::{Action, Outcome};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use wire::{Answered, Boot, Call, Change, Cost, Edge, Environment, Frame, Record};

use crate::board::at_port::AtPort;
use crate::board::requests::{ANSWER_WITHIN, Requests};
use crate::board::source::Origin;
use crate::failure::Failure;

/// Pause between two attempts to open the port again.
const AGAIN: Duration = Duration::from_millis(100);

/// A record, and when it came.
pub(super) type Came = (Instant, Record);

/// A board.
pub(super) struct Board<'a> {
    path: PathBuf,
    port: Option<AtPort<'a>>,
    interrupt: &'a AtomicBool,
    requests: Requests,
    /// Records since [`Board::forget`].
    came: Vec<Came>,
    /// When the last one came.
    last: Option<Instant>,
}

impl<'a> Board<'a> {
    /// Opens the port.
    ///
    /// # Errors
    /// There is no such port, or it may not be opened.
    pub(super) fn open(path: &Path, interrupt: &'a AtomicBool) -> Result<Self, Failure> {
        let port = Some(AtPort::open(Origin::Serial(path.into()), interrupt)?);
        Ok(Self { path: path.into(), port, interrupt, requests: Requests::default(), came: vec![], last: None })
    }

    /// Listens for a moment.
    ///
    /// # Errors
    /// As [`AtPort::receive`].
    pub(super) fn listen(&mut self) -> Result<(), Failure> {
        let came = &mut self.came;
        let Some(port) = &mut self.port else { return self.open_again() };
        port.receive(|record| came.push((Instant::now(), record)))?;
        self.last = self.came.last().map(|(at, _)| *at).or(self.last);
        Ok(())
    }

    /// The same, and a port that goes away or is silent is opened again.
    ///
    /// # Errors
    /// The command is asked to end.
    pub(super) fn listen_through_loss(&mut self) -> Result<(), Failure> {
        match self.listen() {
            Err(failure) if self.interrupt.load(Ordering::Relaxed) => Err(failure),
            Err(_) => {
                self.port = None;
                std::thread::sleep(AGAIN);
                self.open_again()
            }
            Ok(()) => Ok(()),
        }
    }

    fn open_again(&mut self) -> Result<(), Failure> {
        if self.interrupt.load(Ordering::Relaxed) {
            return Err(Failure::run("asked to end before it was done; nothing is written"));
        }
        match AtPort::open(Origin::Serial(self.path.clone()), self.interrupt) {
            Ok(port) => self.port = Some(port),
            Err(_) => std::thread::sleep(AGAIN),
        }
        Ok(())
    }

    /// Listens for so long.
    ///
    /// # Errors
    /// As [`Board::listen`].
    pub(super) fn listen_for(&mut self, secs: f64) -> Result<(), Failure> {
        let until = Instant::now() + Duration::from_secs_f64(secs);
        while Instant::now() < until {
            self.listen()?;
        }
        Ok(())
    }

    /// Forgets what came so far.
    pub(super) fn forget(&mut self) {
        self.came.clear();
    }

    /// Sends a request, without waiting for its answer. Its number.
    ///
    /// # Errors
    /// The port is closed, or takes nothing.
    pub(super) fn send(&mut self, action: Action) -> Result<u16, Failure> {
        let request = self.requests.ask(action, Instant::now());
        let Some(port) = &mut self.port else { return Err(Failure::run("the port is closed")) };
        port.send(&request)?;
        Ok(request.number)
    }

    /// Asks for something; what became of it.
    ///
    /// # Errors
    /// As [`Board::listen`], or no answer comes.
    pub(super) fn ask(&mut self, action: Action) -> Result<Outcome, Failure> {
        let asked = self.send(action)?;
        let until = Instant::now() + ANSWER_WITHIN;
        while Instant::now() < until {
            self.listen()?;
            let mut answers = self.came.iter().filter_map(|(_, record)| match record {
                Record::Answered(Answered { number, outcome, .. }) if *number == asked => Some(*outcome),
                _ => None,
            });
            if let Some(outcome) = answers.next_back() {
                return Ok(outcome);
            }
        }
        Err(self.port.as_ref().map_or_else(|| Failure::run("the port is closed"), AtPort::no_answer))
    }

    /// When the last record came.
    pub(super) fn last(&self) -> Option<Instant> {
        self.last
    }

    /// The last boot record, and when it came.
    pub(super) fn boot(&self) -> Option<(Instant, &Boot)> {
        self.came.iter().rev().find_map(|(at, record)| match record {
            Record::Boot(boot) => Some((*at, boot)),
            _ => None,
        })
    }

    /// Frames, each with the moment of its arrival.
    pub(super) fn frames(&self) -> impl DoubleEndedIterator<Item = (Instant, &Frame)> {
        self.came.iter().filter_map(|(at, record)| match record {
            Record::Frame(frame) => Some((*at, frame)),
            _ => None,
        })
    }

    /// The state that the last frame shows.
    pub(super) fn state(&self) -> Option<SupervisorState> {
        self.frames().next_back().map(|(_, frame)| frame.state)
    }

    /// Edges of the synchronisation input.
    pub(super) fn edges(&self) -> impl DoubleEndedIterator<Item = &Edge> {
        self.came.iter().filter_map(|(_, record)| match record {
            Record::Edge(edge) => Some(edge),
            _ => None,
        })
    }

    /// Changes of state and cause.
    pub(super) fn changes(&self) -> impl DoubleEndedIterator<Item = &Change> {
        self.came.iter().filter_map(|(_, record)| match record {
            Record::Change(change) => Some(change),
            _ => None,
        })
    }

    /// Inputs of the loop, each with its tick.
    pub(super) fn calls(&self) -> impl Iterator<Item = (u32, &Call)> {
        let inputs = self.came.iter().filter_map(|(_, record)| match record {
            Record::Inputs(inputs) => Some(inputs),
            _ => None,
        });
        inputs.flat_map(wire::Inputs::ticks)
    }

    /// Load and reserves.
    pub(super) fn costs(&self) -> impl Iterator<Item = &Cost> {
        self.came.iter().filter_map(|(_, record)| match record {
            Record::Cost(cost) => Some(cost),
            _ => None,
        })
    }

    /// Conditions of the chip.
    pub(super) fn environments(&self) -> impl Iterator<Item = &Environment> {
        self.came.iter().filter_map(|(_, record)| match record {
            Record::Environment(environment) => Some(environment),
            _ => None,
        })
    }

    /// What the board refused, in its words.
    pub(super) fn refused(&self) -> impl Iterator<Item = &str> {
        self.came.iter().filter_map(|(_, record)| match record {
            Record::Refused(refused) => Some(refused.reason.as_str()),
            _ => None,
        })
    }
}
