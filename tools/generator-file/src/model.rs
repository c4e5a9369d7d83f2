//! The `f64` models that the certificate measures: generators whose states can be read and set, each divided by its amplitude.

use cpg_core::network::graph::{Biped, HipKnee, LeftRight};
use cpg_core::network::phase_coupled::RobustConfig;
use cpg_core::{BOUND_FACTOR, Generator, OscillatorState, Oscillators, Rk4, SecondOrder, StateFault};
use joint_loop::GeneratorConfig;
use joint_units::Period;

use crate::file::GeneratorSet;

/// A generator in `f64` whose states can be read and set.
pub(crate) trait Model {
    /// One step.
    fn step(&mut self);
    /// Every state, displacements first, each divided by its amplitude.
    fn state(&self) -> Vec<f64>;
    /// Sets every state; `false` and no change if one is out of bounds.
    fn set_state(&mut self, state: &[f64]) -> bool;
    /// Whether every state is finite and within its bound.
    fn sound(&self) -> bool;
    /// A copy.
    fn copy(&self) -> Box<dyn Model>;
}

/// The model of a generator; `None` if its only state is a phase, which no perturbation moves off the cycle.
///
/// # Errors
/// The generator cannot be built; the text says why.
pub(crate) fn model(set: &GeneratorSet, period: Period) -> Result<Option<Box<dyn Model>>, String> {
    let model: Box<dyn Model> = match (set, set.config()) {
        (_, GeneratorConfig::PhaseCoupled(config)) => {
            let config = RobustConfig {
                natural_period: f64::from(config.natural_period),
                nonlinearity: f64::from(config.nonlinearity),
                coupling: config.coupling.map(f64::from),
                phases: config.phases,
                amplitudes: config.amplitudes,
                offsets: config.offsets,
            };
            Box::new(Network(config.build::<Biped, Rk4>(period).map_err(|e| e.to_string())?))
        }
        (GeneratorSet::Thesis(set), _) => Box::new(Network(
            set.config_of::<f64>().build::<LeftRight, HipKnee, Rk4>(period).map_err(|e| e.to_string())?,
        )),
        _ => return Ok(None),
    };
    Ok(Some(model))
}

/// A network of second-order oscillators.
#[derive(Clone)]
struct Network<F>(Oscillators<F, 4, f64, Rk4>);

impl<F: SecondOrder<f64, 4> + Copy + 'static> Model for Network<F> {
    fn step(&mut self) {
        self.0.step();
    }

    fn state(&self) -> Vec<f64> {
        let (state, limit) = (self.0.state(), self.0.limit());
        let parts = |x: [f64; 4], limit: [f64; 4]| (0..4).map(move |i| x[i] * f64::from(BOUND_FACTOR) / limit[i]);
        parts(state.displacement, limit.displacement).chain(parts(state.velocity, limit.velocity)).collect()
    }

    fn set_state(&mut self, state: &[f64]) -> bool {
        let limit = self.0.limit();
        let whole = |i: usize, limit: f64| state[i] * limit / f64::from(BOUND_FACTOR);
        let state = OscillatorState {
            displacement: std::array::from_fn(|i| whole(i, limit.displacement[i])),
            velocity: std::array::from_fn(|i| whole(i + 4, limit.velocity[i])),
        };
        self.0.set_state(&state).is_ok()
    }

    fn sound(&self) -> bool {
        let sound: Result<(), StateFault> = self.0.check();
        sound.is_ok()
    }

    fn copy(&self) -> Box<dyn Model> {
        Box::new(self.clone())
    }
}
