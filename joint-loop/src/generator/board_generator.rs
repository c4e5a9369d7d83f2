//! The generators that a board can walk with, chosen by parameters and not by the compiler.
//!
//! A loop that is compiled for one generator walks with that one only. [`GeneratorConfig`] holds the parameters of any of four, and
//! [`Walker`] is the one that was built: R1, the thesis' network, a phase with a Fourier series a joint, or the same led by the gait
//! sensor. The same file that a fit wrote builds the same bits here on the host and on the board ([`crate::store::generator_record`] is how it gets there).

use cpg_core::entrainment::phase_lock::PhaseLockConfig;
use cpg_core::entrainment::{EventSource, FollowStatus, Follower, FollowerConfig};
use cpg_core::gait::default_walk::default_config;
use cpg_core::network::graph::{Biped, HipKnee, LeftRight};
use cpg_core::network::phase_coupled::{Robust, RobustConfig};
use cpg_core::network::thesis::{Thesis, ThesisConfig};
use cpg_core::waveform::shape::{FourierShape, PhaseShape, PhaseShapeConfig};
use cpg_core::{BuildError, Follow, Generator, Rk4, StateFault};
use hgod_adc::FilterConfig;
use joint_units::{Joint, Period, Phase, RadPerSec, Radians};

/// Harmonics of a joint's Fourier series. A fit of fewer has zeros above.
pub const SERIES_HARMONICS: usize = 8;

/// One joint's Fourier series, see [`FourierShape`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeriesConfig {
    /// Mean angle, within ±[`cpg_core::waveform::shape::MAX_COEFFICIENT`] rad, as all coefficients.
    pub mean: Radians,
    /// Coefficients of the cosines of harmonic 1, 2, ..., rad.
    pub cos: [f32; SERIES_HARMONICS],
    /// Coefficients of the sines, rad.
    pub sin: [f32; SERIES_HARMONICS],
}

/// One phase, and a Fourier series a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapeConfig {
    /// Stride time, within [`cpg_core::waveform::shape::STRIDE_RANGE_S`] seconds.
    pub stride_s: f32,
    /// The joints, in the order of [`Joint::ALL`].
    pub joints: [SeriesConfig; Joint::COUNT],
}

/// A walker that is followed: the shapes of its joints, the one joint that the gait sensor is worn on, and the events beside its angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FollowConfig {
    /// The joint that is measured.
    pub sensor: Joint,
    /// What tells moments of the stride beside the angle.
    pub events: EventSource,
    /// What the walker does when nobody disturbs him; the stride within the range of [`PhaseLockConfig::stride_s`].
    pub shape: ShapeConfig,
}

impl FollowConfig {
    /// What it becomes: the delay of the gait sensor's filter made up for, everything else as [`FollowerConfig::default`] has it.
    #[must_use]
    pub fn entrained(&self) -> FollowerConfig {
        let lock = PhaseLockConfig { stride_s: self.shape.stride_s, ..PhaseLockConfig::default() };
        let delay_s = FilterConfig::default().delay_s(Period::MILLISECOND);
        FollowerConfig { lock, delay_s, events: self.events, ..FollowerConfig::default() }
    }
}

/// Parameters of a walker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum GeneratorConfig {
    /// R1, see [`cpg_core::network::phase_coupled`].
    Robust(RobustConfig<4, 4>),
    /// The thesis' network, see [`cpg_core::network::thesis`].
    Thesis(ThesisConfig),
    /// Phase and shape, see [`cpg_core::waveform::shape`].
    Shape(ShapeConfig),
    /// Phase and shape that follow the gait sensor, see [`cpg_core::entrainment`].
    Follow(FollowConfig),
}

/// A built walker.
// There is one of it, and no heap to box the largest on.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BoardGenerator {
    /// R1.
    Robust(Robust<Biped, 4, 4>),
    /// The thesis' network.
    Thesis(Thesis),
    /// Phase and shape.
    Shape(PhaseShape<FourierShape<SERIES_HARMONICS>, { Joint::COUNT }>),
    /// Phase and shape that follow the gait sensor.
    Follow(Follower),
}

impl ShapeConfig {
    /// The waveform of each joint.
    ///
    /// # Errors
    /// Names the coefficient that is out of range.
    pub fn shapes(&self) -> Result<[FourierShape<SERIES_HARMONICS>; Joint::COUNT], BuildError> {
        let series = |joint: &SeriesConfig| FourierShape::new(joint.mean, joint.cos, joint.sin);
        let [left_hip, right_hip, left_knee, right_knee] = &self.joints;
        Ok([series(left_hip)?, series(right_hip)?, series(left_knee)?, series(right_knee)?])
    }
}

impl GeneratorConfig {
    /// The walk that ships, see [`cpg_core::gait::default_walk`].
    #[must_use]
    pub const fn default_walk() -> Self {
        Self::Robust(default_config())
    }

    /// `robust`, `thesis`, `shape` or `follow`.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Robust(_) => "robust",
            Self::Thesis(_) => "thesis",
            Self::Shape(_) => "shape",
            Self::Follow(_) => "follow",
        }
    }

    /// The joint whose sensor it follows, if it follows one.
    #[must_use]
    pub const fn follows(&self) -> Option<Joint> {
        match self {
            Self::Follow(follow) => Some(follow.sensor),
            Self::Robust(_) | Self::Thesis(_) | Self::Shape(_) => None,
        }
    }

    /// Checks every parameter and makes the walker for one control period.
    ///
    /// ```
    /// use cpg_core::Generator;
    /// use cpg_core::gait::default_walk::default_walk;
    /// use joint_loop::GeneratorConfig;
    /// use joint_units::Period;
    /// let mut walker = GeneratorConfig::default_walk().build(Period::MILLISECOND)?;
    /// let mut walk = default_walk(Period::MILLISECOND)?;
    /// for _ in 0..5_000 {
    ///     walker.step();
    ///     walk.step();
    /// }
    /// assert_eq!(walker.angles(), walk.angles());
    /// # Ok::<(), cpg_core::BuildError>(())
    /// ```
    ///
    /// # Errors
    /// [`BuildError`] naming the first parameter that is not allowed.
    pub fn build(&self, period: Period) -> Result<BoardGenerator, BuildError> {
        Ok(match self {
            Self::Robust(config) => BoardGenerator::Robust(config.build::<Biped, Rk4>(period)?),
            Self::Thesis(config) => BoardGenerator::Thesis(config.build::<LeftRight, HipKnee, Rk4>(period)?),
            Self::Shape(config) => BoardGenerator::Shape(
                PhaseShapeConfig { shapes: config.shapes()?, stride_s: config.stride_s }.build(period)?,
            ),
            Self::Follow(config) => {
                BoardGenerator::Follow(config.entrained().build(config.shape.shapes()?, config.sensor, period)?)
            }
        })
    }
}

/// Runs the same expression on whichever generator it is.
macro_rules! whichever {
    ($walker:expr, $generator:ident => $what:expr) => {
        match $walker {
            BoardGenerator::Robust($generator) => $what,
            BoardGenerator::Thesis($generator) => $what,
            BoardGenerator::Shape($generator) => $what,
            BoardGenerator::Follow($generator) => $what,
        }
    };
}

impl Generator<{ Joint::COUNT }> for BoardGenerator {
    fn step(&mut self) {
        whichever!(self, generator => generator.step());
    }

    fn angles(&self) -> [Radians; Joint::COUNT] {
        whichever!(self, generator => generator.angles())
    }

    fn rates(&self) -> [RadPerSec; Joint::COUNT] {
        whichever!(self, generator => generator.rates())
    }

    fn phase(&self) -> Phase {
        whichever!(self, generator => generator.phase())
    }

    fn amplitude(&self) -> f32 {
        whichever!(self, generator => generator.amplitude())
    }

    fn check(&self) -> Result<(), StateFault> {
        whichever!(self, generator => generator.check())
    }

    fn reset(&mut self) {
        whichever!(self, generator => generator.reset());
    }
}

impl Follow for BoardGenerator {
    fn observe(&mut self, angle: Option<Radians>) {
        if let BoardGenerator::Follow(follower) = self {
            follower.observe(angle);
        }
    }

    fn heel_strike(&mut self) {
        if let BoardGenerator::Follow(follower) = self {
            follower.heel_strike();
        }
    }

    fn follow_status(&self) -> Option<FollowStatus> {
        if let BoardGenerator::Follow(follower) = self { follower.follow_status() } else { None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A follower is one with the core's own: it is sensed, told of strikes, and says how it stands; the others say nothing.
    #[test]
    fn a_walker_passes_on_what_its_follower_is_told() {
        let joint = |lead: f32| {
            let (mut cos, mut sin) = ([0.0; SERIES_HARMONICS], [0.0; SERIES_HARMONICS]);
            (cos[0], sin[0]) = (0.35 * lead.cos(), 0.35 * lead.sin());
            SeriesConfig { mean: Radians(0.1), cos, sin }
        };
        let shape = ShapeConfig { stride_s: 1.1, joints: [0.0_f32, 3.1, 1.5, 4.6].map(joint) };
        let follow = FollowConfig { sensor: Joint::LeftHip, events: EventSource::FootSwitch, shape };
        let mut walker = GeneratorConfig::Follow(follow).build(Period::MILLISECOND).unwrap();
        let mut core = follow.entrained().build(shape.shapes().unwrap(), Joint::LeftHip, Period::MILLISECOND).unwrap();
        for tick in 0..16_000u32 {
            let cycles = tick as f32 * 1e-3;
            let angle = (tick < 15_000).then(|| Radians(0.1 + 0.35 * (core::f32::consts::TAU * cycles).cos()));
            core.observe(angle);
            walker.observe(angle);
            if tick % 1000 == 400 {
                core.heel_strike();
                walker.heel_strike();
            }
            core.step();
            walker.step();
            assert_eq!((walker.angles(), walker.follow_status()), (core.angles(), Some(core.status())), "tick {tick}");
        }
        let BoardGenerator::Follow(follower) = walker else { unreachable!() };
        assert_eq!(follower, core);
        assert!((follower.event_phase().expect("learned").cycles() - 0.4).abs() < 0.01);
        let robust = GeneratorConfig::default_walk().build(Period::MILLISECOND).unwrap();
        assert_eq!(robust.follow_status(), None);
    }
}
