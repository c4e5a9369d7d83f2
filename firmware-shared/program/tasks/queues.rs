//! The queues from the control task to telemetry, and that of the requests from telemetry to the control task.

use heapless::spsc::{Consumer, Producer, Queue};
use joint_loop::tuning::{Answer, Request, Settings};
use joint_loop::{Conditions, Frame, SENSORS, Sample};
use static_cell::ConstStaticCell;
use wire::{Change, Edge};

use crate::requests::REQUESTS_QUEUED;

/// Samples of half a frame period more than the longest pause of telemetry that the watchdog allows.
const SAMPLES_QUEUED: usize = 64;
/// Frames of the same time, and one more.
const FRAMES_QUEUED: usize = 8;
/// Edges of a 1 kHz line over half a frame period more than the longest pause of telemetry that the watchdog allows.
const EDGES_QUEUED: usize = 128;
/// Changes of state: the longest chain of them, and as many again.
const CHANGES_QUEUED: usize = 16;
/// Frames for the serial port: at most one a tick, over many rounds of telemetry.
const RECORDS_QUEUED: usize = 32;
/// Counts of conditions, once a second.
const CONDITIONS_QUEUED: usize = 3;

struct Queues {
    samples: Queue<(u32, Sample<SENSORS>), SAMPLES_QUEUED>,
    frames: Queue<Frame<SENSORS>, FRAMES_QUEUED>,
    changes: Queue<Change, CHANGES_QUEUED>,
    edges: Queue<Edge, EDGES_QUEUED>,
    records: Queue<Frame<SENSORS>, RECORDS_QUEUED>,
    requests: Queue<Request, REQUESTS_QUEUED>,
    answers: Queue<Answer, REQUESTS_QUEUED>,
    settings: Queue<(u32, Settings), REQUESTS_QUEUED>,
    conditions: Queue<Conditions<SENSORS>, CONDITIONS_QUEUED>,
}

static QUEUES: ConstStaticCell<Queues> = ConstStaticCell::new(Queues {
    samples: Queue::new(),
    frames: Queue::new(),
    changes: Queue::new(),
    edges: Queue::new(),
    records: Queue::new(),
    requests: Queue::new(),
    answers: Queue::new(),
    settings: Queue::new(),
    conditions: Queue::new(),
});

/// The ends of the control task.
pub(crate) struct OfControl {
    /// Each with its tick.
    pub(super) samples: Producer<'static, (u32, Sample<SENSORS>)>,
    pub(super) frames: Producer<'static, Frame<SENSORS>>,
    pub(super) changes: Producer<'static, Change>,
    pub(super) edges: Producer<'static, Edge>,
    /// Frames for the serial port.
    pub(super) records: Producer<'static, Frame<SENSORS>>,
    pub(super) requests: Consumer<'static, Request>,
    pub(super) answers: Producer<'static, Answer>,
    /// Each with a tick in which they were in effect.
    pub(super) settings: Producer<'static, (u32, Settings)>,
    /// What was not as it should be, whenever the settings are reported.
    pub(super) conditions: Producer<'static, Conditions<SENSORS>>,
}

/// The ends of telemetry but that of the requests, which the serial port hands on.
pub(crate) struct OfTelemetry {
    pub(super) samples: Consumer<'static, (u32, Sample<SENSORS>)>,
    pub(super) frames: Consumer<'static, Frame<SENSORS>>,
    pub(super) changes: Consumer<'static, Change>,
    pub(super) edges: Consumer<'static, Edge>,
    pub(super) records: Consumer<'static, Frame<SENSORS>>,
    pub(super) answers: Consumer<'static, Answer>,
    pub(super) settings: Consumer<'static, (u32, Settings)>,
    pub(super) conditions: Consumer<'static, Conditions<SENSORS>>,
}

/// The ends of all queues: of control, of telemetry, and that of the requests. Once.
pub(crate) fn split() -> (OfControl, OfTelemetry, Producer<'static, Request>) {
    let queues = QUEUES.take();
    let (samples, samples_out) = queues.samples.split();
    let (frames, frames_out) = queues.frames.split();
    let (changes, changes_out) = queues.changes.split();
    let (edges, edges_out) = queues.edges.split();
    let (records, records_out) = queues.records.split();
    let (requests_in, requests) = queues.requests.split();
    let (answers, answers_out) = queues.answers.split();
    let (settings, settings_out) = queues.settings.split();
    let (conditions, conditions_out) = queues.conditions.split();
    let control = OfControl { samples, frames, changes, edges, records, requests, answers, settings, conditions };
    let telemetry = OfTelemetry {
        samples: samples_out,
        frames: frames_out,
        changes: changes_out,
        edges: edges_out,
        records: records_out,
        answers: answers_out,
        settings: settings_out,
        conditions: conditions_out,
    };
    (control, telemetry, requests_in)
}
