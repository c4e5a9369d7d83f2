//! The present state of a run, for a screen or a line of text.

use crate::board::counters::{Counters, Heard};
use crate::board::run::Event;
use crate::line_fit::line_fit;
use crate::view::tuning::Tuning;
use joint_loop::SENSORS;
use joint_units::Joint;
use std::collections::VecDeque;
use wire::{Conditions, Cost, Environment, Frame};

/// Length of the charts, in virtual seconds.
pub const PAST_S: f64 = 4.0;

/// Averaging time of the tick rate, in virtual seconds.
const RATE_OVER_S: f64 = 1.0;

/// Number of log lines that are kept.
const LOG_LINES: usize = 50;

/// Steps of the axes of angles, degrees.
pub(super) const SCALE_STEP_DEG: f32 = 30.0;

/// Least and greatest angle of an axis, degrees. It is fixed, so that motions can be compared by eye, and grows for an angle beyond it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale(
    /// The two ends.
    pub [f32; 2],
);

impl Scale {
    fn show(&mut self, degrees: f32) {
        let Self([least, most]) = self;
        if degrees.is_finite() {
            *least = least.min((degrees / SCALE_STEP_DEG).floor() * SCALE_STEP_DEG);
            *most = most.max((degrees / SCALE_STEP_DEG).ceil() * SCALE_STEP_DEG);
        }
    }
}

impl Default for Scale {
    /// Any joint of a walk is inside.
    fn default() -> Self {
        Self([-SCALE_STEP_DEG, 3.0 * SCALE_STEP_DEG])
    }
}

impl Scale {
    /// The multiples of the step from end to end, degrees.
    #[must_use]
    pub fn marks(self) -> Vec<f32> {
        let Self([least, most]) = self;
        let count = ((most - least) / SCALE_STEP_DEG).round() as u16;
        (0..=count).map(|mark| least + f32::from(mark) * SCALE_STEP_DEG).collect()
    }
}

/// What is watched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Watched {
    /// A virtual board: pins, time and a copy of its loop are known beside what it sends.
    #[default]
    Virtual,
    /// A board that runs by itself: what it sends is all that is known.
    Board,
}

/// What the longest tick is counted in: the cycle counter of a chip counts cycles, that of the virtual board instructions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CostUnit {
    /// On the virtual board.
    #[default]
    Instructions,
    /// On a chip.
    Cycles,
    /// On one of the two: the bytes come from a pseudo-terminal or a file.
    Either,
}

impl CostUnit {
    /// The word for the screen.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Instructions => "instructions",
            Self::Cycles => "cycles",
            Self::Either => "cycles (on a virtual board instructions)",
        }
    }
}

/// A point of the charts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Virtual time, s.
    pub t_s: f64,
    /// The counter of ticks.
    pub tick: u32,
    /// Measured angles, in degrees; 0 without a sensor.
    pub measured: [f32; SENSORS],
    /// Setpoints, in degrees.
    pub set: [f32; 4],
}

/// The present state and the recent past.
#[derive(Debug, Clone, Default)]
pub struct View {
    /// Title of the run.
    pub title: String,
    /// What is watched.
    pub watched: Watched,
    /// What its longest tick is counted in.
    pub cost_unit: CostUnit,
    /// The keys that change the board; `None` where it takes no requests.
    pub tuning: Option<Tuning>,
    /// What is wrong with the connection now.
    pub alarm: Option<String>,
    /// Shortest and longest pulse that each servo may get, in microseconds; `None` if the robot is not known.
    pub pulse_limits_us: Option<[[u16; 2]; 4]>,
    /// The axis of the measured angles, and of each setpoint.
    pub scales: (Scale, [Scale; 4]),
    /// The joints with a sensor, from channel 1 on; empty if they are not known.
    pub sensors: Vec<Joint>,
    /// Virtual time, s.
    pub t_s: f64,
    /// The last frame of this boot.
    pub last: Option<Frame>,
    /// When the board was last heard.
    pub heard: Heard,
    /// The points of the charts.
    pub past: VecDeque<Point>,
    /// Pulses at the pins in the last servo period, in microseconds; `None` while the outputs are off.
    pub pins_us: [Option<f64>; 4],
    /// Time of the last pulses, s.
    pub(super) pulses_at_s: f64,
    /// Boots so far.
    pub boots: u32,
    /// Cause of the last boot.
    pub boot_cause: String,
    /// The last lines of the log.
    pub log: VecDeque<String>,
    /// Load and reserves of the processor.
    pub cost: Option<Cost>,
    /// Temperature and supply of the board.
    pub environment: Option<Environment>,
    /// What was not as it should be, since the boot.
    pub conditions: Option<Conditions>,
    /// Counters of the run.
    pub counters: Counters,
}

impl View {
    /// The state before the first event.
    #[must_use]
    pub fn titled(title: String, sensors: Vec<Joint>) -> Self {
        Self { title, sensors, ..Self::default() }
    }

    /// Takes an event.
    pub fn take(&mut self, event: &Event, counters: &Counters) {
        match event {
            Event::Booted { t_s, cause } => {
                self.advance(*t_s);
                (self.boots, self.boot_cause) = (self.boots + 1, cause.clone());
                (self.last, self.cost, self.environment, self.conditions) = (None, None, None, None);
                self.heard.boot_at_s = *t_s;
                self.past.clear();
                self.note(format!("{t_s:9.3} s  boot: {cause}"));
            }
            Event::Tick { t_s, tick } => {
                self.advance(*t_s);
                (self.last, self.heard.frame_at_s) = (Some(*tick), Some(*t_s));
                let measured = tick.sensors.map(|sensor| sensor.map_or(0.0, |sensor| sensor.angle_deg()));
                let set = tick.setpoints_deg();
                let present = tick.sensors.iter().flatten();
                present.for_each(|sensor| self.scales.0.show(sensor.angle_deg()));
                self.scales.1.iter_mut().zip(set).for_each(|(scale, degrees)| scale.show(degrees));
                self.past.push_back(Point { t_s: *t_s, tick: tick.tick, measured, set });
                while self.past.front().is_some_and(|first| first.t_s < t_s - PAST_S) {
                    self.past.pop_front();
                }
            }
            Event::Row(_) | Event::Edge(_) => {}
            Event::Log { t_s, level, text } => {
                self.advance(*t_s);
                self.note(format!("{t_s:9.3} s  {level:<5} {text}"));
            }
            Event::Cost(cost) => self.cost = Some(*cost),
            Event::Environment(environment) => self.environment = Some(*environment),
            Event::Conditions(conditions) => self.conditions = Some(*conditions),
            Event::Pulses { t_s, us } => {
                self.advance(*t_s);
                (self.pins_us, self.pulses_at_s) = (*us, *t_s);
            }
            Event::Status { t_s } => self.advance(*t_s),
            Event::Remark { kind, text } => self.note(format!("board: {kind} {text}")),
            Event::Ended(end) => self.advance(end.t_s),
        }
        self.counters.clone_from(counters);
    }

    /// Since when a virtual board has sent no frame, in virtual seconds; `None` while they come. Of a board that runs by itself the connection
    /// is reported.
    #[must_use]
    pub fn silent_since_s(&self) -> Option<f64> {
        self.heard.silent_since_s(self.t_s).filter(|_| self.watched == Watched::Virtual)
    }

    /// State of the follower in a few words; `None` for other generators.
    #[must_use]
    pub fn following(&self) -> Option<String> {
        self.counters.following.map(|following| {
            let fault = following.fault.map_or(String::new(), |fault| format!(" ({fault} sensor)"));
            format!(
                "{}{fault}   stride {:.2} s   phase error {:.1} deg   confidence {:.2}",
                following.state, following.stride_s, following.phase_error_deg, following.confidence
            )
        })
    }

    /// Pulse of a servo, in microseconds; `None` without one. At the pins of a virtual board; as commanded by a board that runs by itself, and
    /// in shadow mode, where the pins have none.
    #[must_use]
    pub fn pulse_us(&self, servo: usize) -> Option<f64> {
        if self.watched == Watched::Virtual && !self.counters.shadow {
            return self.pins_us[servo];
        }
        self.last.map(|tick| f64::from(tick.pulses_us[servo])).filter(|us| *us > 0.0)
    }

    /// What is known of a sensor's place: the name of its joint, or its channel.
    #[must_use]
    pub fn sensor_name(&self, channel: usize) -> String {
        let joint = self.sensors.get(channel).map(|joint| joint.name().replace('_', " "));
        joint.unwrap_or_else(|| format!("sensor {}", channel + 1))
    }

    /// Adds a line to the log.
    pub fn note(&mut self, line: String) {
        if self.log.len() == LOG_LINES {
            self.log.pop_front();
        }
        self.log.push_back(line);
    }

    fn advance(&mut self, t_s: f64) {
        self.t_s = self.t_s.max(t_s);
        // More than two servo periods without a pulse: the outputs are off.
        if self.t_s - self.pulses_at_s > 0.05 {
            self.pins_us = [None; 4];
        }
    }

    /// Ticks a virtual second over the last second; `None` until there are enough points, and of a board that runs by itself.
    ///
    /// The slope of the straight line through all points: a record leaves the board up to 2 ms after its tick, and the two end points alone
    /// would have an error of 2 in 1000.
    #[must_use]
    pub fn tick_rate_hz(&self) -> Option<f64> {
        if self.watched == Watched::Board {
            // Its own counter is its only clock here.
            return None;
        }
        let last = self.past.back()?;
        // Counted from the last point back: differences are small and exact.
        let from_last = |point: &Point| (last.t_s - point.t_s, f64::from(last.tick.wrapping_sub(point.tick)));
        let recent = self.past.iter().rev().take_while(|point| point.t_s >= last.t_s - RATE_OVER_S);
        let points: Vec<(f64, f64)> = recent.map(from_last).collect();
        let (_, slope) = line_fit(&points);
        slope.is_finite().then_some(slope)
    }

    /// Comparison of board and host so far, in a few words.
    #[must_use]
    pub fn replay(&self) -> String {
        match (self.counters.different, self.counters.compared, &self.counters.why_not) {
            (1.., ..) => format!("DIFFERENT in {} lines", self.counters.different),
            (0, 0, None) => "no lines yet".into(),
            (0, _, Some(why)) => format!("not known: {why}"),
            (0, compared, None) => format!("equal in {compared} lines"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::default_loop::typical_loop;

    fn tick(n: u32) -> Frame {
        Frame { tick: n, seq: n, ..Frame::from(&typical_loop().unwrap().frame()) }
    }

    #[test]
    fn the_tick_rate_is_shown_despite_the_jitter_of_the_wire() {
        for (rate, first) in [(1000.0, 0), (993.0, 0), (1000.0, u32::MAX - 500)] {
            let mut view = View::default();
            assert_eq!(view.tick_rate_hz(), None);
            for n in 0..150_u32 {
                // 0, 1 or 2 ms late, in no order.
                let t_s = f64::from(n * 10) / rate + f64::from(n * 7 % 3) * 1e-3;
                view.take(&Event::Tick { t_s, tick: tick(first.wrapping_add(n * 10)) }, &Counters::default());
            }
            let found = view.tick_rate_hz().unwrap();
            assert!((found - rate).abs() < 0.2, "{found} for {rate}");
        }
    }

    #[test]
    fn the_past_ends_where_the_charts_do_and_at_a_boot() {
        let mut view = View::default();
        for n in 0..1000_u32 {
            view.take(&Event::Tick { t_s: f64::from(n) * 0.01, tick: tick(n * 10) }, &Counters::default());
        }
        assert_eq!(view.past.len(), (PAST_S / 0.01) as usize + 1);
        view.take(&Event::Booted { t_s: 10.5, cause: "iwdg".into() }, &Counters::default());
        assert!(view.past.is_empty() && view.last.is_none() && view.boots == 1);
    }
}
