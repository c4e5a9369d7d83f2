//! The watchdog: started once, never stopped, and running on while a debugger halts the core. [`firmware_shared::liveness`] decides when to reload it.

use embassy_rp::pac::watchdog::regs::Load;
use embassy_rp::pac::{PSM, WATCHDOG};
use firmware_rp2040::watchdog_time::{COUNTS_A_US, TIMEOUT_US};

/// What its reset resets: all stages but the two oscillators (RP2040 datasheet, 2.13.5).
const ALL_BUT_OSCILLATORS: u32 = 0x0001_FFFF & !0b11;

/// What a scratch register has while a reset by the watchdog would be one of this program; the word is that of the pico-sdk's `watchdog_enable`.
const OWN: u32 = 0x6AB7_3121;

/// Says in the scratch register that the next reset by the watchdog is one of this program.
///
/// The boot ROM resets the chip by the watchdog too, after it has written a UF2 file, with the same REASON. It clears this register then (`watchdog_reboot`
/// in its source, `usb_device_tiny/runtime.c`), and a power-on and the RUN pin clear it.
fn mark() {
    WATCHDOG.scratch4().write_value(OWN);
}

/// Whether a reset by the watchdog was one of this program.
pub(crate) fn was_own() -> bool {
    WATCHDOG.scratch4().read() == OWN
}

/// Starts the watchdog: from here on [`feed`] must be called in time.
pub(crate) fn start() {
    mark();
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
    mark();
    PSM.wdsel().write_value(embassy_rp::pac::psm::regs::Wdsel(ALL_BUT_OSCILLATORS));
    loop {
        WATCHDOG.ctrl().write(|w| w.set_trigger(true));
    }
}
