//! Bifurcations along one parameter: a sweep up and a sweep down, and the values at which oscillation begins and ends.
//!
//! Each value starts from where the one before ended, moved by [`PUSH`] of the scale, so that an equilibrium that repels is left. Where a
//! sweep passes from rest to oscillation or back, the value is bisected from the state on the near side. Where the two sweeps
//! differ, both motions attract (hysteresis).

use generator_file::model::Model;

use crate::settle::{Motion, settle};
use crate::system::System;

/// By how much the states are moved at each value, in parts of the scale.
pub const PUSH: f64 = 1e-3;
/// Halvings of the interval of an onset.
const HALVINGS: usize = 14;

/// The motion at one value.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Value of the parameter.
    pub value: f64,
    /// The motion; periods in steps.
    pub motion: Motion,
    /// Time of a step.
    pub step: f64,
}

impl Point {
    /// Smallest and largest value of a state; equal at rest, none if it leaves or is undecided.
    #[must_use]
    pub fn extrema(&self, variable: usize) -> Option<[f64; 2]> {
        match &self.motion {
            Motion::Rest { at } => Some([at[variable]; 2]),
            Motion::Cycle(extent) | Motion::Irregular(extent) => Some([extent.least[variable], extent.most[variable]]),
            Motion::Leaves | Motion::Undecided => None,
        }
    }

    /// Period, in the system's unit of time; none unless it repeats.
    #[must_use]
    pub fn period(&self) -> Option<f64> {
        match &self.motion {
            Motion::Cycle(extent) => Some(extent.steps * self.step),
            _ => None,
        }
    }
}

/// Where oscillation begins or ends on a sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Onset {
    /// Value of the parameter.
    pub value: f64,
    /// How far the last value without and the first with oscillation are apart.
    pub within: f64,
    /// Whether oscillation begins there on this sweep, else it ends.
    pub begins: bool,
}

/// A sweep in one direction.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sweep {
    /// The motion at each value, in the order of the sweep.
    pub points: Vec<Point>,
    /// Onsets, in the order of the sweep.
    pub onsets: Vec<Onset>,
}

/// Sweeps a parameter through the values and back. `done` is called after each value, on any thread.
///
/// # Errors
/// No such parameter, or a value that is not allowed; the text says what is.
pub fn sweep(
    system: &System,
    parameter: &str,
    values: &[f64],
    done: &(impl Fn() + Sync),
) -> Result<[Sweep; 2], String> {
    // Before any work.
    values.iter().try_for_each(|&value| system.with(parameter, value).map(drop))?;
    let back: Vec<f64> = values.iter().rev().copied().collect();
    let one = |values: &[f64]| one_way(system, parameter, values, done);
    let (up, down) = rayon::join(|| one(values), || one(&back));
    Ok([up?, down?])
}

fn one_way(system: &System, parameter: &str, values: &[f64], done: &(impl Fn() + Sync)) -> Result<Sweep, String> {
    let mut sweep = Sweep::default();
    let mut state: Option<Vec<f64>> = None;
    for &value in values {
        let (point, end) = at(system, parameter, value, state.as_deref())?;
        if let (Some(before), Some(state)) = (sweep.points.last(), &state)
            && before.motion.oscillates() != point.motion.oscillates()
        {
            sweep.onsets.push(bisect(system, parameter, before, value, state)?);
        }
        sweep.points.push(point);
        // One that has left begins at the start of the next value.
        state = end;
        done();
    }
    Ok(sweep)
}

/// The motion at a value from a state, and the state at its end.
fn at(
    system: &System,
    parameter: &str,
    value: f64,
    state: Option<&[f64]>,
) -> Result<(Point, Option<Vec<f64>>), String> {
    let system = system.with(parameter, value)?;
    let (mut model, step) = system.model()?;
    let scale = system.scale()?;
    if let Some(state) = state {
        model.set_state(state);
        push(model.as_mut(), &scale);
    }
    let motion = settle(model.as_mut(), &scale, system.cycle() / step);
    let end = (motion != Motion::Leaves).then(|| model.state());
    Ok((Point { value, motion, step }, end))
}

/// Moves every state by another part of its scale, so that no symmetry is kept.
fn push(model: &mut dyn Model, scale: &[f64]) {
    let parts = [1.0, -0.7, 0.5, -0.3];
    for (index, scale) in scale.iter().enumerate() {
        model.kick(index, PUSH * scale * parts[index % parts.len()]);
    }
}

/// The value between `near`, at whose end is `state`, and `far` at which the motion changes.
fn bisect(system: &System, parameter: &str, near: &Point, far: f64, state: &[f64]) -> Result<Onset, String> {
    let (mut near_value, mut far_value) = (near.value, far);
    let oscillated = near.motion.oscillates();
    for _ in 0..HALVINGS {
        let middle = 0.5 * (near_value + far_value);
        let (point, _) = at(system, parameter, middle, Some(state))?;
        if point.motion.oscillates() == oscillated { near_value = middle } else { far_value = middle }
    }
    let value = 0.5 * (near_value + far_value);
    Ok(Onset { value, within: (far_value - near_value).abs(), begins: !oscillated })
}
