//! An oscillator of first order as a model: its states in `f64`, stepped by the classical Runge-Kutta method.

use cpg_core::math::first_order::{Flow, rk4};
use generator_file::model::Model;

use super::kind::Kind;

/// States beyond so many times the largest start or scale have left for good.
const BOUND: f64 = 1e3;

/// A flow with its state.
#[derive(Clone)]
pub(super) struct FlowModel<F, const D: usize> {
    flow: F,
    state: [f64; D],
    step: f64,
    names: &'static [&'static str],
    bound: f64,
}

/// The model of a flow, at its start.
pub(super) fn model<F: Flow<f64, D> + Clone + Send + Sync + 'static, const D: usize>(
    flow: F,
    kind: &Kind,
    scale: &[f64],
    step: f64,
) -> Box<dyn Model> {
    let state = std::array::from_fn(|index| kind.start[index]);
    let bound = BOUND * scale.iter().chain(&state).fold(0.0_f64, |most, x| most.max(x.abs()));
    Box::new(FlowModel { flow, state, step, names: kind.variables, bound })
}

impl<F: Flow<f64, D> + Clone + Send + Sync + 'static, const D: usize> Model for FlowModel<F, D> {
    fn advance(&mut self, steps: usize) -> bool {
        for _ in 0..steps {
            rk4(&self.flow, &mut self.state, self.step);
            // Also where a state is not a number.
            if !self.state.iter().all(|x| x.abs() < self.bound) {
                return false;
            }
        }
        true
    }

    fn state(&self) -> Vec<f64> {
        self.state.to_vec()
    }

    fn set_state(&mut self, state: &[f64]) {
        self.state = std::array::from_fn(|index| state[index]);
    }

    fn names(&self) -> Vec<String> {
        self.names.iter().map(|name| (*name).to_owned()).collect()
    }

    fn value(&self, index: usize) -> f64 {
        self.state[index]
    }

    fn kick(&mut self, index: usize, by: f64) {
        self.state[index] += by;
    }

    fn has_joint_states(&self) -> bool {
        false
    }

    fn is_double(&self) -> bool {
        true
    }

    fn copy(&self) -> Box<dyn Model> {
        Box::new(self.clone())
    }
}
