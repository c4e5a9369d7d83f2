//! Common registers of the three ADCs: status, clock divider, internal channels (RM0090 13.13.15 to 13.13.17).

use crate::lint::LintKind;

/// The registers that the three converters share.
#[derive(Debug, Clone, Default)]
pub(crate) struct AdcCommonRegisters {
    ccr: u32,
}

impl AdcCommonRegisters {
    /// Value of a register; `None`: no register at this offset. `statuses`: SR of ADC1 to ADC3.
    pub(crate) fn peek(&self, offset: u32, statuses: [u32; 3]) -> Option<u32> {
        match offset {
            0x00 => Some(statuses.iter().rev().fold(0, |all, status| all << 8 | (status & 0x3F))),
            0x04 => Some(self.ccr),
            _ => None,
        }
    }

    /// Writes a register.
    pub(crate) fn write(&mut self, offset: u32, value: u32, lints: &mut Vec<LintKind>) {
        if offset != 0x04 {
            lints.push(LintKind::Unmodelled);
            return;
        }
        if value & 0xC01F != 0 {
            lints.push(LintKind::Mode("dual or triple ADC mode"));
        }
        self.ccr = value & 0x00C3_EF1F;
    }

    /// PCLK2 cycles per ADCCLK cycle: 2, 4, 6 or 8.
    pub(crate) fn divider(&self) -> u64 {
        u64::from((self.ccr >> 16 & 3) + 1) * 2
    }

    /// TSVREFE: true while temperature sensor and VREFINT are on.
    pub(crate) fn reference_on(&self) -> bool {
        self.ccr & 1 << 23 != 0
    }

    /// VBATE: true while the divider at VBAT is on.
    pub(crate) fn vbat_on(&self) -> bool {
        self.ccr & 1 << 22 != 0
    }
}
