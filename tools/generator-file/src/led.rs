//! A generator as it runs on a board; a follower gets the angles of a simulated person.

use cpg_core::entrainment::FollowStatus;
use cpg_core::entrainment::phase_lock::Template;
use cpg_core::waveform::shape::Shape;
use cpg_core::{Follow, Generator, StateFault};
use joint_loop::{BoardGenerator, GeneratorConfig};
use joint_units::{Period, Phase, RadPerSec, Radians};

use crate::file::GeneratorSet;
use crate::random::Random;

/// Standard deviation of the noise on the simulated person's angle, degrees.
pub const NOISE_DEG: f64 = 0.1;

/// A simulated person with the sensor.
#[derive(Debug, Clone)]
pub(crate) struct SimulatedPerson {
    template: Template,
    pub(crate) cycles: f64,
    /// Cycles a tick.
    pub(crate) rate: f64,
    pub(crate) random: Random,
}

impl SimulatedPerson {
    pub(crate) fn new(template: Template, phase: f64, stride_s: f64) -> Self {
        Self { template, cycles: phase, rate: 1e-3 / stride_s, random: Random(1) }
    }

    pub(crate) fn tick(&mut self) -> Radians {
        self.cycles += self.rate;
        let noise = self.random.normal() * NOISE_DEG.to_radians();
        Radians((f64::from(self.template.at(self.phase()).angle) + noise) as f32)
    }

    fn phase(&self) -> Phase {
        Phase::from_cycles(self.cycles.rem_euclid(1.0) as f32)
    }

    /// How far `phase` is behind the person's, degrees.
    pub(crate) fn off(&self, phase: Phase) -> f64 {
        f64::from(self.phase().radians_after(phase).0).to_degrees()
    }
}

/// A generator as it runs on the board; a follower gets the angles of a simulated person.
#[derive(Clone)]
pub(crate) struct Led {
    generator: Run,
    person: Option<SimulatedPerson>,
    ticks_per_period: f64,
}

#[derive(Clone)]
enum Run {
    Board(Box<BoardGenerator>),
    Named(Box<dyn Named>),
}

/// A generator of any type, which can be copied with its state.
trait Named: Generator<4> {
    fn copied(&self) -> Box<dyn Named>;
}

impl<G: Generator<4> + Clone + 'static> Named for G {
    fn copied(&self) -> Box<dyn Named> {
        Box::new(self.clone())
    }
}

impl Clone for Box<dyn Named> {
    fn clone(&self) -> Self {
        self.as_ref().copied()
    }
}

impl Led {
    pub(crate) fn new(set: &GeneratorSet, period: Period) -> Result<Self, String> {
        let generator = Run::Board(Box::new(set.build(period).map_err(|error| error.to_string())?));
        let person = match set.config() {
            GeneratorConfig::Follow(config) => {
                let shapes = config.shape.shapes().map_err(|error| error.to_string())?;
                Some(SimulatedPerson::new(shapes[config.sensor as usize], 0.0, f64::from(config.shape.stride_s)))
            }
            _ => None,
        };
        Ok(Self { generator, person, ticks_per_period: f64::from(period.micros()) * 1e-3 })
    }

    /// A generator that follows nobody.
    pub(crate) fn named(generator: impl Generator<4> + Clone + 'static) -> Self {
        Self { generator: Run::Named(Box::new(generator)), person: None, ticks_per_period: 1.0 }
    }

    fn generator(&self) -> &dyn Generator<4> {
        match &self.generator {
            Run::Board(generator) => generator.as_ref(),
            Run::Named(generator) => generator.as_ref(),
        }
    }
}

impl Generator<4> for Led {
    fn step(&mut self) {
        match (&mut self.generator, &mut self.person) {
            (Run::Board(generator), Some(person)) => {
                person.cycles += person.rate * self.ticks_per_period;
                generator.observe(Some(Radians(person.template.at(person.phase()).angle)));
                generator.step();
            }
            (Run::Board(generator), None) => generator.step(),
            (Run::Named(generator), _) => generator.step(),
        }
    }

    fn angles(&self) -> [Radians; 4] {
        self.generator().angles()
    }

    fn rates(&self) -> [RadPerSec; 4] {
        self.generator().rates()
    }

    fn phase(&self) -> Phase {
        self.generator().phase()
    }

    fn amplitude(&self) -> f32 {
        self.generator().amplitude()
    }

    fn check(&self) -> Result<(), StateFault> {
        self.generator().check()
    }

    fn reset(&mut self) {
        match &mut self.generator {
            Run::Board(generator) => generator.reset(),
            Run::Named(generator) => generator.reset(),
        }
    }
}

/// The loop's own sensor has no effect: the simulated person is the input.
impl Follow for Led {
    fn observe(&mut self, _: Option<Radians>) {}

    fn heel_strike(&mut self) {}

    fn follow_status(&self) -> Option<FollowStatus> {
        match &self.generator {
            Run::Board(generator) => generator.follow_status(),
            Run::Named(_) => None,
        }
    }
}
