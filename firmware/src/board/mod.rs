//! What a board is to this firmware: a table of pins and clock facts. One board is one file here, and one Cargo feature.
//!
//! The same on every board, because it is the chip's and not the board's (STM32F4 with a 168 MHz clock):
//!
//! | what | where |
//! |---|---|
//! | servos, left hip, right hip, left knee, right knee | TIM1 channels 1 to 4, pins of the board's choice among those of TIM1 |
//! | emergency stop, high stops | TIM1 break input on PB12 |
//! | sensors 1 to 4 | PA1, PC1, PB0, PB1: channels 1, 11, 8, 9 of ADC1 |
//! | foot switch, a contact to the 3 V supply that closes on the floor | PC5, with the chip's pull-down |
//! | synchronisation input, 3.3 V | PC6, EXTI line 6, with the chip's pull-down |
//! | conversions, four to a control period | TIM2, DMA2 stream 0 |
//! | clock of the tasks that wait | TIM4 |
//! | free-running microseconds | TIM5 |
//!
//! # Duties of a board
//! - Each servo line is free of anything else on the board, and has a pull-down of its own (10 kOhm to ground): in reset and in the bootloader the chip drives nothing.
//! - The emergency stop is a contact from the 3 V supply through 1 kOhm to PB12 that closes to stop; open or not there at all, the chip's
//!   pull-down keeps it released. A broken wire is therefore not noticed: press it to test it.
//! - The servos have a supply of their own. No pulse is not no torque: what must go limp needs its supply switched.
//! - HSE is 8 MHz within 500 ppm. A wrong crystal scales every pulse and is not detected.

use embassy_stm32::pac::GPIOC;
use embassy_stm32::pac::gpio::Gpio;
use embassy_stm32::pac::gpio::vals::{Idr, Moder, Pupdr};
use joint_units::Volts;

#[cfg(all(feature = "f4-discovery", feature = "nucleo-f446re"))]
compile_error!(
    "choose one board: `f4-discovery` is the default, so the Nucleo needs `--no-default-features --features nucleo-f446re`"
);
#[cfg(not(any(feature = "f4-discovery", feature = "nucleo-f446re")))]
compile_error!("choose one board: `--features f4-discovery` or `--features nucleo-f446re`");

#[cfg(feature = "f4-discovery")]
mod f4_discovery;
#[cfg(feature = "f4-discovery")]
pub(crate) use f4_discovery::BOARD;

#[cfg(all(feature = "nucleo-f446re", not(feature = "f4-discovery")))]
mod nucleo_f446re;
#[cfg(all(feature = "nucleo-f446re", not(feature = "f4-discovery")))]
pub(crate) use nucleo_f446re::BOARD;

/// One pin of a port.
#[derive(Clone, Copy)]
pub(crate) struct Pin {
    /// The port's registers.
    pub(crate) port: Gpio,
    /// 0 to 15.
    pub(crate) number: usize,
}

/// Foot switch: high while the foot is on the floor. A wire that is off never strikes.
pub(crate) const FOOT_SWITCH: Pin = Pin::new(GPIOC, 5);

/// Synchronisation input, see [`crate::sync_input`].
pub(crate) const SYNC_INPUT: Pin = Pin::new(GPIOC, 6);

/// Where the 8 MHz come from.
#[derive(Clone, Copy, PartialEq, Eq)]
#[allow(dead_code, reason = "a board has one of them")]
pub(crate) enum Hse {
    /// A crystal at the chip.
    Crystal,
    /// A clock signal, as from the debug probe of a Nucleo.
    External,
}

/// The table that each board fills.
pub(crate) struct Board {
    /// As in the Cargo feature; the first line of the log.
    pub(crate) name: &'static str,
    /// As printed on the chip, and as probe-rs calls it.
    pub(crate) chip: &'static str,
    /// Source of HSE.
    pub(crate) hse: Hse,
    /// Supply below which no sample is believed: under what the board's own regulator delivers.
    pub(crate) min_supply: Volts,
    /// Channel of ADC1 that the temperature sensor of the chip is on: 16, or 18 on the chips where it shares that with VBAT.
    pub(crate) temperature_channel: u8,
    /// Pins of TIM1 channels 1 to 4, all by alternate function 1: PA8 to PA11, or PE9, PE11, PE13, PE14 where the package has them.
    pub(crate) servos: [Pin; 4],
    /// User button; the board holds the line at its level when released.
    pub(crate) button: Pin,
    /// Level of a pressed button.
    pub(crate) button_pressed: bool,
    /// Synchronisation output, see [`joint_loop::io::time_code`].
    pub(crate) sync: Pin,
    /// Lit while the servos get pulses; lit when the level is high.
    pub(crate) led_pulses: Option<Pin>,
    /// Lit in a fault; lit when the level is high.
    pub(crate) led_fault: Option<Pin>,
}

impl Pin {
    const fn new(port: Gpio, number: usize) -> Self {
        Self { port, number }
    }

    /// Takes the level on as soon as the pin is an output.
    pub(crate) fn set(self, high: bool) {
        self.port.bsrr().write(|w| if high { w.set_bs(self.number, true) } else { w.set_br(self.number, true) });
    }

    /// Whether the pin is high.
    pub(crate) fn is_high(self) -> bool {
        self.port.idr().read().idr(self.number) == Idr::HIGH
    }

    /// What the pin is used for. The clock of its port must be on.
    pub(crate) fn set_mode(self, mode: Moder) {
        self.port.moder().modify(|w| w.set_moder(self.number, mode));
    }

    /// The pull of the pin.
    pub(crate) fn set_pull(self, pull: Pupdr) {
        self.port.pupdr().modify(|w| w.set_pupdr(self.number, pull));
    }

    /// Gives the pin to a peripheral.
    pub(crate) fn set_function(self, function: u8) {
        self.port.afr(self.number / 8).modify(|w| w.set_afr(self.number % 8, function));
        self.set_mode(Moder::ALTERNATE);
    }
}

/// The lamps that the board has.
pub(crate) fn lamps() -> impl Iterator<Item = Pin> {
    [BOARD.led_pulses, BOARD.led_fault].into_iter().flatten()
}
