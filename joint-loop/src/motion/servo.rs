//! The servo map: converts a joint angle to the pulse width of a hobby servo.
//!
//! ```text
//! pulse = neutral + direction * micros_per_radian * (angle - angle_at_neutral),   clamped to shortest..longest
//! ```
//! An angle that is not finite is refused before the clamp and the cast: a cast of NaN to an integer gives 0, and `clamp`
//! returns NaN for NaN.

use crate::error::{LoopError, inside};
use crate::setup::robot::{Direction, JointRange, LONGEST, SHORTEST, ServoConfig};
use joint_units::{Joint, PulseMicros, Radians};

impl ServoConfig {
    /// Checks the fields and makes the map of a joint.
    ///
    /// # Errors
    /// [`LoopError`] names the first field that is not allowed, and the joint.
    pub fn build(&self, joint: Joint) -> Result<ServoMap, LoopError> {
        let pulse = |field, value: PulseMicros, least: PulseMicros, most: PulseMicros| {
            inside(field, Some(joint), f32::from(value.0), f32::from(least.0), f32::from(most.0), "us")
        };
        let shortest = pulse("servos.shortest", self.shortest, SHORTEST, LONGEST)?;
        let longest = pulse("servos.longest", self.longest, SHORTEST, LONGEST)?;
        if shortest >= longest {
            return Err(LoopError::Inverted { field: "servos.shortest..longest", joint: Some(joint) });
        }
        let neutral = pulse("servos.neutral", self.neutral, self.shortest, self.longest)?;
        inside("servos.angle_at_neutral", Some(joint), self.angle_at_neutral.degrees(), -180.0, 180.0, "deg")?;
        let scale = inside("servos.micros_per_radian", Some(joint), self.micros_per_radian, 100.0, 2_000.0, "us/rad")?;
        let gain = match self.direction {
            Direction::Forward => scale,
            Direction::Mirrored => -scale,
        };
        Ok(ServoMap { neutral, origin: self.angle_at_neutral.0, gain, shortest, longest })
    }
}

/// Servo map of one joint: a checked [`ServoConfig`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServoMap {
    neutral: f32,
    origin: f32,
    gain: f32,
    shortest: f32,
    longest: f32,
}

impl ServoMap {
    /// Pulse for an angle, rounded to the nearest microsecond; `None` for an angle that is not finite.
    #[must_use]
    pub fn pulse(&self, angle: Radians) -> Option<PulseMicros> {
        let micros = self.micros(angle);
        // From 500 to 2500. Not `clamp`, which has a panic for limits in the wrong order.
        micros.is_finite().then(|| PulseMicros((micros.max(self.shortest).min(self.longest) + 0.5) as u16))
    }

    /// Pulses of all servos for a pose; `None` if one of its angles is not finite.
    #[must_use]
    pub fn pulses(servos: &[Self; Joint::COUNT], pose: [Radians; Joint::COUNT]) -> Option<[PulseMicros; Joint::COUNT]> {
        let mut pulses = [PulseMicros(0); Joint::COUNT];
        for ((pulse, servo), angle) in pulses.iter_mut().zip(servos).zip(pose) {
            *pulse = servo.pulse(angle)?;
        }
        Some(pulses)
    }

    /// Whether the servo may get this pulse.
    #[must_use]
    pub fn allows(&self, pulse: PulseMicros) -> bool {
        (self.shortest..=self.longest).contains(&f32::from(pulse.0))
    }

    /// The pulse of this servo that is nearest to another one.
    pub(crate) fn nearest(&self, pulse: PulseMicros) -> PulseMicros {
        // Not `clamp`, which has a panic for limits in the wrong order. From 500 to 2500, as checked.
        PulseMicros(pulse.0.max(self.shortest as u16).min(self.longest as u16))
    }

    /// Angle for a pulse: the inverse map.
    #[must_use]
    pub fn angle(&self, pulse: PulseMicros) -> Radians {
        Radians(self.origin + (f32::from(pulse.0) - self.neutral) / self.gain)
    }

    /// Checks that the pulses of a range are within the limits, so that the clamp never acts.
    pub(crate) fn reaches(&self, joint: Joint, range: &JointRange) -> Result<(), LoopError> {
        for end in [range.least, range.most] {
            let micros = self.micros(end);
            if !(micros >= self.shortest && micros <= self.longest) {
                let (shortest, longest) = (self.shortest as u16, self.longest as u16);
                return Err(LoopError::BeyondPulses { joint, micros, shortest, longest });
            }
        }
        Ok(())
    }

    fn micros(&self, angle: Radians) -> f32 {
        self.neutral + self.gain * (angle.0 - self.origin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const KNEE: ServoConfig = ServoConfig::hobby(Radians::from_degrees(45.0), Direction::Forward);

    fn map(config: ServoConfig) -> ServoMap {
        config.build(Joint::LeftKnee).expect("valid")
    }

    #[test]
    fn known_angles_give_known_pulses() {
        let (forward, mirrored) = (map(KNEE), map(ServoConfig { direction: Direction::Mirrored, ..KNEE }));
        // 90 degrees are 1000 us, by the definition of 636.62 us/rad.
        for (degrees, micros) in [(45.0, 1500), (135.0, 2500), (-45.0, 500), (90.0, 2000), (5.0, 1056), (1000.0, 2500)]
        {
            let angle = Radians::from_degrees(degrees);
            assert_eq!(forward.pulse(angle), Some(PulseMicros(micros)), "{degrees}");
            assert_eq!(mirrored.pulse(angle), Some(PulseMicros(3000 - micros)), "{degrees} mirrored");
        }
    }

    #[test]
    fn an_angle_that_is_not_finite_has_no_pulse() {
        for angle in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN] {
            assert_eq!(map(KNEE).pulse(Radians(angle)), None, "{angle}");
        }
        for (angle, micros) in [(1e30, 2500), (-1e30, 500), (f32::MIN_POSITIVE, 1000), (-0.0, 1000)] {
            assert_eq!(map(KNEE).pulse(Radians(angle)), Some(PulseMicros(micros)), "{angle}");
        }
    }

    #[test]
    fn every_field_is_checked_by_name() {
        let broken: [(&str, ServoConfig); 9] = [
            ("servos.shortest[left_knee] is 499", ServoConfig { shortest: PulseMicros(499), ..KNEE }),
            ("servos.longest[left_knee] is 2501", ServoConfig { longest: PulseMicros(2501), ..KNEE }),
            (
                "servos.shortest..longest[left_knee]",
                ServoConfig { shortest: PulseMicros(1500), longest: PulseMicros(1500), ..KNEE },
            ),
            (
                "servos.neutral[left_knee] is 2401",
                ServoConfig { neutral: PulseMicros(2401), longest: PulseMicros(2400), ..KNEE },
            ),
            ("servos.angle_at_neutral[left_knee] is not", ServoConfig { angle_at_neutral: Radians(f32::NAN), ..KNEE }),
            ("servos.angle_at_neutral[left_knee] is", ServoConfig { angle_at_neutral: Radians(4.0), ..KNEE }),
            ("servos.micros_per_radian[left_knee] is not", ServoConfig { micros_per_radian: f32::INFINITY, ..KNEE }),
            ("servos.micros_per_radian[left_knee] is 0", ServoConfig { micros_per_radian: 0.0, ..KNEE }),
            ("servos.micros_per_radian[left_knee] is -636", ServoConfig { micros_per_radian: -636.62, ..KNEE }),
        ];
        for (words, config) in broken {
            let error = config.build(Joint::LeftKnee).expect_err(words).to_string();
            assert!(error.starts_with(words), "{error}");
        }
    }

    proptest! {
        #[test]
        fn a_pulse_is_always_inside_and_converts_back(
            bits: u32, mirrored: bool, neutral in 500_u16..=2500, origin in -3.1_f32..3.1, scale in 100.0_f32..2000.0,
        ) {
            let direction = if mirrored { Direction::Mirrored } else { Direction::Forward };
            let map = map(ServoConfig {
                neutral: PulseMicros(neutral), angle_at_neutral: Radians(origin), micros_per_radian: scale, direction, ..KNEE
            });
            if let Some(pulse) = map.pulse(Radians(f32::from_bits(bits))) {
                prop_assert!((500..=2500).contains(&pulse.0));
            }
            for micros in [500, 777, 1500, 2500] {
                let back = map.pulse(map.angle(PulseMicros(micros))).expect("finite");
                prop_assert!(back.0.abs_diff(micros) <= 1, "{} for {micros}", back.0);
            }
        }
    }
}
