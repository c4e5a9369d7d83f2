//! What a board reports once a second: load and reserves of the processor, conditions of the chip.

use serde::{Deserialize, Deserializer, Serialize, de};

/// Load and reserves in the last second.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Cost {
    /// Longest tick by the core's cycle counter: cycles on a chip, instructions on the virtual board, which counts one cycle an instruction.
    pub longest_cycles: u32,
    /// Latest start of a tick after its trigger, us.
    pub latest_start_us: u32,
    /// Records dropped since the boot because a queue was full.
    pub dropped: u32,
    /// Deepest stack since the boot, bytes.
    pub stack_used: u32,
    /// Size of the stack, bytes.
    pub stack_size: u32,
    /// Servo pulses that the break input or a clock failure cut short since the boot, by the widths that were last written.
    pub truncated: u32,
}

/// Conditions of the chip: means over the last second, unless the field says otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Environment {
    /// Temperature of the die, degrees Celsius; `None` on a chip without usable factory readings.
    pub die_c: Option<f32>,
    /// Supply of the converter, V; `None` where the reference has no usable reading.
    pub supply_v: Option<f32>,
    /// Measured clock of the watchdog, Hz; 0: it stands still, `None`: not measured. The last measurement, not a mean.
    pub watchdog_hz: Option<u32>,
    /// Whether a debugger is attached to the core, at the moment of the report.
    pub debugger: bool,
    /// What the board warns of.
    pub warnings: Warnings,
}

/// What a board warns of and arms all the same, as bits: 0 the image has no seal, 1 the brown-out reset has another level than the board's, 2 the robot is
/// the built-in one, 3 a fault or a reset halts the core for the debugger.
///
/// ```
/// use wire::Warnings;
/// let warnings = Warnings::NONE.with(Warnings::BUILT_IN_ROBOT);
/// assert_eq!(warnings.names().collect::<Vec<_>>(), ["built_in_robot"]);
/// assert_eq!(Warnings::from_bits(1 << 4), None);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize)]
pub struct Warnings(u8);

impl Warnings {
    /// Nothing.
    pub const NONE: Self = Self(0);
    /// The image has no seal: the board arms, and its program is not checked.
    pub const UNSEALED: Self = Self(1);
    /// The brown-out reset is off, or at another level than that of the board.
    pub const BROWN_OUT: Self = Self(1 << 1);
    /// The sector of the robot is erased: the board runs the built-in robot.
    pub const BUILT_IN_ROBOT: Self = Self(1 << 2);
    /// A debugger has asked for the core to halt in a fault or after a reset: no handler and no boot runs then.
    pub const CATCHES: Self = Self(1 << 3);
    /// Each with its name in recordings and messages, in order of the bits.
    const NAMED: [(Self, &str); 4] = [
        (Self::UNSEALED, "unsealed"),
        (Self::BROWN_OUT, "brown_out"),
        (Self::BUILT_IN_ROBOT, "built_in_robot"),
        (Self::CATCHES, "catches"),
    ];

    /// From bits; `None` where one is set that has no meaning.
    #[must_use]
    pub const fn from_bits(bits: u8) -> Option<Self> {
        if bits < 1 << Self::NAMED.len() { Some(Self(bits)) } else { None }
    }

    /// As bits.
    #[must_use]
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// These and those.
    #[must_use]
    pub const fn with(self, those: Self) -> Self {
        Self(self.0 | those.0)
    }

    /// The same where `is_on`; otherwise none.
    #[must_use]
    pub const fn when(self, is_on: bool) -> Self {
        if is_on { self } else { Self::NONE }
    }

    /// Whether these are among them.
    #[must_use]
    pub const fn contains(self, these: Self) -> bool {
        self.0 & these.0 == these.0
    }

    /// Those that are there, one by one, in the order of their bits.
    pub fn each(self) -> impl Iterator<Item = Self> {
        Self::NAMED.into_iter().map(|(one, _)| one).filter(move |one| self.contains(*one))
    }

    /// Their names.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        Self::NAMED.into_iter().filter(move |(one, _)| self.contains(*one)).map(|(_, name)| name)
    }
}

impl<'de> Deserialize<'de> for Warnings {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let bits = u8::deserialize(from)?;
        let unknown = || de::Error::invalid_value(de::Unexpected::Unsigned(bits.into()), &"bits 0 to 3");
        Self::from_bits(bits).ok_or_else(unknown)
    }
}
