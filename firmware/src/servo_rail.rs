//! The servo-rail enable: a pin that is high only while the servo outputs are on, and switches the servos' supply.
//!
//! A pulse that is cut short is a valid command for another angle. Where the program cannot wait for its end (break input, reset, brown-out) the
//! supply is what keeps a servo from carrying it out. In reset the pin floats, and its pull-down on the board switches the supply off.

use embassy_stm32::pac::gpio::vals::Moder;
use firmware::board::BOARD;

use crate::pins::PinRegisters;

/// Drives the pin low. The clock of its port must be on.
pub(crate) fn start() {
    off();
    BOARD.servo_rail.set_mode(Moder::OUTPUT);
}

/// Switches the servos' supply on.
pub(crate) fn on() {
    BOARD.servo_rail.set(true);
}

/// Whether the pin is an output, set high only if it may be, and high if it must be.
pub(crate) fn is_as_set(may_be_on: bool, must_be_on: bool) -> bool {
    let is_on = BOARD.servo_rail.is_set();
    BOARD.servo_rail.has_mode(Moder::OUTPUT) && (may_be_on || !is_on) && (is_on || !must_be_on)
}

/// Switches the servos' supply off; from any context.
pub(crate) fn off() {
    BOARD.servo_rail.set(false);
}
