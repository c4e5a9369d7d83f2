//! Values of what can happen to the board: causes of resets, registers of the core, DMA streams, readers of the log.

use std::fmt;

use serde::Deserialize;
use stm32f4_model::ResetCause;

use crate::cpu::Reg;

/// Highest frequency of the low speed oscillator that is accepted, Hz.
pub(crate) const HIGHEST_LSI_HZ: f64 = 100_000.0;

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

impl From<Cause> for ResetCause {
    fn from(cause: Cause) -> Self {
        match cause {
            Cause::PowerOn => ResetCause::PowerOn,
            Cause::BrownOut => ResetCause::BrownOut,
            Cause::Pin => ResetCause::Pin,
            Cause::Software => ResetCause::Software,
            Cause::Watchdog => ResetCause::IndependentWatchdog,
            Cause::WindowWatchdog => ResetCause::WindowWatchdog,
            Cause::LowPower => ResetCause::LowPower,
        }
    }
}

/// What becomes of the RAM while the power is off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Memory {
    /// It keeps its content.
    Kept,
    /// Its content is drawn at random.
    Scrambled,
}

/// A stream of a DMA controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Stream {
    /// 1 or 2.
    pub(crate) controller: u8,
    /// 0 to 7.
    pub(crate) stream: u8,
}

/// How the debugger reads the log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum RttReader {
    /// Not at all.
    Stopped,
    /// One byte a millisecond.
    Byte,
}

/// A register of the core: `r0` to `r12`, `sp`, `lr` or `pc`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub(crate) struct CoreRegister(pub(crate) Reg);

impl TryFrom<String> for CoreRegister {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        let number = || name.strip_prefix('r')?.parse().ok().filter(|n: &u8| *n <= 12 && name == format!("r{n}"));
        let reg = match name.as_str() {
            "sp" => Some(Reg::Sp),
            "lr" => Some(Reg::Lr),
            "pc" => Some(Reg::Pc),
            _ => number().map(Reg::R),
        };
        reg.map(CoreRegister)
            .ok_or_else(|| format!("`{name}` is no register of the core; allowed are r0 to r12, sp, lr and pc"))
    }
}

/// As in a file.
impl fmt::Display for CoreRegister {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Reg::R(n) => write!(f, "r{n}"),
            Reg::Lr => f.write_str("lr"),
            Reg::Pc => f.write_str("pc"),
            _ => f.write_str("sp"),
        }
    }
}
