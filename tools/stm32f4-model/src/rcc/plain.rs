//! Registers of RCC without a side effect in that block: resets, clock enables, spread spectrum.

use crate::chip::Chip;
use crate::lint::LintKind;

const SSCGR: u32 = 0x80;
const PLLI2SCFGR: u32 = 0x84;

/// Offset, reset value, writable bits.
type Register = (u32, u32, u32);

/// RM0090 7.3.
static F407: [Register; 17] = [
    (0x10, 0, 0x2260_11FF),
    (0x14, 0, 0x0000_00F1),
    (0x18, 0, 0x0000_0001),
    (0x20, 0, 0x36FE_C9FF),
    (0x24, 0, 0x0007_5933),
    (0x30, 0x0010_0000, 0x7E74_11FF),
    (0x34, 0, 0x0000_00F1),
    (0x38, 0, 0x0000_0001),
    (0x40, 0, 0x36FE_C9FF),
    (0x44, 0, 0x0007_5F33),
    (0x50, 0x7E67_91FF, 0x7E67_91FF),
    (0x54, 0x0000_00F1, 0x0000_00F1),
    (0x58, 0x0000_0001, 0x0000_0001),
    (0x60, 0x36FE_C9FF, 0x36FE_C9FF),
    (0x64, 0x0007_5F33, 0x0007_5F33),
    (SSCGR, 0, 0xCFFF_FFFF),
    (PLLI2SCFGR, 0x2000_3000, 0x7000_7FC0),
];

/// RM0383 6.3: resets and enables of the blocks that the F411 has. Those for low power modes and the PLL of I2S are not modelled.
static F411: [Register; 9] = [
    (0x10, 0, 0x0060_109F),
    (0x14, 0, 0x0000_0080),
    (0x20, 0, 0x10E2_C80F),
    (0x24, 0, 0x0017_7931),
    (0x30, 0, 0x0060_109F),
    (0x34, 0, 0x0000_0080),
    (0x40, 0, 0x10E2_C80F),
    (0x44, 0, 0x0017_7931),
    (SSCGR, 0, 0xCFFF_FFFF),
];

/// The registers and their values.
#[derive(Debug)]
pub(super) struct Plain {
    registers: &'static [Register],
    /// In the order of the registers.
    values: Vec<u32>,
}

impl Plain {
    /// The registers of a chip.
    pub(super) fn of(chip: Chip) -> Self {
        let registers: &[Register] = match chip {
            Chip::F407 => &F407,
            Chip::F411 => &F411,
        };
        let mut plain = Plain { registers, values: Vec::new() };
        plain.reset();
        plain
    }

    pub(super) fn reset(&mut self) {
        self.values = self.registers.iter().map(|&(_, reset, _)| reset).collect();
    }

    fn index(&self, offset: u32) -> Option<usize> {
        self.registers.iter().position(|&(at, ..)| at == offset)
    }

    /// Value of a register; `None`: there is none at this offset.
    pub(super) fn value(&self, offset: u32) -> Option<u32> {
        self.index(offset).map(|index| self.values[index])
    }

    pub(super) fn write(&mut self, offset: u32, value: u32, lints: &mut Vec<LintKind>) {
        let Some(index) = self.index(offset) else {
            lints.push(LintKind::Unmodelled);
            return;
        };
        let (_, _, writable) = self.registers[index];
        if value & !writable & !self.values[index] != 0 {
            lints.push(LintKind::Misuse("reserved bits of an RCC register are written"));
        }
        self.values[index] = value & writable;
    }
}
