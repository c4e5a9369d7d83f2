//! Makes any change of a generator smooth: of parameters, gait or speed, a stop and a restart, at any tick, also during an earlier change.
//!
//! At a change, the angle and the rate of the new motion differ from those of the output by d (rad) and d' (rad/s). The output from then on is
//! the new motion plus an offset that begins at d and d' and is brought to 0 with bounded acceleration:
//! ```text
//! v = -sign(d) min(k |d|, sqrt(A |d|)),   d'' = clamp(4 k (v - d'), -A, A)
//! ```
//! A is [`TransitionConfig::acceleration`] and k = 3 / [`TransitionConfig::settling_s`] in 1/s. A large offset moves no faster than half of A can
//! brake; a small one is critically damped (d'' = -4 k^2 d - 4 k d') and falls to 2 % within the settling time.
//!
//! So angle and rate of the output are continuous whatever changes, and the acceleration is at most that of the generator plus A. The law
//! depends on d and d' only and not on the time since the change, so this also holds if something changes in every tick. A change may lead
//! the output beyond both motions while their difference in rate is braked, by about d'^2 / (2 A).

use joint_units::{Period, Phase, RadPerSec, RadPerSec2, Radians};

use crate::entrainment::FollowStatus;
use crate::error::{allow_period, in_range};
use crate::math::braking::Braking;
use crate::{BuildError, Field, Follow, Generator, StateFault};

/// Limits of a change; builds a [`Smooth`] generator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TransitionConfig {
    /// Largest acceleration A that a change adds to the generator's own, for each joint; 0.1 to 100 000 rad/s^2, default 150.
    pub acceleration: RadPerSec2,
    /// Time in which a small offset falls to 2 %, s; 0.05 to 60, and at least 24 control periods; default 0.25.
    pub settling_s: f32,
}

impl Default for TransitionConfig {
    /// 150 rad/s^2, about the acceleration of a running knee, and 0.25 s. A smaller acceleration leads further beyond both motions: a
    /// difference of 400 degrees/s between two gaits is braked within 10 degrees at 150 rad/s^2, and within 47 degrees at 30 rad/s^2.
    fn default() -> Self {
        Self { acceleration: RadPerSec2(150.0), settling_s: 0.25 }
    }
}

/// Offset of one joint between the output and the new motion.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Offset {
    /// d, rad.
    angle: f32,
    /// d', rad/s.
    rate: f32,
}

impl Offset {
    /// A smaller offset is set to 0: a step of at most one microradian.
    const NOTHING: Offset = Offset { angle: 1e-6, rate: 1e-4 };

    /// Advances by one control period towards 0.
    fn shrink(&mut self, law: &Braking) {
        if self.angle.abs() < Self::NOTHING.angle && self.rate.abs() < Self::NOTHING.rate {
            *self = Offset::default();
            return;
        }
        let rate = law.next_rate(self.rate, -self.angle, 0.0);
        self.angle += 0.5 * (self.rate + rate) * law.period_s;
        self.rate = rate;
    }
}

/// A generator with smooth changes: wraps a generator `G` of `N` joints.
///
/// Change the generator through [`Smooth::change`] only: what changes it otherwise makes the output jump.
///
/// ```
/// use cpg_core::Generator;
/// use cpg_core::gait::named::Gait;
/// use cpg_core::transition::TransitionConfig;
/// use joint_units::{Period, Radians};
/// let period = Period::MILLISECOND;
/// let walk = Gait::Walk.build(1.0, period)?;
/// let mut smooth = TransitionConfig::default().build(walk, period)?;
/// for _ in 0..1000 {
///     smooth.step();
/// }
/// // From walking to running, in the middle of a stride: no joint jumps.
/// let before = smooth.angles();
/// let run = Gait::from_name("run").expect("a gait").build(1.0, period)?.aligned(smooth.phase(), period);
/// smooth.change(|gait| *gait = run);
/// smooth.step();
/// assert!(smooth.angles().iter().zip(before).all(|(after, before)| (after.0 - before.0).abs() < 0.02));
/// // A stop, before the change is complete.
/// smooth.stop([Radians(0.0); 4]);
/// for _ in 0..5000 {
///     smooth.step();
/// }
/// assert!(!smooth.is_changing());
/// assert_eq!(smooth.angles(), [Radians(0.0); 4]);
/// # Ok::<(), cpg_core::BuildError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Smooth<G, const N: usize> {
    generator: G,
    /// Pose while stopped; `None` otherwise.
    pose: Option<[Radians; N]>,
    offsets: [Offset; N],
    law: Braking,
}

impl TransitionConfig {
    /// Wraps a generator that was built for the same control period.
    ///
    /// # Errors
    /// [`BuildError`] names the field that is out of range; [`BuildError::PeriodTooLong`] if the period is longer than 1/24 of `settling_s`
    /// (above 10.4 ms by default).
    pub fn build<G: Generator<N>, const N: usize>(
        &self,
        generator: G,
        period: Period,
    ) -> Result<Smooth<G, N>, BuildError> {
        in_range(self.acceleration.0, Field::of("acceleration"), 0.1, 1e5)?;
        in_range(self.settling_s, Field::of("settling_s"), 0.05, 60.0)?;
        allow_period(period, (self.settling_s * 1e6 / 24.0) as u32)?;
        Ok(Smooth {
            generator,
            pose: None,
            offsets: [Offset::default(); N],
            law: Braking {
                stiffness: 3.0 / self.settling_s,
                acceleration: self.acceleration.0,
                period_s: period.seconds(),
            },
        })
    }
}

impl<G: Generator<N>, const N: usize> Smooth<G, N> {
    /// Changes the generator by a closure, which may set parameters or replace the generator, and returns its result. The output continues
    /// without a jump. The new generator must have been built for the same control period.
    pub fn change<R>(&mut self, change: impl FnOnce(&mut G) -> R) -> R {
        let before = (self.angles(), self.rates());
        let result = change(&mut self.generator);
        self.lead_from(before);
        result
    }

    /// Moves smoothly to a pose and holds it. The generator is stepped on meanwhile, so its phase advances.
    pub fn stop(&mut self, pose: [Radians; N]) {
        let before = (self.angles(), self.rates());
        self.pose = Some(pose);
        self.lead_from(before);
    }

    /// Holds a pose at once, without a transition: the state of a generator that begins at a stop.
    pub const fn hold(&mut self, pose: [Radians; N]) {
        self.pose = Some(pose);
        self.offsets = [Offset { angle: 0.0, rate: 0.0 }; N];
    }

    /// Ends a stop: moves smoothly from the present angles to the generator's motion.
    pub fn resume(&mut self) {
        let before = (self.angles(), self.rates());
        self.pose = None;
        self.lead_from(before);
    }

    /// Whether a change is not complete: the output differs from the generator's angles, or from the pose while stopped.
    #[must_use]
    pub fn is_changing(&self) -> bool {
        self.offsets.iter().any(|offset| *offset != Offset::default())
    }

    /// The wrapped generator.
    #[must_use]
    pub const fn generator(&self) -> &G {
        &self.generator
    }

    /// The motion without offsets.
    fn wanted(&self) -> ([Radians; N], [RadPerSec; N]) {
        match self.pose {
            Some(pose) => (pose, [RadPerSec(0.0); N]),
            None => (self.generator.angles(), self.generator.rates()),
        }
    }

    /// Sets the offsets so that the output continues from these angles and rates.
    fn lead_from(&mut self, before: ([Radians; N], [RadPerSec; N])) {
        let (angles, rates) = self.wanted();
        let pairs = before.0.iter().zip(before.1).zip(angles.iter().zip(rates));
        for (offset, ((angle0, rate0), (angle1, rate1))) in self.offsets.iter_mut().zip(pairs) {
            *offset = Offset { angle: angle0.0 - angle1.0, rate: rate0.0 - rate1.0 };
        }
    }
}

impl<G: Generator<N>, const N: usize> Generator<N> for Smooth<G, N> {
    fn step(&mut self) {
        self.generator.step();
        for offset in &mut self.offsets {
            offset.shrink(&self.law);
        }
    }

    fn angles(&self) -> [Radians; N] {
        let mut angles = self.wanted().0;
        for (angle, offset) in angles.iter_mut().zip(&self.offsets) {
            angle.0 += offset.angle;
        }
        angles
    }

    fn rates(&self) -> [RadPerSec; N] {
        let mut rates = self.wanted().1;
        for (rate, offset) in rates.iter_mut().zip(&self.offsets) {
            rate.0 += offset.rate;
        }
        rates
    }

    fn phase(&self) -> Phase {
        self.generator.phase()
    }

    fn amplitude(&self) -> f32 {
        self.generator.amplitude()
    }

    fn check(&self) -> Result<(), StateFault> {
        self.generator.check()
    }

    fn reset(&mut self) {
        self.generator.reset();
        self.pose = None;
        self.offsets = [Offset::default(); N];
    }
}

/// Measurements are passed to the wrapped generator.
impl<G: Follow, const N: usize> Follow for Smooth<G, N> {
    fn observe(&mut self, angle: Option<Radians>) {
        self.generator.observe(angle);
    }

    fn heel_strike(&mut self) {
        self.generator.heel_strike();
    }

    fn follow_status(&self) -> Option<FollowStatus> {
        self.generator.follow_status()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::waveform::shape::{Adjustment, FourierShape, PhaseShape, PhaseShapeConfig};

    const CONFIG: TransitionConfig = TransitionConfig { acceleration: RadPerSec2(30.0), settling_s: 0.25 };

    fn gait(mean: f32, cos: [f32; 2], stride: f32) -> PhaseShape<FourierShape<2>, 1> {
        let shape = FourierShape::new(Radians(mean), cos, [0.05, 0.1]).unwrap();
        PhaseShapeConfig { shapes: [shape], stride_s: stride }.build(Period::MILLISECOND).unwrap()
    }

    /// Largest acceleration of a gait by itself.
    fn own_acceleration(mut gait: PhaseShape<FourierShape<2>, 1>) -> f32 {
        let mut worst = 0.0f32;
        for _ in 0..2000 {
            let before = gait.rates()[0].0;
            gait.step();
            worst = worst.max((gait.rates()[0].0 - before).abs() / 1e-3);
        }
        worst
    }

    /// Changes and stops at random ticks, also during changes: the rate is always the derivative of the angle, and the acceleration is at most
    /// that of the gaits plus the configured one.
    #[test]
    fn every_change_is_smooth() {
        let gaits = [gait(0.1, [0.4, 0.1], 1.1), gait(0.5, [-0.3, 0.2], 0.7), gait(-0.2, [0.1, 0.0], 2.0)];
        let own = gaits.map(own_acceleration).into_iter().fold(0.0, f32::max);
        let mut seed = 1u32;
        let mut random = move |n: u32| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) % n
        };
        let mut smooth = CONFIG.build(gaits[0], Period::MILLISECOND).unwrap();
        let mut next_change = 500;
        let (mut changes, mut worst) = (0, 0.0f32);
        for tick in 0..400_000 {
            if tick == next_change {
                match random(5) {
                    0 => smooth.stop([Radians(0.3)]),
                    1 => smooth.resume(),
                    2 => smooth.change(|g| g.set_stride(0.7 + 0.1 * random(8) as f32)).unwrap(),
                    3 => {
                        let adjustment = Adjustment { gain: 0.25 * random(5) as f32, ..Adjustment::default() };
                        smooth.change(|g| g.adjust(0, adjustment)).unwrap();
                    }
                    _ => smooth.change(|g| *g = gaits[random(3) as usize]),
                }
                next_change += 1 + random(600);
                changes += 1;
            }
            let (angle, rate) = (smooth.angles()[0].0, smooth.rates()[0].0);
            smooth.step();
            let (angle1, rate1) = (smooth.angles()[0].0, smooth.rates()[0].0);
            let acceleration = (rate1 - rate).abs() / 1e-3;
            worst = worst.max(acceleration);
            // Rounding of f32 over 1 ms is worth about 0.1 rad/s^2 and 1e-4 rad/s.
            assert!(
                acceleration <= own + CONFIG.acceleration.0 + 0.5,
                "tick {tick}: {acceleration} rad/s^2, own {own}"
            );
            // Angles of a few radians round to 5e-7, which over 1 ms is 5e-4 rad/s an operand.
            let from_angles = (angle1 - angle) / 1e-3;
            assert!((from_angles - 0.5 * (rate + rate1)).abs() < 3e-3, "tick {tick}: {from_angles}, {rate}, {rate1}");
        }
        assert!(changes > 1000 && worst > own, "{changes} changes, {worst} against {own}");
    }

    #[test]
    fn a_change_of_nothing_changes_nothing() {
        let mut smooth = CONFIG.build(gait(0.1, [0.4, 0.1], 1.1), Period::MILLISECOND).unwrap();
        let mut bare = gait(0.1, [0.4, 0.1], 1.1);
        for tick in 0..3000 {
            if tick % 100 == 0 {
                smooth.change(|_| ());
            }
            smooth.step();
            bare.step();
            assert_eq!(smooth.angles(), bare.angles());
            assert!(!smooth.is_changing());
        }
    }

    #[test]
    fn a_stop_ends_in_the_pose_and_a_change_in_the_new_gait() {
        let mut smooth = CONFIG.build(gait(0.1, [0.4, 0.1], 1.1), Period::MILLISECOND).unwrap();
        for _ in 0..777 {
            smooth.step();
        }
        smooth.stop([Radians(0.25)]);
        for _ in 0..1500 {
            smooth.step();
        }
        assert_eq!((smooth.angles()[0], smooth.rates()[0]), (Radians(0.25), RadPerSec(0.0)));
        smooth.resume();
        smooth.change(|g| *g = gait(0.5, [-0.3, 0.2], 0.7));
        let mut bare = gait(0.5, [-0.3, 0.2], 0.7);
        for _ in 0..1500 {
            smooth.step();
            bare.step();
        }
        assert_eq!(smooth.angles(), bare.angles());
    }

    /// The speed changes in every tick for seconds, as with a slider: the offsets do not grow, and the gait is followed.
    #[test]
    fn changes_on_every_tick_do_not_pile_up() {
        let mut smooth = CONFIG.build(gait(0.1, [0.4, 0.1], 1.1), Period::MILLISECOND).unwrap();
        for tick in 0..20_000 {
            let stride = 1.1 + 0.3 * (tick as f32 * 1e-3).sin();
            smooth.change(|g| g.set_stride(stride)).unwrap();
            smooth.step();
            let off = smooth.angles()[0].0 - smooth.generator().angles()[0].0;
            assert!(off.abs() < 0.02, "tick {tick}: {off} off the gait");
        }
        // The worst case: another of two gaits in every tick. The output stays near them.
        let mut gaits = [gait(0.1, [0.4, 0.1], 1.1), gait(0.3, [0.3, 0.1], 1.0)];
        for tick in 0..20_000 {
            smooth.change(|g| *g = gaits[tick % 2]);
            smooth.step();
            gaits.iter_mut().for_each(Generator::step);
            let nearest = gaits.iter().map(|g| (smooth.angles()[0].0 - g.angles()[0].0).abs()).fold(f32::MAX, f32::min);
            assert!(tick < 1000 || nearest < 0.6, "tick {tick}: {nearest} from either gait");
        }
    }

    /// A wrapped follower receives the measurements and computes the same bits as without the wrapper.
    #[test]
    fn a_smooth_follower_locks_on() {
        use crate::entrainment::phase_lock::Template;
        use crate::entrainment::{FollowerConfig, Lock};
        use crate::waveform::shape::Shape;
        use joint_units::Joint;
        let hip = Template::new(Radians(0.1), [0.35, -0.05, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0; 8]).unwrap();
        let mut bare = FollowerConfig::default().build([hip; 4], Joint::LeftHip, Period::MILLISECOND).unwrap();
        let mut smooth = TransitionConfig::default().build(bare, Period::MILLISECOND).unwrap();
        for tick in 0..6000 {
            let angle = Some(Radians(hip.at(Phase::from_cycles(0.3 + tick as f32 * 1e-3 / 1.2)).angle));
            for follower in [&mut bare as &mut dyn Follow, &mut smooth] {
                follower.observe(angle);
                if tick % 1200 == 0 {
                    follower.heel_strike();
                }
            }
            bare.step();
            smooth.step();
            assert_eq!((smooth.angles(), smooth.follow_status()), (bare.angles(), bare.follow_status()), "tick {tick}");
        }
        assert_eq!(smooth.follow_status().map(|status| status.state), Some(Lock::Locked));
    }

    #[test]
    fn bad_fields_are_named() {
        let build = |acceleration, settling_s| {
            let config = TransitionConfig { acceleration: RadPerSec2(acceleration), settling_s };
            config.build(gait(0.1, [0.4, 0.1], 1.1), Period::MILLISECOND).unwrap_err().to_string()
        };
        assert!(build(0.0, 0.1).contains("acceleration"));
        assert!(build(f32::NAN, 0.1).contains("acceleration"));
        assert!(build(1.0, -0.1).contains("settling_s"));
    }
}
