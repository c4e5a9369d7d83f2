//! Pins: computes which levels the chip drives, samples the inputs, and passes levels to IDR, EXTI and the break inputs.

use super::Soc;
use super::pin_levels::OutputEdge;
use crate::adc::Trigger;
use crate::gpio::{self, PinMode};
use crate::pin::{PORTS, Pin};
use crate::plant::Plant;
use crate::tim::{PinSignal, UsedSignals, route};

fn pin(port: usize, number: u8) -> Option<Pin> {
    Pin::new((b'A' + port as u8) as char, number)
}

impl Soc {
    /// Whether one of these pins is connected to USART2.
    pub(super) fn has_pin(&self, pins: &[(usize, u8)]) -> bool {
        pins.iter().any(|&(port, number)| self.gpio[port].mode(number) == PinMode::Alternate(7))
    }

    /// Updates the pins after a write to a GPIO register.
    pub(super) fn port_written(&mut self, port: usize, offset: u32) {
        let functions = matches!(offset, gpio::MODER | gpio::AFRL | gpio::AFRH);
        if functions {
            self.route_pins();
            self.update_used_signals();
        }
        if self.port_changed(port) || functions || offset == gpio::PUPDR {
            self.pins_changed();
        }
    }

    /// Updates the list of pins that are connected to a timer.
    pub(super) fn route_pins(&mut self) {
        self.pins.routes.clear();
        for (index, port) in self.gpio.iter().enumerate() {
            for number in 0..16 {
                let PinMode::Alternate(af) = port.mode(number) else { continue };
                let Some(pin) = pin(index, number) else { continue };
                if let Some((timer, signal)) = route(self.config.chip, pin.port(), number, af) {
                    self.pins.routes.push((pin, timer, signal));
                }
            }
        }
    }

    /// Updates which signals of each timer are used.
    pub(super) fn update_used_signals(&mut self) {
        let mut used = [UsedSignals::default(); 15];
        for adc in &self.adcs {
            for (_, trigger, ..) in adc.triggers().into_iter().flatten() {
                match trigger {
                    Trigger::Compare(timer, channel) => used[usize::from(timer)].channels |= 1 << channel,
                    Trigger::Trgo(timer) => used[usize::from(timer)].trgo = true,
                    Trigger::Line(_) => {}
                }
            }
        }
        for &(_, timer, signal) in &self.pins.routes {
            if let PinSignal::Main(channel) | PinSignal::Complementary(channel) = signal {
                used[timer].pins |= 1 << channel;
            }
        }
        for (timer, used) in self.timers.iter_mut().zip(used) {
            timer.set_used_signals(used);
        }
    }

    /// Level that the chip drives on a pin (`None`: not driven), and the level that counts if it does not drive the pin.
    fn drive(&self, pin: Pin) -> (Option<bool>, bool) {
        let port = &self.gpio[pin.port_index()];
        match port.mode(pin.number()) {
            PinMode::Output => (Some(port.output(pin.number())), false),
            PinMode::Alternate(af) => match route(self.config.chip, pin.port(), pin.number(), af) {
                Some((timer, PinSignal::Main(channel))) => {
                    (self.timers[timer].output(channel, false), port.pull_up(pin.number()))
                }
                Some((timer, PinSignal::Complementary(channel))) => {
                    (self.timers[timer].output(channel, true), port.pull_up(pin.number()))
                }
                _ => (None, false),
            },
            PinMode::Input | PinMode::Analog => (None, false),
        }
    }

    /// Updates the output level of a pin. Returns true if level or drive has changed.
    fn drive_pin(&mut self, pin: Pin) -> bool {
        let (driven, released) = self.drive(pin);
        let (port, bit) = (pin.port_index(), 1 << pin.number());
        let level = driven.unwrap_or(released);
        let moved = level != self.pins.output(pin);
        if moved {
            self.pins.levels[port] ^= bit;
            self.pins.edges.push(OutputEdge { cycle: self.now, pin, level });
        }
        let switched = driven.is_some() != (self.pins.driven[port] & bit != 0);
        if switched {
            self.pins.driven[port] ^= bit;
        }
        moved || switched
    }

    /// Updates all pins of a port. Returns true if any has changed.
    pub(super) fn port_changed(&mut self, port: usize) -> bool {
        (0..16).filter_map(|number| pin(port, number)).fold(false, |changed, pin| self.drive_pin(pin) | changed)
    }

    /// Updates all pins of a timer. Returns true if any has changed.
    pub(super) fn timer_pins_changed(&mut self, timer: usize) -> bool {
        let mut changed = false;
        for index in 0..self.pins.routes.len() {
            let (pin, of, _) = self.pins.routes[index];
            changed |= of == timer && self.drive_pin(pin);
        }
        changed
    }

    /// Passes pin levels to IDR, EXTI and the break inputs.
    pub(super) fn pins_changed(&mut self) {
        for index in 0..PORTS {
            let driven = self.pins.driven[index];
            let floating = self.pins.floating[index];
            let inputs = (self.pins.inputs[index] & !floating) | (self.gpio[index].pull_ups() & floating);
            let level = (self.pins.levels[index] & driven) | (inputs & !driven);
            // 8.3.12: the digital input of an analog pin is off and reads 0.
            self.gpio[index].idr = level & !self.gpio[index].analog();
        }
        self.lines_changed();
        for timer in [1, 8] {
            let mut level = None;
            for &(pin, of, signal) in &self.pins.routes {
                if of == timer && signal == PinSignal::Break {
                    level = Some(self.gpio[pin.port_index()].idr >> pin.number() & 1 != 0);
                }
            }
            self.timers[timer].set_break_level(level);
            // A break changes output pins, which may be inputs of other blocks. It acts once, so that the recursion ends.
            if self.timer_pins_changed(timer) {
                self.pins_changed();
            }
        }
    }

    fn lines_changed(&mut self) {
        let mut lines = 0;
        for line in 0..16 {
            let level = self.gpio.get(self.syscfg.port_of_line(line)).is_some_and(|port| port.idr >> line & 1 != 0);
            lines |= u32::from(level) << line;
        }
        let before = std::mem::replace(&mut self.pins.lines, lines);
        if lines == before {
            return;
        }
        let selected = self.exti.edges(lines & !before, before & !lines);
        for line in [11, 15] {
            if selected >> line & 1 != 0 {
                // A line passes its selected edges on as pulses.
                self.trigger(Trigger::Line(line as u8), true, true);
            }
        }
    }

    /// Reports the new edges of outputs to the plant.
    pub(super) fn report_edges(&mut self, plant: &mut dyn Plant) {
        if self.pins.edges.is_empty() {
            return;
        }
        for edge in std::mem::take(&mut self.pins.edges) {
            plant.record_edge(edge.pin, edge.level, self.time.seconds(edge.cycle));
        }
    }

    /// Schedules the next input sample as the plant announces it. A sample at once is accepted at the start of an advance only; within the
    /// advance it would repeat without end.
    pub(super) fn schedule_input_sample(&mut self, plant: &dyn Plant, at_start: bool) {
        let sampled_at = self.pins.sampled_at.unwrap_or(f64::NEG_INFINITY);
        let announced = plant.next_pin_change(sampled_at.max(0.0));
        self.pins.announced = announced;
        self.pins.polled = announced.is_none();
        self.pins.change_seconds = 0.0;
        self.pins.change_at = match (self.pins.sampled_at, announced) {
            (None, _) => self.now,
            (Some(sampled_at), Some(seconds)) if seconds > sampled_at && seconds < f64::INFINITY => {
                self.pins.change_seconds = seconds;
                self.time.cycle_at(seconds).max(self.now)
            }
            (Some(sampled_at), Some(seconds)) if seconds <= sampled_at && at_start => self.now,
            _ => u64::MAX,
        };
    }

    /// Samples all inputs at the present cycle.
    pub(super) fn sample_inputs(&mut self, plant: &mut dyn Plant) {
        let seconds = self.time.seconds(self.now).max(self.pins.change_seconds);
        self.pins.sampled_at = Some(seconds);
        self.pins.change_at = u64::MAX;
        let mut changed = false;
        for port in 0..PORTS {
            let (mut level, mut floating) = (0, 0);
            for number in 0..16 {
                if let Some(pin) = pin(port, number) {
                    level |= u16::from(plant.input_level(pin, seconds)) << number;
                    floating |= u16::from(plant.input_floats(pin, seconds)) << number;
                }
            }
            changed |= (level, floating) != (self.pins.inputs[port], self.pins.floating[port]);
            (self.pins.inputs[port], self.pins.floating[port]) = (level, floating);
        }
        if changed {
            self.pins_changed();
        }
    }

    /// True if the inputs must be sampled at the end of each advance.
    pub(super) fn inputs_are_polled(&self) -> bool {
        self.pins.polled
    }
}
