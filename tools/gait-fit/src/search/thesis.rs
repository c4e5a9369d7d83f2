//! Fits the thesis' network to a recorded stride so that its orbit is stable: it persists for hundreds of strides, and kicks and
//! random starts come back to it.
//!
//! The equations (see [`super::Network`]) are invariant under
//! - a change of the time scale: alpha, mu and d times r, p times 1/r^2, the product gains times r;
//! - a change of an offset a0;
//! - a scale of the hips by s, the knees by s': p by 1/s^2, the hips' product gains by s/s'^2, the knees' by s'/s^2.
//!
//! So period, offsets and amplitudes follow from the orbit in closed form ([`super::waveform`]), and the search is over the other
//! numbers, in units in which a hip has mu = 1 and every joint an amplitude of about 1: 8 numbers if left and right are equal, 20 if not.
//!
//! | gene | range |
//! |---|---|
//! | alpha / mu of the hip | 0.02 to 1.5, logarithmic |
//! | mu over that of the hip | 0.7 to 3 |
//! | gain of a difference link / mu of the hip | 0 to 1 |
//! | gain of a product link, as a fraction of the value at which it makes a spring negative on the cycle | -0.95 to 0.95 |
//! | phase of the start | 0 to 1 |
//! | p of right over left (sides free) | 0.25 to 4, logarithmic |
//!
//! CMA-ES with BIPOP restarts at 200 steps a stride over 60 strides and two disturbances. With half the steps an optimiser exploits the
//! error of the integrator. So the best few different individuals are then simulated as on the board, at 1 ms, but in f64, for ten times
//! as many strides ([`super::orbit_check`]); the best one with a stable orbit is the result. If there is none, the best is returned as
//! not accepted.

use std::sync::Mutex;

use gait_trace::stride::cycle::Cycle;
use generator_file::file::{ThesisJoint, ThesisSet};
use rayon::prelude::*;

use super::cma_es::{CmaEs, Restart};
use super::evaluator::{Evaluator, Progress};
use super::network::{Network, Oscillator};
use super::orbit_check::{Check, Simulated, check, simulate};
use super::random::Random;
use super::settle::{Durations, settle};
use super::waveform::{COARSE, Match, Sample, Stride, Turns, orbit};

/// Settings of a fit to a recorded stride.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchSettings {
    /// Seed of all random numbers.
    pub seed: u64,
    /// Number of individuals to simulate.
    pub evaluations: usize,
    /// Whether a second search allows left and right to differ.
    pub free_sides: bool,
    /// How many of the best are simulated at 1 ms, at most, until one has a stable orbit.
    pub candidates: usize,
}

impl Default for SearchSettings {
    fn default() -> Self {
        Self { seed: 1, evaluations: 60_000, free_sides: true, candidates: 12 }
    }
}

/// A fit of the thesis' network.
#[derive(Debug, Clone, PartialEq)]
pub struct ThesisFit {
    /// Its parameters.
    pub set: ThesisSet,
    /// Root mean square error of each joint, degrees, on its orbit at 1 ms.
    pub rmse_deg: [f64; 4],
    /// Evaluations at which the search improved, with the root mean square error over all joints, degrees, including the penalties for
    /// orbits that do not close.
    pub history: Vec<(usize, f64)>,
    /// Individuals simulated.
    pub evaluations: usize,
    /// The orbit, from the start of the target.
    pub best_cycle: Cycle,
    /// Period of the orbit at 1 ms, seconds.
    pub period_s: f64,
    /// Whether the orbit is stable, and every kick and enough random starts come back to it.
    pub accepted: bool,
    /// The reason if it was not accepted.
    pub refused_because: Option<String>,
}

/// Steps of a natural period of the hip.
const STEPS: usize = 200;
const STEP: f64 = std::f64::consts::TAU / STEPS as f64;
const PER_SAMPLE: usize = 4;
const DURATIONS: Durations = Durations {
    step: STEP,
    first_wait: 25 * STEPS,
    wait: 15 * STEPS,
    steps_per_sample: PER_SAMPLE,
    // The longest period that is searched is 1.7 natural periods.
    samples: 17 * STEPS / PER_SAMPLE / 10,
};
const SHORTEST: usize = 4 * STEPS / PER_SAMPLE / 10;

/// Fits the thesis' network to a stride of `period_s` seconds. The same seed gives the same bits.
///
/// `progress` gets root mean square errors in degrees, not costs.
///
/// The fit is coarse: for a healthy stride, the best stable orbit within the core's bounds has an error of 3 degrees at the hips and 10
/// to 11 at the knees, because only two product terms deform its sinusoids.
///
/// ```no_run
/// use gait_fit::search::{SearchSettings, fit_thesis};
/// # let target = gait_trace::stride::cycle::Cycle([[0.0; 200]; 4]);
/// let fit = fit_thesis(&target, 1.1, &SearchSettings::default(), &mut |_| ());
/// println!("{:?} degrees, accepted: {}", fit.rmse_deg, fit.accepted);
/// ```
pub fn fit_thesis(
    target: &Cycle,
    period_s: f64,
    settings: &SearchSettings,
    progress: &mut dyn FnMut(Progress),
) -> ThesisFit {
    if let Some(why) = not_a_stride(target, period_s) {
        return fit_of(flat(target, period_s), Check::refused(why), vec![], 0);
    }
    let aim = Aim { stride: Stride::new(target), period_s };
    let mut random = Random::new(settings.seed);
    let mut found = Found { history: vec![], evaluations: 0, pool: Mutex::default() };
    let share = if settings.free_sides { settings.evaluations / 2 } else { settings.evaluations };
    found.search(&aim, Sides::Alike, None, share, &mut random, progress);
    if settings.free_sides {
        let start = found.pool().first().map(|(genes, _)| genes.clone());
        found.search(&aim, Sides::Free, start, settings.evaluations, &mut random, progress);
    }
    let best = best_checked(&found.pool(), settings.candidates, &aim, target);
    let Found { history, evaluations, .. } = found;
    let (set, checked) = best.unwrap_or_else(|| {
        let set = flat(target, period_s);
        let simulated = simulate(&[set], period_s).swap_remove(0);
        (set, check(&set, simulated, target, period_s))
    });
    fit_of(set, checked, history, evaluations)
}

/// The best of so many candidates by their simulation at 1 ms: one that is accepted before others. The search ends with the first that is
/// accepted and about as good as it was found.
fn best_checked(pool: &[(Vec<f64>, f64)], most: usize, aim: &Aim, target: &Cycle) -> Option<(ThesisSet, Check)> {
    let mut candidates: Vec<&(Vec<f64>, f64)> = vec![];
    for candidate in pool {
        // A point close to a refused one would be refused too.
        if candidates.len() < most && candidates.iter().all(|other| distance(&other.0, &candidate.0) >= APART) {
            candidates.push(candidate);
        }
    }
    let realised = |(genes, cost): &&(Vec<f64>, f64)| Some((realise(&decode(genes), aim)?, *cost));
    let (sets, costs): (Vec<ThesisSet>, Vec<f64>) =
        candidates.par_iter().map(realised).collect::<Vec<_>>().into_iter().flatten().unzip();
    let mut simulated = sets.iter().zip(simulate(&sets, aim.period_s)).zip(costs);
    let mut best: Option<(ThesisSet, Check)> = None;
    // Two at a time, which need not wait for each other; the second is not looked at if the first ends the search.
    loop {
        let two: Vec<_> = simulated.by_ref().take(2).collect();
        if two.is_empty() {
            return best;
        }
        let of = |((set, simulated), cost): ((&ThesisSet, Simulated), f64)| {
            (*set, check(set, simulated, target, aim.period_s), cost)
        };
        let checked: Vec<(ThesisSet, Check, f64)> = two.into_par_iter().map(of).collect();
        for (set, checked, cost) in checked {
            let as_found = checked.accepted() && checked.rmse() < 1.05 * cost.sqrt();
            let rank = |check: &Check| (!check.accepted(), check.rmse());
            if best.as_ref().is_none_or(|(_, kept)| rank(&checked) < rank(kept)) {
                best = Some((set, checked));
            }
            if as_found {
                return best;
            }
        }
    }
}

fn fit_of(set: ThesisSet, checked: Check, history: Vec<(usize, f64)>, evaluations: usize) -> ThesisFit {
    ThesisFit {
        set,
        rmse_deg: checked.rmse_deg,
        history,
        evaluations,
        period_s: checked.period_s,
        accepted: checked.accepted(),
        refused_because: checked.refused_because,
        best_cycle: checked.cycle,
    }
}

/// The reason why a target cannot be fitted, if any.
fn not_a_stride(target: &Cycle, period_s: f64) -> Option<String> {
    if !(0.2..=20.0).contains(&period_s) {
        return Some(format!("the stride's period is {period_s} s; allowed is 0.2 to 20 s"));
    }
    for (joint, points) in joint_units::Joint::ALL.iter().zip(&target.0) {
        if let Some(k) = points.iter().position(|x| !(-360.0..=360.0).contains(x)) {
            let name = joint.name().replace('_', " ");
            return Some(format!(
                "the {name} is {} degrees at point {k} of {}; allowed is -360 to 360",
                points[k],
                points.len()
            ));
        }
    }
    None
}

/// Whether left and right have separate parameters.
#[derive(Clone, Copy, PartialEq)]
enum Sides {
    Alike,
    Free,
}

/// The target of the search.
struct Aim {
    stride: Stride,
    period_s: f64,
}

/// Results of the searches.
struct Found {
    history: Vec<(usize, f64)>,
    evaluations: usize,
    /// Good points in the 20 genes of separate sides, lowest cost first.
    pool: Mutex<Vec<(Vec<f64>, f64)>>,
}

impl Found {
    fn search(
        &mut self,
        aim: &Aim,
        sides: Sides,
        start: Option<Vec<f64>>,
        budget: usize,
        random: &mut Random,
        progress: &mut dyn FnMut(Progress),
    ) {
        let (turns, arch) = (Turns::new(), pulp::Arch::new());
        let before = self.evaluations;
        let all = |point: &Vec<f64>| if sides == Sides::Alike { both_sides(point) } else { point.clone() };
        let pool = &self.pool;
        let mut costs = |points: &[Vec<f64>]| -> Vec<f64> {
            let points: Vec<Vec<f64>> = points.iter().map(all).collect();
            // In the widest vectors of the machine: no sum has a fused multiply-add, so the bits are the same in all of them.
            let judge = |network: &Network, records: &[Vec<Sample>; 3]| {
                arch.dispatch(Judge { network, records, aim, turns: &turns })
            };
            let costs = settle(&points, |point| decode(point), DURATIONS, judge);
            keep(&mut pool.lock().unwrap_or_else(std::sync::PoisonError::into_inner), points, &costs);
            costs
        };
        let mut shift =
            |p: Progress| progress(Progress { evaluations: before + p.evaluations, best: p.best.sqrt(), budget });
        let dimensions = if sides == Sides::Alike { 8 } else { 20 };
        let mut evaluator =
            Evaluator::new(dimensions, &mut costs, &mut shift).with_budget(budget.saturating_sub(before));
        let settings = match start {
            None => CmaEs { population: 32, scouts: 256, tolerance: 1e-3, ..CmaEs::default() },
            Some(_) => CmaEs { population: 32, sigma: 0.05, start, restart: Restart::Never, ..CmaEs::default() },
        };
        settings.run(&mut evaluator, random);
        let least = self.history.last().map_or(f64::INFINITY, |h| h.1);
        let better = evaluator.history().iter().map(|&(at, cost)| (before + at, cost.sqrt())).filter(|h| h.1 < least);
        self.history.extend(better);
        self.evaluations += evaluator.evaluations();
    }

    fn pool(&self) -> Vec<(Vec<f64>, f64)> {
        self.pool.lock().unwrap_or_else(std::sync::PoisonError::into_inner).clone()
    }
}

/// Adds good points to the pool, lowest cost first.
fn keep(pool: &mut Vec<(Vec<f64>, f64)>, points: Vec<Vec<f64>>, costs: &[f64]) {
    const LONG: usize = 200;
    for (point, &cost) in points.into_iter().zip(costs) {
        let full = pool.len() == LONG;
        if full && pool.last().is_some_and(|worst| cost >= worst.1) || !cost.is_finite() {
            continue;
        }
        // Of nearly equal points only the best stays; otherwise one run would fill the pool.
        if pool.iter().any(|kept| kept.1 <= cost && distance(&kept.0, &point) < NEAR) {
            continue;
        }
        pool.retain(|kept| distance(&kept.0, &point) >= NEAR);
        pool.insert(pool.partition_point(|kept| kept.1 <= cost), (point, cost));
        pool.truncate(LONG);
    }
}

/// Points closer than this, in the unit box, count as one.
const NEAR: f64 = 0.04;
/// A point closer than this to one that was checked is not checked.
const APART: f64 = 0.08;

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// The genes of separate sides from those of equal sides.
fn both_sides(g: &[f64]) -> Vec<f64> {
    let half = |x: f64| (x + 0.5).rem_euclid(1.0);
    // alpha; mu of all but the left hip; p ratios; difference; product; start phases of all but the left hip.
    vec![
        g[0],
        g[0],
        g[1],
        g[1],
        (1.0 - MU_LOW) / (MU_HIGH - MU_LOW),
        g[2],
        g[2],
        0.5,
        0.5,
        g[3],
        g[3],
        g[4],
        g[4],
        g[5],
        g[5],
        g[6],
        g[6],
        0.5,
        g[7],
        half(g[7]),
    ]
}

const MU_LOW: f64 = 0.7;
const MU_HIGH: f64 = 3.0;

fn logarithmic(low: f64, high: f64, part: f64) -> f64 {
    low * libm::pow(high / low, part)
}

/// The network of 20 genes, in units of the hip's mu and the cycle's amplitude.
fn decode(g: &[f64]) -> Network {
    let mut network = Network::default();
    let ratio = [1.0, logarithmic(0.25, 4.0, g[7]), 1.0, logarithmic(0.25, 4.0, g[8])];
    for i in 0..4 {
        let mu = if i == 0 { 1.0 } else { MU_LOW + (MU_HIGH - MU_LOW) * g[3 + i] };
        let alpha = logarithmic(0.02, 2.0, g[i]);
        let difference = g[9 + i];
        // An amplitude of 1 by harmonic balance.
        let p = 4.0 * (alpha + 2.0 * difference) / (3.0 * alpha * mu * mu) * ratio[i];
        network.joints[i] = Oscillator { alpha, p, mu, offset: 0.0, difference, product: 0.0 };
    }
    let velocity = network.cycle_velocity();
    for i in 0..4 {
        let mu = network.joints[i].mu;
        network.joints[i].product = 0.95 * (2.0 * g[13 + i] - 1.0) * mu * mu / velocity[(i + 2) % 4];
    }
    network.start_at([0.0, g[17], g[18], g[19]]);
    network
}

/// What an individual is judged by.
struct Judge<'a> {
    network: &'a Network,
    records: &'a [Vec<Sample>; 3],
    aim: &'a Aim,
    turns: &'a Turns<COARSE>,
}

impl pulp::WithSimd for Judge<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> f64 {
        cost(self.network, self.records, self.aim, self.turns)
    }
}

/// Mean square error in deg^2 of the worst of three passes, plus a penalty for an orbit that does not close or leaves the core's bounds.
#[inline(always)]
fn cost(network: &Network, records: &[Vec<Sample>; 3], aim: &Aim, turns: &Turns<COARSE>) -> f64 {
    let (mut worst, mut defect) = (0.0f64, 0.0);
    let (mut first, mut scale) = (f64::NAN, [1.0; 2]);
    for record in records {
        let Some(orbit) = orbit(record, SHORTEST) else { return f64::INFINITY };
        let matched = aim.stride.best_match(&orbit.points, turns);
        worst = worst.max(matched.rmse_deg.powi(2));
        if first.is_nan() {
            (first, scale) = (orbit.samples, matched.scale);
        }
        defect += orbit.defect + (orbit.samples / first - 1.0).powi(2);
    }
    let beyond = beyond_bounds(network, &records[2], first, aim.period_s, scale);
    worst + 2500.0 * defect + 1000.0 * beyond
}

/// By how much an orbit, or the network itself, is beyond what the core accepts: its bounds on states, its longest period of 5 ms.
fn beyond_bounds(network: &Network, record: &[Sample], samples: f64, period_s: f64, scale: [f64; 2]) -> f64 {
    if scale.iter().any(|s| *s <= 0.0) {
        return f64::INFINITY;
    }
    let rate = samples * PER_SAMPLE as f64 * STEP / period_s;
    let cycle = network.cycle_velocity();
    let mut beyond = 0.0;
    let mut over = |part: f64| beyond += (part - 1.0).max(0.0);
    for i in 0..4 {
        let own = &network.joints[i];
        let driven = &network.joints[(i + 2) % 4];
        // The product gain in degrees of both joints, back in this joint's own.
        let product = driven.product.abs() * scale[1 - i / 2] / scale[i / 2];
        let runaway = driven.mu * driven.mu / product.max(1e-12);
        let limit = (3.0 * cycle[i]).min(runaway);
        over(cycle[i] / (0.96 * runaway));
        let per_second = 1.0 / (PER_SAMPLE as f64 * STEP);
        let velocity = record.iter().map(|s| f64::from(s[i + 4]).abs()).fold(0.0, f64::max) * per_second;
        let displacement = record.iter().map(|s| f64::from(s[i]).abs()).fold(0.0, f64::max);
        over(velocity / (0.94 * limit));
        over(displacement * own.mu / (2.8 * cycle[i]));
        let growth = own.alpha + 2.0 * own.difference;
        over(rate * 5e-3 * (36.0 * growth - own.alpha + 2.0 * own.difference) / 2.4);
        over(rate * 5e-3 * own.mu / 0.098);
    }
    beyond
}

/// The parameters in degrees and seconds, starting on the orbit where the stride begins; `None` if there is no orbit.
fn realise(network: &Network, aim: &Aim) -> Option<ThesisSet> {
    // Finer than the search, in f64, from the network's settled state.
    let fine = STEP / 4.0;
    let settled = Network { start: network.run(fine, 4 * STEPS * 60), ..*network };
    let mut record: Vec<Sample> = vec![];
    let mut states = vec![];
    let per_sample = 4 * PER_SAMPLE;
    let mut count = 0;
    settled.each_state(fine, per_sample * DURATIONS.samples, |state| {
        if count % per_sample == 0 {
            let v = state.velocity.map(|v| v * fine * per_sample as f64);
            record.push(std::array::from_fn(|i| if i < 4 { state.displacement[i] as f32 } else { v[i - 4] as f32 }));
            states.push(*state);
        }
        count += 1;
    });
    let found = orbit(&record, SHORTEST)?;
    let Match { shift, scale, offset, .. } = aim.stride.best_match(&found.points, &Turns::new());
    let rate = found.samples * per_sample as f64 * fine / aim.period_s;
    if scale.iter().any(|s| *s <= 0.0) || !rate.is_finite() {
        return None;
    }
    let begin = states.get((shift * found.samples) as usize)?;
    let cycle = network.cycle_velocity();
    let joints = std::array::from_fn(|i| {
        let (own, s) = (&network.joints[i], scale[i / 2]);
        let lead = libm::atan2(-begin.velocity[i] / cycle[i], begin.displacement[i] * own.mu / cycle[i]);
        ThesisJoint {
            alpha_per_s: (own.alpha * rate) as f32,
            p_s2_per_deg2: (own.p / (s * s * rate * rate)) as f32,
            mu_rad_per_s: (own.mu * rate) as f32,
            offset_deg: offset[i] as f32,
            start_phase_deg: lead.to_degrees() as f32,
        }
    });
    let difference = |i: usize| (network.joints[i].difference * rate) as f32;
    let product = |i: usize| {
        let other = scale[(i / 2 + 1) % 2];
        (network.joints[i].product * rate * scale[i / 2] / (other * other)) as f32
    };
    Some(ThesisSet {
        difference_per_s: [[difference(0), difference(1)], [difference(2), difference(3)]],
        product_per_deg_s: [[product(0), product(2)], [product(1), product(3)]],
        joints,
    })
}

/// Uncoupled oscillators with the target's ranges: returned as not accepted if no individual had an orbit.
fn flat(target: &Cycle, period_s: f64) -> ThesisSet {
    let mu = std::f64::consts::TAU / period_s;
    let joints = std::array::from_fn(|i| {
        let (low, high) = target.0[i].iter().fold((f64::MAX, f64::MIN), |(l, h), &x| (l.min(x), h.max(x)));
        let amplitude = (0.5 * (high - low)).max(0.1);
        ThesisJoint {
            alpha_per_s: 1.0,
            p_s2_per_deg2: cpg_core::network::thesis::harmonic_balance_p(1.0, 0.0, mu, amplitude) as f32,
            mu_rad_per_s: mu as f32,
            offset_deg: (0.5 * (high + low)) as f32,
            start_phase_deg: 180.0 * (i % 2) as f32,
        }
    });
    ThesisSet { difference_per_s: [[0.0; 2]; 2], product_per_deg_s: [[0.0; 2]; 2], joints }
}
