//! The limit cycle of a system, found to the error of the integration.

use generator_file::model::Model;
use generator_file::orbit::{self, Orbit};

use crate::oscillator::Oscillator;
use crate::settle::{self, settle};
use crate::system::{ONLY_A_PHASE, System};

/// Largest relative difference of the period to that at half the step.
const SAME_PERIOD: f64 = 2e-4;
/// How often the step is halved, at most.
const HALVINGS: usize = 4;

/// A limit cycle, and the model that has it.
pub struct Cycle {
    /// The model, at the step of the integration.
    pub model: Box<dyn Model>,
    /// The orbit.
    pub orbit: Orbit,
    /// Time of one step.
    pub step: f64,
}

impl Cycle {
    /// The cycle that the system settles on from its own start.
    ///
    /// # Errors
    /// It has none, or its only state is a phase; the text says which.
    pub fn of(system: &System) -> Result<Self, String> {
        match system {
            System::Oscillator(oscillator) => Self::of_oscillator(oscillator),
            System::Generator(subject) => {
                let settled = subject.motion()?.ok_or(ONLY_A_PHASE)?;
                match settled.motion {
                    orbit::Motion::Periodic(orbit) => {
                        let step = orbit.period_s / orbit.steps;
                        Ok(Self { model: settled.model, orbit, step })
                    }
                    orbit::Motion::Still => Err("it comes to rest; allowed is a system that oscillates".into()),
                    orbit::Motion::QuasiPeriodic => Err(
                        "its motion is steady but never repeats (quasi-periodic); allowed is a system with a limit cycle".into()
                    ),
                    orbit::Motion::Irregular => {
                        Err("its motion has no steady period; allowed is a system with a limit cycle".into())
                    }
                }
            }
        }
    }

    fn of_oscillator(oscillator: &Oscillator) -> Result<Self, String> {
        let mut step = oscillator.step();
        let mut start = oscillator.kind.start.to_vec();
        let mut coarser: Option<Self> = None;
        for _ in 0..HALVINGS {
            let mut model = oscillator.model(step)?;
            model.set_state(&start);
            let motion = settle(model.as_mut(), &oscillator.scale(), oscillator.cycle() / step);
            let settle::Motion::Cycle(extent) = motion else {
                return Err(format!("its motion is `{}`; allowed is a system with a limit cycle", motion.word()));
            };
            start = model.state();
            let orbit::Motion::Periodic(mut orbit) = orbit::motion(model.as_ref(), extent.steps.ceil() as usize) else {
                return Err("its motion has no orbit that can be found; allowed is a system with a limit cycle".into());
            };
            orbit.period_s = orbit.steps * step;
            let found = Self { model, orbit, step };
            match coarser {
                Some(before) if (before.period() / found.period() - 1.0).abs() < SAME_PERIOD => return Ok(before),
                _ => coarser = Some(found),
            }
            step *= 0.5;
        }
        coarser.ok_or_else(|| "it has no limit cycle".into())
    }

    /// Period, in the system's unit of time.
    #[must_use]
    pub fn period(&self) -> f64 {
        self.orbit.period_s
    }

    /// The model at phase 0: at the step at which its first state is largest.
    #[must_use]
    pub fn at_start(&self) -> Box<dyn Model> {
        let mut model = self.model.copy();
        model.set_state(&self.orbit.at(0.0));
        let mut largest = model.copy();
        for _ in 0..self.orbit.steps as usize {
            model.advance(1);
            if model.value(0) > largest.value(0) {
                largest = model.copy();
            }
        }
        largest
    }
}
