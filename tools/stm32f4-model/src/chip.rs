//! The modelled chips, and what differs between them: identity, memory, ratings, interrupts.

use core::fmt;

/// A chip of the family.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Chip {
    /// STM32F407VG (RM0090).
    #[default]
    F407,
    /// STM32F411CE (RM0383).
    F411,
}

/// The highest frequencies of a chip, Hz, at 2.7 to 3.6 V.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ratings {
    /// HCLK by the scale of the regulator, as PWR_CR.VOS names it; the first where it has one bit.
    pub(crate) hclk: [f64; 4],
    pub(crate) pclk: [f64; 2],
    /// HCLK for 0, 1, 2, ... wait states of the flash.
    pub(crate) flash: &'static [f64],
}

/// Interrupts of the F407 and of the F411 (RM0090 table 62, RM0383 table 37): bit n is position n.
const F407_INTERRUPTS: u128 = (1 << 82) - 1;
const F411_INTERRUPTS: u128 = {
    let absent: [(u8, u8); 10] =
        [(19, 22), (39, 39), (43, 46), (48, 48), (52, 55), (61, 66), (74, 80), (82, 83), (86, 95), (96, 127)];
    let mut all = u128::MAX;
    let mut index = 0;
    while index < absent.len() {
        let (mut line, last) = absent[index];
        while line <= last {
            all &= !(1 << line);
            line += 1;
        }
        index += 1;
    }
    all
};

impl Chip {
    /// Size of the flash, bytes (RM0090 3.4, RM0383 3.3).
    #[must_use]
    pub const fn flash_bytes(self) -> u32 {
        match self {
            Self::F407 => 0x10_0000,
            Self::F411 => 0x8_0000,
        }
    }

    /// True where the core-coupled memory at 0x1000_0000 exists; 128 KiB of SRAM at 0x2000_0000 exist in both chips (RM0090 2.3.1, RM0383 2.3.1).
    #[must_use]
    pub const fn has_core_coupled_memory(self) -> bool {
        matches!(self, Self::F407)
    }

    /// True for an interrupt that the chip has.
    ///
    /// ```
    /// use stm32f4_model::Chip;
    /// // CAN1_TX, I2C1_EV, SPI5.
    /// assert_eq!([19, 31, 85].map(|line| Chip::F407.has_interrupt(line)), [true, true, false]);
    /// assert_eq!([19, 31, 85].map(|line| Chip::F411.has_interrupt(line)), [false, true, true]);
    /// ```
    #[must_use]
    pub const fn has_interrupt(self, line: u8) -> bool {
        let all = match self {
            Self::F407 => F407_INTERRUPTS,
            Self::F411 => F411_INTERRUPTS,
        };
        line < 128 && all >> line & 1 != 0
    }

    /// DBGMCU_IDCODE: device 0x413 (RM0090 38.6.1), revision 0x1007; device 0x431 (RM0383 23.6.1), revision 0x1000.
    pub const fn idcode(self) -> u32 {
        match self {
            Self::F407 => 0x1007_6413,
            Self::F411 => 0x1000_6431,
        }
    }

    /// Channel of ADC1 that the temperature sensor is on (RM0090 13.10, RM0383 11.9). On the F411 it shares that with VBAT.
    pub(crate) const fn temperature_channel(self) -> u8 {
        match self {
            Self::F407 => 16,
            Self::F411 => 18,
        }
    }

    /// Divider between VBAT and channel 18 (RM0090 13.11, RM0383 11.10).
    pub(crate) const fn vbat_divider(self) -> f64 {
        match self {
            Self::F407 => 2.0,
            Self::F411 => 4.0,
        }
    }

    /// SysTick calibration: 1 ms of HCLK / 8 at the frequency that the manual names (RM0090 and RM0383 10.1.2, 12.1.2).
    #[must_use]
    pub const fn systick_calibration(self) -> u32 {
        match self {
            Self::F407 => 18_750,
            Self::F411 => 10_500,
        }
    }

    pub(crate) const fn ratings(self) -> Ratings {
        match self {
            // Data sheet of the F407, table 14; RM0090 3.5.1, table 10: 30 MHz for each wait state plus one. Only the least significant bit of VOS exists.
            Self::F407 => {
                Ratings { hclk: [168e6; 4], pclk: [42e6, 84e6], flash: &[30e6, 60e6, 90e6, 120e6, 150e6, 168e6] }
            }
            // RM0383 5.4.1: VOS 1 is scale 3, 2 scale 2, 3 scale 1, 0 is reserved and selects scale 3. Data sheet of the F411, "General operating
            // conditions"; RM0383 3.4.1.
            Self::F411 => {
                Ratings { hclk: [64e6, 64e6, 84e6, 100e6], pclk: [50e6, 100e6], flash: &[30e6, 64e6, 90e6, 100e6] }
            }
        }
    }
}

/// As printed on the chip, without the package: `STM32F407`.
impl fmt::Display for Chip {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::F407 => "STM32F407",
            Self::F411 => "STM32F411",
        })
    }
}
