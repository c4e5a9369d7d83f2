//! Named gaits behind one type, at any speed.
//!
//! | name | generator | stride at speed 1 |
//! |---|---|---|
//! | `walk` | R1, [`crate::gait::default_walk`] | 1.1 s |
//! | `natural-walk` | phase and shape, six harmonics of a healthy adult's mean stride | 1.084 s |
//! | `thesis` | the thesis' network, Table 1, set S | 1.1 s |
//! | `cell-walk` | four cells of Golubitsky's, [`LegGait::Walk`] | 1.1 s |
//! | `run`, `skip` | the same, [`LegGait::Run`], [`LegGait::Skip`] | 0.7 s |
//! | `slow-hop`, `fast-hop` | the same, both legs together | 0.6 s, 0.5 s |
//! | `gallop-walk`, `gallop-run` | the same, one leg leads | 0.8 s, 0.6 s |
//! | `human-walk` | phase and shape of recorded walks, [`crate::gait::family`] | 1.046 s |
//! | `human-run`, `human-run-unscaled` | of recorded runs, with and without the limits of the default robot | 0.726 s |
//!
//! The last three change their shape with the speed and allow only the cadences that were recorded, see [`Gait::speeds`].
//!
//! To change from one gait or speed to another at any tick, wrap it in [`crate::transition::Smooth`].

use joint_units::{Period, Phase, RadPerSec, Radians};

use crate::error::in_range;
use crate::gait::default_walk::default_config;
use crate::gait::family::Member;
use crate::gait::fitted::{NATURAL_WALK, shape};
use crate::joints::linear::{PhasePlane, Readout, ReadoutConfig};
use crate::network::graph::{Biped, HipKnee, LeftRight};
use crate::network::phase_coupled::Robust;
use crate::network::symmetric_cells::{LegGait, LegNetwork};
use crate::network::thesis::{Thesis, ThesisConfig};
use crate::waveform::shape::{FourierShape, PhaseShape, PhaseShapeConfig};
use crate::{BuildError, Field, Generator, Rk4, StateFault};

/// The name of a gait.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Gait {
    /// R1, the default walk.
    Walk,
    /// A healthy adult's mean stride.
    NaturalWalk,
    /// The thesis' network.
    Thesis,
    /// Four cells.
    Cells(LegGait),
    /// A member of the family.
    Human(Member),
}

impl Gait {
    /// Every gait.
    pub const ALL: [Gait; 13] = [
        Gait::Walk,
        Gait::NaturalWalk,
        Gait::Thesis,
        Gait::Cells(LegGait::Walk),
        Gait::Cells(LegGait::Run),
        Gait::Cells(LegGait::SlowHop),
        Gait::Cells(LegGait::FastHop),
        Gait::Cells(LegGait::GallopWalk),
        Gait::Cells(LegGait::GallopRun),
        Gait::Cells(LegGait::Skip),
        Gait::Human(Member::Walk),
        Gait::Human(Member::Run),
        Gait::Human(Member::RunUnscaled),
    ];

    /// The name as in the table above.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Gait::Walk => "walk",
            Gait::NaturalWalk => "natural-walk",
            Gait::Thesis => "thesis",
            Gait::Cells(LegGait::Walk) => "cell-walk",
            Gait::Cells(LegGait::Run) => "run",
            Gait::Cells(LegGait::SlowHop) => "slow-hop",
            Gait::Cells(LegGait::FastHop) => "fast-hop",
            Gait::Cells(LegGait::GallopWalk) => "gallop-walk",
            Gait::Cells(LegGait::GallopRun) => "gallop-run",
            Gait::Cells(LegGait::Skip) => "skip",
            Gait::Human(member) => member.name(),
        }
    }

    /// The gait of that name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Gait::ALL.into_iter().find(|gait| gait.name() == name)
    }

    /// Stride in seconds at speed 1.
    #[must_use]
    pub const fn stride_s(self) -> f32 {
        match self {
            Gait::Walk | Gait::Thesis | Gait::Cells(LegGait::Walk) => 1.1,
            Gait::NaturalWalk => 1.084,
            Gait::Cells(LegGait::Run | LegGait::Skip) => 0.7,
            Gait::Cells(LegGait::SlowHop | LegGait::GallopRun) => 0.6,
            Gait::Cells(LegGait::FastHop) => 0.5,
            Gait::Cells(LegGait::GallopWalk) => 0.8,
            Gait::Human(member) => 120.0 / member.middle(),
        }
    }

    /// What the gait is, in words.
    #[must_use]
    pub const fn description(self) -> &'static str {
        match self {
            Gait::Walk => "the default walk, R1",
            Gait::NaturalWalk => "the mean stride of a healthy adult",
            Gait::Thesis => "the thesis' network, Table 1, set S",
            Gait::Cells(_) => "four symmetric cells",
            Gait::Human(Member::Walk) => "recorded walks, 98.4 to 131 steps a minute",
            Gait::Human(Member::Run) => {
                "recorded runs, 154.9 to 175.7 steps a minute, scaled into the limits of the default robot"
            }
            Gait::Human(Member::RunUnscaled) => {
                "recorded runs, 154.9 to 175.7 steps a minute, beyond the limits of the default robot"
            }
        }
    }

    /// Slowest and fastest speed that [`Gait::build`] allows.
    #[must_use]
    pub const fn speeds(self) -> (f32, f32) {
        match self {
            Gait::Human(member) => {
                let (least, most) = member.cadences();
                (least / member.middle(), most / member.middle())
            }
            _ => (0.5, 1.5),
        }
    }

    /// Slowest and fastest cadence of [`Gait::speed_at`], steps a minute.
    #[must_use]
    pub const fn cadences(self) -> (f32, f32) {
        match self {
            Gait::Human(member) => member.cadences(),
            _ => {
                let (least, most) = self.speeds();
                (least * 120.0 / self.stride_s(), most * 120.0 / self.stride_s())
            }
        }
    }

    /// The speed at which [`Gait::build`] has a cadence in steps a minute, two a stride.
    ///
    /// # Errors
    /// `cadence` outside of [`Gait::cadences`], or not finite.
    ///
    /// ```
    /// use cpg_core::gait::named::Gait;
    /// use joint_units::Period;
    /// let walk = Gait::from_name("human-walk").expect("a gait");
    /// assert!(walk.build(walk.speed_at(110.0)?, Period::MILLISECOND).is_ok());
    /// let refused = walk.speed_at(90.0).unwrap_err();
    /// assert_eq!(refused.to_string(), "cadence = 90: must be from 98.4 to 131");
    /// # Ok::<(), cpg_core::BuildError>(())
    /// ```
    pub fn speed_at(self, cadence: f32) -> Result<f32, BuildError> {
        let ((least, most), (slowest, fastest)) = (self.cadences(), self.speeds());
        in_range(cadence, Field::of("cadence"), least, most)?;
        // At the ends the product may be beyond by a rounding.
        Ok((cadence * self.stride_s() / 120.0).max(slowest).min(fastest))
    }

    /// Builds the gait; `speed` divides the stride time, within [`Gait::speeds`].
    ///
    /// # Errors
    /// `speed` out of range, or the period too long for the generator.
    ///
    /// ```
    /// use cpg_core::Generator;
    /// use cpg_core::gait::named::Gait;
    /// use joint_units::Period;
    /// let mut run = Gait::from_name("run").expect("a gait").build(1.0, Period::MILLISECOND)?;
    /// let left = run.angles()[0];
    /// for _ in 0..350 {
    ///     run.step();
    /// }
    /// // Half a stride later the right leg is where the left one was.
    /// assert!((run.angles()[1].0 - left.0).abs() < 1e-3);
    /// # Ok::<(), cpg_core::BuildError>(())
    /// ```
    pub fn build(self, speed: f32, period: Period) -> Result<DefaultGait, BuildError> {
        let (slowest, fastest) = self.speeds();
        in_range(speed, Field::of("speed"), slowest, fastest)?;
        Ok(match self {
            Gait::Walk => {
                let mut config = default_config();
                config.natural_period /= speed;
                DefaultGait::Walk(config.build(period)?)
            }
            Gait::NaturalWalk => DefaultGait::Shape(
                PhaseShapeConfig { shapes: natural_shapes()?, stride_s: self.stride_s() / speed }.build(period)?,
            ),
            Gait::Thesis => {
                let mut config = ThesisConfig::set_s();
                for joint in &mut config.joints {
                    // Time runs faster as a whole: alpha and mu scale with it, p with its inverse square.
                    joint.alpha *= speed;
                    joint.mu *= speed;
                    joint.p /= speed * speed;
                }
                config.difference = config.difference.map(|pair| pair.map(|k| k * speed));
                config.product = config.product.map(|pair| pair.map(|k| k * speed));
                DefaultGait::Thesis(config.build::<LeftRight, HipKnee, Rk4>(period)?)
            }
            Gait::Cells(gait) => DefaultGait::Cells(cells(gait, self.stride_s() / speed, period)?),
            Gait::Human(member) => {
                let (least, most) = member.cadences();
                // At the ends the product may be beyond by a rounding.
                let cadence = (speed * member.middle()).max(least).min(most);
                DefaultGait::Shape(member.at_cadence(cadence)?.build(period)?)
            }
        })
    }
}

/// A built gait.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DefaultGait {
    /// R1.
    Walk(Robust<Biped, 4, 4>),
    /// Phase and shape.
    Shape(PhaseShape<FourierShape<6>, 4>),
    /// The thesis' network.
    Thesis(Thesis),
    /// Four cells.
    Cells(Readout<LegNetwork, 8, 4>),
}

impl DefaultGait {
    /// The gait after steps until its gait phase passes `phase`, one stride at most: the right start for a gait that replaces another one at this
    /// phase. `period` is that of its build. It computes up to a stride of steps, so call it outside the control loop; phase and shape are
    /// set to the phase at once.
    #[must_use]
    pub fn aligned(mut self, phase: Phase, period: Period) -> Self {
        if let Self::Shape(shape) = &mut self {
            shape.set_phase(phase);
            return self;
        }
        let ahead = |gait: &Self| phase - gait.phase();
        // Longer than the slowest stride at half speed.
        let most = 3_000_000_u32.checked_div(period.micros()).unwrap_or(0);
        for _ in 0..most {
            let before = ahead(&self);
            self.step();
            // The distance falls from step to step, and leaps up where the phase has been passed.
            if ahead(&self).0 > before.0 {
                break;
            }
        }
        self
    }
}

pub(crate) fn natural_shapes() -> Result<[FourierShape<6>; 4], BuildError> {
    let [a, b, c, d] = &NATURAL_WALK;
    Ok([shape(a)?, shape(b)?, shape(c)?, shape(d)?])
}

/// Cells 1 and 2 drive the hips, 3 and 4 the knees, with the amplitudes and offsets of the default walk.
fn cells(gait: LegGait, stride_s: f32, period: Period) -> Result<Readout<LegNetwork, 8, 4>, BuildError> {
    // sqrt(1.9): the amplitude of every gait of the network, see `LegNetwork::of`.
    const RADIUS: f32 = 1.378_404_9;
    let walk = default_config();
    let mut config = ReadoutConfig {
        start: [0.0; 8],
        cycle: 1.0,
        stride_s,
        weights: [[0.0; 8]; 4],
        offsets: walk.offsets,
        plane: PhasePlane { x: 0, y: 1, centre: (0.0, 0.0), radius: (RADIUS, RADIUS) },
        bound: 5.0,
    };
    for (cell, phase) in config.start.chunks_exact_mut(2).zip(gait.phases()) {
        if let [x, y] = cell {
            let (sin, cos) = crate::math::trig::sin_cos(Phase::from_cycles(phase));
            (*x, *y) = (RADIUS * cos, RADIUS * sin);
        }
    }
    for ((cell, row), amplitude) in config.weights.iter_mut().enumerate().zip(walk.amplitudes) {
        if let Some(weight) = row.get_mut(2 * cell) {
            *weight = amplitude.0 / RADIUS;
        }
    }
    config.build(LegNetwork::of(gait), period)
}

/// Calls a method of the generator in the enum.
macro_rules! each {
    ($gait:expr, $generator:ident => $call:expr) => {
        match $gait {
            DefaultGait::Walk($generator) => $call,
            DefaultGait::Shape($generator) => $call,
            DefaultGait::Thesis($generator) => $call,
            DefaultGait::Cells($generator) => $call,
        }
    };
}

impl Generator<4> for DefaultGait {
    fn step(&mut self) {
        each!(self, generator => generator.step());
    }

    fn angles(&self) -> [Radians; 4] {
        each!(self, generator => generator.angles())
    }

    fn rates(&self) -> [RadPerSec; 4] {
        each!(self, generator => generator.rates())
    }

    fn phase(&self) -> Phase {
        each!(self, generator => generator.phase())
    }

    fn amplitude(&self) -> f32 {
        each!(self, generator => generator.amplitude())
    }

    fn check(&self) -> Result<(), StateFault> {
        each!(self, generator => generator.check())
    }

    fn reset(&mut self) {
        each!(self, generator => generator.reset());
    }
}
