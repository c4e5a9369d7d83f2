//! The registers of the pins: function, pull, level.

use embassy_rp::pac;
use embassy_rp::pac::io::regs::GpioCtrl;
use embassy_rp::pac::pads::regs::GpioCtrl as Pad;
use firmware_rp2040::board::Pin;

/// Functions of every pin (RP2040 datasheet, 2.19.2).
const PWM: u8 = 4;
const SIO: u8 = 5;

/// The chip's pull of an input.
#[derive(Clone, Copy)]
pub(crate) enum Pull {
    Up,
    Down,
}

/// A pin's registers. Its bank must be out of reset ([`out_of_reset`]).
pub(crate) trait PinRegisters: Copy {
    /// 0 to 29.
    fn index(self) -> usize;

    fn mask(self) -> u32 {
        1 << self.index()
    }

    /// Sets the level that the pin takes while it is an output.
    fn set(self, high: bool) {
        let out = pac::SIO.gpio_out(0);
        if high { out.value_set() } else { out.value_clr() }.write_value(self.mask());
    }

    /// Whether the pin is high.
    fn is_high(self) -> bool {
        pac::SIO.gpio_in(0).read() & self.mask() != 0
    }

    /// Drives the level of [`PinRegisters::set`].
    fn make_output(self) {
        pac::SIO.gpio_oe(0).value_set().write_value(self.mask());
        self.connect(SIO);
    }

    /// Reads the pin, with this pull.
    fn make_input(self, pull: Pull) {
        pac::SIO.gpio_oe(0).value_clr().write_value(self.mask());
        self.connect(SIO);
        pac::PADS_BANK0.gpio(self.index()).write(|w| {
            w.set_ie(true);
            w.set_schmitt(true);
            match pull {
                Pull::Up => w.set_pue(true),
                Pull::Down => w.set_pde(true),
            }
        });
    }

    /// Gives the pin to the PWM.
    fn connect_pwm(self) {
        self.connect(PWM);
    }

    /// Leaves the pin to the converter: no pull, no input, no output.
    fn make_analog(self) {
        self.connect(0x1F);
        pac::PADS_BANK0.gpio(self.index()).write(|w| w.set_od(true));
    }

    fn connect(self, function: u8) {
        pac::PADS_BANK0.gpio(self.index()).write_value(driven());
        pac::IO_BANK0.gpio(self.index()).ctrl().write_value(ctrl(function));
    }

    /// Whether the pin belongs to the PWM and nothing overrides it.
    fn is_pwm(self) -> bool {
        self.has(PWM)
    }

    /// Whether the pin is driven by [`PinRegisters::set`] and nothing overrides it.
    fn is_output(self) -> bool {
        self.has(SIO) && pac::SIO.gpio_oe(0).value().read() & self.mask() != 0
    }

    fn has(self, function: u8) -> bool {
        pac::IO_BANK0.gpio(self.index()).ctrl().read() == ctrl(function)
            && pac::PADS_BANK0.gpio(self.index()).read() == driven()
    }

    /// Whether an output is set high.
    fn is_set(self) -> bool {
        pac::SIO.gpio_out(0).value().read() & self.mask() != 0
    }
}

/// A function without an override.
fn ctrl(function: u8) -> GpioCtrl {
    let mut w = GpioCtrl(0);
    w.set_funcsel(function);
    w
}

/// A pad that drives and reads, without a pull: the reset value without its pull-down.
fn driven() -> Pad {
    let mut w = Pad(0);
    w.set_ie(true);
    w.set_schmitt(true);
    w.set_drive(embassy_rp::pac::pads::vals::Drive::_4M_A);
    w
}

impl PinRegisters for Pin {
    #[inline(always)]
    fn index(self) -> usize {
        // What the board's table guarantees, in a form that leaves no range check: this runs in the panic handler.
        usize::from(self.0) & 0x1F
    }
}

/// Takes the pins' registers out of reset.
pub(crate) fn out_of_reset() {
    pac::RESETS.reset().modify(|w| {
        w.set_io_bank0(false);
        w.set_pads_bank0(false);
    });
    while !(pac::RESETS.reset_done().read().io_bank0() && pac::RESETS.reset_done().read().pads_bank0()) {}
}
