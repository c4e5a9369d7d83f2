//! The generators as the certificate sees them: every state in parts of its amplitude.

use cpg_core::{BOUND_FACTOR, Generator, OscillatorState, Oscillators, Rk4, SecondOrder, StateFault};

use crate::certificate::Specimen;

/// A network of second-order oscillators.
#[derive(Clone)]
pub(crate) struct Orbiting<F>(pub(crate) Oscillators<F, 4, f64, Rk4>);

impl<F: SecondOrder<f64, 4> + Copy + 'static> Specimen for Orbiting<F> {
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

    fn copy(&self) -> Box<dyn Specimen> {
        Box::new(self.clone())
    }
}
