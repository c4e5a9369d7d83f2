//! Progress counters of the tasks, which the watchdog task reads.

use core::sync::atomic::{AtomicU32, Ordering};

use firmware_shared::liveness::Progress;

use crate::stopwatch;

/// A counter with one writer, so that load and store need not be one operation.
pub(super) struct Rounds(AtomicU32);

impl Rounds {
    const fn new() -> Self {
        Self(AtomicU32::new(0))
    }

    /// Counts one round.
    pub(super) fn count(&self) {
        self.0.store(self.read().wrapping_add(1), Ordering::Relaxed);
    }

    fn read(&self) -> u32 {
        self.0.load(Ordering::Relaxed)
    }
}

/// Ticks finished.
pub(super) static CONTROL: Rounds = Rounds::new();
/// Samples taken.
pub(super) static SENSOR: Rounds = Rounds::new();
/// Rounds of the telemetry task.
pub(super) static TELEMETRY: Rounds = Rounds::new();

/// Snapshot of the counters; the clock is read first, so that errors only overcount.
pub(super) fn progress() -> Progress {
    let now_us = stopwatch::now_us();
    Progress { control: CONTROL.read(), sensor: SENSOR.read(), telemetry: TELEMETRY.read(), now_us }
}
