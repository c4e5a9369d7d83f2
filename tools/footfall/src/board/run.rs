//! Follows a run of a board: decodes its lines to events, compares them with the host's copy of the loop, and counts.
//!
//! ```text
//! board line --> RTT channel 0 --[image]--> text
//!            --> RTT channel 1 --> frame, inputs --[replay]--> equal or not
//! ```
//! A frame is an event at once, for live views. It is a [`Row`] as soon as the inputs of its tick have arrived: with the converter's
//! codes, and compared with the host's copy of the loop.

use crate::board::counters::Counters;
use crate::board::host_copy::loop_of;
use crate::board::image::{Decoder, Image};
use crate::board::lines::{BoardLine, End, RECORDS};
use crate::board::replay::{Difference, Gap, Replay, differences};
use crate::board::serial::{LinkError, Records};
use joint_loop::SENSORS;
use joint_loop::setup::default_loop::Parameters;
use joint_units::AdcCode;
use std::collections::VecDeque;
use wire::{Boot, Conditions, Cost, DecodeError, Edge, Environment, Frame, Inputs, Record, Subject};

/// Calls of the loop between two frames.
pub const CALLS_A_FRAME: u32 = wire::CALLS as u32;

/// Rows that wait for their inputs: more than the board's queues hold.
const WAITING: usize = 32;

/// Number of differences that are kept.
const KEPT_DIFFERENCES: usize = 10;

/// Why a run cannot be followed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RunError {
    /// The board runs another file than the one with the log table.
    #[error(
        "the virtual board runs an image with SHA-256 {runs}, the log table is of {table}; give the ELF file that the board runs, and do not rebuild it during the run"
    )]
    OtherImage {
        /// Hash of the board's file.
        runs: String,
        /// Hash of the table's file.
        table: String,
    },
    /// The first frame of the log is malformed.
    #[error(
        "the log does not begin with a frame of this image: the board runs another one; give the ELF file that was flashed"
    )]
    FirstFrame,
    /// A record of the log cannot be read.
    #[error(transparent)]
    Record(#[from] DecodeError),
}

/// An event of a run.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// The chip left reset.
    Booted {
        /// Virtual seconds since power-on.
        t_s: f64,
        /// Cause of the reset.
        cause: String,
    },
    /// A frame of the board.
    Tick {
        /// Virtual time of its arrival, s.
        t_s: f64,
        /// The board's frame.
        tick: Frame,
    },
    /// The same with its inputs.
    Row(Row),
    /// A line of the log for the user.
    Log {
        /// Virtual time of its arrival, s.
        t_s: f64,
        /// Its level; may be empty.
        level: String,
        /// The text.
        text: String,
    },
    /// Load and reserves of the last second.
    Cost(Cost),
    /// Temperature and supply.
    Environment(Environment),
    /// What was not as it should be, since the boot.
    Conditions(Conditions),
    /// An edge at the synchronisation input.
    Edge(Edge),
    /// Pulses at the pins.
    Pulses {
        /// Virtual time, s.
        t_s: f64,
        /// Widths in microseconds.
        us: [Option<f64>; 4],
    },
    /// Another 100 ms have passed.
    Status {
        /// Virtual time, s.
        t_s: f64,
    },
    /// A message of the virtual board.
    Remark {
        /// The type of the message.
        kind: String,
        /// The text.
        text: String,
    },
    /// The run has ended.
    Ended(Box<End>),
}

/// A frame with its input.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Time of the tick by the board's clock, in virtual seconds since power-on.
    pub time_s: f64,
    /// The board's frame.
    pub tick: Frame,
    /// Codes of the sensors; `None` if the inputs record was lost.
    pub codes: Option<[AdcCode; SENSORS]>,
    /// The host's copy gave the same bits; `None` if not known.
    pub equal: Option<bool>,
}

/// A run of a board.
pub struct BoardRun<'t> {
    decoder: Decoder<'t>,
    records: Records,
    sha256: &'t str,
    parameters: Parameters,
    counters: Counters,
    /// A correct frame was received.
    in_step: bool,
    /// Start of the present boot, s.
    began_s: f64,
    replay: Option<Replay>,
    waiting: VecDeque<Frame>,
    last_seq: u32,
}

impl<'t> BoardRun<'t> {
    /// A run of an image on a board with these parameters.
    #[must_use]
    pub fn new(image: &'t Image, parameters: Parameters) -> Self {
        Self {
            decoder: image.decoder(),
            records: Records::default(),
            sha256: &image.sha256,
            parameters,
            counters: Counters::default(),
            in_step: false,
            began_s: 0.0,
            replay: None,
            waiting: VecDeque::new(),
            last_seq: 0,
        }
    }

    /// The counters so far.
    #[must_use]
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Takes a line of the board.
    ///
    /// # Errors
    /// The log is not of this image.
    pub fn take(&mut self, line: BoardLine) -> Result<Vec<Event>, RunError> {
        let mut events = Vec::new();
        match line {
            BoardLine::Start { elf_sha256 } => {
                if elf_sha256 != self.sha256 {
                    return Err(RunError::OtherImage { runs: elf_sha256, table: self.sha256.into() });
                }
            }
            BoardLine::Boot { t_s, cause } => {
                self.restart(t_s, &mut events);
                events.push(Event::Booted { t_s, cause });
            }
            BoardLine::Rtt { t_s, channel: RECORDS, bytes } => self.records(t_s, &bytes, &mut events)?,
            BoardLine::Rtt { t_s, bytes, .. } => self.log(t_s, &bytes, &mut events)?,
            BoardLine::Pulses { t_s, us } => events.push(Event::Pulses { t_s, us }),
            BoardLine::Status { t_s } => events.push(Event::Status { t_s }),
            BoardLine::Remark { kind, text, .. } => events.push(Event::Remark { kind, text }),
            BoardLine::End(end) => {
                self.settle_all(&mut events);
                events.push(Event::Ended(end));
            }
        }
        Ok(events)
    }

    /// Completes the rows that still wait, at the end of the output.
    pub fn finish(&mut self) -> Vec<Event> {
        let mut events = Vec::new();
        self.settle_all(&mut events);
        events
    }

    fn restart(&mut self, t_s: f64, events: &mut Vec<Event>) {
        self.settle_all(events);
        self.decoder.restart();
        self.records = Records::default();
        self.counters.restart(t_s);
        self.began_s = t_s;
        self.replay = None;
        self.last_seq = 0;
    }

    fn log(&mut self, t_s: f64, bytes: &[u8], events: &mut Vec<Event>) -> Result<(), RunError> {
        self.decoder.push(bytes);
        while let Some(message) = self.decoder.message() {
            let Ok(message) = message else {
                if !self.in_step {
                    return Err(RunError::FirstFrame);
                }
                self.counters.malformed += 1;
                continue;
            };
            self.in_step = true;
            // Lines without a level repeat a frame as text.
            if !message.level.is_empty() {
                events.push(Event::Log { t_s, level: message.level, text: message.text });
            }
        }
        Ok(())
    }

    fn records(&mut self, t_s: f64, bytes: &[u8], events: &mut Vec<Event>) -> Result<(), RunError> {
        for byte in bytes {
            let record = match self.records.push(*byte) {
                None => continue,
                Some(Err(LinkError::Frame(_))) => {
                    self.counters.malformed += 1;
                    continue;
                }
                Some(Err(LinkError::Record(error))) => return Err(error.into()),
                Some(Ok(record)) => record,
            };
            match record {
                Record::Boot(boot) => {
                    self.counters.shadow = boot.shadow;
                    self.begin_replay(&boot);
                }
                Record::Change(change) => self.counters.change(&change, t_s),
                Record::Refused(refused) => {
                    let reason = Some(refused.reason.as_str().into());
                    if refused.subject != Subject::Arming {
                        self.counters.not_started.clone_from(&reason);
                    }
                    self.counters.refused = reason;
                }
                Record::Frame(frame) => self.tick(t_s, frame, events),
                Record::Inputs(inputs) => self.inputs(&inputs, events),
                Record::Edge(edge) => events.push(Event::Edge(edge)),
                Record::Cost(cost) => {
                    self.counters.add(cost);
                    events.push(Event::Cost(cost));
                }
                Record::Environment(environment) => events.push(Event::Environment(environment)),
                Record::Conditions(conditions) => events.push(Event::Conditions(conditions)),
                // The log also has them as text lines.
                Record::Answered(_) | Record::Port(_) | Record::Settings(_) => {}
            }
        }
        Ok(())
    }

    fn begin_replay(&mut self, boot: &Boot) {
        match loop_of(&self.parameters, boot) {
            Ok(joints) => self.replay = Some(Replay::new(joints)),
            Err(why) => {
                self.counters.why_not.get_or_insert(why);
            }
        }
    }

    fn tick(&mut self, t_s: f64, tick: Frame, events: &mut Vec<Event>) {
        self.counters.follow(&tick);
        let calls = tick.seq.wrapping_sub(self.last_seq);
        self.counters.lost_lines += u64::from((calls / CALLS_A_FRAME).saturating_sub(1));
        self.last_seq = tick.seq;
        (self.counters.last, self.counters.heard.frame_at_s) = (Some(tick), Some(t_s));
        events.push(Event::Tick { t_s, tick });
        self.waiting.push_back(tick);
        self.settle(WAITING, events);
    }

    fn inputs(&mut self, inputs: &Inputs, events: &mut Vec<Event>) {
        if let Some(replay) = &mut self.replay {
            let before = replay.calls();
            if let Err(gap) = replay.feed(inputs) {
                self.counters.why_not.get_or_insert_with(|| gap.to_string());
            }
            self.counters.calls += replay.calls() - before;
        }
        self.settle(WAITING, events);
    }

    fn settle_all(&mut self, events: &mut Vec<Event>) {
        self.settle(0, events);
    }

    /// Completes the rows whose inputs have arrived, and all but the newest `keep` without inputs.
    fn settle(&mut self, keep: usize, events: &mut Vec<Event>) {
        while let Some(&tick) = self.waiting.front() {
            let at = self.replay.as_ref().and_then(|replay| replay.at(tick.tick));
            let Some((call, frame)) = at else {
                if self.waiting.len() <= keep && self.may_still_come() {
                    return;
                }
                self.waiting.pop_front();
                self.counters.not_compared += 1;
                self.counters.why_not.get_or_insert_with(|| "the log has no inputs of these ticks".into());
                events.push(Event::Row(Row { time_s: self.time_s(&tick), tick, codes: None, equal: None }));
                continue;
            };
            let (found, codes) = (differences(&tick, frame), call.sample().codes);
            self.counters.hashes = Some((tick.setpoint_hash, frame.setpoint_hash));
            self.waiting.pop_front();
            self.counters.compared += 1;
            let equal = self.differ(found);
            let time_s = self.time_s(&tick);
            events.push(Event::Row(Row { time_s, tick, codes: Some(codes), equal: Some(equal) }));
        }
    }

    /// Counts the differences of a frame; true if there are none.
    fn differ(&mut self, found: Vec<Difference>) -> bool {
        let equal = found.is_empty();
        self.counters.different += u64::from(!equal);
        let free = KEPT_DIFFERENCES.saturating_sub(self.counters.differences.len());
        self.counters.differences.extend(found.into_iter().take(free));
        equal
    }

    fn may_still_come(&self) -> bool {
        let gap: Option<Gap> = self.replay.as_ref().and_then(Replay::gap);
        self.replay.is_some() && gap.is_none()
    }

    /// Time by the board's own counter, which starts at zero with each boot.
    fn time_s(&self, tick: &Frame) -> f64 {
        self.began_s + f64::from(tick.tick) / 1000.0
    }
}
