//! Time: events in their order, and what each brings about.

use super::{KEPT_CONVERSIONS, Soc};
use crate::adc::{AdcChannel, Step, Trigger};
use crate::bus::Width;
use crate::dma::{IRQS, REQUESTS, Source};
use crate::gpio::Mode;
use crate::lint::LintKind;
use crate::memory_map::Bus;
use crate::plant::{DmaMemory, Plant};
use crate::reset::ResetCause;
use crate::tim::Signals;

/// Interrupt numbers (RM0090 12.1.3).
const IRQ_RCC: u8 = 5;
const IRQ_ADC: u8 = 18;
/// EXTI lines by interrupt.
const EXTI_IRQS: [(u8, u32); 14] = [
    (6, 1),
    (7, 1 << 1),
    (8, 1 << 2),
    (9, 1 << 3),
    (10, 1 << 4),
    (23, 0x03E0),
    (40, 0xFC00),
    (1, 1 << 16),
    (41, 1 << 17),
    (42, 1 << 18),
    (62, 1 << 19),
    (76, 1 << 20),
    (2, 1 << 21),
    (3, 1 << 22),
];

impl Soc {
    /// Moves on to a cycle, through every event up to and including it, in order. A cycle that is past does nothing.
    ///
    /// Stops early, at the cycle of the bite, when the watchdog runs out: [`Soc::now`] is then less than `cycle` and
    /// [`Soc::take_reset`] gives the cause.
    pub fn advance_to(&mut self, cycle: u64, plant: &mut dyn Plant, memory: &mut dyn DmaMemory) {
        let target = cycle.max(self.now);
        self.show_edges(plant);
        self.serve_requests(memory);
        self.expect_inputs(plant, true);
        self.refresh_next();
        while self.next <= target {
            self.now = self.next.max(self.now);
            self.fire(plant);
            self.serve_requests(memory);
            self.show_edges(plant);
            self.expect_inputs(plant, false);
            self.refresh();
            if self.reset_request.is_some() {
                return;
            }
        }
        self.now = target;
        if self.polls_inputs() {
            self.look_at_inputs(plant);
            self.show_edges(plant);
            self.refresh();
        }
    }

    /// Everything that is due now.
    fn fire(&mut self, plant: &mut dyn Plant) {
        for number in 1..self.timers.len() {
            if self.timers[number].next_event() <= self.now {
                let signals = self.timers[number].run_to(self.now);
                self.deliver(number, signals);
            }
        }
        for index in 0..self.adcs.len() {
            if self.adcs[index].next_event() <= self.now {
                self.convert(index, plant);
            }
        }
        if self.pins.change_at <= self.now {
            self.look_at_inputs(plant);
        }
        if self.bite_at <= self.now {
            self.bite_at = u64::MAX;
            self.iwdg.deadline = None;
            self.reset_request = Some(ResetCause::IndependentWatchdog);
        }
    }

    /// Carries a timer's signals to ADC, DMA and pins.
    pub(super) fn deliver(&mut self, timer: usize, signals: Signals) {
        let number = timer as u8;
        self.trigger(Trigger::Trgo(number), signals.trgo_rise, signals.trgo_fall);
        for channel in 0..4 {
            let bit = 1 << channel;
            self.trigger(Trigger::Compare(number, channel), signals.cc_rise & bit != 0, signals.cc_fall & bit != 0);
            if signals.dma_cc & bit != 0 {
                self.requests.push(Source::Compare(timer, channel));
            }
        }
        if signals.dma_update {
            self.requests.push(Source::Update(timer));
        }
        // A timer's output may itself be an input: of EXTI or of another timer's break.
        if self.timer_pins_changed(timer) {
            self.pins_changed();
        }
    }

    /// A trigger of the converters has risen or fallen (or both, as a pulse does).
    pub(super) fn trigger(&mut self, from: Trigger, rise: bool, fall: bool) {
        if !rise && !fall {
            return;
        }
        for adc in &mut self.adcs {
            for (group, trigger, on_rise, on_fall) in adc.triggers().into_iter().flatten() {
                if trigger == from && (rise && on_rise || fall && on_fall) {
                    adc.start(group, self.now);
                }
            }
        }
    }

    /// The event of a converter that is due.
    fn convert(&mut self, index: usize, plant: &mut dyn Plant) {
        match self.adcs[index].due() {
            Some(Step::Sample(channel)) => {
                let code = self.sample(AdcChannel { adc: index as u8 + 1, channel }, plant);
                self.adcs[index].sampled(code);
            }
            Some(Step::Finish) => {
                if let Some(conversion) = self.adcs[index].finish(self.now) {
                    if self.conversions.len() >= KEPT_CONVERSIONS {
                        self.conversions.pop_front();
                    }
                    self.conversions.push_back(conversion);
                }
            }
            None => {}
        }
    }

    /// The 12 bit code of a channel now.
    fn sample(&mut self, channel: AdcChannel, plant: &mut dyn Plant) -> u16 {
        let seconds = self.time.seconds(self.now);
        // Data sheet table 67, for a VDDA from 2.4 V.
        if self.clocks.hclk / (self.clocks.apb[1] * self.adc_common.divider()) as f64 > 36e6 {
            self.lint(
                0x4001_2304,
                Width::Word,
                LintKind::Misuse("a conversion with ADCCLK above its rating of 36 MHz"),
                None,
            );
        }
        let vdda = plant.vdda(seconds).unwrap_or(self.config.vdda);
        let volts = match (channel.pin(), channel.adc, channel.channel) {
            (Some(pin), ..) => {
                if self.gpio[pin.port_index()].mode(pin.number()) != Mode::Analog {
                    let moder = 0x4002_0000 + 0x400 * pin.port_index() as u32;
                    self.lint(
                        moder,
                        Width::Word,
                        LintKind::Misuse("a pin is converted that is not in analog mode"),
                        None,
                    );
                }
                plant.volts(channel, seconds)
            }
            (None, 1, internal @ (16 | 17)) if self.adc_common.reference_on() => {
                // Data sheet 6.3.22, 6.3.24: both need 10 us of sampling.
                if self.adcs[0].sampling_seconds(internal, self.clocks.hclk) < 10e-6 {
                    let smpr1 = 0x4001_200C;
                    let kind = LintKind::Misuse("an internal channel is sampled for less than 10 us");
                    self.lint(smpr1, Width::Word, kind, None);
                }
                if internal == 17 { self.config.vrefint } else { 0.76 + 0.0025 * (self.config.die_celsius - 25.0) }
            }
            (None, 1, 18) if self.adc_common.vbat_on() => self.config.vbat / 2.0,
            _ => 0.0,
        };
        // `as` makes 0 of a voltage that is no number.
        (volts / vdda * 4095.0).round().clamp(0.0, 4095.0) as u16
    }

    /// Serves the DMA requests that have come up.
    fn serve_requests(&mut self, memory: &mut dyn DmaMemory) {
        for source in std::mem::take(&mut self.requests) {
            self.serve(source, memory);
        }
        for index in 0..self.adcs.len() {
            if self.adcs[index].dma_request()
                && let Some(last) = self.serve(Source::Adc(index), memory)
            {
                self.adcs[index].dma_served(last);
            }
        }
    }

    /// Makes one transfer for a source, if a stream listens to it. True where it was the last of the stream's buffer.
    fn serve(&mut self, source: Source, memory: &mut dyn DmaMemory) -> Option<bool> {
        for &(_, controller, stream, channel) in REQUESTS.iter().filter(|&&(from, ..)| from == source) {
            if !self.rcc.enabled((Bus::Ahb1, 21 + controller as u8)) {
                continue;
            }
            let Some(transfer) = self.dma[controller].transfer(stream, channel) else { continue };
            let good = if transfer.to_memory {
                let value = self.read(transfer.peripheral, transfer.width);
                memory.write(transfer.memory, transfer.width, value)
            } else {
                match memory.read(transfer.memory, transfer.width) {
                    Some(value) => {
                        self.write(transfer.peripheral, transfer.width, value);
                        true
                    }
                    None => false,
                }
            };
            let last = self.dma[controller].transferred(stream, good);
            self.refresh();
            return Some(last);
        }
        None
    }

    /// Works out interrupt lines and the next event anew, after any change.
    pub(super) fn refresh(&mut self) {
        self.refresh_lines();
        self.refresh_next();
    }

    fn refresh_next(&mut self) {
        let timers = self.timers.iter().map(|timer| timer.next_event()).min().unwrap_or(u64::MAX);
        let common = timers.min(self.bite_at).min(self.pins.change_at);
        self.next = self.adcs.iter().fold(common, |next, adc| next.min(adc.next_event()));
        self.next_visible = self.adcs.iter().fold(common, |next, adc| next.min(adc.next_visible()));
    }

    fn refresh_lines(&mut self) {
        let mut lines = [0; 3];
        let mut raise = |irq: u8, level: bool| lines[usize::from(irq / 32)] |= u32::from(level) << (irq % 32);
        for timer in &self.timers[1..] {
            for (irq, level) in timer.interrupts() {
                raise(irq, level);
            }
        }
        raise(IRQ_ADC, self.adcs.iter().any(|adc| adc.interrupt()));
        raise(IRQ_RCC, self.rcc.interrupt());
        let pending = self.exti.pending();
        for (irq, mask) in EXTI_IRQS {
            raise(irq, pending & mask != 0);
        }
        for (controller, irqs) in IRQS.iter().enumerate() {
            for (stream, &irq) in irqs.iter().enumerate() {
                raise(irq, self.dma[controller].interrupt(stream));
            }
        }
        self.lines = lines;
    }
}
