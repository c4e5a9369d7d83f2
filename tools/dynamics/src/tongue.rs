//! Arnold tongues: which periodic inputs lock a limit cycle, n of its cycles to m of the input.
//!
//! The input acts on one state, `x' = ... + A cos(2 pi F t)`. It is applied as kicks between the steps of the integration, half a kick before the first
//! step, so that its error falls with the square of the step. A *ratio* is F divided by the model's own frequency; a *strength* is A divided by the
//! amplitude of the state and by 2 pi times the own frequency: at strength 1 the input alone would move the state by its amplitude.
//!
//! The winding number is the mean number of cycles to one of the input, from the upward crossings of one state's middle. After [`SETTLE`] cycles of
//! the input, a window of [`WATCH`] is watched. The model has **locked** n:m if, at every n-th crossing, or at every k n-th one with k up to
//! [`MOST_REPEAT`] for a motion whose period has doubled, the phase against n/m of the input stays within [`SLIP`] of a cycle over the window: the winding
//! number is n/m within `SLIP / WATCH`. It has **slipped** if the phase has changed by a whole
//! cycle. Otherwise it is watched again, twice as long each time, up to [`LONGEST`] cycles, and is then **undecided**.

use generator_file::model::Model;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use std::f64::consts::TAU;

use crate::cycle::Cycle;
use crate::settle::Crossings;

/// Cycles of the input before the first window.
pub const SETTLE: f64 = 20.0;
/// Cycles of the input in the first window.
pub const WATCH: f64 = 40.0;
/// Cycles of the input in the longest window.
pub const LONGEST: f64 = 640.0;
/// Cycles of the input after which a window ends early if the phase has changed by a whole cycle.
const LOOK: f64 = 10.0;
/// The state whose crossings are counted: the first one moves in every system.
const WATCHED: usize = 0;
/// Largest change of the phase in a window of a lock, in cycles.
pub const SLIP: f64 = 0.02;
/// Most repetitions of n:m after which a locked motion repeats.
pub const MOST_REPEAT: usize = 4;
/// Part of the range by which the watched state must come back before the next crossing counts.
const HYSTERESIS: f64 = 0.2;

/// A periodic input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Input {
    /// The state on which it acts.
    pub variable: usize,
    /// Frequency divided by the model's own.
    pub ratio: f64,
    /// Amplitude, see the [module](self).
    pub strength: f64,
}

impl Input {
    /// Its amplitude A, in the unit of the state per unit of time.
    #[must_use]
    pub fn force(&self, cycle: &Cycle) -> f64 {
        self.strength * unit_force(cycle, self.variable)
    }
}

/// The amplitude A of strength 1.
#[must_use]
pub fn unit_force(cycle: &Cycle, variable: usize) -> f64 {
    cycle.orbit.amplitude[variable] * TAU / cycle.period()
}

/// What is known of one input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Verdict {
    /// It locks n of the model's cycles to m of the input: the index of the pair in the list.
    Locked(usize),
    /// It locks none of the pairs.
    Slips,
    /// Neither within the longest window.
    Undecided,
    /// A state reached its bound.
    Leaves,
}

/// One cell of the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// The input.
    pub input: Input,
    /// Mean number of cycles to one of the input; NaN if there were too few.
    pub winding: f64,
    /// What is known.
    pub verdict: Verdict,
}

/// n cycles of the model to m of the input.
pub type Pair = (u32, u32);

/// The cells of a grid, row by row of rising strength. `done` is called after each cell, on any thread.
pub fn map(
    cycle: &Cycle,
    variable: usize,
    ratios: &[f64],
    strengths: &[f64],
    pairs: &[Pair],
    done: &(impl Fn() + Sync),
) -> Vec<Cell> {
    let start = cycle.at_start();
    (0..ratios.len() * strengths.len())
        .into_par_iter()
        .map(|index| {
            let (ratio, strength) = (ratios[index % ratios.len()], strengths[index / ratios.len()]);
            let cell = cell(cycle, start.copy(), Input { variable, ratio, strength }, pairs);
            done();
            cell
        })
        .collect()
}

/// Runs the model with one input, from a start on the orbit.
#[must_use]
pub fn cell(cycle: &Cycle, start: Box<dyn Model>, input: Input, pairs: &[Pair]) -> Cell {
    let mut run = Run::new(cycle, start, input);
    let mut winding = f64::NAN;
    let verdict = run.verdict(pairs, &mut winding).unwrap_or(Verdict::Leaves);
    Cell { input, winding, verdict }
}

/// The phase against n/m of the input, over a window.
struct Drift {
    /// Change from the first crossing to the last, in cycles.
    total: f64,
    /// Largest difference between two crossings that are a whole number of repetitions apart.
    range: f64,
}

impl Drift {
    fn of(marks: &[f64], (n, m): Pair) -> Self {
        let ratio = f64::from(n) / f64::from(m);
        let phases: Vec<f64> = marks.iter().enumerate().map(|(index, mark)| index as f64 - ratio * mark).collect();
        let (Some(first), Some(last)) = (phases.first(), phases.last()) else {
            return Self { total: 0.0, range: f64::INFINITY };
        };
        let range = |repeat: usize| {
            let every = || phases.iter().step_by(n as usize * repeat).copied();
            // Two repetitions at least have to be compared.
            if every().count() < 3 {
                f64::INFINITY
            } else {
                every().fold(f64::MIN, f64::max) - every().fold(f64::MAX, f64::min)
            }
        };
        Self { total: last - first, range: (1..=MOST_REPEAT).map(range).fold(f64::INFINITY, f64::min) }
    }
}

/// A model with an input.
struct Run {
    model: Box<dyn Model>,
    input: Input,
    /// Kick of a whole step at the input's maximum.
    kick: f64,
    /// Cycles of the input a step.
    rate: f64,
    step: u64,
    counter: Crossings,
}

impl Run {
    fn new(cycle: &Cycle, model: Box<dyn Model>, input: Input) -> Self {
        let orbit = &cycle.orbit;
        let counter = Crossings::new(orbit.middle[WATCHED], HYSTERESIS * orbit.amplitude[WATCHED]);
        let kick = input.force(cycle) * cycle.step;
        let mut run = Self { model, input, kick, rate: input.ratio / orbit.steps, step: 0, counter };
        run.model.kick(input.variable, 0.5 * run.kick);
        run
    }

    /// What is known after as many windows as it takes; none if a state reaches its bound.
    fn verdict(&mut self, pairs: &[Pair], winding: &mut f64) -> Option<Verdict> {
        self.watch(SETTLE)?;
        let mut length = WATCH;
        while length <= LONGEST {
            let (mut marks, mut watched) = (vec![], 0.0);
            while watched < length {
                marks.extend(self.watch(LOOK)?);
                watched += LOOK;
                if let (Some(first), Some(last), true) = (marks.first(), marks.last(), marks.len() > 2) {
                    *winding = (marks.len() - 1) as f64 / (last - first);
                    if pairs.iter().all(|&pair| Drift::of(&marks, pair).total.abs() >= 1.0) {
                        return Some(Verdict::Slips);
                    }
                }
            }
            if let Some(index) = pairs.iter().position(|&pair| Drift::of(&marks, pair).range < SLIP) {
                return Some(Verdict::Locked(index));
            }
            length *= 2.0;
        }
        Some(Verdict::Undecided)
    }

    /// Runs for some cycles of the input. Returns the times of the crossings, in cycles of the input; none if a state reaches its bound.
    fn watch(&mut self, cycles: f64) -> Option<Vec<f64>> {
        let steps = (cycles / self.rate).ceil() as u64;
        let mut marks = vec![];
        for _ in 0..steps {
            // The state in the middle of a kick is that of the motion without kicks.
            if let Some(at) = self.counter.next(self.model.value(WATCHED)) {
                marks.push(at * self.rate);
            }
            if !self.model.advance(1) {
                return None;
            }
            self.step += 1;
            let phase = (self.step as f64 * self.rate).fract();
            self.model.kick(self.input.variable, self.kick * (TAU * phase).cos());
        }
        Some(marks)
    }
}
