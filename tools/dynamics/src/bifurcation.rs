//! Bifurcations along one parameter: a sweep up and a sweep down, and the values at which oscillation begins and ends.
//!
//! Each value starts from where the one before ended. An equilibrium is moved by [`PUSH`] of the scale, so that one that repels is left. An oscillation
//! goes on as it is, since near a fold of cycles a push would end it; it is moved afterwards, and where it then goes on in another way, it is that.
//!
//! Where a sweep passes from rest to oscillation, the value is bisected from the rest on the near side. Where oscillation ends, it is continued towards
//! the value with steps that are halved each time that it does not survive one: a fold is approached, never jumped. Where the two sweeps differ, both
//! motions attract (hysteresis).
//!
//! A motion is slow near an onset, and what counts as settled there decides where the onset is found. So it is found four times: from the value before
//! and from the one before that, each with the times and steps of a sweep and with more care: four times the windows, a quarter of the change that
//! counts as settled, half of the step of the integration. The value is that of the smaller step with more care, and `within` is how far the others
//! are from it, and the last step.

use generator_file::model::Model;
use rayon::prelude::*;

use crate::settle::{Motion, settle_with_care};
use crate::system::System;

/// By how much an equilibrium is moved at each value, in parts of the scale.
pub const PUSH: f64 = 1e-3;
/// Halvings of the interval of an onset.
const HALVINGS: i32 = 14;
/// Steps towards the end of an oscillation, at most.
const MOST_STEPS: usize = 100;
/// How carefully an onset is judged, see the module; the last is the one that counts.
const CARES: [u32; 2] = [1, 4];

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
    /// How far it may be off: the largest distance of the other estimates, and the last step of the search.
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
    let along = Along { system, parameter };
    let mut sweep = Sweep::default();
    // Where the motion of each value ended; none if it left.
    let mut ends: Vec<Option<Vec<f64>>> = vec![];
    for &value in values {
        let (point, end) = match (sweep.points.last(), ends.last().and_then(Option::as_deref)) {
            (Some(before), Some(state)) => along.next(before, state, value)?,
            // The first value, and after one that has left.
            _ => along.at(value, None, 1)?,
        };
        if let Some(before) = sweep.points.last()
            && before.motion.oscillates() != point.motion.oscillates()
        {
            let known = sweep.points.iter().zip(&ends).rev();
            let alike = known.take_while(|(one, _)| one.motion.oscillates() == before.motion.oscillates());
            let near: Vec<(f64, &[f64])> =
                alike.take(2).filter_map(|(one, end)| Some((one.value, end.as_deref()?))).collect();
            sweep.onsets.extend(along.onset(&near, value, before.motion.oscillates())?);
        }
        sweep.points.push(point);
        ends.push(end);
        done();
    }
    Ok(sweep)
}

/// A motion, and its last state if it did not leave.
type Settled = (Point, Option<Vec<f64>>);

/// A system along one of its parameters.
struct Along<'a> {
    system: &'a System,
    parameter: &'a str,
}

/// A state to start from.
#[derive(Clone, Copy)]
struct Start<'a> {
    state: &'a [f64],
    /// By how much it is moved, in parts of the scale.
    push: f64,
}

impl Along<'_> {
    /// The motion at a value.
    fn at(&self, value: f64, start: Option<Start<'_>>, care: u32) -> Result<Settled, String> {
        let system = self.system.with(self.parameter, value)?;
        let (mut model, step) = system.model_in_parts(if care > 1 { 2 } else { 1 })?;
        let scale = system.scale()?;
        if let Some(Start { state, push: by }) = start {
            model.set_state(state);
            push(model.as_mut(), &scale, by);
        }
        let motion = settle_with_care(model.as_mut(), &scale, system.cycle() / step, care);
        let end = (motion != Motion::Leaves).then(|| model.state());
        Ok((Point { value, motion, step }, end))
    }

    /// The motion at a value from the state at the end of the value before.
    fn next(&self, before: &Point, state: &[f64], value: f64) -> Result<Settled, String> {
        if !before.motion.oscillates() {
            return self.at(value, Some(Start { state, push: PUSH }), 1);
        }
        let mut going = self.at(value, Some(Start { state, push: 0.0 }), 1)?;
        if !going.0.motion.oscillates() {
            // The step may be too long for it.
            let (reached, end) = self.continued((before.value, state), value, 1)?;
            if reached != value {
                return Ok(going);
            }
            going = self.at(value, Some(Start { state: &end, push: 0.0 }), 1)?;
        }
        let Some(end) = &going.1 else { return Ok(going) };
        let pushed = self.at(value, Some(Start { state: end, push: PUSH }), 1)?;
        Ok(if pushed.0.motion.oscillates() { pushed } else { going })
    }

    /// How far an oscillation lives on from a value and a state towards another value, and its state there.
    fn continued(&self, near: (f64, &[f64]), far: f64, care: u32) -> Result<(f64, Vec<f64>), String> {
        let (mut value, mut state) = (near.0, near.1.to_vec());
        let least = (far - value).abs() * 0.5f64.powi(HALVINGS);
        let mut step = 0.5 * (far - value);
        for _ in 0..MOST_STEPS {
            let left = far - value;
            let next = if step.abs() < left.abs() { value + step } else { far };
            match self.at(next, Some(Start { state: &state, push: 0.0 }), care)? {
                (point, Some(end)) if point.motion.oscillates() => (value, state) = (next, end),
                _ => step *= 0.5,
            }
            if value == far || step.abs() < least {
                break;
            }
        }
        Ok((value, state))
    }

    /// The value between `near` and `far` at which oscillation begins, by bisection.
    fn begins(&self, near: (f64, &[f64]), far: f64, care: u32) -> Result<f64, String> {
        let (mut rests, mut oscillates) = (near.0, far);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (rests + oscillates);
            let start = Start { state: near.1, push: PUSH / f64::from(care) };
            let (point, _) = self.at(middle, Some(start), care)?;
            if point.motion.oscillates() { oscillates = middle } else { rests = middle }
        }
        Ok(0.5 * (rests + oscillates))
    }

    /// The onset before `far`, from the values `near` with their states, the nearest first; none if there are none.
    fn onset(&self, near: &[(f64, &[f64])], far: f64, oscillated: bool) -> Result<Option<Onset>, String> {
        let Some(nearest) = near.first() else { return Ok(None) };
        let tries: Vec<((f64, &[f64]), u32)> = near.iter().flat_map(|&near| CARES.map(|care| (near, care))).collect();
        let found: Result<Vec<f64>, String> = tries
            .par_iter()
            .map(|&(near, care)| match oscillated {
                true => Ok(self.continued(near, far, care)?.0),
                false => self.begins(near, far, care),
            })
            .collect();
        let found = found?;
        // The careful one from the nearest value.
        let value = found[CARES.len() - 1];
        let spread = found.iter().map(|other| (other - value).abs()).fold(0.0, f64::max);
        let within = spread + (far - nearest.0).abs() * 0.5f64.powi(HALVINGS);
        Ok(Some(Onset { value, within, begins: !oscillated }))
    }
}

/// Moves every state by another part of its scale, so that no symmetry is kept.
fn push(model: &mut dyn Model, scale: &[f64], by: f64) {
    let parts = [1.0, -0.7, 0.5, -0.3];
    for (index, scale) in scale.iter().enumerate().filter(|_| by != 0.0) {
        model.kick(index, by * scale * parts[index % parts.len()]);
    }
}
