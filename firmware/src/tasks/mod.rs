//! The three tasks, and what passes between them.
//!
//! ```text
//!  interrupt executor                                   thread executor
//!  (above everything that logs)
//!
//!  DMA interrupt --> control (sample, tick, pulses) --> queues ---> telemetry --> RTT
//!                       |                                               |
//!                       +---------------- progress --------------------+-------> watchdog --> IWDG
//! ```
//!
//! Nothing flows from right to left: the ticks never wait for the thread.

pub(crate) mod control;
pub(crate) mod sensor;
pub(crate) mod telemetry;
pub(crate) mod watchdog;

use core::sync::atomic::{AtomicU32, Ordering};

use firmware::liveness::Progress;

use crate::stopwatch;

/// Counts rounds. Each has one writer, so that load and store need not be one operation.
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

/// Snapshot of the counters; the clock is read first, so that errors only overcount.
fn progress() -> Progress {
    let now_us = stopwatch::now_us();
    Progress { control: CONTROL.read(), sensor: SENSOR.read(), telemetry: TELEMETRY.read(), now_us }
}
