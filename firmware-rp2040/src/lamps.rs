//! Drives the board's lamp, see [`firmware_shared::lamp`]: one lamp shows pulses and faults.

use firmware_rp2040::board::BOARD;
use firmware_shared::lamp::{STEP_MS, Shown};

use crate::pins::PinRegisters;
use crate::stopwatch;

/// Makes the pin of the lamp an output.
pub(crate) fn start() {
    BOARD.led.set(false);
    BOARD.led.make_output();
}

/// Shows the state at this time, ms.
pub(crate) fn show(shown: Shown, ms: u32) {
    BOARD.led.set(shown.lit(ms).is_some());
}

/// Shows this from now on. Before the tasks start.
pub(crate) fn show_for_ever(shown: Shown) -> ! {
    stopwatch::wait_and_call(STEP_MS, |ms| show(shown, ms))
}
