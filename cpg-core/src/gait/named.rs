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
//!
//! To change from one gait or speed to another at any tick, wrap it in [`crate::transition::Smooth`].

use joint_units::{Period, Phase, RadPerSec, Radians};

use crate::error::in_range;
use crate::gait::default_walk::default_config;
use crate::gait::fitted::{Harmonics, NATURAL_WALK};
use crate::joints::linear::{PhasePlane, Readout, ReadoutConfig};
use crate::network::graph::{Biped, HipKnee, LeftRight};
use crate::network::phase_coupled::Robust;
use crate::network::symmetric_cells::{LegGait, LegNetwork};
use crate::network::thesis::{Thesis, ThesisConfig};
use crate::waveform::shape::{FourierShape, PhaseShape, PhaseShapeConfig};
use crate::{BuildError, Field, Generator, Rk4, StateFault};

/// Least and largest speed of a gait, as a factor on its own cadence. [`crate::gait::speed_limit`] has those within rate limits.
pub const SPEEDS: (f32, f32) = (0.5, 1.5);

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
}

impl Gait {
    /// Every gait.
    pub const ALL: [Gait; 10] = [
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
        }
    }

    /// Builds the gait; `speed` 0.5 to 1.5 divides the stride time.
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
        in_range(speed, Field::of("speed"), SPEEDS.0, SPEEDS.1)?;
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
    /// phase. `period` is that of its build. It computes up to a stride of steps, so call it outside the control loop.
    #[must_use]
    pub fn aligned(mut self, phase: Phase, period: Period) -> Self {
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
    let shape = |(mean, cos, sin): Harmonics| {
        let radians = |degrees: f32| Radians::from_degrees(degrees).0;
        FourierShape::new(Radians::from_degrees(mean), cos.map(radians), sin.map(radians))
    };
    let [a, b, c, d] = NATURAL_WALK;
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
