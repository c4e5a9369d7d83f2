//! Faults: status registers, exception to take, escalation to HardFault, lock-up (ARMv7-M ARM, B1.5.13 to B1.5.15).

use crate::cpu::Trap;
use crate::nvic::{self, Masks, Nvic};
use crate::probe::core::vector_catch;
use crate::scs::{Scs, cfsr, hfsr};

/// Cause of a synchronous exception.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FaultCause {
    /// An instruction or an access failed.
    Trap(Trap),
    /// A supervisor call.
    Supervisor,
    /// A breakpoint with no debugger attached.
    Breakpoint,
    /// A frame could not be written.
    Stacking,
    /// A frame could not be read.
    Unstacking,
    /// A bad EXC_RETURN.
    Return,
    /// A vector with bit 0 clear, or without memory at its address.
    Vector,
}

/// Response of the core.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FaultResponse {
    /// The core takes this exception.
    Take(u8),
    /// No exception can be taken: the core stops until a reset.
    LockUp,
}

impl FaultCause {
    /// The exception that is defined for the cause.
    #[must_use]
    pub(crate) const fn exception(self) -> u8 {
        match self {
            FaultCause::Trap(Trap::Undefined | Trap::InvalidState | Trap::Other) | FaultCause::Return => {
                nvic::USAGE_FAULT
            }
            FaultCause::Trap(Trap::FetchNever) => nvic::MEM_MANAGE,
            FaultCause::Trap(_) | FaultCause::Stacking | FaultCause::Unstacking => nvic::BUS_FAULT,
            FaultCause::Supervisor => nvic::SV_CALL,
            FaultCause::Breakpoint => nvic::DEBUG_MONITOR,
            FaultCause::Vector => nvic::HARD_FAULT,
        }
    }

    /// The vector catches that halt at exception `number`, which the core takes for this cause (ARMv7-M ARM, table B1-9).
    #[must_use]
    pub(crate) const fn vector_catches(self, number: u8) -> u32 {
        let of_entry_or_return = match self {
            FaultCause::Stacking | FaultCause::Unstacking | FaultCause::Vector => vector_catch::EXCEPTION,
            _ => 0,
        };
        of_entry_or_return
            | match number {
                nvic::HARD_FAULT => vector_catch::HARD_FAULT,
                nvic::MEM_MANAGE => vector_catch::MEM_MANAGE,
                nvic::BUS_FAULT => vector_catch::BUS,
                nvic::USAGE_FAULT => vector_catch::STATE,
                _ => 0,
            }
    }

    /// Description for the output.
    #[must_use]
    pub(crate) const fn name(self) -> &'static str {
        match self {
            FaultCause::Trap(Trap::Undefined) => "undefined instruction",
            FaultCause::Trap(Trap::InvalidState) => "branch to an even address",
            FaultCause::Trap(Trap::FetchUnmapped) => "fetch from an address without memory",
            FaultCause::Trap(Trap::FetchNever) => {
                "fetch from a region without code (only with --probe the virtual board runs code from RAM)"
            }
            FaultCause::Trap(Trap::ReadUnmapped(_)) => "read from an unmapped address",
            FaultCause::Trap(Trap::WriteUnmapped(_)) => "write to an unmapped address",
            FaultCause::Trap(Trap::WriteFlash(_)) => "write to flash",
            FaultCause::Trap(Trap::Other) => "unknown error of the emulator",
            FaultCause::Supervisor => "supervisor call at a priority that it cannot preempt",
            FaultCause::Breakpoint => "breakpoint without debugger",
            FaultCause::Stacking => "stack pointer outside of RAM at an exception entry",
            FaultCause::Unstacking => "stack pointer outside of memory at an exception return",
            FaultCause::Return => "invalid exception return",
            FaultCause::Vector => "invalid vector",
        }
    }

    fn record(self, scs: &mut Scs) {
        let bits = match self {
            FaultCause::Trap(Trap::Undefined | Trap::Other) => cfsr::UNDEFINSTR,
            FaultCause::Trap(Trap::InvalidState) => cfsr::INVSTATE,
            FaultCause::Trap(Trap::FetchUnmapped) => cfsr::IBUSERR,
            FaultCause::Trap(Trap::FetchNever) => cfsr::IACCVIOL,
            FaultCause::Trap(Trap::ReadUnmapped(addr) | Trap::WriteUnmapped(addr)) => {
                scs.bfar = addr;
                cfsr::PRECISERR | cfsr::BFARVALID
            }
            FaultCause::Trap(Trap::WriteFlash(_)) => cfsr::IMPRECISERR,
            FaultCause::Stacking => cfsr::STKERR,
            FaultCause::Unstacking => cfsr::UNSTKERR,
            FaultCause::Return => cfsr::INVPC,
            FaultCause::Supervisor | FaultCause::Breakpoint | FaultCause::Vector => 0,
        };
        scs.cfsr |= bits;
    }
}

/// Sets the status registers for the cause and selects the exception to take.
pub(crate) fn respond(cause: FaultCause, scs: &mut Scs, nvic: &Nvic, masks: Masks) -> FaultResponse {
    cause.record(scs);
    let exception = cause.exception();
    let now = nvic.execution_priority(masks);
    if exception != nvic::HARD_FAULT && nvic.is_enabled(exception) && nvic.group_priority(exception) < now {
        return FaultResponse::Take(exception);
    }
    if now <= -1 {
        return FaultResponse::LockUp;
    }
    scs.hfsr |= match cause {
        FaultCause::Breakpoint => hfsr::DEBUGEVT,
        FaultCause::Vector => hfsr::VECTTBL,
        _ => hfsr::FORCED,
    };
    FaultResponse::Take(nvic::HARD_FAULT)
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNMASKED: Masks = Masks { primask: false, faultmask: false, basepri: 0 };

    #[test]
    fn a_fault_uses_its_own_handler_only_if_enabled() {
        let (mut scs, mut nvic) = (Scs::default(), Nvic::default());
        let cause = FaultCause::Trap(Trap::Undefined);
        assert_eq!(respond(cause, &mut scs, &nvic, UNMASKED), FaultResponse::Take(nvic::HARD_FAULT));
        assert_eq!((scs.cfsr, scs.hfsr), (cfsr::UNDEFINSTR, hfsr::FORCED));
        nvic.enable(nvic::USAGE_FAULT);
        scs.hfsr = 0;
        assert_eq!(respond(cause, &mut scs, &nvic, UNMASKED), FaultResponse::Take(nvic::USAGE_FAULT));
        assert_eq!(scs.hfsr, 0);
    }

    #[test]
    fn a_fault_that_cannot_preempt_escalates_then_locks_up() {
        let (mut scs, mut nvic) = (Scs::default(), Nvic::default());
        nvic.enable(nvic::BUS_FAULT);
        nvic.set_priority(nvic::BUS_FAULT, 0x40);
        let cause = FaultCause::Trap(Trap::ReadUnmapped(0x6000_0004));
        nvic.enable(20);
        nvic.set_priority(20, 0x40);
        nvic.activate(20);
        assert_eq!(respond(cause, &mut scs, &nvic, UNMASKED), FaultResponse::Take(nvic::HARD_FAULT));
        assert_eq!(scs.bfar, 0x6000_0004);
        nvic.activate(nvic::HARD_FAULT);
        assert_eq!(respond(cause, &mut scs, &nvic, UNMASKED), FaultResponse::LockUp);
        nvic.deactivate(nvic::HARD_FAULT);
        assert_eq!(respond(cause, &mut scs, &nvic, Masks { faultmask: true, ..UNMASKED }), FaultResponse::LockUp);
    }

    #[test]
    fn supervisor_calls_escalate_under_primask() {
        let (mut scs, nvic) = (Scs::default(), Nvic::default());
        assert_eq!(respond(FaultCause::Supervisor, &mut scs, &nvic, UNMASKED), FaultResponse::Take(nvic::SV_CALL));
        let masked = Masks { primask: true, ..UNMASKED };
        assert_eq!(respond(FaultCause::Supervisor, &mut scs, &nvic, masked), FaultResponse::Take(nvic::HARD_FAULT));
        assert_eq!((scs.cfsr, scs.hfsr), (0, hfsr::FORCED));
    }

    #[test]
    fn a_fault_that_escalates_is_caught_as_a_hard_fault() {
        let undefined = FaultCause::Trap(Trap::Undefined);
        assert_eq!(undefined.vector_catches(nvic::HARD_FAULT), vector_catch::HARD_FAULT);
        assert_eq!(undefined.vector_catches(nvic::USAGE_FAULT), vector_catch::STATE);
        let both = vector_catch::HARD_FAULT | vector_catch::EXCEPTION;
        assert_eq!(FaultCause::Vector.vector_catches(nvic::HARD_FAULT), both);
        assert_eq!(FaultCause::Supervisor.vector_catches(nvic::SV_CALL), 0);
    }

    #[test]
    fn a_breakpoint_without_debugger_is_a_hard_fault() {
        let (mut scs, nvic) = (Scs::default(), Nvic::default());
        assert_eq!(respond(FaultCause::Breakpoint, &mut scs, &nvic, UNMASKED), FaultResponse::Take(nvic::HARD_FAULT));
        assert_eq!(scs.hfsr, hfsr::DEBUGEVT);
    }
}
