//! One run: the board's lines go in, events come out, and the books are kept.
//!
//! ```text
//! board line --> bytes of the log --[image]--> text --[telemetry]--> tick, inputs --[replay]--> equal or not
//! ```
//! A `tick` line is an event at once, for whoever shows it live. It is a [`Row`] a moment later, when the inputs of that tick
//! have come too: with the converter's code, and compared with the host's copy of the loop.

use crate::board::image::{Decoder, Image};
use crate::board::lines::{BoardLine, End};
use crate::board::replay::{Difference, Gap, Replay, differences, follow_differences};
use crate::board::telemetry;
use crate::board::telemetry::{Boot, Cost, Edge, Env, Follow, Inputs, Line, LineError, Margin, Tick};
use cpg_core::entrainment::{Lock, SensorFault};
use joint_loop::setup::default_loop::{BoardLoop, Parameters, board_loop};
use joint_loop::store::{generator_record, sensor_record};
use joint_loop::{Cause, SENSORS};
use joint_units::AdcCode;
use serde::Serialize;
use std::collections::VecDeque;

/// Calls of the loop between two `tick` lines.
pub const CALLS_A_TICK_LINE: u32 = 10;

/// Rows that wait for their inputs: more than the board's queues hold.
const WAITING: usize = 32;

/// Differences that are kept word for word.
const KEPT_DIFFERENCES: usize = 10;

/// What makes going on senseless.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SessionError {
    /// The board runs another file than the one whose log table is used.
    #[error(
        "the virtual board runs an image with SHA-256 {runs}, the log table is of {table}: was the file just rebuilt?"
    )]
    OtherImage {
        /// Hash of what runs.
        runs: String,
        /// Hash of the table's file.
        table: String,
    },
    /// The first frame of the log makes no sense.
    #[error("the log does not begin with a frame of this image: the board runs another one")]
    FirstFrame,
    /// A line of the log is not as agreed.
    #[error("the log is not what this program reads: {0}; image and program are of different versions")]
    Line(#[from] LineError),
}

/// What happened.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// The chip came out of reset.
    Booted {
        /// When, in virtual seconds since power-on.
        t_s: f64,
        /// Why.
        cause: String,
    },
    /// What the loop saw and did.
    Tick {
        /// When the line was taken.
        t_s: f64,
        /// The line.
        tick: Tick,
    },
    /// The same, complete.
    Row(Row),
    /// A line of the log for people.
    Log {
        /// When it was taken.
        t_s: f64,
        /// Its level; may be empty.
        level: String,
        /// The text.
        text: String,
    },
    /// What the last second cost.
    Cost(Cost),
    /// What was left to spare.
    Margin(Margin),
    /// See [`Env`].
    Env(Env),
    /// An edge at the synchronisation input.
    Edge(Edge),
    /// Pulses at the pins.
    Pulses {
        /// When.
        t_s: f64,
        /// Widths in microseconds.
        us: [Option<f64>; 4],
    },
    /// Another 100 ms have passed.
    Status {
        /// When.
        t_s: f64,
    },
    /// The board has something to say.
    Remark {
        /// What kind of thing.
        kind: String,
        /// The text.
        text: String,
    },
    /// The run is over.
    Ended(Box<End>),
}

/// A `tick` line with its input.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Time of the tick by the board's own count, in virtual seconds since power-on.
    pub time_s: f64,
    /// The line.
    pub tick: Tick,
    /// Codes of the sensors; `None` when the line with them was lost.
    pub codes: Option<[AdcCode; SENSORS]>,
    /// Whether the host's copy did the same, bit for bit; `None` when it cannot tell.
    pub equal: Option<bool>,
}

/// How a walker that follows the gait sensor stands.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Following {
    /// `stopped`, `seeking`, `locked` or `holding`.
    pub state: &'static str,
    /// What is wrong with the sensor.
    pub fault: Option<&'static str>,
    /// 1 where the sensor says what was foretold, 0 where nothing can be told.
    pub confidence: f32,
    /// The person's stride time as estimated, seconds.
    pub stride_s: f32,
    /// Phase of the person less the estimated one, degrees of the cycle.
    pub phase_error_deg: f32,
    /// When it first locked, in seconds since the boot.
    pub locked_at_s: Option<f64>,
}

/// The books of a run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Books {
    /// Boots so far.
    pub boots: u32,
    /// `tick` lines that were lost, by their numbers.
    pub lost_lines: u64,
    /// Frames of the log that made no sense.
    pub malformed: u64,
    /// Rows that were compared with the host.
    pub compared: u64,
    /// Rows that were not, and why the first of them was not.
    pub not_compared: u64,
    /// See `not_compared`.
    pub why_not: Option<String>,
    /// Rows in which something differed.
    pub different: u64,
    /// The first differences.
    pub differences: Vec<Difference>,
    /// Calls that the host's copy ran, over all boots.
    pub calls: u64,
    /// The last `tick` line.
    pub last: Option<Tick>,
    /// Why the supervisor last changed its state.
    pub cause: Cause,
    /// The board says that it drives nothing.
    pub shadow: bool,
    /// Of a walker that follows the gait sensor.
    pub following: Option<Following>,
    /// Setpoint hashes of board and host at the last row that was compared.
    pub hashes: Option<(u64, u64)>,
}

/// One run.
pub struct Session<'t> {
    decoder: Decoder<'t>,
    sha256: &'t str,
    parameters: Parameters,
    books: Books,
    /// Any frame of the log made sense.
    heard: bool,
    /// When the present boot began.
    began_s: f64,
    replay: Option<Replay>,
    waiting: VecDeque<Tick>,
    waiting_follows: VecDeque<Follow>,
    last_seq: u32,
}

impl<'t> Session<'t> {
    /// A run of an image on a board that was given these parameters.
    #[must_use]
    pub fn new(image: &'t Image, parameters: Parameters) -> Self {
        Self {
            decoder: image.decoder(),
            sha256: &image.sha256,
            parameters,
            books: Books::default(),
            heard: false,
            began_s: 0.0,
            replay: None,
            waiting: VecDeque::new(),
            waiting_follows: VecDeque::new(),
            last_seq: 0,
        }
    }

    /// The books so far.
    #[must_use]
    pub fn books(&self) -> &Books {
        &self.books
    }

    /// Takes a line of the board.
    ///
    /// # Errors
    /// The log cannot be that of the image.
    pub fn take(&mut self, line: BoardLine) -> Result<Vec<Event>, SessionError> {
        let mut events = Vec::new();
        match line {
            BoardLine::Start { elf_sha256 } => {
                if elf_sha256 != self.sha256 {
                    return Err(SessionError::OtherImage { runs: elf_sha256, table: self.sha256.into() });
                }
            }
            BoardLine::Boot { t_s, cause } => {
                self.restart(t_s, &mut events);
                events.push(Event::Booted { t_s, cause });
            }
            BoardLine::Rtt { t_s, bytes } => self.log(t_s, &bytes, &mut events)?,
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

    /// Settles the rows that still wait; for a board whose last line never came.
    pub fn finish(&mut self) -> Vec<Event> {
        let mut events = Vec::new();
        self.settle_all(&mut events);
        events
    }

    fn restart(&mut self, t_s: f64, events: &mut Vec<Event>) {
        self.settle_all(events);
        self.decoder.restart();
        self.books.boots += 1;
        self.began_s = t_s;
        self.replay = None;
        self.last_seq = 0;
    }

    fn log(&mut self, t_s: f64, bytes: &[u8], events: &mut Vec<Event>) -> Result<(), SessionError> {
        self.decoder.push(bytes);
        while let Some(message) = self.decoder.message() {
            let Ok(message) = message else {
                if !self.heard {
                    return Err(SessionError::FirstFrame);
                }
                self.books.malformed += 1;
                continue;
            };
            self.heard = true;
            match telemetry::parse(&message.text)? {
                Line::Boot(boot) => {
                    self.books.shadow = boot.shadow;
                    self.begin_replay(&boot);
                    events.push(Event::Log { t_s, level: message.level, text: message.text });
                }
                Line::State(change) => {
                    self.books.cause = change.cause;
                    events.push(Event::Log { t_s, level: message.level, text: message.text });
                }
                Line::Tick(tick) => self.tick(t_s, tick, events),
                Line::Inputs(inputs) => self.inputs(&inputs, events),
                Line::Follow(follow) => self.follow(follow, events),
                Line::Edge(edge) => events.push(Event::Edge(edge)),
                Line::Cost(cost) => events.push(Event::Cost(cost)),
                Line::Margin(margin) => events.push(Event::Margin(margin)),
                Line::Env(env) => events.push(Event::Env(env)),
                Line::Text => events.push(Event::Log { t_s, level: message.level, text: message.text }),
            }
        }
        Ok(())
    }

    fn begin_replay(&mut self, boot: &Boot) {
        match loop_of(&self.parameters, boot) {
            Ok(joints) => self.replay = Some(Replay::new(joints)),
            Err(why) => {
                self.books.why_not.get_or_insert(why);
            }
        }
    }

    fn follow(&mut self, follow: Follow, events: &mut Vec<Event>) {
        let locked = (follow.state == Lock::Locked).then(|| f64::from(follow.tick) / 1000.0);
        self.books.following = Some(Following {
            state: follow.state.name(),
            fault: follow.fault.map(SensorFault::name),
            confidence: follow.confidence,
            stride_s: follow.stride_s,
            phase_error_deg: follow.phase_error_deg,
            locked_at_s: self.books.following.and_then(|known| known.locked_at_s).or(locked),
        });
        self.waiting_follows.push_back(follow);
        self.settle(WAITING, events);
    }

    fn tick(&mut self, t_s: f64, tick: Tick, events: &mut Vec<Event>) {
        let calls = tick.seq.wrapping_sub(self.last_seq);
        self.books.lost_lines += u64::from((calls / CALLS_A_TICK_LINE).saturating_sub(1));
        self.last_seq = tick.seq;
        self.books.last = Some(tick);
        events.push(Event::Tick { t_s, tick });
        self.waiting.push_back(tick);
        self.settle(WAITING, events);
    }

    fn inputs(&mut self, inputs: &Inputs, events: &mut Vec<Event>) {
        if let Some(replay) = &mut self.replay {
            let before = replay.calls();
            if let Err(gap) = replay.feed(inputs) {
                self.books.why_not.get_or_insert_with(|| gap.to_string());
            }
            self.books.calls += replay.calls() - before;
        }
        self.settle(WAITING, events);
    }

    fn settle_all(&mut self, events: &mut Vec<Event>) {
        self.settle(0, events);
    }

    /// Settles the rows whose inputs have come, and the oldest ones beyond `keep` even without.
    fn settle(&mut self, keep: usize, events: &mut Vec<Event>) {
        while let Some(&follow) = self.waiting_follows.front() {
            let frame = self.replay.as_ref().and_then(|replay| replay.at(follow.tick));
            if frame.is_none() && self.waiting_follows.len() <= keep && self.may_still_come() {
                break;
            }
            self.waiting_follows.pop_front();
            // What cannot be compared is told by its `tick` line.
            let found = frame.map_or(vec![], |(_, frame)| follow_differences(&follow, frame));
            self.differ(found);
        }
        while let Some(&tick) = self.waiting.front() {
            let at = self.replay.as_ref().and_then(|replay| replay.at(tick.tick));
            let Some((call, frame)) = at else {
                if self.waiting.len() <= keep && self.may_still_come() {
                    return;
                }
                self.waiting.pop_front();
                self.books.not_compared += 1;
                self.books.why_not.get_or_insert_with(|| "the log holds no inputs of these ticks".into());
                events.push(Event::Row(Row { time_s: self.time_s(&tick), tick, codes: None, equal: None }));
                continue;
            };
            let found = differences(&tick, frame);
            self.waiting.pop_front();
            self.books.compared += 1;
            self.books.hashes = Some((tick.hash, frame.setpoint_hash));
            let equal = self.differ(found);
            let time_s = self.time_s(&tick);
            events.push(Event::Row(Row { time_s, tick, codes: Some(call.sensors), equal: Some(equal) }));
        }
    }

    /// Enters what differs in a line into the books; true if nothing does.
    fn differ(&mut self, found: Vec<Difference>) -> bool {
        let equal = found.is_empty();
        self.books.different += u64::from(!equal);
        let room = KEPT_DIFFERENCES.saturating_sub(self.books.differences.len());
        self.books.differences.extend(found.into_iter().take(room));
        equal
    }

    fn may_still_come(&self) -> bool {
        let gap: Option<Gap> = self.replay.as_ref().and_then(Replay::gap);
        self.replay.is_some() && gap.is_none()
    }

    /// By the board's own count: resets begin it anew, and it can only be behind the time of the reset.
    fn time_s(&self, tick: &Tick) -> f64 {
        self.began_s + f64::from(tick.tick) / 1000.0
    }
}

/// The host's copy of the loop of a board that said these first words; an error says why there is none.
pub(crate) fn loop_of(parameters: &Parameters, boot: &Boot) -> Result<BoardLoop, String> {
    let walker = generator_record::record_of(&parameters.generator).crc();
    let sensors = sensor_record::record_of(&parameters.sensors).crc();
    if boot.generator_crc != walker {
        return Err(format!(
            "the board walks with the parameters {:08x}, known here are {walker:08x}; allowed is the file they were made of, by --params",
            boot.generator_crc
        ));
    }
    if boot.sensors_crc != sensors {
        return Err(format!(
            "the board has the sensors {:08x}, known here are {sensors:08x}; allowed are those that it was given, by --sensor",
            boot.sensors_crc
        ));
    }
    board_loop(parameters, boot.vrefint_cal, boot.min_supply, boot.sensor_required).map_err(|error| error.to_string())
}
