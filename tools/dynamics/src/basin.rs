//! Basins of attraction: which attractor each start of a grid reaches.
//!
//! Two states vary over the grid, the others have given values. A start that comes within [`NEAR`] of the system's own cycle is on it; every other one is
//! followed by [`settle`]. Ends that are equal within [`SAME`] of the scale, and in period, are one attractor.

use generator_file::model::Model;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

use crate::cycle::Cycle;
use crate::settle::{Motion, settle};
use crate::system::System;

/// Largest difference of two ends of one attractor, in parts of the scale; of two periods, relative.
pub const SAME: f64 = 0.05;

/// Distance from the system's own cycle of a start that is on it, in amplitudes.
pub const NEAR: f64 = 0.01;
/// Cycles after which the distance is compared, and how often.
const COMPARED: (f64, usize) = (2.0, 10);

/// Values of one state of the grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Index of the state.
    pub variable: usize,
    /// Its values.
    pub values: Vec<f64>,
}

/// The map of a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    /// What is reached, in the order of the number of starts, most first.
    pub attractors: Vec<Motion>,
    /// Index of the attractor of each start, row by row of the second axis.
    pub cells: Vec<usize>,
    /// Time of a step.
    pub step: f64,
}

/// Follows every start of a grid. `others` has a value of each state; those of the axes are replaced. `done` is called after each start, on any thread.
///
/// # Errors
/// The system cannot be built; the text says why.
pub fn map(system: &System, axes: &[Axis; 2], others: &[f64], done: &(impl Fn() + Sync)) -> Result<Map, String> {
    let (model, step) = system.model()?;
    let (scale, cycle) = (system.scale()?, system.cycle() / step);
    let own = Own::of(system, &scale);
    let [x, y] = axes;
    let width = x.values.len();
    let ends: Vec<Motion> = (0..width * y.values.len())
        .into_par_iter()
        .map(|index| {
            let mut start = others.to_vec();
            start[x.variable] = x.values[index % width];
            start[y.variable] = y.values[index / width];
            let mut model = model.copy();
            model.set_state(&start);
            let end = own
                .as_ref()
                .and_then(|own| own.reached(model.as_mut(), cycle))
                .unwrap_or_else(|| settle(model.as_mut(), &scale, cycle));
            done();
            end
        })
        .collect();
    let (mut attractors, mut cells): (Vec<Motion>, Vec<usize>) = (vec![], vec![]);
    for end in ends {
        let known = attractors.iter().position(|known| is_same(known, &end, &scale));
        cells.push(known.unwrap_or(attractors.len()));
        if known.is_none() {
            attractors.push(end);
        }
    }
    let count = |index: usize| cells.iter().filter(|&&cell| cell == index).count();
    let mut order: Vec<usize> = (0..attractors.len()).collect();
    order.sort_by_key(|&index| std::cmp::Reverse(count(index)));
    let place = |index: usize| order.iter().position(|&of| of == index).unwrap_or(0);
    Ok(Map {
        cells: cells.iter().map(|&index| place(index)).collect(),
        attractors: order.iter().map(|&index| attractors[index].clone()).collect(),
        step,
    })
}

/// The cycle that the system settles on from its own start.
struct Own {
    cycle: Cycle,
    motion: Motion,
}

impl Own {
    fn of(system: &System, scale: &[f64]) -> Option<Self> {
        let cycle = Cycle::of(system).ok()?;
        // At the step of the map.
        let (mut model, step) = system.model().ok()?;
        model.set_state(&cycle.at_start().state());
        let motion = settle(model.as_mut(), scale, system.cycle() / step);
        Some(Self { cycle, motion })
    }

    /// The motion, if the model comes near the cycle.
    fn reached(&self, model: &mut dyn Model, cycle: f64) -> Option<Motion> {
        let (cycles, times) = COMPARED;
        for _ in 0..times {
            if !model.advance((cycles * cycle).ceil() as usize) {
                return Some(Motion::Leaves);
            }
            if self.cycle.orbit.distance(&model.state()) < NEAR {
                return Some(self.motion.clone());
            }
        }
        None
    }
}

fn is_same(a: &Motion, b: &Motion, scale: &[f64]) -> bool {
    let near = |a: &[f64], b: &[f64]| a.iter().zip(b).zip(scale).all(|((a, b), scale)| (a - b).abs() < SAME * scale);
    match (a, b) {
        (Motion::Rest { at: a }, Motion::Rest { at: b }) => near(a, b),
        (Motion::Cycle(a), Motion::Cycle(b)) => {
            (a.steps / b.steps - 1.0).abs() < SAME
                && near(&a.least, &b.least)
                && near(&a.most, &b.most)
                && near(&a.at_crossing, &b.at_crossing)
        }
        (Motion::Irregular(_), Motion::Irregular(_))
        | (Motion::Leaves, Motion::Leaves)
        | (Motion::Undecided, Motion::Undecided) => true,
        _ => false,
    }
}
