//! Drives the board's lamps, see [`firmware_shared::lamp`].

use embassy_stm32::pac::RCC;
use embassy_stm32::pac::gpio::vals::Moder;
use firmware::board::{BOARD, Pin};
use firmware_shared::lamp::{Lamp, STEP_MS, Shown};

use crate::pins::PinRegisters;
use crate::{clocks, stopwatch};

fn pins() -> impl Iterator<Item = Pin> {
    [BOARD.led_pulses, BOARD.led_fault].into_iter().flatten()
}

/// Makes the pins of the lamps outputs.
pub(crate) fn start() {
    // A board has them on any port.
    RCC.ahb1enr().modify(|w| {
        w.set_gpioaen(true);
        w.set_gpioben(true);
        w.set_gpiocen(true);
        w.set_gpioden(true);
        w.set_gpioeen(true);
    });
    clocks::settle();
    pins().for_each(|pin| {
        pin.set(!BOARD.lamps_lit);
        pin.set_mode(Moder::OUTPUT);
    });
}

/// Shows the state at this time, ms.
pub(crate) fn show(shown: Shown, ms: u32) {
    let lit = match shown.lit(ms) {
        Some(Lamp::Pulses) => BOARD.led_pulses,
        Some(Lamp::Fault) => BOARD.led_fault.or(BOARD.led_pulses),
        None => None,
    };
    pins().for_each(|pin| pin.set((lit == Some(pin)) == BOARD.lamps_lit));
}

/// Shows this from now on, asleep between changes. Before the tasks start.
pub(crate) fn show_for_ever(shown: Shown) -> ! {
    start();
    stopwatch::sleep_and_wake(STEP_MS, |ms| show(shown, ms))
}
