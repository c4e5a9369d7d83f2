//! A sensor's codes as they are when something is broken: each takes the stream as it should be and gives it as it comes.

use joint_units::AdcCode;

/// What is wrong with the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Degraded {
    /// Nothing.
    Sound,
    /// From this tick on the wire is off: the pull-down reads near 0.
    Open(u32),
    /// From this tick on the wire is at the supply.
    Short(u32),
    /// From this tick on the code stays as it is.
    Stuck(u32),
    /// One sample in so many is a spike of electromagnetic noise.
    Spikes(u32),
    /// The wire is off for the first of so many ticks, of so many in all.
    DropOuts {
        /// Ticks off.
        off: u32,
        /// Ticks from one drop-out to the next.
        every: u32,
    },
}

/// A stream of codes under way.
#[derive(Debug, Clone)]
pub struct Stream {
    what: Degraded,
    tick: u32,
    last: AdcCode,
}

impl Stream {
    /// A stream from its first tick on.
    #[must_use]
    pub const fn new(what: Degraded) -> Self {
        Self { what, tick: 0, last: AdcCode(0) }
    }

    /// The code that comes where this one should.
    pub fn code(&mut self, code: AdcCode) -> AdcCode {
        self.tick += 1;
        let tick = self.tick;
        let off = AdcCode(3);
        let given = match self.what {
            Degraded::Sound => code,
            Degraded::Open(from) if tick >= from => off,
            Degraded::Short(from) if tick >= from => AdcCode(4090),
            Degraded::Stuck(from) if tick > from => self.last,
            Degraded::Spikes(every) if tick.is_multiple_of(every) => AdcCode(code.0.saturating_add(900).min(3900)),
            Degraded::DropOuts { off: ticks, every } if tick % every < ticks => off,
            _ => code,
        };
        self.last = given;
        given
    }
}
