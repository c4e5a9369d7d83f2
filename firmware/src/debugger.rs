//! Whether a debugger is attached to the core. It may halt it at any time: then the last pulses go on until the watchdog resets the board.

use cortex_m::peripheral::DCB;
use joint_loop::Debugger;

use crate::variant::DEBUGGER_REFUSED;

/// Whether one has set C_DEBUGEN (ARMv7-M ARM, C1.6.2), and whether this program refuses it.
pub(crate) fn attached() -> Debugger {
    const C_DEBUGEN: u32 = 1;
    // SAFETY: a register of the core that every program may read, as a word.
    let is_attached = unsafe { (*DCB::PTR).dhcsr.read() } & C_DEBUGEN != 0;
    match (is_attached, DEBUGGER_REFUSED) {
        (false, _) => Debugger::Absent,
        (true, false) => Debugger::Attached,
        (true, true) => Debugger::Refused,
    }
}
