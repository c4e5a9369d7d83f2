//! What is shown of a board that runs: the view that its records make, without a copy of its loop.

use joint_loop::setup::default_loop::Parameters;
use joint_loop::store::{robot_record, sensor_record};
use joint_loop::{RecordName, RobotConfig};
use wire::{Answered, Boot, Frame, Record, RecordId, Warnings};

use crate::board::counters::Counters;
use crate::board::run::Event;
use crate::board::transport::Heard;
use crate::options::sensors::joints;
use crate::publish::Publisher;
use crate::view::state::{View, Watched};
use crate::view::warnings::explained;

/// What is shown so far.
pub(super) struct Shown {
    pub(super) view: View,
    counters: Counters,
    /// Time of the first frame, s.
    first_s: Option<f64>,
    /// Start of the present boot, s: each boot of the board counts from zero, and time goes on.
    began_s: f64,
    /// A debugger was attached while the outputs were on, in the last report.
    armed_with_debugger: bool,
    /// What the board warned of in the last report.
    warned: Warnings,
    pub(super) publisher: Publisher,
}

/// What a board sent, for who prints it.
#[derive(Debug)]
pub(super) enum News {
    /// An event.
    Event(Event),
    /// An answer to a request.
    Answer(Answered),
}

impl Shown {
    pub(super) fn titled(title: String, publisher: Publisher) -> Self {
        let mut view = View::titled(title, Vec::new());
        view.watched = Watched::Board;
        Self {
            view,
            counters: Counters::default(),
            first_s: None,
            began_s: 0.0,
            armed_with_debugger: false,
            warned: Warnings::NONE,
            publisher,
        }
    }

    /// Seconds of the board since the first frame.
    pub(super) fn seconds(&self) -> f64 {
        self.first_s.map_or(0.0, |first| self.view.t_s - first)
    }

    /// Whether a frame has come.
    pub(super) fn has_frames(&self) -> bool {
        self.first_s.is_some()
    }

    /// Takes what the board sent; gives what is new of it.
    pub(super) fn take(&mut self, heard: Heard) -> Vec<News> {
        let record = match heard {
            Heard::Record(record) => record,
            Heard::Damaged => {
                self.counters.malformed += 1;
                self.view.counters.malformed += 1;
                return Vec::new();
            }
        };
        match record {
            Record::Frame(tick) => self.tick(tick),
            Record::Boot(boot) => self.boot(&boot),
            Record::Change(change) => {
                self.counters.cause = change.cause;
                let text = format!("{}, cause {}", change.state.name(), change.cause.name());
                self.show(Event::Log { t_s: self.view.t_s, level: "info".into(), text })
            }
            Record::Cost(cost) => self.show(Event::Cost(cost)),
            Record::Environment(environment) => {
                let mut news = self.show(Event::Environment(environment));
                news.extend(self.debugger(environment.debugger));
                news.extend(self.warn(environment.warnings));
                news
            }
            Record::Conditions(conditions) => self.show(Event::Conditions(conditions)),
            Record::Edge(edge) => self.show(Event::Edge(edge)),
            Record::Refused(refused) => {
                let text = format!("{}: {}", refused.subject.name(), refused.reason);
                self.show(Event::Remark { kind: "refused".into(), text })
            }
            Record::Answered(answer) => {
                if let Some(tuning) = &mut self.view.tuning {
                    tuning.take(&answer);
                }
                vec![News::Answer(answer)]
            }
            Record::Settings(settings) => {
                if let Some(tuning) = &mut self.view.tuning {
                    tuning.reported(settings.values);
                }
                Vec::new()
            }
            Record::Inputs(_) | Record::Port(_) => Vec::new(),
        }
    }

    /// Reports once that a debugger is attached to a board that is armed.
    fn debugger(&mut self, is_attached: bool) -> Vec<News> {
        let is_armed = is_attached && self.view.last.is_some_and(|tick| tick.state.moving());
        if !std::mem::replace(&mut self.armed_with_debugger, is_armed) && is_armed {
            let text = "a debugger is attached while the board is armed: it may halt the core; then the pulses go on until the watchdog resets the board";
            return self.show(Event::Log { t_s: self.view.t_s, level: "warn".into(), text: text.into() });
        }
        Vec::new()
    }

    /// Reports what the board warns of, each once in a boot.
    fn warn(&mut self, now: Warnings) -> Vec<News> {
        let before = std::mem::replace(&mut self.warned, now);
        let new = now.each().filter(|one| !before.contains(*one)).map(explained);
        let lines: Vec<_> =
            new.map(|text| Event::Log { t_s: self.view.t_s, level: "warn".into(), text: text.into() }).collect();
        lines.into_iter().flat_map(|line| self.show(line)).collect()
    }

    fn tick(&mut self, tick: Frame) -> Vec<News> {
        let mut news = Vec::new();
        let is_back = |last: Frame| last.tick.wrapping_sub(tick.tick).cast_signed() > 0;
        if self.view.last.is_some_and(is_back) {
            news = self.restart("not known, its record was lost");
        }
        self.counters.follow(&tick);
        let t_s = self.began_s + f64::from(tick.tick) / 1000.0;
        self.first_s.get_or_insert(t_s);
        news.extend(self.show(Event::Tick { t_s, tick }));
        news
    }

    fn boot(&mut self, boot: &Boot) -> Vec<News> {
        self.counters.shadow = boot.shadow;
        let news = self.restart(boot.reset.name());
        // What the board runs is known where it is the default.
        let default = Parameters::with_defaults(None, None, RobotConfig::default_biped()).ok();
        let is = |id: &Option<RecordId>, crc: &dyn Fn(&RecordName) -> u32| {
            id.as_ref().is_some_and(|id| id.crc == crc(&RecordName::cut(&id.name)))
        };
        self.view.pulse_limits_us = None;
        self.view.sensors.clear();
        if let Some(Parameters { sensors, robot, .. }) = default {
            if is(&boot.robot, &|name| robot_record::record_of(&robot, name).crc()) {
                let limits = robot.servos.map(|servo| [servo.shortest.0, servo.longest.0]);
                self.view.pulse_limits_us = Some(limits);
            }
            if is(&boot.sensors, &|name| sensor_record::record_of(&sensors, name).crc()) {
                self.view.sensors = joints(&sensors);
            }
        }
        news
    }

    fn restart(&mut self, cause: &str) -> Vec<News> {
        self.warned = Warnings::NONE;
        // A board that is met while it runs shows its own time.
        self.began_s = if self.has_frames() { self.view.t_s } else { 0.0 };
        if let Some(tuning) = &mut self.view.tuning {
            tuning.booted();
        }
        self.show(Event::Booted { t_s: self.began_s, cause: cause.into() })
    }

    fn show(&mut self, event: Event) -> Vec<News> {
        self.view.take(&event, &self.counters);
        self.publisher.event(&event);
        vec![News::Event(event)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::default_loop::typical_loop;
    use joint_loop::SupervisorState;
    use wire::Environment;

    fn frame(tick: u32) -> Heard {
        Heard::Record(Record::Frame(Frame { tick, seq: tick, ..Frame::from(&typical_loop().unwrap().frame()) }))
    }

    #[test]
    fn time_goes_on_after_a_reset_whose_record_was_lost() {
        let mut shown = Shown::titled("a port".into(), Publisher::default());
        for tick in [5_000, 5_010, 5_500] {
            assert_eq!(shown.take(frame(tick)).len(), 1);
        }
        assert!((shown.seconds() - 0.5).abs() < 1e-9 && shown.view.boots == 0);
        let news = shown.take(frame(10));
        assert!(matches!(&news[0], News::Event(Event::Booted { cause, .. }) if cause.contains("lost")), "{news:?}");
        assert!((shown.view.t_s - 5.51).abs() < 1e-9 && (shown.seconds() - 0.51).abs() < 1e-9);
        // The counter wraps after 49 days: that is no reset.
        let mut shown = Shown::titled("a port".into(), Publisher::default());
        shown.take(frame(u32::MAX));
        assert_eq!(shown.take(frame(9)).len(), 1);
    }

    #[test]
    fn a_debugger_is_reported_once_for_each_arming() {
        let report = |debugger| {
            Heard::Record(Record::Environment(Environment {
                die_c: None,
                supply_v: None,
                watchdog_hz: None,
                debugger,
                warnings: Warnings::NONE,
            }))
        };
        let at = |tick, state| {
            let frame = Frame { tick, state, ..Frame::from(&typical_loop().unwrap().frame()) };
            Heard::Record(Record::Frame(frame))
        };
        let mut shown = Shown::titled("a board".into(), Publisher::default());
        let mut warnings = 0;
        for (tick, state, attached) in [
            (1_000, SupervisorState::Disarmed, true),
            (2_000, SupervisorState::Walking, true),
            (3_000, SupervisorState::Walking, true),
            (4_000, SupervisorState::Disarmed, true),
            (5_000, SupervisorState::Walking, false),
            (6_000, SupervisorState::Walking, true),
        ] {
            shown.take(at(tick, state));
            let news = shown.take(report(attached));
            warnings += news
                .iter()
                .filter(|news| matches!(news, News::Event(Event::Log { level, .. }) if level == "warn"))
                .count();
        }
        assert_eq!(warnings, 2);
    }

    /// Each warning is one line of a boot.
    #[test]
    fn what_a_board_warns_of_is_said_once_in_a_boot() {
        let report = |warnings| {
            Heard::Record(Record::Environment(Environment {
                die_c: None,
                supply_v: None,
                watchdog_hz: None,
                debugger: false,
                warnings,
            }))
        };
        let said = |news: &[News]| {
            let lines = news.iter().filter_map(|news| match news {
                News::Event(Event::Log { level, text, .. }) if level == "warn" => Some(text.clone()),
                _ => None,
            });
            lines.collect::<Vec<_>>()
        };
        let mut shown = Shown::titled("a board".into(), Publisher::default());
        let both = Warnings::UNSEALED.with(Warnings::BROWN_OUT);
        let counts = [Warnings::UNSEALED, both, both].map(|warnings| said(&shown.take(report(warnings))).len());
        assert_eq!(counts, [1, 1, 0]);
        let _ = shown.restart("pin");
        let lines = said(&shown.take(report(both)));
        assert_eq!(lines.len(), 2, "after a reset again");
        assert!(lines[1].contains("cargo xtask board brown-out"), "{lines:?}");
    }

    #[test]
    fn damage_is_counted() {
        let mut shown = Shown::titled("a log".into(), Publisher::default());
        assert!(shown.take(Heard::Damaged).is_empty());
        assert_eq!(shown.view.counters.malformed, 1);
    }
}
