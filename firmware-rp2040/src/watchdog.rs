//! The watchdog: started once, never stopped, and running on while a debugger halts the core. [`firmware_shared::liveness`] decides when to reload it.

use embassy_rp::pac::watchdog::regs::Load;
use embassy_rp::pac::{PSM, WATCHDOG};
use firmware_rp2040::watchdog_time::{COUNTS_A_US, TIMEOUT_US};

/// What its reset resets: all stages but the two oscillators (RP2040 datasheet, 2.13.5).
const ALL_BUT_OSCILLATORS: u32 = 0x0001_FFFF & !0b11;

/// Starts the watchdog: from here on [`feed`] must be called in time.
pub(crate) fn start() {
    PSM.wdsel().write_value(embassy_rp::pac::psm::regs::Wdsel(ALL_BUT_OSCILLATORS));
    feed();
    WATCHDOG.ctrl().write(|w| w.set_enable(true));
}

/// Reloads the watchdog.
pub(crate) fn feed() {
    WATCHDOG.load().write_value(Load(TIMEOUT_US * COUNTS_A_US));
}

/// Resets the chip at once. `SYSRESETREQ` of the core would reset the core alone, and leave the pins as they are.
pub(crate) fn reset() -> ! {
    PSM.wdsel().write_value(embassy_rp::pac::psm::regs::Wdsel(ALL_BUT_OSCILLATORS));
    loop {
        WATCHDOG.ctrl().write(|w| w.set_trigger(true));
    }
}
