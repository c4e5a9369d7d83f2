//! Debug registers of the core, its break point unit, and the identification of its components (ARMv7-M ARM, C1.6, C1.11 and B3.5; Cortex-M4 TRM,
//! chapters 8 and 10).
//!
//! C_DEBUGEN, the vector catches, the status of the last halts and the comparators outlast every reset but a power-on.

use stm32f4_model::Chip;

/// Debug halting control and status.
pub(crate) const DHCSR: u32 = 0xE000_EDF0;
/// Selects the register of the core that DCRDR transfers.
pub(crate) const DCRSR: u32 = 0xE000_EDF4;
/// Data of such a transfer.
pub(crate) const DCRDR: u32 = 0xE000_EDF8;
/// Vector catches, and TRCENA.
pub(crate) const DEMCR: u32 = 0xE000_EDFC;
/// Reasons of the halts since the flags were cleared.
pub(crate) const DFSR: u32 = 0xE000_ED30;
/// Break point unit: FP_CTRL, FP_REMAP, and a word for each comparator.
pub(crate) const FP_CTRL: u32 = 0xE000_2000;
const FP_REMAP: u32 = 0xE000_2004;
const FP_COMP0: u32 = 0xE000_2008;
const FP_COMP7: u32 = 0xE000_2024;

/// Comparators of instructions; two more are for literals, which are not modelled.
const CODE_COMPARATORS: usize = 6;

const C_DEBUGEN: u32 = 1;
const C_HALT: u32 = 1 << 1;
const C_STEP: u32 = 1 << 2;
const C_MASKINTS: u32 = 1 << 3;
const S_REGRDY: u32 = 1 << 16;
const S_HALT: u32 = 1 << 17;
const S_SLEEP: u32 = 1 << 18;
const S_LOCKUP: u32 = 1 << 19;
const S_RETIRE_ST: u32 = 1 << 24;
const S_RESET_ST: u32 = 1 << 25;
const DHCSR_KEY: u32 = 0xA05F;
/// Bits of DEMCR that a power-on resets: TRCENA and the vector catches.
const DEMCR_WRITABLE: u32 = 1 << 24 | vector_catch::ALL;

/// Vector catches of DEMCR (C1.6.5): what halts the core before the first instruction of a handler, or of the program.
pub(crate) mod vector_catch {
    /// VC_CORERESET: a reset.
    pub(crate) const RESET: u32 = 1;
    /// VC_MMERR: MemManage.
    pub(crate) const MEM_MANAGE: u32 = 1 << 4;
    /// VC_STATERR: UsageFault by a state or an instruction.
    pub(crate) const STATE: u32 = 1 << 7;
    /// VC_BUSERR: BusFault.
    pub(crate) const BUS: u32 = 1 << 8;
    /// VC_INTERR: a fault of an exception entry or return.
    pub(crate) const EXCEPTION: u32 = 1 << 9;
    /// VC_HARDERR: HardFault.
    pub(crate) const HARD_FAULT: u32 = 1 << 10;
    /// All of them, with VC_NOCPERR and VC_CHKERR, whose faults the board does not model.
    pub(crate) const ALL: u32 = RESET | 0x7F << 4;
}

/// Reason of a halt: its flag in DFSR.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum HaltReason {
    /// C_HALT or C_STEP.
    Request = 1,
    /// A BKPT instruction, or a comparator of the break point unit.
    Breakpoint = 1 << 1,
    /// A vector catch.
    VectorCatch = 1 << 3,
}

/// What a write to DHCSR asks of the core.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Request {
    /// Nothing.
    None,
    /// To halt.
    Halt,
    /// To go on after a halt.
    Resume,
    /// To execute one instruction after a halt.
    Step,
}

/// What the core does while it is not halted, for DHCSR.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct CoreActivity {
    /// It sleeps.
    pub(crate) sleeps: bool,
    /// It is locked up.
    pub(crate) is_locked_up: bool,
}

/// State of the debug registers.
#[derive(Debug, Clone, Default)]
pub(crate) struct CoreDebug {
    /// C_DEBUGEN, C_HALT, C_STEP and C_MASKINTS.
    control: u32,
    demcr: u32,
    dfsr: u32,
    /// DCRDR.
    pub(crate) data: u32,
    is_halted: bool,
    /// S_RESET_ST and S_RETIRE_ST, until DHCSR is read.
    was_reset: bool,
    has_retired: bool,
    breakpoints_on: bool,
    comparators: [u32; 8],
}

impl CoreDebug {
    /// What a reset leaves: after a power-on nothing.
    pub(crate) fn reset(&mut self, is_power_on: bool) {
        if is_power_on {
            *self = CoreDebug::default();
        }
        self.control &= C_DEBUGEN;
        self.is_halted = false;
        self.was_reset = true;
    }

    /// C_DEBUGEN: a debugger has enabled halting.
    pub(crate) const fn is_enabled(&self) -> bool {
        self.control & C_DEBUGEN != 0
    }

    /// Sets or clears C_DEBUGEN.
    pub(crate) fn enable(&mut self, enabled: bool) {
        self.control = if enabled { self.control | C_DEBUGEN } else { 0 };
    }

    /// True if a step or a run takes no interrupts.
    pub(crate) const fn masks_interrupts(&self) -> bool {
        self.control & (C_DEBUGEN | C_MASKINTS) == C_DEBUGEN | C_MASKINTS
    }

    /// S_HALT.
    pub(crate) const fn is_halted(&self) -> bool {
        self.is_halted
    }

    /// The core has halted.
    pub(crate) fn halt(&mut self, reason: HaltReason) {
        self.is_halted = true;
        self.control |= C_HALT;
        self.dfsr |= reason as u32;
    }

    /// The core goes on.
    pub(crate) fn go_on(&mut self) {
        self.is_halted = false;
        self.has_retired = true;
    }

    /// True if DEMCR catches one of these vectors, see [`vector_catch`], and a debugger has enabled halting.
    pub(crate) const fn catches(&self, vectors: u32) -> bool {
        self.is_enabled() && self.demcr & vectors != 0
    }

    /// Reads DHCSR as a debugger, which clears its sticky bits.
    pub(crate) fn read_dhcsr(&mut self, activity: CoreActivity) -> u32 {
        // The core retires instructions unless it stands still.
        let has_retired =
            std::mem::take(&mut self.has_retired) || !(self.is_halted || activity.sleeps || activity.is_locked_up);
        let was_reset = std::mem::take(&mut self.was_reset);
        let flags = [
            (true, S_REGRDY),
            (self.is_halted, S_HALT),
            (activity.sleeps && !self.is_halted, S_SLEEP),
            (activity.is_locked_up && !self.is_halted, S_LOCKUP),
            (has_retired, S_RETIRE_ST),
            (was_reset, S_RESET_ST),
        ];
        flags.into_iter().filter(|(is_set, _)| *is_set).fold(self.control, |word, (_, flag)| word | flag)
    }

    /// Writes DHCSR as a debugger: without the key nothing happens.
    pub(crate) fn write_dhcsr(&mut self, value: u32) -> Request {
        if value >> 16 != DHCSR_KEY {
            return Request::None;
        }
        // C_MASKINTS changes only while the core is halted.
        let kept = if self.is_halted { 0 } else { C_MASKINTS };
        let wanted = value & (C_DEBUGEN | C_HALT | C_STEP | C_MASKINTS) & !kept | self.control & kept;
        self.control = if wanted & C_DEBUGEN == 0 { 0 } else { wanted };
        match (self.is_halted, self.control & C_HALT != 0, self.control & C_STEP != 0) {
            (false, true, _) => Request::Halt,
            // The manual leaves open what C_STEP does to a core that runs, as after a reset that the debugger did not see. Here it halts after one
            // instruction, too.
            (_, false, true) => Request::Step,
            (true, false, false) => Request::Resume,
            (false, false, false) | (true, true, _) => Request::None,
        }
    }

    /// DEMCR. Monitor mode is not modelled.
    pub(crate) const fn demcr(&self) -> u32 {
        self.demcr
    }

    /// Writes DEMCR, as the core or a debugger.
    pub(crate) fn write_demcr(&mut self, value: u32) {
        self.demcr = value & DEMCR_WRITABLE;
    }

    /// TRCENA: DWT and ITM are on.
    pub(crate) const fn traces(&self) -> bool {
        self.demcr >> 24 & 1 != 0
    }

    /// DFSR.
    pub(crate) const fn dfsr(&self) -> u32 {
        self.dfsr
    }

    /// Writes DFSR: flags are cleared by writing 1.
    pub(crate) fn write_dfsr(&mut self, value: u32) {
        self.dfsr &= !value;
    }

    /// Reads a register of the break point unit; `None`: it has none there.
    pub(crate) fn read_breakpoint_unit(&self, addr: u32) -> Option<u32> {
        match addr {
            // NUM_LIT 2, NUM_CODE 6.
            FP_CTRL => Some(0x260 | u32::from(self.breakpoints_on)),
            // RMPSPT: a remap is supported. It is not modelled.
            FP_REMAP => Some(1 << 29),
            FP_COMP0..=FP_COMP7 if addr.is_multiple_of(4) => Some(self.comparators[(addr - FP_COMP0) as usize / 4]),
            _ => None,
        }
    }

    /// Writes a register of the break point unit; false: it has none there.
    pub(crate) fn write_breakpoint_unit(&mut self, addr: u32, value: u32) -> bool {
        match addr {
            // KEY, bit 1, must be 1 for the write to take effect.
            FP_CTRL if value & 2 != 0 => self.breakpoints_on = value & 1 != 0,
            FP_CTRL | FP_REMAP => {}
            FP_COMP0..=FP_COMP7 if addr.is_multiple_of(4) => {
                self.comparators[(addr - FP_COMP0) as usize / 4] = value & 0xDFFF_FFFD;
            }
            _ => return false,
        }
        true
    }

    /// Addresses of the hardware break points that are on.
    pub(crate) fn breakpoints(&self) -> Vec<u32> {
        let mut addresses = Vec::new();
        if !self.breakpoints_on || !self.is_enabled() {
            return addresses;
        }
        for comparator in self.comparators.iter().take(CODE_COMPARATORS).filter(|word| *word & 1 != 0) {
            let word_address = comparator & 0x1FFF_FFFC;
            // REPLACE: bit 30 the lower half-word, bit 31 the upper one.
            addresses.extend((comparator >> 30 & 1 != 0).then_some(word_address));
            addresses.extend((comparator >> 31 != 0).then_some(word_address + 2));
        }
        addresses
    }
}

/// A component of the core: its address, and its peripheral identification PIDR0 to PIDR3 with the class in the last byte.
const COMPONENTS: [(u32, [u8; 4], u8); 3] = [
    // System Control Space of a Cortex-M4 with FPU, data watchpoint and trace, break point unit.
    (0xE000_E000, [0x0C, 0xB0, 0x0B, 0x00], 0xE0),
    (0xE000_1000, [0x02, 0xB0, 0x3B, 0x00], 0xE0),
    (0xE000_2000, [0x03, 0xB0, 0x2B, 0x00], 0xE0),
];
/// Address of the ROM table.
pub(crate) const ROM_TABLE: u32 = 0xE00F_F000;
/// Entries of the ROM table: offsets of the components. Bit 0: it is present. Not modelled, and so absent: ITM, TPIU, ETM.
const ROM_ENTRIES: [u32; 7] =
    [0xFFF0_F003, 0xFFF0_2003, 0xFFF0_3003, 0xFFF0_1002, 0xFFF4_1002, 0xFFF4_2002, 0x0000_0000];

/// A word of the ROM table, or of the identification of a component; `None`: there is no such word at the address.
pub(crate) fn identification(chip: Chip, addr: u32) -> Option<u32> {
    let (base, offset) = (addr & !0xFFF, addr & 0xFFF);
    if base == ROM_TABLE && (offset as usize) < 4 * ROM_ENTRIES.len() {
        return Some(ROM_ENTRIES[offset as usize / 4]);
    }
    let (peripheral, manufacturer, class) = if base == ROM_TABLE {
        // RM0090 38.8, RM0383 23.8: the part number is the device identity; the manufacturer is STMicroelectronics, JEP106 code 0x20.
        let part = (chip.idcode() & 0xFFF).to_le_bytes();
        ([part[0], part[1] & 0xF, 0x0A, 0x00], 0x00, 0x10)
    } else {
        let (_, peripheral, class) = COMPONENTS.iter().find(|(component, ..)| *component == base)?;
        (*peripheral, 0x04, *class)
    };
    let byte = match offset {
        0xFD0 => manufacturer,
        0xFD4 | 0xFD8 | 0xFDC => 0,
        0xFE0 | 0xFE4 | 0xFE8 | 0xFEC => peripheral[(offset as usize - 0xFE0) / 4],
        0xFF0 => 0x0D,
        0xFF4 => class,
        0xFF8 => 0x05,
        0xFFC => 0xB1,
        _ => return None,
    };
    Some(byte.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEY: u32 = DHCSR_KEY << 16;

    fn attached() -> CoreDebug {
        let mut debug = CoreDebug::default();
        assert_eq!(debug.write_dhcsr(KEY | C_DEBUGEN), Request::None);
        debug
    }

    #[test]
    fn a_write_without_the_key_is_ignored() {
        // C1.6.2: DBGKEY 0xA05F.
        let mut debug = CoreDebug::default();
        assert_eq!(debug.write_dhcsr(C_DEBUGEN | C_HALT), Request::None);
        assert!(!debug.is_enabled());
    }

    #[test]
    fn halt_step_and_resume() {
        let mut debug = attached();
        assert_eq!(debug.write_dhcsr(KEY | C_DEBUGEN | C_HALT), Request::Halt);
        debug.halt(HaltReason::Request);
        assert_eq!((debug.dfsr(), debug.read_dhcsr(CoreActivity::default()) & 0xF_0003), (1, 3 << 16 | 3));
        assert_eq!(debug.write_dhcsr(KEY | C_DEBUGEN | C_STEP | C_MASKINTS), Request::Step);
        assert!(debug.masks_interrupts());
        debug.go_on();
        debug.halt(HaltReason::Request);
        assert_eq!(debug.write_dhcsr(KEY | C_DEBUGEN), Request::Resume);
        debug.go_on();
        let sleeps = CoreActivity { sleeps: true, is_locked_up: false };
        assert_eq!(debug.read_dhcsr(sleeps) & 0xF_0003, S_REGRDY | S_SLEEP | C_DEBUGEN);
        assert_eq!(debug.write_dhcsr(KEY | C_DEBUGEN | C_STEP | C_MASKINTS), Request::Step);
        assert!(!debug.masks_interrupts(), "not while the core runs");
        // Without C_DEBUGEN a halted core goes on.
        debug.halt(HaltReason::Breakpoint);
        assert_eq!(debug.write_dhcsr(KEY), Request::Resume);
        assert!(!debug.is_enabled());
    }

    #[test]
    fn status_bits_of_the_past_are_cleared_by_a_read() {
        let mut debug = attached();
        debug.reset(false);
        let locked = CoreActivity { sleeps: false, is_locked_up: true };
        assert_eq!(debug.read_dhcsr(locked), S_RESET_ST | S_LOCKUP | S_REGRDY | C_DEBUGEN);
        assert_eq!(debug.read_dhcsr(locked), S_LOCKUP | S_REGRDY | C_DEBUGEN);
        assert_eq!(debug.read_dhcsr(CoreActivity::default()) & S_RETIRE_ST, S_RETIRE_ST);
    }

    #[test]
    fn only_a_power_on_clears_the_debug_state() {
        // C1.6.2, C1.6.5, C1.11.3.
        let mut debug = attached();
        debug.write_demcr(1 << 24 | vector_catch::RESET | vector_catch::HARD_FAULT);
        debug.write_breakpoint_unit(FP_CTRL, 3);
        debug.write_breakpoint_unit(FP_COMP0, 0x4800_0101);
        debug.halt(HaltReason::VectorCatch);
        debug.reset(false);
        assert!(debug.is_enabled() && !debug.is_halted() && debug.catches(vector_catch::RESET) && debug.traces());
        assert_eq!((debug.dfsr(), debug.breakpoints()), (8, vec![0x0800_0100]));
        debug.write_dfsr(8);
        assert_eq!(debug.dfsr(), 0);
        debug.reset(true);
        assert!(!debug.is_enabled() && !debug.catches(vector_catch::ALL) && debug.breakpoints().is_empty());
        assert_eq!(debug.demcr(), 0);
    }

    #[test]
    fn catches_need_a_debugger() {
        let mut debug = CoreDebug::default();
        debug.write_demcr(vector_catch::ALL);
        assert!(!debug.catches(vector_catch::HARD_FAULT));
        debug.enable(true);
        assert!(debug.catches(vector_catch::HARD_FAULT));
    }

    #[test]
    fn comparators_select_half_words() {
        // C1.11.5, FP_COMPn: REPLACE 01 lower, 10 upper, 11 both.
        let mut debug = attached();
        debug.write_breakpoint_unit(FP_CTRL, 3);
        for (n, word) in [0x4800_0101, 0x8800_0205, 0xC800_0301, 0x4800_0400].into_iter().enumerate() {
            assert!(debug.write_breakpoint_unit(FP_COMP0 + 4 * n as u32, word));
        }
        // The comparators of literals are no break points.
        debug.write_breakpoint_unit(FP_COMP0 + 24, 0x4800_0501);
        assert_eq!(debug.breakpoints(), [0x0800_0100, 0x0800_0206, 0x0800_0300, 0x0800_0302]);
        debug.write_breakpoint_unit(FP_CTRL, 0);
        assert_eq!(debug.breakpoints().len(), 4, "without KEY the write is ignored");
        debug.write_breakpoint_unit(FP_CTRL, 2);
        assert_eq!((debug.breakpoints().len(), debug.read_breakpoint_unit(FP_CTRL)), (0, Some(0x260)));
        assert_eq!(debug.read_breakpoint_unit(FP_COMP7 + 4), None);
    }

    #[test]
    fn components_identify_themselves() {
        let words = |base: u32, offsets: [u32; 4]| offsets.map(|offset| identification(Chip::F407, base + offset));
        let ids = [0xFF0, 0xFF4, 0xFF8, 0xFFC];
        assert_eq!(words(ROM_TABLE, ids), [Some(0x0D), Some(0x10), Some(0x05), Some(0xB1)]);
        assert_eq!(words(0xE000_E000, ids), [Some(0x0D), Some(0xE0), Some(0x05), Some(0xB1)]);
        assert_eq!(words(ROM_TABLE, [0xFE0, 0xFE4, 0xFE8, 0xFD0]), [Some(0x13), Some(0x04), Some(0x0A), Some(0)]);
        assert_eq!(identification(Chip::F411, ROM_TABLE + 0xFE0), Some(0x31));
        // Each component that is present lies where its entry says.
        let present = ROM_ENTRIES.iter().filter(|entry| *entry & 1 != 0);
        let bases: Vec<u32> = present.map(|entry| ROM_TABLE.wrapping_add(entry & !0xFFF)).collect();
        assert_eq!(bases, COMPONENTS.map(|(base, ..)| base));
        assert_eq!(identification(Chip::F407, 0xE000_3FE0), None);
    }
}
