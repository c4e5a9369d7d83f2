//! The four tasks, and what passes between them.
//!
//! ```text
//!  interrupt executor                                   thread executor
//!  (above everything that logs)
//!
//!  DMA interrupt --> sensor --> control --> queues ---> telemetry --> RTT
//!                       |          |                        |
//!                       +----------+------ progress --------+-------> watchdog --> IWDG
//! ```
//!
//! Nothing flows from right to left: what is in the thread can be as slow as it likes, the ticks do not wait.

pub(crate) mod control;
pub(crate) mod sensor;
pub(crate) mod telemetry;
pub(crate) mod watchdog;

use core::sync::atomic::{AtomicU32, Ordering};

use firmware::liveness::Progress;

use crate::stopwatch;

/// How often a task has come round. Each has one writer, so that load and store need not be one operation.
struct Rounds(AtomicU32);

impl Rounds {
    const fn new() -> Self {
        Self(AtomicU32::new(0))
    }

    fn count(&self) {
        self.0.store(self.read().wrapping_add(1), Ordering::Relaxed);
    }

    fn read(&self) -> u32 {
        self.0.load(Ordering::Relaxed)
    }
}

static CONTROL: Rounds = Rounds::new();
static SENSOR: Rounds = Rounds::new();
static TELEMETRY: Rounds = Rounds::new();

/// How far everybody is.
fn progress() -> Progress {
    // The clock first: a tick between the two reads then counts as one too many, never as one too few for long.
    let now_us = stopwatch::now_us();
    Progress { control: CONTROL.read(), sensor: SENSOR.read(), telemetry: TELEMETRY.read(), now_us }
}

/// Ticks since the start, the time stamp of the log: it exists before any clock does.
pub(crate) fn ticks() -> u32 {
    CONTROL.read()
}
