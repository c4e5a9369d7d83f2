//! The few semihosting calls that a self-test needs (Arm, Semihosting for AArch32 and AArch64): write a text, and exit with a status.

use crate::cpu::{Cpu, Reg};

const SYS_WRITE0: u32 = 0x04;
const SYS_EXIT: u32 = 0x18;
const SYS_EXIT_EXTENDED: u32 = 0x20;
/// The reason of a program that ended by itself.
const APPLICATION_EXIT: u32 = 0x2_0026;
/// Longest text, bytes.
const LONGEST: u32 = 4096;

/// What the program asked for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Answer {
    /// It has ended, with a status.
    Exit(u32),
    /// It writes a text.
    Text(String),
    /// Something else; R0 is now -1.
    Unknown(u32),
}

/// Answers the call in R0 with its argument in R1.
pub(crate) fn call(cpu: &mut impl Cpu) -> Answer {
    let (operation, argument) = (cpu.reg(Reg::R(0)), cpu.reg(Reg::R(1)));
    match operation {
        SYS_EXIT => Answer::Exit(u32::from(argument != APPLICATION_EXIT)),
        SYS_EXIT_EXTENDED => match (cpu.read_word(argument), cpu.read_word(argument.wrapping_add(4))) {
            (Some(APPLICATION_EXIT), Some(status)) => Answer::Exit(status),
            _ => Answer::Exit(1),
        },
        SYS_WRITE0 => {
            let bytes = (0..LONGEST).map_while(|n| {
                let mut byte = [0];
                (cpu.read_memory(argument.wrapping_add(n), &mut byte) && byte[0] != 0).then_some(byte[0])
            });
            Answer::Text(String::from_utf8_lossy(&bytes.collect::<Vec<u8>>()).into_owned())
        }
        other => {
            cpu.set_reg(Reg::R(0), u32::MAX);
            Answer::Unknown(other)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::Stop;

    struct Program {
        r: [u32; 2],
        memory: Vec<u8>,
    }

    impl Cpu for Program {
        fn reg(&self, reg: Reg) -> u32 {
            if let Reg::R(n) = reg { self.r[usize::from(n)] } else { 0 }
        }
        fn set_reg(&mut self, reg: Reg, value: u32) {
            if let Reg::R(n) = reg {
                self.r[usize::from(n)] = value;
            }
        }
        fn set_mode(&mut self, _: u32, _: u32) {}
        fn clear_exclusive(&mut self) {}
        fn read_memory(&self, addr: u32, into: &mut [u8]) -> bool {
            self.memory.get(addr as usize..addr as usize + into.len()).map(|from| into.copy_from_slice(from)).is_some()
        }
        fn write_ram(&mut self, _: u32, _: &[u8]) -> bool {
            false
        }
        fn run(&mut self) -> Stop {
            Stop::Requested
        }
    }

    fn answer(operation: u32, argument: u32, memory: &[u8]) -> Answer {
        call(&mut Program { r: [operation, argument], memory: memory.to_vec() })
    }

    #[test]
    fn a_program_ends_with_its_status() {
        assert_eq!(answer(0x18, 0x2_0026, &[]), Answer::Exit(0));
        assert_eq!(answer(0x18, 0x2_0023, &[]), Answer::Exit(1));
        let block = [0x26, 0, 2, 0, 9, 0, 0, 0];
        assert_eq!(answer(0x20, 0, &block), Answer::Exit(9));
        assert_eq!(answer(0x20, 4, &block), Answer::Exit(1), "half of the block lies outside of memory");
    }

    #[test]
    fn a_text_ends_at_its_nul() {
        assert_eq!(answer(0x04, 1, b"xhello\0y"), Answer::Text("hello".into()));
        assert_eq!(answer(0x04, 0, b"no end"), Answer::Text("no end".into()));
    }

    #[test]
    fn other_operations_fail() {
        let mut program = Program { r: [0x01, 0], memory: vec![] };
        assert_eq!(call(&mut program), Answer::Unknown(1));
        assert_eq!(program.r[0], u32::MAX);
    }
}
