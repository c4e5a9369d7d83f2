//! The watchdog task: reloads the independent watchdog while sampling, control and telemetry make progress. It runs in the thread of
//! telemetry, so that a thread without processor time is detected too. The rules are
//! [`firmware_shared::liveness::judge`] and [`firmware_shared::liveness::keeps_pace`].

use embassy_time::Timer;
use firmware_shared::liveness::{FEED_US, Liveness, Part, Progress, RETRY_US, judge, keeps_pace};
use firmware_shared::oscillator::MEASURED_EVERY_S;
use firmware_shared::post_mortem::{Cause, Record, STABLE_RUN_S};

use super::progress::progress;
use crate::removed::{Protection, lacks};
use crate::{faults, log, servo_pwm, watchdog, watchdog_clock};

/// Checks every [`FEED_US`].
#[embassy_executor::task]
pub(crate) async fn watchdog_task() -> ! {
    let begun = progress();
    let mut fed = Feeding { since: begun, pace_from: begun, feeds: 0 };
    watchdog::feed();
    loop {
        Timer::after_micros(FEED_US.into()).await;
        while !watchdog_step(&mut fed) {
            Timer::after_micros(RETRY_US.into()).await;
        }
    }
}

struct Feeding {
    since: Progress,
    /// Progress at which the pace was last found right.
    pace_from: Progress,
    feeds: u32,
}

/// Checks the progress once; true if it reloaded the watchdog.
#[inline(never)]
fn watchdog_step(fed: &mut Feeding) -> bool {
    let now = progress();
    if lacks(Protection::Liveness) {
        watchdog::feed();
        return true;
    }
    match keeps_pace(&fed.pace_from, &now) {
        Liveness::Alive => fed.pace_from = now,
        Liveness::Stalled(part) => end(part, Cause::Stalled),
        Liveness::Wait | Liveness::Racing(_) => {}
    }
    match judge(&fed.since, &now) {
        Liveness::Alive => {
            watchdog::feed();
            fed.since = now;
            fed.feeds = fed.feeds.saturating_add(1);
            if fed.feeds == STABLE_RUN_S * 1_000_000 / FEED_US {
                faults::forget_streak();
            }
            // Right after a reload there is the most time for it.
            if fed.feeds.is_multiple_of(MEASURED_EVERY_S * 1_000_000 / FEED_US) {
                watchdog_clock::measure();
            }
            true
        }
        Liveness::Wait => false,
        Liveness::Stalled(part) => end(part, Cause::Stalled),
        Liveness::Racing(part) => end(part, Cause::Racing),
    }
}

/// Switches the servos off, reports the part that failed, and resets.
fn end(part: Part, cause: Cause) -> ! {
    servo_pwm::outputs_off();
    log::stalled(part, cause.name());
    faults::die(Record::new(cause, [part as u32, 0], ""))
}
