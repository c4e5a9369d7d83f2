//! The Unix time of a board's ticks.

use crate::channel::clock::unix_ns;

/// Converts ticks to Unix time: the first tick after a boot has the time of its arrival, later ones follow by the board's own clock.
#[derive(Debug, Default)]
pub(super) struct BoardTime {
    /// Unix time in nanoseconds and number of the last tick.
    last: Option<(u64, u32)>,
}

impl BoardTime {
    /// The board left reset.
    pub(super) fn restart(&mut self) {
        self.last = None;
    }

    /// The Unix time of a tick, ns.
    pub(super) fn unix_ns(&mut self, tick: u32) -> u64 {
        self.at(tick, unix_ns)
    }

    fn at(&mut self, tick: u32, now_ns: impl Fn() -> u64) -> u64 {
        // A step of more than half the counter's range is one back: a board that has started again, and whose boot record was lost.
        let later = self.last.filter(|(_, last)| tick.wrapping_sub(*last) <= u32::MAX / 2);
        let ns = later.map_or_else(now_ns, |(ns, last)| ns + u64::from(tick.wrapping_sub(last)) * 1_000_000);
        self.last = Some((ns, tick));
        ns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_follow_the_boards_clock_from_the_first_one_on() {
        let mut time = BoardTime::default();
        assert_eq!(time.at(u32::MAX, || 7_000_000), 7_000_000);
        assert_eq!(time.at(9, || 99), 17_000_000, "the counter may overflow");
        assert_eq!(time.at(5, || 50_000_000), 50_000_000, "a step back is a new start");
        time.restart();
        assert_eq!(time.at(6, || 60_000_000), 60_000_000);
    }
}
