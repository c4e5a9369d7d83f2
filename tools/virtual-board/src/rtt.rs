//! RTT reader, as in a debugger: finds the control block in RAM, reads the bytes that the program wrote to its up channels, and writes to a down channel.
//!
//! Layout (SEGGER RTT): 16 bytes `SEGGER RTT`, number of up and of down channels, then 24 bytes for each up and for each down channel: name, buffer,
//! size, write offset, read offset, flags. Bits 0 and 1 of the flags select the mode for a full buffer: 0 drop the message, 1 write what fits, 2 wait
//! for the reader.

use crate::cpu::Cpu;

const MAGIC: &[u8; 16] = b"SEGGER RTT\0\0\0\0\0\0";
/// Offset of the number of up channels, and of the first channel; bytes of one.
const COUNTS: u32 = 16;
const CHANNELS: u32 = 24;
const CHANNEL: u32 = 24;
const SIZE: u32 = 8;
const WRITE: u32 = 12;
const READ: u32 = 16;
const FLAGS: u32 = 20;
/// Most channels of a direction that are looked at.
const MOST_CHANNELS: u32 = 16;

/// Reader of one control block.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rtt {
    /// Address of `_SEGGER_RTT`.
    pub(crate) address: u32,
    /// Mode that the attached debugger sets in every up channel; `None`: as the program set it.
    pub(crate) mode: Option<u32>,
    /// How much of it the debugger reads.
    pub(crate) reading: RttReading,
}

/// How much of the buffers a debugger reads at a time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RttReading {
    /// All.
    All,
    /// One byte of each channel.
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

/// A channel, as its fields are at the moment.
#[derive(Debug, Clone, Copy)]
struct Channel {
    /// Address of the fields.
    at: u32,
    buffer: u32,
    size: u32,
    write: u32,
    read: u32,
    flags: u32,
}

impl Rtt {
    /// The numbers of up and of down channels; none before the program has initialised the control block.
    fn counts(&self, cpu: &impl Cpu) -> Option<[u32; 2]> {
        let mut magic = [0; 16];
        if !cpu.read_memory(self.address, &mut magic) || &magic != MAGIC {
            return None;
        }
        let count = |offset| Some(cpu.read_word(self.address + COUNTS + offset)?.min(MOST_CHANNELS));
        Some([count(0)?, count(4)?])
    }

    /// A channel by its place in the control block.
    fn channel(&self, cpu: &impl Cpu, place: u32) -> Option<Channel> {
        let at = self.address + CHANNELS + place * CHANNEL;
        let word = |offset| cpu.read_word(at + offset);
        let channel = Channel {
            at,
            buffer: word(4)?,
            size: word(SIZE)?,
            write: word(WRITE)?,
            read: word(READ)?,
            flags: word(FLAGS)?,
        };
        let Channel { size, write, read, .. } = channel;
        (size <= 0x1_0000 && write < size && read < size).then_some(channel)
    }

    /// Sets the mode and reads the bytes written since the last call, with the number of their channel: none before the program has initialised the
    /// control block, or if its fields are invalid.
    pub(crate) fn poll(&self, cpu: &mut impl Cpu) -> Vec<(u8, Vec<u8>)> {
        let mut all = Vec::new();
        let Some([up, _]) = self.counts(cpu) else { return all };
        for number in 0..up {
            let Some(channel) = self.channel(cpu, number) else { continue };
            let Channel { at, buffer, size, write, read, flags } = channel;
            if let Some(mode) = self.mode
                && flags & 3 != mode
            {
                cpu.write_ram(at + FLAGS, &(flags & !3 | mode).to_le_bytes());
            }
            let mut bytes = vec![0; size as usize];
            if self.reading == RttReading::Nothing || write == read || !cpu.read_memory(buffer, &mut bytes) {
                continue;
            }
            let until = if self.reading == RttReading::Byte { (read + 1) % size } else { write };
            cpu.write_ram(at + READ, &until.to_le_bytes());
            let (write, read) = (until as usize, read as usize);
            let bytes =
                if write > read { bytes[read..write].to_vec() } else { [&bytes[read..], &bytes[..write]].concat() };
            all.push((number as u8, bytes));
        }
        all
    }

    /// Writes to a down channel what it has space for; how many bytes it took.
    pub(crate) fn write(&self, cpu: &mut impl Cpu, number: u32, bytes: &[u8]) -> usize {
        let channel = self.counts(cpu).filter(|[_, down]| number < *down);
        let Some(Channel { at, buffer, size, write, read, .. }) =
            channel.and_then(|[up, _]| self.channel(cpu, up + number))
        else {
            return 0;
        };
        let free = (read + size - write - 1) % size;
        let bytes = &bytes[..bytes.len().min(free as usize)];
        for (place, byte) in (write..).zip(bytes) {
            cpu.write_ram(buffer + place % size, &[*byte]);
        }
        cpu.write_ram(at + WRITE, &((write + bytes.len() as u32) % size).to_le_bytes());
        bytes.len()
    }

    /// Empties the buffers, at a reset. The start-up code writes the fields word by word: a read between two of them would find bytes of the run before.
    pub(crate) fn forget(&self, cpu: &mut impl Cpu) {
        if self.reading == RttReading::Nothing {
            return;
        }
        let Some([up, down]) = self.counts(cpu) else { return };
        for place in 0..up + down {
            for offset in [WRITE, READ] {
                cpu.write_ram(self.address + CHANNELS + place * CHANNEL + offset, &[0; 4]);
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

    /// A control block at 16 with an up channel, whose 8 bytes at 160 hold `abcdefgh`, another one with 4 bytes at 176, and a down channel with 8 bytes at 184.
    fn ram(write: u32, read: u32) -> Ram {
        let mut ram = Ram(vec![0; 256]);
        ram.write_ram(16, MAGIC);
        let channels = [[0, 160, 8, write, read, 1], [0, 176, 4, 0, 0, 0], [0, 184, 8, 6, 6, 0]];
        for (place, word) in [2, 1].into_iter().chain(channels.into_iter().flatten()).enumerate() {
            ram.write_ram(32 + 4 * place as u32, &u32::to_le_bytes(word));
        }
        ram.write_ram(160, b"abcdefgh");
        ram
    }

    /// What a poll reads of the first channel; the second one is empty.
    fn first(rtt: &Rtt, ram: &mut Ram) -> Vec<u8> {
        let mut read = rtt.poll(ram);
        assert!(read.len() <= 1 && read.iter().all(|(number, _)| *number == 0));
        read.pop().map_or(Vec::new(), |(_, bytes)| bytes)
    }

    #[test]
    fn reads_each_byte_once_and_across_the_buffer_end() {
        let rtt = Rtt { address: 16, mode: None, reading: RttReading::All };
        for (write, read, text) in [(3, 0, "abc"), (2, 6, "ghab"), (0, 6, "gh"), (5, 5, "")] {
            let mut ram = ram(write, read);
            assert_eq!(first(&rtt, &mut ram), text.as_bytes(), "write {write} read {read}");
            assert_eq!(first(&rtt, &mut ram), b"");
            assert_eq!(ram.read_word(16 + 40), Some(write));
        }
    }

    #[test]
    fn sets_the_mode_and_keeps_the_bytes_if_not_draining() {
        let rtt = Rtt { address: 16, mode: Some(2), reading: RttReading::Nothing };
        let mut ram = ram(3, 0);
        assert_eq!(first(&rtt, &mut ram), b"");
        assert_eq!((ram.read_word(16 + 44), ram.read_word(16 + 68)), (Some(2), Some(2)));
        assert_eq!(ram.read_word(16 + 40), Some(0));
    }

    #[test]
    fn every_up_channel_is_read_and_a_down_channel_takes_what_fits() {
        let rtt = Rtt { address: 16, mode: None, reading: RttReading::All };
        let mut ram = ram(3, 0);
        ram.write_ram(176, b"wire");
        ram.write_ram(16 + 60, &2_u32.to_le_bytes());
        assert_eq!(rtt.poll(&mut ram), [(0, b"abc".to_vec()), (1, b"wi".to_vec())]);
        assert_eq!(rtt.write(&mut ram, 0, b"12345"), 5);
        assert_eq!((&ram.0[184..187], &ram.0[190..192], ram.read_word(16 + 84)), (&b"345"[..], &b"12"[..], Some(3)));
        // One byte stays free: equal offsets are an empty channel.
        assert_eq!((rtt.write(&mut ram, 0, b"6789"), rtt.write(&mut ram, 0, b"9")), (2, 0));
        assert_eq!(rtt.write(&mut ram, 1, b"6"), 0, "there is no such channel");
    }

    #[test]
    fn a_slow_reader_takes_a_byte_at_a_time() {
        let rtt = Rtt { address: 16, mode: None, reading: RttReading::Byte };
        let mut ram = ram(1, 6);
        let read: Vec<Vec<u8>> = (0..4).map(|_| first(&rtt, &mut ram)).collect();
        assert_eq!(read, [&b"g"[..], b"h", b"a", b""]);
    }

    #[test]
    fn a_read_while_the_program_initialises_the_block_again_finds_nothing_old() {
        let rtt = Rtt { address: 16, mode: None, reading: RttReading::All };
        let mut ram = ram(5, 2);
        assert_eq!(first(&rtt, &mut ram), b"cde");
        rtt.forget(&mut ram);
        // Of its fields the program has written the first one.
        ram.write_ram(16 + 36, &[0; 4]);
        assert_eq!(first(&rtt, &mut ram), b"");
    }

    #[test]
    fn an_invalid_control_block_gives_no_bytes() {
        let rtt = Rtt { address: 16, mode: None, reading: RttReading::All };
        assert_eq!(first(&rtt, &mut ram(8, 0)), b"", "offset beyond the buffer");
        assert_eq!(first(&rtt, &mut Ram(vec![0; 256])), b"", "before the program has initialised it");
        assert_eq!(first(&rtt, &mut Ram(vec![0; 4])), b"", "outside of memory");
    }
}
