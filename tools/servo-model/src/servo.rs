//! One servo over time.

use crate::drive::{DRIVE_S, RELAXED_S};
use crate::{DataSheet, Kind};

/// Pulse of the middle, us.
const MIDDLE_US: f64 = 1_500.0;

/// A servo that was mounted with a scale of its own: the angle is that of the shaft, 0 at a pulse of 1500 us. Times may not go back.
#[derive(Debug, Clone)]
pub struct Servo {
    data: DataSheet,
    us_per_degree: f64,
    /// Pulse whose angle the shaft has, us.
    at_us: f64,
    /// Pulse that it goes to, us; `None`: it has taken none since the supply came.
    target_us: Option<f64>,
    /// End of the last pulse that it took, s.
    last_s: f64,
    now_s: f64,
    supply: bool,
    /// End of its start-up, s: earlier pulses are ignored.
    ready_s: f64,
}

impl Servo {
    /// A servo without supply that stands at this angle, degrees. `us_per_degree`: change of the pulse for a degree, above 0.
    #[must_use]
    pub fn new(data: &DataSheet, us_per_degree: f64, angle: f64) -> Self {
        let at_us = MIDDLE_US + angle * us_per_degree;
        Servo {
            data: *data,
            us_per_degree,
            at_us: at_us.clamp(data.mechanical_us[0], data.mechanical_us[1]),
            target_us: None,
            last_s: f64::NEG_INFINITY,
            now_s: 0.0,
            supply: false,
            ready_s: f64::INFINITY,
        }
    }

    /// Angle of the shaft, degrees.
    #[must_use]
    pub fn angle(&self) -> f64 {
        (self.at_us - MIDDLE_US) / self.us_per_degree
    }

    /// Torque of what its motor can give at present, 0 to 1.
    #[must_use]
    pub fn torque(&self) -> f64 {
        let silent = self.now_s - self.last_s;
        match (self.supply && self.target_us.is_some(), self.data.kind) {
            (false, _) => 0.0,
            (true, Kind::Digital) => 1.0,
            (true, Kind::Analogue) => ((RELAXED_S - silent) / (RELAXED_S - DRIVE_S)).clamp(0.0, 1.0),
        }
    }

    /// Switches the supply at a time, s. A servo that loses it forgets its last pulse; one that gets it starts, and takes no pulse until it has.
    pub fn set_supply(&mut self, seconds: f64, on: bool) {
        self.advance(seconds);
        if on && !self.supply {
            self.ready_s = seconds + self.data.start_up_s;
        }
        self.supply = on;
        if !on {
            self.target_us = None;
        }
    }

    /// Takes a pulse of this width that ends at a time, s, unless it is still starting.
    pub fn pulse(&mut self, ended: f64, us: f64) {
        self.advance(ended);
        let [least, most] = self.data.accepted_us;
        if !self.supply || ended < self.ready_s || !(least..=most).contains(&us) {
            return;
        }
        self.last_s = ended;
        // Within the dead band the motor stands still.
        let is_new = (us - self.at_us).abs() > self.data.dead_band_us;
        self.target_us = Some(if is_new { us } else { self.at_us });
    }

    /// Moves on to a time, s.
    pub fn advance(&mut self, seconds: f64) {
        let until = match self.data.kind {
            Kind::Analogue => seconds.min(self.last_s + DRIVE_S),
            Kind::Digital => seconds,
        };
        if let Some(target) = self.target_us.filter(|_| self.supply && until > self.now_s) {
            let [least, most] = self.data.mechanical_us;
            let farthest = (until - self.now_s) * 60.0 / self.data.s_per_60_degrees * self.us_per_degree;
            self.at_us += (target.clamp(least, most) - self.at_us).clamp(-farthest, farthest);
        }
        self.now_s = self.now_s.max(seconds);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCALE: f64 = 1000.0 / 90.0;

    /// A servo whose supply has been on for a second.
    fn servo(kind: Kind) -> Servo {
        let mut servo = Servo::new(DataSheet::of(kind), SCALE, 0.0);
        servo.set_supply(-1.0, true);
        servo
    }

    /// Pulses each 20 ms from a time on; the time after them.
    fn pulses(servo: &mut Servo, from: f64, count: u32, us: f64) -> f64 {
        (0..count).for_each(|n| servo.pulse(from + 0.02 * f64::from(n), us));
        let end = from + 0.02 * f64::from(count);
        servo.advance(end);
        end
    }

    #[test]
    fn both_follow_pulses_at_the_speed_of_the_data_sheet() {
        for kind in [Kind::Analogue, Kind::Digital] {
            let mut servo = servo(kind);
            let time = DataSheet::of(kind).s_per_60_degrees;
            (0..8)
                .map(|n| 0.02 * f64::from(n))
                .filter(|at| *at < time)
                .for_each(|at| servo.pulse(at, 1500.0 + 60.0 * SCALE));
            servo.advance(0.99 * time);
            assert!((servo.angle() - 59.4).abs() < 1e-6, "{kind:?}: {}", servo.angle());
            servo.advance(time);
            assert!((servo.angle() - 60.0).abs() < 1e-6, "{kind:?}: {}", servo.angle());
        }
    }

    #[test]
    fn one_pulse_moves_an_analogue_servo_for_a_frame_and_a_digital_one_all_the_way() {
        let [mut analogue, mut digital] = [servo(Kind::Analogue), servo(Kind::Digital)];
        for servo in [&mut analogue, &mut digital] {
            servo.pulse(0.0, 2000.0);
            servo.advance(1.0);
        }
        assert!((analogue.angle() - 8.0).abs() < 1e-9, "20 ms at 400 degrees a second: {}", analogue.angle());
        assert!((digital.angle() - 45.0).abs() < 1e-9, "{}", digital.angle());
    }

    #[test]
    fn silence_takes_the_torque_of_an_analogue_servo_only() {
        let [mut analogue, mut digital] = [servo(Kind::Analogue), servo(Kind::Digital)];
        for (after, of_analogue) in [(0.02, 1.0), (0.035, 0.5), (0.05, 0.0), (1.0, 0.0)] {
            for servo in [&mut analogue, &mut digital] {
                servo.pulse(0.0, 1500.0);
                servo.advance(after);
            }
            assert!((analogue.torque() - of_analogue).abs() < 1e-9, "{after}: {}", analogue.torque());
            assert_eq!(digital.torque(), 1.0);
        }
    }

    #[test]
    fn without_supply_there_is_neither_torque_nor_motion() {
        for kind in [Kind::Analogue, Kind::Digital] {
            let mut servo = servo(kind);
            servo.pulse(0.0, 2000.0);
            servo.set_supply(0.001, false);
            let angle = servo.angle();
            pulses(&mut servo, 0.02, 10, 900.0);
            assert_eq!((servo.angle(), servo.torque()), (angle, 0.0), "{kind:?}");
            servo.set_supply(0.3, true);
            servo.advance(0.4);
            assert_eq!((servo.angle(), servo.torque()), (angle, 0.0), "it has forgotten the pulse: {kind:?}");
        }
    }

    #[test]
    fn a_digital_servo_takes_no_pulse_while_it_starts() {
        let [mut analogue, mut digital] = [servo(Kind::Analogue), servo(Kind::Digital)];
        for servo in [&mut analogue, &mut digital] {
            servo.set_supply(0.5, false);
            servo.set_supply(1.0, true);
            // The supply that is on already starts nothing.
            servo.set_supply(1.1, true);
            pulses(servo, 1.0, 10, 1_600.0);
        }
        assert!((analogue.angle() - 9.0).abs() < 1e-9, "{}", analogue.angle());
        assert_eq!((digital.angle(), digital.torque()), (0.0, 0.0));
        digital.pulse(1.2, 1_600.0);
        digital.advance(1.4);
        assert!((digital.angle() - 9.0).abs() < 1e-9, "{}", digital.angle());
    }

    #[test]
    fn a_pulse_outside_the_accepted_range_is_ignored_and_the_mechanical_range_is_an_end_stop() {
        let mut digital = servo(Kind::Digital);
        digital.pulse(0.0, 1600.0);
        digital.pulse(0.02, 499.0);
        digital.advance(1.0);
        assert!((digital.angle() - 9.0).abs() < 1e-9);
        let mut analogue = servo(Kind::Analogue);
        pulses(&mut analogue, 0.0, 100, 100.0);
        assert!((analogue.angle() - -81.0).abs() < 1e-9, "600 us: {}", analogue.angle());
    }

    #[test]
    fn a_change_within_the_dead_band_does_not_move_it() {
        for (kind, within, beyond) in [(Kind::Analogue, 5.0, 6.0), (Kind::Digital, 4.0, 5.0)] {
            let mut servo = servo(kind);
            let end = pulses(&mut servo, 0.0, 5, 1500.0 + within);
            assert_eq!(servo.angle(), 0.0, "{kind:?}");
            pulses(&mut servo, end, 5, 1500.0 + beyond);
            assert!((servo.angle() - beyond / SCALE).abs() < 1e-9, "{kind:?}");
        }
    }
}
