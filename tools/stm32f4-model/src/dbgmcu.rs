//! DBGMCU: device identity and debug freeze bits (RM0090 38.16).
//!
//! The freeze bits act only while a debugger halts the core. That is not modelled, so they are plain storage.

use crate::lint::LintKind;

/// Device 0x413 (STM32F405/407/415/417), revision 0x1007.
const IDCODE: u32 = 0x1007_6413;

/// DBGMCU registers. Only a power-on resets them.
#[derive(Debug, Clone, Default)]
pub(crate) struct Dbgmcu {
    cr: u32,
    freeze: [u32; 2],
}

impl Dbgmcu {
    pub(crate) fn peek(&self, offset: u32) -> Option<u32> {
        Some(match offset {
            0x00 => IDCODE,
            0x04 => self.cr,
            0x08 | 0x0C => self.freeze[usize::from(offset == 0x0C)],
            _ => return None,
        })
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32, lints: &mut Vec<LintKind>) {
        match offset {
            0x00 => lints.push(LintKind::Misuse("DBGMCU_IDCODE is read only")),
            0x04 => self.cr = value & 0xE7,
            0x08 => self.freeze[0] = value & 0x06E0_1DFF,
            0x0C => self.freeze[1] = value & 0x0007_0003,
            _ => lints.push(LintKind::Unmodelled),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn identity_and_storage() {
        // RM0090 38.6.1: DEV_ID of the F405xx/407xx is 0x413.
        let mut dbgmcu = Dbgmcu::default();
        assert_eq!(dbgmcu.peek(0).map(|id| id & 0xFFF), Some(0x413));
        dbgmcu.write(8, 1 << 12, &mut Vec::new());
        dbgmcu.write(4, 7, &mut Vec::new());
        assert_eq!((dbgmcu.peek(8), dbgmcu.peek(4)), (Some(1 << 12), Some(7)));
    }
}
