//! Debug port and AHB access port (ARM IHI 0031, ADIv5.2, chapters B2, C2; Cortex-M4 TRM, chapter 8; RM0090 38.8).

use stm32f4_model::Width;

/// The bus of the chip as its debug access port uses it.
pub(crate) trait DebugBus {
    /// Reads; `None`: a bus fault.
    fn load(&mut self, addr: u32, width: Width) -> Option<u32>;

    /// Writes; false: a bus fault.
    fn store(&mut self, addr: u32, width: Width, value: u32) -> bool;

    /// Pulls the reset pin low, or releases it.
    fn pull_reset_pin(&mut self, low: bool);
}

/// Answer to an access that has no value: a sticky error is set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Fault;

/// DPIDR of an SW-DP version 1 by Arm (RM0090 38.8.3).
const DPIDR: u32 = 0x2BA0_1477;
/// IDR of the AHB-AP of a Cortex-M4.
const AHB_AP_IDR: u32 = 0x2477_0011;
/// BASE: the ROM table, present.
const BASE: u32 = super::core::ROM_TABLE | 3;

// CTRL/STAT.
const STICKYORUN: u32 = 1 << 1;
const STICKYCMP: u32 = 1 << 4;
const STICKYERR: u32 = 1 << 5;
const READOK: u32 = 1 << 6;
const WDATAERR: u32 = 1 << 7;
const CTRL_WRITABLE: u32 = 0x54FF_FF0D;
const POWER_UP_REQUESTS: u32 = 1 << 28 | 1 << 30;
const RESET_REQUEST: u32 = 1 << 26;

// CSW.
const CSW_RESET: u32 = 0x4380_0042;
const CSW_WRITABLE: u32 = 0x7F00_0F37;
const DEVICE_ENABLE: u32 = 1 << 6;
const SINGLE: u32 = 1;
const PACKED: u32 = 2;

/// Registers of the debug port, and of access port 0.
#[derive(Debug, Clone)]
pub(crate) struct DebugPort {
    ctrl: u32,
    /// The sticky flags of CTRL/STAT.
    sticky: u32,
    select: u32,
    /// Result of the last read of an access port.
    read_buffer: u32,
    csw: u32,
    tar: u32,
}

impl Default for DebugPort {
    fn default() -> Self {
        DebugPort { ctrl: 0, sticky: 0, select: 0, read_buffer: 0, csw: CSW_RESET, tar: 0 }
    }
}

impl DebugPort {
    /// Reads a register of the debug port: its address 0, 4, 8 or 12.
    pub(crate) fn read_dp(&self, address: u8) -> u32 {
        match address & 0xC {
            0x0 => DPIDR,
            // DPBANKSEL 1 is DLCR: its turnaround is one period.
            0x4 if self.select & 0xF == 1 => 0x40,
            // The acknowledgements follow the requests at once.
            0x4 => self.ctrl | (self.ctrl & (POWER_UP_REQUESTS | RESET_REQUEST)) << 1 | self.sticky,
            // RESEND and RDBUFF: the last result.
            _ => self.read_buffer,
        }
    }

    /// Writes a register of the debug port.
    pub(crate) fn write_dp(&mut self, address: u8, value: u32) {
        match address & 0xC {
            // ABORT: STKCMPCLR, STKERRCLR, WDERRCLR, ORUNERRCLR.
            0x0 => {
                for (bit, flag) in [(1, STICKYCMP), (2, STICKYERR), (3, WDATAERR), (4, STICKYORUN)] {
                    if value >> bit & 1 != 0 {
                        self.sticky &= !flag;
                    }
                }
            }
            0x4 if self.select & 0xF == 0 => self.ctrl = value & CTRL_WRITABLE,
            0x8 => self.select = value,
            _ => {}
        }
    }

    /// True if an access port gives no access: after an error that was not cleared, or without power.
    pub(crate) const fn refuses(&self) -> bool {
        self.sticky & (STICKYERR | STICKYORUN | STICKYCMP | WDATAERR) != 0
            || self.ctrl & POWER_UP_REQUESTS != POWER_UP_REQUESTS
    }

    /// Access port and bank of SELECT, with the low address bits of an access: as number and register.
    pub(crate) const fn selected(&self, address: u8) -> (u8, u8) {
        ((self.select >> 24) as u8, self.select as u8 & 0xF0 | address & 0xC)
    }

    /// Reads a register of an access port.
    ///
    /// # Errors
    /// The access failed, now or before.
    pub(crate) fn read_ap(&mut self, port: u8, register: u8, bus: &mut dyn DebugBus) -> Result<u32, Fault> {
        if self.refuses() {
            return Err(Fault);
        }
        let value = match (port, register & 0xFC) {
            (0, 0x00) => self.csw | DEVICE_ENABLE,
            (0, 0x04) => self.tar,
            (0, 0x0C) => self.transfer(None, bus)?,
            (0, register @ 0x10..=0x1C) => {
                let address = self.tar & !0xF | u32::from(register & 0xC);
                self.checked(bus.load(address, Width::Word))?
            }
            (0, 0xF8) => BASE,
            (0, 0xFC) => AHB_AP_IDR,
            // CFG and the other registers are 0, and so is an access port that the chip does not have.
            _ => 0,
        };
        self.read_buffer = value;
        self.sticky |= READOK;
        Ok(value)
    }

    /// Writes a register of an access port.
    ///
    /// # Errors
    /// The access failed, now or before.
    pub(crate) fn write_ap(&mut self, port: u8, register: u8, value: u32, bus: &mut dyn DebugBus) -> Result<(), Fault> {
        if self.refuses() {
            return Err(Fault);
        }
        match (port, register & 0xFC) {
            (0, 0x00) => self.csw = value & CSW_WRITABLE,
            (0, 0x04) => self.tar = value,
            (0, 0x0C) => drop(self.transfer(Some(value), bus)?),
            (0, register @ 0x10..=0x1C) => {
                let address = self.tar & !0xF | u32::from(register & 0xC);
                self.checked(bus.store(address, Width::Word, value).then_some(0))?;
            }
            _ => {}
        }
        Ok(())
    }

    fn checked(&mut self, result: Option<u32>) -> Result<u32, Fault> {
        if result.is_none() {
            self.sticky |= STICKYERR;
        }
        result.ok_or(Fault)
    }

    /// Reads or writes by DRW: one access of the size of CSW, or several that are packed into the word. The data are on the byte lanes of their
    /// address.
    fn transfer(&mut self, written: Option<u32>, bus: &mut dyn DebugBus) -> Result<u32, Fault> {
        let width = match self.csw & 7 {
            0 => Width::Byte,
            1 => Width::Half,
            _ => Width::Word,
        };
        let increment = self.csw >> 4 & 3;
        let accesses = if increment == PACKED { 4 / width.bytes() } else { 1 };
        let mut word = 0;
        for _ in 0..accesses {
            let shift = 8 * (self.tar & 3 & !(width.bytes() - 1));
            let result = match written {
                Some(value) => bus.store(self.tar, width, value >> shift & width.mask()).then_some(0),
                None => bus.load(self.tar, width),
            };
            word |= self.checked(result)? << shift;
            if increment == SINGLE || increment == PACKED {
                // C2.2.2: the increment is guaranteed on the ten low bits only.
                self.tar = self.tar & !0x3FF | self.tar.wrapping_add(width.bytes()) & 0x3FF;
            }
        }
        Ok(word)
    }

    /// Reads bytes with the widest accesses that address and length allow, as a probe does for its host.
    ///
    /// # Errors
    /// An access failed. The error is not sticky: the probe clears it.
    pub(crate) fn read_memory(
        &mut self,
        address: u32,
        length: usize,
        bus: &mut dyn DebugBus,
    ) -> Result<Vec<u8>, Fault> {
        if self.refuses() {
            return Err(Fault);
        }
        let width = match (address | length as u32) & 3 {
            0 => Width::Word,
            2 => Width::Half,
            _ => Width::Byte,
        };
        let mut bytes = Vec::with_capacity(length);
        let mut at = address;
        while bytes.len() < length {
            let value = bus.load(at, width).ok_or(Fault)?;
            bytes.extend(&value.to_le_bytes()[..width.bytes() as usize]);
            at = at.wrapping_add(width.bytes());
        }
        Ok(bytes)
    }

    /// Writes bytes, a multiple of `width`, with accesses of that width.
    ///
    /// # Errors
    /// An access failed. The error is not sticky: the probe clears it.
    pub(crate) fn write_memory(
        &mut self,
        address: u32,
        width: Width,
        bytes: &[u8],
        bus: &mut dyn DebugBus,
    ) -> Result<(), Fault> {
        if self.refuses() {
            return Err(Fault);
        }
        for (n, item) in bytes.chunks_exact(width.bytes() as usize).enumerate() {
            let mut word = [0; 4];
            word[..item.len()].copy_from_slice(item);
            let at = address.wrapping_add(n as u32 * width.bytes());
            bus.store(at, width, u32::from_le_bytes(word)).then_some(()).ok_or(Fault)?;
        }
        Ok(())
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// 64 bytes of memory at 0x2000_0000, and what was written to the reset pin.
    #[derive(Default)]
    pub(in super::super) struct Memory {
        pub(in super::super) bytes: Vec<u8>,
        pub(in super::super) accesses: Vec<(u32, Width, Option<u32>)>,
        pub(in super::super) reset_pin: Vec<bool>,
    }

    pub(in super::super) const RAM: u32 = 0x2000_0000;

    impl Memory {
        pub(in super::super) fn new() -> Self {
            Memory { bytes: (0..64).collect(), ..Memory::default() }
        }
    }

    impl DebugBus for Memory {
        fn load(&mut self, addr: u32, width: Width) -> Option<u32> {
            let at = addr.checked_sub(RAM)? as usize;
            let from = self.bytes.get(at..at + width.bytes() as usize)?;
            self.accesses.push((addr, width, None));
            Some(from.iter().rev().fold(0, |word, byte| word << 8 | u32::from(*byte)))
        }

        fn store(&mut self, addr: u32, width: Width, value: u32) -> bool {
            let Some(at) = addr.checked_sub(RAM).map(|at| at as usize) else { return false };
            let length = width.bytes() as usize;
            let Some(to) = self.bytes.get_mut(at..at + length) else { return false };
            to.copy_from_slice(&value.to_le_bytes()[..length]);
            self.accesses.push((addr, width, Some(value)));
            true
        }

        fn pull_reset_pin(&mut self, low: bool) {
            self.reset_pin.push(low);
        }
    }

    pub(in super::super) fn powered() -> DebugPort {
        let mut port = DebugPort::default();
        port.write_dp(4, POWER_UP_REQUESTS);
        port
    }

    #[test]
    fn power_up_is_acknowledged() {
        // B2.2.2: CDBGPWRUPACK, CSYSPWRUPACK; without power an access port refuses.
        let mut port = DebugPort::default();
        assert_eq!((port.read_dp(0), port.read_dp(4)), (DPIDR, 0));
        assert_eq!(port.read_ap(0, 0xFC, &mut Memory::new()), Err(Fault));
        port.write_dp(4, POWER_UP_REQUESTS);
        assert_eq!(port.read_dp(4), 0xF000_0000);
        assert_eq!(port.read_ap(0, 0xFC, &mut Memory::new()), Ok(AHB_AP_IDR));
        assert_eq!(port.read_ap(1, 0xFC, &mut Memory::new()), Ok(0), "no other access port");
        assert_eq!(port.read_ap(0, 0xF8, &mut Memory::new()), Ok(0xE00F_F003));
        port.write_dp(8, 0x0100_00F0);
        assert_eq!(port.selected(0xC), (1, 0xFC));
    }

    #[test]
    fn data_are_on_the_byte_lanes_of_their_address() {
        // C2.2.6.
        let (mut port, mut memory) = (powered(), Memory::new());
        let mut read = |csw: u32, tar: u32| {
            port.write_ap(0, 0, csw, &mut memory).unwrap();
            port.write_ap(0, 4, tar, &mut memory).unwrap();
            let value = port.read_ap(0, 0xC, &mut memory).unwrap();
            (value, port.read_ap(0, 4, &mut memory).unwrap() - RAM)
        };
        assert_eq!(read(2, RAM + 4), (0x0706_0504, 4), "no increment");
        assert_eq!(read(0x12, RAM + 4), (0x0706_0504, 8));
        assert_eq!(read(0x10, RAM + 5), (0x0000_0500, 6), "a byte");
        assert_eq!(read(0x11, RAM + 6), (0x0706_0000, 8), "a half-word");
        assert_eq!(read(0x20, RAM + 8), (0x0B0A_0908, 12), "four bytes, packed");
        port.write_ap(0, 0, 0x10, &mut memory).unwrap();
        port.write_ap(0, 4, RAM + 1, &mut memory).unwrap();
        port.write_ap(0, 0xC, 0x1234_AB78, &mut memory).unwrap();
        assert_eq!(memory.bytes[..4], [0, 0xAB, 2, 3]);
    }

    #[test]
    fn banked_data_registers_address_four_words() {
        let (mut port, mut memory) = (powered(), Memory::new());
        port.write_ap(0, 4, RAM + 0x14, &mut memory).unwrap();
        assert_eq!(port.read_ap(0, 0x18, &mut memory), Ok(0x1B1A_1918));
        port.write_ap(0, 0x1C, 0xDEAD_BEEF, &mut memory).unwrap();
        assert_eq!(memory.bytes[0x1C..0x20], [0xEF, 0xBE, 0xAD, 0xDE]);
        assert_eq!(port.read_ap(0, 4, &mut memory), Ok(RAM + 0x14), "TAR stays");
    }

    #[test]
    fn the_increment_wraps_at_a_kibibyte() {
        let (mut port, mut memory) = (powered(), Memory::new());
        port.write_ap(0, 0, 0x12, &mut memory).unwrap();
        port.tar = RAM | 0x3FC;
        memory.bytes.resize(0x400, 0);
        port.read_ap(0, 0xC, &mut memory).unwrap();
        assert_eq!(port.tar, RAM);
    }

    #[test]
    fn a_bus_fault_is_sticky_until_abort_clears_it() {
        // B1.2, B2.2.1.
        let (mut port, mut memory) = (powered(), Memory::new());
        port.write_ap(0, 0, 2, &mut memory).unwrap();
        port.write_ap(0, 4, 0x3000_0000, &mut memory).unwrap();
        assert_eq!(port.read_ap(0, 0xC, &mut memory), Err(Fault));
        assert_eq!(port.read_dp(4) & STICKYERR, STICKYERR);
        assert_eq!(port.read_ap(0, 0xFC, &mut memory), Err(Fault));
        assert_eq!(port.write_ap(0, 4, RAM, &mut memory), Err(Fault));
        port.write_dp(0, 1 << 1);
        assert!(port.refuses(), "another flag");
        port.write_dp(0, 1 << 2);
        port.write_ap(0, 4, RAM, &mut memory).unwrap();
        assert_eq!(port.read_ap(0, 0xC, &mut memory), Ok(0x0302_0100));
        assert_eq!(port.read_dp(0xC), 0x0302_0100, "RDBUFF");
    }

    #[test]
    fn memory_is_read_with_the_widest_access() {
        let (mut port, mut memory) = (powered(), Memory::new());
        for (address, length, width, count) in [
            (RAM, 8, Width::Word, 2),
            (RAM + 2, 4, Width::Half, 2),
            (RAM, 6, Width::Half, 3),
            (RAM + 1, 4, Width::Byte, 4),
        ] {
            memory.accesses.clear();
            let first = (address - RAM) as u8;
            let expected: Vec<u8> = (first..first + length as u8).collect();
            assert_eq!(port.read_memory(address, length, &mut memory), Ok(expected));
            assert_eq!((memory.accesses[0].1, memory.accesses.len()), (width, count));
        }
        assert_eq!(port.read_memory(RAM + 60, 8, &mut memory), Err(Fault));
        assert!(!port.refuses());
        port.write_memory(RAM, Width::Half, &[9, 8, 7, 6], &mut memory).unwrap();
        assert_eq!(memory.bytes[..5], [9, 8, 7, 6, 4]);
        assert_eq!(port.write_memory(0, Width::Word, &[0; 4], &mut memory), Err(Fault));
    }
}
