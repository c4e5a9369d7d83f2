//! The clock tree of a board as numbers: crystal, PLL, dividers of the buses (RM0090 7.2 and 7.3.2, RM0383 6.2 and 6.3.2, RM0390 6.2 and 6.3.2).
//!
//! ```text
//! HSE -> / M -> VCO x N -> / P -> HCLK, the core -> / APBx -> PCLKx, the buses; timers: PCLKx if APBx = 1, else 2 PCLKx
//!                       -> / Q -> 48 MHz domain, which this program does not use
//! ```

/// Source of HSE.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hse {
    /// A crystal at the chip.
    Crystal,
    /// A clock signal, as from the debug probe of a Nucleo.
    External,
}

/// Factors of the PLL.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pll {
    /// Divider of HSE, 2 to 63.
    pub m: u8,
    /// Factor of the VCO, 50 to 432.
    pub n: u16,
    /// Divider of the VCO for the core: 2, 4, 6 or 8.
    pub p: u8,
    /// Divider of the VCO for the 48 MHz domain, 2 to 15.
    pub q: u8,
}

/// The clocks of a board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClockTree {
    /// Source of HSE.
    pub hse: Hse,
    /// Frequency of HSE, MHz.
    pub hse_mhz: u16,
    /// The PLL, whose input is HSE.
    pub pll: Pll,
    /// Dividers of APB1 and APB2: 1, 2, 4, 8 or 16.
    pub apb: [u16; 2],
}

/// Divider of PCLK2 for the converter.
pub const ADC_DIVIDER: u16 = 4;

impl ClockTree {
    /// Clock of the core, MHz.
    #[must_use]
    pub const fn core_mhz(&self) -> u16 {
        let Pll { m, n, p, .. } = self.pll;
        // At most 26 MHz times 432; the divisors are at least 2.
        (self.hse_mhz as u32 * n as u32 / (m as u32 * p as u32)) as u16
    }

    /// Clock of APB1, which is that of USART2, MHz.
    #[must_use]
    pub const fn apb1_mhz(&self) -> u16 {
        self.core_mhz() / self.apb[0]
    }

    /// Clock of the timers on APB1 (TIM2 to TIM5), MHz.
    #[must_use]
    pub const fn apb1_timer_mhz(&self) -> u16 {
        timer_mhz(self.core_mhz(), self.apb[0])
    }

    /// Clock of the timers on APB2 (TIM1), MHz.
    #[must_use]
    pub const fn apb2_timer_mhz(&self) -> u16 {
        timer_mhz(self.core_mhz(), self.apb[1])
    }

    /// Clock of the converter, MHz.
    #[must_use]
    pub const fn adc_mhz(&self) -> u16 {
        self.core_mhz() / self.apb[1] / ADC_DIVIDER
    }

    /// Whether every clock here is a whole number of megahertz, so that the timers count microseconds and the frames are 20 ms.
    #[must_use]
    pub const fn is_exact(&self) -> bool {
        let Pll { m, n, p, .. } = self.pll;
        let divisor = m as u32 * p as u32;
        (self.hse_mhz as u32).is_multiple_of(m as u32)
            && (self.hse_mhz as u32 * n as u32).is_multiple_of(divisor)
            && self.core_mhz().is_multiple_of(self.apb[0])
            && self.core_mhz().is_multiple_of(self.apb[1] * ADC_DIVIDER)
    }
}

const fn timer_mhz(core_mhz: u16, divider: u16) -> u16 {
    if divider == 1 { core_mhz } else { core_mhz / divider * 2 }
}

#[cfg(test)]
mod tests {
    use super::super::BOARDS;
    use super::*;

    /// Limits of a chip: core, PCLK1, PCLK2, converter, MHz.
    fn most(chip: &str) -> [u16; 4] {
        match &chip[..9] {
            // Data sheet of the F407, table 14; RM0090 13.2 and data sheet table 67.
            "STM32F407" => [168, 42, 84, 36],
            // Data sheet of the F446: without over-drive, which the HAL switches on, 168; with it 180, 45, 90.
            "STM32F446" => [180, 45, 90, 36],
            // Data sheet of the F411, "General operating conditions" and "ADC characteristics".
            "STM32F411" => [100, 50, 100, 36],
            other => panic!("{other} has no limits here"),
        }
    }

    #[test]
    fn every_clock_is_exact_and_within_the_limits_of_its_chip() {
        for board in BOARDS {
            let clocks = board.clocks;
            let Pll { m, n, p, q } = clocks.pll;
            assert!(clocks.is_exact(), "{}", board.name);
            // 6.3.2 and 7.3.2 of the manuals: input 1 to 2 MHz, VCO 100 to 432 MHz, the 48 MHz domain at most 48 MHz.
            let input = clocks.hse_mhz / u16::from(m);
            let vco = input * n;
            assert!(
                (1..=2).contains(&input) && (100..=432).contains(&vco) && (50..=432).contains(&n),
                "{}",
                board.name
            );
            assert!([2, 4, 6, 8].contains(&p) && (2..=15).contains(&q) && vco / u16::from(q) <= 48, "{}", board.name);
            let [core, pclk1, pclk2, adc] = most(board.chip);
            assert!(clocks.core_mhz() <= core && clocks.apb1_mhz() <= pclk1, "{}", board.name);
            assert!(clocks.core_mhz() / clocks.apb[1] <= pclk2 && clocks.adc_mhz() <= adc, "{}", board.name);
        }
    }

    #[test]
    fn the_clocks_of_the_boards() {
        let clocks = BOARDS.map(|board| {
            let clocks = board.clocks;
            [clocks.core_mhz(), clocks.apb1_timer_mhz(), clocks.apb2_timer_mhz(), clocks.apb1_mhz(), clocks.adc_mhz()]
        });
        assert_eq!(clocks, [[168, 84, 168, 42, 21], [168, 84, 168, 42, 21], [100, 100, 100, 50, 25]]);
    }

    #[test]
    fn a_clock_that_is_no_whole_number_is_found() {
        let clocks = BOARDS[2].clocks;
        // 25 MHz / 13 * 104 / 2 is 100 MHz too, but the input of the VCO is no whole number, and the HAL computes in whole numbers.
        assert!(!ClockTree { pll: Pll { m: 13, n: 104, ..clocks.pll }, ..clocks }.is_exact());
        assert!(!ClockTree { hse_mhz: 8, ..clocks }.is_exact());
    }
}
