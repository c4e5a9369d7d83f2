//! The interface to the board: [`Sample`] in, [`Command`] out.
//!
//! A board fills a [`Sample`] once per control period and carries out the [`Command`]: firmware, a host replay of recorded
//! inputs, or a test. The docs of the fields state its duties.

use crate::control::watchdog_clock::WatchdogHz;
use crate::tuning::Request;
use joint_units::{AdcCode, Joint, PulseMicros};

/// Largest number of periods that one call counts; more are counted as this many. The wire format has one byte for it.
pub const MAX_ELAPSED: u32 = 255;

/// Inputs of one tick, all taken at one instant. `S` is the number of sensor channels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sample<const S: usize> {
    /// Control periods since the previous call: 1 normally, more if periods were missed. The board takes it from a
    /// free-running hardware timer and calls **once** for any number of periods: missed ticks are dropped. The value is
    /// clamped to 1 to [`MAX_ELAPSED`].
    pub elapsed: u32,
    /// Raw code of each gait sensor; any value on a channel without a sensor. If the converter delivered no new code, the board
    /// repeats the last one and sets [`BoardFaults::ADC_OVERRUN`].
    pub codes: [AdcCode; S],
    /// Raw code of the internal reference, converted in the same sequence.
    pub vrefint: AdcCode,
    /// Raw level of the user button, true while it is pressed. The loop debounces it.
    pub button: bool,
    /// Raw level of the foot switch, true while the foot is on the floor; false without a switch. Its rising edge is a heel
    /// strike. The follower rejects a bounce by its interval.
    pub foot: bool,
    /// Whether this tick began too long after its trigger, or the one before ended too long after its own (more than 100 and 500 us in the
    /// firmware of this repository). Many late ticks stop the motion, see [`crate::control::timeliness`].
    pub late: bool,
    /// Faults that the board found since the previous call. The board repeats a fault while it lasts.
    pub faults: BoardFaults,
    /// A new measurement of the clock of the board's watchdog; `None` in the ticks between. The first one must come before the first arming.
    pub watchdog_clock: Option<WatchdogHz>,
    /// Whether a debugger is attached to the core, which it may halt.
    pub debugger: Debugger,
    /// Whether the program in flash is not proven to be the one that was built: its check after the boot has not ended, or a check found
    /// another one. Such a board does not arm, and a motion stops.
    pub program_unproven: bool,
    /// What a host asks for in this tick; see [`crate::tuning`].
    pub request: Option<Request>,
}

impl<const S: usize> Default for Sample<S> {
    /// One period, button released, no foot on the floor, no fault, no measurement, no debugger, a proven program, no request, all codes 0 (a short circuit for any sensor).
    fn default() -> Self {
        Self {
            elapsed: 1,
            codes: [AdcCode(0); S],
            vrefint: AdcCode(0),
            button: false,
            foot: false,
            late: false,
            faults: BoardFaults::NONE,
            watchdog_clock: None,
            debugger: Debugger::Absent,
            program_unproven: false,
            request: None,
        }
    }
}

/// Whether a debugger is attached.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Debugger {
    /// None is attached.
    #[default]
    Absent,
    /// One is attached; the loop does not act on it, a recording has it.
    Attached,
    /// One is attached, and the board refuses it: the loop stops and does not arm.
    Refused,
}

/// Faults that the board found: a set of at most six bits, as in the wire format.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BoardFaults(u8);

impl BoardFaults {
    /// No fault.
    pub const NONE: Self = Self(0);
    /// The converter lost or did not finish a conversion; this tick repeats old codes. A few per second are tolerated.
    pub const ADC_OVERRUN: Self = Self(1 << 0);
    /// The break input is active: hardware has already switched the outputs off.
    pub const BREAK_INPUT: Self = Self(1 << 1);
    /// The clock failed or is not the configured one.
    pub const CLOCK: Self = Self(1 << 2);
    /// A task made no progress; a reset by the watchdog is near.
    pub const WATCHDOG: Self = Self(1 << 3);
    /// The outputs were found on when commanded off, or off when commanded on.
    pub const OUTPUTS: Self = Self(1 << 4);
    /// All bits of the set. A bit without a name is a fault like the others.
    pub const CARRIED: u8 = 0x3f;

    /// Faults from bits. Bits outside [`BoardFaults::CARRIED`] are dropped.
    #[must_use]
    pub const fn from_bits(bits: u8) -> Self {
        Self(bits & Self::CARRIED)
    }

    /// Bits of the set.
    #[must_use]
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// Union of both sets.
    #[must_use]
    pub const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// This set without the faults of `other`.
    #[must_use]
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// Whether all faults of `other` are set.
    #[must_use]
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Whether no fault is set.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }
}

/// Outputs of one tick: the servo pulses until the next tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Command {
    /// Pulse widths in joint order, or `None`: the main output is off. After a fault the board switches off **at once**, even
    /// during a pulse; at the end of a stop the present pulse may be completed. Before the board switches the output on, it
    /// loads all four compare registers, so that no first pulse is shortened. While the output is on, it writes preloaded
    /// registers only.
    pub pulses: Option<[PulseMicros; Joint::COUNT]>,
}

impl Command {
    /// Outputs off.
    pub const OFF: Self = Self { pulses: None };
}
