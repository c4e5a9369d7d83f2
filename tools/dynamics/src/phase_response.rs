//! The phase response curve: by how much a kick of one state shifts the phase, and the lock range that follows from it.
//!
//! The direct method: the model runs from a phase of its orbit, once with the kick and once without, until the kicked one is back on the orbit. The shift
//! is the difference of their phases then, as a part of the cycle; positive is an advance. The phase is that of the nearest point of the orbit; one that
//! stays away from the orbit has no phase, and the kick is *lost*.
//!
//! For a weak input `x' = ... + A cos(2 pi F t)` on that state, with the response `Z` to a unit kick, the phase difference `psi` to an m-th of the input
//! changes on average by
//! ```text
//! psi' = f - F/m + A H(psi),   H(psi) = mean over theta of Z(theta) cos(2 pi m (theta - psi))
//! ```
//! so that one cycle locks to m of the input for `m (f + A min H) <= F <= m (f + A max H)`.

use generator_file::model::Model;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use std::f64::consts::TAU;

use crate::cycle::Cycle;

/// Cycles after which the phase is compared for the first time; the time is then doubled.
const FIRST_CYCLES: f64 = 10.0;
/// Most cycles after a kick.
pub const MOST_CYCLES: f64 = 320.0;
/// Largest distance from the orbit of a model that is back, in amplitudes.
pub const BACK: f64 = 0.01;
/// Largest change of the shift between two comparisons of one that has converged, in cycles.
pub const CONVERGED: f64 = 1e-4;

/// The response to a kick at one phase.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    /// Phase of the kick, 0 to 1; 0 where the first state is largest.
    pub phase: f64,
    /// Asymptotic shift of the phase, -0.5 to 0.5; none if it does not come back to the orbit.
    pub shift: Option<f64>,
    /// Distance from the orbit at the end, in amplitudes; infinite if a state reached its bound.
    pub distance: f64,
}

/// The responses to a kick of the state `variable` by `size`, in the unit of the state, at evenly spaced phases.
#[must_use]
pub fn response(cycle: &Cycle, variable: usize, size: f64, phases: usize) -> Vec<Response> {
    let start = cycle.at_start();
    (0..phases)
        .into_par_iter()
        .map(|index| at_phase(cycle, start.copy(), variable, size, index as f64 / phases as f64))
        .collect()
}

/// `free` is at phase 0.
fn at_phase(cycle: &Cycle, mut free: Box<dyn Model>, variable: usize, size: f64, phase: f64) -> Response {
    let orbit = &cycle.orbit;
    let step = (phase * orbit.steps).round();
    let phase = step / orbit.steps;
    free.advance(step as usize);
    let mut kicked = free.copy();
    kicked.kick(variable, size);
    let (mut cycles, mut done, mut before) = (FIRST_CYCLES, 0.0, None);
    loop {
        let steps = ((cycles - done) * orbit.steps).round() as usize;
        free.advance(steps);
        if !kicked.advance(steps) {
            return Response { phase, shift: None, distance: f64::INFINITY };
        }
        let ((distance, at), (_, free_at)) = (orbit.nearest(&kicked.state()), orbit.nearest(&free.state()));
        let shift = wrapped(at - free_at);
        let is_same = before.is_some_and(|before| wrapped(shift - before).abs() < CONVERGED);
        if distance < BACK && is_same {
            return Response { phase, shift: Some(shift), distance };
        }
        if cycles >= MOST_CYCLES {
            return Response { phase, shift: None, distance };
        }
        before = Some(shift);
        (done, cycles) = (cycles, 2.0 * cycles);
    }
}

/// A difference of phases, from -0.5 to 0.5.
fn wrapped(difference: f64) -> f64 {
    difference - difference.round()
}

/// Lowest and highest change of frequency, in cycles per unit of time and unit of the input's amplitude A, over which one cycle locks to `m` of a weak
/// sinusoidal input; none if a kick is lost. `size` is the size of the kick of the responses.
#[must_use]
pub fn lock_range(responses: &[Response], size: f64, m: u32) -> Option<[f64; 2]> {
    let shifts: Option<Vec<(f64, f64)>> =
        responses.iter().map(|response| Some((response.phase, response.shift? / size))).collect();
    let shifts = shifts?;
    let m = f64::from(m);
    // The mean difference to an m-th of the input, over all phases.
    let interaction = |psi: f64| {
        shifts.iter().map(|(theta, shift)| shift * (TAU * m * (theta - psi)).cos()).sum::<f64>() / shifts.len() as f64
    };
    let all = (0..720).map(|k| interaction(f64::from(k) / 720.0 / m));
    let (low, high) = all.fold((f64::MAX, f64::MIN), |(low, high), value| (low.min(value), high.max(value)));
    Some([m * low, m * high])
}
