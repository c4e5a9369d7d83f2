//! Hips and knees from the oscillatory building block ([`crate::edge_reversal::obb`]), with profiles of swing and stance.
//!
//! One neuron swings the left leg, the other the right; a leg stands while the other swings. A leg swings from its rear to its front angle
//! in the first step of the block in which its neuron fires, and moves back in the first step in which the other neuron fires; its knee
//! bends once in each swing. With s the elapsed part of the step:
//!
//! ```text
//! hip = from + (to - from) (3 s^2 - 2 s^3),   knee = stance + (swing - stance) 16 s^2 (1 - s)^2
//! ```
//! so angle and rate are continuous for every firing word. The word of the steps (1, 1) is FEFE, walking; (1, 2) is a limp, in which the right leg has two
//! of three steps. Yang et al. 2014 do not define joint angles; these profiles were designed here.
//!
//! ```
//! use cpg_core::Generator;
//! use cpg_core::joints::swing_stance::{ObbWalk, ObbWalkConfig};
//! let mut walk = ObbWalkConfig::default().build(joint_units::Period::MILLISECOND)?;
//! assert!((walk.angles()[0].degrees() - 25.0).abs() < 1e-3);
//! for _ in 0..550 {
//!     walk.step();
//! }
//! // Half a stride later the legs have changed places; a quarter on, the left knee is bent most.
//! assert!((walk.angles()[1].degrees() - 25.0).abs() < 1e-3);
//! for _ in 0..275 {
//!     walk.step();
//! }
//! assert!((walk.angles()[2].degrees() - 60.0).abs() < 1e-3);
//! # Ok::<(), cpg_core::BuildError>(())
//! ```

use joint_units::{Period, Phase, RadPerSec, Radians};

use crate::edge_reversal::obb::{Neuron, Obb, Reversibilities};
use crate::error::{all_in_range, allow_period, in_range};
use crate::joints::features::{Features, fill};
use crate::waveform::clock::STRIDE_RANGE_S;
use crate::{BuildError, Field, Generator, StateFault};

/// Largest number of steps of a leg in a stride.
pub const MAX_STEPS: u32 = 8;

/// Steps of each leg, stride and profiles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObbWalkConfig {
    /// Steps of the left leg and of the right leg in a stride, 1 to [`MAX_STEPS`]; one of the two is 1.
    pub steps: [u32; 2],
    /// Stride in seconds, within [`STRIDE_RANGE_S`].
    pub stride_s: f32,
    /// Hip angle at the end of a swing and of a stance; within ±pi/2.
    pub hip: [Radians; 2],
    /// Knee angle in stance, and its largest angle in swing; 0 to pi.
    pub knee: [Radians; 2],
}

impl Default for ObbWalkConfig {
    /// Both legs alike at a stride of 1.1 s, hips 25 to -15 degrees, knees 5 to 60.
    fn default() -> Self {
        Self {
            steps: [1, 1],
            stride_s: 1.1,
            hip: [25.0, -15.0].map(Radians::from_degrees),
            knee: [5.0, 60.0].map(Radians::from_degrees),
        }
    }
}

/// Position of a leg at the start and at the end of a step: 0 rear, 1 front.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Leg {
    from: f32,
    to: f32,
}

/// Hips and knees driven by one building block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObbWalk {
    config: ObbWalkConfig,
    block: Obb,
    /// State before the step in which the left leg, in front, begins to stand.
    start: (Obb, [Leg; 2]),
    /// Steps of a stride.
    steps: u32,
    /// Time in the step times the steps of a stride, microseconds: exact for any period.
    elapsed: u32,
    stride_us: u32,
    period: Period,
    legs: [Leg; 2],
    steps_since_front: u32,
}

impl ObbWalkConfig {
    /// Validates the configuration for a control period; the generator starts where the left leg is in front.
    ///
    /// # Errors
    /// Names the field that is out of range; `PeriodTooLong` for fewer than 8 ticks a step.
    pub fn build(&self, period: Period) -> Result<ObbWalk, BuildError> {
        let [left, right] = self.steps;
        let most = MAX_STEPS as f32;
        in_range(left as f32, Field::at("steps", 0), 1.0, most)?;
        in_range(right as f32, Field::at("steps", 1), 1.0, if left == 1 { most } else { 1.0 })?;
        in_range(self.stride_s, Field::of("stride_s"), STRIDE_RANGE_S.0, STRIDE_RANGE_S.1)?;
        let pi = core::f32::consts::PI;
        all_in_range(self.hip.map(|angle| angle.0), "hip", -0.5 * pi, 0.5 * pi)?;
        all_in_range(self.knee.map(|angle| angle.0), "knee", 0.0, pi)?;
        // A neuron fires as often as the other's reversibility says.
        let reversibilities = Reversibilities::new(right, left).map_err(|_| BuildError::OutOfRange {
            field: Field::of("steps"),
            value: left as f32,
            min: 1.0,
            max: most,
        })?;
        let (steps, stride_us) = (left.saturating_add(right), (self.stride_s * 1e6 + 0.5) as u32);
        let max_micros = (stride_us / 8).checked_div(steps).unwrap_or(0);
        allow_period(period, max_micros)?;
        let mut block = Obb::new(reversibilities);
        let mut legs = [Leg::default(); 2];
        // More than one stride, until the left leg has swung.
        for _ in 0..4 * MAX_STEPS {
            turn(&mut legs, block.step());
            if legs.first().is_some_and(|left| left.from < left.to) {
                break;
            }
        }
        let mut walk = ObbWalk {
            config: *self,
            block,
            start: (block, legs),
            steps,
            elapsed: 0,
            stride_us,
            period,
            legs,
            steps_since_front: 0,
        };
        walk.reset();
        Ok(walk)
    }
}

impl ObbWalk {
    /// The building block.
    #[must_use]
    pub const fn block(&self) -> &Obb {
        &self.block
    }

    fn next_step(&mut self) {
        let arrived = self.legs.first().is_some_and(|left| left.from < left.to);
        turn(&mut self.legs, self.block.step());
        self.steps_since_front = if arrived { 0 } else { self.steps_since_front.saturating_add(1) };
    }

    /// Elapsed part of the step.
    fn part(&self) -> f32 {
        self.elapsed as f32 / self.stride_us as f32
    }

    /// Position of a leg (0 rear, 1 front) and flexion of its knee, 0 to 1.
    fn leg(leg: &Leg, s: f32) -> [f32; 2] {
        let rise = s * s * (3.0 - 2.0 * s);
        let bend = if leg.from < leg.to { 16.0 * s * s * (1.0 - s) * (1.0 - s) } else { 0.0 };
        [leg.from + (leg.to - leg.from) * rise, bend]
    }

    /// Their derivatives by s.
    fn leg_slope(leg: &Leg, s: f32) -> [f32; 2] {
        let bend = if leg.from < leg.to { 32.0 * s * (1.0 - s) * (1.0 - 2.0 * s) } else { 0.0 };
        [(leg.to - leg.from) * 6.0 * s * (1.0 - s), bend]
    }

    /// The values of `of` for each leg: hips, then knees.
    fn each(&self, of: impl Fn(&Leg, f32) -> [f32; 2]) -> [f32; 4] {
        let s = self.part();
        let [[left_hip, left_knee], [right_hip, right_knee]] = self.legs.map(|leg| of(&leg, s));
        [left_hip, right_hip, left_knee, right_knee]
    }

    /// Angle at 0 and at 1 of each joint.
    fn range(&self) -> [[f32; 2]; 4] {
        let ([front, rear], [stance, swing]) = (self.config.hip, self.config.knee);
        [[rear.0, front.0], [rear.0, front.0], [stance.0, swing.0], [stance.0, swing.0]]
    }
}

/// The legs in the step in which a neuron fires: its leg moves forward, the other back.
fn turn(legs: &mut [Leg; 2], fires: Neuron) {
    let turns = [fires == Neuron::Flexor, fires == Neuron::Extensor];
    for (leg, forward) in legs.iter_mut().zip(turns) {
        *leg = Leg { from: leg.to, to: if forward { 1.0 } else { 0.0 } };
    }
}

impl Generator<4> for ObbWalk {
    fn step(&mut self) {
        // Below 2^32: a step has at least 8 ticks.
        self.elapsed = self.elapsed.saturating_add(self.period.micros().saturating_mul(self.steps));
        if self.elapsed >= self.stride_us {
            self.elapsed = self.elapsed.saturating_sub(self.stride_us);
            self.next_step();
        }
    }

    fn angles(&self) -> [Radians; 4] {
        let mut angles = [Radians(0.0); 4];
        for (angle, (part, [zero, one])) in angles.iter_mut().zip(self.each(Self::leg).iter().zip(self.range())) {
            angle.0 = zero + (one - zero) * part;
        }
        angles
    }

    fn rates(&self) -> [RadPerSec; 4] {
        let per_second = self.steps as f32 / self.config.stride_s;
        let mut rates = [RadPerSec(0.0); 4];
        for (rate, (slope, [zero, one])) in rates.iter_mut().zip(self.each(Self::leg_slope).iter().zip(self.range())) {
            rate.0 = (one - zero) * slope * per_second;
        }
        rates
    }

    /// 0 where the left leg has come to its front.
    fn phase(&self) -> Phase {
        let stride = u64::from(self.stride_us).saturating_mul(u64::from(self.steps));
        let passed = u64::from(self.steps_since_front)
            .saturating_mul(u64::from(self.stride_us))
            .saturating_add(u64::from(self.elapsed));
        // Below 2^64: at most 9 steps of 20 s, or 1.8e8, times 2^32.
        Phase((passed << 32).checked_div(stride).unwrap_or(0) as u32)
    }

    fn amplitude(&self) -> f32 {
        1.0
    }

    fn check(&self) -> Result<(), StateFault> {
        Ok(())
    }

    fn reset(&mut self) {
        (self.block, self.legs) = self.start;
        self.elapsed = 0;
        self.next_step();
    }
}

/// Position of each hip (0 rear, 1 front) and flexion of each knee, 0 to 1.
impl Features for ObbWalk {
    const COUNT: usize = 4;

    fn features(&self, out: &mut [f32]) {
        fill(out, self.each(Self::leg));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn walk(steps: [u32; 2], stride_s: f32, micros: u32) -> ObbWalk {
        let config = ObbWalkConfig { steps, stride_s, ..ObbWalkConfig::default() };
        config.build(Period::from_micros(micros).unwrap()).unwrap()
    }

    /// Angles differentiate to rates, and no step is larger than the profile's steepest slope; for every word and odd periods.
    #[test]
    fn angle_and_rate_are_continuous_for_every_word() {
        for (steps, stride, micros) in
            [([1, 1], 1.1, 1000), ([1, 2], 1.0, 700), ([3, 1], 2.3, 1000), ([1, 8], 4.0, 333)]
        {
            let mut walk = walk(steps, stride, micros);
            let dt = micros as f32 * 1e-6;
            let per_step = (steps[0] + steps[1]) as f32 / stride;
            // |d2 bend| <= 32 of the knee's 55 degrees.
            let acceleration = 32.0 * 55f32.to_radians() * per_step * per_step;
            for _ in 0..20_000 {
                let (angles, rates) = (walk.angles(), walk.rates());
                walk.step();
                for joint in 0..4 {
                    let mean = 0.5 * (rates[joint].0 + walk.rates()[joint].0);
                    let moved = (walk.angles()[joint].0 - angles[joint].0) / dt;
                    assert!(
                        (moved - mean).abs() < acceleration * dt,
                        "{steps:?} joint {joint}: {moved} against {mean}"
                    );
                    assert!((walk.rates()[joint].0 - rates[joint].0).abs() < 1.01 * acceleration * dt + 1e-4);
                }
            }
        }
    }

    /// Ten thousand strides of a period that does not divide the stride: the phase is that of the exact time.
    #[test]
    fn the_stride_is_exact() {
        for (steps, micros) in [([1, 1], 1000u32), ([2, 1], 700)] {
            let mut walk = walk(steps, 1.1, micros);
            for tick in 1..1_000_000u64 {
                walk.step();
                if tick % 997 == 0 {
                    let strides = tick as f64 * f64::from(micros) / 1.1e6;
                    let off = (f64::from(walk.phase().cycles()) - strides + 0.5).rem_euclid(1.0) - 0.5;
                    assert!(off.abs() < 1e-6, "tick {tick}: {off}");
                }
            }
        }
    }

    /// Share of the time in which each knee bends: the leg's own steps that bring it forward are one a stride.
    #[test]
    fn each_leg_swings_once_a_stride_and_they_never_swing_together() {
        let mut walk = walk([1, 3], 1.0, 1000);
        let mut bent = [0u32; 2];
        for _ in 0..10_000 {
            walk.step();
            let [.., left, right] = walk.angles().map(|angle| angle.degrees() > 5.001);
            assert!(!(left && right));
            bent[0] += u32::from(left);
            bent[1] += u32::from(right);
        }
        for ticks in bent {
            assert!((2400..=2500).contains(&ticks), "{bent:?}");
        }
        walk.reset();
        assert_eq!(walk.phase().0, 0);
        assert!((walk.angles()[0].degrees() - 25.0).abs() < 1e-4);
    }

    #[test]
    fn bad_fields_are_named() {
        type Break = fn(&mut ObbWalkConfig);
        let broken: [(Break, &str); 6] = [
            (|c| c.steps = [0, 1], "steps[0]"),
            (|c| c.steps = [2, 2], "steps[1]"),
            (|c| c.steps = [1, 9], "steps[1]"),
            (|c| c.stride_s = 0.1, "stride_s"),
            (|c| c.hip[1].0 = f32::NAN, "hip[1]"),
            (|c| c.knee[0].0 = -0.1, "knee[0]"),
        ];
        for (broken, name) in broken {
            let mut config = ObbWalkConfig::default();
            broken(&mut config);
            let error = config.build(Period::MILLISECOND).unwrap_err().to_string();
            assert!(error.contains(name), "{error} does not name {name}");
        }
        let slow = ObbWalkConfig::default().build(Period::from_micros(70_000).unwrap());
        assert_eq!(slow.unwrap_err(), BuildError::PeriodTooLong { micros: 70_000, max_micros: 68_750 });
    }
}
