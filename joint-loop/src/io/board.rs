//! The contract with the board: what it delivers for a tick, and what it does with the answer.
//!
//! A board is anything that can fill a [`Sample`] once a control period and carry out a [`Command`]: firmware, a host
//! replay of its recorded inputs, a test. The field docs state the duties of whoever implements one.

use joint_units::{AdcCode, Joint, PulseMicros};

/// Most periods that one call can account for: a longer silence counts as this many. The wire format has one byte for it.
pub const MAX_ELAPSED: u32 = 255;

/// What the board delivers for one tick, all taken at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sample<const S: usize> {
    /// Control periods since the previous call: 1 normally, more when periods were missed. The board takes it from a free
    /// running hardware timer and calls **once**, however many periods went by: missed ticks are dropped, never caught up.
    /// Values are taken as 1 to [`MAX_ELAPSED`].
    pub elapsed: u32,
    /// Raw code of each gait sensor; whatever it is where none is worn. When the converter delivered nothing new, the board repeats the last code and sets
    /// [`BoardFaults::ADC_OVERRUN`].
    pub codes: [AdcCode; S],
    /// Raw code of the internal reference, converted in the same sequence.
    pub vrefint: AdcCode,
    /// Raw level of the user button, true while it is held; the loop debounces it.
    pub button: bool,
    /// Raw level of the foot switch, true while the foot is on the floor; false where none is wired. Its rising edge is a heel strike, and
    /// a bounce is none: whoever takes it looks at the interval.
    pub foot: bool,
    /// The previous tick ended after its deadline. Counted, nothing else.
    pub late: bool,
    /// Faults that the board found since the previous call; it repeats one for as long as it lasts.
    pub faults: BoardFaults,
}

impl<const S: usize> Default for Sample<S> {
    /// One period later, nothing pressed, no foot on the floor, no fault, all codes 0 (which any sensor calls a short).
    fn default() -> Self {
        Self {
            elapsed: 1,
            codes: [AdcCode(0); S],
            vrefint: AdcCode(0),
            button: false,
            foot: false,
            late: false,
            faults: BoardFaults::NONE,
        }
    }
}

/// What the board found wrong: a set of bits, six at most (the wire format has room for no more).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BoardFaults(u8);

impl BoardFaults {
    /// Nothing wrong.
    pub const NONE: Self = Self(0);
    /// The converter lost or did not finish a conversion; this tick's codes are old ones. Tolerated a few times a second.
    pub const ADC_OVERRUN: Self = Self(1 << 0);
    /// The break input is active: hardware has already switched the outputs off.
    pub const BREAK_INPUT: Self = Self(1 << 1);
    /// The clock failed or is not the one that was configured.
    pub const CLOCK: Self = Self(1 << 2);
    /// A task that must make progress has not; the watchdog is about to bite.
    pub const WATCHDOG: Self = Self(1 << 3);
    /// The outputs were found on when commanded off, or off when commanded on.
    pub const OUTPUTS: Self = Self(1 << 4);
    /// All bits that can be carried. A bit without a name of its own is a fault like the others: nothing is ignored.
    pub const CARRIED: u8 = 0x3f;

    /// From bits; those beyond [`BoardFaults::CARRIED`] are dropped.
    #[must_use]
    pub const fn from_bits(bits: u8) -> Self {
        Self(bits & Self::CARRIED)
    }

    /// As bits.
    #[must_use]
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// These and those.
    #[must_use]
    pub const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// These without those.
    #[must_use]
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// Whether every one of `other` is set.
    #[must_use]
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Whether none is set.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }
}

/// What the board shall do with the servos until the next tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Command {
    /// Pulse widths in joint order, or `None`: the main output goes off and stays off. After a fault that is **now**, in the
    /// middle of a pulse if need be; at the end of a stop the pulse that is under way may run to its end. When pulses come
    /// after none, the board loads all four compare registers before it switches the output on, so that no first pulse is a
    /// runt; after that it only ever writes preloaded registers.
    pub pulses: Option<[PulseMicros; Joint::COUNT]>,
}

impl Command {
    /// Outputs off.
    pub const OFF: Self = Self { pulses: None };
}
