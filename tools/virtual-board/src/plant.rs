//! Signals at the pins: voltages from a recording, the user button, digital inputs, and the measurement of the outputs.

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::str::FromStr;

use stm32f4_model::{AdcChannel, Pin, Plant};

use crate::campaign::Press;
use crate::feed::{Contact, Feed};
use crate::modelled_board::Wiring;
use crate::pulses::Pulses;
use crate::tables::{LevelTable, VoltageColumn, VoltageTable};
use crate::waveform::Waveform;

/// The emergency stop: high while released, by its closed contact.
pub(crate) const EMERGENCY_STOP: Pin = match Pin::new('B', 12) {
    Some(pin) => pin,
    None => panic!("a pin of port B"),
};

/// One press of the user button, or of the emergency stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ButtonPress {
    /// Time of the press, s.
    pub(crate) at: f64,
    /// Duration, s.
    pub(crate) hold: f64,
}

impl ButtonPress {
    /// A press from this time on, s, with a hold of half a second: its release arms.
    pub(crate) const fn deliberate(at: f64) -> Self {
        Self { at, hold: 0.5 }
    }

    /// A press from this time on, s, of a tenth of a second.
    pub(crate) const fn short(at: f64) -> Self {
        Self { at, hold: 0.1 }
    }

    fn is_on(&self, seconds: f64) -> bool {
        (self.at..self.at + self.hold).contains(&seconds)
    }
}

impl From<Press> for ButtonPress {
    fn from(Press { at_s, hold_s }: Press) -> Self {
        Self { at: at_s, hold: hold_s }
    }
}

/// A jumper wire: the level of a pin that the chip drives, at another pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Wire {
    /// The pin that the chip drives.
    pub(crate) from: Pin,
    /// The input at the other end.
    pub(crate) to: Pin,
}

impl FromStr for Wire {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || format!("`{text}` is not PIN=PIN, an output and an input, for example PE9=PC6");
        let (from, to) = text.split_once('=').ok_or_else(expected)?;
        let pin = |name: &str| name.parse::<Pin>().map_err(|error| format!("{error}"));
        Ok(Self { from: pin(from)?, to: pin(to)? })
    }
}

/// Signals at the pins of the board.
#[derive(Debug, Default)]
pub(crate) struct BoardPlant {
    wiring: Wiring,
    volts: VoltageTable,
    presses: Vec<ButtonPress>,
    /// Presses of the emergency stop.
    stops: Vec<ButtonPress>,
    lines: BTreeMap<Pin, LevelTable>,
    /// The user holds the button pressed.
    held: bool,
    /// Voltages that replace those of the table.
    held_volts: BTreeMap<Pin, f64>,
    held_supply: Option<f64>,
    /// Waveforms that replace all else at an input.
    waves: BTreeMap<Pin, Waveform>,
    /// The user has pressed or released since the last input sample.
    changed: Cell<bool>,
    /// Time of the last input sample, s.
    sampled_s: f64,
    /// What a program outside gives.
    feed: Feed,
    /// Supply while nothing else gives one, V: the level of an output that is high.
    supply: f64,
    /// Wires from outputs to inputs, and the pins that the chip drives high.
    wires: Vec<Wire>,
    high: BTreeSet<Pin>,
    /// Time of the last edge at the driven end of a wire, s.
    wire_edge_s: f64,
    /// Measurement of the output pins.
    pub(crate) pulses: Pulses,
}

impl BoardPlant {
    /// The plant of a board with recorded voltages, presses at given times, and digital inputs.
    #[must_use]
    pub(crate) fn new(
        wiring: Wiring,
        volts: VoltageTable,
        presses: Vec<ButtonPress>,
        lines: BTreeMap<Pin, LevelTable>,
    ) -> Self {
        BoardPlant { wiring, volts, presses, lines, pulses: Pulses::of(wiring), ..BoardPlant::default() }
    }

    /// Whether the user button is pressed at a time, s.
    pub(crate) fn button_is_pressed(&self, seconds: f64) -> bool {
        match self.waves.get(&self.wiring.button) {
            Some(wave) => wave.at(seconds) == self.wiring.pressed,
            None => {
                self.held
                    || self.feed.is_on(Contact::Button, seconds)
                    || self.presses.iter().any(|press| press.is_on(seconds))
            }
        }
    }

    /// Sets the supply while nothing else gives one, V.
    pub(crate) fn supplied(self, supply: f64) -> Self {
        Self { supply, ..self }
    }

    /// Adds a press of the emergency stop.
    pub(crate) fn press_emergency_stop(&mut self, press: ButtonPress) {
        self.stops.push(press);
        self.changed.set(true);
    }

    /// Presses the button for a deliberate hold, from a time on, s, or as soon as the emergency stop is released.
    pub(crate) fn press_deliberately(&mut self, seconds: f64) {
        let present = self.stops.iter().filter(|stop| stop.is_on(seconds));
        let at = present.map(|stop| stop.at + stop.hold).fold(seconds, f64::max);
        self.presses.push(ButtonPress::deliberate(at));
        self.changed.set(true);
    }

    /// Drops the presses that have not begun at a time, s.
    pub(crate) fn drop_presses_after(&mut self, seconds: f64) {
        self.presses.retain(|press| press.at <= seconds);
        self.stops.retain(|press| press.at <= seconds);
        self.changed.set(true);
    }

    /// Presses or releases the button.
    pub(crate) fn hold_button(&mut self, down: bool) {
        self.held = down;
        self.changed.set(true);
    }

    /// Drives an input by a waveform from now on; the button is one.
    pub(crate) fn drive(&mut self, pin: Pin, wave: Waveform) {
        self.waves.insert(pin, wave);
        self.changed.set(true);
    }

    /// What a program outside gives.
    pub(crate) const fn feed(&mut self) -> &mut Feed {
        &mut self.feed
    }

    /// Takes the state of a contact from a program outside, from a time on, s. Returns whether it is another one than before.
    pub(crate) fn give_contact(&mut self, contact: Contact, seconds: f64, on: bool) -> bool {
        let is_other = self.feed.give_contact(contact, seconds, on);
        // An input sample of this very moment has been taken.
        if is_other && seconds <= self.sampled_s {
            self.changed.set(true);
        }
        is_other
    }

    /// True if the level of an input is given by a table.
    pub(crate) fn has_line(&self, pin: Pin) -> bool {
        self.lines.contains_key(&pin)
    }

    /// Replaces all wires.
    pub(crate) fn wire(&mut self, wires: Vec<Wire>) {
        self.wires = wires;
        self.changed.set(true);
    }

    /// Level that a wire brings to a pin; `None` without a wire.
    fn wired(&self, pin: Pin) -> Option<bool> {
        self.wires.iter().find(|wire| wire.to == pin).map(|wire| self.high.contains(&wire.from))
    }

    /// Ends the waveform of an input.
    pub(crate) fn release(&mut self, pin: Pin) {
        self.waves.remove(&pin);
        self.changed.set(true);
    }

    /// Holds a pin of the converter at a voltage from now on, V.
    pub(crate) fn hold_volts(&mut self, pin: Pin, volts: f64) {
        self.held_volts.insert(pin, volts);
    }

    /// Ends that.
    pub(crate) fn release_volts(&mut self, pin: Pin) {
        self.held_volts.remove(&pin);
    }

    /// Holds the analogue supply at a voltage from now on, V; `None` ends that.
    pub(crate) fn hold_supply(&mut self, volts: Option<f64>) {
        self.held_supply = volts;
    }

    /// Adds a press that begins now.
    pub(crate) fn press_button(&mut self, press: ButtonPress) {
        self.presses.push(press);
        self.changed.set(true);
    }

    /// Level at an input, s.
    pub(crate) fn level(&self, pin: Pin, seconds: f64) -> bool {
        if let Some(level) = self.wired(pin) {
            return level;
        }
        if let Some(wave) = self.waves.get(&pin) {
            return wave.at(seconds);
        }
        if pin == self.wiring.button {
            return self.button_is_pressed(seconds) == self.wiring.pressed;
        }
        match self.lines.get(&pin) {
            Some(line) => line.at(seconds),
            None if pin == EMERGENCY_STOP => {
                let is_pressed = self.feed.is_on(Contact::Stop, seconds);
                !is_pressed && !self.stops.iter().any(|press| press.is_on(seconds))
            }
            None => self.feed.is_on(Contact::Pin(pin), seconds),
        }
    }

    /// True if an input changes after a time, s.
    #[must_use]
    pub(crate) fn expects_change(&self, seconds: f64) -> bool {
        self.presses.iter().chain(&self.stops).any(|press| press.at + press.hold > seconds)
            || self.lines.values().any(|line| line.next_edge(seconds).is_some())
            || self.waves.values().any(|wave| wave.next_edge(seconds).is_some())
            || self.feed.edges_after(seconds).next().is_some()
    }
}

impl Plant for BoardPlant {
    fn volts(&mut self, channel: AdcChannel, seconds: f64) -> f64 {
        if let Some(level) = channel.pin().and_then(|pin| self.wired(pin)) {
            return if level { self.vdda(seconds).unwrap_or(self.supply) } else { 0.0 };
        }
        let given =
            |pin| self.feed.volts(VoltageColumn::Pin(pin), seconds).unwrap_or_else(|| self.volts.at(pin, seconds));
        let at = |pin| self.held_volts.get(&pin).copied().unwrap_or_else(|| given(pin));
        channel.pin().map_or(0.0, at)
    }

    fn vdda(&mut self, seconds: f64) -> Option<f64> {
        let given = || self.feed.volts(VoltageColumn::Vdda, seconds);
        self.held_supply.or_else(given).or_else(|| self.volts.vdda(seconds))
    }

    fn input_level(&mut self, pin: Pin, seconds: f64) -> bool {
        if pin == self.wiring.button {
            self.changed.set(false);
            self.sampled_s = seconds;
        }
        self.level(pin, seconds)
    }

    fn input_floats(&mut self, pin: Pin, seconds: f64) -> bool {
        self.wiring.open
            && pin == self.wiring.button
            && !self.waves.contains_key(&pin)
            && !self.button_is_pressed(seconds)
    }

    fn record_edge(&mut self, pin: Pin, level: bool, seconds: f64) {
        self.pulses.edge(pin, level, seconds);
        if level {
            self.high.insert(pin);
        } else {
            self.high.remove(&pin);
        }
        if self.wires.iter().any(|wire| wire.from == pin) {
            self.wire_edge_s = seconds;
            // An edge that an input of the same moment has made, as the emergency stop does, comes after that sample.
            if seconds <= self.sampled_s {
                self.changed.set(true);
            }
        }
    }

    fn next_pin_change(&self, seconds: f64) -> Option<f64> {
        if self.changed.get() {
            return Some(seconds);
        }
        let presses = self.presses.iter().chain(&self.stops).flat_map(|press| [press.at, press.at + press.hold]);
        let edges = self.lines.values().filter_map(|line| line.next_edge(seconds));
        let waves = self.waves.values().filter_map(|wave| wave.next_edge(seconds));
        let given = self.feed.edges_after(seconds).chain([self.wire_edge_s]);
        Some(presses.chain(edges).chain(waves).chain(given).filter(|&at| at > seconds).fold(f64::INFINITY, f64::min))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BUTTON: Pin = crate::modelled_board::ModelledBoard::F4Discovery.wiring().button;
    use crate::waveform::Wave;
    use anyhow::Result;

    fn volts(text: &str, repeat: bool) -> Result<VoltageTable> {
        VoltageTable::parse(text.as_bytes(), repeat)
    }

    #[test]
    fn interpolates_and_holds_both_ends() {
        let volts = volts("time_s,PA1,PC2\n1,0.5,3\n2,1.5,2\n4,1.0,1\n", false).unwrap();
        let pa1 = "PA1".parse().unwrap();
        for (time, want) in [(0.0, 0.5), (1.0, 0.5), (1.25, 0.75), (2.0, 1.5), (3.0, 1.25), (4.0, 1.0), (9.0, 1.0)] {
            assert!((volts.at(pa1, time) - want).abs() < 1e-12, "at {time}");
        }
        assert_eq!(volts.at("PC2".parse().unwrap(), 3.0), 1.5);
        assert_eq!(volts.at("PB0".parse().unwrap(), 3.0), 0.0);
    }

    #[test]
    fn the_supply_is_a_column_like_the_pins() {
        let table = volts("time_s,VDDA,PA1\n0,3.0,1\n1,3.0,1\n2,2.0,1\n", false).unwrap();
        assert!(table.has_vdda());
        let mut plant = BoardPlant::new(Wiring::default(), table, vec![], BTreeMap::new());
        for (time, want) in [(0.5, 3.0), (1.5, 2.5), (9.0, 2.0)] {
            assert!((plant.vdda(time).unwrap() - want).abs() < 1e-12, "at {time}");
        }
        let without = volts("time_s,PA1\n0,1\n", false).unwrap();
        assert!(!without.has_vdda());
        assert_eq!(BoardPlant::new(Wiring::default(), without, vec![], BTreeMap::new()).vdda(1.0), None);
    }

    #[test]
    fn a_repeated_recording_has_the_period_of_its_rows() {
        let volts = volts("time_s,PA1\n0,0\n1,1\n2,0\n", true).unwrap();
        let pa1 = "PA1".parse().unwrap();
        for n in 0..5 {
            let start = 2.0 * f64::from(n);
            assert!((volts.at(pa1, start + 0.25) - 0.25).abs() < 1e-9);
            assert!((volts.at(pa1, start + 1.75) - 0.25).abs() < 1e-9);
        }
    }

    #[test]
    fn bad_tables_are_refused_with_their_line() {
        for (text, words) in [
            ("", "first column"),
            ("t,PA1\n0,1\n", "must be `time_s`"),
            ("time_s\n0\n", "no pin is named"),
            ("time_s,PQ1\n0,1\n", "`PQ1` is not the name of a pin"),
            ("time_s,PA1,PA1\n0,1,1\n", "PA1 is named twice"),
            ("time_s,PA1\n", "the table has no row; at least one is required"),
            ("time_s,PA1\n0,1\n0,2\n", "line 3: time 0 s does not come after 0 s"),
            ("time_s,PA1\n0,1\n1,nan\n", "line 3: `nan` is not a finite number"),
            ("time_s,PA1\n0,1\n1,x\n", "line 3: `x` is not a finite number"),
            ("time_s,PA1\n0,1\n1\n", "line: 3"),
            ("time_s,VDDA,VDDA\n0,3,3\n", "VDDA is named twice"),
            ("time_s,vdda\n0,3\n", "`vdda` is not the name of a pin"),
            ("time_s,PA1,VDDA\n0,1,3\n1,1,0\n", "line 3: VDDA of 0 V; the converter divides by it"),
            ("time_s,VDDA\n0,-3\n", "line 2: VDDA of -3 V"),
        ] {
            let message = format!("{:#}", volts(text, false).unwrap_err());
            assert!(message.contains(words), "{text:?}: {message}");
        }
        assert!(volts("time_s,PA1\n0,1\n", true).is_err());
    }

    #[test]
    fn the_button_is_high_during_presses_and_while_held() {
        let press = ButtonPress { at: 1.0, hold: 0.1 };
        let mut plant = BoardPlant::new(Wiring::default(), VoltageTable::default(), vec![press], BTreeMap::new());
        assert_eq!(plant.next_pin_change(0.0), Some(1.0));
        assert_eq!(plant.next_pin_change(1.0), Some(1.1));
        assert_eq!(plant.next_pin_change(1.1), Some(f64::INFINITY));
        assert!(
            !plant.input_level(BUTTON, 0.999)
                && plant.input_level(BUTTON, 1.0)
                && plant.input_level(BUTTON, 1.05)
                && !plant.input_level(BUTTON, 1.1)
        );
        plant.press_deliberately(3.0);
        assert_eq!(plant.next_pin_change(3.0), Some(3.0), "the chip must sample at once");
        assert!(plant.input_level(BUTTON, 3.0) && plant.input_level(BUTTON, 3.499) && !plant.input_level(BUTTON, 3.5));
        assert_eq!(plant.next_pin_change(3.0), Some(3.5));
        plant.hold_button(true);
        assert_eq!(plant.next_pin_change(5.0), Some(5.0), "the chip must sample at once");
        assert!(plant.input_level(BUTTON, 5.0));
        assert_eq!(plant.next_pin_change(5.0), Some(f64::INFINITY));
        assert!(plant.expects_change(3.4) && !plant.expects_change(3.6));
    }

    #[test]
    fn the_emergency_stop_is_low_while_pressed() {
        let mut plant = BoardPlant::default();
        plant.press_emergency_stop(ButtonPress::short(2.0));
        assert_eq!(plant.next_pin_change(0.5), Some(0.5), "the chip must sample at once");
        assert!(!plant.input_level(BUTTON, 0.5));
        assert_eq!((plant.next_pin_change(0.5), plant.next_pin_change(2.0)), (Some(2.0), Some(2.1)));
        let levels = [0.0, 1.999, 2.0, 2.099, 2.1].map(|seconds| plant.input_level(EMERGENCY_STOP, seconds));
        assert_eq!(levels, [true, true, false, false, true]);
        // A hold waits for the release.
        plant.press_deliberately(2.05);
        assert_eq!(
            [2.05, 2.099, 2.1, 2.599, 2.6].map(|s| plant.input_level(BUTTON, s)),
            [false, false, true, true, false]
        );
        // A cut cable.
        let cut = BTreeMap::from([(EMERGENCY_STOP, LevelTable::fixed(false))]);
        assert!(
            !BoardPlant::new(Wiring::default(), VoltageTable::default(), vec![], cut).input_level(EMERGENCY_STOP, 1.0)
        );
    }

    #[test]
    fn a_waveform_replaces_all_else_until_it_is_released() {
        let wave = |high| Waveform::from(Wave::level(BUTTON, high), 1.0);
        let mut plant =
            BoardPlant::new(Wiring::default(), VoltageTable::default(), vec![ButtonPress::short(1.0)], BTreeMap::new());
        plant.drive(BUTTON, wave(false));
        plant.drive(EMERGENCY_STOP, wave(false));
        assert_eq!(plant.next_pin_change(1.0), Some(1.0), "the chip must sample at once");
        assert!(!plant.input_level(BUTTON, 1.05) && !plant.input_level(EMERGENCY_STOP, 1.05));
        plant.release(BUTTON);
        plant.release(EMERGENCY_STOP);
        assert!(plant.input_level(BUTTON, 1.05) && plant.input_level(EMERGENCY_STOP, 1.05));
    }

    #[test]
    fn fixed_levels_apply_and_other_pins_are_low() {
        let pin: Pin = "PB12".parse().unwrap();
        let mut plant = BoardPlant::new(
            Wiring::default(),
            VoltageTable::default(),
            vec![],
            BTreeMap::from([(pin, LevelTable::fixed(true))]),
        );
        assert!(plant.input_level(pin, 0.0));
        assert!(!plant.input_level("PB13".parse().unwrap(), 0.0));
    }

    #[test]
    fn a_wire_brings_the_level_of_an_output_to_an_input() {
        let [from, to, analogue] = ["PE9", "PC6", "PA1"].map(|name| name.parse().unwrap());
        let mut plant = BoardPlant::default().supplied(3.0);
        plant.record_edge(from, true, 0.5);
        plant.input_level(BUTTON, 0.5);
        assert!(!plant.input_level(to, 0.5));
        plant.wire(vec![Wire { from, to }, Wire { from, to: analogue }]);
        assert_eq!(plant.next_pin_change(0.6), Some(0.6), "the chip must sample at once");
        plant.input_level(BUTTON, 0.6);
        assert!(plant.input_level(to, 0.6));
        let channel = AdcChannel { adc: 1, channel: 1 };
        assert_eq!(plant.volts(channel, 0.6), 3.0);
        plant.hold_supply(Some(2.9));
        assert_eq!(plant.volts(channel, 0.6), 2.9);
        plant.record_edge(from, false, 0.7);
        assert_eq!(plant.next_pin_change(0.6), Some(0.7), "at the moment of the edge");
        assert_eq!((plant.input_level(to, 0.7), plant.volts(channel, 0.7)), (false, 0.0));
        assert_eq!(plant.next_pin_change(0.7), Some(f64::INFINITY));
        plant.input_level(BUTTON, 0.8);
        plant.record_edge(from, true, 0.8);
        assert_eq!(plant.next_pin_change(0.8), Some(0.8), "an edge that the sample of this moment has made");
    }

    #[test]
    fn a_line_has_the_edges_of_its_file() {
        let pin: Pin = "PC6".parse().unwrap();
        let line = LevelTable::parse("time_s,level\n0.5,1\n0.5001,0\n# a comment\n2,1\n".as_bytes()).unwrap();
        let mut plant =
            BoardPlant::new(Wiring::default(), VoltageTable::default(), vec![], BTreeMap::from([(pin, line)]));
        for (time, want) in [(0.0, false), (0.5, true), (0.50005, true), (0.5001, false), (1.9, false), (9.0, true)] {
            assert_eq!(plant.input_level(pin, time), want, "at {time}");
        }
        assert_eq!([0.0, 0.5, 1.0, 2.0].map(|t| plant.next_pin_change(t)), [0.5, 0.5001, 2.0, f64::INFINITY].map(Some));
        assert!(plant.expects_change(1.9) && !plant.expects_change(2.0));
        for (text, words) in [
            ("time,level\n", "the header must be `time_s,level`"),
            ("time_s,level\n0,up\n", "line 2: the level is `up`; allowed is 0 or 1"),
            ("time_s,level\n0,1\n0,0\n", "line 3: time 0 s does not come after 0 s"),
            ("time_s,level\nx,1\n", "line 2: `x` is not a finite number"),
        ] {
            let message = format!("{:#}", LevelTable::parse(text.as_bytes()).unwrap_err());
            assert!(message.contains(words), "{message}");
        }
    }
}
