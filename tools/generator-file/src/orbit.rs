//! The motion that a model settles on: an orbit, found to rounding error by Newton's method, or a motion without one.
//!
//! The orbit solves F(x, T) = x, where F(x, T) is the state after the time T from x. Newton's steps use the differential M of F by x;
//! on the orbit the eigenvalues of M are the Floquet multipliers. An orbit counts only if the model comes to it from its own start.
//!
//! A **distance** is that of a state from the nearest point of the orbit: the root of the sum of squares over all states, each divided by
//! its amplitude on the orbit. One point of the orbit is one time shift of all joints, so a joint that is shifted alone stays away.

use nalgebra::{DMatrix, DVector};

use crate::model::Model;

/// Strides before the first search for an orbit.
const SETTLE_STRIDES: usize = 60;
/// Strides between two searches.
const MORE_STRIDES: usize = 100;
/// Searches before the motion counts as one without an orbit.
const SEARCHES: usize = 4;
/// Distance from the orbit at which the model counts as on it.
const ON_ORBIT: f64 = 0.02;
/// Strides that are recorded for a search.
const RECORDED_STRIDES: usize = 14;
/// Most strides from the start to an orbit that counts.
pub(crate) const MOST_STRIDES: usize = SETTLE_STRIDES + (SEARCHES - 1) * MORE_STRIDES + SEARCHES * RECORDED_STRIDES;
/// Most cycles of the first moving state in one period.
const MOST_CYCLES: usize = 6;
/// Half range of a state below which it does not move.
const MOVES: f64 = 0.02;
/// Largest relative deviation of an interval of a state that moves steadily.
const STEADY: f64 = 0.1;
/// Points of an orbit: so many to twice as many, or one a step.
const LEAST_POINTS: usize = 200;

/// The motion that a model settles on.
pub enum Motion {
    /// It comes to rest.
    Still,
    /// Every state that moves does so steadily, but the whole never repeats.
    QuasiPeriodic,
    /// At least one state has no steady period.
    Irregular,
    /// It comes to this orbit.
    Periodic(Orbit),
}

/// An orbit.
pub struct Orbit {
    /// States at every few steps, in amplitudes, one after the other.
    scaled: Vec<f64>,
    /// The same numbers, one state after the other, so that many points are compared with a state at once.
    by_state: Vec<f64>,
    /// Parts of it, each with the points within a distance of its centre.
    arcs: Arcs,
    /// Steps from one of them to the next.
    every: usize,
    /// Amplitude of each state: half its range, or its size if it does not move.
    pub amplitude: Vec<f64>,
    /// Middle of each state's range.
    pub middle: Vec<f64>,
    /// Period, seconds, or units of the model's own time.
    pub period_s: f64,
    /// Period in steps.
    pub steps: f64,
    /// Sizes of the Floquet multipliers without the trivial one, largest first.
    pub multipliers: Vec<f64>,
}

impl Orbit {
    /// Number of states.
    #[must_use]
    pub fn dimensions(&self) -> usize {
        self.amplitude.len()
    }

    /// The state after a part of the period, 0 to 1.
    #[must_use]
    pub fn at(&self, part: f64) -> Vec<f64> {
        let n = self.dimensions();
        let points = self.scaled.len() / n;
        let place = ((part * points as f64) as usize).min(points - 1);
        self.scaled[place * n..(place + 1) * n].iter().zip(&self.amplitude).map(|(x, a)| x * a).collect()
    }

    /// Largest size of a state.
    #[must_use]
    pub fn size(&self, index: usize) -> f64 {
        self.scaled.iter().skip(index).step_by(self.dimensions()).fold(0.0, |most, x| f64::max(most, x.abs()))
            * self.amplitude[index]
    }

    /// Distance of a state from the orbit.
    #[must_use]
    pub fn distance(&self, state: &[f64]) -> f64 {
        self.nearest(state).0
    }

    /// Distance of a state from the orbit, and the place of the nearest point as a part of the period, 0 to 1.
    #[must_use]
    pub fn nearest(&self, state: &[f64]) -> (f64, f64) {
        let n = self.dimensions();
        let here: Vec<f64> = state.iter().zip(&self.amplitude).map(|(x, a)| x / a).collect();
        let Some((place, least)) = self.nearest_point(&here) else { return (f64::INFINITY, 0.0) };
        // Between points the orbit is straight.
        let points = self.scaled.len() / n;
        let point = |k: usize| &self.scaled[(k % points) * n..(k % points + 1) * n];
        let segment = |from: usize| {
            let (part, square) = to_segment(point(from), point(from + 1), &here);
            // The last segment ends at the first point, after a shorter time than the others.
            let ends = [from % points, from % points + 1].map(|k| self.steps.min((k * self.every) as f64));
            (square, (ends[0] + part * (ends[1] - ends[0])) / self.steps)
        };
        let at = (least, (place * self.every) as f64 / self.steps);
        let (square, part) = [segment(place + points - 1), segment(place)]
            .into_iter()
            .fold(at, |best, other| if other.0 < best.0 { other } else { best });
        (square.sqrt(), part.rem_euclid(1.0))
    }

    /// Whether the distance of a state from the orbit is greater than `near`; the answer is that of [`Self::distance`], which it mostly
    /// finds from few points.
    #[must_use]
    pub fn is_beyond(&self, state: &[f64], near: f64) -> bool {
        let n = self.dimensions();
        let points = self.scaled.len() / n;
        let here: Vec<f64> = state.iter().zip(&self.amplitude).map(|(x, a)| x / a).collect();
        let point = |k: usize| &self.scaled[(k % points) * n..(k % points + 1) * n];
        let mut least = f64::INFINITY;
        let mut place = None;
        for from in self.arcs.about(&here, near) {
            for k in from..=(from + ARC).min(points) {
                let square = square(point(k), &here);
                if square < least {
                    (least, place) = (square, Some(k));
                }
            }
        }
        let Some(place) = place else {
            // Every arc is further away; a state that is no number has no distance.
            return here.iter().all(|x| x.is_finite());
        };
        if least < SURELY * near * near {
            return false;
        }
        // If the orbit is near, the nearest of all points is among those of the arcs about the state, and a segment at it is near.
        let is_near = |from: usize| to_segment(point(from), point(from + 1), &here).1 <= near * near / SURELY;
        (!is_near(place + points - 1) && !is_near(place)) || self.distance(state) > near
    }

    /// The point that is nearest to a state in amplitudes, the first of several, and the square of its distance.
    fn nearest_point(&self, here: &[f64]) -> Option<(usize, f64)> {
        /// Points that are compared at once: their squares stay in the registers and the nearest memory.
        const AT_ONCE: usize = 64;
        let points = self.scaled.len() / here.len();
        let mut nearest: Option<(usize, f64)> = None;
        for from in (0..points).step_by(AT_ONCE) {
            let count = AT_ONCE.min(points - from);
            let mut squares = [0.0; AT_ONCE];
            for (values, x) in self.by_state.chunks_exact(points).zip(here) {
                for (square, value) in squares[..count].iter_mut().zip(&values[from..from + count]) {
                    *square += (value - x) * (value - x);
                }
            }
            for (k, square) in squares[..count].iter().enumerate() {
                if nearest.is_none_or(|(_, least)| square.total_cmp(&least).is_lt()) {
                    nearest = Some((from + k, *square));
                }
            }
        }
        nearest
    }
}

/// Square of the distance of two points.
fn square(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

/// The place on a segment that is nearest to a point, 0 to 1, and the square of its distance.
fn to_segment(a: &[f64], b: &[f64], here: &[f64]) -> (f64, f64) {
    let along: f64 = a.iter().zip(b).zip(here).map(|((a, b), x)| (b - a) * (x - a)).sum();
    let length: f64 = a.iter().zip(b).map(|(a, b)| (b - a) * (b - a)).sum();
    let part = if length > 0.0 { (along / length).clamp(0.0, 1.0) } else { 0.0 };
    (part, a.iter().zip(b).zip(here).map(|((a, b), x)| (a + part * (b - a) - x).powi(2)).sum())
}

/// Segments of an arc.
const ARC: usize = 8;
/// A comparison of squares is not left to the rounding: one that is decided by less is left to the distance itself.
const SURELY: f64 = 1.0 - 1e-9;

/// Arcs of an orbit, of [`ARC`] segments each.
struct Arcs {
    /// Centres, one state after the other.
    centres: Vec<f64>,
    /// Largest distance of a point from the centre of its arc.
    radii: Vec<f64>,
}

impl Arcs {
    fn of(scaled: &[f64], n: usize) -> Self {
        let points = scaled.len() / n;
        let point = |k: usize| &scaled[(k % points) * n..(k % points + 1) * n];
        let parts: Vec<(Vec<f64>, f64)> = (0..points)
            .step_by(ARC)
            .map(|from| {
                // With the first point of the next arc, which ends its last segment.
                let own: Vec<&[f64]> = (from..=(from + ARC).min(points)).map(point).collect();
                let centre: Vec<f64> =
                    (0..n).map(|i| own.iter().map(|point| point[i]).sum::<f64>() / own.len() as f64).collect();
                let radius = own.iter().map(|point| square(point, &centre)).fold(0.0, f64::max).sqrt();
                (centre, radius)
            })
            .collect();
        let centres = (0..n).flat_map(|i| parts.iter().map(move |(centre, _)| centre[i])).collect();
        Self { centres, radii: parts.iter().map(|(_, radius)| *radius).collect() }
    }

    /// The first points of the arcs that may have a point within `near` of a state in amplitudes.
    fn about(&self, here: &[f64], near: f64) -> impl Iterator<Item = usize> {
        let mut squares = vec![0.0; self.radii.len()];
        for (centres, x) in self.centres.chunks_exact(self.radii.len()).zip(here) {
            for (square, centre) in squares.iter_mut().zip(centres) {
                *square += (centre - x) * (centre - x);
            }
        }
        let reach = move |radius: f64| (near + radius) * (near + radius) / SURELY;
        let arcs = squares.into_iter().zip(&self.radii).enumerate();
        arcs.filter(move |(_, (square, radius))| *square <= reach(**radius)).map(|(arc, _)| arc * ARC)
    }
}

/// The motion that a model settles on from its own start. `stride` is the expected period in steps.
pub fn motion(built: &dyn Model, stride: usize) -> Motion {
    let mut model = built.copy();
    let mut recorded = None;
    for search in 0..SEARCHES {
        model.advance(stride * if search == 0 { SETTLE_STRIDES } else { MORE_STRIDES });
        let record = Record::of(model.as_mut(), stride);
        if record.moving.is_empty() {
            return Motion::Still;
        }
        if let Some(orbit) = record.orbit(model.as_ref())
            && orbit.distance(&model.state()) < ON_ORBIT
        {
            return Motion::Periodic(orbit);
        }
        recorded = Some(record);
    }
    match recorded {
        Some(record) if record.is_steady() => Motion::QuasiPeriodic,
        _ => Motion::Irregular,
    }
}

/// The states of some strides.
struct Record {
    states: Vec<Vec<f64>>,
    /// Half range and middle of each state.
    spread: Vec<(f64, f64)>,
    /// The states that move.
    moving: Vec<usize>,
}

impl Record {
    fn of(model: &mut dyn Model, stride: usize) -> Self {
        let mut states = Vec::with_capacity(RECORDED_STRIDES * stride + 1);
        states.push(model.state());
        for _ in 0..RECORDED_STRIDES * stride {
            model.advance(1);
            states.push(model.state());
        }
        let spread: Vec<(f64, f64)> = (0..states[0].len())
            .map(|i| {
                let fold = |(low, high): (f64, f64), s: &Vec<f64>| (low.min(s[i]), high.max(s[i]));
                let (low, high) = states.iter().fold((f64::MAX, f64::MIN), fold);
                (0.5 * (high - low), 0.5 * (high + low))
            })
            .collect();
        let moving = (0..spread.len()).filter(|&i| spread[i].0 > MOVES * spread[i].1.abs().max(1.0)).collect();
        Self { states, spread, moving }
    }

    /// Upward crossings of the middle of a state, in steps.
    fn crossings(&self, index: usize) -> Vec<f64> {
        let middle = self.spread[index].1;
        let pairs = self.states.windows(2).enumerate();
        pairs
            .filter_map(|(step, pair)| {
                let (before, now) = (pair[0][index] - middle, pair[1][index] - middle);
                (before < 0.0 && now >= 0.0).then(|| step as f64 - before / (now - before))
            })
            .collect()
    }

    /// Whether the intervals of every moving state are equal.
    fn is_steady(&self) -> bool {
        self.moving.iter().all(|&index| {
            let marks = self.crossings(index);
            let Some(cycles) = marks.len().checked_sub(1).filter(|&cycles| cycles >= 3) else { return false };
            let mean = (marks[cycles] - marks[0]) / cycles as f64;
            marks.windows(2).all(|pair| (pair[1] - pair[0] - mean).abs() < STEADY * mean)
        })
    }

    /// The orbit near the last state, if there is one.
    fn orbit(&self, model: &dyn Model) -> Option<Orbit> {
        let amplitude: Vec<f64> =
            self.spread
                .iter()
                .enumerate()
                .map(|(i, &(half, middle))| {
                    if self.moving.contains(&i) { half } else { if middle.abs() > MOVES { middle.abs() } else { 1.0 } }
                })
                .collect();
        let marks = self.crossings(*self.moving.first()?);
        let cycles = marks.len().checked_sub(1).filter(|&cycles| cycles >= 3)?;
        let cycle = (marks[cycles] - marks[0]) / cycles as f64;
        // The fewest cycles after which the state returns.
        let last = self.states.last()?;
        let back = |count: usize| {
            let from = self.states.len() as f64 - 1.0 - count as f64 * cycle;
            if from < NODES as f64 { f64::INFINITY } else { apart(&interpolated(&self.states, from), last, &amplitude) }
        };
        let distances: Vec<f64> = (1..=MOST_CYCLES).map(back).collect();
        let least = distances.iter().copied().fold(f64::INFINITY, f64::min);
        let count = 1 + distances.iter().position(|d| *d <= f64::max(0.02, 3.0 * least))?;
        if least > 0.3 {
            return None;
        }
        newton(model, &amplitude, cycle * count as f64)
    }
}

fn apart(a: &[f64], b: &[f64], amplitude: &[f64]) -> f64 {
    a.iter().zip(b).zip(amplitude).map(|((a, b), size)| ((a - b) / size).powi(2)).sum::<f64>().sqrt()
}

/// Points through which states between steps are interpolated: with fewer, the error of the interpolation is a drift of joints that
/// differ in phase.
const NODES: usize = 6;

/// The states at a fractional step, by the polynomial through the nearest points. There must be six states or more.
#[must_use]
pub fn interpolated(states: &[Vec<f64>], step: f64) -> Vec<f64> {
    let first = (step as usize).saturating_sub(NODES / 2 - 1).min(states.len().saturating_sub(NODES));
    let t = step - first as f64;
    let weight = |k: usize| -> f64 {
        (0..NODES).filter(|&other| other != k).map(|other| (t - other as f64) / (k as f64 - other as f64)).product()
    };
    let weights: [f64; NODES] = std::array::from_fn(weight);
    let near = &states[first..first + NODES];
    (0..near[0].len()).map(|i| near.iter().zip(weights).map(|(state, weight)| weight * state[i]).sum()).collect()
}

/// The flow of a model in amplitudes.
struct FlowMap<'a> {
    model: &'a dyn Model,
    amplitude: &'a [f64],
}

impl FlowMap<'_> {
    /// The states about the time `steps` from a start.
    fn about(&self, start: &DVector<f64>, steps: f64) -> Vec<Vec<f64>> {
        let mut model = self.model.copy();
        let whole: Vec<f64> = start.iter().zip(self.amplitude).map(|(x, a)| x * a).collect();
        model.set_state(&whole);
        model.advance((steps as usize).saturating_sub(NODES / 2 - 1));
        (0..NODES)
            .map(|k| {
                model.advance(usize::from(k > 0));
                model.state().iter().zip(self.amplitude).map(|(x, a)| x / a).collect()
            })
            .collect()
    }

    /// The state after the time `steps`, and its derivative by that time.
    fn after(&self, start: &DVector<f64>, steps: f64) -> (DVector<f64>, DVector<f64>) {
        let near = self.about(start, steps);
        let part = (NODES / 2 - 1) as f64 + steps.fract();
        let at = |shift: f64| DVector::from_vec(interpolated(&near, part + shift));
        let small = 1e-3;
        (at(0.0), (at(small) - at(-small)) / (2.0 * small))
    }

    /// The differential of the state after the time `steps` by the start.
    fn differential(&self, start: &DVector<f64>, steps: f64, size: f64) -> DMatrix<f64> {
        let n = start.len();
        let mut map = DMatrix::zeros(n, n);
        for column in 0..n {
            let moved = |by: f64| {
                let mut moved = start.clone();
                moved[column] += by;
                self.after(&moved, steps).0
            };
            map.set_column(column, &((moved(size) - moved(-size)) / (2.0 * size)));
        }
        map
    }
}

/// The orbit near the state of a model; `period` is a first estimate in steps.
fn newton(model: &dyn Model, amplitude: &[f64], period: f64) -> Option<Orbit> {
    let flow = FlowMap { model, amplitude };
    let (size, residual, singular) = if model.is_double() { (1e-5, 1e-8, 1e-6) } else { (5e-3, 1e-4, 1e-3) };
    let n = amplitude.len();
    let mut start = DVector::from_iterator(n, model.state().iter().zip(amplitude).map(|(x, a)| x / a));
    let mut steps = period;
    for round in 0..12 {
        let (end, speed) = flow.after(&start, steps);
        let left = &end - &start;
        if !left.norm().is_finite() || !(0.3..3.0).contains(&(steps / period)) {
            return None;
        }
        let map = flow.differential(&start, steps, size);
        if left.norm() < residual && round > 0 {
            return Some(orbit_of(&flow, &start, steps, &map));
        }
        // The change of the start is perpendicular to the motion; the period takes the rest.
        let mut matrix = DMatrix::zeros(n + 1, n + 1);
        matrix.view_mut((0, 0), (n, n)).copy_from(&(&map - DMatrix::identity(n, n)));
        matrix.view_mut((0, n), (n, 1)).copy_from(&speed);
        matrix.view_mut((n, 0), (1, n)).copy_from(&speed.transpose());
        let mut right = DVector::zeros(n + 1);
        right.rows_mut(0, n).copy_from(&-&left);
        let decomposed = matrix.svd(true, true);
        let least = singular * decomposed.singular_values.max();
        let change = decomposed.solve(&right, least).ok()?;
        let shrink = (0.5 / change.rows(0, n).norm()).min(1.0);
        start += change.rows(0, n) * shrink;
        steps += change[n] * shrink;
    }
    None
}

fn orbit_of(flow: &FlowMap<'_>, start: &DVector<f64>, steps: f64, map: &DMatrix<f64>) -> Orbit {
    let mut model = flow.model.copy();
    let whole: Vec<f64> = start.iter().zip(flow.amplitude).map(|(x, a)| x * a).collect();
    model.set_state(&whole);
    let points = steps.ceil() as usize;
    let every = (points / LEAST_POINTS).max(1);
    let (mut states, mut low, mut high) = (vec![], whole.clone(), whole);
    for point in 0..points {
        let state = model.state();
        for (i, x) in state.iter().enumerate() {
            (low[i], high[i]) = (low[i].min(*x), high[i].max(*x));
        }
        if point % every == 0 {
            states.push(state);
        }
        model.advance(1);
    }
    let ranges = low.iter().zip(&high).zip(flow.amplitude);
    let amplitude: Vec<f64> = ranges
        .map(|((low, high), known)| {
            let (half, middle) = (0.5 * (high - low), 0.5 * (high + low));
            if half > MOVES * middle.abs().max(1.0) { half } else { *known }
        })
        .collect();
    let middle = low.iter().zip(&high).map(|(low, high)| 0.5 * (low + high)).collect();
    let scaled: Vec<f64> = states.iter().flat_map(|state| state.iter().zip(&amplitude).map(|(x, a)| x / a)).collect();
    let n = amplitude.len();
    let by_state = (0..n).flat_map(|i| scaled.iter().skip(i).step_by(n).copied()).collect();
    let arcs = Arcs::of(&scaled, n);
    Orbit { scaled, by_state, arcs, every, amplitude, middle, period_s: f64::NAN, steps, multipliers: multipliers(map) }
}

/// Sizes of the eigenvalues without the one nearest to 1, largest first: a difference along the orbit does not contract.
fn multipliers(map: &DMatrix<f64>) -> Vec<f64> {
    let mut values: Vec<_> = map.complex_eigenvalues().iter().copied().collect();
    let off = |a: &nalgebra::Complex<f64>| (a - nalgebra::Complex::new(1.0, 0.0)).norm();
    if let Some(trivial) = (0..values.len()).min_by(|&a, &b| off(&values[a]).total_cmp(&off(&values[b]))) {
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
    use crate::subject::Subject;

    /// The table of R1 at w = 2 pi/1.1: period and leading multiplier, from an independent integration.
    #[test]
    fn period_and_contraction_of_r1_are_those_of_the_table() {
        for (nonlinearity, coupling, period_s, multiplier) in [
            (0.1, 0.1, 1.100_684_57, 0.534),
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
            let settled = Subject::Set(GeneratorSet::PhaseCoupled(set)).motion().unwrap().unwrap();
            let Motion::Periodic(orbit) = settled.motion else { panic!("an orbit") };
            assert!((orbit.period_s - period_s).abs() < 1e-6, "{nonlinearity}, {coupling}: {}", orbit.period_s);
            let found = orbit.multipliers[0];
            assert!((found - multiplier).abs() < 6e-4, "{nonlinearity}, {coupling}: {found}");
            // It is closed: the last point is one step before the first.
            let step = orbit.distance(&orbit.at(0.999));
            assert!(step < 1e-9, "{step}");
        }
    }

    /// The nearest point is that of a search through one point after the other, bit for bit.
    #[test]
    fn the_nearest_point_is_the_nearest_of_all() {
        let set = GeneratorFile::default_of("phase-coupled").unwrap().set;
        let Motion::Periodic(orbit) = Subject::Set(set).motion().unwrap().unwrap().motion else { panic!("an orbit") };
        let n = orbit.dimensions();
        let mut random = crate::random::Random(5);
        for case in 0..2000 {
            let mut here: Vec<f64> = (0..n).map(|_| random.within(1.5)).collect();
            if case % 7 == 0 {
                here = orbit.scaled[case % 50 * n..][..n].to_vec();
            }
            let square = |point: &[f64]| point.iter().zip(&here).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
            let all = orbit.scaled.chunks_exact(n).map(square).enumerate();
            let (place, least) = all.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
            let (found, found_least) = orbit.nearest_point(&here).unwrap();
            assert_eq!((found, found_least.to_bits()), (place, least.to_bits()), "{case}");
        }
    }

    /// Whether a state is beyond a distance is what the distance says: far away, on the orbit, and about the distance itself.
    #[test]
    fn beyond_a_distance_is_what_the_distance_says() {
        let mut orbits = 0;
        for name in ["phase-coupled", "hopf", "van-der-pol", "matsuoka", "half-centre"] {
            let motion = Subject::named(name).unwrap().motion().unwrap();
            let Some(Motion::Periodic(orbit)) = motion.map(|settled| settled.motion) else { continue };
            orbits += 1;
            let mut random = crate::random::Random(6);
            let mut beyond = 0;
            for case in 0..4000 {
                let size = [1e-9, 0.01, 0.03, 0.1, 1.0][case % 5];
                let mut state = orbit.at(0.5 + 0.5 * random.within(1.0));
                for (x, amplitude) in state.iter_mut().zip(&orbit.amplitude) {
                    *x += size * random.within(1.0) * amplitude;
                }
                let distance = orbit.distance(&state);
                for near in [0.05, 0.1 * size, distance, distance * (1.0 - 1e-12), distance * (1.0 + 1e-12)] {
                    assert_eq!(orbit.is_beyond(&state, near), distance > near, "{name}, {case}: {distance} and {near}");
                    beyond += u32::from(distance > near);
                }
            }
            assert!((4000..16_000).contains(&beyond), "{name}: {beyond}");
            assert!(!orbit.is_beyond(&vec![f64::NAN; orbit.dimensions()], 0.05));
        }
        assert!(orbits >= 2, "{orbits}");
    }

    /// A joint that is shifted alone is away from the orbit by what it is shifted; all joints shifted together are on it.
    #[test]
    fn a_distance_has_the_phase_of_every_joint() {
        let set = GeneratorFile::default_of("phase-coupled").unwrap().set;
        let Motion::Periodic(orbit) = Subject::Set(set).motion().unwrap().unwrap().motion else { panic!("an orbit") };
        let (here, later) = (orbit.at(0.3), orbit.at(0.55));
        assert!(orbit.distance(&later) < 1e-9);
        let mut knee = here.clone();
        for state in [2, 6] {
            knee[state] = later[state];
        }
        // A quarter of a cycle is 1.41 amplitudes; the nearest shift of all joints leaves most of it.
        assert!((0.9..1.42).contains(&orbit.distance(&knee)), "{}", orbit.distance(&knee));
    }
}
