//! RTT reader, as in a debugger: finds the control block in RAM and reads the bytes that the program wrote to up channel 0.
//!
//! Layout (SEGGER RTT, as defmt-rtt writes it): 16 bytes `SEGGER RTT`, number of up and of down channels, then 24 bytes for each
//! channel: name, buffer, size, write offset, read offset, flags. Bits 0 and 1 of the flags select the mode for a full buffer:
//! 0 drop the message, 1 write what fits, 2 wait for the reader.

use crate::cpu::Cpu;

const MAGIC: &[u8; 16] = b"SEGGER RTT\0\0\0\0\0\0";
const CHANNEL: u32 = 24;
const SIZE: u32 = 8;
const WRITE: u32 = 12;
const READ: u32 = 16;
const FLAGS: u32 = 20;

/// Reader of up channel 0 of one control block.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rtt {
    /// Address of `_SEGGER_RTT`.
    pub(crate) address: u32,
    /// Mode that the attached debugger sets; `None`: as the program set it.
    pub(crate) mode: Option<u32>,
    /// How much of it the debugger reads.
    pub(crate) reading: RttReading,
}

/// How much of the buffer a debugger reads at a time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RttReading {
    /// All.
    All,
    /// One byte.
    Byte,
    /// Nothing: it is attached but does not read.
    Nothing,
}

impl RttReading {
    /// All or nothing.
    pub(crate) const fn new(drains: bool) -> Self {
        if drains { RttReading::All } else { RttReading::Nothing }
    }
}

impl Rtt {
    /// Sets the mode and reads the bytes written since the last call: none before the program has initialised the control block, or if its
    /// fields are invalid.
    pub(crate) fn poll(&self, cpu: &mut impl Cpu) -> Vec<u8> {
        let mut magic = [0; 16];
        if !cpu.read_memory(self.address, &mut magic) || &magic != MAGIC {
            return Vec::new();
        }
        let channel = self.address + CHANNEL;
        let mut descriptor = [0; 24];
        if !cpu.read_memory(channel, &mut descriptor) {
            return Vec::new();
        }
        let field = |offset: u32| {
            let at = offset as usize;
            u32::from_le_bytes([descriptor[at], descriptor[at + 1], descriptor[at + 2], descriptor[at + 3]])
        };
        let flags = field(FLAGS);
        if let Some(mode) = self.mode
            && flags & 3 != mode
        {
            cpu.write_ram(channel + FLAGS, &(flags & !3 | mode).to_le_bytes());
        }
        if self.reading == RttReading::Nothing {
            return Vec::new();
        }
        let (buffer, size, write, read) = (field(4), field(SIZE), field(WRITE), field(READ));
        if size > 0x1_0000 || write >= size || read >= size || write == read {
            return Vec::new();
        }
        let mut bytes = vec![0; size as usize];
        if !cpu.read_memory(buffer, &mut bytes) {
            return Vec::new();
        }
        let until = if self.reading == RttReading::Byte { (read + 1) % size } else { write };
        cpu.write_ram(channel + READ, &until.to_le_bytes());
        let (write, read) = (until as usize, read as usize);
        if write > read { bytes[read..write].to_vec() } else { [&bytes[read..], &bytes[..write]].concat() }
    }

    /// Empties the buffer, at a reset. The start-up code writes the fields word by word: a read between two of them would find bytes of the run before.
    pub(crate) fn forget(&self, cpu: &mut impl Cpu) {
        let mut magic = [0; 16];
        if self.reading != RttReading::Nothing && cpu.read_memory(self.address, &mut magic) && &magic == MAGIC {
            for offset in [WRITE, READ] {
                cpu.write_ram(self.address + CHANNEL + offset, &[0; 4]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::{Reg, Stop};

    struct Ram(Vec<u8>);

    impl Cpu for Ram {
        fn reg(&self, _: Reg) -> u32 {
            0
        }
        fn set_reg(&mut self, _: Reg, _: u32) {}
        fn set_mode(&mut self, _: u32, _: u32) {}
        fn clear_exclusive(&mut self) {}
        fn read_memory(&self, addr: u32, into: &mut [u8]) -> bool {
            self.0.get(addr as usize..addr as usize + into.len()).map(|from| into.copy_from_slice(from)).is_some()
        }
        fn write_ram(&mut self, addr: u32, bytes: &[u8]) -> bool {
            self.0.get_mut(addr as usize..addr as usize + bytes.len()).map(|to| to.copy_from_slice(bytes)).is_some()
        }
        fn run(&mut self) -> Stop {
            Stop::Requested
        }
    }

    /// A control block at 16 with an 8 byte buffer at 128 that holds `abcdefgh`.
    fn ram(write: u32, read: u32) -> Ram {
        let mut ram = Ram(vec![0; 256]);
        ram.write_ram(16, MAGIC);
        for (offset, word) in [(16, 1), (20, 0), (24, 0), (28, 128), (32, 8), (36, write), (40, read), (44, 1)] {
            ram.write_ram(16 + offset, &u32::to_le_bytes(word));
        }
        ram.write_ram(128, b"abcdefgh");
        ram
    }

    #[test]
    fn reads_each_byte_once_and_across_the_buffer_end() {
        let rtt = Rtt { address: 16, mode: None, reading: RttReading::All };
        for (write, read, text) in [(3, 0, "abc"), (2, 6, "ghab"), (0, 6, "gh"), (5, 5, "")] {
            let mut ram = ram(write, read);
            assert_eq!(rtt.poll(&mut ram), text.as_bytes(), "write {write} read {read}");
            assert_eq!(rtt.poll(&mut ram), b"");
            assert_eq!(ram.read_word(16 + 40), Some(write));
        }
    }

    #[test]
    fn sets_the_mode_and_keeps_the_bytes_if_not_draining() {
        let rtt = Rtt { address: 16, mode: Some(2), reading: RttReading::Nothing };
        let mut ram = ram(3, 0);
        assert_eq!(rtt.poll(&mut ram), b"");
        assert_eq!(ram.read_word(16 + 44), Some(2));
        assert_eq!(ram.read_word(16 + 40), Some(0));
    }

    #[test]
    fn a_slow_reader_takes_a_byte_at_a_time() {
        let rtt = Rtt { address: 16, mode: None, reading: RttReading::Byte };
        let mut ram = ram(1, 6);
        let read: Vec<Vec<u8>> = (0..4).map(|_| rtt.poll(&mut ram)).collect();
        assert_eq!(read, [&b"g"[..], b"h", b"a", b""]);
    }

    #[test]
    fn a_read_while_the_program_initialises_the_block_again_finds_nothing_old() {
        let rtt = Rtt { address: 16, mode: None, reading: RttReading::All };
        let mut ram = ram(5, 2);
        assert_eq!(rtt.poll(&mut ram), b"cde");
        rtt.forget(&mut ram);
        // Of its fields the program has written the first one.
        ram.write_ram(16 + 36, &[0; 4]);
        assert_eq!(rtt.poll(&mut ram), b"");
    }

    #[test]
    fn an_invalid_control_block_gives_no_bytes() {
        let rtt = Rtt { address: 16, mode: None, reading: RttReading::All };
        assert_eq!(rtt.poll(&mut ram(8, 0)), b"", "offset beyond the buffer");
        assert_eq!(rtt.poll(&mut Ram(vec![0; 256])), b"", "before the program has initialised it");
        assert_eq!(rtt.poll(&mut Ram(vec![0; 4])), b"", "outside of memory");
    }
}
