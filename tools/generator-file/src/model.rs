//! The models that certificates and analyses measure: generators whose states can be read and set.

use cpg_core::joints::from_hopf_bank::BankWalk;
use cpg_core::joints::linear::{LinearJoints, Readout};
use cpg_core::math::first_order::Flow;
use cpg_core::network::graph::{Biped, HipKnee, LeftRight};
use cpg_core::network::phase_coupled::RobustConfig;
use cpg_core::{BOUND_FACTOR, Generator, OscillatorState, Oscillators, Rk4, SecondOrder};
use joint_loop::GeneratorConfig;
use joint_units::{Joint, Period};

use crate::file::GeneratorSet;

/// A generator or oscillator whose states can be read and set.
pub trait Model: Send + Sync {
    /// Advances by so many steps. False if a state reaches its bound on the way: on a board that is a fault.
    fn advance(&mut self, steps: usize) -> bool;
    /// Every state. Those of a network are displacements first, then velocities, each divided by its closed-form amplitude.
    fn state(&self) -> Vec<f64>;
    /// Sets every state; one beyond its bound is put just inside it.
    fn set_state(&mut self, state: &[f64]);
    /// Names of the states, in the order of [`Model::state`].
    fn names(&self) -> Vec<String>;
    /// One state; `index` is below their number.
    fn value(&self, index: usize) -> f64 {
        self.state()[index]
    }
    /// Adds to one state; `index` is below their number.
    fn kick(&mut self, index: usize, by: f64) {
        let mut state = self.state();
        state[index] += by;
        self.set_state(&state);
    }
    /// Whether the states are displacements and velocities of the joints.
    fn has_joint_states(&self) -> bool;
    /// Whether it is computed in `f64`, else in `f32`.
    fn is_double(&self) -> bool;
    /// A copy.
    fn copy(&self) -> Box<dyn Model>;
}

/// Names of the four joints.
const JOINTS: [&str; 4] = [Joint::ALL[0].name(), Joint::ALL[1].name(), Joint::ALL[2].name(), Joint::ALL[3].name()];

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
            network(config.build::<Biped, Rk4>(period).map_err(|e| e.to_string())?, JOINTS)
        }
        (GeneratorSet::Thesis(set), _) => {
            network(set.config_of::<f64>().build::<LeftRight, HipKnee, Rk4>(period).map_err(|e| e.to_string())?, JOINTS)
        }
        _ => return Ok(None),
    };
    Ok(Some(model))
}

/// The model of a network of second-order oscillators, one for each of `names`.
pub fn network<F: SecondOrder<f64, N> + Copy + Send + Sync + 'static, const N: usize>(
    oscillators: Oscillators<F, N, f64, Rk4>,
    names: [&'static str; N],
) -> Box<dyn Model> {
    Box::new(Network { oscillators, names })
}

/// A network of second-order oscillators, one a joint.
#[derive(Clone)]
struct Network<F, const N: usize> {
    oscillators: Oscillators<F, N, f64, Rk4>,
    names: [&'static str; N],
}

impl<F: SecondOrder<f64, N> + Copy + Send + Sync + 'static, const N: usize> Model for Network<F, N> {
    fn advance(&mut self, steps: usize) -> bool {
        let mut sound = true;
        for _ in 0..steps {
            self.oscillators.step();
            sound &= self.oscillators.check().is_ok();
        }
        sound
    }

    fn state(&self) -> Vec<f64> {
        let (state, limit) = (self.oscillators.state(), self.oscillators.limit());
        let parts = |x: [f64; N], limit: [f64; N]| (0..N).map(move |i| x[i] * f64::from(BOUND_FACTOR) / limit[i]);
        parts(state.displacement, limit.displacement).chain(parts(state.velocity, limit.velocity)).collect()
    }

    fn set_state(&mut self, state: &[f64]) {
        let limit = self.oscillators.limit();
        let most = 0.999 * f64::from(BOUND_FACTOR);
        let whole = |i: usize, limit: f64| state[i].max(-most).min(most) * limit / f64::from(BOUND_FACTOR);
        let state = OscillatorState {
            displacement: std::array::from_fn(|i| whole(i, limit.displacement[i])),
            velocity: std::array::from_fn(|i| whole(i + N, limit.velocity[i])),
        };
        // Every state is inside its bound.
        let _ = self.oscillators.set_state(&state);
    }

    fn names(&self) -> Vec<String> {
        let of = |what: &'static str| self.names.iter().map(move |name| format!("{name}.{what}"));
        of("displacement").chain(of("velocity")).collect()
    }

    fn value(&self, index: usize) -> f64 {
        let (state, limit) = (self.oscillators.state(), self.oscillators.limit());
        let (value, limit) = match index.checked_sub(N) {
            None => (state.displacement[index], limit.displacement[index]),
            Some(velocity) => (state.velocity[velocity], limit.velocity[velocity]),
        };
        value * f64::from(BOUND_FACTOR) / limit
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
pub(crate) trait FlowStates: Generator<4> + Clone + Send + Sync + 'static {
    /// The states.
    fn states(&self) -> Vec<f64>;
    /// Sets them; each is limited to its bound.
    fn set_states(&mut self, state: &[f64]);
}

impl<F: Flow<f32, D> + Clone + Send + Sync + 'static, const D: usize, const M: usize> FlowStates
    for LinearJoints<F, D, M>
{
    fn states(&self) -> Vec<f64> {
        self.state().iter().map(|&x| f64::from(x)).collect()
    }

    fn set_states(&mut self, state: &[f64]) {
        self.set_state(std::array::from_fn(|i| state[i] as f32));
    }
}

impl<F: Flow<f32, D> + Clone + Send + Sync + 'static, const D: usize> FlowStates for Readout<F, D, 4> {
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

    fn names(&self) -> Vec<String> {
        (0..self.0.states().len()).map(|index| format!("state[{index}]")).collect()
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
