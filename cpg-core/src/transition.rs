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
//!
//! # Limits
//! At every tick the rate of the output is limited such that the joint can still stop inside its [`JointLimits`], or short of the new motion;
//! the proof is in `src/transition/governor.rs`. With motions and poses inside the range, and with w' and w'' the largest rate and acceleration
//! of the motions before and after the change:
//!
//! | of the output | at every tick |
//! |---|---|
//! | angle | in the range |
//! | rate | at most the larger of [`JointLimits::rate`] and w' |
//! | acceleration | at most w'' + A |
//!
//! - A complete change has no effect: the output is the generator's angles, bit for bit.
//! - A motion that leaves its range is limited: the output brakes before the end of the range with about [`JointLimits::acceleration`], stays
//!   there, and is led back to the motion as after a change. As long as it differs, [`Smooth::is_changing`] is true.
//! - [`Smooth::stop`] refuses a pose outside the range. [`Smooth::change`] accepts every generator, as its range is not known before it runs.
//! - A motion faster than the rate limit is not slowed. [`crate::gait::speed_limit`] has the speeds at which a named gait is within it.
//! - Limits of two joints together, such as the sum of the knees, are not kept here; the gate of `joint-loop` keeps them.

use joint_units::{Period, Phase, RadPerSec, RadPerSec2, Radians};

use crate::entrainment::FollowStatus;
use crate::error::{allow_period, in_range};
use crate::math::braking::Braking;
use crate::{BuildError, Field, Follow, Generator, StateFault};

mod governor;
mod limits;

pub use limits::JointLimits;

use governor::{Moving, Tick};

/// Limits of a change; builds a [`Smooth`] generator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TransitionConfig {
    /// Largest acceleration A that a change adds to the generator's own, for each joint; 0.1 to 100 000 rad/s^2, and at most that of the
    /// joints' limits; default 150.
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

/// A smaller offset is set to 0: a step of at most one microradian.
const NOTHING: Moving = Moving { angle: 1e-6, rate: 1e-4 };

/// A generator with smooth changes: wraps a generator `G` of `N` joints.
///
/// Change the generator through [`Smooth::change`] only: what changes it otherwise makes the output jump.
///
/// ```
/// use cpg_core::Generator;
/// use cpg_core::gait::named::Gait;
/// use cpg_core::transition::{JointLimits, TransitionConfig};
/// use joint_units::{Period, RadPerSec, RadPerSec2, Radians};
/// let period = Period::MILLISECOND;
/// let walk = Gait::Walk.build(1.0, period)?;
/// let range = |least, most| JointLimits {
///     least: Radians::from_degrees(least),
///     most: Radians::from_degrees(most),
///     rate: RadPerSec(8.7),
///     acceleration: RadPerSec2(349.0),
/// };
/// let limits = [range(-30.0, 60.0), range(-30.0, 60.0), range(-2.0, 120.0), range(-2.0, 120.0)];
/// let mut smooth = TransitionConfig::default().build(walk, limits, period)?;
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
/// smooth.stop([Radians(0.0); 4])?;
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
    /// Differences of the output from the motion, rad and rad/s.
    offsets: [Moving; N],
    /// Angles of the output.
    angles: [Radians; N],
    limits: [JointLimits; N],
    law: Braking,
}

impl TransitionConfig {
    /// Wraps a generator that was built for the same control period. All changes keep the limits of the joints.
    ///
    /// # Errors
    /// [`BuildError`] names the field that is out of range, with the joint as its index if it is one of the limits;
    /// [`BuildError::PeriodTooLong`] if the period is longer than 1/24 of `settling_s` (above 10.4 ms by default).
    pub fn build<G: Generator<N>, const N: usize>(
        &self,
        generator: G,
        limits: [JointLimits; N],
        period: Period,
    ) -> Result<Smooth<G, N>, BuildError> {
        let mut greatest = JointLimits::WIDEST.acceleration.0;
        for (index, joint) in limits.iter().enumerate() {
            joint.check(index)?;
            greatest = greatest.min(joint.acceleration.0);
        }
        in_range(self.acceleration.0, Field::of("acceleration"), 0.1, greatest)?;
        in_range(self.settling_s, Field::of("settling_s"), 0.05, 60.0)?;
        allow_period(period, (self.settling_s * 1e6 / 24.0) as u32)?;
        let mut smooth = Smooth {
            generator,
            pose: None,
            offsets: [Moving::default(); N],
            angles: [Radians(0.0); N],
            limits,
            law: Braking {
                stiffness: 3.0 / self.settling_s,
                acceleration: self.acceleration.0,
                period_s: period.seconds(),
            },
        };
        smooth.start();
        Ok(smooth)
    }
}

impl<G: Generator<N>, const N: usize> Smooth<G, N> {
    /// Changes the generator by a closure, which may set parameters or replace the generator, and returns its result. The output continues
    /// without a jump. The new generator must have been built for the same control period.
    pub fn change<R>(&mut self, change: impl FnOnce(&mut G) -> R) -> R {
        let rates = self.rates();
        let result = change(&mut self.generator);
        self.lead_from(rates);
        result
    }

    /// Moves smoothly to a pose and holds it. The generator is stepped on meanwhile, so its phase advances.
    ///
    /// # Errors
    /// [`BuildError`] names the joint whose angle is outside its range; the motion then goes on unchanged.
    pub fn stop(&mut self, pose: [Radians; N]) -> Result<(), BuildError> {
        self.allow_pose(&pose)?;
        let rates = self.rates();
        self.pose = Some(pose);
        self.lead_from(rates);
        Ok(())
    }

    /// Holds a pose at once, without a transition: the state of a generator that begins at a stop.
    ///
    /// # Errors
    /// As [`Smooth::stop`].
    pub fn hold(&mut self, pose: [Radians; N]) -> Result<(), BuildError> {
        self.allow_pose(&pose)?;
        self.pose = Some(pose);
        self.start();
        Ok(())
    }

    /// Ends a stop: moves smoothly from the present angles to the generator's motion.
    pub fn resume(&mut self) {
        let rates = self.rates();
        self.pose = None;
        self.lead_from(rates);
    }

    /// Whether the output differs from the generator's angles, or from the pose while stopped: a change is not complete, or a motion outside
    /// its range is limited.
    #[must_use]
    pub fn is_changing(&self) -> bool {
        self.offsets.iter().any(|offset| *offset != Moving::default())
    }

    /// The wrapped generator.
    #[must_use]
    pub const fn generator(&self) -> &G {
        &self.generator
    }

    /// The limits of the joints.
    #[must_use]
    pub const fn limits(&self) -> &[JointLimits; N] {
        &self.limits
    }

    fn allow_pose(&self, pose: &[Radians; N]) -> Result<(), BuildError> {
        let mut joints = pose.iter().zip(&self.limits).enumerate();
        joints.try_for_each(|(index, (angle, limits))| {
            in_range(angle.0, Field::at("pose", index), limits.least.0, limits.most.0)
        })
    }

    /// Angles of the motion without offsets.
    fn wanted_angles(&self) -> [Radians; N] {
        self.pose.unwrap_or_else(|| self.generator.angles())
    }

    /// Rates of the motion without offsets.
    fn wanted_rates(&self) -> [RadPerSec; N] {
        if self.pose.is_some() { [RadPerSec(0.0); N] } else { self.generator.rates() }
    }

    /// Sets the offsets so that the output continues with its angles and these rates.
    fn lead_from(&mut self, rates: [RadPerSec; N]) {
        let wanted = self.wanted_angles().into_iter().zip(self.wanted_rates());
        let output = self.angles.iter().zip(rates);
        for (offset, ((angle0, rate0), (angle1, rate1))) in self.offsets.iter_mut().zip(output.zip(wanted)) {
            *offset = Moving { angle: angle0.0 - angle1.0, rate: rate0.0 - rate1.0 };
        }
    }

    /// Begins with the motion; a joint outside its range begins at rest at the end of it.
    fn start(&mut self) {
        let (wanted, rates) = (self.wanted_angles(), self.wanted_rates());
        let joints = self.offsets.iter_mut().zip(&mut self.angles).zip(&self.limits);
        for (((offset, output), limits), (angle, rate)) in joints.zip(wanted.into_iter().zip(rates)) {
            *output = Radians(limits.hold(angle.0));
            *offset =
                if *output == angle { Moving::default() } else { Moving { angle: output.0 - angle.0, rate: -rate.0 } };
        }
    }
}

impl<G: Generator<N>, const N: usize> Generator<N> for Smooth<G, N> {
    fn step(&mut self) {
        self.generator.step();
        let angles = self.wanted_angles();
        let passes = |((limits, before), after): ((&JointLimits, &Radians), &Radians)| {
            governor::passes(limits, &self.law, before.0, after.0)
        };
        if !self.is_changing() && self.limits.iter().zip(&self.angles).zip(&angles).all(passes) {
            self.angles = angles;
            return;
        }
        let motions = angles.into_iter().zip(self.wanted_rates());
        let joints = self.offsets.iter_mut().zip(&mut self.angles).zip(&self.limits);
        for (((offset, output), limits), (angle, rate)) in joints.zip(motions) {
            if offset.angle.abs() < NOTHING.angle && offset.rate.abs() < NOTHING.rate {
                *offset = Moving::default();
            }
            let motion = Moving { angle: angle.0, rate: rate.0 };
            let tick = Tick { before: output.0, motion, offset: *offset };
            let asked = self.law.next_rate(offset.rate, -offset.angle, 0.0);
            let rate = governor::limit(limits, &self.law, &tick, asked);
            offset.angle += 0.5 * (offset.rate + rate) * self.law.period_s;
            offset.rate = rate;
            *output = Radians(limits.hold(motion.angle + offset.angle));
        }
    }

    fn angles(&self) -> [Radians; N] {
        self.angles
    }

    fn rates(&self) -> [RadPerSec; N] {
        let mut rates = self.wanted_rates();
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
        self.start();
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
mod tests;
