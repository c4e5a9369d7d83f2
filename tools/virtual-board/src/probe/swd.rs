//! Serial wire debug: the bits on the wire (ARM IHI 0031, ADIv5.2, chapter B4).
//!
//! The probe turns the wire around by itself, so that the bits here are those of request, acknowledgement and data alone.

use super::adi::{DebugBus, DebugPort, Fault};

/// Ones in a row that reset the line (B4.3.3).
const RESET_ONES: u32 = 50;
/// Acknowledgements, lowest bit first.
const OK: u64 = 0b001;
const FAULT: u64 = 0b100;
/// Bits of a request.
const REQUEST_BITS: u32 = 8;
/// Bits of a written word and its parity.
const DATA_BITS: u32 = 33;

/// A write whose data follow.
#[derive(Debug, Clone, Copy)]
struct Write {
    is_access_port: bool,
    address: u8,
}

/// The target's end of the wire.
#[derive(Debug, Clone, Default)]
pub(crate) struct Wire {
    ones: u32,
    /// After a reset of the line only a read of DPIDR is answered (B4.3.4).
    is_connected: bool,
    was_reset: bool,
    /// Bits of the request or of the data that came so far.
    bits: u64,
    count: u32,
    write: Option<Write>,
    /// Bits that the target drives, and how many.
    answer: u64,
    answer_bits: u32,
}

const fn parity(value: u32) -> bool {
    !value.count_ones().is_multiple_of(2)
}

impl Wire {
    /// The probe drives so many bits, lowest first.
    pub(crate) fn drive(&mut self, bits: u32, count: u32, port: &mut DebugPort, bus: &mut dyn DebugBus) {
        for n in 0..count.min(32) {
            self.drive_bit(bits >> n & 1 != 0, port, bus);
        }
    }

    /// The probe reads so many bits, at most 32. A wire that nobody drives is pulled up.
    pub(crate) fn read(&mut self, count: u32) -> u32 {
        let count = count.min(32);
        let mut bits = 0;
        for n in 0..count {
            let bit = if self.answer_bits > 0 { self.answer & 1 } else { 1 };
            bits |= (bit as u32) << n;
            self.answer >>= 1;
            self.answer_bits = self.answer_bits.saturating_sub(1);
        }
        bits
    }

    fn drive_bit(&mut self, bit: bool, port: &mut DebugPort, bus: &mut dyn DebugBus) {
        self.answer_bits = 0;
        self.ones = if bit { self.ones + 1 } else { 0 };
        if self.ones == RESET_ONES {
            *self = Wire { ones: self.ones, was_reset: true, ..Wire::default() };
        }
        if self.ones >= RESET_ONES {
            return;
        }
        // Idle bits are 0; a request starts with 1.
        if self.write.is_none() && self.count == 0 && !bit {
            return;
        }
        self.bits |= u64::from(bit) << self.count;
        self.count += 1;
        let expected = if self.write.is_some() { DATA_BITS } else { REQUEST_BITS };
        if self.count == expected {
            let bits = std::mem::take(&mut self.bits);
            self.count = 0;
            match self.write.take() {
                Some(write) => self.finish_write(write, bits, port, bus),
                None => self.take_request(bits as u8, port, bus),
            }
        }
    }

    fn take_request(&mut self, request: u8, port: &mut DebugPort, bus: &mut dyn DebugBus) {
        let bit = |n: u8| request >> n & 1 != 0;
        let body = request >> 1 & 0xF;
        // Start 1, stop 0, park 1. A request that is damaged is not answered.
        if bit(6) || !bit(7) || parity(body.into()) != bit(5) {
            self.is_connected = false;
            return;
        }
        let (is_access_port, is_read, address) = (bit(1), bit(2), request >> 1 & 0xC);
        if self.was_reset && is_read && !is_access_port && address == 0 {
            (self.was_reset, self.is_connected) = (false, true);
        }
        if !self.is_connected {
            return;
        }
        if is_access_port && port.refuses() {
            (self.answer, self.answer_bits) = (FAULT, 3);
            return;
        }
        if !is_read {
            (self.answer, self.answer_bits) = (OK, 3);
            self.write = Some(Write { is_access_port, address });
            return;
        }
        let value = if is_access_port {
            // A read is posted: it gives the result of the one before, and RDBUFF gives its own.
            let posted = port.read_dp(0xC);
            let (number, register) = port.selected(address);
            // An error is in CTRL/STAT, and in the next acknowledgement.
            let _: Result<u32, Fault> = port.read_ap(number, register, bus);
            posted
        } else {
            port.read_dp(address)
        };
        self.answer = OK | u64::from(value) << 3 | u64::from(parity(value)) << 35;
        self.answer_bits = 36;
    }

    fn finish_write(&mut self, write: Write, bits: u64, port: &mut DebugPort, bus: &mut dyn DebugBus) {
        let value = bits as u32;
        if parity(value) != (bits >> 32 & 1 != 0) {
            return;
        }
        if write.is_access_port {
            let (number, register) = port.selected(write.address);
            // As for a read.
            let _: Result<(), Fault> = port.write_ap(number, register, value, bus);
        } else {
            port.write_dp(write.address, value);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::adi::tests::{Memory, RAM, powered};
    use super::*;

    struct Line {
        wire: Wire,
        port: DebugPort,
        memory: Memory,
    }

    impl Line {
        fn new() -> Self {
            Line { wire: Wire::default(), port: powered(), memory: Memory::new() }
        }

        fn drive(&mut self, bits: u32, count: u32) {
            self.wire.drive(bits, count, &mut self.port, &mut self.memory);
        }

        /// At least 50 ones, then idle bits.
        fn reset(&mut self) {
            self.drive(u32::MAX, 32);
            self.drive(u32::MAX, 24);
            self.drive(0, 3);
        }

        fn request(is_access_port: bool, is_read: bool, address: u32) -> u32 {
            let body = u32::from(is_access_port) | u32::from(is_read) << 1 | address;
            1 | body << 1 | u32::from(parity(body)) << 5 | 1 << 7
        }

        /// Acknowledgement and word; `None`: the parity is wrong.
        fn read(&mut self, is_access_port: bool, address: u32) -> (u32, Option<u32>) {
            self.drive(Line::request(is_access_port, true, address), 8);
            let low = u64::from(self.wire.read(32));
            let all = low | u64::from(self.wire.read(4)) << 32;
            let word = (all >> 3) as u32;
            ((all & 7) as u32, (parity(word) == (all >> 35 & 1 != 0)).then_some(word))
        }

        fn write(&mut self, is_access_port: bool, address: u32, value: u32) -> u32 {
            self.drive(Line::request(is_access_port, false, address), 8);
            let acknowledgement = self.wire.read(3);
            if acknowledgement == 1 {
                self.drive(value, 32);
                self.drive(u32::from(parity(value)), 1);
            }
            acknowledgement
        }
    }

    #[test]
    fn the_request_for_dpidr_is_0xa5() {
        // B4.2.1, figure B4-2.
        assert_eq!(Line::request(false, true, 0), 0xA5);
        let mut line = Line::new();
        line.reset();
        assert_eq!(line.read(false, 0), (1, Some(0x2BA0_1477)));
    }

    #[test]
    fn a_reset_of_the_line_needs_a_read_of_dpidr() {
        let mut line = Line::new();
        assert_eq!(line.read(false, 0).0, 7, "nobody drives the wire");
        line.reset();
        assert_eq!(line.read(false, 4).0, 7);
        line.reset();
        assert_eq!(line.read(false, 0).0, 1);
        assert_eq!(line.read(false, 4), (1, Some(0xF000_0000)));
        // The switch sequence JTAG to SWD, between two resets.
        line.drive(u32::MAX, 32);
        line.drive(u32::MAX, 32);
        line.drive(0xE79E, 16);
        line.reset();
        assert_eq!(line.read(false, 0).0, 1);
    }

    #[test]
    fn reads_of_an_access_port_are_posted() {
        // B4.2.2.
        let mut line = Line::new();
        line.reset();
        line.read(false, 0);
        assert_eq!(line.write(false, 8, 0), 1);
        assert_eq!(line.write(true, 0, 0x12), 1);
        assert_eq!(line.write(true, 4, RAM), 1);
        line.read(true, 0xC);
        assert_eq!(line.read(true, 0xC), (1, Some(0x0302_0100)));
        assert_eq!(line.read(false, 0xC), (1, Some(0x0706_0504)));
    }

    #[test]
    fn an_error_is_a_fault_until_it_is_cleared() {
        let mut line = Line::new();
        line.reset();
        line.read(false, 0);
        line.write(true, 0, 0x12);
        line.write(true, 4, 0);
        assert_eq!(line.read(true, 0xC).0, 1, "posted");
        assert_eq!(line.read(true, 0xC).0, 4);
        assert_eq!(line.write(true, 4, RAM), 4);
        assert_eq!(line.write(false, 0, 1 << 2), 1);
        assert_eq!(line.write(true, 4, RAM), 1);
    }

    #[test]
    fn damaged_bits_have_no_effect() {
        let mut line = Line::new();
        line.reset();
        line.read(false, 0);
        // Data with a wrong parity.
        line.drive(Line::request(false, false, 8), 8);
        line.wire.read(3);
        line.drive(0x0100_0000, 32);
        line.drive(0, 1);
        assert_eq!(line.port.selected(0), (0, 0));
        // A request with a wrong parity: no answer, until a reset of the line.
        line.drive(0xA5 ^ 1 << 5, 8);
        assert_eq!(line.wire.read(3), 7);
        assert_eq!(line.read(false, 0).0, 7);
    }
}
