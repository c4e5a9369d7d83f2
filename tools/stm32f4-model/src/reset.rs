//! Causes of a reset and their flags in RCC_CSR (RM0090 6.1.1 "System reset", 6.3.21 "RCC_CSR").

use core::fmt;

/// Cause of a reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ResetCause {
    /// Supply switched on: the only reset that clears the backup domain and the debug registers.
    PowerOn,
    /// The supply fell below the level of the brown-out reset.
    BrownOut,
    /// NRST pulled low from outside.
    Pin,
    /// SYSRESETREQ written to the core's AIRCR.
    Software,
    /// Timeout of the independent watchdog.
    IndependentWatchdog,
    /// The window watchdog.
    WindowWatchdog,
    /// A low-power mode was entered against the option bytes.
    LowPower,
}

impl ResetCause {
    /// The bits that this reset sets in RCC_CSR. Each reset pulls NRST low inside the chip, so that PINRSTF is set too.
    pub(crate) const fn flags(self) -> u32 {
        const BOR: u32 = 1 << 25;
        const PIN: u32 = 1 << 26;
        const POR: u32 = 1 << 27;
        const SOFT: u32 = 1 << 28;
        const IWDG: u32 = 1 << 29;
        const WWDG: u32 = 1 << 30;
        const LPWR: u32 = 1 << 31;
        PIN | match self {
            ResetCause::PowerOn => BOR | POR,
            ResetCause::BrownOut => BOR,
            ResetCause::Pin => 0,
            ResetCause::Software => SOFT,
            ResetCause::IndependentWatchdog => IWDG,
            ResetCause::WindowWatchdog => WWDG,
            ResetCause::LowPower => LPWR,
        }
    }
}

/// `power_on`, `brown_out`, `pin`, `software`, `iwdg`, `wwdg` or `low_power`.
impl fmt::Display for ResetCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            ResetCause::PowerOn => "power_on",
            ResetCause::BrownOut => "brown_out",
            ResetCause::Pin => "pin",
            ResetCause::Software => "software",
            ResetCause::IndependentWatchdog => "iwdg",
            ResetCause::WindowWatchdog => "wwdg",
            ResetCause::LowPower => "low_power",
        })
    }
}
