//! Follows a model until it rests, repeats or leaves, and says which.
//!
//! The motion is watched window by window. A window is a few cycles; it is made longer if less than four cycles are in it. The model
//!
//! - **rests** if its range falls below [`STILL`], or falls from window to window until it is below [`SMALL`],
//! - has **settled on a cycle** if its range is the same in three windows, within [`SAME`] of it, and at least [`SMALL`]: periodic if the times of up to eight
//!   cycles repeat, else irregular,
//! - **leaves** if a state reaches its bound or is not a number.
//!
//! Near an onset of oscillation the range changes slowly. After [`MOST_WINDOWS`] a motion whose range falls counts as rest; one whose range rises is
//! followed for four times as long, and is then an oscillation, whatever its range. One that does neither is undecided.

use generator_file::model::Model;

/// Range, in parts of the scale, below which a model rests.
pub const STILL: f64 = 1e-6;
/// Range, in parts of the scale, below which a decreasing motion counts as rest.
pub const SMALL: f64 = 0.01;
/// Largest change of the range from window to window of a motion that has settled, in parts of the range, or of the scale if that is less.
pub const SAME: f64 = 1e-3;
/// Cycles of a window.
pub const WINDOW_CYCLES: f64 = 6.0;
/// Most windows of a motion that does not grow.
pub const MOST_WINDOWS: usize = 60;
/// Most cycles after which a motion repeats.
const MOST_REPEAT: usize = 8;
/// Largest relative change of a period that repeats.
const STEADY: f64 = 2e-3;
/// Part of the range by which a state must come back before the next crossing counts.
const HYSTERESIS: f64 = 0.1;

/// Where a model ends.
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// At an equilibrium.
    Rest {
        /// Its states.
        at: Vec<f64>,
    },
    /// On a limit cycle.
    Cycle(Extent),
    /// It oscillates, but does not repeat within eight cycles.
    Irregular(Extent),
    /// A state reached its bound or is not a number.
    Leaves,
    /// Neither within the time.
    Undecided,
}

/// The extent of an oscillation.
#[derive(Debug, Clone, PartialEq)]
pub struct Extent {
    /// Period in steps, until the motion repeats; of an irregular one the mean time of a cycle.
    pub steps: f64,
    /// Smallest value of each state.
    pub least: Vec<f64>,
    /// Largest value of each state.
    pub most: Vec<f64>,
    /// The states where the first state that moves rises through the middle of its range: two cycles of equal extent in which the states take turns in
    /// another order differ here.
    pub at_crossing: Vec<f64>,
}

impl Motion {
    /// Whether it oscillates.
    #[must_use]
    pub fn oscillates(&self) -> bool {
        matches!(self, Self::Cycle(_) | Self::Irregular(_))
    }

    /// What it is, in a word.
    #[must_use]
    pub fn word(&self) -> &'static str {
        match self {
            Self::Rest { .. } => "rest",
            Self::Cycle(_) => "cycle",
            Self::Irregular(_) => "irregular",
            Self::Leaves => "leaves",
            Self::Undecided => "undecided",
        }
    }
}

/// Every state of a window.
struct Window {
    states: Vec<Vec<f64>>,
    least: Vec<f64>,
    most: Vec<f64>,
}

impl Window {
    /// Follows the model; none if it leaves.
    fn of(model: &mut dyn Model, steps: usize) -> Option<Self> {
        let first = model.state();
        let mut window = Self { least: first.clone(), most: first.clone(), states: Vec::with_capacity(steps + 1) };
        window.states.push(first);
        for _ in 0..steps {
            if !model.advance(1) {
                return None;
            }
            let state = model.state();
            for ((least, most), value) in window.least.iter_mut().zip(&mut window.most).zip(&state) {
                (*least, *most) = (least.min(*value), most.max(*value));
            }
            window.states.push(state);
        }
        Some(window)
    }

    /// Largest range of a state, in parts of the scale.
    fn range(&self, scale: &[f64]) -> f64 {
        let ranges = self.least.iter().zip(&self.most).zip(scale).map(|((least, most), scale)| (most - least) / scale);
        ranges.fold(0.0, f64::max)
    }

    /// Largest change of an end of a range since the window before, in parts of the scale.
    fn change(&self, before: &Self, scale: &[f64]) -> f64 {
        let ends =
            |a: &[f64], b: &[f64]| a.iter().zip(b).zip(scale).map(|((a, b), s)| (a - b).abs() / s).fold(0.0, f64::max);
        ends(&self.least, &before.least).max(ends(&self.most, &before.most))
    }

    /// The first state that moves by at least half of the largest range.
    fn moving(&self, scale: &[f64]) -> usize {
        let most = self.range(scale);
        (0..scale.len()).find(|&i| self.most[i] - self.least[i] >= 0.5 * most * scale[i]).unwrap_or(0)
    }

    /// Upward crossings of the middle of a state's range, in steps.
    fn crossings(&self, index: usize) -> Vec<f64> {
        let middle = 0.5 * (self.least[index] + self.most[index]);
        let mut counter = Crossings::new(middle, HYSTERESIS * (self.most[index] - self.least[index]));
        self.states.iter().filter_map(|state| counter.next(state[index])).collect()
    }

    fn extent(&self, marks: &[f64], repeat: usize, steady: bool) -> Motion {
        let cycles = marks.len() - 1;
        let mean = (marks[cycles] - marks[0]) / cycles as f64;
        let crossing = marks[cycles];
        let place = (crossing as usize).min(self.states.len() - 2);
        let part = crossing - place as f64;
        let at_crossing =
            self.states[place].iter().zip(&self.states[place + 1]).map(|(a, b)| a + part * (b - a)).collect();
        let steps = if steady { marks[cycles] - marks[cycles - repeat] } else { mean };
        let extent = Extent { steps, least: self.least.clone(), most: self.most.clone(), at_crossing };
        if steady { Motion::Cycle(extent) } else { Motion::Irregular(extent) }
    }

    /// The motion of a window whose range no longer changes; none if there are too few cycles.
    fn motion(&self, scale: &[f64]) -> Option<Motion> {
        let index = self.moving(scale);
        let marks = self.crossings(index);
        if marks.len() < 4 {
            return None;
        }
        let cycles = marks.len() - 1;
        let repeats = |count: usize| {
            let mut sums = marks.windows(count + 1).map(|marks| marks[count] - marks[0]);
            let Some(first) = sums.next() else { return false };
            sums.all(|sum| (sum / first - 1.0).abs() < STEADY)
        };
        let repeat = (1..=MOST_REPEAT.min(cycles / 2)).find(|&count| repeats(count));
        Some(self.extent(&marks, repeat.unwrap_or(1), repeat.is_some()))
    }
}

/// Finds upward crossings of a level, one value a step.
#[derive(Debug, Clone)]
pub struct Crossings {
    level: f64,
    hysteresis: f64,
    before: Option<f64>,
    is_below: bool,
    step: f64,
}

impl Crossings {
    /// Crossings of `level`; between two of them the value must be below the level by `hysteresis`.
    #[must_use]
    pub fn new(level: f64, hysteresis: f64) -> Self {
        Self { level, hysteresis, before: None, is_below: false, step: -1.0 }
    }

    /// The next value. A crossing between the last value and this one is returned as its time in steps, from 0 at the first value.
    pub fn next(&mut self, value: f64) -> Option<f64> {
        self.step += 1.0;
        let before = self.before.replace(value)?;
        let (low, high) = (before - self.level, value - self.level);
        self.is_below |= low < -self.hysteresis;
        if self.is_below && low < 0.0 && high >= 0.0 {
            self.is_below = false;
            return Some(self.step - 1.0 + low / (low - high));
        }
        None
    }
}

/// Follows the model from its state until it is known where it ends. `scale` is about half the range of each state on a cycle, `cycle` about its length in
/// steps. The model is left at the last state.
#[must_use]
pub fn settle(model: &mut dyn Model, scale: &[f64], cycle: f64) -> Motion {
    settle_with_care(model, scale, cycle, 1)
}

/// The same with `care` times as many windows, and an allowed change from window to window of a part of it.
#[must_use]
pub fn settle_with_care(model: &mut dyn Model, scale: &[f64], cycle: f64, care: u32) -> Motion {
    let (most_windows, allowed) = (MOST_WINDOWS * care as usize, SAME / f64::from(care));
    let mut steps = (WINDOW_CYCLES * cycle).ceil().max(8.0) as usize;
    let longest = 64 * steps;
    let mut before: Option<Window> = None;
    let (mut same, mut falling) = (0, 0);
    let mut ratio = 1.0;
    for index in 0..4 * most_windows {
        if index >= most_windows && ratio < 1.0 + allowed {
            break;
        }
        let Some(window) = Window::of(model, steps) else { return Motion::Leaves };
        let range = window.range(scale);
        if !range.is_finite() {
            return Motion::Leaves;
        }
        if range < STILL {
            return Motion::Rest { at: model.state() };
        }
        if let Some(before) = &before {
            ratio = range / before.range(scale);
            falling = if ratio < 0.9 { falling + 1 } else { 0 };
            same = if window.change(before, scale) < allowed * range.min(1.0) && range >= SMALL { same + 1 } else { 0 };
        }
        if falling >= 3 && range < SMALL {
            return Motion::Rest { at: model.state() };
        }
        if same >= 2 {
            match window.motion(scale) {
                Some(motion) => return motion,
                None if 2 * steps <= longest => {
                    // Too few cycles, or a slow drift: a longer window.
                    steps *= 2;
                    (before, same, falling) = (None, 0, 0);
                    continue;
                }
                None => return Motion::Undecided,
            }
        }
        before = Some(window);
    }
    let last = before.as_ref().and_then(|window| window.motion(scale));
    match last {
        _ if ratio < 1.0 - allowed => Motion::Rest { at: model.state() },
        Some(motion) => motion,
        None => Motion::Undecided,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::oscillator::Oscillator;

    fn settled(oscillator: &Oscillator, start: &[f64]) -> (Motion, f64) {
        let step = oscillator.step();
        let mut model = oscillator.model(step).unwrap();
        model.set_state(start);
        (settle(model.as_mut(), &oscillator.scale(), oscillator.cycle() / step), step)
    }

    /// The periods and ranges of an independent integrator of high order.
    #[test]
    fn cycles_have_the_period_and_range_of_another_integrator() {
        for (name, parameters, period, index, least, most) in [
            ("van-der-pol", vec![("mu", 1.0)], 6.663_286_9, 0, -2.008_62, 2.008_62),
            ("van-der-pol", vec![("mu", 5.0)], 11.612_230_7, 0, -2.021_508, 2.021_508),
            ("fitzhugh-nagumo", vec![("current", 0.5)], 39.474_415, 0, -1.970_407, 1.852_117),
            ("fitzhugh-nagumo", vec![("current", 1.0)], 36.698_794_4, 0, f64::NAN, f64::NAN),
            ("morris-lecar", vec![("current", 100.0)], 85.290_641, 0, -50.336_069, 33.325_804),
            ("morris-lecar", vec![("current", 150.0)], 66.161_752_7, 0, f64::NAN, f64::NAN),
            ("terman-wang", vec![("current", 0.8)], 125.313_327_4, 0, -2.031_248, 1.983_731),
            ("terman-wang", vec![("current", 0.2)], 190.943_621_9, 0, f64::NAN, f64::NAN),
            ("matsuoka", vec![("weight", 2.5)], 29.581_81, 0, f64::NAN, 0.612_69),
            ("matsuoka", vec![("weight", 1.5)], 17.576_52, 0, f64::NAN, 0.513_40),
            ("hopf", vec![], 1.0, 0, -1.0, 1.0),
            ("rayleigh", vec![("mu", 0.2), ("alpha", 1.0), ("p", 1.0)], 58.061_15, 0, f64::NAN, f64::NAN),
        ] {
            let mut oscillator = Oscillator::named(name).unwrap();
            for (parameter, value) in parameters {
                oscillator = oscillator.with(parameter, value).unwrap();
            }
            let (motion, step) = settled(&oscillator, oscillator.kind.start);
            let Motion::Cycle(extent) = motion else { panic!("{name}: {motion:?}") };
            assert!((extent.steps * step / period - 1.0).abs() < 1e-3, "{name}: {}", extent.steps * step);
            for (found, known) in [(extent.least[index], least), (extent.most[index], most)] {
                assert!(known.is_nan() || (found / known - 1.0).abs() < 2e-3, "{name}: {found}, {known}");
            }
        }
    }

    #[test]
    fn rest_and_escape_differ() {
        let silent = Oscillator::named("fitzhugh-nagumo").unwrap().with("current", 0.2).unwrap();
        let (motion, _) = settled(&silent, silent.kind.start);
        let Motion::Rest { at } = motion else { panic!("{motion:?}") };
        // The closed form of the equilibrium: w = (v + 0.7) / 0.8, v - v^3/3 - w + 0.2 = 0.
        assert!((at[0] - at[0].powi(3) / 3.0 - (at[0] + 0.7) / 0.8 + 0.2).abs() < 1e-4, "{at:?}");
        // A step that is far too long.
        let oscillator = Oscillator::named("van-der-pol").unwrap();
        let mut model = oscillator.model(3.0).unwrap();
        assert_eq!(settle(model.as_mut(), &oscillator.scale(), 20.0), Motion::Leaves);
    }

    #[test]
    fn a_crossing_counts_once() {
        let mut counter = Crossings::new(0.0, 0.5);
        let values = [-1.0, 1.0, -0.1, 0.1, -0.6, 0.2, 1.0];
        let found: Vec<f64> = values.into_iter().filter_map(|value| counter.next(value)).collect();
        assert_eq!(found, [0.5, 4.75]);
    }
}
