//! Feeds the independent watchdog while everybody else makes progress, in the same thread as telemetry: what starves the thread is
//! caught as well. The rule is [`firmware::liveness::judge`].

use embassy_time::Timer;
use firmware::liveness::{FEED_US, Progress, RETRY_US, Verdict, judge};
use firmware::post_mortem::{Cause, Record, STABLE_RUN_S};

use super::progress;
use crate::{faults, watchdog};

/// Asks every [`FEED_US`].
#[embassy_executor::task]
pub(crate) async fn watchdog_task() -> ! {
    let mut fed = Feeding { since: progress(), feeds: 0 };
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
    feeds: u32,
}

/// One question to the others; true when it could feed.
#[inline(never)]
#[cfg_attr(target_os = "none", unsafe(no_mangle))]
fn watchdog_step(fed: &mut Feeding) -> bool {
    let now = progress();
    match judge(&fed.since, &now) {
        Verdict::Alive => {
            watchdog::feed();
            fed.since = now;
            fed.feeds = fed.feeds.saturating_add(1);
            if fed.feeds == STABLE_RUN_S * 1_000_000 / FEED_US {
                faults::forget_streak();
            }
            true
        }
        Verdict::Wait => false,
        Verdict::Stalled(part) => faults::die(Record::new(Cause::Stalled, [part as u32, 0], "")),
        Verdict::Racing(part) => faults::die(Record::new(Cause::Racing, [part as u32, 0], "")),
    }
}
