//! DBGMCU: device identity and debug freeze bits (RM0090 38.16).
//!
//! The freeze bits act only while a debugger halts the core ([`crate::Soc::halt`]): of the timers and of the watchdog. The others are plain
//! storage.

use crate::chip::Chip;
use crate::lint::LintKind;

/// DBGMCU registers. Only a power-on resets them.
#[derive(Debug, Clone)]
pub(crate) struct Dbgmcu {
    chip: Chip,
    cr: u32,
    freeze: [u32; 2],
}

impl Dbgmcu {
    pub(crate) fn new(chip: Chip) -> Self {
        Dbgmcu { chip, cr: 0, freeze: [0; 2] }
    }

    pub(crate) fn peek(&self, offset: u32) -> Option<u32> {
        Some(match offset {
            0x00 => self.chip.idcode(),
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

impl Dbgmcu {
    /// Whether a timer, 1 to 14, stops while the core is halted (38.16.4, 38.16.5).
    pub(crate) fn stops_timer(&self, number: usize) -> bool {
        let (register, bit) = match number {
            2..=7 => (0, number - 2),
            12..=14 => (0, number - 6),
            1 => (1, 0),
            8 => (1, 1),
            _ => (1, number + 7),
        };
        self.freeze[register] >> bit & 1 != 0
    }

    /// Whether the independent watchdog stops while the core is halted.
    pub(crate) fn stops_watchdog(&self) -> bool {
        self.freeze[0] >> 12 & 1 != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn identity_and_storage() {
        // RM0090 38.6.1: DEV_ID of the F405xx/407xx is 0x413.
        let mut dbgmcu = Dbgmcu::new(Chip::F407);
        assert_eq!(dbgmcu.peek(0).map(|id| id & 0xFFF), Some(0x413));
        // RM0383 23.6.1: 0x431.
        assert_eq!(Dbgmcu::new(Chip::F411).peek(0).map(|id| id & 0xFFF), Some(0x431));
        dbgmcu.write(8, 1 << 12, &mut Vec::new());
        dbgmcu.write(4, 7, &mut Vec::new());
        assert_eq!((dbgmcu.peek(8), dbgmcu.peek(4)), (Some(1 << 12), Some(7)));
        assert!(dbgmcu.stops_watchdog());
    }

    #[test]
    fn a_freeze_bit_for_each_timer() {
        // RM0090 38.16.4, 38.16.5.
        let bits = [(2, 8, 0), (7, 8, 5), (12, 8, 6), (14, 8, 8), (1, 12, 0), (8, 12, 1), (9, 12, 16), (11, 12, 18)];
        for (number, offset, bit) in bits {
            let mut dbgmcu = Dbgmcu::new(Chip::F407);
            dbgmcu.write(offset, 1 << bit, &mut Vec::new());
            let stopped: Vec<_> = (1..=14).filter(|number| dbgmcu.stops_timer(*number)).collect();
            assert_eq!((stopped, dbgmcu.stops_watchdog()), (vec![number], false));
        }
    }
}
