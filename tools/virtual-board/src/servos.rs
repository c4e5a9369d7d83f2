//! Modelled servos at the servo pins: their joint angles over time.

use servo_model::{DataSheet, Kind, Servo};

use crate::judge::Joint;
use crate::pulses::{OutputChange, PulsePeriod, TimedOutputChange};

/// A servo and its joint.
#[derive(Debug, Clone)]
struct Mounted {
    servo: Servo,
    joint: Joint,
    least: f64,
    most: f64,
}

/// Four servos, in the order of the servo pins.
#[derive(Debug, Clone)]
pub(crate) struct Servos([Mounted; 4]);

/// What happens at the connectors of the servos.
#[derive(Debug, Clone, Copy)]
enum Event {
    Pulse(usize, f64),
    Supply(bool),
}

/// Pulse of the middle of a servo, us.
const MIDDLE_US: f64 = 1_500.0;

impl Mounted {
    /// Angle of the joint, degrees.
    fn degrees(&self) -> f64 {
        let us = MIDDLE_US + self.servo.angle() * self.joint.us_per_radian.abs().to_radians();
        self.joint.angle(us).to_degrees()
    }

    fn note(&mut self) {
        let angle = self.degrees();
        (self.least, self.most) = (self.least.min(angle), self.most.max(angle));
    }
}

impl Servos {
    /// Servos of a kind on these joints, which stand at these angles, degrees.
    pub(crate) fn new(kind: Kind, joints: &[Joint; 4], at: [f64; 4]) -> Self {
        let mounted = |joint: &Joint, at: f64| {
            let us_per_degree = joint.us_per_radian.abs().to_radians();
            let us = joint.neutral_us + joint.us_per_radian * (at.to_radians() - joint.angle_at_neutral);
            let servo = Servo::new(DataSheet::of(kind), us_per_degree, (us - MIDDLE_US) / us_per_degree);
            let mut mounted = Mounted { servo, joint: *joint, least: f64::INFINITY, most: f64::NEG_INFINITY };
            mounted.note();
            mounted
        };
        Servos(std::array::from_fn(|n| mounted(&joints[n], at[n])))
    }

    /// Takes the pulses and the changes of the supply since the last call, and moves on to a time, s, unless a pulse lasts: the pulses of a frame come
    /// when the last one has ended, and a servo must not be past the end of its own.
    pub(crate) fn take(&mut self, periods: &[PulsePeriod], changes: &[TimedOutputChange], now: f64, in_pulse: bool) {
        let mut events: Vec<(f64, Event)> = Vec::new();
        for period in periods {
            let ended = |us: f64| period.seconds + us * 1e-6;
            let pulses =
                period.us.iter().enumerate().filter_map(|(n, us)| us.map(|us| (ended(us), Event::Pulse(n, us))));
            events.extend(pulses);
        }
        for change in changes {
            if let OutputChange::Rail(on) = change.change {
                events.push((change.seconds, Event::Supply(on)));
            }
        }
        events.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (seconds, event) in events {
            match event {
                Event::Pulse(n, us) => self.0[n].servo.pulse(seconds, us),
                Event::Supply(on) => self.0.iter_mut().for_each(|mounted| mounted.servo.set_supply(seconds, on)),
            }
        }
        for mounted in &mut self.0 {
            if !in_pulse {
                mounted.servo.advance(now);
            }
            mounted.note();
        }
    }

    /// Angles of the joints, degrees.
    pub(crate) fn degrees(&self) -> [f64; 4] {
        self.0.each_ref().map(Mounted::degrees)
    }

    /// Torque of each, 0 to 1.
    pub(crate) fn torque(&self) -> [f64; 4] {
        self.0.each_ref().map(|mounted| mounted.servo.torque())
    }

    /// Least and most angle of each joint so far, degrees.
    pub(crate) fn extremes(&self) -> [[f64; 2]; 4] {
        self.0.each_ref().map(|mounted| [mounted.least, mounted.most])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1500 us at 0.5 rad, mirrored, and 600 us a radian.
    const MIRRORED: Joint = Joint {
        neutral_us: 1500.0,
        angle_at_neutral: 0.5,
        us_per_radian: -600.0,
        range: [-1.0, 1.0],
        rate: 2.0,
        acceleration: 100.0,
        park: 0.0,
        pulses_us: [550.0, 2450.0],
    };

    #[test]
    fn the_angle_is_that_of_the_joint() {
        let mut servos = Servos::new(Kind::Digital, &[MIRRORED; 4], [0.0, 10.0, 0.0, 0.0]);
        assert!((servos.degrees()[1] - 10.0).abs() < 1e-9);
        let on = TimedOutputChange { seconds: 0.0, instructions: 0, change: OutputChange::Rail(true) };
        let us = [1500.0, 1800.0, 1200.0, 1500.0];
        let pulses = PulsePeriod { seconds: 0.3, us: us.map(Some), programmed_us: us.map(Some), rail: true };
        servos.take(&[pulses], &[on], 1.0, false);
        for (got, want) in servos.degrees().iter().zip([0.5, 0.0, 1.0, 0.5_f64]) {
            assert!((got - want.to_degrees()).abs() < 1e-6, "{got} {want}");
        }
        assert_eq!(servos.torque(), [1.0; 4]);
        // While a pulse lasts, the servos wait for its end.
        let before = servos.degrees();
        servos.take(&[], &[], 1.001, true);
        assert_eq!(servos.degrees(), before);
        // A supply that goes in the same step as a pulse comes after it.
        let off = TimedOutputChange { seconds: 1.0016, instructions: 0, change: OutputChange::Rail(false) };
        let us = [900.0; 4];
        let pulses = PulsePeriod { seconds: 1.0, us: us.map(Some), programmed_us: us.map(Some), rail: true };
        servos.take(&[pulses], &[off], 2.0, false);
        // 0.7 ms at 612 degrees a second.
        assert!((servos.degrees()[0] - (0.5_f64.to_degrees() + 0.4286)).abs() < 0.001, "{:?}", servos.degrees());
        assert_eq!(servos.torque(), [0.0; 4]);
        assert!(servos.extremes()[0][0] == 0.0);
    }
}
