//! The hexapod's six legs as joint angles: the steps of the ladder ([`crate::edge_reversal::hexapod`]) turned into swing and stance profiles.
//!
//! A step of the ladder lasts a fixed time. A leg that swings moves from its present angle to its front angle; a leg that stands moves
//! back, in each step by so much that the steps of its stance, one less than the period ([`Hexapod::period`]), lead from the front to the
//! rear angle. Within a step each leg follows the cubic
//! Hermite polynomial with the position and rate at both ends, so both are continuous through every step and every change of gait, and
//! the acceleration is at most [`HexapodWalk::acceleration_bound`]. A leg that must wait for its neighbours after a change waits at the
//! rear angle.
//!
//! ```
//! use cpg_core::Generator;
//! use cpg_core::joints::hexapod_legs::{HexapodWalk, HexapodWalkConfig};
//! use joint_units::Period;
//! let mut walk = HexapodWalkConfig::default().build(Period::MILLISECOND)?;
//! // The tripod: in each half second three legs come forward by 40 degrees while three are drawn back.
//! let before = walk.angles();
//! for _ in 0..500 {
//!     walk.step();
//! }
//! let moved: Vec<i32> = walk.angles().iter().zip(before).map(|(a, b)| (a.degrees() - b.degrees()).round() as i32).collect();
//! assert_eq!(moved.iter().filter(|&&degrees| degrees == 40).count(), 3, "{moved:?}");
//! assert_eq!(moved.iter().filter(|&&degrees| degrees == -40).count(), 3, "{moved:?}");
//! # Ok::<(), cpg_core::BuildError>(())
//! ```

use joint_units::{Period, Phase, RadPerSec, RadPerSec2, Radians};

use crate::edge_reversal::hexapod::{Hexapod, HexapodError, Leg, Orientation};
use crate::edge_reversal::smer::{MAX_REVERSIBILITY, SmerError};
use crate::error::in_range;
use crate::{BuildError, Field, Generator, StateFault};

/// Gait, time of a step and angles of a [`HexapodWalk`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HexapodWalkConfig {
    /// Gait of the ladder: 1 (tripod), 3 (middle gait), 5 (wave) or any other up to [`MAX_REVERSIBILITY`].
    pub reversibility: u32,
    /// Which of the 98 live orientations the ladder starts with; it decides the class, which changes of gait conserve.
    pub orientation: Orientation,
    /// Time of one step of the ladder in seconds, which is the time of a swing; 0.05 to 60.
    pub step_s: f32,
    /// Angle of a leg at the end of its swing; within ±pi/2 and above `rear`.
    pub front: Radians,
    /// Angle of a leg at the end of its stance; within ±pi/2.
    pub rear: Radians,
}

impl Default for HexapodWalkConfig {
    /// The tripod, half a second a step, 20 degrees either way.
    fn default() -> Self {
        Self {
            reversibility: 1,
            orientation: Orientation::WAVE,
            step_s: 0.5,
            front: Radians::from_degrees(20.0),
            rear: Radians::from_degrees(-20.0),
        }
    }
}

/// Angle in radians and rate in radians per step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Knot {
    angle: f32,
    rate: f32,
}

/// A walking hexapod: six joints in the order of [`Leg::ALL`].
#[derive(Debug, Clone, PartialEq)]
pub struct HexapodWalk {
    ladder: Hexapod,
    start: Hexapod,
    front: f32,
    rear: f32,
    ticks_per_step: u32,
    period_s: f32,
    tick: u32,
    /// Steps since the bottom left leg last swung.
    steps_since_first_leg: u32,
    from: [Knot; 6],
    to: [Knot; 6],
}

impl HexapodWalkConfig {
    /// Validates the configuration for a control period; every leg starts at its position in the settled gait.
    ///
    /// # Errors
    /// Names the field that is out of range.
    pub fn build(&self, period: Period) -> Result<HexapodWalk, BuildError> {
        in_range(self.step_s, Field::of("step_s"), 0.05, 60.0)?;
        let step_s = self.step_s;
        let limit = core::f32::consts::FRAC_PI_2;
        in_range(self.rear.0, Field::of("rear"), -limit, limit)?;
        let rear = self.rear.0;
        in_range(self.front.0, Field::of("front"), rear, limit)?;
        let front = self.front.0;
        let mut ladder =
            Hexapod::with_orientation(self.reversibility, self.orientation).map_err(|error| match error {
                HexapodError::Dead { .. } => {
                    let cycles = self.orientation.circulation();
                    BuildError::OutOfRange {
                        field: Field::of("orientation.circulation"),
                        value: f32::from(if matches!(cycles.upper, -2..=2) { cycles.lower } else { cycles.upper }),
                        min: -2.0,
                        max: 2.0,
                    }
                }
                HexapodError::Reversibility => BuildError::OutOfRange {
                    field: Field::of("reversibility"),
                    value: self.reversibility as f32,
                    min: 1.0,
                    max: MAX_REVERSIBILITY as f32,
                },
            })?;
        // Longer than every transient, so that the start is on the gait's cycle.
        for _ in 0..24 {
            ladder.step();
        }
        let ticks_per_step = ((step_s * 1e6) as u32 / period.micros().max(1)).max(1);
        let mut walk = HexapodWalk {
            start: ladder.clone(),
            ladder,
            front,
            rear,
            ticks_per_step,
            period_s: period.seconds(),
            tick: 0,
            steps_since_first_leg: 0,
            from: [Knot::default(); 6],
            to: [Knot::default(); 6],
        };
        walk.reset();
        Ok(walk)
    }
}

impl HexapodWalk {
    /// Changes the gait; it takes effect with the next step of the ladder, and no leg jumps.
    ///
    /// # Errors
    /// As [`Hexapod::set_reversibility`]; the running gait is then unchanged.
    pub fn set_reversibility(&mut self, reversibility: u32) -> Result<(), SmerError> {
        self.ladder.set_reversibility(reversibility)
    }

    /// The ladder.
    #[must_use]
    pub const fn ladder(&self) -> &Hexapod {
        &self.ladder
    }

    /// No leg accelerates more than this. With stroke s and step time T every angle lies in s and every rate at a knot within s/T, and
    /// `6 s/T^2 + 4 s/T^2 + 2 s/T^2` bounds the second derivative of such a cubic.
    #[must_use]
    pub fn acceleration_bound(&self) -> RadPerSec2 {
        let step_s = self.ticks_per_step as f32 * self.period_s;
        RadPerSec2(12.0 * (self.front - self.rear) / (step_s * step_s))
    }

    /// Target of each leg at the end of the next step.
    fn next_step(&mut self) {
        self.from = self.to;
        let swings = self.ladder.step();
        let stroke = self.front - self.rear;
        let draw = stroke / self.ladder.period().saturating_sub(1).max(1) as f32;
        self.steps_since_first_leg =
            if swings.contains(Leg::BottomLeft) { 0 } else { self.steps_since_first_leg.saturating_add(1) };
        for ((leg, from), to) in Leg::ALL.iter().zip(&self.from).zip(&mut self.to) {
            *to = if swings.contains(*leg) {
                Knot { angle: self.front, rate: -draw }
            } else if from.angle - draw > self.rear + 0.01 * draw {
                Knot { angle: from.angle - draw, rate: -draw }
            } else {
                // The last step of the stance ends at the rear; the swing lifts off from rest there.
                Knot { angle: self.rear, rate: 0.0 }
            };
        }
    }
}

impl Generator<6> for HexapodWalk {
    fn step(&mut self) {
        self.tick = self.tick.saturating_add(1);
        if self.tick >= self.ticks_per_step {
            self.tick = 0;
            self.next_step();
        }
    }

    fn angles(&self) -> [Radians; 6] {
        let s = self.tick as f32 / self.ticks_per_step as f32;
        let (s2, s3) = (s * s, s * s * s);
        let mut angles = [Radians(0.0); 6];
        for (angle, (a, b)) in angles.iter_mut().zip(self.from.iter().zip(&self.to)) {
            let rise = b.angle - a.angle;
            angle.0 = a.angle + rise * (3.0 * s2 - 2.0 * s3) + a.rate * (s - 2.0 * s2 + s3) + b.rate * (s3 - s2);
        }
        angles
    }

    fn rates(&self) -> [RadPerSec; 6] {
        let s = self.tick as f32 / self.ticks_per_step as f32;
        let per_s = 1.0 / (self.ticks_per_step as f32 * self.period_s);
        let mut rates = [RadPerSec(0.0); 6];
        for (rate, (a, b)) in rates.iter_mut().zip(self.from.iter().zip(&self.to)) {
            let rise = b.angle - a.angle;
            let per_step =
                rise * 6.0 * s * (1.0 - s) + a.rate * (1.0 - s * (4.0 - 3.0 * s)) + b.rate * s * (3.0 * s - 2.0);
            rate.0 = per_step * per_s;
        }
        rates
    }

    /// 0 where the bottom left leg lifts off; one cycle is the period of the ladder.
    fn phase(&self) -> Phase {
        let cycle = self.ladder.period() as f32;
        let s = self.tick as f32 / self.ticks_per_step as f32;
        Phase::from_cycles((self.steps_since_first_leg as f32 + s) / cycle)
    }

    fn amplitude(&self) -> f32 {
        1.0
    }

    fn check(&self) -> Result<(), StateFault> {
        Ok(())
    }

    fn reset(&mut self) {
        self.ladder = self.start.clone();
        self.tick = 0;
        self.to = [Knot { angle: self.rear, rate: 0.0 }; 6];
        // After two periods every leg has its position in the gait.
        for _ in 0..self.ladder.period().saturating_mul(2).min(64) {
            self.next_step();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn walk(reversibility: u32) -> HexapodWalk {
        HexapodWalkConfig { reversibility, ..HexapodWalkConfig::default() }.build(Period::MILLISECOND).unwrap()
    }

    /// In each gait each leg covers its whole stroke, swings for one step of the period and stands for the rest: in the class of the wave at
    /// R = 5, 3 and 1, and in one class each of period 4 and 6 at R = 1.
    #[test]
    fn legs_cover_their_stroke_with_the_duty_of_the_gait() {
        for (reversibility, orientation, period) in
            [(5, "dd-dd-lll", 6), (3, "dd-dd-lll", 4), (1, "dd-dd-lll", 2), (1, "dd-dd-lrr", 4), (1, "dd-du-lrr", 6)]
        {
            let orientation: Orientation = orientation.parse().unwrap();
            let mut walk = HexapodWalkConfig { reversibility, orientation, ..HexapodWalkConfig::default() }
                .build(Period::MILLISECOND)
                .unwrap();
            let cycle = 500 * period;
            let (mut forward, mut low, mut high) = ([0u32; 6], [1.0f32; 6], [-1.0f32; 6]);
            for _ in 0..cycle {
                walk.step();
                for leg in 0..6 {
                    forward[leg] += u32::from(walk.rates()[leg].0 > 1e-3);
                    low[leg] = low[leg].min(walk.angles()[leg].0);
                    high[leg] = high[leg].max(walk.angles()[leg].0);
                }
            }
            for leg in 0..6 {
                let name = format!("{orientation} at {reversibility}, leg {leg}");
                assert!((low[leg] + 20f32.to_radians()).abs() < 0.02, "{name}: {}", low[leg]);
                assert!((high[leg] - 20f32.to_radians()).abs() < 0.05, "{name}: {}", high[leg]);
                let swing = forward[leg] as f32 / cycle as f32;
                let want = 1.0 / period as f32;
                assert!((swing - want).abs() < 0.25 * want, "{name}: {swing}");
            }
        }
    }

    /// Changes of gait at any tick: position and rate are continuous, the acceleration stays under the stated bound.
    #[test]
    fn every_change_is_smooth() {
        let mut walk = walk(5);
        let bound = walk.acceleration_bound().0;
        let mut worst = 0.0f32;
        for tick in 0..200_000u32 {
            if tick % 1777 == 0 {
                walk.set_reversibility([5, 3, 1, 5, 1, 3][(tick / 1777) as usize % 6]).unwrap();
            }
            let (angles, rates) = (walk.angles(), walk.rates());
            walk.step();
            let (angles1, rates1) = (walk.angles(), walk.rates());
            for leg in 0..6 {
                let acceleration = (rates1[leg].0 - rates[leg].0).abs() / 1e-3;
                worst = worst.max(acceleration);
                assert!(acceleration <= bound * 1.001 + 0.01, "tick {tick} leg {leg}: {acceleration} over {bound}");
                let mean_rate = 0.5 * (rates[leg].0 + rates1[leg].0);
                assert!(((angles1[leg].0 - angles[leg].0) / 1e-3 - mean_rate).abs() < 2e-3, "tick {tick} leg {leg}");
            }
        }
        assert!(worst > 0.3 * bound, "the bound says something: {worst} of {bound}");
    }

    #[test]
    fn reset_starts_over_and_phase_runs_once_a_cycle() {
        let mut walk = walk(5);
        let first = walk.clone();
        let mut wraps = 0;
        for _ in 0..500 * 6 * 10 {
            let before = walk.phase().0;
            walk.step();
            wraps += u32::from(walk.phase().0 < before);
        }
        assert_eq!(wraps, 10);
        walk.reset();
        assert_eq!(walk.angles(), first.angles());
    }

    #[test]
    fn bad_fields_are_named() {
        let build = |r, step_s, front, rear| {
            let front_and_rear = (Radians(front), Radians(rear));
            let config =
                HexapodWalkConfig { front: front_and_rear.0, rear: front_and_rear.1, ..HexapodWalkConfig::default() };
            HexapodWalkConfig { reversibility: r, step_s, ..config }.build(Period::MILLISECOND).unwrap_err().to_string()
        };
        assert!(build(5, 0.0, 0.3, -0.3).contains("step_s"));
        assert!(build(5, 0.5, 0.3, f32::NAN).contains("rear"));
        assert!(build(5, 0.5, -0.4, -0.3).contains("front"));
        assert!(build(0, 0.5, 0.3, -0.3).contains("reversibility"));
        let dead = HexapodWalkConfig { orientation: "dd-uu-lrr".parse().unwrap(), ..HexapodWalkConfig::default() };
        assert_eq!(
            dead.build(Period::MILLISECOND).unwrap_err().to_string(),
            "orientation.circulation = 4: must be from -2 to 2"
        );
    }
}
