//! The models that the certificate measures: generators whose states can be read and set.

use cpg_core::joints::from_hopf_bank::BankWalk;
use cpg_core::joints::linear::{LinearJoints, Readout};
use cpg_core::math::first_order::Flow;
use cpg_core::network::graph::{Biped, HipKnee, LeftRight};
use cpg_core::network::phase_coupled::RobustConfig;
use cpg_core::{BOUND_FACTOR, Generator, OscillatorState, Oscillators, Rk4, SecondOrder};
use joint_loop::GeneratorConfig;
use joint_units::Period;

use crate::file::GeneratorSet;

/// A generator whose states can be read and set.
pub(crate) trait Model {
    /// Advances by so many steps. False if a state reaches its bound on the way: on a board that is a fault.
    fn advance(&mut self, steps: usize) -> bool;
    /// Every state. Those of a network are displacements first, then velocities, each divided by its closed-form amplitude.
    fn state(&self) -> Vec<f64>;
    /// Sets every state; one beyond its bound is put just inside it.
    fn set_state(&mut self, state: &[f64]);
    /// Whether the states are displacements and velocities of the joints.
    fn has_joint_states(&self) -> bool;
    /// Whether it is computed in `f64`, else in `f32`.
    fn is_double(&self) -> bool;
    /// A copy.
    fn copy(&self) -> Box<dyn Model>;
}

/// The model of a generator file's set in `f64`; `None` if its only state is a phase, which no kick moves off the cycle.
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

/// A network of second-order oscillators, one a joint.
#[derive(Clone)]
struct Network<F>(Oscillators<F, 4, f64, Rk4>);

impl<F: SecondOrder<f64, 4> + Copy + 'static> Model for Network<F> {
    fn advance(&mut self, steps: usize) -> bool {
        let mut sound = true;
        for _ in 0..steps {
            self.0.step();
            sound &= self.0.check().is_ok();
        }
        sound
    }

    fn state(&self) -> Vec<f64> {
        let (state, limit) = (self.0.state(), self.0.limit());
        let parts = |x: [f64; 4], limit: [f64; 4]| (0..4).map(move |i| x[i] * f64::from(BOUND_FACTOR) / limit[i]);
        parts(state.displacement, limit.displacement).chain(parts(state.velocity, limit.velocity)).collect()
    }

    fn set_state(&mut self, state: &[f64]) {
        let limit = self.0.limit();
        let most = 0.999 * f64::from(BOUND_FACTOR);
        let whole = |i: usize, limit: f64| state[i].max(-most).min(most) * limit / f64::from(BOUND_FACTOR);
        let state = OscillatorState {
            displacement: std::array::from_fn(|i| whole(i, limit.displacement[i])),
            velocity: std::array::from_fn(|i| whole(i + 4, limit.velocity[i])),
        };
        // Every state is inside its bound.
        let _ = self.0.set_state(&state);
    }

    fn has_joint_states(&self) -> bool {
        true
    }

    fn is_double(&self) -> bool {
        true
    }

    fn copy(&self) -> Box<dyn Model> {
        Box::new(self.clone())
    }
}

/// A generator in `f32` whose states are those of a flow.
pub(crate) trait FlowStates: Generator<4> + Clone + 'static {
    /// The states.
    fn states(&self) -> Vec<f64>;
    /// Sets them; each is limited to its bound.
    fn set_states(&mut self, state: &[f64]);
}

impl<F: Flow<f32, D> + Clone + 'static, const D: usize, const M: usize> FlowStates for LinearJoints<F, D, M> {
    fn states(&self) -> Vec<f64> {
        self.state().iter().map(|&x| f64::from(x)).collect()
    }

    fn set_states(&mut self, state: &[f64]) {
        self.set_state(std::array::from_fn(|i| state[i] as f32));
    }
}

impl<F: Flow<f32, D> + Clone + 'static, const D: usize> FlowStates for Readout<F, D, 4> {
    fn states(&self) -> Vec<f64> {
        self.state().iter().map(|&x| f64::from(x)).collect()
    }

    fn set_states(&mut self, state: &[f64]) {
        self.set_state(std::array::from_fn(|i| state[i] as f32));
    }
}

impl<const H: usize> FlowStates for BankWalk<H> {
    fn states(&self) -> Vec<f64> {
        self.bank().points().as_flattened().iter().map(|&x| f64::from(x)).collect()
    }

    fn set_states(&mut self, state: &[f64]) {
        self.set_points(std::array::from_fn(|i| [state[2 * i] as f32, state[2 * i + 1] as f32]));
    }
}

/// The model of such a generator.
#[derive(Clone)]
pub(crate) struct Single<G>(pub(crate) G);

impl<G: FlowStates> Model for Single<G> {
    fn advance(&mut self, steps: usize) -> bool {
        let mut sound = true;
        for _ in 0..steps {
            self.0.step();
            sound &= self.0.check().is_ok();
        }
        sound
    }

    fn state(&self) -> Vec<f64> {
        self.0.states()
    }

    fn set_state(&mut self, state: &[f64]) {
        self.0.set_states(state);
    }

    fn has_joint_states(&self) -> bool {
        false
    }

    fn is_double(&self) -> bool {
        false
    }

    fn copy(&self) -> Box<dyn Model> {
        Box::new(self.clone())
    }
}
