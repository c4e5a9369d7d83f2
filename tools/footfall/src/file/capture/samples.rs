//! Converts the board's log to samples, one for every call of the loop, and counts the lost ones.
//!
//! ```text
//! inputs record -> calls -> sensor chain     -> volts, angle, validity
//!                        -> copy of the loop -> state, setpoints, pulses, counters      (if complete since the boot)
//! frame         -> compared with the copy; without a copy it is the source of its tick
//! ```
//! A sample is lost if the first tick of an inputs record does not continue the last one. Nothing takes its place: the next sample has
//! the number of lost ones. The copy of the loop stops there, since its state depends on all earlier inputs. The sensor chain starts
//! again with the next sample, as on a board after boot, and is exact once its filter and its plausibility limits no longer depend on
//! earlier samples.
//!
//! A board whose log nobody reads fills its buffer and drops what follows: a gap after the first 400 samples or fewer is the time before
//! the capture began, and no loss.

use crate::board::host_copy::loop_of;
use crate::board::replay::{Difference, Replay, differences};
use hgod_adc::{Reading, Sensor, SensorState};
use joint_loop::SENSORS;
use joint_loop::setup::default_loop::Parameters;
use joint_units::{AdcCode, Volts};
use std::collections::VecDeque;
use wire::{Boot, Call, Edge, Frame, Inputs, Record};

/// Samples that wait for their frame: more than the board's queues hold.
const WAITING: usize = 64;

/// Frames that wait for their inputs.
const WAITING_LINES: usize = 16;

/// Samples that a board's buffers hold at most: 240 in that of RTT channel 1, the others in its queues.
const BUFFERED: u64 = 400;

/// Number of differences that are kept.
const KEPT_DIFFERENCES: usize = 10;

/// Source of state, setpoints and pulses of a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Known {
    /// The host's copy of the loop, with every call since the boot; equal to the board's frame where there is one.
    Replayed,
    /// The board's frame.
    Line,
    /// None: an earlier sample was lost, and only every tenth tick has a frame.
    Nothing,
}

impl Known {
    /// Name in captures; empty for none.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Replayed => "replay",
            Self::Line => "line",
            Self::Nothing => "",
        }
    }
}

/// One call of the board's loop.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// Number of boots in the capture, this one included.
    pub boot: u32,
    /// Control periods since the boot, missed ones included: the board's own clock.
    pub tick: u32,
    /// Nanoseconds since the first power-on in the capture, by the board's own clock.
    pub time_ns: u64,
    /// Input of the loop.
    pub call: Call,
    /// Output of the sensor chain; `None` without a sensor, or if the boot record with the chip's reference is not known.
    pub readings: [Option<Reading>; SENSORS],
    /// Output of the loop.
    pub output: Option<Frame>,
    /// Source of the output.
    pub known: Known,
    /// All samples lost since the start of the capture.
    pub lost: u64,
}

/// An edge at the synchronisation input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EdgeAt {
    /// Time on the axis of the capture, ns.
    pub time_ns: u64,
    /// The level after it.
    pub high: bool,
}

/// A boot.
#[derive(Debug, Clone, PartialEq)]
pub struct Booted {
    /// The boot record; `None` if it was lost.
    pub boot: Option<Boot>,
    /// Time on the axis of the capture, ns.
    pub time_ns: u64,
}

/// Counters of a capture.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Counts {
    /// Samples in the capture.
    pub samples: u64,
    /// Control periods without a sample, from the gaps of the inputs records.
    pub lost: u64,
    /// Control periods between the samples that the board's buffers held and the beginning of the capture. They are not lost ones.
    pub before: u64,
    /// The gaps: boot, last tick before, first tick after. The first thousand.
    pub gaps: Vec<(u32, u32, u32)>,
    /// Control periods in which the board's loop did not run, from the board's counter; they have no sample.
    pub missed: u64,
    /// Records that the board's log dropped, from the board's counter, over all boots.
    pub board_dropped: u64,
    /// Frames that were compared with the host's copy of the loop.
    pub confirmed: u64,
    /// Of these, frames with a difference.
    pub different: u64,
    /// The first differences.
    pub differences: Vec<Difference>,
    /// Edges at the synchronisation input.
    pub edges: u64,
    /// Ticks with more edges before them than the board can store.
    pub edges_lost: u64,
    /// Malformed frames of the log.
    pub malformed: u64,
    /// The first reason why the host's copy stopped.
    pub why_no_replay: Option<String>,
}

/// Number of gaps that are kept.
const KEPT_GAPS: usize = 1000;

/// Converts lines of the log to samples.
#[derive(Debug)]
pub struct Sampler {
    parameters: Parameters,
    counts: Counts,
    boot: u32,
    /// Time of tick 0 of the present boot on the axis of the capture.
    began_ns: u64,
    /// Overflows of the tick counter, in ticks.
    turns: u64,
    last: Option<u32>,
    last_ns: u64,
    dropped_this_boot: u32,
    sensors: [Option<Sensor>; SENSORS],
    states: [SensorState; SENSORS],
    edges: Vec<EdgeAt>,
    replay: Option<Replay>,
    waiting: VecDeque<Sample>,
    lines: VecDeque<Frame>,
}

impl Sampler {
    /// For a board with these parameters.
    #[must_use]
    pub fn new(parameters: Parameters) -> Self {
        Self {
            parameters,
            counts: Counts::default(),
            boot: 0,
            began_ns: 0,
            turns: 0,
            last: None,
            last_ns: 0,
            dropped_this_boot: 0,
            sensors: [const { None }; SENSORS],
            states: [SensorState::default(); SENSORS],
            edges: Vec::new(),
            replay: None,
            waiting: VecDeque::new(),
            lines: VecDeque::new(),
        }
    }

    /// The counts so far.
    #[must_use]
    pub const fn counts(&self) -> &Counts {
        &self.counts
    }

    /// Counts a malformed frame.
    pub fn malformed(&mut self) {
        self.counts.malformed += 1;
    }

    /// Takes a record. `reset_ns` is the start of the present boot, if known from outside of the board.
    /// Appends complete samples to `out`; returns the boot that the record reports.
    pub fn record(&mut self, record: Record, reset_ns: Option<u64>, out: &mut Vec<Sample>) -> Option<Booted> {
        match record {
            Record::Boot(boot) => return Some(self.boot(Some(boot), reset_ns, out)),
            Record::Inputs(inputs) => return self.inputs(&inputs, out),
            Record::Frame(frame) => self.tick(frame, out),
            Record::Cost(cost) => {
                let more = cost.dropped.checked_sub(self.dropped_this_boot).unwrap_or(cost.dropped);
                self.counts.board_dropped += u64::from(more);
                self.dropped_this_boot = cost.dropped;
            }
            Record::Edge(edge) => self.edge(&edge),
            Record::Change(_)
            | Record::Environment(_)
            | Record::Refused(_)
            | Record::Answered(_)
            | Record::Port(_)
            | Record::Settings(_)
            | Record::Conditions(_) => {}
        }
        None
    }

    /// Appends the samples that still wait, at the end of the log.
    pub fn finish(&mut self, out: &mut Vec<Sample>) {
        self.settle(true, out);
    }

    fn boot(&mut self, boot: Option<Boot>, reset_ns: Option<u64>, out: &mut Vec<Sample>) -> Booted {
        self.settle(true, out);
        self.lines.clear();
        self.boot += 1;
        // Without a known reset, a boot begins at the end of the last sample before it.
        let after = if self.boot == 1 { 0 } else { self.last_ns };
        self.began_ns = reset_ns.map_or(after, |at| at.max(after));
        (self.turns, self.dropped_this_boot) = (0, 0);
        self.states = [SensorState::default(); SENSORS];
        self.replay = None;
        self.last = boot.as_ref().map(|_| 0);
        if let Some(boot) = &boot {
            let channels = self.parameters.sensors.channels().iter();
            for (sensor, channel) in self.sensors.iter_mut().zip(channels) {
                *sensor = channel
                    .as_ref()
                    .and_then(|channel| channel.build(AdcCode(boot.reference_cal), Volts(boot.min_supply_v)).ok());
            }
            self.begin_replay(boot);
        }
        Booted { boot, time_ns: self.began_ns }
    }

    fn begin_replay(&mut self, boot: &Boot) {
        match loop_of(&self.parameters, boot) {
            Ok(joints) => self.replay = Some(Replay::new(joints)),
            Err(why) => {
                self.counts.why_no_replay.get_or_insert(why);
            }
        }
    }

    fn inputs(&mut self, inputs: &Inputs, out: &mut Vec<Sample>) -> Option<Booted> {
        let first = inputs.calls.first()?;
        let mut booted = None;
        let mut lost = match self.last {
            Some(last) => inputs.first_tick.wrapping_sub(last).wrapping_sub(first.elapsed.max(1).into()),
            None => 0,
        };
        if lost > u32::MAX / 2 || (self.last.is_none() && self.boot == 0) {
            // Decreasing ticks mean a boot whose record was lost; ticks before any boot mean a capture that began later.
            let reset = self.boot > 0;
            booted = Some(self.boot(None, None, out));
            lost = if reset { inputs.first_tick.wrapping_sub(first.elapsed.max(1).into()) } else { 0 };
            self.counts.why_no_replay.get_or_insert_with(|| {
                "the capture has no boot record of the board; reset the board after the capture has begun".into()
            });
        }
        if lost > 0 {
            let taken = self.counts.samples + self.waiting.len() as u64;
            let began = self.counts.gaps.is_empty() && taken <= BUFFERED;
            *(if began { &mut self.counts.before } else { &mut self.counts.lost }) += u64::from(lost);
            if self.counts.gaps.len() < KEPT_GAPS {
                self.counts.gaps.push((self.boot, self.last.unwrap_or(0), inputs.first_tick));
            }
            self.states = [SensorState::default(); SENSORS];
        }
        if let Some(replay) = &mut self.replay
            && let Err(gap) = replay.feed(inputs)
        {
            self.counts.why_no_replay.get_or_insert_with(|| gap.to_string());
        }
        for (nth, call) in inputs.calls.iter().enumerate() {
            let elapsed = u32::from(call.elapsed.max(1));
            let tick = match (nth, self.last) {
                (0, _) | (_, None) => inputs.first_tick,
                (_, Some(last)) => last.wrapping_add(elapsed),
            };
            self.turns += u64::from(self.last.is_some_and(|last| tick < last)) << 32;
            self.last = Some(tick);
            self.counts.missed += u64::from(elapsed - 1);
            let sample = self.sample(tick, call);
            self.last_ns = sample.time_ns;
            self.waiting.push_back(sample);
        }
        self.settle(false, out);
        booted
    }

    fn sample(&mut self, tick: u32, call: &Call) -> Sample {
        let mut readings = [None; SENSORS];
        let channels = self.sensors.iter().zip(&mut self.states).zip(call.sample().codes);
        for (reading, ((sensor, state), code)) in readings.iter_mut().zip(channels) {
            *reading = sensor.as_ref().map(|sensor| {
                state.missed(u32::from(call.elapsed.max(1)) - 1);
                sensor.sample(state, code, AdcCode(call.reference))
            });
        }
        let replayed = self.replay.as_ref().and_then(|replay| replay.at(tick)).map(|(_, frame)| Frame::from(frame));
        Sample {
            boot: self.boot,
            tick,
            time_ns: self.began_ns.saturating_add((self.turns + u64::from(tick)).saturating_mul(1_000_000)),
            call: call.clone(),
            readings,
            known: if replayed.is_some() { Known::Replayed } else { Known::Nothing },
            output: replayed,
            lost: self.counts.lost,
        }
    }

    /// Edges since the last call.
    pub fn edges(&mut self) -> Vec<EdgeAt> {
        std::mem::take(&mut self.edges)
    }

    fn edge(&mut self, edge: &Edge) {
        self.counts.edges += 1;
        self.counts.edges_lost += u64::from(edge.lost_before);
        let tick_ns = (self.turns + u64::from(edge.tick)).saturating_mul(1_000_000);
        let time_ns = self.began_ns.saturating_add(tick_ns).saturating_add_signed(i64::from(edge.offset_us) * 1000);
        self.edges.push(EdgeAt { time_ns, high: edge.high });
    }

    fn tick(&mut self, tick: Frame, out: &mut Vec<Sample>) {
        if self.lines.len() == WAITING_LINES {
            self.lines.pop_front();
        }
        self.lines.push_back(tick);
        self.settle(false, out);
    }

    /// Appends the samples up to the last frame, those that have waited long enough, or all of them.
    fn settle(&mut self, all: bool, out: &mut Vec<Sample>) {
        while let Some(first) = self.waiting.front() {
            let seen = self.lines.back().is_some_and(|line| line.tick.wrapping_sub(first.tick) <= u32::MAX / 2);
            if !all && !seen && self.waiting.len() <= WAITING {
                return;
            }
            let Some(mut sample) = self.waiting.pop_front() else { return };
            if let Some(line) = self.lines.iter().find(|line| line.tick == sample.tick) {
                match self.replay.as_ref().and_then(|replay| replay.at(sample.tick)) {
                    Some((_, frame)) => {
                        let found = differences(line, frame);
                        self.counts.confirmed += 1;
                        self.counts.different += u64::from(!found.is_empty());
                        let free = KEPT_DIFFERENCES.saturating_sub(self.counts.differences.len());
                        self.counts.differences.extend(found.into_iter().take(free));
                    }
                    None => (sample.output, sample.known) = (Some(*line), Known::Line),
                }
            }
            self.counts.samples += 1;
            out.push(sample);
        }
    }
}
