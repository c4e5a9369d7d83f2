//! Records at the start of a board: what it is and what it runs, or why it does not run.

use heapless::String;
use serde::{Deserialize, Serialize};

/// The board, its image and its parameters: the first record after a reset.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Boot {
    /// [`crate::VERSION`] of the image. It is the first field in every version, so that any reader can read it.
    pub version: u16,
    /// Name of the board, as its Cargo feature.
    pub board: String<24>,
    /// Name of the chip, as probe-rs writes it.
    pub chip: String<24>,
    /// Cause of the reset.
    pub reset: Reset,
    /// Crashes in a row before this boot.
    pub streak: u32,
    /// The factory's code of the internal voltage reference.
    pub reference_cal: u16,
    /// Supply below which no sample is good, V.
    pub min_supply_v: f32,
    /// Whether the joints move only while the sensors are good.
    pub sensor_required: bool,
    /// The generator record that the board runs; `None` where the parameters are refused, see [`Refused`].
    pub generator: Option<RecordId>,
    /// The sensor record that the board runs; `None` as above.
    pub sensors: Option<RecordId>,
    /// The robot record that the board runs; `None` as above.
    pub robot: Option<RecordId>,
    /// Whether the outputs stay off: the image is built with the feature `shadow`.
    pub shadow: bool,
    /// How the outputs of the run before the reset ended; `None` where the reset lost it: after a power-on or a brown-out.
    pub last_outputs: Option<LastOutputs>,
    /// Whether the image has a seal, the check sum by which the program proves its own bytes; `None` on a board whose program checks none.
    pub sealed: Option<bool>,
    /// Level of the brown-out reset that the chip has, and that of the board.
    pub brown_out: BrownOut,
}

/// Level of the brown-out reset: 0 is off, 3 is the highest. Of a chip whose detector has no levels 0 is off and 1 is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct BrownOut {
    /// In the option bytes, or in the register of the detector.
    pub level: u8,
    /// The one that fits the board's supply.
    pub wanted: u8,
}

impl BrownOut {
    /// Whether the chip has the level of its board.
    #[must_use]
    pub const fn is_right(self) -> bool {
        self.level == self.wanted
    }
}

impl core::fmt::Display for BrownOut {
    /// In words, after `the brown-out reset is`.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self.level {
            0 => f.write_str("off"),
            level => write!(f, "at level {level}"),
        }?;
        write!(f, "; this board wants level {}", self.wanted)
    }
}

/// How the servo outputs of a run ended, from memory that a reset keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct LastOutputs {
    /// The last pulses that the loop commanded, in joint order, us; 0: none, or so long ago that they are not known any more. The loop starts its
    /// next motion from them ([`joint_loop::JointLoop::start_from`]).
    pub pulses_us: [u16; 4],
    /// Whether the outputs were on when the reset came: it may have cut the pulse of each servo.
    pub on: bool,
    /// Pulses that the break input or a clock failure cut short in that run.
    pub cut: u32,
}

/// What identifies a record in flash: its name is for people, its check sum is of all of it, the name included.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RecordId {
    /// Name; `built-in` where the sector is erased.
    pub name: String<24>,
    /// Check sum.
    pub crc: u32,
}

impl RecordId {
    /// A name of at most 24 bytes and a check sum. A longer name, which no record has, becomes empty.
    #[must_use]
    pub fn new(name: &str, crc: u32) -> Self {
        Self { name: String::try_from(name).unwrap_or_default(), crc }
    }
}

/// Cause of a reset. The order is part of the version.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Reset {
    /// Supply switched on.
    PowerOn,
    /// Supply too low for a moment.
    BrownOut,
    /// The independent watchdog was not reloaded in time.
    IndependentWatchdog,
    /// The window watchdog was not reloaded in time.
    WindowWatchdog,
    /// The program asked for it.
    Software,
    /// A low-power mode was entered against the option bytes.
    LowPower,
    /// The reset pin.
    Pin,
}

impl Reset {
    /// Every cause, in order.
    pub const ALL: [Self; 7] = [
        Self::PowerOn,
        Self::BrownOut,
        Self::IndependentWatchdog,
        Self::WindowWatchdog,
        Self::Software,
        Self::LowPower,
        Self::Pin,
    ];

    /// Name in recordings and messages.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::PowerOn => "power_on",
            Self::BrownOut => "brown_out",
            Self::IndependentWatchdog => "iwdg",
            Self::WindowWatchdog => "wwdg",
            Self::Software => "software",
            Self::LowPower => "low_power",
            Self::Pin => "pin",
        }
    }
}

/// The board does not use a record or a clock, or does not arm: what, and the reason.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Refused {
    /// What is refused.
    pub subject: Subject,
    /// The reason as text: what is wrong and what is allowed; cut at 160 bytes.
    pub reason: String<160>,
}

/// What can be refused. The order is part of the version.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Subject {
    /// The generator record in flash. The outputs stay off until another one is written.
    GeneratorRecord,
    /// The sensor record in flash. The outputs stay off until another one is written.
    SensorRecord,
    /// The robot record in flash. The outputs stay off until another one is written.
    RobotRecord,
    /// Generator, sensors, robot and chip do not fit together. The outputs stay off.
    Configuration,
    /// The clock: the crystal does not start. The outputs stay off.
    Clock,
    /// Arming: the button is ignored.
    Arming,
}

impl Subject {
    /// Every subject, in order.
    pub const ALL: [Self; 6] =
        [Self::GeneratorRecord, Self::SensorRecord, Self::RobotRecord, Self::Configuration, Self::Clock, Self::Arming];

    /// Name in recordings and messages.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::GeneratorRecord => "generator_record",
            Self::SensorRecord => "sensor_record",
            Self::RobotRecord => "robot_record",
            Self::Configuration => "configuration",
            Self::Clock => "clock",
            Self::Arming => "arming",
        }
    }
}

impl Refused {
    /// A refusal with a reason that can be printed; a text of more than 160 bytes is cut between two characters.
    ///
    /// ```
    /// use wire::{Refused, Subject};
    /// let refused = Refused::new(Subject::Clock, format_args!("the {} MHz clock did not start", 8));
    /// assert_eq!(refused.reason, "the 8 MHz clock did not start");
    /// assert_eq!(Refused::new(Subject::Clock, "é".repeat(100)).reason.len(), 160);
    /// ```
    #[must_use]
    pub fn new(subject: Subject, reason: impl core::fmt::Display) -> Self {
        struct Cut(String<160>);
        impl core::fmt::Write for Cut {
            fn write_str(&mut self, text: &str) -> core::fmt::Result {
                text.chars().try_for_each(|character| self.0.push(character).map_err(|_| core::fmt::Error))
            }
        }
        let mut cut = Cut(String::new());
        // An error means that the text was cut.
        let _ = core::fmt::write(&mut cut, format_args!("{reason}"));
        Self { subject, reason: cut.0 }
    }
}
