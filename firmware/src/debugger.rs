//! Whether a debugger is attached to the core. It may halt it at any time: then the last pulses go on until the watchdog resets the board.

use cortex_m::peripheral::DCB;
use embassy_stm32::pac::DBGMCU;
use joint_loop::Debugger;

use crate::variant::DEBUGGER_REFUSED;

/// Bits of DEMCR (ARMv7-M ARM, C1.6.5) with which a fault (VC_MMERR to VC_HARDERR) or a reset (VC_CORERESET) halts the core.
const CATCHES: u32 = 0b111_1111 << 4 | 1;

const C_DEBUGEN: u32 = 1;

/// Whether one has set C_DEBUGEN (ARMv7-M ARM, C1.6.2), and whether this program refuses it.
pub(crate) fn attached() -> Debugger {
    // SAFETY: a register of the core that every program may read, as a word.
    let is_attached = unsafe { (*DCB::PTR).dhcsr.read() } & C_DEBUGEN != 0;
    match (is_attached, DEBUGGER_REFUSED) {
        (false, _) => Debugger::Absent,
        (true, false) => Debugger::Attached,
        (true, true) => Debugger::Refused,
    }
}

/// Whether a debugger has asked for the core to halt in a fault or after a reset: then neither the handler runs, which switches the servos off, nor a boot.
/// The bits outlast the debugger's program, until the supply was off.
pub(crate) fn catches() -> bool {
    // SAFETY: as above.
    let (dhcsr, demcr) = unsafe { ((*DCB::PTR).dhcsr.read(), (*DCB::PTR).demcr.read()) };
    dhcsr & C_DEBUGEN != 0 && demcr & CATCHES != 0
}

/// The debug clock stays on in sleep, so that a probe can read the log of a board that stays off.
pub(crate) fn keep_log_readable() {
    DBGMCU.cr().modify(|w| w.set_dbg_sleep(true));
}
