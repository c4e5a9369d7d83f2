//! The limit cycle of a generator's model, and how starts beside it behave.
//!
//! A distance is the largest difference of a state from the nearest point of the orbit; every state is divided by its amplitude.

use nalgebra::DMatrix;
use serde::Serialize;

use crate::model::Model;
use crate::random::Random;

/// Largest size of a random start, in amplitudes.
pub const START_BOX: f64 = 1.5;
/// Strides after which a random start is judged.
pub const START_STRIDES: u32 = 60;
/// Strides after which a perturbed start is judged.
pub const RETURN_STRIDES: u32 = 100;
/// Smallest accepted share of the perturbed starts that are back on the orbit, every phase included.
pub const RETURN_SHARE: f64 = 0.95;
/// Points of the orbit to which distances are measured.
const ORBIT_POINTS: usize = 400;
/// Step of these simulations, in microseconds.
pub(crate) const STEP_MICROS: u32 = 5_000;

/// A start that diverged.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Diverged {
    /// The start's number.
    pub start: u32,
    /// Its initial state in amplitudes: displacement of each joint, then velocity of each.
    pub state: Vec<f64>,
}

/// The limit cycle.
pub(crate) struct Orbit {
    /// States at equal intervals of time.
    pub(crate) points: Vec<Vec<f64>>,
    /// Period, seconds.
    pub(crate) period_s: f64,
    /// Period in steps.
    pub(crate) steps: f64,
}

impl Orbit {
    /// Distance of a state from the orbit.
    fn distance(&self, state: &[f64]) -> f64 {
        let to = |point: &Vec<f64>| point.iter().zip(state).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        self.points.iter().map(to).fold(f64::MAX, f64::min)
    }

    /// Largest absolute value of a state.
    pub(crate) fn size(&self, index: usize) -> f64 {
        self.points.iter().map(|p| p[index].abs()).fold(0.0, f64::max)
    }
}

fn steps_per(seconds: f64) -> u32 {
    (seconds * 1e6 / f64::from(STEP_MICROS)).ceil() as u32
}

/// Upward zero crossings of the first displacement within `steps` steps, in steps.
fn crossings(model: &mut dyn Model, steps: u32) -> Vec<f64> {
    let mut marks = vec![];
    let mut before = model.state()[0];
    for step in 0..steps {
        model.step();
        let now = model.state()[0];
        if before < 0.0 && now >= 0.0 {
            marks.push(f64::from(step) - before / (now - before));
        }
        before = now;
    }
    marks
}

/// The limit cycle that a model settles on; `None` if it does not oscillate. `guess_s` is the expected period, seconds.
pub(crate) fn limit_cycle(built: &dyn Model, guess_s: f64) -> Option<Orbit> {
    let mut model = built.copy();
    let stride = steps_per(guess_s);
    for _ in 0..stride * 100 {
        model.step();
    }
    let mut copy = model.copy();
    let marks = crossings(copy.as_mut(), stride * 25);
    let cycles = marks.len().checked_sub(1).filter(|&n| n >= 10)?;
    let steps = (marks[cycles] - marks[0]) / cycles as f64;
    let even = marks.windows(2).all(|w| (w[1] - w[0] - steps).abs() < 0.05 * steps);
    let mut points = vec![];
    let stride = (steps / ORBIT_POINTS as f64).max(1.0);
    let mut next = 0.0;
    for step in 0..steps.ceil() as u32 {
        if f64::from(step) >= next {
            points.push(model.state());
            next += stride;
        }
        model.step();
    }
    let orbit = Orbit { points, period_s: steps * f64::from(STEP_MICROS) * 1e-6, steps };
    let swings = (0..4).all(|joint| orbit.size(joint) > 0.05);
    (even && swings && model.sound()).then_some(orbit)
}

/// Largest displacement of each joint over one period.
fn sizes(model: &mut dyn Model, orbit: &Orbit) -> Vec<f64> {
    let mut sizes = vec![0.0f64; 4];
    for _ in 0..orbit.steps.ceil() as u32 {
        model.step();
        for (size, x) in sizes.iter_mut().zip(model.state()) {
            *size = size.max(x.abs());
        }
    }
    sizes
}

/// Whether the amplitude of each joint is between 0.5 and 1.5 times that of the orbit.
fn keeps_size(model: &mut dyn Model, orbit: &Orbit) -> bool {
    let sizes = sizes(model, orbit);
    model.sound() && sizes.iter().enumerate().all(|(joint, s)| (0.5..1.5).contains(&(s / orbit.size(joint))))
}

pub(crate) fn run(model: &mut dyn Model, steps: f64) {
    for _ in 0..steps as u32 {
        model.step();
    }
}

/// Perturbed starts near the orbit, and how they ended.
#[derive(Default)]
pub(crate) struct Perturbed {
    /// Starts that were tried.
    pub(crate) tried: u32,
    /// Those back on the orbit after [`RETURN_STRIDES`] strides.
    pub(crate) back: u32,
    /// Those that diverged.
    pub(crate) diverged: Vec<Diverged>,
}

/// Starts 100 times beside the orbit.
pub(crate) fn perturb(built: &dyn Model, orbit: &Orbit) -> Perturbed {
    let mut random = Random(8);
    let mut all = Perturbed::default();
    for start in 0..100u32 {
        let point = &orbit.points[start as usize * orbit.points.len() / 100];
        let state: Vec<f64> = point.iter().map(|x| x + random.within(0.08)).collect();
        let mut model = built.copy();
        if !model.set_state(&state) {
            continue;
        }
        all.tried += 1;
        run(model.as_mut(), orbit.steps * f64::from(RETURN_STRIDES));
        all.back += u32::from(orbit.distance(&model.state()) < 0.05);
        if !keeps_size(model.as_mut(), orbit) {
            all.diverged.push(Diverged { start, state });
        }
    }
    all
}

/// Starts at random states: how many are on the orbit after [`START_STRIDES`] strides, and how many diverged.
pub(crate) fn scatter(built: &dyn Model, orbit: &Orbit, starts: u32) -> (u32, u32) {
    let mut random = Random(1);
    let dimensions = built.state().len();
    let (mut converged, mut diverged) = (0, 0);
    for _ in 0..starts {
        let state: Vec<f64> = (0..dimensions).map(|_| random.within(START_BOX)).collect();
        let mut model = built.copy();
        if !model.set_state(&state) {
            diverged += 1;
            continue;
        }
        run(model.as_mut(), orbit.steps * f64::from(START_STRIDES));
        if orbit.distance(&model.state()) < 0.05 {
            converged += 1;
        } else if !keeps_size(model.as_mut(), orbit) {
            diverged += 1;
        }
    }
    (converged, diverged)
}

/// Seconds until a push of the first velocity is within 5 percent of the orbit and stays there; `None` if it is not within
/// [`RETURN_STRIDES`] strides.
pub(crate) fn settle(built: &dyn Model, orbit: &Orbit) -> Option<f64> {
    let mut model = built.copy();
    let mut state = orbit.points[0].clone();
    let velocity = state.len() / 2;
    *state.get_mut(velocity)? += 0.5;
    if !model.set_state(&state) {
        return None;
    }
    let steps = orbit.steps as u32 * RETURN_STRIDES;
    let mut last_outside = 0;
    for step in 0..steps {
        if orbit.distance(&model.state()) > 0.05 {
            last_outside = step + 1;
        }
        model.step();
    }
    (last_outside < steps).then_some(f64::from(last_outside) * f64::from(STEP_MICROS) * 1e-6)
}

/// Absolute values of the Floquet multipliers without the trivial one, largest first: eigenvalues of the differential of the map over one
/// period. The remaining fraction of a step is interpolated linearly.
pub(crate) fn multipliers(built: &dyn Model, orbit: &Orbit) -> Vec<f64> {
    let n = built.state().len();
    let after = |state: &[f64]| {
        let mut model = built.copy();
        model.set_state(state);
        run(model.as_mut(), orbit.steps.floor());
        let low = model.state();
        model.step();
        let part = orbit.steps.fract();
        low.iter().zip(model.state()).map(|(a, b)| a + part * (b - a)).collect::<Vec<_>>()
    };
    let size = 1e-5;
    let base = &orbit.points[0];
    let mut map = DMatrix::<f64>::zeros(n, n);
    for column in 0..n {
        let (mut plus, mut minus) = (base.clone(), base.clone());
        plus[column] += size;
        minus[column] -= size;
        for (row, (a, b)) in after(&plus).iter().zip(after(&minus)).enumerate() {
            map[(row, column)] = (a - b) / (2.0 * size);
        }
    }
    let mut values: Vec<_> = map.complex_eigenvalues().iter().copied().collect();
    // The trivial multiplier is the one nearest to 1: a difference along the orbit does not contract.
    let nearest = |a: &nalgebra::Complex<f64>| (a - nalgebra::Complex::new(1.0, 0.0)).norm();
    if let Some(trivial) = (0..values.len()).min_by(|&a, &b| nearest(&values[a]).total_cmp(&nearest(&values[b]))) {
        values.remove(trivial);
    }
    let mut sizes: Vec<f64> = values.into_iter().map(nalgebra::Complex::norm).collect();
    sizes.sort_by(|a, b| b.total_cmp(a));
    sizes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::file::{GeneratorFile, GeneratorSet};
    use crate::model::model;
    use joint_units::Period;

    /// The table of R1 at w = 2 pi/1.1: period and leading multiplier, from an independent integration.
    #[test]
    fn period_and_contraction_of_r1_are_those_of_the_table() {
        for (nonlinearity, coupling, period_s, multiplier) in [
            (0.2, 0.1, 1.102_732_28, 0.531),
            (0.2, 0.2, 1.102_703_34, 0.288),
            (0.5, 0.2, 1.116_638_80, 0.268),
            (0.5, 0.5, 1.115_436_42, 0.054),
            (1.0, 0.5, 1.157_577_24, 0.024),
        ] {
            let GeneratorSet::PhaseCoupled(mut set) = GeneratorFile::default_of("phase-coupled").unwrap().set else {
                panic!("R1")
            };
            (set.natural_period_s, set.nonlinearity, set.coupling) = (1.1, nonlinearity, [coupling; 4]);
            let step = Period::from_micros(STEP_MICROS).unwrap();
            let model = model(&GeneratorSet::PhaseCoupled(set), step).unwrap().unwrap();
            let orbit = limit_cycle(model.as_ref(), 1.1).unwrap();
            assert!((orbit.period_s - period_s).abs() < 3e-6, "{nonlinearity}, {coupling}: {}", orbit.period_s);
            let found = multipliers(model.as_ref(), &orbit)[0];
            assert!((found - multiplier).abs() < 1.5e-3, "{nonlinearity}, {coupling}: {found}");
        }
    }
}
