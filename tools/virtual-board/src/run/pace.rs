//! Virtual time beside real time.

use std::time::{Duration, Instant};

/// How far virtual time may be behind real time before it no longer catches up.
const MOST_BEHIND: Duration = Duration::from_millis(50);
/// How far virtual time may be ahead after it was not paced.
const MOST_AHEAD: Duration = Duration::from_millis(20);

/// A moment of real time, and the virtual time that belongs to it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pace {
    since: Instant,
    from_s: f64,
}

impl Pace {
    /// Virtual time begins now.
    pub(super) fn start() -> Self {
        Pace { since: Instant::now(), from_s: 0.0 }
    }

    /// The real time of a virtual one, s.
    pub(super) fn due(&self, seconds: f64) -> Instant {
        self.since + Duration::from_secs_f64((seconds - self.from_s).max(0.0))
    }

    /// Takes the present moment for that of a virtual time, s, unless they are close.
    pub(super) fn follow(&mut self, seconds: f64) {
        let (now, due) = (Instant::now(), self.due(seconds));
        if due + MOST_BEHIND < now || due > now + MOST_AHEAD {
            *self = Pace { since: now, from_s: seconds };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lead_is_kept_and_a_long_lag_is_dropped() {
        let mut pace = Pace::start();
        let since = pace.since;
        assert_eq!(pace.due(1.5), since + Duration::from_millis(1500));
        pace.follow(0.01);
        assert_eq!(pace.due(1.5), since + Duration::from_millis(1500), "close enough");
        pace.follow(100.0);
        assert!(pace.due(100.0) <= Instant::now(), "an unpaced run was ahead");
        pace.since -= Duration::from_secs(1);
        pace.follow(100.0);
        assert!(pace.since + Duration::from_millis(500) > Instant::now());
    }
}
