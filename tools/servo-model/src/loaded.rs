//! A servo under load: the torque of its shaft, from the last pulse, the supply, and the angle and speed that a body gives the shaft.

use std::f64::consts::FRAC_PI_3;
use std::fmt;

use crate::drive::{DRIVE_S, RELAXED_S};
use crate::{Kind, LoadSheet};

/// What a servo does at one supply.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strength {
    /// Torque at speed 0, N m.
    pub stall_nm: f64,
    /// Speed at torque 0, rad/s.
    pub no_load_rad_s: f64,
}

/// A supply beyond the data sheet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SupplyError {
    /// The servo's name.
    pub name: &'static str,
    /// What was asked for, V.
    pub volts: f64,
    /// Least and highest supply of the data sheet, V.
    pub allowed: [f64; 2],
}

impl fmt::Display for SupplyError {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [least, most] = self.allowed;
        write!(
            to,
            "supply of {} = {} V: allowed is {least} to {most} V, as its data sheet has, or 0 V for none",
            self.name, self.volts
        )
    }
}

impl std::error::Error for SupplyError {}

impl LoadSheet {
    /// Stall torque and no-load speed at a supply, V: straight lines between the points of the data sheet.
    ///
    /// # Errors
    /// A supply outside of the data sheet's points: nothing says what the servo does there.
    pub fn strength(&self, volts: f64) -> Result<Strength, SupplyError> {
        let [low, high] = self.points;
        let allowed = [low.volts, high.volts];
        if !(low.volts..=high.volts).contains(&volts) {
            return Err(SupplyError { name: self.name, volts, allowed });
        }
        let share = (volts - low.volts) / (high.volts - low.volts);
        let between = |from: f64, to: f64| from + share * (to - from);
        Ok(Strength {
            stall_nm: between(low.stall_nm, high.stall_nm),
            no_load_rad_s: between(FRAC_PI_3 / low.s_per_60_degrees, FRAC_PI_3 / high.s_per_60_degrees),
        })
    }
}

/// A servo whose shaft is turned by a body as much as by its motor. Angles are those of the shaft, 0 at 1500 us, and grow with the pulse.
///
/// The torque is that of a motor whose voltage is proportional to the error within the proportional band, and whose speed takes from it what the
/// line from stall torque to no-load speed says: `stall * share(error) - stall / no_load * speed`. It may pass the stall torque where the body
/// turns the shaft against the drive, up to twice. Times are seconds and may not go back.
#[derive(Debug, Clone)]
pub struct LoadedServo {
    sheet: LoadSheet,
    us_per_rad: f64,
    target_us: Option<f64>,
    /// End of the last pulse that it took, s.
    last_s: f64,
    /// `None`: no supply.
    strength: Option<Strength>,
}

impl LoadedServo {
    /// Pulse of the middle, us.
    pub const MIDDLE_US: f64 = 1_500.0;

    /// A servo without supply. `us_per_rad`: change of the pulse for one radian of the shaft, above 0.
    #[must_use]
    pub fn new(sheet: &LoadSheet, us_per_rad: f64) -> Self {
        LoadedServo { sheet: *sheet, us_per_rad, target_us: None, last_s: f64::NEG_INFINITY, strength: None }
    }

    /// Switches the supply, V; 0 is none, and a servo that loses it forgets its last pulse.
    ///
    /// # Errors
    /// A supply outside of the data sheet; the servo keeps the one that it has.
    pub fn set_supply(&mut self, volts: f64) -> Result<(), SupplyError> {
        if volts == 0.0 {
            (self.strength, self.target_us) = (None, None);
            return Ok(());
        }
        self.strength = Some(self.sheet.strength(volts)?);
        Ok(())
    }

    /// Takes a pulse of this width that ends at a time, s. One outside of the range that the servo accepts changes nothing.
    pub fn pulse(&mut self, ended_s: f64, us: f64) {
        let [least, most] = self.sheet.accepted_us;
        if self.strength.is_some() && (least..=most).contains(&us) {
            let [shortest, longest] = self.sheet.mechanical_us;
            self.target_us = Some(us.clamp(shortest, longest));
            self.last_s = ended_s;
        }
    }

    /// Torque of the motor at the shaft at a time, N m, positive towards longer pulses. `angle`: of the shaft, rad; `speed`: rad/s.
    ///
    /// Within the dead band the motor only brakes. An analogue servo fades without pulses; then it does not brake either.
    #[must_use]
    pub fn torque(&self, seconds: f64, angle: f64, speed: f64) -> f64 {
        let (Some(strength), Some(target)) = (self.strength, self.target_us) else { return 0.0 };
        let error_us = target - (Self::MIDDLE_US + angle * self.us_per_rad);
        // From the edge of the dead band on, so that the torque has no step there.
        let beyond = (error_us.abs() - self.sheet.dead_band_us).max(0.0) / self.us_per_rad;
        let drive = (beyond / self.sheet.band_rad).min(1.0).copysign(error_us);
        self.awake(seconds) * strength.stall_nm * (drive - speed / strength.no_load_rad_s)
    }

    /// How much of its drive a servo has after its last pulse, 0 to 1.
    fn awake(&self, seconds: f64) -> f64 {
        match self.sheet.kind {
            Kind::Digital => 1.0,
            Kind::Analogue => ((RELAXED_S - (seconds - self.last_s)) / (RELAXED_S - DRIVE_S)).clamp(0.0, 1.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const US_PER_RAD: f64 = 2_000.0 / std::f64::consts::PI;
    /// N m of one kgf cm.
    const KGF_CM: f64 = 0.098_066_5;

    fn servo(sheet: &LoadSheet, volts: f64) -> LoadedServo {
        let mut servo = LoadedServo::new(sheet, US_PER_RAD);
        servo.set_supply(volts).expect("a supply of the data sheet");
        servo
    }

    #[test]
    fn a_shaft_that_stands_far_from_its_pulse_has_the_stall_torque_of_the_data_sheet() {
        for (sheet, low, high) in [
            (&LoadSheet::SG90, (4.8, 1.8), (6.0, 2.2)),
            (&LoadSheet::MG996R, (4.8, 9.4), (6.0, 11.0)),
            (&LoadSheet::DS3225, (5.0, 21.0), (6.8, 25.0)),
        ] {
            for (volts, kgf_cm) in [low, high] {
                let mut servo = servo(sheet, volts);
                servo.pulse(0.0, 2_000.0);
                assert!((servo.torque(0.0, 0.0, 0.0) - kgf_cm * KGF_CM).abs() < 1e-9, "{}", sheet.name);
                servo.pulse(0.0, 1_000.0);
                assert!((servo.torque(0.0, 0.0, 0.0) + kgf_cm * KGF_CM).abs() < 1e-9, "{}", sheet.name);
            }
        }
    }

    #[test]
    fn at_the_speed_of_the_data_sheet_there_is_no_torque() {
        for (sheet, volts, time) in
            [(&LoadSheet::SG90, 6.0, 0.10), (&LoadSheet::MG996R, 4.8, 0.17), (&LoadSheet::DS3225, 6.8, 0.13)]
        {
            let mut servo = servo(sheet, volts);
            servo.pulse(0.0, 2_000.0);
            let no_load = 60_f64.to_radians() / time;
            assert!(servo.torque(0.0, 0.0, no_load).abs() < 1e-12, "{}", sheet.name);
            // Half of the stall torque at half of the speed: a straight line.
            let stall = servo.torque(0.0, 0.0, 0.0);
            assert!((servo.torque(0.0, 0.0, no_load / 2.0) - stall / 2.0).abs() < 1e-12);
        }
    }

    #[test]
    fn within_the_dead_band_it_only_brakes_and_beyond_it_the_torque_rises_over_the_proportional_band() {
        let sheet = LoadSheet::MG996R;
        let mut servo = servo(&sheet, 6.0);
        let stall = sheet.strength(6.0).expect("a supply of the data sheet").stall_nm;
        servo.pulse(0.0, 1_504.9);
        assert_eq!(servo.torque(0.0, 0.0, 0.0), 0.0);
        assert!(servo.torque(0.0, 0.0, 1.0) < 0.0 && servo.torque(0.0, 0.0, -1.0) > 0.0, "it brakes");
        for share in [0.25, 0.5, 1.0, 2.0] {
            servo.pulse(0.0, 1_500.0 + sheet.dead_band_us + share * sheet.band_rad * US_PER_RAD);
            assert!((servo.torque(0.0, 0.0, 0.0) - stall * share.min(1.0)).abs() < 1e-9, "{share}");
        }
    }

    #[test]
    fn silence_fades_an_analogue_servo_and_a_digital_one_holds() {
        for (sheet, after_35_ms, after_1_s) in
            [(&LoadSheet::MG996R, 0.5, 0.0), (&LoadSheet::SG90, 0.5, 0.0), (&LoadSheet::DS3225, 1.0, 1.0)]
        {
            let mut servo = servo(sheet, 6.0);
            assert_eq!(servo.torque(0.0, 0.5, 1.0), 0.0, "no pulse yet");
            servo.pulse(0.0, 2_000.0);
            let full = servo.torque(0.0, 0.0, 1.0);
            assert_eq!(servo.torque(0.02, 0.0, 1.0), full);
            assert!((servo.torque(0.035, 0.0, 1.0) - after_35_ms * full).abs() < 1e-9, "{}", sheet.name);
            assert_eq!(servo.torque(1.0, 0.0, 1.0), after_1_s * full, "{}", sheet.name);
        }
    }

    #[test]
    fn without_supply_there_is_no_torque_and_the_pulse_is_forgotten() {
        let mut servo = LoadedServo::new(&LoadSheet::DS3225, US_PER_RAD);
        servo.pulse(0.0, 2_000.0);
        assert_eq!(servo.torque(0.0, 0.0, 1.0), 0.0);
        servo.set_supply(6.0).expect("a supply of the data sheet");
        servo.pulse(0.0, 2_000.0);
        servo.set_supply(0.0).expect("none");
        servo.set_supply(6.0).expect("a supply of the data sheet");
        assert_eq!(servo.torque(0.0, 0.0, 1.0), 0.0);
    }

    #[test]
    fn torque_and_speed_grow_with_the_supply_and_nothing_is_said_beyond_the_data_sheet() {
        for sheet in LoadSheet::ALL {
            let [low, high] = sheet.points;
            let at = |share: f64| sheet.strength(low.volts + share * (high.volts - low.volts)).expect("within");
            let all: Vec<Strength> = (0..=10).map(|tenth| at(f64::from(tenth) / 10.0)).collect();
            assert!(all.windows(2).all(|pair| pair[0].stall_nm < pair[1].stall_nm), "{}", sheet.name);
            assert!(all.windows(2).all(|pair| pair[0].no_load_rad_s < pair[1].no_load_rad_s), "{}", sheet.name);
            for volts in [low.volts - 0.1, high.volts + 0.1, -1.0, f64::NAN] {
                let error = LoadedServo::new(sheet, US_PER_RAD).set_supply(volts).expect_err("beyond the data sheet");
                assert!(
                    error.to_string().contains(&format!("allowed is {} to {} V", low.volts, high.volts)),
                    "{error}"
                );
            }
        }
    }

    #[test]
    fn a_pulse_that_is_not_accepted_changes_nothing_and_the_mechanical_range_bounds_the_target() {
        let mut servo = servo(&LoadSheet::DS3225, 6.0);
        servo.pulse(0.0, 1_600.0);
        let before = servo.torque(0.0, 0.0, 0.0);
        servo.pulse(0.02, 2_600.0);
        servo.pulse(0.02, f64::NAN);
        assert_eq!(servo.torque(0.02, 0.0, 0.0), before);
        let mut analogue = LoadedServo::new(&LoadSheet::MG996R, US_PER_RAD);
        analogue.set_supply(6.0).expect("a supply of the data sheet");
        analogue.pulse(0.0, 100.0);
        let stop = (LoadSheet::MG996R.mechanical_us[0] - LoadedServo::MIDDLE_US) / US_PER_RAD;
        assert_eq!(analogue.torque(0.0, stop, 0.0), 0.0, "at its end stop it has arrived");
    }
}
