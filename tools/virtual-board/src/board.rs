//! The board around the processor: peripherals, NVIC, private peripheral bus, signals at the pins, and their common clock.
//!
//! Time is counted in HCLK cycles since power-on. An instruction costs a constant number of them (`cpi` of [`BoardModel::new`]), added when
//! its block begins, so that a register access inside a block happens at the time of the end of the block. Not cycle-accurate.

use stm32f4_model::{DmaMemory, Lint, LintKind, ResetCause, Soc, Width};

use crate::addresses::FLASH;
use crate::cpu::Machine;
use crate::nvic::{self, Masks, Nvic};
use crate::plant::BoardPlant;
use crate::scs::Scs;

/// TIM1's break and dead-time register: bit 15 is the main output enable.
const TIM1_BDTR: u32 = 0x4001_0044;
const MOE: u32 = 1 << 15;
/// TIM1's counter, its period and its compare registers.
const TIM1_CNT: u32 = 0x4001_0024;
const TIM1_ARR: u32 = 0x4001_002C;
const TIM1_CCR: std::ops::RangeInclusive<u32> = 0x4001_0034..=0x4001_0040;
/// RCC's reset register of APB2: bit 0 resets TIM1.
const RCC_APB2RSTR: u32 = 0x4002_3824;
const DBGMCU_CR: u32 = 0xE004_2004;
/// DBGMCU_CR.DBG_SLEEP: the core clock runs while the core sleeps.
const DBG_SLEEP: u32 = 1;
const NEVER: u64 = u64::MAX;
/// Status register of the flash interface.
const FLASH_SR: u32 = 0x4002_3C0C;
/// Virtual time that a poll of it takes at most while the flash is busy and the program runs in RAM, s. A program that erases a sector polls for a second,
/// and does nothing else.
const POLL_S: f64 = 20e-6;
/// RAM and core-coupled memory lie from here on.
const FIRST_RAM: u32 = 0x1000_0000;

/// State of the board around the processor.
pub(crate) struct BoardModel {
    /// The chip's peripherals.
    pub(crate) soc: Soc,
    /// Interrupt controller.
    pub(crate) nvic: Nvic,
    /// Private peripheral bus.
    pub(crate) scs: Scs,
    /// Signals at the pins.
    pub(crate) plant: BoardPlant,
    /// Instructions executed since power-on.
    pub(crate) instructions: u64,
    /// The event register of WFE and SEV.
    pub(crate) event: bool,
    /// A reset that is requested but not yet carried out.
    pub(crate) reset: Option<ResetCause>,
    /// Address of the block of instructions that runs.
    pub(crate) block: u32,
    /// Addresses of blocks whose next execution is reported in `reached`.
    pub(crate) watched: Vec<u32>,
    /// The watched address that was reached.
    pub(crate) reached: Option<u32>,
    /// The accesses are those of a debugger.
    pub(crate) is_debugger: bool,
    now: u64,
    deadline: u64,
    next_stop: u64,
    next_stop_s: f64,
    /// Inputs are known up to this cycle, and nothing later is looked at.
    horizon: u64,
    horizon_s: f64,
    /// The processor stopped before a block that would pass the horizon, and for nothing else.
    met_horizon: bool,
    hclk_hz: u32,
    cpi_milli: u64,
    cycle_remainder: u64,
    exception_possible: bool,
    nmi: bool,
    debug_in_sleep: bool,
    /// Address of the block that ran at each lint of the peripherals and of the core.
    lint_blocks: [Vec<u32>; 2],
    /// Updates of the peripherals that the interrupt controller and the deadline have.
    seen_updates: u64,
}

impl BoardModel {
    /// A board at power-on. `cpi`: cycles per instruction, rounded to a thousandth.
    #[must_use]
    pub(crate) fn new(soc: Soc, plant: BoardPlant, cpi: f64) -> Self {
        let hclk_hz = soc.hclk_hz();
        let mut scs = Scs::default();
        scs.chip = soc.config().chip;
        scs.reset();
        BoardModel {
            soc,
            nvic: Nvic::default(),
            scs,
            plant,
            instructions: 0,
            event: false,
            reset: None,
            block: 0,
            watched: Vec::new(),
            reached: None,
            is_debugger: false,
            now: 0,
            deadline: 0,
            next_stop: 0,
            next_stop_s: 0.0,
            horizon: NEVER,
            horizon_s: f64::INFINITY,
            met_horizon: false,
            hclk_hz,
            cpi_milli: (cpi * 1000.0).round() as u64,
            cycle_remainder: 0,
            exception_possible: false,
            nmi: false,
            debug_in_sleep: false,
            lint_blocks: [Vec::new(), Vec::new()],
            seen_updates: u64::MAX,
        }
    }

    /// Makes an instruction take so many cycles, rounded to a thousandth.
    pub(crate) fn set_cpi(&mut self, cpi: f64) {
        self.cpi_milli = (cpi * 1000.0).round() as u64;
    }

    /// HCLK cycles since power-on.
    #[must_use]
    pub(crate) const fn now(&self) -> u64 {
        self.now
    }

    /// Virtual seconds since power-on.
    #[must_use]
    pub(crate) fn seconds(&self) -> f64 {
        self.soc.seconds(self.now)
    }

    /// Schedules a stop at a time, s.
    pub(crate) fn stop_at(&mut self, seconds: f64) {
        self.next_stop_s = seconds;
        self.next_stop = self.soc.cycle_at(seconds);
        self.update_deadline();
    }

    /// Sets the time up to which the inputs are known, s: no block of instructions runs past it.
    pub(crate) fn set_horizon(&mut self, seconds: f64) {
        self.horizon_s = seconds;
        self.update_horizon();
    }

    /// An input will change, of which the peripherals do not know yet: they are advanced before the core goes on.
    pub(crate) const fn expect_change(&mut self) {
        self.deadline = 0;
    }

    /// The last cycle before the horizon: what is due at that time comes after it.
    fn update_horizon(&mut self) {
        self.horizon = match self.soc.cycle_at(self.horizon_s) {
            NEVER => NEVER,
            cycle => cycle.saturating_sub(1),
        };
    }

    /// True if the board is past its horizon: by the entry of an exception.
    #[must_use]
    pub(crate) const fn is_past_horizon(&self) -> bool {
        self.now > self.horizon
    }

    /// True if a sleep would pass the horizon.
    #[must_use]
    pub(crate) fn sleeps_past_horizon(&self) -> bool {
        self.sleeps_until() > self.horizon
    }

    /// True if so many instructions would pass the horizon.
    const fn would_pass_horizon(&self, instructions: u32) -> bool {
        let instructions = instructions as u64;
        let is_one_each = self.cpi_milli == 1000;
        let cycles =
            if is_one_each { instructions } else { (instructions * self.cpi_milli + self.cycle_remainder) / 1000 };
        self.now + cycles > self.horizon
    }

    /// True if the processor stopped before a block that would pass the horizon, and for nothing else.
    #[must_use]
    pub(crate) const fn has_met_horizon(&self) -> bool {
        self.met_horizon
    }

    /// True from the time that was set with [`BoardModel::stop_at`].
    #[must_use]
    pub(crate) const fn stop_is_due(&self) -> bool {
        self.now >= self.next_stop
    }

    /// True if an interrupt, a timer or an input can still end a sleep.
    #[must_use]
    pub(crate) fn can_wake(&self) -> bool {
        self.soc.next_event().is_some()
            || self.scs.systick.next_event().is_some()
            || self.plant.expects_change(self.seconds())
    }

    /// The next times at which something happens, in words, for a message.
    #[must_use]
    pub(crate) fn deadlines(&self) -> String {
        format!(
            "deadline {}, peripherals {:?}, SysTick {:?}, stop {} ({} s), exception possible: {}",
            self.deadline,
            self.soc.next_event(),
            self.scs.systick.next_event(),
            self.next_stop,
            self.next_stop_s,
            self.exception_possible
        )
    }

    /// Passes time until the flash operation that runs has ended: an access of a debugger to the flash interface waits for it.
    pub(crate) fn wait_for_flash(&mut self, memory: &mut dyn DmaMemory) {
        if let Some(seconds) = self.soc.flash_ends_at() {
            self.now = self.now.max(self.soc.cycle_at(seconds));
            self.sync(memory);
        }
    }

    /// Adds cycles that belong to no instruction.
    pub(crate) const fn add_cycles(&mut self, cycles: u64) {
        self.now += cycles;
    }

    fn sleeps_until(&self) -> u64 {
        self.deadline.max(self.now + 1)
    }

    /// Advances time to the deadline, with the core asleep. Returns the cycles slept.
    pub(crate) fn sleep(&mut self) -> u64 {
        let until = self.sleeps_until();
        let cycles = until - self.now;
        if !self.debug_in_sleep || self.scs.debug.is_halted() {
            self.scs.exclude_cycles(cycles);
        }
        self.now = until;
        cycles
    }

    /// True if a core that sleeps continues to sleep, and the run has nothing to report or to do before the deadline.
    /// `injection_s`: time of the next fault to inject, s.
    #[must_use]
    pub(crate) fn is_quiet(&self, injection_s: f64) -> bool {
        let asleep = !self.nvic.has_pending() && !self.event && !self.soc.clock_stopped() && !self.soc.core_waits();
        let silent = self.reset.is_none() && self.reached.is_none() && !self.plant.pulses.has_news();
        asleep && silent && !self.stop_is_due() && self.seconds() < injection_s
    }

    /// Advances the peripherals to the present, and updates interrupt lines and reset requests.
    pub(crate) fn sync(&mut self, memory: &mut dyn DmaMemory) {
        self.advance(memory);
        self.reset = self.reset.or_else(|| self.soc.take_reset());
        self.refresh();
    }

    fn advance(&mut self, memory: &mut dyn DmaMemory) {
        self.plant.pulses.instructions = self.instructions;
        self.soc.advance_to(self.now, &mut self.plant, memory);
        // Before the next write: the compare registers still hold what the pulse began with.
        if self.plant.pulses.awaits_programmed() {
            let programmed = TIM1_CCR.step_by(4).map(|addr| f64::from(self.soc.read(addr, Width::Word)));
            let mut us = [0.0; 4];
            us.iter_mut().zip(programmed).for_each(|(us, programmed)| *us = programmed);
            self.plant.pulses.note_programmed(us);
        }
    }

    fn refresh(&mut self) {
        self.nvic.set_lines(self.soc.irq_lines());
        let nmi = self.soc.nmi_line();
        if nmi && !self.nmi {
            self.nvic.pend(nvic::NMI);
        }
        self.nmi = nmi;
        self.scs.advance(self.now, &mut self.nvic);
        if self.nvic.take_newly_pending() && self.scs.event_on_pending() {
            self.event = true;
        }
        self.exception_possible = self.is_deliverable(Masks::default());
        if self.soc.hclk_hz() != self.hclk_hz {
            self.hclk_hz = self.soc.hclk_hz();
            self.next_stop = self.soc.cycle_at(self.next_stop_s);
            self.update_horizon();
        }
        if self.scs.reset_requested {
            self.reset = self.reset.or(Some(ResetCause::Software));
        }
        let lints = [self.soc.lints().len(), self.scs.lints().len()];
        for (blocks, count) in self.lint_blocks.iter_mut().zip(lints) {
            blocks.resize(count, self.block);
        }
        self.seen_updates = self.soc.updates();
        self.update_deadline();
    }

    /// Lints of the peripherals, and of the core, each in the order of first occurrence.
    #[must_use]
    pub(crate) fn lints(&self) -> [&[Lint]; 2] {
        [self.soc.lints(), self.scs.lints()]
    }

    /// Address of the block that ran at the first occurrence of lint `n` of a source (0 peripherals, 1 core).
    #[must_use]
    pub(crate) fn lint_block(&self, source: usize, n: usize) -> u32 {
        self.lint_blocks[source].get(n).copied().unwrap_or(self.block)
    }

    fn update_deadline(&mut self) {
        let events = [self.soc.next_event(), self.scs.systick.next_event(), Some(self.next_stop)];
        self.deadline = if self.reset.is_some() { 0 } else { events.into_iter().flatten().min().unwrap_or(NEVER) };
    }

    /// Resets everything except time, counters and the plant.
    pub(crate) fn restart(&mut self, cause: ResetCause, memory: &mut dyn DmaMemory) {
        // The models stop at a watchdog timeout, which may lie before the end of the last block.
        self.now = self.soc.now();
        self.soc.reset(cause);
        self.advance(memory);
        let seconds = self.seconds();
        self.plant.pulses.reset(seconds);
        self.nvic = Nvic::default();
        self.scs.reset();
        self.scs.debug.reset(cause == ResetCause::PowerOn);
        (self.event, self.reset, self.nmi, self.debug_in_sleep, self.cycle_remainder) = (false, None, false, false, 0);
        self.refresh();
    }

    /// Reads TIM1's main output enable while it is set, because the break input clears it without a write.
    pub(crate) fn check_outputs(&mut self) {
        if self.plant.pulses.armed() && !self.output_enable() {
            self.set_armed(false);
        }
    }

    fn output_enable(&mut self) -> bool {
        self.soc.read(TIM1_BDTR, Width::Word) & MOE != 0
    }

    /// Measures a write of a pulse width against the frames of TIM1, which counts microseconds.
    fn note_width_written(&mut self) {
        let [count, last] = [TIM1_CNT, TIM1_ARR].map(|addr| self.soc.read(addr, Width::Word));
        self.plant.pulses.note_width_written(f64::from(count.min((last + 1).saturating_sub(count))));
    }

    fn set_armed(&mut self, armed: bool) {
        let seconds = self.seconds();
        self.plant.pulses.set_armed(armed, seconds);
    }

    /// Adds the cycles of instructions that do not take one cycle each.
    #[inline(never)]
    fn spend(&mut self, instructions: u32) {
        let spent = u64::from(instructions) * self.cpi_milli + self.cycle_remainder;
        self.now += spent / 1000;
        self.cycle_remainder = spent % 1000;
    }

    #[inline(never)]
    fn is_deliverable(&self, masks: Masks) -> bool {
        self.deliverable(masks).is_some()
    }

    /// The exception to take now. C_MASKINTS of a debugger leaves NMI and the faults (ARMv7-M ARM, C1.6.2).
    pub(crate) fn deliverable(&self, masks: Masks) -> Option<u8> {
        let is_masked = self.scs.debug.masks_interrupts();
        self.nvic.deliverable(masks).filter(|number| !is_masked || *number < nvic::PEND_SV)
    }

    #[cold]
    fn note_watched(&mut self, pc: u32) {
        if let Some(n) = self.watched.iter().position(|&watched| watched == pc) {
            self.reached = Some(self.watched.swap_remove(n));
            self.deadline = 0;
        }
    }

    /// True while the core runs code in RAM: only a debugger puts it there, to program the flash.
    const fn runs_in_ram(&self) -> bool {
        self.block >= FIRST_RAM
    }

    /// Passes the time of a poll of the flash that is busy, to the end of its operation at most.
    fn pass_poll(&mut self) {
        if let Some(end) = self.soc.flash_ends_at() {
            let poll = self.seconds() + POLL_S;
            self.now = self.now.max(self.soc.cycle_at(end.min(poll)));
        }
    }

    /// Irregular accesses are recorded as lints, but for those of a debugger and of its code.
    fn choose_lints(&mut self) {
        let are_recorded = !self.is_debugger && !self.runs_in_ram();
        self.soc.record_lints(are_recorded);
        self.scs.ignores_lints = !are_recorded;
    }

    fn is_core(addr: u32) -> bool {
        (0xE000_0000..0xE004_2000).contains(&addr) || (0xE004_2400..0xE010_0000).contains(&addr)
    }

    /// Records a use of the FPU that is a UsageFault on the chip; the emulator executes it.
    pub(crate) fn note_fpu_use(&mut self) {
        if !self.scs.fpu_enabled() {
            let kind = LintKind::Misuse(
                "floating-point instruction while CPACR keeps the FPU off: the chip takes a UsageFault",
            );
            self.scs.record_lint(kind, 0xE000_ED88, Width::Word, None, self.now);
        }
    }
}

impl Machine for BoardModel {
    fn before_block(&mut self, instructions: u32, masks: impl FnOnce() -> Masks) -> bool {
        if self.now >= self.deadline || self.exception_possible && self.is_deliverable(masks()) {
            self.met_horizon = false;
            return true;
        }
        self.met_horizon = self.would_pass_horizon(instructions);
        self.met_horizon
    }

    fn charge(&mut self, pc: u32, instructions: u32) {
        self.block = pc;
        self.instructions += u64::from(instructions);
        if self.cpi_milli == 1000 {
            self.now += u64::from(instructions);
        } else {
            self.spend(instructions);
        }
        if !self.watched.is_empty() {
            self.note_watched(pc);
        }
    }

    fn stay(&mut self) {
        // Without an access nothing changes before the deadline, and no pass ends behind the horizon.
        let cycles = self.deadline.min(self.horizon).saturating_sub(self.now).min(u64::from(u32::MAX));
        let passes = (cycles * 1000).saturating_sub(self.cycle_remainder) / self.cpi_milli;
        let passes = u32::try_from(passes).unwrap_or(u32::MAX);
        self.instructions += u64::from(passes);
        self.spend(passes);
    }

    fn send_event(&mut self) {
        self.event = true;
    }

    fn load(&mut self, addr: u32, width: Width, memory: &mut dyn DmaMemory) -> u32 {
        self.choose_lints();
        if Self::is_core(addr) {
            self.scs.advance(self.now, &mut self.nvic);
            return self.scs.read(addr, width, &self.nvic, self.now);
        }
        if addr == FLASH_SR && self.runs_in_ram() && !self.is_debugger {
            self.pass_poll();
        }
        self.advance(memory);
        let value = self.soc.read(addr, width);
        // A loop that waits reads a register thousands of times, and nothing changes.
        if self.soc.updates() != self.seen_updates {
            self.reset = self.reset.or_else(|| self.soc.take_reset());
            self.refresh();
        }
        value
    }

    fn store(&mut self, addr: u32, width: Width, value: u32, memory: &mut dyn DmaMemory) {
        self.choose_lints();
        if Self::is_core(addr) {
            self.scs.advance(self.now, &mut self.nvic);
            self.scs.write(addr, width, value, &mut self.nvic, self.now);
            self.refresh();
            return;
        }
        self.advance(memory);
        if TIM1_CCR.contains(&addr) && self.plant.pulses.armed() {
            self.note_width_written();
        }
        self.soc.write(addr, width, value);
        let armed = match addr & !3 {
            TIM1_BDTR => Some(self.output_enable()),
            RCC_APB2RSTR if value & 1 != 0 => Some(false),
            _ => None,
        };
        // Arming is recorded before the edges that it enables, disarming after the edge that it causes.
        if armed == Some(true) {
            self.set_armed(true);
        }
        self.advance(memory);
        if armed == Some(false) {
            self.set_armed(false);
        }
        if addr == DBGMCU_CR {
            self.debug_in_sleep = value & DBG_SLEEP != 0;
        }
        self.reset = self.reset.or_else(|| self.soc.take_reset());
        self.refresh();
    }

    fn store_to_flash(&mut self, addr: u32, width: Width, value: u32, memory: &mut dyn DmaMemory) -> bool {
        self.advance(memory);
        if !self.soc.flash_accepts_stores() {
            return false;
        }
        self.soc.store_to_flash(FLASH | addr, width, value);
        self.refresh();
        if !self.runs_in_ram() {
            // A fetch from flash waits now.
            self.deadline = 0;
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stm32f4_model::{NoMemory, SocConfig};

    fn asleep() -> BoardModel {
        let mut board = BoardModel::new(Soc::new(SocConfig::default()), BoardPlant::default(), 1.0);
        board.stop_at(1e-3);
        board.sync(&mut NoMemory);
        board
    }

    #[test]
    fn a_sleep_is_quiet_until_something_is_to_do() {
        assert!(asleep().is_quiet(f64::INFINITY));
        let disturbances: [fn(&mut BoardModel); 5] = [
            |board| board.nvic.pend(nvic::PEND_SV),
            |board| board.event = true,
            |board| board.reset = Some(ResetCause::Software),
            |board| board.set_armed(true),
            |board| assert_eq!(board.sleep(), 16_000, "1 ms at 16 MHz"),
        ];
        for (n, disturb) in disturbances.iter().enumerate() {
            let mut board = asleep();
            disturb(&mut board);
            assert!(!board.is_quiet(f64::INFINITY), "disturbance {n}");
        }
        assert!(!asleep().is_quiet(0.0), "a fault is to be injected");
    }

    /// The passes of a branch to itself, one by one and as many as nothing would stop.
    #[test]
    fn passes_that_are_only_counted_end_where_executed_ones_would() {
        let no_masks = || -> Masks { unreachable!("no exception is possible") };
        for cpi in [0.1, 0.7, 1.0, 1.3, 2.999, 20.0] {
            for (deadline, horizon) in [(1_000, u64::MAX), (1_001, 1_000), (997, 1_003), (5, 5), (0, u64::MAX)] {
                let board = || {
                    let mut board = BoardModel::new(Soc::new(SocConfig::default()), BoardPlant::default(), cpi);
                    board.now = 2;
                    (board.deadline, board.horizon) = (deadline, horizon);
                    board.charge(0x0800_0000, 3);
                    board
                };
                let (mut executed, mut counted) = (board(), board());
                counted.stay();
                for board in [&mut executed, &mut counted] {
                    while !board.before_block(1, no_masks) {
                        board.charge(0x0800_0000, 1);
                    }
                }
                let at = |board: &BoardModel| (board.now, board.cycle_remainder, board.instructions, board.met_horizon);
                assert_eq!(at(&counted), at(&executed), "{cpi} cycles each, to {deadline} and {horizon}");
            }
        }
    }
}
