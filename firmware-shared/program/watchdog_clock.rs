//! The measured clock of the watchdog, from the task that measures it to the ticks and to telemetry.

use portable_atomic::{AtomicU32, Ordering};

use joint_loop::WatchdogHz;

use crate::removed::{Protection, lacks};
use crate::stopwatch;

/// No measurement.
const NONE: u32 = u32::MAX;
/// The last one, Hz.
static LAST: AtomicU32 = AtomicU32::new(NONE);
/// The same until a tick takes it.
static NEW: AtomicU32 = AtomicU32::new(NONE);

/// Measures it, which takes 1 to 8 ms.
pub(crate) fn measure() {
    let WatchdogHz(measured) = stopwatch::measure_watchdog_clock();
    /// In the middle of what is allowed.
    const NOMINAL_HZ: u32 = 32_000;
    let hz = if lacks(Protection::WatchdogClock) { NOMINAL_HZ } else { measured };
    LAST.store(hz, Ordering::Relaxed);
    NEW.store(hz, Ordering::Relaxed);
}

/// The measurement since the last call, for the tick.
pub(crate) fn take() -> Option<WatchdogHz> {
    let hz = NEW.swap(NONE, Ordering::Relaxed);
    (hz != NONE).then_some(WatchdogHz(hz))
}

/// The last measurement.
pub(crate) fn last() -> Option<WatchdogHz> {
    let hz = LAST.load(Ordering::Relaxed);
    (hz != NONE).then_some(WatchdogHz(hz))
}
