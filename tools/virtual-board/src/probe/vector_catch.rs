//! Vector catches of DEMCR (ARMv7-M ARM, C1.6.5, table B1-9): where a fault halts the core before the first instruction of its handler.

use crate::fault::FaultCause;
use crate::nvic;

/// VC_CORERESET: a reset.
pub(crate) const RESET: u32 = 1;
/// VC_MMERR: MemManage.
const MEM_MANAGE: u32 = 1 << 4;
/// VC_CHKERR: a division by zero or an unaligned access, which the board does not model.
const CHECK: u32 = 1 << 6;
/// VC_NOCPERR: a coprocessor that is off, which the board does not model.
const NO_COPROCESSOR: u32 = 1 << 5;
/// VC_STATERR: UsageFault by a state or an instruction.
const STATE: u32 = 1 << 7;
/// VC_BUSERR: BusFault.
const BUS: u32 = 1 << 8;
/// VC_INTERR: a fault of an exception entry or return.
const EXCEPTION: u32 = 1 << 9;
/// VC_HARDERR: HardFault.
pub(crate) const HARD_FAULT: u32 = 1 << 10;
/// All of them.
pub(crate) const ALL: u32 = RESET | MEM_MANAGE | NO_COPROCESSOR | CHECK | STATE | BUS | EXCEPTION | HARD_FAULT;

/// The catches that halt at exception `number`, which the core takes for a cause.
pub(crate) const fn of(number: u8, cause: FaultCause) -> u32 {
    let is_of_entry_or_return = matches!(cause, FaultCause::Stacking | FaultCause::Unstacking | FaultCause::Vector);
    let on_entry_or_return = if is_of_entry_or_return { EXCEPTION } else { 0 };
    on_entry_or_return
        | match number {
            nvic::HARD_FAULT => HARD_FAULT,
            nvic::MEM_MANAGE => MEM_MANAGE,
            nvic::BUS_FAULT => BUS,
            nvic::USAGE_FAULT => STATE,
            _ => 0,
        }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::Trap;

    #[test]
    fn a_fault_that_escalates_is_caught_as_a_hard_fault() {
        let undefined = FaultCause::Trap(Trap::Undefined);
        assert_eq!(of(nvic::HARD_FAULT, undefined), HARD_FAULT);
        assert_eq!(of(nvic::USAGE_FAULT, undefined), STATE);
        assert_eq!(of(nvic::HARD_FAULT, FaultCause::Vector), HARD_FAULT | EXCEPTION);
        assert_eq!(of(nvic::SV_CALL, FaultCause::Supervisor), 0);
        assert_eq!(ALL, 0x7F1, "the bits 10 to 4 and 0");
    }
}
