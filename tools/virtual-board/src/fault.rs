//! From something that went wrong to the exception that answers for it: status registers, escalation to HardFault, lock-up
//! (ARMv7-M ARM, B1.5.13 to B1.5.15).

use crate::cpu::Trap;
use crate::nvic::{self, Masks, Nvic};
use crate::scs::{Scs, cfsr, hfsr};

/// A synchronous exception.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Cause {
    /// The processor could not execute or access something.
    Trap(Trap),
    /// A supervisor call.
    Supervisor,
    /// A breakpoint with no debugger attached.
    Breakpoint,
    /// A frame could not be written.
    Stacking,
    /// A frame could not be read back.
    Unstacking,
    /// A bad EXC_RETURN.
    Return,
    /// A vector with bit 0 clear, or no memory where the vector should be.
    Vector,
}

/// What becomes of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Answer {
    /// This exception is taken now.
    Take(u8),
    /// Nothing can answer: the core stops until a reset.
    LockUp,
}

impl Cause {
    /// The exception that was meant for it.
    #[must_use]
    pub(crate) const fn exception(self) -> u8 {
        match self {
            Cause::Trap(Trap::Undefined | Trap::InvalidState | Trap::Other) | Cause::Return => nvic::USAGE_FAULT,
            Cause::Trap(Trap::FetchNever) => nvic::MEM_MANAGE,
            Cause::Trap(_) | Cause::Stacking | Cause::Unstacking => nvic::BUS_FAULT,
            Cause::Supervisor => nvic::SV_CALL,
            Cause::Breakpoint => nvic::DEBUG_MONITOR,
            Cause::Vector => nvic::HARD_FAULT,
        }
    }

    /// In words, for the report.
    #[must_use]
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Cause::Trap(Trap::Undefined) => "undefined instruction",
            Cause::Trap(Trap::InvalidState) => "branch to an even address",
            Cause::Trap(Trap::FetchUnmapped) => "fetch where no memory is",
            Cause::Trap(Trap::FetchNever) => {
                "fetch from a place that never holds code (the board runs no code from RAM)"
            }
            Cause::Trap(Trap::ReadUnmapped(_)) => "read where nothing is",
            Cause::Trap(Trap::WriteUnmapped(_)) => "write where nothing is",
            Cause::Trap(Trap::WriteFlash(_)) => "write to flash",
            Cause::Trap(Trap::Other) => "the emulator gave up",
            Cause::Supervisor => "supervisor call that may not preempt",
            Cause::Breakpoint => "breakpoint without a debugger",
            Cause::Stacking => "stack pointer outside of RAM at an exception entry",
            Cause::Unstacking => "stack pointer outside of memory at an exception return",
            Cause::Return => "invalid exception return",
            Cause::Vector => "bad vector",
        }
    }

    fn record(self, scs: &mut Scs) {
        let bits = match self {
            Cause::Trap(Trap::Undefined | Trap::Other) => cfsr::UNDEFINSTR,
            Cause::Trap(Trap::InvalidState) => cfsr::INVSTATE,
            Cause::Trap(Trap::FetchUnmapped) => cfsr::IBUSERR,
            Cause::Trap(Trap::FetchNever) => cfsr::IACCVIOL,
            Cause::Trap(Trap::ReadUnmapped(addr) | Trap::WriteUnmapped(addr)) => {
                scs.bfar = addr;
                cfsr::PRECISERR | cfsr::BFARVALID
            }
            Cause::Trap(Trap::WriteFlash(_)) => cfsr::IMPRECISERR,
            Cause::Stacking => cfsr::STKERR,
            Cause::Unstacking => cfsr::UNSTKERR,
            Cause::Return => cfsr::INVPC,
            Cause::Supervisor | Cause::Breakpoint | Cause::Vector => 0,
        };
        scs.cfsr |= bits;
    }
}

/// Records the cause in the status registers and finds the exception to take.
pub(crate) fn answer(cause: Cause, scs: &mut Scs, nvic: &Nvic, masks: Masks) -> Answer {
    cause.record(scs);
    let wanted = cause.exception();
    let now = nvic.execution_priority(masks);
    if wanted != nvic::HARD_FAULT && nvic.is_enabled(wanted) && nvic.group_priority(wanted) < now {
        return Answer::Take(wanted);
    }
    if now <= -1 {
        return Answer::LockUp;
    }
    scs.hfsr |= match cause {
        Cause::Breakpoint => hfsr::DEBUGEVT,
        Cause::Vector => hfsr::VECTTBL,
        _ => hfsr::FORCED,
    };
    Answer::Take(nvic::HARD_FAULT)
}

#[cfg(test)]
mod tests {
    use super::*;

    const OPEN: Masks = Masks { primask: false, faultmask: false, basepri: 0 };

    #[test]
    fn a_fault_goes_to_its_own_handler_only_when_that_is_enabled() {
        let (mut scs, mut nvic) = (Scs::default(), Nvic::default());
        let cause = Cause::Trap(Trap::Undefined);
        assert_eq!(answer(cause, &mut scs, &nvic, OPEN), Answer::Take(nvic::HARD_FAULT));
        assert_eq!((scs.cfsr, scs.hfsr), (cfsr::UNDEFINSTR, hfsr::FORCED));
        nvic.enable(nvic::USAGE_FAULT);
        scs.hfsr = 0;
        assert_eq!(answer(cause, &mut scs, &nvic, OPEN), Answer::Take(nvic::USAGE_FAULT));
        assert_eq!(scs.hfsr, 0);
    }

    #[test]
    fn a_fault_that_may_not_preempt_escalates_and_then_locks_up() {
        let (mut scs, mut nvic) = (Scs::default(), Nvic::default());
        nvic.enable(nvic::BUS_FAULT);
        nvic.set_priority(nvic::BUS_FAULT, 0x40);
        let cause = Cause::Trap(Trap::ReadUnmapped(0x6000_0004));
        nvic.enable(20);
        nvic.set_priority(20, 0x40);
        nvic.activate(20);
        assert_eq!(answer(cause, &mut scs, &nvic, OPEN), Answer::Take(nvic::HARD_FAULT));
        assert_eq!(scs.bfar, 0x6000_0004);
        nvic.activate(nvic::HARD_FAULT);
        assert_eq!(answer(cause, &mut scs, &nvic, OPEN), Answer::LockUp);
        nvic.deactivate(nvic::HARD_FAULT);
        assert_eq!(answer(cause, &mut scs, &nvic, Masks { faultmask: true, ..OPEN }), Answer::LockUp);
    }

    #[test]
    fn supervisor_calls_escalate_under_primask() {
        let (mut scs, nvic) = (Scs::default(), Nvic::default());
        assert_eq!(answer(Cause::Supervisor, &mut scs, &nvic, OPEN), Answer::Take(nvic::SV_CALL));
        let closed = Masks { primask: true, ..OPEN };
        assert_eq!(answer(Cause::Supervisor, &mut scs, &nvic, closed), Answer::Take(nvic::HARD_FAULT));
        assert_eq!((scs.cfsr, scs.hfsr), (0, hfsr::FORCED));
    }

    #[test]
    fn a_breakpoint_without_a_debugger_is_a_hard_fault_of_its_own() {
        let (mut scs, nvic) = (Scs::default(), Nvic::default());
        assert_eq!(answer(Cause::Breakpoint, &mut scs, &nvic, OPEN), Answer::Take(nvic::HARD_FAULT));
        assert_eq!(scs.hfsr, hfsr::DEBUGEVT);
    }
}
