//! The registers of the private peripheral bus: NVIC, SCB, SysTick, the cycle counter of the DWT, FPU control (ARMv7-M ARM, B3.2 to B3.4).
//!
//! An access that is not supported is recorded as a lint and makes the run fail: a register without a model, a width that is not allowed,
//! modes such as the MPU, division traps or floating-point contexts without automatic saving.

use stm32f4_model::{Chip, Lint, LintKind, Width};

use crate::nvic::{self, LINES, Nvic};
use crate::probe::core::{CoreDebug, DEMCR, DFSR, DHCSR};
use crate::systick::SysTick;

const SHCSR_ENABLES: [(u32, u8); 3] =
    [(1 << 16, nvic::MEM_MANAGE), (1 << 17, nvic::BUS_FAULT), (1 << 18, nvic::USAGE_FAULT)];
const SHCSR_ACTIVE: [(u32, u8); 7] = [
    (1, nvic::MEM_MANAGE),
    (1 << 1, nvic::BUS_FAULT),
    (1 << 3, nvic::USAGE_FAULT),
    (1 << 7, nvic::SV_CALL),
    (1 << 8, nvic::DEBUG_MONITOR),
    (1 << 10, nvic::PEND_SV),
    (1 << 11, nvic::SYS_TICK),
];
const SHCSR_PENDED: [(u32, u8); 4] =
    [(1 << 12, nvic::USAGE_FAULT), (1 << 13, nvic::MEM_MANAGE), (1 << 14, nvic::BUS_FAULT), (1 << 15, nvic::SV_CALL)];

/// CFSR bits that this board sets.
pub(crate) mod cfsr {
    /// Instruction fetch from a region that holds no code.
    pub(crate) const IACCVIOL: u32 = 1;
    /// Instruction fetch from an address without memory.
    pub(crate) const IBUSERR: u32 = 1 << 8;
    /// Data access that failed, address in BFAR.
    pub(crate) const PRECISERR: u32 = 1 << 9;
    /// Data access that failed, address not known.
    pub(crate) const IMPRECISERR: u32 = 1 << 10;
    /// A frame could not be read.
    pub(crate) const UNSTKERR: u32 = 1 << 11;
    /// A frame could not be written.
    pub(crate) const STKERR: u32 = 1 << 12;
    /// BFAR holds the address.
    pub(crate) const BFARVALID: u32 = 1 << 15;
    /// Undefined instruction.
    pub(crate) const UNDEFINSTR: u32 = 1 << 16;
    /// Branch to an address with bit 0 clear.
    pub(crate) const INVSTATE: u32 = 1 << 17;
    /// Bad EXC_RETURN.
    pub(crate) const INVPC: u32 = 1 << 18;
}

/// HFSR bits that this board sets.
pub(crate) mod hfsr {
    /// The vector could not be read.
    pub(crate) const VECTTBL: u32 = 1 << 1;
    /// A fault that its own handler could not take.
    pub(crate) const FORCED: u32 = 1 << 30;
    /// A breakpoint without debugger.
    pub(crate) const DEBUGEVT: u32 = 1 << 31;
}

/// State of the private peripheral bus, without that of the NVIC.
#[derive(Debug, Default)]
pub(crate) struct Scs {
    /// The SysTick timer.
    pub(crate) systick: SysTick,
    /// Vector table offset.
    pub(crate) vtor: u32,
    /// Configurable fault status, see [`cfsr`].
    pub(crate) cfsr: u32,
    /// HardFault status, see [`hfsr`].
    pub(crate) hfsr: u32,
    /// Address of the last data bus fault.
    pub(crate) bfar: u32,
    /// The chip, for what differs in its core.
    pub(crate) chip: Chip,
    /// Debug registers.
    pub(crate) debug: CoreDebug,
    /// Lints are not recorded: a debugger accesses the registers.
    pub(crate) ignores_lints: bool,
    /// A write to AIRCR requested a reset.
    pub(crate) reset_requested: bool,
    /// Cycles that the DWT counter has not counted because it was off or the core slept.
    cycles_missed: u64,
    scr: u32,
    ccr_writable: u32,
    cpacr: u32,
    fpccr: u32,
    fpcar: u32,
    fpdscr: u32,
    mmfar: u32,
    actlr: u32,
    dwt_enabled: bool,
    lints: Vec<Lint>,
}

impl Scs {
    /// Resets all registers but the debug registers, which [`CoreDebug::reset`] resets; lints are kept.
    pub(crate) fn reset(&mut self) {
        let (lints, debug) = (std::mem::take(&mut self.lints), std::mem::take(&mut self.debug));
        *self = Scs { fpccr: 0xC000_0000, lints, debug, chip: self.chip, ..Scs::default() };
    }

    /// Lints, in the order of first occurrence.
    #[must_use]
    pub(crate) fn lints(&self) -> &[Lint] {
        &self.lints
    }

    /// Records a lint.
    pub(crate) fn record_lint(&mut self, kind: LintKind, addr: u32, width: Width, write: Option<u32>, cycle: u64) {
        if self.ignores_lints {
            return;
        }
        let same =
            |lint: &&mut Lint| (lint.kind, lint.addr, lint.width, lint.write) == (kind, addr, width, write.is_some());
        match self.lints.iter_mut().find(same) {
            Some(lint) => lint.count += 1,
            None => {
                let value = write.unwrap_or(0);
                self.lints.push(Lint { cycle, addr, width, kind, write: write.is_some(), value, count: 1 });
            }
        }
    }

    /// SCR.SLEEPONEXIT.
    #[must_use]
    pub(crate) const fn sleeps_on_exit(&self) -> bool {
        self.scr & 1 << 1 != 0
    }

    /// SCR.SEVONPEND.
    #[must_use]
    pub(crate) const fn event_on_pending(&self) -> bool {
        self.scr & 1 << 4 != 0
    }

    /// True if CPACR enables coprocessors 10 and 11, the FPU.
    #[must_use]
    pub(crate) const fn fpu_enabled(&self) -> bool {
        self.cpacr >> 20 & 0xF == 0xF
    }

    /// Advances SysTick to a cycle and pends its exception if due.
    pub(crate) fn advance(&mut self, cycle: u64, nvic: &mut Nvic) {
        if self.systick.advance(cycle) {
            nvic.pend(nvic::SYS_TICK);
        }
    }

    /// Excludes cycles from the cycle counter: the core slept with its clock off.
    pub(crate) fn exclude_cycles(&mut self, cycles: u64) {
        if self.counting() {
            self.cycles_missed = self.cycles_missed.wrapping_add(cycles);
        }
    }

    const fn counting(&self) -> bool {
        self.dwt_enabled && self.debug.traces()
    }

    fn cycle_count(&self, cycle: u64) -> u32 {
        let frozen = if self.counting() { cycle } else { 0 };
        frozen.wrapping_sub(self.cycles_missed) as u32
    }

    /// Sets the cycle counter and its enables.
    fn set_cycle_count(&mut self, cycle: u64, count: u32, enabled: bool, demcr: u32) {
        self.dwt_enabled = enabled;
        self.debug.write_demcr(demcr);
        let frozen = if self.counting() { cycle } else { 0 };
        self.cycles_missed = frozen.wrapping_sub(count.into());
    }

    /// Reads the register at `addr`.
    pub(crate) fn read(&mut self, addr: u32, width: Width, nvic: &Nvic, cycle: u64) -> u32 {
        // Registers made of bytes take any width.
        if let Some(exception) = priority_bytes(addr) {
            return (0..width.bytes() as u8)
                .fold(0, |word, n| word | u32::from(nvic.priority(exception + n)) << (8 * n));
        }
        let shift = 8 * (addr & 3);
        if (0xE000_ED28..0xE000_ED2C).contains(&addr) {
            return self.cfsr >> shift & width.mask();
        }
        if width != Width::Word || shift != 0 {
            self.record_lint(LintKind::Width, addr, width, None, cycle);
            return 0;
        }
        match self.read_word(addr, nvic, cycle) {
            Some(value) => value,
            None => {
                self.record_lint(LintKind::Unmodelled, addr, width, None, cycle);
                0
            }
        }
    }

    fn read_word(&mut self, addr: u32, nvic: &Nvic, cycle: u64) -> Option<u32> {
        let lines = |of: fn(&Nvic, u8) -> bool, base: u32| {
            (0..32).fold(0, |word, n| word | u32::from(line(addr - base, n).is_some_and(|line| of(nvic, line))) << n)
        };
        Some(match addr {
            0xE000_1000 => 0x4000_0000 | u32::from(self.dwt_enabled),
            0xE000_1004 => self.cycle_count(cycle),
            // ICTR: three words of interrupt lines.
            0xE000_E004 => 2,
            0xE000_E008 => self.actlr,
            0xE000_E010 => self.systick.read_control(cycle),
            0xE000_E014 => self.systick.reload(),
            0xE000_E018 => self.systick.read_value(cycle),
            // CALIB (PM0214 4.5.4).
            0xE000_E01C => 0x4000_0000 | self.chip.systick_calibration(),
            0xE000_E100..=0xE000_E108 => lines(Nvic::is_enabled, 0xE000_E100),
            0xE000_E180..=0xE000_E188 => lines(Nvic::is_enabled, 0xE000_E180),
            0xE000_E200..=0xE000_E208 => lines(Nvic::is_pending, 0xE000_E200),
            0xE000_E280..=0xE000_E288 => lines(Nvic::is_pending, 0xE000_E280),
            0xE000_E300..=0xE000_E308 => lines(Nvic::is_active, 0xE000_E300),
            // CPUID: Cortex-M4 r0p1.
            0xE000_ED00 => 0x410F_C241,
            0xE000_ED04 => self.icsr(nvic),
            0xE000_ED08 => self.vtor,
            0xE000_ED0C => 0xFA05_0000 | u32::from(nvic.prigroup()) << 8,
            0xE000_ED10 => self.scr,
            // CCR: STKALIGN always, the rest as written.
            0xE000_ED14 => 1 << 9 | self.ccr_writable,
            0xE000_ED24 => self.shcsr(nvic),
            0xE000_ED2C => self.hfsr,
            DFSR => self.debug.dfsr(),
            0xE000_ED34 => self.mmfar,
            0xE000_ED38 => self.bfar,
            0xE000_ED3C => 0,
            0xE000_ED88 => self.cpacr,
            // C_DEBUGEN. The core reads it as running: no other bit is of use to a program.
            DHCSR => u32::from(self.debug.is_enabled()),
            DEMCR => self.debug.demcr(),
            0xE000_EF34 => self.fpccr,
            0xE000_EF38 => self.fpcar,
            0xE000_EF3C => self.fpdscr,
            0xE000_EF40 => 0x1011_0021,
            0xE000_EF44 => 0x1100_0011,
            0xE000_EF48 => 0,
            _ => return None,
        })
    }

    fn icsr(&self, nvic: &Nvic) -> u32 {
        let flag = |on: bool, bit: u32| u32::from(on) << bit;
        let active = (1..nvic::EXCEPTIONS as u8)
            .filter(|&n| nvic.is_active(n))
            .min_by_key(|&n| (nvic.group_priority(n), nvic.priority(n), n));
        u32::from(active.unwrap_or(0))
            | flag(nvic.active_count() <= 1, 11)
            | u32::from(nvic.best_pending().unwrap_or(0)) << 12
            | flag(nvic.any_line_pending(), 22)
            | flag(nvic.is_pending(nvic::SYS_TICK), 26)
            | flag(nvic.is_pending(nvic::PEND_SV), 28)
            | flag(nvic.is_pending(nvic::NMI), 31)
    }

    fn shcsr(&self, nvic: &Nvic) -> u32 {
        let set = |table: &[(u32, u8)], of: fn(&Nvic, u8) -> bool| {
            table.iter().filter(|&&(_, n)| of(nvic, n)).fold(0, |word, &(bit, _)| word | bit)
        };
        set(&SHCSR_ENABLES, Nvic::is_enabled)
            | set(&SHCSR_ACTIVE, Nvic::is_active)
            | set(&SHCSR_PENDED, Nvic::is_pending)
    }

    /// Writes the register at `addr`.
    pub(crate) fn write(&mut self, addr: u32, width: Width, value: u32, nvic: &mut Nvic, cycle: u64) {
        if let Some(exception) = priority_bytes(addr) {
            (0..width.bytes() as u8).for_each(|n| nvic.set_priority(exception + n, (value >> (8 * n)) as u8));
            return;
        }
        let shift = 8 * (addr & 3);
        if (0xE000_ED28..0xE000_ED2C).contains(&addr) {
            self.cfsr &= !((value & width.mask()) << shift);
            return;
        }
        if width != Width::Word || shift != 0 {
            self.record_lint(LintKind::Width, addr, width, Some(value), cycle);
            return;
        }
        if let Err(kind) = self.write_word(addr, value, nvic, cycle) {
            self.record_lint(kind, addr, width, Some(value), cycle);
        }
    }

    fn write_word(&mut self, addr: u32, value: u32, nvic: &mut Nvic, cycle: u64) -> Result<(), LintKind> {
        let mut lines = |base: u32, act: fn(&mut Nvic, u8)| {
            (0..32)
                .filter(|n| value >> n & 1 != 0)
                .filter_map(|n| line(addr - base, n))
                .for_each(|line| act(nvic, line));
        };
        match addr {
            0xE000_1000 => {
                if value & !1 & !0xF000_0000 != 0 {
                    return Err(LintKind::Mode("DWT functions other than the cycle counter"));
                }
                self.set_cycle_count(cycle, self.cycle_count(cycle), value & 1 != 0, self.debug.demcr());
            }
            0xE000_1004 => self.set_cycle_count(cycle, value, self.dwt_enabled, self.debug.demcr()),
            // The lock access register of the DWT: the F407 has no lock.
            0xE000_1FB0 => {}
            0xE000_E008 => self.actlr = value,
            0xE000_E010 => self.systick.write_control(cycle, value),
            0xE000_E014 => self.systick.write_reload(cycle, value),
            0xE000_E018 => self.systick.write_value(cycle),
            0xE000_E100..=0xE000_E108 => {
                lines(0xE000_E100, Nvic::enable);
                let first = 8 * (addr - 0xE000_E100);
                let enables =
                    |is_wrong: &dyn Fn(u8) -> bool| (0..32).any(|n| value >> n & 1 != 0 && is_wrong((first + n) as u8));
                if enables(&|line| !self.chip.has_interrupt(line)) {
                    return Err(LintKind::Misuse("an interrupt is enabled that the chip does not have"));
                }
                if enables(&|line| line >= LINES) {
                    return Err(LintKind::Unmodelled);
                }
            }
            0xE000_E180..=0xE000_E188 => lines(0xE000_E180, Nvic::disable),
            0xE000_E200..=0xE000_E208 => lines(0xE000_E200, Nvic::pend),
            0xE000_E280..=0xE000_E288 => lines(0xE000_E280, Nvic::unpend),
            0xE000_ED04 => {
                for (bit, exception, set) in [
                    (31, nvic::NMI, true),
                    (28, nvic::PEND_SV, true),
                    (27, nvic::PEND_SV, false),
                    (26, nvic::SYS_TICK, true),
                    (25, nvic::SYS_TICK, false),
                ] {
                    match (value >> bit & 1 != 0, set) {
                        (true, true) => nvic.pend(exception),
                        (true, false) => nvic.unpend(exception),
                        (false, _) => {}
                    }
                }
            }
            0xE000_ED08 => self.vtor = value & 0xFFFF_FF80,
            0xE000_ED0C => {
                if value >> 16 != 0x05FA {
                    return Err(LintKind::Misuse("AIRCR is written without its key 0x05FA: the write is ignored"));
                }
                nvic.set_prigroup((value >> 8) as u8);
                self.reset_requested |= value & 1 << 2 != 0;
            }
            0xE000_ED10 => self.scr = value & 0x16,
            0xE000_ED14 => {
                self.ccr_writable = value & 0x11B;
                if value & 1 << 4 != 0 {
                    return Err(LintKind::Mode("trap on division by zero"));
                }
                if value & 1 << 3 != 0 {
                    return Err(LintKind::Mode("trap on unaligned access"));
                }
            }
            0xE000_ED24 => {
                for (bit, exception) in SHCSR_ENABLES {
                    if value & bit != 0 { nvic.enable(exception) } else { nvic.disable(exception) }
                }
                // Context switchers rewrite the active bits; changing them is not modelled.
                let held =
                    SHCSR_ACTIVE.iter().filter(|&&(_, n)| nvic.is_active(n)).fold(0, |word, &(bit, _)| word | bit);
                if value & 0xFFF != held {
                    return Err(LintKind::Mode("active bits of SHCSR changed by a write"));
                }
            }
            0xE000_ED2C => self.hfsr &= !value,
            DFSR => self.debug.write_dfsr(value),
            0xE000_ED34 => self.mmfar = value,
            0xE000_ED38 => self.bfar = value,
            0xE000_ED88 => self.cpacr = value & 0x00F0_0000,
            DEMCR => self.set_cycle_count(cycle, self.cycle_count(cycle), self.dwt_enabled, value),
            0xE000_EF00 => {
                if let Some(line) = line(0, value & 0x1FF) {
                    nvic.pend(line);
                }
            }
            0xE000_EF34 => {
                self.fpccr = value & 0xC000_017B;
                if value & 1 << 31 == 0 {
                    return Err(LintKind::Mode("floating-point context without automatic saving (FPCCR.ASPEN = 0)"));
                }
            }
            0xE000_EF38 => self.fpcar = value & !7,
            0xE000_EF3C => {
                self.fpdscr = value & 0x07C0_0000;
                if self.fpdscr != 0 {
                    return Err(LintKind::Mode("default floating-point status other than 0"));
                }
            }
            _ => return Err(LintKind::Unmodelled),
        }
        Ok(())
    }
}

/// The exception of bit `n` in the word at byte `offset` of a register bank of lines.
fn line(offset: u32, n: u32) -> Option<u8> {
    let number = offset * 8 + n;
    (number < u32::from(LINES)).then_some(16 + number as u8)
}

/// The exception whose priority byte is at `addr`: SHPR1 to SHPR3 and IPR.
fn priority_bytes(addr: u32) -> Option<u8> {
    match addr {
        0xE000_ED18..=0xE000_ED23 => Some((addr - 0xE000_ED14) as u8),
        0xE000_E400..=0xE000_E453 => Some((addr - 0xE000_E400) as u8 + 16),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fresh() -> (Scs, Nvic) {
        let mut scs = Scs::default();
        scs.reset();
        (scs, Nvic::default())
    }

    #[test]
    fn enable_and_pending_registers_map_to_lines() {
        let (mut scs, mut nvic) = fresh();
        scs.write(0xE000_E104, Width::Word, 1 << 18, &mut nvic, 0);
        assert!(nvic.is_enabled(16 + 50), "TIM5 is line 50");
        assert_eq!(scs.read(0xE000_E184, Width::Word, &nvic, 0), 1 << 18);
        scs.write(0xE000_EF00, Width::Word, 50, &mut nvic, 0);
        assert!(nvic.is_pending(66));
        assert_eq!(scs.read(0xE000_E204, Width::Word, &nvic, 0), 1 << 18);
        assert_eq!(scs.read(0xE000_ED04, Width::Word, &nvic, 0) >> 12 & 0x1FF, 66, "VECTPENDING");
        scs.write(0xE000_E284, Width::Word, 1 << 18, &mut nvic, 0);
        assert!(!nvic.is_pending(66));
        assert!(scs.lints().is_empty());
    }

    #[test]
    fn priorities_accept_bytes_and_words() {
        let (mut scs, mut nvic) = fresh();
        scs.write(0xE000_E400 + 18, Width::Byte, 0x65, &mut nvic, 0);
        assert_eq!(nvic.priority(16 + 18), 0x60);
        scs.write(0xE000_ED20, Width::Word, 0xF0E0_0000, &mut nvic, 0);
        assert_eq!((nvic.priority(nvic::PEND_SV), nvic.priority(nvic::SYS_TICK)), (0xE0, 0xF0));
        assert_eq!(scs.read(0xE000_ED20, Width::Word, &nvic, 0), 0xF0E0_0000);
    }

    #[test]
    fn the_cycle_counter_stops_and_restarts() {
        let (mut scs, mut nvic) = fresh();
        scs.write(0xE000_1000, Width::Word, 1, &mut nvic, 100);
        assert_eq!(scs.read(0xE000_1004, Width::Word, &nvic, 200), 0, "TRCENA is off");
        scs.write(0xE000_EDFC, Width::Word, 1 << 24, &mut nvic, 1_000);
        assert_eq!(scs.read(0xE000_1004, Width::Word, &nvic, 1_500), 500);
        scs.exclude_cycles(300);
        assert_eq!(scs.read(0xE000_1004, Width::Word, &nvic, 2_000), 700);
        scs.write(0xE000_1004, Width::Word, 7, &mut nvic, 3_000);
        assert_eq!(scs.read(0xE000_1004, Width::Word, &nvic, 3_010), 17);
        scs.write(0xE000_1000, Width::Word, 0, &mut nvic, 3_010);
        assert_eq!(scs.read(0xE000_1004, Width::Word, &nvic, 9_000), 17);
        scs.write(0xE000_1000, Width::Word, 1, &mut nvic, 10_000);
        assert_eq!(scs.read(0xE000_1004, Width::Word, &nvic, 10_001), 18);
        assert!(scs.lints().is_empty());
    }

    #[test]
    fn unsupported_accesses_make_one_lint_with_a_count() {
        let (mut scs, mut nvic) = fresh();
        for cycle in 0..3 {
            assert_eq!(scs.read(0xE000_ED94, Width::Word, &nvic, cycle), 0, "MPU_CTRL");
        }
        let _ = scs.read(0xE000_E100, Width::Byte, &nvic, 5);
        scs.write(0xE000_ED14, Width::Word, 1 << 4, &mut nvic, 6);
        let kinds: Vec<_> = scs.lints().iter().map(|lint| (lint.kind, lint.count, lint.cycle)).collect();
        let modes =
            [(LintKind::Unmodelled, 3, 0), (LintKind::Width, 1, 5), (LintKind::Mode("trap on division by zero"), 1, 6)];
        assert_eq!(kinds, modes);
        scs.reset();
        assert_eq!(scs.lints().len(), 3, "a reset of the chip keeps the lints");
    }

    #[test]
    fn an_interrupt_that_the_chip_lacks_is_recorded() {
        // RM0383 table 37: no CAN1_TX, which is line 19 of the F407; SPI4, line 84, is not modelled.
        for (chip, addr, bit, wanted) in [
            (Chip::F407, 0xE000_E100, 19, false),
            (Chip::F411, 0xE000_E100, 19, true),
            (Chip::F411, 0xE000_E100, 31, false),
            (Chip::F411, 0xE000_E108, 84 - 64, true),
        ] {
            let (mut scs, mut nvic) = fresh();
            scs.chip = chip;
            scs.write(addr, Width::Word, 1 << bit, &mut nvic, 0);
            assert_eq!(!scs.lints().is_empty(), wanted, "{chip}, bit {bit}");
        }
    }

    #[test]
    fn reset_needs_the_key() {
        let (mut scs, mut nvic) = fresh();
        scs.write(0xE000_ED0C, Width::Word, 1 << 2, &mut nvic, 0);
        assert!(!scs.reset_requested);
        assert_eq!(scs.lints().len(), 1);
        scs.write(0xE000_ED0C, Width::Word, 0x05FA_0004, &mut nvic, 0);
        assert!(scs.reset_requested);
    }

    #[test]
    fn fault_status_is_cleared_by_writing_ones_in_any_width() {
        let (mut scs, mut nvic) = fresh();
        scs.cfsr = cfsr::UNDEFINSTR | cfsr::PRECISERR | cfsr::BFARVALID;
        assert_eq!(scs.read(0xE000_ED2A, Width::Half, &nvic, 0), 1);
        scs.write(0xE000_ED29, Width::Byte, 0x82, &mut nvic, 0);
        assert_eq!(scs.cfsr, cfsr::UNDEFINSTR);
        scs.write(0xE000_ED28, Width::Word, u32::MAX, &mut nvic, 0);
        assert_eq!(scs.cfsr, 0);
    }

    #[test]
    fn cpacr_enables_the_fpu() {
        let (mut scs, mut nvic) = fresh();
        assert!(!scs.fpu_enabled());
        scs.write(0xE000_ED88, Width::Word, 0xF << 20, &mut nvic, 0);
        assert!(scs.fpu_enabled());
    }
}
