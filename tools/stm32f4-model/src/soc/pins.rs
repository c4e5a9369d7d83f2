//! Levels of the pins: what the chip drives, what the plant puts on the rest, and who looks at them (IDR, EXTI, break inputs).

use super::Soc;
use crate::adc::Trigger;
use crate::gpio::{self, Mode};
use crate::pin::{PORTS, Pin};
use crate::plant::Plant;
use crate::tim::{Listeners, PinSignal, route};

/// An output that has changed and waits to be shown to the plant.
#[derive(Debug, Clone, Copy)]
struct Edge {
    cycle: u64,
    pin: Pin,
    level: bool,
}

/// State of all pins.
#[derive(Debug)]
pub(super) struct Pins {
    /// Levels that the chip puts out, as the plant was told; bit n is pin n of the port.
    levels: [u16; PORTS],
    /// Pins that the chip drives now.
    driven: [u16; PORTS],
    /// Levels the plant puts on pins.
    inputs: [u16; PORTS],
    /// Pins with a timer's signal on them.
    routes: Vec<(Pin, usize, PinSignal)>,
    /// Levels of EXTI lines 0 to 15.
    lines: u32,
    edges: Vec<Edge>,
    /// Time of the last look at the inputs; `None`: never.
    looked: Option<f64>,
    /// Cycle of the next announced change of an input, `u64::MAX`: none.
    pub(super) change_at: u64,
    change_seconds: f64,
    polled: bool,
}

impl Pins {
    pub(super) fn new() -> Self {
        Pins {
            levels: [0; PORTS],
            driven: [0; PORTS],
            inputs: [0; PORTS],
            routes: Vec::new(),
            lines: 0,
            edges: Vec::new(),
            looked: None,
            change_at: u64::MAX,
            change_seconds: 0.0,
            polled: false,
        }
    }

    pub(super) fn output(&self, pin: Pin) -> bool {
        self.levels[pin.port_index()] >> pin.number() & 1 != 0
    }
}

fn pin(port: usize, number: u8) -> Option<Pin> {
    Pin::new((b'A' + port as u8) as char, number)
}

impl Soc {
    /// A GPIO register was written.
    pub(super) fn port_written(&mut self, port: usize, offset: u32) {
        let functions = matches!(offset, gpio::MODER | gpio::AFRL | gpio::AFRH);
        if functions {
            self.route_pins();
            self.listen();
        }
        if self.port_changed(port) || functions {
            self.pins_changed();
        }
    }

    /// Works out which pins carry a timer's signal.
    pub(super) fn route_pins(&mut self) {
        self.pins.routes.clear();
        for (index, port) in self.gpio.iter().enumerate() {
            for number in 0..16 {
                let Mode::Alternate(af) = port.mode(number) else { continue };
                let Some(pin) = pin(index, number) else { continue };
                if let Some((timer, signal)) = route(pin.port(), number, af) {
                    self.pins.routes.push((pin, timer, signal));
                }
            }
        }
    }

    /// Tells each timer who waits for its signals.
    pub(super) fn listen(&mut self) {
        let mut listeners = [Listeners::default(); 15];
        for adc in &self.adcs {
            for (_, trigger, ..) in adc.triggers().into_iter().flatten() {
                match trigger {
                    Trigger::Compare(timer, channel) => listeners[usize::from(timer)].channels |= 1 << channel,
                    Trigger::Trgo(timer) => listeners[usize::from(timer)].trgo = true,
                    Trigger::Line(_) => {}
                }
            }
        }
        for &(_, timer, signal) in &self.pins.routes {
            if let PinSignal::Main(channel) | PinSignal::Complementary(channel) = signal {
                listeners[timer].pins |= 1 << channel;
            }
        }
        for (timer, listeners) in self.timers.iter_mut().zip(listeners) {
            timer.listen(listeners);
        }
    }

    /// Level that the chip drives on a pin, `None`: none; and the level at which the pin counts when the chip has let it go.
    fn drive(&self, pin: Pin) -> (Option<bool>, bool) {
        let port = &self.gpio[pin.port_index()];
        match port.mode(pin.number()) {
            Mode::Output => (Some(port.output(pin.number())), false),
            Mode::Alternate(af) => match route(pin.port(), pin.number(), af) {
                Some((timer, PinSignal::Main(channel))) => {
                    (self.timers[timer].output(channel, false), port.pull_up(pin.number()))
                }
                Some((timer, PinSignal::Complementary(channel))) => {
                    (self.timers[timer].output(channel, true), port.pull_up(pin.number()))
                }
                _ => (None, false),
            },
            Mode::Input | Mode::Analog => (None, false),
        }
    }

    /// Works out what the chip does to a pin. True where that has changed.
    fn drive_pin(&mut self, pin: Pin) -> bool {
        let (driven, released) = self.drive(pin);
        let (port, bit) = (pin.port_index(), 1 << pin.number());
        let level = driven.unwrap_or(released);
        let moved = level != self.pins.output(pin);
        if moved {
            self.pins.levels[port] ^= bit;
            self.pins.edges.push(Edge { cycle: self.now, pin, level });
        }
        let switched = driven.is_some() != (self.pins.driven[port] & bit != 0);
        if switched {
            self.pins.driven[port] ^= bit;
        }
        moved || switched
    }

    /// Works out all pins of a port anew. True where any has changed.
    pub(super) fn port_changed(&mut self, port: usize) -> bool {
        (0..16).filter_map(|number| pin(port, number)).fold(false, |changed, pin| self.drive_pin(pin) | changed)
    }

    /// Works out the pins of a timer anew. True where any has changed.
    pub(super) fn timer_pins_changed(&mut self, timer: usize) -> bool {
        let mut changed = false;
        for index in 0..self.pins.routes.len() {
            let (pin, of, _) = self.pins.routes[index];
            changed |= of == timer && self.drive_pin(pin);
        }
        changed
    }

    /// Carries pin levels over to IDR, EXTI and the break inputs.
    pub(super) fn pins_changed(&mut self) {
        for index in 0..PORTS {
            let driven = self.pins.driven[index];
            let level = (self.pins.levels[index] & driven) | (self.pins.inputs[index] & !driven);
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
            // A break that acts moves pins, which may be looked at in their turn. It acts once, so that this ends.
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
                // A line hands on the edges it has selected, as pulses.
                self.trigger(Trigger::Line(line as u8), true, true);
            }
        }
    }

    /// Shows the plant the edges of outputs that have come up.
    pub(super) fn show_edges(&mut self, plant: &mut dyn Plant) {
        if self.pins.edges.is_empty() {
            return;
        }
        for edge in std::mem::take(&mut self.pins.edges) {
            plant.edge(edge.pin, edge.level, self.time.seconds(edge.cycle));
        }
    }

    /// Asks the plant when the inputs change next. At the start of an advance it may ask for a look at once; asked for again within the
    /// advance that would never end.
    pub(super) fn expect_inputs(&mut self, plant: &dyn Plant, at_start: bool) {
        let looked = self.pins.looked.unwrap_or(f64::NEG_INFINITY);
        let announced = plant.next_pin_change(looked.max(0.0));
        self.pins.polled = announced.is_none();
        self.pins.change_seconds = 0.0;
        self.pins.change_at = match (self.pins.looked, announced) {
            (None, _) => self.now,
            (Some(looked), Some(seconds)) if seconds > looked && seconds < f64::INFINITY => {
                self.pins.change_seconds = seconds;
                self.time.cycle_at(seconds).max(self.now)
            }
            (Some(looked), Some(seconds)) if seconds <= looked && at_start => self.now,
            _ => u64::MAX,
        };
    }

    /// Looks at all inputs at the present cycle.
    pub(super) fn look_at_inputs(&mut self, plant: &mut dyn Plant) {
        let seconds = self.time.seconds(self.now).max(self.pins.change_seconds);
        self.pins.looked = Some(seconds);
        self.pins.change_at = u64::MAX;
        let mut changed = false;
        for port in 0..PORTS {
            let mut level = 0;
            for number in 0..16 {
                if let Some(pin) = pin(port, number) {
                    level |= u16::from(plant.pin(pin, seconds)) << number;
                }
            }
            changed |= level != self.pins.inputs[port];
            self.pins.inputs[port] = level;
        }
        if changed {
            self.pins_changed();
        }
    }

    /// True where levels are to be asked for at each advance.
    pub(super) fn polls_inputs(&self) -> bool {
        self.pins.polled
    }
}
