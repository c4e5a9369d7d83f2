//! Registers of one GPIO port (RM0090 chapter 8). `soc/pins.rs` computes the levels of the pins from them.

use crate::lint::LintKind;

pub(crate) const MODER: u32 = 0x00;
const OTYPER: u32 = 0x04;
const OSPEEDR: u32 = 0x08;
pub(crate) const PUPDR: u32 = 0x0C;
const IDR: u32 = 0x10;
const ODR: u32 = 0x14;
const BSRR: u32 = 0x18;
const LCKR: u32 = 0x1C;
pub(crate) const AFRL: u32 = 0x20;
pub(crate) const AFRH: u32 = 0x24;

/// Mode of a pin (8.4.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PinMode {
    Input,
    Output,
    /// Alternate function, 0 to 15.
    Alternate(u8),
    Analog,
}

/// Registers of one port.
#[derive(Debug, Clone)]
pub(crate) struct Gpio {
    moder: u32,
    otyper: u32,
    ospeedr: u32,
    pupdr: u32,
    odr: u32,
    afr: [u32; 2],
    /// Bits 0 to 15: pins whose configuration is frozen; bit 16: LCKK.
    lckr: u32,
    /// Number of correct writes of the lock sequence of 8.4.8 so far, and their pins.
    lock_steps: u8,
    lock_pins: u32,
    /// Levels at the pins, as read from IDR. Updated by `soc/pins.rs`.
    pub(crate) idr: u16,
}

impl Gpio {
    /// A port, 0 (A) to 8 (I), with the reset values of 8.4: ports A and B have the debug pins.
    pub(crate) fn new(port: usize) -> Self {
        let (moder, ospeedr, pupdr) = match port {
            0 => (0xA800_0000, 0x0C00_0000, 0x6400_0000),
            1 => (0x0000_0280, 0x0000_00C0, 0x0000_0100),
            _ => (0, 0, 0),
        };
        Gpio { moder, otyper: 0, ospeedr, pupdr, odr: 0, afr: [0; 2], lckr: 0, lock_steps: 0, lock_pins: 0, idr: 0 }
    }

    pub(crate) fn peek(&self, offset: u32) -> Option<u32> {
        Some(match offset {
            MODER => self.moder,
            OTYPER => self.otyper,
            OSPEEDR => self.ospeedr,
            PUPDR => self.pupdr,
            IDR => u32::from(self.idr),
            ODR => self.odr,
            BSRR => 0,
            LCKR => self.lckr,
            AFRL => self.afr[0],
            AFRH => self.afr[1],
            _ => return None,
        })
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32, lints: &mut Vec<LintKind>) {
        // 8.4.8: the configuration of a locked pin stays until the next reset.
        let locked = if self.lckr & 1 << 16 != 0 { self.lckr & 0xFFFF } else { 0 };
        let mut locked_field = false;
        let mut keep = |old: u32, bits: u32, first: u32, count: u32| {
            let mut mask = 0;
            for pin in 0..count {
                if locked >> (first + pin) & 1 != 0 {
                    mask |= ((1 << bits) - 1) << (pin * bits);
                }
            }
            locked_field |= (old ^ value) & mask != 0;
            (value & !mask) | (old & mask)
        };
        match offset {
            MODER => self.moder = keep(self.moder, 2, 0, 16),
            OTYPER => self.otyper = keep(self.otyper, 1, 0, 16) & 0xFFFF,
            OSPEEDR => self.ospeedr = keep(self.ospeedr, 2, 0, 16),
            PUPDR => self.pupdr = keep(self.pupdr, 2, 0, 16),
            IDR => lints.push(LintKind::Misuse("GPIO IDR is read only")),
            ODR => self.odr = value & 0xFFFF,
            // 8.4.7: if both bits of a pin are 1, set has priority over reset.
            BSRR => self.odr = (self.odr & !(value >> 16)) | (value & 0xFFFF),
            LCKR => self.write_lock(value),
            AFRL => self.afr[0] = keep(self.afr[0], 4, 0, 8),
            AFRH => self.afr[1] = keep(self.afr[1], 4, 8, 8),
            _ => lints.push(LintKind::Unmodelled),
        }
        if locked_field {
            lints.push(LintKind::Misuse("the configuration of the pin is locked by GPIO LCKR until the next reset"));
        }
    }

    /// Follows the lock sequence: LCKK 1, 0, 1 with the same pins each time.
    fn write_lock(&mut self, value: u32) {
        if self.lckr & 1 << 16 != 0 {
            return;
        }
        let (key, pins) = (value & 1 << 16 != 0, value & 0xFFFF);
        self.lock_steps = match (self.lock_steps, key) {
            (0, true) => 1,
            (1, false) if pins == self.lock_pins => 2,
            (2, true) if pins == self.lock_pins => 3,
            (_, true) => 1,
            _ => 0,
        };
        self.lock_pins = pins;
        self.lckr = pins | if self.lock_steps == 3 { 1 << 16 } else { 0 };
    }

    pub(crate) fn mode(&self, pin: u8) -> PinMode {
        match self.moder >> (pin * 2) & 3 {
            0 => PinMode::Input,
            1 => PinMode::Output,
            2 => PinMode::Alternate((self.afr[usize::from(pin / 8)] >> (pin % 8 * 4) & 0xF) as u8),
            _ => PinMode::Analog,
        }
    }

    /// Pins in analog mode.
    pub(crate) fn analog(&self) -> u16 {
        (0..16).filter(|&pin| self.mode(pin) == PinMode::Analog).fold(0, |mask, pin| mask | 1 << pin)
    }

    /// Bit of a pin in the output register.
    pub(crate) fn output(&self, pin: u8) -> bool {
        self.odr >> pin & 1 != 0
    }

    /// Pins whose pull-up is on.
    pub(crate) fn pull_ups(&self) -> u16 {
        (0..16).filter(|&pin| self.pull_up(pin)).fold(0, |mask, pin| mask | 1 << pin)
    }

    /// True where the pull-up is on.
    pub(crate) fn pull_up(&self, pin: u8) -> bool {
        self.pupdr >> (pin * 2) & 3 == 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(port: &mut Gpio, offset: u32, value: u32) -> Vec<LintKind> {
        let mut lints = Vec::new();
        port.write(offset, value, &mut lints);
        lints
    }

    #[test]
    fn reset_values_of_ports_a_and_b() {
        // RM0090 8.4.1, 8.4.3, 8.4.4: PA13, PA14, PA15, PB3, PB4 are the debug port.
        let (a, b, c) = (Gpio::new(0), Gpio::new(1), Gpio::new(2));
        assert_eq!([a.peek(0), a.peek(8), a.peek(12)], [Some(0xA800_0000), Some(0x0C00_0000), Some(0x6400_0000)]);
        assert_eq!([b.peek(0), b.peek(8), b.peek(12)], [Some(0x280), Some(0xC0), Some(0x100)]);
        assert_eq!([c.peek(0), c.peek(8), c.peek(12)], [Some(0); 3]);
        assert_eq!(a.mode(13), PinMode::Alternate(0));
        assert_eq!(a.mode(8), PinMode::Input);
    }

    #[test]
    fn bsrr_sets_and_resets_bits_and_set_has_priority() {
        // RM0090 8.4.7.
        let mut port = Gpio::new(3);
        write(&mut port, BSRR, 0x0000_1001);
        write(&mut port, BSRR, 0x0001_0000);
        assert_eq!(port.peek(ODR), Some(0x1000));
        write(&mut port, BSRR, 0x0002_0002);
        assert_eq!(port.peek(ODR), Some(0x1002));
        assert_eq!(port.peek(BSRR), Some(0));
    }

    #[test]
    fn alternate_function_numbers() {
        // RM0090 8.4.9, 8.4.10: four bits a pin, pins 0 to 7 low, 8 to 15 high.
        let mut port = Gpio::new(2);
        write(&mut port, MODER, 2 << 12 | 2 << 16);
        write(&mut port, AFRL, 3 << 24);
        write(&mut port, AFRH, 1);
        assert_eq!((port.mode(6), port.mode(8)), (PinMode::Alternate(3), PinMode::Alternate(1)));
    }

    #[test]
    fn lock_sequence_freezes_the_configuration() {
        // RM0090 8.3.6, 8.4.8.
        let mut port = Gpio::new(2);
        for value in [0x1_0300, 0x0_0300, 0x1_0300] {
            write(&mut port, LCKR, value);
        }
        assert_eq!(port.peek(LCKR), Some(0x1_0300));
        assert_eq!(write(&mut port, MODER, 0x0015_0001).len(), 1);
        assert_eq!(port.peek(MODER), Some(0x0010_0001), "pins 8 and 9 are locked, pins 0 and 10 are not");
        assert_eq!(write(&mut port, AFRH, 0x222).len(), 1);
        assert_eq!(port.peek(AFRH), Some(0x200));
        // The output register is not part of the configuration.
        write(&mut port, ODR, 0x100);
        assert!(port.output(8));
    }

    #[test]
    fn an_incomplete_lock_sequence_locks_nothing() {
        let mut port = Gpio::new(2);
        for value in [0x1_0100, 0x0_0200, 0x1_0100] {
            write(&mut port, LCKR, value);
        }
        assert_eq!(port.peek(LCKR), Some(0x100));
        assert_eq!(write(&mut port, MODER, 0x0001_0000), []);
    }
}
