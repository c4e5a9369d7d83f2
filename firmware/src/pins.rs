//! The registers of a board's pins.

use embassy_stm32::pac;
use embassy_stm32::pac::gpio::Gpio;
use embassy_stm32::pac::gpio::vals::{Idr, Moder, Odr, Ot, Pupdr};
use firmware::board::{Pin, Port};

/// A pin's registers. The clock of its port must be on.
pub(crate) trait PinRegisters: Copy {
    /// The port.
    fn gpio(self) -> Gpio;

    /// 0 to 15.
    fn index(self) -> usize;

    /// Sets the level that the pin takes while it is an output.
    fn set(self, high: bool) {
        self.gpio().bsrr().write(|w| if high { w.set_bs(self.index(), true) } else { w.set_br(self.index(), true) });
    }

    /// Whether the pin is high.
    fn is_high(self) -> bool {
        self.gpio().idr().read().idr(self.index()) == Idr::HIGH
    }

    /// Sets the mode: input, output, alternate, analogue.
    fn set_mode(self, mode: Moder) {
        self.gpio().moder().modify(|w| w.set_moder(self.index(), mode));
    }

    /// Sets the pull.
    fn set_pull(self, pull: Pupdr) {
        self.gpio().pupdr().modify(|w| w.set_pupdr(self.index(), pull));
    }

    /// Whether the pin has this pull.
    fn has_pull(self, pull: Pupdr) -> bool {
        self.gpio().pupdr().read().pupdr(self.index()) == pull
    }

    /// Whether the pin has this mode, and drives both levels where it is an output.
    fn has_mode(self, mode: Moder) -> bool {
        self.gpio().moder().read().moder(self.index()) == mode
            && self.gpio().otyper().read().ot(self.index()) == Ot::PUSH_PULL
    }

    /// Whether the pin belongs to a peripheral by this function.
    fn has_function(self, function: u8) -> bool {
        self.gpio().afr(self.index() / 8).read().afr(self.index() % 8) == function && self.has_mode(Moder::ALTERNATE)
    }

    /// Whether an output is set high.
    fn is_set(self) -> bool {
        self.gpio().odr().read().odr(self.index()) == Odr::HIGH
    }

    /// Gives the pin to a peripheral.
    fn set_function(self, function: u8) {
        self.gpio().afr(self.index() / 8).modify(|w| w.set_afr(self.index() % 8, function));
        self.set_mode(Moder::ALTERNATE);
    }
}

impl PinRegisters for Pin {
    #[inline(always)]
    fn gpio(self) -> Gpio {
        match self.port {
            Port::A => pac::GPIOA,
            Port::B => pac::GPIOB,
            Port::C => pac::GPIOC,
            Port::D => pac::GPIOD,
            Port::E => pac::GPIOE,
        }
    }

    #[inline(always)]
    fn index(self) -> usize {
        // What the board files guarantee, in a form that leaves no range check: this runs in the panic handler.
        usize::from(self.number) % 16
    }
}
