//! PWR: registers of the power controller (RM0090 chapter 5.4, STM32F405/407).
//!
//! Low power modes are not modelled. [`crate::supply`] has the supervision of the supply.

use crate::lint::LintKind;

/// Backup domain write enable.
const DBP: u32 = 1 << 8;
const PVDE: u32 = 1 << 4;
const VOS: u32 = 1 << 14;

/// PWR registers.
#[derive(Debug, Clone)]
pub(crate) struct Pwr {
    cr: u32,
    csr: u32,
    /// PVDO: the supply is below the threshold of the voltage detector.
    pub(crate) supply_is_low: bool,
}

impl Pwr {
    pub(crate) fn new() -> Self {
        Pwr { cr: VOS, csr: 0, supply_is_low: false }
    }

    pub(crate) fn peek(&self, offset: u32) -> Option<u32> {
        Some(match offset {
            0x00 => self.cr,
            // 5.4.2: VOSRDY. The regulator is ready at once, and so is the backup regulator.
            0x04 => self.csr | VOS | self.csr >> 6 & 1 << 3 | u32::from(self.supply_is_low) << 2,
            _ => return None,
        })
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32, lints: &mut Vec<LintKind>) {
        match offset {
            // CWUF and CSBF clear flags that are never set here, and read as 0. VOS has one bit on this chip; bit 15 is reserved.
            0x00 => self.cr = value & 0x43F3,
            // EWUP and BRE; WUF, SBF, PVDO are read only.
            0x04 => self.csr = value & 0x300,
            _ => lints.push(LintKind::Unmodelled),
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
        let pwr = Pwr::new();
        assert_eq!((pwr.peek(0), pwr.peek(4)), (Some(0x4000), Some(0x4000)));
    }

    #[test]
    fn backup_access_and_regulator() {
        let mut pwr = Pwr::new();
        let mut lints = Vec::new();
        pwr.write(0, VOS | DBP, &mut lints);
        assert!(pwr.backup_writable());
        pwr.write(4, 1 << 9, &mut lints);
        assert_eq!(pwr.peek(4), Some(0x4208));
        assert_eq!(lints, []);
        pwr.write(0, PVDE | 5 << 5, &mut lints);
        assert_eq!((pwr.voltage_detector(), lints), ((true, 5), vec![]));
    }
}
