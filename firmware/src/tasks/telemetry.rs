//! The telemetry task: sends the contents of the control task's queues to the log, as records of the crate `wire`.

use embassy_time::Timer;
use firmware::liveness::FEED_US;
use heapless::spsc::Consumer;
use joint_loop::{Cause, Frame, SENSORS, Sample, SupervisorState};
use wire::{Call, Change, Cost, Edge, Inputs, Record};

use super::control::{dropped, take_worst};
use super::progress::TELEMETRY;
use crate::environment::Environment;
use crate::log;
use crate::stack;

/// Period of the task, us: less than half the period of the watchdog task, which must see progress each time.
const ROUND_US: u32 = 2_000;
const _: () = assert!(2 * ROUND_US < FEED_US, "the watchdog task must see a round each time");
const ROUNDS_A_SECOND: u32 = 1_000_000 / ROUND_US;
/// Frames from one line for people to the next: half a second.
pub(crate) const FRAMES_A_LINE: u8 = 50;

/// State of the telemetry task.
pub(crate) struct Telemetry {
    /// Each with its tick.
    pub(crate) samples: Consumer<'static, (u32, Sample<SENSORS>)>,
    pub(crate) frames: Consumer<'static, Frame<SENSORS>>,
    pub(crate) edges: Consumer<'static, Edge>,
    /// Sensors that the board has: the first channels.
    pub(crate) sensors: usize,
    /// Calls of the record that is being collected.
    pub(crate) inputs: Inputs,
    /// Tick of the last of them.
    pub(crate) last_tick: u32,
    pub(crate) environment: Environment,
    pub(crate) rounds: u32,
    /// Frames until the next line for people.
    pub(crate) frames_to_line: u8,
    /// State and cause of the last frame.
    pub(crate) reported: Option<(SupervisorState, Cause)>,
}

/// Runs every [`ROUND_US`].
#[embassy_executor::task]
pub(crate) async fn telemetry_task(mut telemetry: Telemetry) -> ! {
    loop {
        telemetry_step(&mut telemetry);
        Timer::after_micros(ROUND_US.into()).await;
    }
}

/// Empties the queues.
#[inline(never)]
fn telemetry_step(telemetry: &mut Telemetry) {
    while let Some((tick, sample)) = telemetry.samples.dequeue() {
        telemetry.collect(tick, &sample);
    }
    while let Some(frame) = telemetry.frames.dequeue() {
        telemetry.report(&frame);
    }
    while let Some(edge) = telemetry.edges.dequeue() {
        log::send(&Record::Edge(edge));
    }
    telemetry.rounds += 1;
    if telemetry.rounds == ROUNDS_A_SECOND {
        telemetry.rounds = 0;
        let (longest_cycles, latest_start_us) = take_worst();
        let (used, size) = stack::high_water();
        log::send(&Record::Cost(Cost {
            longest_cycles,
            latest_start_us,
            dropped: dropped(),
            stack_used: used as u32,
            stack_size: size as u32,
        }));
        log::send(&Record::Environment(telemetry.environment.take()));
    }
    TELEMETRY.count();
}

impl Telemetry {
    /// Collects a record of successive calls; after a gap a new record begins.
    fn collect(&mut self, tick: u32, sample: &Sample<SENSORS>) {
        if tick != self.last_tick.wrapping_add(sample.elapsed) {
            self.flush();
        }
        if self.inputs.calls.is_empty() {
            self.inputs.first_tick = tick;
        }
        self.last_tick = tick;
        // Never full here: a full record has been sent.
        let _ = self.inputs.calls.push(Call::of(sample, self.sensors));
        if self.inputs.calls.is_full() {
            self.flush();
        }
    }

    fn flush(&mut self) {
        if !self.inputs.calls.is_empty() {
            log::send(&Record::Inputs(core::mem::take(&mut self.inputs)));
        }
    }

    fn report(&mut self, frame: &Frame<SENSORS>) {
        let Frame { tick, state, cause, .. } = *frame;
        if self.reported.replace((state, cause)) != Some((state, cause)) {
            let change = Change { tick, state, cause };
            log::state(&change);
            log::send(&Record::Change(change));
        }
        let frame = wire::Frame::from(frame);
        self.frames_to_line -= 1;
        if self.frames_to_line == 0 {
            self.frames_to_line = FRAMES_A_LINE;
            log::status(&frame);
        }
        log::send(&Record::Frame(frame));
    }
}
