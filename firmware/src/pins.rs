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

/// The pins of a port that belong to a peripheral: the bits of its registers that say so, and their values. A check reads each register once.
#[derive(Clone, Copy)]
pub(crate) struct FunctionPins {
    port: Port,
    /// Two bits a pin: alternate function.
    modes: u32,
    modes_set: u32,
    /// A bit a pin, 0 as push-pull drives both levels.
    types: u32,
    /// Four bits a pin; pins 0 to 7, and 8 to 15.
    functions: [u32; 2],
    functions_set: [u32; 2],
}

impl FunctionPins {
    /// Those of the pins that are on this port, each with this function.
    pub(crate) const fn on(port: Port, pins: &[Pin], function: u8) -> Self {
        let mut own = Self { port, modes: 0, modes_set: 0, types: 0, functions: [0; 2], functions_set: [0; 2] };
        let mut at = 0;
        while at < pins.len() {
            let Pin { port: of, number, .. } = pins[at];
            if of as u8 == port as u8 {
                own.modes |= 3 << (2 * number);
                own.modes_set |= (Moder::ALTERNATE as u32) << (2 * number);
                own.types |= 1 << number;
                own.functions[number as usize / 8] |= 0xF << (number % 8 * 4);
                own.functions_set[number as usize / 8] |= (function as u32) << (number % 8 * 4);
            }
            at += 1;
        }
        own
    }

    /// Whether all of them belong to the peripheral, and drive both levels. The clock of the port must be on.
    #[inline(always)]
    pub(crate) fn are_set(self) -> bool {
        let gpio = gpio(self.port);
        let function = |half: usize| {
            self.functions[half] == 0 || gpio.afr(half).read().0 & self.functions[half] == self.functions_set[half]
        };
        self.types == 0
            || (gpio.moder().read().0 & self.modes == self.modes_set
                && gpio.otyper().read().0 & self.types == 0
                && function(0)
                && function(1))
    }
}

/// Registers of a port.
#[inline(always)]
fn gpio(port: Port) -> Gpio {
    match port {
        Port::A => pac::GPIOA,
        Port::B => pac::GPIOB,
        Port::C => pac::GPIOC,
        Port::D => pac::GPIOD,
        Port::E => pac::GPIOE,
    }
}

impl PinRegisters for Pin {
    #[inline(always)]
    fn gpio(self) -> Gpio {
        gpio(self.port)
    }

    #[inline(always)]
    fn index(self) -> usize {
        // What the board files guarantee, in a form that leaves no range check: this runs in the panic handler.
        usize::from(self.number) % 16
    }
}
