//! What can happen in a campaign: the words of its file.

use anyhow::Result;
use serde::Deserialize;
use stm32f4_model::{Pin, ResetCause};

use crate::inject::{self, InjectionKind};
use crate::loader::ProgramImage;

/// What happens.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(crate) enum Inject {
    /// The function never returns.
    Hang(String),
    /// The function executes an undefined instruction.
    Undefined(String),
    /// The program panics.
    Panic,
    /// The crystal stops.
    Crystal,
    /// The converter loses a result.
    Overrun,
    /// A DMA transfer fails.
    Transfer,
    /// The timer that triggers the conversions stops.
    Trigger,
    /// Bits of a word change, of a register or in RAM.
    Flip {
        /// Address of the word.
        address: u32,
        /// The bits.
        mask: u32,
    },
    /// The supply becomes this voltage.
    Supply(f64),
    /// A pin of the converter gets this voltage.
    Volts {
        /// The pin.
        pin: PinName,
        /// V.
        volts: f64,
    },
    /// An input gets this level.
    Level {
        /// The pin.
        pin: PinName,
        /// High or low.
        high: bool,
    },
    /// An instruction takes so many cycles.
    Slow(f64),
    /// A debugger halts the core.
    Halt,
    /// The oscillator of the watchdog gets this frequency, Hz; 0 stops it.
    Lsi(f64),
    /// An exception is enabled and pending, though nothing has requested it: 2 to 15 those of the core, 16 and more the interrupts.
    Exception(u8),
    /// The chip is reset.
    Reset(Cause),
    /// A half-word of the flash reads as this from now on.
    Flash {
        /// Its address, even.
        address: u32,
        /// What it reads as.
        half: u16,
    },
}

/// Cause of a reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Cause {
    /// The supply was switched on.
    PowerOn,
    /// The supply was too low for a moment.
    BrownOut,
    /// The reset pin.
    Pin,
    /// The program.
    Software,
    /// The independent watchdog.
    Watchdog,
    /// The window watchdog.
    WindowWatchdog,
    /// A low-power mode.
    LowPower,
}

impl Inject {
    /// The same as an injection into an image.
    ///
    /// # Errors
    /// The image lacks the function.
    pub(crate) fn kind(&self, image: &ProgramImage) -> Result<InjectionKind> {
        Ok(match self {
            Inject::Hang(symbol) => InjectionKind::Hang(image.find_function(symbol)?),
            Inject::Undefined(symbol) => InjectionKind::Fault(image.find_function(symbol)?),
            Inject::Panic => inject::panic_in(image)?.1,
            Inject::Crystal => InjectionKind::Crystal,
            Inject::Overrun => InjectionKind::Overrun,
            Inject::Transfer => InjectionKind::Transfer,
            Inject::Trigger => InjectionKind::Trigger,
            Inject::Flip { address, mask } => InjectionKind::Flip { address: *address, mask: *mask },
            Inject::Supply(volts) => InjectionKind::Supply(*volts),
            Inject::Volts { pin, volts } => InjectionKind::Volts(pin.0, *volts),
            Inject::Level { pin, high } => InjectionKind::Level(pin.0, *high),
            Inject::Slow(cpi) => InjectionKind::Slow(*cpi),
            Inject::Halt => InjectionKind::Halt,
            Inject::Lsi(hz) => InjectionKind::LowSpeedClock(*hz),
            Inject::Exception(number) => InjectionKind::Exception(*number),
            Inject::Reset(cause) => InjectionKind::Reset(match cause {
                Cause::PowerOn => ResetCause::PowerOn,
                Cause::BrownOut => ResetCause::BrownOut,
                Cause::Pin => ResetCause::Pin,
                Cause::Software => ResetCause::Software,
                Cause::Watchdog => ResetCause::IndependentWatchdog,
                Cause::WindowWatchdog => ResetCause::WindowWatchdog,
                Cause::LowPower => ResetCause::LowPower,
            }),
            Inject::Flash { address, half } => InjectionKind::Flash { address: *address, half: *half },
        })
    }
}

/// The name of a pin, as `PA1`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "String")]
pub(crate) struct PinName(pub(crate) Pin);

impl TryFrom<String> for PinName {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        name.parse().map(PinName).map_err(|error| format!("{error}"))
    }
}
