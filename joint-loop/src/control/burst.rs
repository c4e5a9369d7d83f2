//! Counts events within one second of the first of them.

/// The events, and the time since the first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Burst {
    count: u32,
    /// Periods since the first.
    age: u32,
}

impl Burst {
    /// Adds the events of a tick, `elapsed` periods after the one before; the events since the first one of the last `second` periods. After a
    /// second the next event is a first one again.
    pub(crate) fn note(&mut self, events: u32, elapsed: u32, second: u32) -> u32 {
        self.age = self.age.saturating_add(elapsed);
        if self.count == 0 || self.age >= second {
            (self.count, self.age) = (0, 0);
        }
        self.count = self.count.saturating_add(events);
        self.count
    }
}
