//! TIM1 to TIM14: edge-aligned up-counting, output compare and PWM, trigger output, break (RM0090 chapters 17 to 20).
//!
//! Not modelled, and recorded as lints when selected: down and centre-aligned counting, input capture other than that of a measured clock, slave modes,
//! external clock, encoder, dead time, commutation preload, DMA bursts.
//!
//! - `bits`: bit masks of the registers.
//! - `capture`: input capture of LSI and of the crystal.
//! - `counter`: prescaler, period, repetition, preload registers.
//! - `registers`: effects of reads and writes.
//! - `output`: from the reference level of a channel to its pins, and the break.
//! - `table`: features and pins of the 14 timers.

pub(crate) mod bits;
mod capture;
mod counter;
mod output;
mod registers;
mod table;

pub(crate) use table::{PinSignal, TIMERS, TimerFeatures, route};

use bits::{AOE, BIF, CC_DE_SHIFT, CC_IE, CCDS, COMIF, MOE, OPM, TIF, UDE, UDIS, UIE, UIF};
use counter::Counter;

/// Signals of a timer to ADCs, DMA and pins since its last update.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Signals {
    /// The trigger output rose or fell; a pulse does both.
    pub(crate) trgo_rise: bool,
    pub(crate) trgo_fall: bool,
    /// Channels whose reference level rose or fell while CCxE is set.
    pub(crate) cc_rise: u8,
    pub(crate) cc_fall: u8,
    /// DMA requests.
    pub(crate) dma_update: bool,
    pub(crate) dma_cc: u8,
}

impl Signals {
    fn pulse(&mut self) {
        self.trgo_rise = true;
        self.trgo_fall = true;
    }
}

/// Signals of a timer that other blocks use. Unused signals make no events, which saves time.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct UsedSignals {
    /// An ADC is triggered by TRGO.
    pub(crate) trgo: bool,
    /// Channels that trigger an ADC, one bit each.
    pub(crate) channels: u8,
    /// Channels that are connected to a pin, one bit each.
    pub(crate) pins: u8,
}

/// State of one timer.
#[derive(Debug, Clone)]
pub(crate) struct Timer {
    pub(crate) features: &'static TimerFeatures,
    counter: Counter,
    /// CR1 without CEN, which is `counter.enabled`.
    cr1: u32,
    cr2: u32,
    smcr: u32,
    dier: u32,
    sr: u32,
    ccmr: [u32; 2],
    ccer: u32,
    bdtr: u32,
    /// BDTR has been written: its LOCK field is fixed (17.4.18).
    lock_set: bool,
    option: u32,
    /// OCxREF, one bit for each channel.
    reference: u8,
    /// The break input is at its active level or the clock has failed.
    break_level: Option<bool>,
    clock_failed: bool,
    used: UsedSignals,
    /// Cycle of the next event with a used signal; `u64::MAX`: none.
    next: u64,
}

impl Timer {
    pub(crate) fn new(features: &'static TimerFeatures, at: u64) -> Self {
        Timer {
            features,
            counter: Counter::new(features.top, at),
            cr1: 0,
            cr2: 0,
            smcr: 0,
            dier: 0,
            sr: 0,
            ccmr: [0; 2],
            ccer: 0,
            bdtr: 0,
            lock_set: false,
            option: 0,
            reference: 0,
            break_level: None,
            clock_failed: false,
            used: UsedSignals::default(),
            next: u64::MAX,
        }
    }

    /// Cycle of the next event that changes an interrupt line, a pin, or makes a request; `u64::MAX`: none.
    pub(crate) fn next_event(&self) -> u64 {
        self.next
    }

    /// Sets the clock from `cycle` on: HCLK cycles per timer clock; `None`: no clock.
    pub(crate) fn set_clock(&mut self, cycle: u64, clock: Option<u64>) {
        // Signals up to `cycle` were routed by the advance to it.
        let _ = self.run_to(cycle);
        self.counter.set_clock(clock);
        self.counter.set_reference_cycle(cycle);
        self.refresh();
    }

    pub(crate) fn set_used_signals(&mut self, used: UsedSignals) {
        if self.used != used {
            self.used = used;
            self.refresh();
        }
    }

    /// MMS: the signal on the trigger output.
    fn mms(&self) -> u32 {
        self.cr2 >> 4 & 7
    }

    fn mode(&self, channel: usize) -> u32 {
        self.ccmr[channel / 2] >> (channel % 2 * 8 + 4) & 7
    }

    fn is_input(&self, channel: usize) -> bool {
        self.ccmr[channel / 2] >> (channel % 2 * 8) & 3 != 0
    }

    fn preloads(&self, channel: usize) -> bool {
        self.ccmr[channel / 2] >> (channel % 2 * 8 + 3) & 1 != 0
    }

    fn enabled_channels(&self) -> u8 {
        (0..4).filter(|channel| self.ccer >> (channel * 4) & 1 != 0).fold(0, |mask, channel| mask | 1 << channel)
    }

    /// Channels whose reference level is used, one bit each.
    fn used_references(&self) -> u8 {
        let mut seen = self.used.channels & self.enabled_channels();
        if self.used.trgo && self.mms() >= 4 {
            seen |= 1 << (self.mms() - 4);
        }
        seen | (self.used.pins & self.driving_channels())
    }

    /// Channels whose compare match is used, one bit each, and whether the overflow is used.
    fn used_events(&self) -> (u8, bool) {
        let by_channel = if self.cr2 & CCDS == 0 { self.dier >> CC_DE_SHIFT } else { 0 };
        let mut channels = ((self.dier & CC_IE) >> 1 | by_channel & 0xF) as u8 | self.used_references();
        if self.used.trgo && self.mms() == 3 {
            channels |= 1;
        }
        let overflow = channels != 0
            || self.dier & (UIE | UDE) != 0
            || self.used.trgo && self.mms() == 2
            || self.cr2 & CCDS != 0 && self.dier >> CC_DE_SHIFT & 0xF != 0
            || self.bdtr & AOE != 0
            || self.cr1 & OPM != 0;
        (channels, overflow)
    }

    /// Updates the cycle of the next event after a change.
    fn refresh(&mut self) {
        let (channels, overflow) = self.used_events();
        self.next = if self.counter.running() && overflow {
            self.counter.cycle_after(self.counter.next(channels).counts)
        } else {
            u64::MAX
        };
    }

    /// Advances the timer to a cycle and returns its signals.
    ///
    /// The caller must stop at every [`Timer::next_event`], so that each used signal belongs to the returned cycle.
    #[must_use]
    pub(crate) fn run_to(&mut self, cycle: u64) -> Signals {
        let mut signals = Signals::default();
        if !self.counter.running() {
            self.counter.set_reference_cycle(cycle);
            return signals;
        }
        let all = (1 << self.features.channels) - 1;
        if self.counter.next(all).counts > self.counter.counts_until(cycle) {
            // Neither an overflow nor a match: the next event keeps its cycle.
            self.counter.step_to(cycle);
            return signals;
        }
        let unused = !self.used_events().1;
        let mut periods = 0;
        while self.counter.running() {
            let event = self.counter.next(all);
            if event.counts > self.counter.counts_until(cycle) {
                self.counter.step_to(cycle);
                break;
            }
            self.counter.step(event.counts);
            if event.overflow {
                self.overflow(&mut signals);
                periods += 1;
                if unused && periods > 2 * (u64::from(self.counter.rcr.active) + 1) {
                    self.skip_periods(cycle);
                    periods = 0;
                }
            } else {
                self.compare(event.matches, &mut signals);
            }
        }
        self.refresh();
        signals
    }

    /// Skips pairs of update periods up to a cycle. After two periods without a used signal a further pair changes nothing: flags are set,
    /// shadow registers loaded, and toggling channels back at their level.
    fn skip_periods(&mut self, cycle: u64) {
        let pair = 2 * (u64::from(self.counter.rcr.active) + 1) * self.counter.period();
        let counts = self.counter.counts_until(cycle) / pair * pair;
        if counts > 0 {
            self.counter.skip(counts);
        }
    }

    /// Handles a wrap of the counter to 0.
    fn overflow(&mut self, signals: &mut Signals) {
        // 17.4.5: a compare value above ARR raises its flag at the overflow.
        let arr = self.counter.arr.active;
        let mut matches = self.channels_where(|timer, channel| timer.counter.ccr[channel].active > arr);
        if self.counter.repetitions == 0 {
            self.counter.repetitions = self.counter.rcr.active;
            if self.cr1 & UDIS == 0 {
                self.update(signals);
                self.sr |= UIF;
                signals.dma_update |= self.dier & UDE != 0;
                self.counter.enabled &= self.cr1 & OPM == 0;
            }
        } else {
            self.counter.repetitions -= 1;
        }
        matches |= self.channels_where(|timer, channel| timer.counter.ccr[channel].active == 0);
        self.compare(matches, signals);
    }

    fn channels_where(&self, wanted: impl Fn(&Self, usize) -> bool) -> u8 {
        (0..usize::from(self.features.channels))
            .filter(|&channel| wanted(self, channel))
            .fold(0, |mask, c| mask | 1 << c)
    }

    /// Performs an update event: shadow registers are loaded (17.3.1), TRGO pulses, AOE sets MOE (17.4.18).
    fn update(&mut self, signals: &mut Signals) {
        self.counter.psc.transfer();
        self.counter.arr.transfer();
        self.counter.rcr.transfer();
        self.counter.repetitions = self.counter.rcr.active;
        for ccr in &mut self.counter.ccr {
            ccr.transfer();
        }
        if self.mms() == 2 {
            signals.pulse();
        }
        if self.cr2 & CCDS != 0 {
            signals.dma_cc |= (self.dier >> CC_DE_SHIFT & 0xF) as u8;
        }
        if self.bdtr & AOE != 0 && !self.break_active() {
            self.bdtr |= MOE;
        }
    }

    /// Handles compare matches: flags, DMA requests, reference levels.
    fn compare(&mut self, matches: u8, signals: &mut Signals) {
        let matches = matches & !self.channels_where(Self::is_input);
        self.sr |= u32::from(matches) << 1;
        if self.cr2 & CCDS == 0 {
            signals.dma_cc |= matches & (self.dier >> CC_DE_SHIFT) as u8;
        }
        // 17.4.2: the compare pulse comes even if the flag is already set.
        if matches & 1 != 0 && self.mms() == 3 {
            signals.pulse();
        }
        self.update_references(matches, signals);
    }

    /// Updates OCxREF by OCxM (17.4.7). The PWM modes compare continuously, modes 1 to 3 act on a match.
    fn update_references(&mut self, matches: u8, signals: &mut Signals) {
        let before = self.reference;
        for channel in 0..usize::from(self.features.channels) {
            let bit = 1 << channel;
            let below = self.counter.cnt < self.counter.ccr[channel].active;
            let high = match self.mode(channel) {
                _ if self.is_input(channel) => false,
                1 if matches & bit != 0 => true,
                2 if matches & bit != 0 => false,
                3 if matches & bit != 0 => before & bit == 0,
                4 => false,
                5 => true,
                6 => below,
                7 => !below,
                _ => before & bit != 0,
            };
            self.reference = if high { self.reference | bit } else { self.reference & !bit };
        }
        let (risen, fallen) = (self.reference & !before, before & !self.reference);
        signals.cc_rise |= risen & self.enabled_channels();
        signals.cc_fall |= fallen & self.enabled_channels();
        if self.mms() >= 4 {
            let bit = 1 << (self.mms() - 4);
            signals.trgo_rise |= risen & bit != 0;
            signals.trgo_fall |= fallen & bit != 0;
        }
    }

    /// Flags of SR whose interrupt is enabled.
    pub(crate) const fn pending(&self) -> u32 {
        self.sr & self.dier
    }

    /// Interrupt numbers and levels, in the order update, compare, trigger, break.
    pub(crate) fn interrupts(&self) -> [(u8, bool); 4] {
        let pending = self.pending();
        let irqs = self.features.irqs;
        [
            (irqs.update, pending & UIF != 0),
            (irqs.compare, pending & CC_IE != 0),
            (irqs.trigger, pending & (TIF | COMIF) != 0),
            (irqs.brk, pending & BIF != 0),
        ]
    }
}
