//! PWR: registers of the power controller (RM0090 chapter 5.4, STM32F405/407; RM0383 chapter 5.4).
//!
//! Low power modes are not modelled. [`crate::supply`] has the supervision of the supply.

use crate::chip::Chip;
use crate::lint::LintKind;

/// Backup domain write enable.
const DBP: u32 = 1 << 8;
const PVDE: u32 = 1 << 4;
/// VOS of the F407, and VOSRDY of both.
const VOS: u32 = 1 << 14;
/// VOS of the F411, and its value after a reset: scale 2.
const VOS_F411: u32 = 3 << 14;
const SCALE_2: u32 = 2 << 14;

/// PWR registers.
#[derive(Debug, Clone)]
pub(crate) struct Pwr {
    chip: Chip,
    cr: u32,
    csr: u32,
    /// PVDO: the supply is below the threshold of the voltage detector.
    pub(crate) supply_is_low: bool,
}

impl Pwr {
    pub(crate) fn new(chip: Chip) -> Self {
        let cr = match chip {
            Chip::F407 => VOS,
            Chip::F411 => SCALE_2,
        };
        Pwr { chip, cr, csr: 0, supply_is_low: false }
    }

    pub(crate) fn peek(&self, offset: u32) -> Option<u32> {
        Some(match offset {
            0x00 => self.cr,
            // 5.4.2: VOSRDY. The regulator is ready at once, and so is the backup regulator.
            0x04 => self.csr | VOS | self.csr >> 6 & 1 << 3 | u32::from(self.supply_is_low) << 2,
            _ => return None,
        })
    }

    /// Writes a register. `pll_on`: RCC_CR.PLLON, while which the F411 does not take another VOS (RM0383 5.4.1).
    pub(crate) fn write(&mut self, offset: u32, value: u32, pll_on: bool, lints: &mut Vec<LintKind>) {
        match offset {
            0x00 if self.chip == Chip::F411 => {
                let locked = if pll_on { VOS_F411 } else { 0 };
                if (value ^ self.cr) & locked != 0 {
                    lints.push(LintKind::Misuse("PWR_CR.VOS can only be written while the PLL is off"));
                }
                // Beside those of the F407: LPLVDS, MRLVDS, ADCDC1, both bits of VOS, FMSSR, FISSR.
                self.cr = (value & 0x0030_EFF3 & !locked) | (self.cr & locked);
            }
            // CWUF and CSBF clear flags that are never set here, and read as 0. VOS has one bit on this chip; bit 15 is reserved.
            0x00 => self.cr = value & 0x43F3,
            // EWUP and BRE; WUF, SBF, PVDO are read only.
            0x04 => self.csr = value & 0x300,
            _ => lints.push(LintKind::Unmodelled),
        }
    }

    /// VOS of the F411, 0 to 3; 0 on the F407, whose ratings do not depend on it here.
    pub(crate) fn voltage_scale(&self) -> usize {
        match self.chip {
            Chip::F407 => 0,
            Chip::F411 => (self.cr >> 14 & 3) as usize,
        }
    }

    /// PVDE and PLS: whether the voltage detector is on, and its threshold.
    pub(crate) fn voltage_detector(&self) -> (bool, u32) {
        (self.cr & PVDE != 0, self.cr >> 5 & 7)
    }

    /// True where RCC_BDCR and the RTC may be written.
    pub(crate) fn backup_writable(&self) -> bool {
        self.cr & DBP != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_one_after_reset_and_ready() {
        // RM0090 5.4.1 (reset value 0x0000 4000) and 5.4.2 for the F405/407.
        let pwr = Pwr::new(Chip::F407);
        assert_eq!((pwr.peek(0), pwr.peek(4)), (Some(0x4000), Some(0x4000)));
    }

    #[test]
    fn the_scale_of_the_f411_is_locked_while_the_pll_runs() {
        // RM0383 5.4.1: reset value 0x0000 8000, scale 2; VOS is modified while the PLL is off.
        let mut pwr = Pwr::new(Chip::F411);
        assert_eq!((pwr.peek(0), pwr.voltage_scale()), (Some(0x8000), 2));
        let mut lints = Vec::new();
        pwr.write(0, 3 << 14 | DBP, false, &mut lints);
        assert_eq!((pwr.voltage_scale(), pwr.backup_writable(), lints.len()), (3, true, 0));
        pwr.write(0, 1 << 14, true, &mut lints);
        assert_eq!((pwr.voltage_scale(), pwr.backup_writable(), lints.len()), (3, false, 1));
    }

    #[test]
    fn backup_access_and_regulator() {
        let mut pwr = Pwr::new(Chip::F407);
        let mut lints = Vec::new();
        pwr.write(0, VOS | DBP, true, &mut lints);
        assert!(pwr.backup_writable());
        pwr.write(4, 1 << 9, true, &mut lints);
        assert_eq!(pwr.peek(4), Some(0x4208));
        assert_eq!(lints, []);
        pwr.write(0, PVDE | 5 << 5, true, &mut lints);
        assert_eq!((pwr.voltage_detector(), lints), ((true, 5), vec![]));
    }
}
