//! The inputs of a call beside the converter's codes, as bits.

use joint_loop::{BoardFaults, Debugger, Sample};
use serde::{Deserialize, Deserializer, Serialize, de};

/// Button, foot switch, lateness, board faults, debugger and check of the program of one call of the loop.
///
/// ```
/// use wire::Flags;
/// use joint_loop::BoardFaults;
/// let flags = Flags::from_bits(0b1_0000_0101).unwrap();
/// assert!(flags.button() && flags.foot() && !flags.late());
/// assert_eq!(flags.faults(), BoardFaults::ADC_OVERRUN);
/// assert_eq!(Flags::from_bits(1 << 12), None);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize)]
pub struct Flags(u16);

impl Flags {
    const BUTTON: u16 = 1 << 0;
    const LATE: u16 = 1 << 1;
    const FAULTS_SHIFT: u32 = 2;
    const FOOT: u16 = 1 << 8;
    const DEBUGGER: u16 = 1 << 9;
    const REFUSED: u16 = 1 << 10;
    const UNPROVEN: u16 = 1 << 11;
    /// All bits that have a meaning: 0 button, 1 late, 2 to 7 faults of the board, 8 foot on the floor, 9 a debugger is attached, 10 the board
    /// refuses it, 11 the program in flash is not proven to be the one that was built.
    pub const ALL: u16 = Self::BUTTON
        | Self::LATE
        | ((BoardFaults::CARRIED as u16) << Self::FAULTS_SHIFT)
        | Self::FOOT
        | Self::DEBUGGER
        | Self::REFUSED
        | Self::UNPROVEN;

    /// The flags of a sample.
    #[must_use]
    pub const fn of<const S: usize>(sample: &Sample<S>) -> Self {
        let mut bits = (sample.faults.bits() as u16) << Self::FAULTS_SHIFT;
        if sample.button {
            bits |= Self::BUTTON;
        }
        if sample.late {
            bits |= Self::LATE;
        }
        if sample.foot {
            bits |= Self::FOOT;
        }
        if sample.program_unproven {
            bits |= Self::UNPROVEN;
        }
        bits |= match sample.debugger {
            Debugger::Absent => 0,
            Debugger::Attached => Self::DEBUGGER,
            Debugger::Refused => Self::DEBUGGER | Self::REFUSED,
        };
        Self(bits)
    }

    /// From bits; `None` where one is set that is not in [`Flags::ALL`], or a debugger is refused that is not attached.
    #[must_use]
    pub const fn from_bits(bits: u16) -> Option<Self> {
        let is_known = bits & !Self::ALL == 0 && bits & (Self::DEBUGGER | Self::REFUSED) != Self::REFUSED;
        if is_known { Some(Self(bits)) } else { None }
    }

    /// As bits, see [`Flags::ALL`].
    #[must_use]
    pub const fn bits(self) -> u16 {
        self.0
    }

    /// The user button is pressed.
    #[must_use]
    pub const fn button(self) -> bool {
        self.0 & Self::BUTTON != 0
    }

    /// The tick began more than 100 us after its trigger, or the one before ended more than 500 us after its own.
    #[must_use]
    pub const fn late(self) -> bool {
        self.0 & Self::LATE != 0
    }

    /// The foot is on the floor.
    #[must_use]
    pub const fn foot(self) -> bool {
        self.0 & Self::FOOT != 0
    }

    /// Whether a debugger is attached.
    #[must_use]
    pub const fn debugger(self) -> Debugger {
        match self.0 & (Self::DEBUGGER | Self::REFUSED) {
            0 => Debugger::Absent,
            Self::DEBUGGER => Debugger::Attached,
            _ => Debugger::Refused,
        }
    }

    /// The program in flash is not proven to be the one that was built.
    #[must_use]
    pub const fn program_unproven(self) -> bool {
        self.0 & Self::UNPROVEN != 0
    }

    /// Faults that the board found since the previous call.
    #[must_use]
    pub const fn faults(self) -> BoardFaults {
        BoardFaults::from_bits((self.0 >> Self::FAULTS_SHIFT) as u8)
    }
}

impl<'de> Deserialize<'de> for Flags {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let bits = u16::deserialize(from)?;
        let unknown =
            || de::Error::invalid_value(de::Unexpected::Unsigned(bits.into()), &"bits 0 to 11, and 9 with 10");
        Self::from_bits(bits).ok_or_else(unknown)
    }
}
