//! Whether a debugger is attached: a program of this core cannot read that (ARMv6-M ARM, C1.6: its debug registers are for the debugger alone).

use joint_loop::Debugger;

use crate::variant::DEBUGGER_REFUSED;

const _: () = assert!(
    !DEBUGGER_REFUSED,
    "the processor of this chip does not tell the program about a debugger: it cannot refuse one; build without `no-debugger`"
);

/// Always absent.
pub(crate) const fn attached() -> Debugger {
    Debugger::Absent
}

/// Not known: no.
pub(crate) const fn catches() -> bool {
    false
}

/// Nothing to do: a probe reads the memory of this chip in sleep too.
pub(crate) const fn keep_log_readable() {}
