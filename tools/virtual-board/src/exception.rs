//! Exception entry and return: stack frame, EXC_RETURN, mode changes (ARMv7-M ARM, B1.5.6 to B1.5.8).
//!
//! The floating-point part of the frame is written at once. With lazy stacking, the default of the hardware, the frame only differs until
//! the first floating-point instruction of the handler.

use crate::cpu::{CONTROL_FPCA, CONTROL_NPRIV, CONTROL_SPSEL, Cpu, Reg, XPSR_EXCEPTION, XPSR_IT, XPSR_T};
use crate::nvic::{NMI, Nvic};

/// Bytes of the integer part of a frame: R0-R3, R12, LR, return address, xPSR.
const BASIC: u32 = 0x20;
/// Bytes of a frame with S0-S15, FPSCR and a reserved word.
const EXTENDED: u32 = 0x68;
/// EXC_RETURN bit 2: the frame is on the process stack.
const ON_PSP: u32 = 1 << 2;
/// EXC_RETURN bit 3: the return goes to thread mode.
const TO_THREAD: u32 = 1 << 3;
/// EXC_RETURN bit 4: the frame has no floating-point part.
const NO_FP: u32 = 1 << 4;
/// xPSR bit 9 in a frame: a word of padding lies above it.
const PADDED: u32 = 1 << 9;

/// A frame that could not be written or read: the stack pointer is not in RAM.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct StackFault {
    /// Stack pointer of the frame.
    pub(crate) address: u32,
}

/// Reason why an exception return failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ReturnFault {
    /// EXC_RETURN or the running exception does not match the state.
    Invalid,
    /// The frame could not be read.
    Stack(StackFault),
}

/// Takes exception `number` at `handler`: writes the frame, sets LR to EXC_RETURN and switches to handler mode.
///
/// # Errors
/// The frame does not fit into RAM. The handler is entered nevertheless, with the stack pointer moved, as on the chip.
pub(crate) fn enter(
    cpu: &mut impl Cpu,
    nvic: &mut Nvic,
    number: u8,
    handler: u32,
    return_to: u32,
) -> Result<(), StackFault> {
    let xpsr = cpu.reg(Reg::Xpsr);
    let control = cpu.reg(Reg::Control);
    let thread = xpsr & XPSR_EXCEPTION == 0;
    let on_psp = thread && control & CONTROL_SPSEL != 0;
    let fp = control & CONTROL_FPCA != 0;

    let sp = cpu.reg(Reg::Sp);
    let size = if fp { EXTENDED } else { BASIC };
    // CCR.STKALIGN is read-only 1 on the Cortex-M4 of ST: frames are aligned to 8 bytes.
    let frame = sp.wrapping_sub(size) & !7;
    let padded = if sp & 4 != 0 { PADDED } else { 0 };

    let mut words = [0u32; EXTENDED as usize / 4];
    for (word, reg) in words.iter_mut().zip([Reg::R(0), Reg::R(1), Reg::R(2), Reg::R(3), Reg::R(12), Reg::Lr]) {
        *word = cpu.reg(reg);
    }
    words[6] = return_to & !1;
    words[7] = xpsr & !PADDED | padded;
    if fp {
        for n in 0..16 {
            words[8 + usize::from(n)] = cpu.reg(Reg::S(n));
        }
        words[24] = cpu.reg(Reg::Fpscr);
    }
    let bytes: Vec<u8> = words[..size as usize / 4].iter().flat_map(|word| word.to_le_bytes()).collect();
    let stacked = if cpu.write_ram(frame, &bytes) { Ok(()) } else { Err(StackFault { address: frame }) };

    // Before the mode changes: this sets the interrupted stack pointer.
    cpu.set_reg(Reg::Sp, frame);
    let exc_return =
        0xFFFF_FFE1 | if on_psp { ON_PSP } else { 0 } | if thread { TO_THREAD } else { 0 } | if fp { 0 } else { NO_FP };
    start_handler(cpu, nvic, number, handler, exc_return);
    stacked
}

/// Starts a handler whose frame is already written: last part of an entry, and the whole of a tail-chained one.
pub(crate) fn start_handler(cpu: &mut impl Cpu, nvic: &mut Nvic, number: u8, handler: u32, exc_return: u32) {
    nvic.activate(number);
    let xpsr = cpu.reg(Reg::Xpsr);
    let control = cpu.reg(Reg::Control);
    cpu.set_mode(xpsr & !(XPSR_EXCEPTION | XPSR_IT) | XPSR_T | u32::from(number), control & CONTROL_NPRIV);
    cpu.set_reg(Reg::Lr, exc_return);
    cpu.clear_exclusive();
    cpu.set_reg(Reg::Pc, handler & !1);
}

/// Checks an exception return by `exc_return`; returns the number of the exception that ends.
///
/// # Errors
/// The value does not match the state.
pub(crate) fn check_return(cpu: &impl Cpu, nvic: &Nvic, exc_return: u32) -> Result<u8, ReturnFault> {
    let number = cpu.exception();
    if number == 0 || !nvic.is_active(number) {
        return Err(ReturnFault::Invalid);
    }
    let nested = nvic.active_count() > 1;
    match exc_return | NO_FP {
        0xFFFF_FFF1 if nested => Ok(number),
        0xFFFF_FFF9 | 0xFFFF_FFFD if !nested => Ok(number),
        _ => Err(ReturnFault::Invalid),
    }
}

/// Makes the running exception inactive, and clears FAULTMASK unless it was the NMI.
pub(crate) fn deactivate(cpu: &mut impl Cpu, nvic: &mut Nvic, number: u8) {
    nvic.deactivate(number);
    if number != NMI {
        cpu.set_reg(Reg::Faultmask, 0);
    }
}

/// Restores the frame that `exc_return` selects and continues at its return address.
///
/// # Errors
/// The frame is not in memory, or its exception number does not match the mode to return to.
pub(crate) fn unstack(cpu: &mut impl Cpu, exc_return: u32) -> Result<(), ReturnFault> {
    let from_psp = exc_return & ON_PSP != 0;
    let to_thread = exc_return & TO_THREAD != 0;
    let fp = exc_return & NO_FP == 0;
    let size = if fp { EXTENDED } else { BASIC };
    let frame = cpu.reg(if from_psp { Reg::Psp } else { Reg::Msp });
    let mut bytes = [0u8; EXTENDED as usize];
    if !cpu.read_memory(frame, &mut bytes[..size as usize]) {
        return Err(ReturnFault::Stack(StackFault { address: frame }));
    }
    let word = |n: usize| u32::from_le_bytes([bytes[4 * n], bytes[4 * n + 1], bytes[4 * n + 2], bytes[4 * n + 3]]);
    let xpsr = word(7);
    if (xpsr & XPSR_EXCEPTION == 0) != to_thread {
        return Err(ReturnFault::Invalid);
    }

    for (n, reg) in [Reg::R(0), Reg::R(1), Reg::R(2), Reg::R(3), Reg::R(12), Reg::Lr].into_iter().enumerate() {
        cpu.set_reg(reg, word(n));
    }
    if fp {
        for n in 0..16 {
            cpu.set_reg(Reg::S(n), word(8 + usize::from(n)));
        }
        cpu.set_reg(Reg::Fpscr, word(24));
    }
    let sp = frame.wrapping_add(size) | if xpsr & PADDED != 0 { 4 } else { 0 };
    cpu.set_reg(if from_psp { Reg::Psp } else { Reg::Msp }, sp);
    let control = cpu.reg(Reg::Control) & CONTROL_NPRIV
        | if from_psp { CONTROL_SPSEL } else { 0 }
        | if fp { CONTROL_FPCA } else { 0 };
    cpu.set_mode(xpsr & !PADDED, control);
    cpu.clear_exclusive();
    cpu.set_reg(Reg::Pc, word(6) & !1);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::Stop;

    /// A processor with registers and a small RAM that executes nothing.
    struct TestCpu {
        r: [u32; 13],
        s: [u32; 32],
        lr: u32,
        pc: u32,
        xpsr: u32,
        msp: u32,
        psp: u32,
        control: u32,
        fpscr: u32,
        exclusive: bool,
        ram: Vec<u8>,
    }

    const RAM: u32 = 0x2000_0000;

    impl TestCpu {
        fn new() -> Self {
            TestCpu {
                r: std::array::from_fn(|n| 0x100 + n as u32),
                s: std::array::from_fn(|n| 0x5000 + n as u32),
                lr: 0x0800_0101,
                pc: 0x0800_0200,
                xpsr: XPSR_T | 0x6000_0000,
                msp: RAM + 0x800,
                psp: RAM + 0x404,
                control: 0,
                fpscr: 0x0300_0000,
                exclusive: true,
                ram: vec![0; 0x1000],
            }
        }

        fn using_psp(&self) -> bool {
            self.xpsr & XPSR_EXCEPTION == 0 && self.control & CONTROL_SPSEL != 0
        }
    }

    impl Cpu for TestCpu {
        fn reg(&self, reg: Reg) -> u32 {
            match reg {
                Reg::R(n) => self.r[usize::from(n)],
                Reg::Sp if self.using_psp() => self.psp,
                Reg::Sp | Reg::Msp => self.msp,
                Reg::Psp => self.psp,
                Reg::Lr => self.lr,
                Reg::Pc => self.pc,
                Reg::Xpsr => self.xpsr,
                Reg::Control => self.control,
                Reg::Fpscr => self.fpscr,
                Reg::S(n) => self.s[usize::from(n)],
                Reg::Primask | Reg::Faultmask | Reg::Basepri => 0,
            }
        }

        fn set_reg(&mut self, reg: Reg, value: u32) {
            match reg {
                Reg::R(n) => self.r[usize::from(n)] = value,
                Reg::Sp if self.using_psp() => self.psp = value,
                Reg::Sp | Reg::Msp => self.msp = value,
                Reg::Psp => self.psp = value,
                Reg::Lr => self.lr = value,
                Reg::Pc => self.pc = value,
                Reg::Fpscr => self.fpscr = value,
                Reg::S(n) => self.s[usize::from(n)] = value,
                Reg::Xpsr | Reg::Control => unreachable!("set_mode"),
                Reg::Primask | Reg::Faultmask | Reg::Basepri => {}
            }
        }

        fn set_mode(&mut self, xpsr: u32, control: u32) {
            (self.xpsr, self.control) = (xpsr, control);
        }

        fn clear_exclusive(&mut self) {
            self.exclusive = false;
        }

        fn read_memory(&self, addr: u32, into: &mut [u8]) -> bool {
            let Some(at) = addr.checked_sub(RAM).map(|at| at as usize) else { return false };
            let Some(from) = self.ram.get(at..at + into.len()) else { return false };
            into.copy_from_slice(from);
            true
        }

        fn write_ram(&mut self, addr: u32, bytes: &[u8]) -> bool {
            let Some(at) = addr.checked_sub(RAM).map(|at| at as usize) else { return false };
            let Some(to) = self.ram.get_mut(at..at + bytes.len()) else { return false };
            to.copy_from_slice(bytes);
            true
        }

        fn run(&mut self) -> Stop {
            Stop::Requested
        }
    }

    fn leave(cpu: &mut TestCpu, nvic: &mut Nvic) -> Result<(), ReturnFault> {
        let exc_return = cpu.lr;
        let number = check_return(cpu, nvic, exc_return)?;
        deactivate(cpu, nvic, number);
        unstack(cpu, exc_return)
    }

    #[test]
    fn entry_then_return_restores_everything() {
        for (control, exc_return) in
            [(0, 0xFFFF_FFF9u32), (CONTROL_SPSEL, 0xFFFF_FFFD), (CONTROL_FPCA, 0xFFFF_FFE9), (7, 0xFFFF_FFED)]
        {
            let (mut cpu, mut nvic) = (TestCpu::new(), Nvic::default());
            cpu.control = control;
            // In the middle of an IT block.
            cpu.xpsr |= 0x0200_0C00;
            let (xpsr, sp) = (cpu.xpsr, cpu.reg(Reg::Sp));
            enter(&mut cpu, &mut nvic, 20, 0x0800_1001, 0x0800_0200).unwrap();
            assert_eq!(cpu.lr, exc_return);
            assert_eq!(cpu.pc, 0x0800_1000);
            assert_eq!(cpu.exception(), 20);
            assert_eq!(cpu.xpsr & XPSR_IT, 0, "the handler starts outside any IT block");
            assert_eq!(cpu.control, control & CONTROL_NPRIV);
            assert!(!cpu.exclusive && nvic.is_active(20));
            let frame = cpu.reg(if control & CONTROL_SPSEL != 0 { Reg::Psp } else { Reg::Msp });
            assert_eq!(frame % 8, 0);
            assert_eq!(cpu.read_word(frame + 24), Some(0x0800_0200));

            cpu.r = [0; 13];
            cpu.s = [0; 32];
            cpu.fpscr = 0;
            leave(&mut cpu, &mut nvic).unwrap();
            assert_eq!((cpu.r[0], cpu.r[3], cpu.r[12], cpu.lr), (0x100, 0x103, 0x10C, 0x0800_0101));
            assert_eq!((cpu.xpsr, cpu.control, cpu.reg(Reg::Sp)), (xpsr, control, sp));
            assert_eq!(cpu.pc, 0x0800_0200);
            if control & CONTROL_FPCA != 0 {
                assert_eq!((cpu.s[0], cpu.s[15], cpu.s[16], cpu.fpscr), (0x5000, 0x500F, 0, 0x0300_0000));
            }
            assert_eq!(nvic.active_count(), 0);
        }
    }

    #[test]
    fn a_nested_exception_returns_to_the_handler() {
        let (mut cpu, mut nvic) = (TestCpu::new(), Nvic::default());
        enter(&mut cpu, &mut nvic, 20, 0x0800_1001, 0x0800_0200).unwrap();
        enter(&mut cpu, &mut nvic, 21, 0x0800_2001, 0x0800_1004).unwrap();
        assert_eq!(cpu.lr, 0xFFFF_FFF1);
        leave(&mut cpu, &mut nvic).unwrap();
        assert_eq!((cpu.exception(), cpu.pc), (20, 0x0800_1004));
        leave(&mut cpu, &mut nvic).unwrap();
        assert_eq!((cpu.exception(), cpu.pc), (0, 0x0800_0200));
    }

    #[test]
    fn a_frame_outside_ram_is_an_error_but_the_handler_starts() {
        let (mut cpu, mut nvic) = (TestCpu::new(), Nvic::default());
        cpu.msp = 0x1000_0010;
        let fault = enter(&mut cpu, &mut nvic, 20, 0x0800_1001, 0x0800_0200).unwrap_err();
        assert_eq!(fault.address, 0x0FFF_FFF0);
        assert_eq!(cpu.pc, 0x0800_1000);
        assert_eq!(unstack(&mut cpu, 0xFFFF_FFF9), Err(ReturnFault::Stack(fault)));
    }

    #[test]
    fn invalid_returns_are_refused() {
        let (mut cpu, mut nvic) = (TestCpu::new(), Nvic::default());
        assert_eq!(check_return(&cpu, &nvic, 0xFFFF_FFF9), Err(ReturnFault::Invalid), "no exception runs");
        enter(&mut cpu, &mut nvic, 20, 0x0800_1001, 0x0800_0200).unwrap();
        for wrong in [0xFFFF_FFF1, 0xFFFF_FFF5, 0xFFFF_FFE1, 0xFFFF_FFFF] {
            assert_eq!(check_return(&cpu, &nvic, wrong), Err(ReturnFault::Invalid), "{wrong:#x}");
        }
        assert_eq!(check_return(&cpu, &nvic, 0xFFFF_FFF9), Ok(20));
    }
}
