//! The chip around the core: all blocks on one bus with one clock.
//!
//! - `access`: what a read or write of the core, or of DMA, reaches.
//! - `events`: time: who is due next, triggers, conversions, transfers, the watchdog.
//! - `tree`: consequences of RCC: clocks, resets, ratings.
//! - `pins`: levels of the pins, EXTI, break inputs.

mod access;
mod events;
mod pins;
mod tree;

use std::collections::vec_deque::Drain;
use std::collections::{HashMap, VecDeque};

use crate::adc::{Adc, Common, Conversion};
use crate::bus::Width;
use crate::clock::{Clocks, Timebase};
use crate::config::SocConfig;
use crate::dbgmcu::Dbgmcu;
use crate::dma::{Dma, Source};
use crate::exti::{Exti, Syscfg};
use crate::flash::Flash;
use crate::gpio::Gpio;
use crate::iwdg::Iwdg;
use crate::lint::{Lint, LintKind};
use crate::pin::Pin;
use crate::pwr::Pwr;
use crate::rcc::Rcc;
use crate::reset::ResetCause;
use crate::tim::{TIMERS, Timer};

use pins::Pins;

/// Results kept for [`Soc::conversions`]; older ones are dropped.
const KEPT_CONVERSIONS: usize = 1 << 16;

/// The STM32F407VG around its core.
///
/// Time is counted in HCLK cycles since power-on. The caller runs the core, and before each access to a register advances to the cycle of
/// that access; an access then takes no time. After an access or an advance [`Soc::next_event`] may have moved, in either direction.
///
/// ```
/// use stm32f4_model::{NoMemory, Pin, Plant, Soc, SocConfig, Width};
///
/// struct Scope(Vec<(Pin, bool, f64)>);
/// impl Plant for Scope {
///     fn volts(&mut self, _: stm32f4_model::AdcChannel, _: f64) -> f64 { 0.0 }
///     fn pin(&mut self, _: Pin, _: f64) -> bool { false }
///     fn edge(&mut self, pin: Pin, level: bool, seconds: f64) { self.0.push((pin, level, seconds)) }
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
    clocks: Clocks,
    rcc: Rcc,
    pwr: Pwr,
    flash: Flash,
    dbgmcu: Dbgmcu,
    syscfg: Syscfg,
    exti: Exti,
    iwdg: Iwdg,
    gpio: [Gpio; 9],
    /// By number; 0 is no timer.
    timers: [Timer; 15],
    adcs: [Adc; 3],
    adc_common: Common,
    dma: [Dma; 2],
    pins: Pins,
    lines: [u32; 3],
    /// DMA requests of timers that have not been served yet.
    requests: Vec<Source>,
    /// Cycle of the watchdog's bite.
    bite_at: u64,
    reset_request: Option<ResetCause>,
    /// Cycles of the next event at all, and of the next that the outside can see.
    next: u64,
    next_visible: u64,
    lints: Vec<Lint>,
    lint_index: HashMap<(u32, Width, LintKind, bool), usize>,
    conversions: VecDeque<Conversion>,
}

impl Soc {
    /// A chip that has just been switched on.
    #[must_use]
    pub fn new(config: SocConfig) -> Self {
        let rcc = Rcc::new(config.hse_hz, config.hse_ready, config.lse_ready);
        let clocks = rcc.clocks();
        let mut soc = Soc {
            now: 0,
            time: Timebase::new(clocks.hclk),
            clocks,
            rcc,
            pwr: Pwr::new(),
            flash: Flash::new(),
            dbgmcu: Dbgmcu::default(),
            syscfg: Syscfg::default(),
            exti: Exti::default(),
            iwdg: Iwdg::new(config.lsi_hz),
            gpio: std::array::from_fn(Gpio::new),
            timers: std::array::from_fn(|number| Timer::new(&TIMERS[number], 0)),
            adcs: std::array::from_fn(Adc::new),
            adc_common: Common::default(),
            dma: [Dma::new(), Dma::new()],
            pins: Pins::new(),
            lines: [0; 3],
            requests: Vec::new(),
            bite_at: u64::MAX,
            reset_request: None,
            next: u64::MAX,
            next_visible: u64::MAX,
            lints: Vec::new(),
            lint_index: HashMap::new(),
            conversions: VecDeque::new(),
            config,
        };
        soc.apply_tree();
        soc.refresh();
        soc
    }

    /// The configuration the chip was made with.
    #[must_use]
    pub fn config(&self) -> &SocConfig {
        &self.config
    }

    /// Present time, HCLK cycles since power-on. Resets do not set it back.
    #[must_use]
    pub fn now(&self) -> u64 {
        self.now
    }

    /// Cycle of the next event that can change an interrupt line or a pin, or request a reset; `None`: nothing is under way.
    ///
    /// May name a cycle at which nothing turns out to change, never a later one than the first change. Input pins are included as far as
    /// the plant announces them ([`crate::Plant::next_pin_change`]).
    #[must_use]
    pub fn next_event(&self) -> Option<u64> {
        (self.next_visible != u64::MAX).then_some(self.next_visible)
    }

    /// Levels of the 82 peripheral interrupt lines: bit n of the 96 is IRQ n.
    #[must_use]
    pub fn irq_lines(&self) -> &[u32; 3] {
        &self.lines
    }

    /// The core's NMI line: high from a failure of the crystal under the clock security system until RCC_CIR.CSSC is written.
    #[must_use]
    pub fn nmi_line(&self) -> bool {
        self.rcc.nmi()
    }

    /// True while the core has no clock, because the crystal that clocks it has failed without the clock security system. Cycles then
    /// go on as time at the last frequency; the core must not execute, and only the watchdog still runs.
    #[must_use]
    pub fn clock_stopped(&self) -> bool {
        self.rcc.stopped()
    }

    /// A reset that the chip itself wants: answer it with [`Soc::reset`]. [`Soc::advance_to`] stops at the cycle of the request.
    pub fn take_reset(&mut self) -> Option<ResetCause> {
        self.reset_request.take()
    }

    /// Resets all blocks at the present cycle (RM0090 6.1.1). RCC_CSR remembers the cause; a power-on also clears the backup domain and
    /// the debug registers. Pins are let go; time, lints and conversions stay.
    pub fn reset(&mut self, cause: ResetCause) {
        self.rcc.reset(cause);
        self.pwr = Pwr::new();
        self.flash = Flash::new();
        self.syscfg = Syscfg::default();
        self.exti = Exti::default();
        self.iwdg = Iwdg::new(self.config.lsi_hz);
        self.adc_common = Common::default();
        self.dma = [Dma::new(), Dma::new()];
        self.gpio = std::array::from_fn(Gpio::new);
        self.timers = std::array::from_fn(|number| Timer::new(&TIMERS[number], self.now));
        self.adcs = std::array::from_fn(Adc::new);
        if cause == ResetCause::PowerOn {
            self.dbgmcu = Dbgmcu::default();
        }
        self.requests.clear();
        self.reset_request = None;
        self.apply_tree();
        self.refresh();
    }

    /// AHB clock, Hz, rounded.
    #[must_use]
    pub fn hclk_hz(&self) -> u32 {
        self.clocks.hclk.round() as u32
    }

    /// Seconds from power-on to a cycle, through all clock changes. For a cycle to come: if the clock stays as it is.
    #[must_use]
    pub fn seconds(&self, cycle: u64) -> f64 {
        self.time.seconds(cycle)
    }

    /// The first cycle that is not before a time, with the clock as it is; a time before the last clock change gives the cycle of that.
    #[must_use]
    pub fn cycle_at(&self, seconds: f64) -> u64 {
        self.time.cycle_at(seconds)
    }

    /// What was recorded so far, in the order of first occurrence.
    #[must_use]
    pub fn lints(&self) -> &[Lint] {
        &self.lints
    }

    /// Takes out the ADC results delivered since the last call; only the last 65 536 are kept.
    pub fn conversions(&mut self) -> Drain<'_, Conversion> {
        self.conversions.drain(..)
    }

    /// The level that the chip puts on a pin: false for a pin that it does not drive, unless a timer has let it go to its pull-up.
    #[must_use]
    pub fn output_level(&self, pin: Pin) -> bool {
        self.pins.output(pin)
    }

    /// The crystal stops, and never starts again: not even after a reset.
    pub fn fail_hse(&mut self) {
        let cycle = self.now;
        for timer in &mut self.timers {
            // Whatever was due up to now has been reported.
            let _ = timer.run_to(cycle);
        }
        self.rcc.lose_hse();
        self.apply_tree();
        self.refresh();
    }

    /// The next regular result of a converter (0 to 2) finds the last one not yet taken, as after a bus that was held up: an overrun.
    pub fn hold_up_converter(&mut self, index: usize) {
        if let Some(adc) = self.adcs.get_mut(index) {
            adc.hold_up();
        }
    }

    /// The next transfer of a stream (0 to 7) of a DMA controller (0 or 1) meets a bus error: a transfer error.
    pub fn cut_transfer(&mut self, controller: usize, stream: usize) {
        if let Some(dma) = self.dma.get_mut(controller).filter(|_| stream < 8) {
            dma.cut(stream);
        }
    }

    /// Records an access.
    fn lint(&mut self, addr: u32, width: Width, kind: LintKind, write: Option<u32>) {
        let key = (addr, width, kind, write.is_some());
        match self.lint_index.get(&key) {
            Some(&index) => self.lints[index].count += 1,
            None => {
                self.lint_index.insert(key, self.lints.len());
                let (value, write) = (write.unwrap_or(0), write.is_some());
                self.lints.push(Lint { cycle: self.now, addr, width, kind, write, value, count: 1 });
            }
        }
    }
}
