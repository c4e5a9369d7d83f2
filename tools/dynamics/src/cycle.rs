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

/// Steps beside a cycle between which its largest value is interpolated.
const BESIDE: usize = 4;
/// Thirds that are cut off from the interval of the largest value.
const THIRDS: usize = 60;

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

    /// The model at phase 0: where its first state is largest, between two steps as a rule.
    #[must_use]
    pub fn at_start(&self) -> Box<dyn Model> {
        let mut model = self.model.copy();
        model.set_state(&self.orbit.at(0.0));
        // A cycle, and some steps to either side.
        let mut states = vec![];
        for _ in 0..self.orbit.steps as usize + 2 * BESIDE {
            states.push(model.state());
            model.advance(1);
        }
        let inner = BESIDE..states.len() - BESIDE;
        let largest = inner.max_by(|&a, &b| states[a][0].total_cmp(&states[b][0])).unwrap_or(BESIDE) as f64;
        let at = |step: f64| orbit::interpolated(&states, step);
        let (mut low, mut high) = (largest - 1.0, largest + 1.0);
        // It has one largest value between the two neighbours of the largest.
        for _ in 0..THIRDS {
            let third = (high - low) / 3.0;
            let [left, right] = [low + third, high - third];
            if at(left)[0] < at(right)[0] { low = left } else { high = right }
        }
        model.set_state(&at(0.5 * (low + high)));
        model
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On the circle the first state is largest where the second is zero, and the start of another step is the same point.
    #[test]
    fn phase_zero_lies_between_steps() {
        let state = Cycle::of(&System::read("oscillator:hopf").unwrap()).unwrap().at_start().state();
        assert!((state[0] - 1.0).abs() < 1e-6 && state[1].abs() < 1e-4, "{state:?}");
        let neuron = Cycle::of(&System::read("oscillator:fitzhugh-nagumo").unwrap()).unwrap();
        let here = neuron.at_start().state();
        // v' = v - v^3/3 - w + 0.5 is zero there.
        let slope = here[0] - here[0].powi(3) / 3.0 - here[1] + 0.5;
        assert!(slope.abs() < 1e-4, "{slope}");
        assert!(neuron.orbit.distance(&here) < 1e-3, "{}", neuron.orbit.distance(&here));
    }
}
