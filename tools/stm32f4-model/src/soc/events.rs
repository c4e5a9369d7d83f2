//! Events: advances time and carries out timer signals, conversions, DMA transfers, captures and the watchdog in the order of time.

use super::{KEPT_CONVERSIONS, Soc};
use crate::adc::{Adc, AdcChannel, AdcEvent, Trigger};
use crate::bus::Width;
use crate::dma::{DmaSource, IRQS, connections};
use crate::gpio::PinMode;
use crate::lint::LintKind;
use crate::memory_map::Bus;
use crate::plant::{DmaMemory, Plant};
use crate::reset::ResetCause;
use crate::tim::Signals;
use crate::usart::SERIAL_OUT;

// Interrupt numbers (RM0090 12.1.3).
const IRQ_FLASH: u8 = 4;
const IRQ_RCC: u8 = 5;
const IRQ_ADC: u8 = 18;
const IRQ_USART2: u8 = 38;
/// Interrupt number and mask of its EXTI lines (RM0090 12.1.3).
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
    /// Advances to a cycle and carries out every event up to and including it, in order. A past cycle has no effect.
    ///
    /// Stops early at a watchdog timeout: [`Soc::now`] is then less than `cycle` and [`Soc::take_reset`] returns the cause.
    pub fn advance_to(&mut self, cycle: u64, plant: &mut dyn Plant, memory: &mut dyn DmaMemory) {
        let target = cycle.max(self.now);
        if self.is_settled_until(target, plant) {
            self.now = target;
            return;
        }
        self.report_edges(plant);
        self.serve_dma_requests(memory);
        self.schedule_input_sample(plant, true);
        self.refresh_if_stale();
        if self.schedule_stale {
            self.refresh_schedule();
        } else {
            debug_assert_eq!((self.scheduled, self.scheduled_visible), self.schedule(), "the schedule is stale");
            self.refresh_next();
        }
        while self.next <= target {
            self.now = self.next.max(self.now);
            self.process_due_events(plant);
            self.serve_dma_requests(memory);
            self.report_edges(plant);
            self.schedule_input_sample(plant, false);
            self.refresh();
            if self.reset_request.is_some() {
                return;
            }
        }
        self.now = target;
        if self.inputs_are_polled() {
            self.sample_inputs(plant);
            self.report_edges(plant);
            self.refresh();
        }
        self.is_settled = true;
    }

    /// True if an advance to this cycle would only pass time: nothing was accessed or broken since the last one, no event is due, and the plant announces
    /// what it did.
    fn is_settled_until(&self, cycle: u64, plant: &dyn Plant) -> bool {
        let is_settled =
            self.is_settled && !self.schedule_stale && cycle < self.next && self.pins.is_announced_by(plant);
        debug_assert!(
            !is_settled
                || (self.scheduled, self.scheduled_visible) == self.schedule()
                    && !self.stale
                    && self.pins.edges.is_empty()
                    && self.requests.is_empty(),
            "a change is passed over"
        );
        is_settled
    }

    /// Carries out all events of the present cycle.
    fn process_due_events(&mut self, plant: &mut dyn Plant) {
        for number in 1..self.timers.len() {
            if self.timers[number].next_event() <= self.now {
                let signals = self.timers[number].run_to(self.now);
                self.pass_signals(number, signals);
            }
        }
        for index in 0..self.adcs.len() {
            if self.adcs[index].next_event() <= self.now {
                self.convert(index, plant);
            }
        }
        if self.usart2.next_event() <= self.now {
            self.usart2.run_to(self.now);
            self.send_characters();
        }
        if self.pins.change_at <= self.now {
            self.sample_inputs(plant);
        }
        if self.released_at <= self.now {
            self.released_at = u64::MAX;
        }
        if self.flash_at <= self.now {
            self.flash_at = u64::MAX;
            self.flash_operations.extend(self.flash.finish());
        }
        if self.capture_at() <= self.now {
            self.capture();
        }
        if self.watchdog_at <= self.now {
            self.watchdog_at = u64::MAX;
            self.iwdg.deadline = None;
            self.reset_request = Some(ResetCause::IndependentWatchdog);
        }
    }

    /// Characters leave the chip by the pin.
    fn send_characters(&mut self) {
        let sent = self.usart2.take_sent();
        if sent.is_empty() || self.has_pin(&SERIAL_OUT) {
            self.serial.extend(sent);
        } else {
            let kind = LintKind::Misuse("USART2 sends, but neither PA2 nor PD5 is connected to it");
            self.lint(0x4000_4404, Width::Byte, kind, None);
        }
    }

    /// Passes the signals of a timer to ADCs, DMA and pins.
    pub(super) fn pass_signals(&mut self, timer: usize, signals: Signals) {
        let number = timer as u8;
        self.trigger(Trigger::Trgo(number), signals.trgo_rise, signals.trgo_fall);
        for channel in 0..4 {
            let bit = 1 << channel;
            self.trigger(Trigger::Compare(number, channel), signals.cc_rise & bit != 0, signals.cc_fall & bit != 0);
            if signals.dma_cc & bit != 0 {
                self.requests.push(DmaSource::Compare(timer, channel));
            }
        }
        if signals.dma_update {
            self.requests.push(DmaSource::Update(timer));
        }
        // The output of a timer may be an input of EXTI or of the break of another timer.
        if self.timer_pins_changed(timer) {
            self.pins_changed();
        }
    }

    /// Starts the converters that an edge of a trigger selects; a pulse has both edges.
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

    /// Carries out the present event of a converter.
    fn convert(&mut self, index: usize, plant: &mut dyn Plant) {
        match self.adcs[index].due() {
            Some(AdcEvent::Sample(channel)) => {
                let code = self.sample(AdcChannel { adc: index as u8 + 1, channel }, plant);
                self.adcs[index].sampled(code);
            }
            Some(AdcEvent::Finish) => {
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

    /// Samples a channel: its 12 bit code, 0 to 4095.
    fn sample(&mut self, channel: AdcChannel, plant: &mut dyn Plant) -> u16 {
        let seconds = self.time.seconds(self.now);
        // Data sheet table 67, for a VDDA from 2.4 V.
        if self.clocks.hclk / (self.clocks.apb[1] * self.adc_common.divider()) as f64 > 36e6 {
            self.lint(
                0x4001_2304,
                Width::Word,
                LintKind::Misuse("a conversion runs with ADCCLK above its rating of 36 MHz"),
                None,
            );
        }
        let vdda = plant.vdda(seconds).unwrap_or(self.config.vdda);
        let volts = match (channel.pin(), channel.adc, channel.channel) {
            (Some(pin), ..) => {
                if self.gpio[pin.port_index()].mode(pin.number()) != PinMode::Analog {
                    let moder = 0x4002_0000 + 0x400 * pin.port_index() as u32;
                    self.lint(moder, Width::Word, LintKind::Misuse("the converted pin is not in analog mode"), None);
                }
                plant.volts(channel, seconds)
            }
            // 13.11, RM0383 11.9: where both are on the channel, VBAT is converted.
            (None, 1, 18) if self.adc_common.vbat_on() => self.config.vbat / self.config.chip.vbat_divider(),
            (None, 1, internal)
                if self.adc_common.reference_on()
                    && (internal == 17 || internal == self.config.chip.temperature_channel()) =>
            {
                // Data sheet 6.3.22, 6.3.24: both need 10 us of sampling.
                if self.adcs[0].sampling_seconds(internal, self.clocks.hclk) < 10e-6 {
                    let smpr1 = 0x4001_200C;
                    let kind = LintKind::Misuse("an internal channel is sampled for less than its minimum of 10 us");
                    self.lint(smpr1, Width::Word, kind, None);
                }
                if internal == 17 { self.config.vrefint } else { 0.76 + 0.0025 * (self.config.die_celsius - 25.0) }
            }
            _ => 0.0,
        };
        // `as` converts NaN to 0.
        (volts / vdda * 4095.0).round().clamp(0.0, 4095.0) as u16
    }

    /// Serves all pending DMA requests.
    fn serve_dma_requests(&mut self, memory: &mut dyn DmaMemory) {
        for source in std::mem::take(&mut self.requests) {
            self.serve(source, memory);
        }
        for index in 0..self.adcs.len() {
            if self.adcs[index].dma_request()
                && let Some(last) = self.serve(DmaSource::Adc(index), memory)
            {
                self.adcs[index].dma_served(last);
            }
        }
        if self.usart2.offers_data() {
            self.serve(DmaSource::Received, memory);
        }
        // The shift register may take the first at once.
        while self.usart2.requests_data() && self.serve(DmaSource::ToSend, memory).is_some() {}
    }

    /// Makes one transfer for a source; `None`: no stream has selected it. `Some(true)`: it was the last item of the buffer.
    fn serve(&mut self, source: DmaSource, memory: &mut dyn DmaMemory) -> Option<bool> {
        for &(controller, stream, channel) in connections(source) {
            if !self.rcc.enabled((Bus::Ahb1, 21 + controller as u8)) {
                continue;
            }
            let Some(transfer) = self.dma[controller].transfer(stream, channel) else { continue };
            if self.dma[controller].takes_lost_request(stream) {
                return Some(false);
            }
            let good = if transfer.to_memory {
                let value = self.read_register(transfer.peripheral, transfer.width);
                memory.write(transfer.memory, transfer.width, value)
            } else {
                match memory.read(transfer.memory, transfer.width) {
                    Some(value) => {
                        self.write_register(transfer.peripheral, transfer.width, value);
                        true
                    }
                    None => false,
                }
            };
            let last = self.dma[controller].transferred(stream, good);
            self.stale = true;
            return Some(last);
        }
        None
    }

    /// Updates interrupt lines and the next event after a change.
    pub(super) fn refresh(&mut self) {
        self.stale = false;
        self.is_settled = false;
        self.refresh_lines();
        self.refresh_schedule();
    }

    /// The same if a register access or a transfer was made since the last update.
    pub(super) fn refresh_if_stale(&mut self) {
        if self.stale {
            self.refresh();
        }
    }

    /// Updates the next events of the blocks, and from them the next event.
    fn refresh_schedule(&mut self) {
        (self.scheduled, self.scheduled_visible) = self.schedule();
        self.schedule_stale = false;
        self.refresh_next();
    }

    /// Cycles of the next event of the blocks, and of the next one with a visible effect.
    fn schedule(&self) -> (u64, u64) {
        let rare = self.watchdog_at.min(self.capture_at()).min(self.flash_at).min(self.released_at);
        let common = self.timers.iter().fold(rare, |next, timer| next.min(timer.next_event()));
        let serial = self.usart2.next_event();
        let serial_visible =
            self.usart2.has_interrupts() || [5, 6].iter().any(|stream| self.dma[0].has_interrupts(*stream));
        let adcs = |next: u64, of: fn(&Adc) -> u64| self.adcs.iter().fold(next, |next, adc| next.min(of(adc)));
        let visible = adcs(if serial_visible { common.min(serial) } else { common }, Adc::next_visible);
        (adcs(common.min(serial), Adc::next_event), visible)
    }

    /// Updates the next event after a change of the inputs.
    fn refresh_next(&mut self) {
        self.updates += 1;
        self.next = self.scheduled.min(self.pins.change_at);
        self.next_visible = self.scheduled_visible.min(self.pins.change_at);
    }

    fn refresh_lines(&mut self) {
        let mut lines = [0; 3];
        let mut raise = |irq: u8, level: bool| lines[usize::from(irq / 32)] |= u32::from(level) << (irq % 32);
        // Most blocks have nothing pending, and this runs at every register access.
        for timer in self.timers[1..].iter().filter(|timer| timer.pending() != 0) {
            for (irq, level) in timer.interrupts() {
                raise(irq, level);
            }
        }
        raise(IRQ_ADC, self.adcs.iter().any(|adc| adc.interrupt()));
        raise(IRQ_FLASH, self.flash.interrupt());
        raise(IRQ_RCC, self.rcc.interrupt());
        raise(IRQ_USART2, self.usart2.interrupt());
        let pending = self.exti.pending();
        if pending != 0 {
            for (irq, mask) in EXTI_IRQS {
                raise(irq, pending & mask != 0);
            }
        }
        for (dma, irqs) in self.dma.iter().zip(&IRQS).filter(|(dma, _)| dma.has_flags()) {
            for (stream, &irq) in irqs.iter().enumerate() {
                raise(irq, dma.interrupt(stream));
            }
        }
        self.lines = lines;
    }
}
