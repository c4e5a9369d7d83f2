//! Semihosting calls for self-tests: write a text, exit with a status (Arm, Semihosting for AArch32 and AArch64).

use crate::cpu::{Cpu, Reg};

const SYS_WRITE0: u32 = 0x04;
const SYS_EXIT: u32 = 0x18;
const SYS_EXIT_EXTENDED: u32 = 0x20;
/// Exit reason of a program that ended by itself.
const APPLICATION_EXIT: u32 = 0x2_0026;
/// Longest text, bytes.
const LONGEST: u32 = 4096;

/// Request of the program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum SemihostingRequest {
    /// Exit with a status.
    Exit(u32),
    /// Write a text.
    Text(String),
    /// Another operation; R0 is set to -1.
    Unknown(u32),
}

/// Serves the call with its operation in R0 and its argument in R1.
pub(crate) fn serve(cpu: &mut impl Cpu) -> SemihostingRequest {
    let (operation, argument) = (cpu.reg(Reg::R(0)), cpu.reg(Reg::R(1)));
    match operation {
        SYS_EXIT => SemihostingRequest::Exit(u32::from(argument != APPLICATION_EXIT)),
        SYS_EXIT_EXTENDED => match (cpu.read_word(argument), cpu.read_word(argument.wrapping_add(4))) {
            (Some(APPLICATION_EXIT), Some(status)) => SemihostingRequest::Exit(status),
            _ => SemihostingRequest::Exit(1),
        },
        SYS_WRITE0 => {
            let bytes = (0..LONGEST).map_while(|n| {
                let mut byte = [0];
                (cpu.read_memory(argument.wrapping_add(n), &mut byte) && byte[0] != 0).then_some(byte[0])
            });
            SemihostingRequest::Text(String::from_utf8_lossy(&bytes.collect::<Vec<u8>>()).into_owned())
        }
        other => {
            cpu.set_reg(Reg::R(0), u32::MAX);
            SemihostingRequest::Unknown(other)
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

    fn request(operation: u32, argument: u32, memory: &[u8]) -> SemihostingRequest {
        serve(&mut Program { r: [operation, argument], memory: memory.to_vec() })
    }

    #[test]
    fn a_program_ends_with_its_status() {
        assert_eq!(request(0x18, 0x2_0026, &[]), SemihostingRequest::Exit(0));
        assert_eq!(request(0x18, 0x2_0023, &[]), SemihostingRequest::Exit(1));
        let block = [0x26, 0, 2, 0, 9, 0, 0, 0];
        assert_eq!(request(0x20, 0, &block), SemihostingRequest::Exit(9));
        assert_eq!(request(0x20, 4, &block), SemihostingRequest::Exit(1), "half of the block lies outside of memory");
    }

    #[test]
    fn a_text_ends_at_its_nul() {
        assert_eq!(request(0x04, 1, b"xhello\0y"), SemihostingRequest::Text("hello".into()));
        assert_eq!(request(0x04, 0, b"no end"), SemihostingRequest::Text("no end".into()));
    }

    #[test]
    fn other_operations_fail() {
        let mut program = Program { r: [0x01, 0], memory: vec![] };
        assert_eq!(serve(&mut program), SemihostingRequest::Unknown(1));
        assert_eq!(program.r[0], u32::MAX);
    }
}
