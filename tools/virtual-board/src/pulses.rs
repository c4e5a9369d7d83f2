//! Measurement of the servo outputs and of the servo-rail enable: pulse widths, edge counts, and edges while the
//! outputs are disarmed.
//!
//! Armed means that TIM1's main output enable (BDTR.MOE) is set. An edge of a servo pin while it is not is counted as before arming or as
//! after disarming, by whether MOE has been set since the last reset. The one falling edge that disarming itself causes is not counted.

use std::collections::BTreeMap;

use stm32f4_model::Pin;

use crate::modelled_board::Wiring;
use crate::servo_pulse::{PulseSupply, Returned, ServoPulse};

/// Time after disarming in which a falling edge counts as its effect, s.
const DISARM_EDGE_S: f64 = 1e-6;

/// The pulses of one period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PulsePeriod {
    /// Time of the first rising edge, s.
    pub(crate) seconds: f64,
    /// Pulse width of each servo, us, the last one if it had several; `None`: no pulse.
    pub(crate) us: [Option<f64>; 4],
    /// Compare value of the timer at the start of each pulse, us; `None`: the timer did not start it.
    pub(crate) programmed_us: [Option<f64>; 4],
    /// The servos' supply was on at the end of the last pulse.
    pub(crate) rail: bool,
}

/// State of the servo outputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct OutputState {
    /// The main output enable is set.
    pub(crate) armed: bool,
    /// A servo pin is high.
    pub(crate) high: bool,
    /// The servos' supply is on.
    pub(crate) rail: bool,
}

/// A change of the servo outputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum OutputChange {
    /// The last servo pin went low (false), or the first one high (true).
    High(bool),
    /// The main output enable was cleared or set.
    Armed(bool),
    /// The servos' supply was switched off or on.
    Rail(bool),
}

/// A change of the servo outputs with its time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TimedOutputChange {
    /// Time, s.
    pub(crate) seconds: f64,
    /// Instructions executed by then.
    pub(crate) instructions: u64,
    /// Change.
    pub(crate) change: OutputChange,
}

/// A change of a pin's level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PinEdge {
    /// Pin.
    pub(crate) pin: Pin,
    /// Time, s.
    pub(crate) seconds: f64,
    /// The level after it.
    pub(crate) level: bool,
}

/// Measures the servo pins, and counts the edges of all pins.
#[derive(Debug, Default)]
pub(crate) struct Pulses {
    wiring: Wiring,
    rise: [Option<f64>; 4],
    done: [Option<f64>; 4],
    programmed: [Option<f64>; 4],
    period: Option<f64>,
    armed: bool,
    armed_since_reset: bool,
    disarmed_at: f64,
    rail: bool,
    edges: BTreeMap<Pin, u64>,
    /// Shortest and longest pulse of each servo, us.
    pub(crate) extremes: [Option<(f64, f64)>; 4],
    /// Edges of servo pins since a reset and before the first arming.
    pub(crate) before_arming: u64,
    /// Edges of servo pins after disarming.
    pub(crate) after_disarming: u64,
    /// Shortest time from a write of a pulse width to the start of a servo frame, before or after it, us; `None`: no write while armed.
    pub(crate) frame_margin_us: Option<f64>,
    /// Instructions executed so far; the board keeps it up to date.
    pub(crate) instructions: u64,
    /// Pins whose edges are recorded, and the recorded edges.
    watched: Vec<Pin>,
    kept: Vec<PinEdge>,
    /// The edges of the lamps, if they are recorded.
    lamps: Option<Vec<PinEdge>>,
    /// The servos' supply in each pulse that has begun.
    supplies: [Option<PulseSupply>; 4],
    /// The supply that came since a servo pin rose.
    returned: [Returned; 4],
    periods: Vec<PulsePeriod>,
    pulses: Vec<ServoPulse>,
    activity: Vec<TimedOutputChange>,
}

impl Pulses {
    /// No pulse yet, at the pins of a board.
    pub(crate) fn of(wiring: Wiring) -> Self {
        Pulses { wiring, ..Pulses::default() }
    }

    /// The servo pins in the order of joints.
    pub(crate) const fn servos(&self) -> [Pin; 4] {
        self.wiring.servos
    }

    /// Starts recording the edges of pins.
    pub(crate) fn record_edges_of(&mut self, pins: impl Iterator<Item = Pin>) {
        self.watched.extend(pins);
    }

    /// The edges of watched pins since the last call, in the order of time.
    pub(crate) fn take_edges(&mut self) -> Vec<PinEdge> {
        std::mem::take(&mut self.kept)
    }

    /// Starts recording the edges of the lamps.
    pub(crate) fn record_lamps(&mut self) {
        self.lamps = Some(Vec::new());
    }

    /// The edges of the lamps since the last call, in the order of time.
    pub(crate) fn take_lamps(&mut self) -> Vec<PinEdge> {
        self.lamps.as_mut().map(std::mem::take).unwrap_or_default()
    }

    /// Sets the state of the main output enable.
    pub(crate) fn set_armed(&mut self, armed: bool, seconds: f64) {
        if self.armed && !armed {
            self.disarmed_at = seconds;
        }
        if self.armed != armed {
            self.note(seconds, OutputChange::Armed(armed));
        }
        self.armed = armed;
        self.armed_since_reset |= armed;
    }

    /// Records a reset of the chip.
    pub(crate) fn reset(&mut self, seconds: f64) {
        self.set_armed(false, seconds);
        self.armed_since_reset = false;
    }

    /// True while the main output enable is set.
    #[must_use]
    pub(crate) const fn armed(&self) -> bool {
        self.armed
    }

    /// State of the outputs.
    #[must_use]
    pub(crate) fn state(&self) -> OutputState {
        OutputState { armed: self.armed, high: self.any_high(), rail: self.rail }
    }

    /// Records a write of a pulse width, so long from the start of a servo frame, us.
    pub(crate) fn note_width_written(&mut self, from_frame_us: f64) {
        self.frame_margin_us = Some(self.frame_margin_us.unwrap_or(f64::MAX).min(from_frame_us));
    }

    /// True if a pulse has begun whose compare value is not known yet.
    #[must_use]
    pub(crate) fn awaits_programmed(&self) -> bool {
        self.armed
            && self.rise.iter().zip(&self.programmed).any(|(rise, programmed)| rise.is_some() && programmed.is_none())
    }

    /// Takes the timer's compare values at the start of the pulses, us.
    pub(crate) fn note_programmed(&mut self, us: [f64; 4]) {
        for ((programmed, us), rise) in self.programmed.iter_mut().zip(us).zip(&self.rise) {
            if rise.is_some() {
                programmed.get_or_insert(us);
            }
        }
    }

    /// The pulses that last at this time, s.
    pub(crate) fn unfinished(&self, seconds: f64) -> impl Iterator<Item = ServoPulse> {
        (0..self.rise.len()).filter_map(move |servo| self.pulse(servo, seconds))
    }

    /// The pulse that began at a servo pin, if one did, up to this time, s.
    fn pulse(&self, servo: usize, to: f64) -> Option<ServoPulse> {
        let (from, supply) = (self.rise[servo]?, self.supplies[servo]?);
        let returned_s = self.returned[servo].until(to);
        Some(ServoPulse { servo, from, to, programmed_us: self.programmed[servo], supply, returned_s })
    }

    /// True while a servo pin is high.
    #[must_use]
    pub(crate) fn any_high(&self) -> bool {
        self.rise.iter().any(Option::is_some)
    }

    fn note(&mut self, seconds: f64, change: OutputChange) {
        self.activity.push(TimedOutputChange { seconds, instructions: self.instructions, change });
    }

    /// Records an edge of any pin.
    pub(crate) fn edge(&mut self, pin: Pin, level: bool, seconds: f64) {
        *self.edges.entry(pin).or_default() += 1;
        if self.watched.contains(&pin) {
            self.kept.push(PinEdge { pin, seconds, level });
        }
        if let Some(lamps) = self.lamps.as_mut().filter(|_| self.wiring.lamps.contains(&pin)) {
            lamps.push(PinEdge { pin, seconds, level });
        }
        if pin == self.wiring.rail {
            self.rail = level;
            if level {
                self.returned.iter_mut().for_each(|returned| returned.begin(seconds));
            } else {
                self.supplies.iter_mut().flatten().for_each(|supply| supply.end(seconds));
                self.returned.iter_mut().for_each(|returned| returned.end(seconds));
            }
            self.note(seconds, OutputChange::Rail(level));
        }
        let Some(servo) = self.wiring.servos.iter().position(|&servo| servo == pin) else { return };
        let ends_by_disarming = !level && seconds - self.disarmed_at <= DISARM_EDGE_S;
        if !self.armed && !ends_by_disarming {
            let count = if self.armed_since_reset { &mut self.after_disarming } else { &mut self.before_arming };
            *count += 1;
        }
        let was_high = self.any_high();
        if level {
            (self.rise[servo], self.supplies[servo]) = (Some(seconds), Some(PulseSupply::begin(self.rail)));
            self.returned[servo] = Returned::default();
            self.period.get_or_insert(seconds);
        } else if let Some(pulse) = self.pulse(servo, seconds) {
            (self.rise[servo], self.supplies[servo]) = (None, None);
            let us = pulse.us();
            self.pulses.push(pulse);
            self.done[servo] = Some(us);
            let (min, max) = self.extremes[servo].unwrap_or((us, us));
            self.extremes[servo] = Some((min.min(us), max.max(us)));
        }
        let high = self.any_high();
        if high != was_high {
            self.note(seconds, OutputChange::High(high));
        }
        // All pins are low again: the pulses of the period are complete.
        if !high && let Some(start) = self.period.take() {
            self.periods.push(PulsePeriod {
                seconds: start,
                us: std::mem::take(&mut self.done),
                programmed_us: std::mem::take(&mut self.programmed),
                rail: self.rail,
            });
        }
    }

    /// True if a period was completed or an output has changed since they were last taken.
    #[must_use]
    pub(crate) fn has_news(&self) -> bool {
        !self.periods.is_empty() || !self.pulses.is_empty() || !self.activity.is_empty()
    }

    /// The periods completed since the last call.
    pub(crate) fn take_periods(&mut self) -> Vec<PulsePeriod> {
        std::mem::take(&mut self.periods)
    }

    /// The pulses that ended since the last call, in the order of their ends.
    pub(crate) fn take_pulses(&mut self) -> Vec<ServoPulse> {
        std::mem::take(&mut self.pulses)
    }

    /// The changes since the last call, in the order of time.
    pub(crate) fn take_activity(&mut self) -> Vec<TimedOutputChange> {
        std::mem::take(&mut self.activity)
    }

    /// Number of edges of each pin with edges.
    #[must_use]
    pub(crate) const fn edges(&self) -> &BTreeMap<Pin, u64> {
        &self.edges
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SERVOS: [Pin; 4] = crate::modelled_board::ModelledBoard::F4Discovery.wiring().servos;
    const LAMP: Pin = crate::modelled_board::ModelledBoard::F4Discovery.wiring().lamps[2];
    const RAIL: Pin = crate::modelled_board::ModelledBoard::F4Discovery.wiring().rail;

    fn pulse(pulses: &mut Pulses, at: f64, us: [f64; 4]) {
        SERVOS.iter().for_each(|&pin| pulses.edge(pin, true, at));
        let mut order: Vec<usize> = (0..4).collect();
        order.sort_by(|&a, &b| us[a].total_cmp(&us[b]));
        order.into_iter().for_each(|n| pulses.edge(SERVOS[n], false, at + us[n] * 1e-6));
    }

    #[test]
    fn measures_each_period_and_the_extremes() {
        let mut pulses = Pulses::default();
        pulses.set_armed(true, 0.0);
        pulse(&mut pulses, 0.02, [1500.0, 1400.0, 1600.0, 1500.0]);
        pulse(&mut pulses, 0.04, [1510.0, 1390.0, 1600.0, 1500.0]);
        let periods = pulses.take_periods();
        assert_eq!(periods.len(), 2);
        assert_eq!(periods[1].seconds, 0.04);
        for (got, want) in periods[1].us.iter().zip([1510.0, 1390.0, 1600.0, 1500.0]) {
            assert!((got.unwrap() - want).abs() < 1e-6);
        }
        let (min, max) = pulses.extremes[1].unwrap();
        assert!((min - 1390.0).abs() < 1e-6 && (max - 1400.0).abs() < 1e-6);
        assert_eq!((pulses.before_arming, pulses.after_disarming), (0, 0));
        assert_eq!(pulses.edges()[&SERVOS[0]], 4);
        assert!(pulses.take_periods().is_empty());
    }

    #[test]
    fn a_servo_without_a_pulse_has_none() {
        let mut pulses = Pulses::default();
        pulses.set_armed(true, 0.0);
        pulses.edge(SERVOS[2], true, 0.0);
        pulses.edge(SERVOS[2], false, 0.001);
        let us = pulses.take_periods()[0].us;
        assert_eq!((us[0], us[1], us[3]), (None, None, None));
        assert!((us[2].unwrap() - 1000.0).abs() < 1e-6);
    }

    #[test]
    fn a_period_has_the_level_of_the_rail_at_its_end() {
        let mut pulses = Pulses::default();
        pulses.set_armed(true, 0.0);
        pulses.edge(RAIL, true, 0.01);
        pulse(&mut pulses, 0.02, [1500.0, 1400.0, 1600.0, 1500.0]);
        pulses.edge(SERVOS[0], true, 0.04);
        pulses.edge(RAIL, false, 0.0405);
        pulses.edge(SERVOS[0], false, 0.041);
        let rails: Vec<bool> = pulses.take_periods().iter().map(|period| period.rail).collect();
        assert_eq!(rails, [true, false]);
        let changes = pulses.take_activity();
        assert!(changes.iter().any(|noted| noted.change == OutputChange::Rail(false) && noted.seconds == 0.0405));
    }

    #[test]
    fn each_pulse_has_its_own_edges_and_supply() {
        let mut pulses = Pulses::default();
        pulses.set_armed(true, 0.0);
        pulses.edge(SERVOS[1], true, 0.01);
        pulses.edge(SERVOS[1], false, 0.011);
        pulses.edge(RAIL, true, 0.015);
        pulse(&mut pulses, 0.02, [1500.0, 1400.0, 1600.0, 1500.0]);
        // Two pulses in one frame, in the second of which the supply goes.
        SERVOS[..2].iter().for_each(|&pin| pulses.edge(pin, true, 0.04));
        pulses.edge(SERVOS[0], false, 0.0405);
        pulses.edge(SERVOS[0], true, 0.0406);
        pulses.edge(RAIL, false, 0.0407);
        pulses.edge(SERVOS[0], false, 0.041);
        let all = pulses.take_pulses();
        assert_eq!(all.iter().map(|pulse| pulse.servo).collect::<Vec<_>>(), [1, 1, 0, 3, 2, 0, 0]);
        assert_eq!(all[0].supply, PulseSupply::Absent);
        assert!(all[1..6].iter().all(|pulse| pulse.supply == PulseSupply::Whole));
        assert!((all[5].us() - 500.0).abs() < 1e-6 && (all[5].to - 0.0405).abs() < 1e-9);
        assert_eq!((all[6].from, all[6].lost_supply()), (0.0406, Some(0.0407)));
        let left: Vec<ServoPulse> = pulses.unfinished(0.05).collect();
        assert_eq!((left.len(), left[0].servo, left[0].lost_supply()), (1, 1, Some(0.0407)));
        assert!(pulses.take_pulses().is_empty());
    }

    #[test]
    fn the_margin_is_that_of_the_closest_write() {
        let mut pulses = Pulses::default();
        assert_eq!(pulses.frame_margin_us, None);
        [400.0, 310.0, 500.0].into_iter().for_each(|us| pulses.note_width_written(us));
        assert_eq!(pulses.frame_margin_us, Some(310.0));
    }

    #[test]
    fn edges_while_disarmed_are_counted_separately() {
        let mut pulses = Pulses::default();
        pulses.edge(SERVOS[0], true, 0.1);
        pulses.edge(SERVOS[0], false, 0.2);
        pulses.set_armed(true, 1.0);
        pulses.edge(SERVOS[0], true, 1.5);
        // Disarming ends the pulse: its falling edge comes at the same time.
        pulses.set_armed(false, 1.5005);
        pulses.edge(SERVOS[0], false, 1.5005);
        assert_eq!((pulses.before_arming, pulses.after_disarming), (2, 0));
        pulses.edge(SERVOS[1], true, 2.0);
        pulses.edge(SERVOS[1], false, 2.001);
        assert_eq!((pulses.before_arming, pulses.after_disarming), (2, 2));
        pulses.reset(3.0);
        pulses.edge(SERVOS[1], true, 3.0);
        assert_eq!(
            (pulses.before_arming, pulses.after_disarming),
            (3, 2),
            "a rising edge is not an effect of the reset"
        );
    }

    #[test]
    fn lamps_are_recorded_apart() {
        let mut pulses = Pulses::default();
        pulses.edge(LAMP, true, 0.5);
        assert_eq!(pulses.take_lamps(), [], "not recorded");
        pulses.record_lamps();
        pulses.edge(LAMP, false, 1.5);
        pulses.edge(Pin::new('D', 11).unwrap(), true, 1.6);
        assert_eq!(pulses.take_lamps(), [PinEdge { pin: LAMP, seconds: 1.5, level: false }]);
        assert_eq!((pulses.take_lamps(), pulses.take_edges()), (vec![], vec![]));
    }

    #[test]
    fn other_pins_are_counted_and_recorded_if_selected() {
        let mut pulses = Pulses::default();
        let led = Pin::new('D', 12).unwrap();
        pulses.edge(led, true, 0.0);
        assert_eq!(pulses.edges()[&led], 1);
        assert_eq!(pulses.take_edges(), [], "not recorded");
        pulses.record_edges_of([led].into_iter());
        pulses.edge(led, false, 2.5);
        pulses.edge(Pin::new('B', 5).unwrap(), true, 2.75);
        assert_eq!(pulses.take_edges(), [PinEdge { pin: led, seconds: 2.5, level: false }]);
        assert_eq!(pulses.take_edges(), []);
        assert_eq!(pulses.before_arming, 0);
        assert!(pulses.take_activity().is_empty());
    }
}
