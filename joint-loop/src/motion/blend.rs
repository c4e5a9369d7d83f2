//! The blend: ramps between the park pose and the generator's angles.
//!
//! ```text
//! target = weight * generator + (1 - weight) * park
//! weight = s(rise) * (1 - s(stop)) * (1 - s(hurry)),     s(x) = 10 x^3 - 15 x^4 + 6 x^5,   x = ticks / duration, 0 to 1
//! ```
//! s is the minimum-jerk profile (Flash and Hogan, J. Neurosci. 5 (1985) 1688): velocity and acceleration are 0 at both ends. A
//! stop does not replace the ramp that it interrupts but multiplies it. So the weight is twice continuously differentiable and
//! within 0 to 1 whenever a stop begins, also during a ramp, and when a normal stop becomes a hurried one. At weight 0 the
//! target is the park pose and at weight 1 the generator's angles, both bit for bit.

use crate::control::supervisor::Motion;
use crate::error::{LoopError, inside, ticks};
use crate::motion::ramp::ramp;
use crate::setup::robot::{DEFAULT_PARK, GateConfig};
use joint_units::{Joint, Period, Radians};

/// Park pose and ramp times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BlendConfig {
    /// Pose at the start and at the end of a motion. rad, inside the gate's range and pose envelope.
    pub park: [Radians; Joint::COUNT],
    /// Time of the ramp from the park pose to the generator's angles. s, 0.5 to 30.
    pub ramp_s: f32,
    /// Time of a stop by the button. s, 0.3 to 30.
    pub stop_s: f32,
    /// Time of a stop that the monitor demands. s, 0.1 to 0.3.
    pub hurry_s: f32,
}

impl BlendConfig {
    /// Park pose [`DEFAULT_PARK`]; ramp 2 s: under two strides; stop 1 s: about one stride; hurry 0.3 s: the longest allowed
    /// motion after a sensor or the generator has failed.
    pub const DEFAULT: Self = Self { park: DEFAULT_PARK, ramp_s: 2.0, stop_s: 1.0, hurry_s: 0.3 };

    /// Checks the fields, and the park pose against the gate's limits.
    ///
    /// # Errors
    /// [`LoopError`] names the first field that is not allowed.
    pub fn build(&self, period: Period, gate: &GateConfig) -> Result<Blend, LoopError> {
        for ((joint, angle), range) in Joint::ALL.into_iter().zip(self.park).zip(gate.range) {
            let (least, most) = (range.least.degrees(), range.most.degrees());
            inside("blend.park", Some(joint), angle.degrees(), least, most, "deg")?;
        }
        for (index, limit) in gate.pose.iter().enumerate() {
            if limit.is_some_and(|limit| limit.of(&self.park).0 >= limit.most.0) {
                return Err(LoopError::ParkOutsidePose { index });
            }
        }
        Ok(Blend {
            park: self.park,
            ramp: ticks("blend.ramp_s", self.ramp_s, 0.5, 30.0, period)?,
            stop: ticks("blend.stop_s", self.stop_s, 0.3, 30.0, period)?,
            hurry: ticks("blend.hurry_s", self.hurry_s, 0.1, 0.3, period)?,
            grace: ticks("grace", GRACE_S, GRACE_S, GRACE_S, period)?,
        })
    }
}

/// Time after the end of a stop in which the gate may still move to the park pose. Then the outputs are switched off.
const GRACE_S: f32 = 0.5;

/// Blend for one period: a checked [`BlendConfig`] in ticks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Blend {
    park: [Radians; Joint::COUNT],
    ramp: u32,
    stop: u32,
    hurry: u32,
    grace: u32,
}

/// State of the blend: ticks since each ramp began; `None` before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Weight {
    rise: Option<u32>,
    stop: Option<u32>,
    hurry: Option<u32>,
}

impl Weight {
    /// Whether the ramp to the generator's angles has not begun, in a motion.
    #[must_use]
    pub fn is_at_start(self) -> bool {
        self.rise == Some(0)
    }
}

impl Blend {
    /// The park pose.
    #[must_use]
    pub const fn park(&self) -> [Radians; Joint::COUNT] {
        self.park
    }

    /// Advances the ramps by one tick. A repeated instruction does not restart a ramp.
    #[must_use]
    pub fn advance(&self, weight: Weight, motion: Motion) -> Weight {
        let on = |ticks: Option<u32>| ticks.map(|ticks| ticks.saturating_add(1));
        let mut next = Weight { rise: on(weight.rise), stop: on(weight.stop), hurry: on(weight.hurry) };
        match motion {
            Motion::Rest | Motion::Trim => Weight::default(),
            Motion::Freeze => weight,
            Motion::Rise => Weight { rise: Some(0), ..Weight::default() },
            Motion::Run => next,
            Motion::Stop => {
                next.stop.get_or_insert(0);
                next
            }
            Motion::Hurry => {
                next.hurry.get_or_insert(0);
                next
            }
        }
    }

    /// The same where the joints may not be at the park pose yet: the ramp to the generator's angles begins when they are, and not in a stop.
    #[must_use]
    pub fn advance_from(&self, weight: Weight, motion: Motion, at_park: bool) -> Weight {
        let next = self.advance(weight, motion);
        let stops = next.stop.is_some() || next.hurry.is_some();
        if weight.is_at_start() && (stops || !at_park) { Weight { rise: next.rise.map(|_| 0), ..next } } else { next }
    }

    /// Share of the generator in the target, 0 to 1.
    #[must_use]
    pub fn weight(&self, weight: Weight) -> f32 {
        ramp(weight.rise, self.ramp) * (1.0 - ramp(weight.stop, self.stop)) * (1.0 - ramp(weight.hurry, self.hurry))
    }

    /// Target pose for the generator's angles.
    #[must_use]
    pub fn target(&self, weight: Weight, generator: [Radians; Joint::COUNT]) -> [Radians; Joint::COUNT] {
        let mut target = generator;
        let weight = self.weight(weight);
        for (angle, park) in target.iter_mut().zip(self.park) {
            *angle = Radians(angle.0 * weight + park.0 * (1.0 - weight));
        }
        target
    }

    /// Whether the ramp to the generator's angles has ended.
    #[must_use]
    pub fn risen(&self, weight: Weight) -> bool {
        weight.rise.is_some_and(|ticks| ticks >= self.ramp)
    }

    /// Whether a stop has ended: the target is the park pose.
    #[must_use]
    pub fn stopped(&self, weight: Weight) -> bool {
        self.stopped_for(weight, 0)
    }

    /// Whether a stop ended more than 0.5 s ago, enough for the gate to reach the park pose.
    #[must_use]
    pub fn overdue(&self, weight: Weight) -> bool {
        self.stopped_for(weight, self.grace)
    }

    fn stopped_for(&self, weight: Weight, ticks: u32) -> bool {
        weight.stop.is_some_and(|stop| stop >= self.stop.saturating_add(ticks))
            || weight.hurry.is_some_and(|hurry| hurry >= self.hurry.saturating_add(ticks))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::ramp::minimum_jerk;
    use proptest::prelude::*;

    fn blend() -> Blend {
        BlendConfig::DEFAULT.build(Period::MILLISECOND, &GateConfig::default_biped()).expect("valid")
    }

    #[test]
    fn the_ends_are_exact() {
        let (blend, angles) = (blend(), [0.123, -0.4, 1.07, 0.01].map(Radians));
        let begun = blend.advance(Weight::default(), Motion::Rise);
        assert_eq!(blend.target(begun, angles), blend.park());
        let risen = (0..2_000).fold(begun, |weight, _| blend.advance(weight, Motion::Run));
        assert!(blend.risen(risen) && !blend.risen(Weight { rise: Some(1_999), ..risen }));
        assert_eq!(blend.target(risen, angles).map(|a| a.0.to_bits()), angles.map(|a| a.0.to_bits()));
        let stopped = (0..=1_000).fold(risen, |weight, _| blend.advance(weight, Motion::Stop));
        assert!(blend.stopped(stopped) && !blend.overdue(stopped));
        assert_eq!(blend.target(stopped, angles), blend.park());
        assert!(blend.overdue((0..500).fold(stopped, |weight, _| blend.advance(weight, Motion::Stop))));
    }

    #[test]
    fn a_stop_begins_at_the_full_weight_and_ends_in_its_time() {
        let blend = blend();
        let risen = Weight { rise: Some(2_000), ..Weight::default() };
        for (motion, duration) in [(Motion::Stop, 1_000), (Motion::Hurry, 300)] {
            let mut weight = blend.advance(risen, motion);
            assert_eq!(blend.weight(weight), 1.0);
            for tick in 0..duration {
                assert!(!blend.stopped(weight), "{tick}");
                weight = blend.advance(weight, if tick % 2 == 0 { motion } else { Motion::Run });
            }
            assert!(blend.stopped(weight) && blend.weight(weight) == 0.0);
            let frozen = blend.advance(weight, Motion::Freeze);
            assert_eq!((frozen, blend.advance(weight, Motion::Rest)), (weight, Weight::default()));
        }
    }

    #[test]
    fn the_ramp_waits_for_the_park_pose_and_does_not_begin_in_a_stop() {
        let blend = blend();
        let begun = blend.advance_from(Weight::default(), Motion::Rise, false);
        let waiting = (0..5_000).fold(begun, |weight, _| blend.advance_from(weight, Motion::Run, false));
        assert!(waiting.is_at_start() && waiting == begun);
        let on = blend.advance_from(waiting, Motion::Run, true);
        assert_eq!(on.rise, Some(1));
        // Once begun it goes on.
        assert_eq!(blend.advance_from(on, Motion::Run, false).rise, Some(2));
        for motion in [Motion::Stop, Motion::Hurry] {
            let stopped = (0..2_000).fold(waiting, |weight, _| blend.advance_from(weight, motion, true));
            assert!(blend.overdue(stopped) && blend.weight(stopped) == 0.0 && stopped.is_at_start());
        }
        assert_eq!(blend.advance_from(waiting, Motion::Rest, true), Weight::default());
    }

    #[test]
    fn the_ramp_has_the_minimum_jerk_profile() {
        // Closed form: 1/2 at half time, largest speed there with 15/8 of the mean, largest acceleration 10/sqrt(3).
        assert_eq!(minimum_jerk(0.5), 0.5);
        let h = 1e-3_f64;
        let s = |x: f64| f64::from(minimum_jerk(x as f32));
        assert!(((s(0.5 + h) - s(0.5 - h)) / (2.0 * h) - 1.875).abs() < 1e-3);
        let h = 1e-2_f64;
        let peak = 0.5 - 0.5 / 3.0_f64.sqrt();
        let acceleration = (s(peak + h) - 2.0 * s(peak) + s(peak - h)) / (h * h);
        assert!((acceleration - 10.0 / 3.0_f64.sqrt()).abs() < 2e-2, "{acceleration}");
    }

    proptest! {
        /// With stops at any time: 0 to 1, at most the sum of the ramps' speeds, no step in speed.
        #[test]
        fn the_weight_is_smooth_whenever_a_stop_begins(stop_at in 1_u32..4_000, hurry_after in 0_u32..2_000) {
            let blend = blend();
            let (mut weight, mut last) = (blend.advance(Weight::default(), Motion::Rise), [0.0_f64; 2]);
            for tick in 1..6_500 {
                let motion = match tick {
                    t if t < stop_at => Motion::Run,
                    t if t < stop_at + hurry_after => Motion::Stop,
                    _ => Motion::Hurry,
                };
                weight = blend.advance(weight, motion);
                let now = f64::from(blend.weight(weight));
                prop_assert!((0.0..=1.0).contains(&now));
                let (speed, before) = (now - last[1], last[1] - last[0]);
                // Sum of 15/8 over each of the three durations.
                prop_assert!(speed.abs() <= 1.875 * (1.0 / 300.0 + 1.0 / 1000.0 + 1.0 / 2000.0));
                // Largest possible value: accelerations of the three, and twice the products of their speeds.
                prop_assert!((speed - before).abs() <= 1.5e-4, "{} at {}", speed - before, tick);
                last = [last[1], now];
            }
            prop_assert!(last[1] == 0.0 && blend.stopped(weight));
        }
    }
}
