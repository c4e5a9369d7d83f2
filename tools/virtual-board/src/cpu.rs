//! Interfaces between the processor ([`Cpu`]) and the board around it ([`Machine`]).
//!
//! The processor only executes instructions. The board models exceptions, the NVIC and the System Control Space, which the emulator does
//! not have. One implementation of the processor: [`crate::unicorn::UnicornCpu`].

use stm32f4_model::{DmaMemory, Width};

use crate::nvic::Masks;

/// A register of the processor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reg {
    /// General register R0 to R12.
    R(u8),
    /// The current stack pointer: MSP or PSP.
    Sp,
    /// The link register.
    Lr,
    /// The program counter; bit 0 is always 0.
    Pc,
    /// Program status with flags, IT state, T bit and exception number.
    Xpsr,
    /// Process stack pointer, also while the main one is current.
    Psp,
    /// Main stack pointer, also while the process one is current.
    Msp,
    /// CONTROL: bit 0 unprivileged thread, bit 1 thread on PSP, bit 2 floating-point context active.
    Control,
    /// PRIMASK.
    Primask,
    /// FAULTMASK.
    Faultmask,
    /// BASEPRI.
    Basepri,
    /// Floating-point status and control.
    Fpscr,
    /// Single precision register S0 to S31.
    S(u8),
}

/// CONTROL.nPRIV.
pub(crate) const CONTROL_NPRIV: u32 = 1;
/// CONTROL.SPSEL.
pub(crate) const CONTROL_SPSEL: u32 = 1 << 1;
/// CONTROL.FPCA.
pub(crate) const CONTROL_FPCA: u32 = 1 << 2;
/// xPSR.T: Thumb state, always set.
pub(crate) const XPSR_T: u32 = 1 << 24;
/// The bits of xPSR that hold the number of the running exception.
pub(crate) const XPSR_EXCEPTION: u32 = 0x1FF;
/// The bits of xPSR that hold the state of an IT block.
pub(crate) const XPSR_IT: u32 = 0x0600_FC00;

/// `b .`
pub(crate) const BRANCH_TO_SELF: u16 = 0xE7FE;

/// Reason why the instruction at the program counter cannot execute.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Trap {
    /// Undefined instruction.
    Undefined,
    /// A branch to an address with bit 0 clear.
    InvalidState,
    /// Instruction fetch from an address without memory.
    FetchUnmapped,
    /// Instruction fetch from a region that holds no code.
    FetchNever,
    /// Data read from an unmapped address, which it holds.
    ReadUnmapped(u32),
    /// Data write to an unmapped address, which it holds.
    WriteUnmapped(u32),
    /// Data write to flash, with its address.
    WriteFlash(u32),
    /// Another error of the emulator.
    Other,
}

/// Reason why [`Cpu::run`] returned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stop {
    /// The machine requested it, before the block at the program counter.
    Requested,
    /// A supervisor call; the program counter is past it.
    Supervisor,
    /// A breakpoint instruction with its number; the program counter is at it.
    Breakpoint(u8),
    /// A hardware break point at the program counter.
    HardwareBreakpoint,
    /// A branch to an EXC_RETURN value.
    ExceptionReturn(u32),
    /// Wait for interrupt; the program counter is past it.
    WaitForInterrupt,
    /// Wait for event; the program counter is past it. The board models the event register.
    WaitForEvent,
    /// The instruction at the program counter cannot execute.
    Trap(Trap),
}

/// The board as the processor uses it.
pub(crate) trait Machine {
    /// Decides before each block of so many instructions whether to stop there. `masks` reads the mask registers, which is slow.
    fn before_block(&mut self, instructions: u32, masks: impl FnOnce() -> Masks) -> bool;

    /// Counts the instructions of the block at `pc`, which runs next.
    fn charge(&mut self, pc: u32, instructions: u32);

    /// Counts more passes of the block that runs next, a branch to itself, as long as nothing would stop one.
    fn stay(&mut self);

    /// Sets the event register: the program executed SEV.
    fn send_event(&mut self);

    /// Loads from the peripherals or the private peripheral bus; 0 if not modelled.
    fn load(&mut self, addr: u32, width: Width, memory: &mut dyn DmaMemory) -> u32;

    /// Stores to the peripherals or the private peripheral bus.
    fn store(&mut self, addr: u32, width: Width, value: u32, memory: &mut dyn DmaMemory);

    /// Stores to the flash; false: it is locked, and the store is a fault.
    fn store_to_flash(&mut self, addr: u32, width: Width, value: u32, memory: &mut dyn DmaMemory) -> bool;
}

/// A processor that executes ARMv7E-M instructions with the single precision floating-point extension.
pub(crate) trait Cpu {
    /// Reads a register.
    fn reg(&self, reg: Reg) -> u32;

    /// Writes a register. Not for xPSR and CONTROL: see [`Cpu::set_mode`].
    fn set_reg(&mut self, reg: Reg, value: u32);

    /// Writes xPSR and CONTROL together, from any mode to any other, and banks the stack pointers accordingly.
    fn set_mode(&mut self, xpsr: u32, control: u32);

    /// Clears the exclusive monitor, as each exception entry and return does.
    fn clear_exclusive(&mut self);

    /// Reads memory; false if a part of it is neither flash nor RAM.
    fn read_memory(&self, addr: u32, into: &mut [u8]) -> bool;

    /// Writes RAM; false, without a write, if a part of it is not RAM.
    fn write_ram(&mut self, addr: u32, bytes: &[u8]) -> bool;

    /// Runs until an event that the board must handle.
    fn run(&mut self) -> Stop;

    /// The mask registers.
    fn masks(&self) -> Masks {
        Masks {
            primask: self.reg(Reg::Primask) & 1 != 0,
            faultmask: self.reg(Reg::Faultmask) & 1 != 0,
            basepri: self.reg(Reg::Basepri) as u8,
        }
    }

    /// Number of the running exception; 0 in thread mode.
    fn exception(&self) -> u8 {
        (self.reg(Reg::Xpsr) & XPSR_EXCEPTION) as u8
    }

    /// Reads a word of memory; `None`: no memory at the address.
    fn read_word(&self, addr: u32) -> Option<u32> {
        let mut bytes = [0; 4];
        self.read_memory(addr, &mut bytes).then(|| u32::from_le_bytes(bytes))
    }
}

/// Number of instructions in a sequence of Thumb code; 32-bit ones start with 0b11101, 0b11110 or 0b11111.
#[must_use]
pub(crate) fn count_instructions(code: &[u8]) -> u32 {
    let mut count = 0;
    let mut at = 0;
    while at + 1 < code.len() {
        at += if is_wide(u16::from_le_bytes([code[at], code[at + 1]])) { 4 } else { 2 };
        count += 1;
    }
    count
}

/// True for the first half of a 32-bit instruction.
#[must_use]
pub(crate) const fn is_wide(first: u16) -> bool {
    first >> 11 >= 0b11101
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_narrow_and_wide_instructions() {
        // nop; bl +0; bx lr
        assert_eq!(count_instructions(&[0x00, 0xBF, 0x00, 0xF0, 0x00, 0xF8, 0x70, 0x47]), 3);
        assert_eq!(count_instructions(&[]), 0);
        // b . is 0xE7FE: narrow although it begins with 111.
        assert!(!is_wide(0xE7FE));
        assert!(is_wide(0xE92D));
        // A block that ends in the middle of a wide instruction still counts it.
        assert_eq!(count_instructions(&[0x00, 0xF0]), 1);
    }
}
