//! The chip without its core: all peripheral blocks on one bus and one time base.
//!
//! - `access`: reads and writes by the core or DMA.
//! - `events`: order of events, triggers, conversions, transfers, watchdog.
//! - `faults`: what a caller can break.
//! - `clock_tree`: effects of RCC: clocks, resets, ratings.
//! - `low_speed`: what the watchdog's clock drives, and the timers that measure a clock.
//! - `pin_levels`: state of the pins.
//! - `pins`: effects of pin levels on IDR, EXTI and break inputs.

mod access;
mod clock_tree;
mod events;
mod faults;
mod low_speed;
mod pin_levels;
mod pins;

use std::collections::vec_deque::Drain;
use std::collections::{HashMap, VecDeque};

use crate::adc::{Adc, AdcCommonRegisters, Conversion};
use crate::bus::Width;
use crate::clock::{ClockTree, Timebase};
use crate::config::SocConfig;
use crate::dbgmcu::Dbgmcu;
use crate::dma::{Dma, DmaSource};
use crate::exti::{Exti, Syscfg};
use crate::flash::{Flash, FlashOperation};
use crate::gpio::Gpio;
use crate::iwdg::Iwdg;
use crate::lint::{Lint, LintKind};
use crate::measured_clock::{Capture, MEASURED};
use crate::oscillator::Oscillator;
use crate::pin::Pin;
use crate::pwr::Pwr;
use crate::rcc::Rcc;
use crate::reset::ResetCause;
use crate::supply::Supply;
use crate::tim::{TIMERS, Timer};
use crate::usart::{SERIAL_IN, Usart};

use pin_levels::Pins;

/// Number of results kept for [`Soc::conversions`]; older ones are dropped.
const KEPT_CONVERSIONS: usize = 1 << 16;

/// The peripherals of the chip.
///
/// Time is counted in HCLK cycles since power-on. The caller models the core, and calls [`Soc::advance_to`] with the cycle of each register
/// access before the access, which itself takes no time. An access or an advance may move [`Soc::next_event`] in either direction.
///
/// ```
/// use stm32f4_model::{NoMemory, Pin, Plant, Soc, SocConfig, Width};
///
/// struct Scope(Vec<(Pin, bool, f64)>);
/// impl Plant for Scope {
///     fn volts(&mut self, _: stm32f4_model::AdcChannel, _: f64) -> f64 { 0.0 }
///     fn input_level(&mut self, _: Pin, _: f64) -> bool { false }
///     fn record_edge(&mut self, pin: Pin, level: bool, seconds: f64) { self.0.push((pin, level, seconds)) }
/// }
///
/// let mut soc = Soc::new(SocConfig::default());
/// let mut scope = Scope(Vec::new());
/// soc.write(0x4002_3830, Width::Word, 1 << 3); // RCC_AHB1ENR: clock for port D
/// soc.write(0x4002_0C00, Width::Word, 1 << 24); // GPIOD_MODER: PD12 is an output
/// soc.advance_to(16_000, &mut scope, &mut NoMemory); // 1 ms at 16 MHz
/// soc.write(0x4002_0C18, Width::Word, 1 << 12); // GPIOD_BSRR: LED on
/// soc.advance_to(16_001, &mut scope, &mut NoMemory);
/// assert_eq!(scope.0, [(Pin::new('D', 12).unwrap(), true, 0.001)]);
/// assert!(soc.lints().is_empty());
/// ```
#[derive(Debug)]
pub struct Soc {
    config: SocConfig,
    now: u64,
    time: Timebase,
    clocks: ClockTree,
    rcc: Rcc,
    pwr: Pwr,
    flash: Flash,
    /// Flash operations that have ended or were cut, for the caller, which holds the memory.
    flash_operations: Vec<FlashOperation>,
    supply: Supply,
    dbgmcu: Dbgmcu,
    /// A debugger has halted the core.
    halted: bool,
    syscfg: Syscfg,
    exti: Exti,
    lsi: Oscillator,
    /// HSE_RTC: the crystal after its prescaler.
    hse_rtc: Oscillator,
    iwdg: Iwdg,
    gpio: [Gpio; 9],
    /// Index is the number of the timer; 0 is unused.
    timers: [Timer; 15],
    adcs: [Adc; 3],
    adc_common: AdcCommonRegisters,
    dma: [Dma; 2],
    usart2: Usart,
    /// Characters that left the chip.
    serial: Vec<u8>,
    pins: Pins,
    lines: [u32; 3],
    /// DMA requests of timers that have not been served yet.
    requests: Vec<DmaSource>,
    /// Cycle of the watchdog timeout; `u64::MAX`: not started.
    watchdog_at: u64,
    /// The next capture of each measured clock; `None`: nothing is captured.
    captures: [Option<Capture>; MEASURED.len()],
    reset_request: Option<ResetCause>,
    /// Cycle of the end of a flash operation, and of a reset by the supply; `u64::MAX`: none is scheduled.
    flash_at: u64,
    released_at: u64,
    /// Cycles of the next event, and of the next event with a visible effect; `u64::MAX`: none.
    next: u64,
    next_visible: u64,
    /// The same without the inputs.
    scheduled: u64,
    scheduled_visible: u64,
    /// A register access or a transfer was made since the interrupt lines and `scheduled` were updated.
    stale: bool,
    /// A register access has moved the next event of a timer since `scheduled` was updated.
    schedule_stale: bool,
    /// Nothing was accessed or broken since the last advance, which carried out all that was due.
    is_settled: bool,
    /// Number of updates of the interrupt lines or the next event, and of new lints.
    updates: u64,
    records_lints: bool,
    lints: Vec<Lint>,
    lint_index: HashMap<(u32, Width, LintKind, bool), usize>,
    conversions: VecDeque<Conversion>,
}

impl Soc {
    /// A chip at power-on.
    #[must_use]
    pub fn new(config: SocConfig) -> Self {
        let rcc = Rcc::new(config.chip, config.hse_hz, config.hse_ready, config.lse_ready);
        let clocks = rcc.clocks();
        let mut soc = Soc {
            now: 0,
            time: Timebase::new(clocks.hclk),
            clocks,
            rcc,
            pwr: Pwr::new(config.chip),
            flash: Flash::new(config.chip, config.bor_level),
            flash_operations: Vec::new(),
            supply: Supply::new(config.vdd, config.brown_out_threshold, config.bor_level),
            dbgmcu: Dbgmcu::new(config.chip),
            halted: false,
            syscfg: Syscfg::default(),
            exti: Exti::default(),
            lsi: Oscillator::new(config.lsi_hz),
            hse_rtc: Oscillator::new(0.0),
            iwdg: Iwdg::new(),
            gpio: std::array::from_fn(Gpio::new),
            timers: std::array::from_fn(|number| Timer::new(&TIMERS[number], 0)),
            adcs: std::array::from_fn(Adc::new),
            adc_common: AdcCommonRegisters::default(),
            dma: [Dma::new(), Dma::new()],
            usart2: Usart::new(),
            serial: Vec::new(),
            pins: Pins::new(),
            lines: [0; 3],
            requests: Vec::new(),
            watchdog_at: u64::MAX,
            captures: [None; MEASURED.len()],
            reset_request: None,
            flash_at: u64::MAX,
            released_at: u64::MAX,
            next: u64::MAX,
            next_visible: u64::MAX,
            scheduled: u64::MAX,
            scheduled_visible: u64::MAX,
            stale: false,
            schedule_stale: false,
            is_settled: false,
            updates: 0,
            records_lints: true,
            lints: Vec::new(),
            lint_index: HashMap::new(),
            conversions: VecDeque::new(),
            config,
        };
        soc.rcc.set_lsi_works(soc.lsi.oscillates());
        soc.apply_clock_tree();
        soc.refresh();
        soc
    }

    /// Configuration of the chip.
    #[must_use]
    pub fn config(&self) -> &SocConfig {
        &self.config
    }

    /// Present time, HCLK cycles since power-on. A reset does not set it back.
    #[must_use]
    pub fn now(&self) -> u64 {
        self.now
    }

    /// Cycle of the next event that can change an interrupt line or a pin, or request a reset; `None`: no such event is scheduled.
    ///
    /// The cycle is never later than the first change, but the event may turn out to change nothing. Input changes are included if the
    /// plant announces them ([`crate::Plant::next_pin_change`]).
    #[must_use]
    pub fn next_event(&self) -> Option<u64> {
        (self.next_visible != u64::MAX).then_some(self.next_visible)
    }

    /// Levels of the 82 peripheral interrupt lines: bit n % 32 of word n / 32 is IRQ n.
    #[must_use]
    pub fn irq_lines(&self) -> &[u32; 3] {
        &self.lines
    }

    /// A number that changes whenever the interrupt lines, the next event, the number of lints or a request of a reset may have changed.
    #[must_use]
    pub fn updates(&self) -> u64 {
        self.updates
    }

    /// Level of the NMI line: high from a crystal failure with the clock security system on until RCC_CIR.CSSC is written.
    #[must_use]
    pub fn nmi_line(&self) -> bool {
        self.rcc.nmi()
    }

    /// True while the core has no clock, because its crystal failed with the clock security system off. The cycle count then continues at
    /// the last frequency; the core must not execute, and only the watchdog runs.
    #[must_use]
    pub fn clock_stopped(&self) -> bool {
        self.rcc.stopped()
    }

    /// True while the core stands still although it has a clock: the chip is held in reset, or the flash is erased or programmed, so that a fetch from
    /// it waits (RM0090 3.6). A program in RAM goes on meanwhile: see [`Soc::is_held_in_reset`].
    #[must_use]
    pub fn core_waits(&self) -> bool {
        self.is_held_in_reset() || self.flash.ends_at().is_some()
    }

    /// True while the supply or the reset pin holds the chip in reset.
    #[must_use]
    pub fn is_held_in_reset(&self) -> bool {
        self.supply.held_until() > self.time.seconds(self.now) + 1e-12
    }

    /// Time of the end of the flash operation that runs, s; `None`: none runs.
    #[must_use]
    pub fn flash_ends_at(&self) -> Option<f64> {
        self.flash.ends_at()
    }

    /// True where a store to the flash programs it: FLASH_CR is unlocked, and PG is set (RM0090 3.6.4).
    #[must_use]
    pub fn flash_accepts_stores(&self) -> bool {
        self.flash.accepts_stores()
    }

    /// Whether lints are recorded. They are not for accesses of a debugger, which may look at any address.
    pub fn record_lints(&mut self, are_recorded: bool) {
        self.records_lints = are_recorded;
    }

    /// Takes the flash operations that have ended or were cut since the last call, in order. The caller applies them to its memory.
    pub fn take_flash_operations(&mut self) -> Vec<FlashOperation> {
        std::mem::take(&mut self.flash_operations)
    }

    /// Takes a reset request of the chip, to which the caller responds with [`Soc::reset`]. [`Soc::advance_to`] stops at its cycle.
    pub fn take_reset(&mut self) -> Option<ResetCause> {
        self.reset_request.take()
    }

    /// Resets all blocks at the present cycle (RM0090 6.1.1) and sets the cause in RCC_CSR. A power-on also clears the backup domain and the
    /// debug registers. The chip drives no pin afterwards. Time, lints and conversions are kept.
    pub fn reset(&mut self, cause: ResetCause) {
        self.flash_operations.extend(self.flash.cut(self.time.seconds(self.now)));
        self.rcc.reset(cause);
        self.pwr = Pwr::new(self.config.chip);
        self.flash.reset();
        self.syscfg = Syscfg::default();
        self.exti = Exti::default();
        self.iwdg = Iwdg::new();
        self.adc_common = AdcCommonRegisters::default();
        self.dma = [Dma::new(), Dma::new()];
        self.usart2 = Usart::new();
        self.gpio = std::array::from_fn(Gpio::new);
        self.timers = std::array::from_fn(|number| Timer::new(&TIMERS[number], self.now));
        self.adcs.iter_mut().for_each(Adc::reset);
        if cause == ResetCause::PowerOn {
            self.dbgmcu = Dbgmcu::new(self.config.chip);
        }
        self.halted = false;
        self.requests.clear();
        self.captures = [None; MEASURED.len()];
        self.reset_request = None;
        self.apply_clock_tree();
        self.refresh();
    }

    /// AHB clock, Hz, rounded.
    #[must_use]
    pub fn hclk_hz(&self) -> u32 {
        self.clocks.hclk.round() as u32
    }

    /// Seconds from power-on to a cycle. For a future cycle the present clock is assumed.
    #[must_use]
    pub fn seconds(&self, cycle: u64) -> f64 {
        self.time.seconds(cycle)
    }

    /// The first cycle that is not before a time, s, with the present clock. Before the last clock change: the cycle of that change.
    #[must_use]
    pub fn cycle_at(&self, seconds: f64) -> u64 {
        self.time.cycle_at(seconds)
    }

    /// The lints so far, in the order of first occurrence.
    #[must_use]
    pub fn lints(&self) -> &[Lint] {
        &self.lints
    }

    /// Removes and returns the ADC results since the last call; only the last 65 536 are kept.
    pub fn conversions(&mut self) -> Drain<'_, Conversion> {
        self.conversions.drain(..)
    }

    /// Removes and returns the characters that USART2 has sent since the last call.
    pub fn take_serial(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.serial)
    }

    /// Puts characters on the line to USART2, one after the other at its own rate. They are lost while its receiver is off or has no pin.
    pub fn put_serial(&mut self, bytes: &[u8]) {
        if self.has_pin(&SERIAL_IN) {
            self.usart2.put(bytes, self.now);
            self.refresh();
        }
    }

    /// Level of a pin as an output. A pin that the chip does not drive counts as low; a timer pin that is not driven, as its pull-up.
    #[must_use]
    pub fn output_level(&self, pin: Pin) -> bool {
        self.pins.output(pin)
    }

    /// Tells the peripherals that a debugger halts the core, until [`Soc::resume`] or the next reset: those with a freeze bit in DBGMCU stop (38.16.2).
    pub fn halt(&mut self) {
        self.set_halted(true);
    }

    /// Tells the peripherals that the core goes on after a halt.
    pub fn resume(&mut self) {
        self.set_halted(false);
    }

    fn set_halted(&mut self, is_halted: bool) {
        let cycle = self.now;
        for timer in &mut self.timers {
            // Signals up to the present cycle were routed by the last advance.
            let _ = timer.run_to(cycle);
        }
        self.halted = is_halted;
        let periods = self.lsi.periods(self.time.seconds(cycle));
        self.iwdg.freeze((is_halted && self.dbgmcu.stops_watchdog()).then_some(periods), periods);
        self.apply_clock_tree();
        self.schedule_low_speed();
        self.refresh();
    }

    /// Records a lint.
    fn lint(&mut self, addr: u32, width: Width, kind: LintKind, write: Option<u32>) {
        if !self.records_lints {
            return;
        }
        let key = (addr, width, kind, write.is_some());
        match self.lint_index.get(&key) {
            Some(&index) => self.lints[index].count += 1,
            None => {
                self.updates += 1;
                self.lint_index.insert(key, self.lints.len());
                let (value, write) = (write.unwrap_or(0), write.is_some());
                self.lints.push(Lint { cycle: self.now, addr, width, kind, write, value, count: 1 });
            }
        }
    }
}
