//! The servo-rail enable: a pin that is high only while the servo outputs are on, and switches the servos' supply.

use firmware_rp2040::board::BOARD;

use crate::pins::PinRegisters;

/// Drives the pin low.
pub(crate) fn start() {
    off();
    BOARD.servo_rail.make_output();
}

/// Switches the servos' supply on.
pub(crate) fn on() {
    BOARD.servo_rail.set(true);
}

/// Whether the pin is an output, set high only if it may be, and high if it must be.
pub(crate) fn is_as_set(may_be_on: bool, must_be_on: bool) -> bool {
    let is_on = BOARD.servo_rail.is_set();
    BOARD.servo_rail.is_output() && (may_be_on || !is_on) && (is_on || !must_be_on)
}

/// Switches the servos' supply off; from any context.
pub(crate) fn off() {
    BOARD.servo_rail.set(false);
}
