//! Fits R1 (`cpg_core::network::phase_coupled`) to a recorded stride: amplitude, offset and phase of each
//! joint, and eps and kap, which deform its sinusoids slightly.
//!
//! Levenberg-Marquardt on the waveform of the limit cycle, which is the core's own network in f64 at 5 ms, run until it has settled.
//! Amplitudes and offsets are linear and follow from the waveform by least squares, so the search is over the phase of each joint (the
//! first one's is common to all), and eps and kap if they are free; the natural period follows from the measured one. Starts: the phases
//! of the target's fundamentals, which are close enough for a single start. Any number of joints and any graph is fitted alike.

use std::f64::consts::TAU;

use cpg_core::network::graph::{Biped, Graph};
use cpg_core::network::phase_coupled::{Robust, RobustConfig};
use cpg_core::{Generator as _, Rk4};
use gait_trace::stride::cycle::{Cycle, POINTS};
use gait_trace::stride::metrics::rmse;
use generator_file::file::{PhaseCoupledJoint, PhaseCoupledSet};
use joint_units::{Period, Phase, Radians};
use rayon::prelude::*;

use super::evaluator::{Evaluator, Progress};
use super::levenberg::levenberg;

/// Whether eps and kap are searched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Dynamics {
    /// As given: eps, kap of all links.
    Fixed(f64, f64),
    /// eps from 0.05 to 1, kap from 0.1 to 1.
    Free,
}

/// A fit of R1.
#[derive(Debug, Clone, PartialEq)]
pub struct PhaseCoupledFit {
    /// Its parameters.
    pub set: PhaseCoupledSet,
    /// Root mean square error of each joint on the limit cycle, degrees.
    pub rmse_deg: [f64; 4],
    /// Evaluations at which the fit improved, with the root mean square error over all joints, degrees.
    pub history: Vec<(usize, f64)>,
    /// Number of limit cycles computed.
    pub evaluations: usize,
    /// The limit cycle, from the start of the target.
    pub best_cycle: Cycle,
    /// Period of the limit cycle, seconds.
    pub period_s: f64,
}

const EPS: (f64, f64) = (0.05, 1.0);
const KAP: (f64, f64) = (0.1, 1.0);

/// Fits R1 to a stride of `period_s` seconds, 0.2 to 20. It uses no random numbers. `progress` gets root mean
/// square errors in degrees.
///
/// ```
/// use gait_fit::search::{Dynamics, fit_phase_coupled};
/// use gait_trace::stride::cycle::Cycle;
/// // Sinusoids, which R1 reproduces best.
/// let target = Cycle(std::array::from_fn(|joint| std::array::from_fn(|k| {
///     let lead = [0.0, 0.5, 0.7, 0.2][joint];
///     25.0 + 20.0 * (std::f64::consts::TAU * (k as f64 / 200.0 + lead)).cos()
/// })));
/// let fit = fit_phase_coupled(&target, 1.2, Dynamics::Fixed(0.2, 0.2), &mut |_| ());
/// assert!(fit.rmse_deg.iter().all(|rmse| *rmse < 0.3), "{:?}", fit.rmse_deg);
/// assert!((fit.set.joints[2].amplitude_deg - 20.0).abs() < 0.2);
/// ```
pub fn fit_phase_coupled(
    target: &Cycle,
    period_s: f64,
    dynamics: Dynamics,
    progress: &mut dyn FnMut(Progress),
) -> PhaseCoupledFit {
    let NetworkFit { network, rmse_deg, history, evaluations, best_cycle, period_s } =
        fit_network::<Biped, 4, 4>(&target.0, period_s, dynamics, progress);
    let joints = network.joints.map(|(amplitude_deg, offset_deg, phase_deg)| PhaseCoupledJoint {
        amplitude_deg,
        offset_deg,
        phase_deg,
    });
    let set = PhaseCoupledSet {
        natural_period_s: network.natural_period_s,
        nonlinearity: network.nonlinearity,
        coupling: [network.coupling; 4],
        joints,
    };
    PhaseCoupledFit { set, rmse_deg, history, evaluations, best_cycle: Cycle(best_cycle), period_s }
}

/// The parameters of a fitted network of `N` joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FittedNetwork<const N: usize> {
    /// Period of the linear part, seconds.
    pub natural_period_s: f32,
    /// Strength eps with which the amplitude returns.
    pub nonlinearity: f32,
    /// Strength kap of all links.
    pub coupling: f32,
    /// Amplitude, offset and phase lead of each joint, degrees.
    pub joints: [(f32, f32, f32); N],
}

/// A fit of R1 to `N` joints.
#[derive(Debug, Clone, PartialEq)]
pub struct NetworkFit<const N: usize> {
    /// The parameters.
    pub network: FittedNetwork<N>,
    /// Root mean square error of each joint on the limit cycle, degrees.
    pub rmse_deg: [f64; N],
    /// As in [`PhaseCoupledFit`].
    pub history: Vec<(usize, f64)>,
    /// Number of limit cycles computed.
    pub evaluations: usize,
    /// The limit cycle, from the start of the target.
    pub best_cycle: Curves<N>,
    /// Period of the limit cycle, seconds.
    pub period_s: f64,
}

/// One stride of `N` joints, degrees.
pub type Curves<const N: usize> = [[f64; POINTS]; N];

/// As [`fit_phase_coupled`], for `N` joints that the graph `G` links by `E` links.
pub fn fit_network<G: Graph<N, E> + Sync, const N: usize, const E: usize>(
    target: &Curves<N>,
    period_s: f64,
    dynamics: Dynamics,
    progress: &mut dyn FnMut(Progress),
) -> NetworkFit<N> {
    let leads = target.each_ref().map(fundamental);
    // Coordinates: the common phase, leads of the others before the first, eps, kap; phases as +-half a cycle about the first guess.
    let dimensions = if dynamics == Dynamics::Free { N + 2 } else { N };
    let decode = |point: &[f64]| -> Guess<N> {
        let (eps, kap) = match dynamics {
            Dynamics::Fixed(eps, kap) => (eps, kap),
            Dynamics::Free => (EPS.0 + (EPS.1 - EPS.0) * point[N], KAP.0 + (KAP.1 - KAP.0) * point[N + 1]),
        };
        let lead = |i: usize| if i == 0 { 0.0 } else { leads[i] - leads[0] + point[i] - 0.5 };
        Guess { begin: leads[0] + point[0] - 0.5, leads: std::array::from_fn(lead), eps, kap }
    };
    let mut residuals = |points: &[Vec<f64>]| -> Vec<Option<Vec<f64>>> {
        points.par_iter().map(|point| Some(decode(point).fitted::<G, E>(target)?.residuals(target))).collect()
    };
    let mut unused = |points: &[Vec<f64>]| vec![f64::INFINITY; points.len()];
    let mut root = |p: Progress| progress(Progress { best: p.best.sqrt(), ..p });
    let mut evaluator = Evaluator::new(dimensions, &mut unused, &mut root).with_budget(400);
    let start = vec![0.5; dimensions];
    levenberg(&mut evaluator, &mut residuals, &start);
    let best = evaluator.best().map_or(start, <[f64]>::to_vec);
    let guess = decode(&best);
    let fitted = guess.fitted::<G, E>(target).unwrap_or_else(|| Fitted::mean(target));
    let phase_deg = |lead: f64| ((lead + 0.5).rem_euclid(1.0) * 360.0 - 180.0) as f32;
    let network = FittedNetwork {
        natural_period_s: (period_s / fitted.stretch) as f32,
        nonlinearity: guess.eps as f32,
        coupling: guess.kap as f32,
        joints: std::array::from_fn(|i| {
            (fitted.amplitude[i] as f32, fitted.offset[i] as f32, phase_deg(guess.leads[i]))
        }),
    };
    NetworkFit {
        network,
        rmse_deg: std::array::from_fn(|i| rmse(&fitted.cycle[i], &target[i]).unwrap_or(f64::NAN)),
        history: evaluator.history().iter().map(|&(at, cost)| (at, cost.sqrt())).collect(),
        evaluations: evaluator.evaluations(),
        best_cycle: fitted.cycle,
        period_s: f64::from(network.natural_period_s) * fitted.stretch,
    }
}

/// Lead of the fundamental over a cosine, cycles.
fn fundamental(points: &[f64; POINTS]) -> f64 {
    let (mut c, mut s) = (0.0, 0.0);
    for (k, x) in points.iter().enumerate() {
        let angle = TAU * k as f64 / POINTS as f64;
        c += x * libm::cos(angle);
        s -= x * libm::sin(angle);
    }
    libm::atan2(s, c) / TAU
}

struct Guess<const N: usize> {
    /// Fraction of the cycle at the start of the target.
    begin: f64,
    leads: [f64; N],
    eps: f64,
    kap: f64,
}

struct Fitted<const N: usize> {
    amplitude: [f64; N],
    offset: [f64; N],
    cycle: Curves<N>,
    /// Period over natural period.
    stretch: f64,
}

/// Natural period of the simulation, seconds; the waveform does not depend on it.
const NATURAL: f64 = 1.0;
const STEP_S: f64 = 5e-3;
const SETTLE: usize = 30 * 200;

impl<const N: usize> Guess<N> {
    /// Displacements over a cycle from the first joint's upward zero crossing, and the period relative to the natural period.
    fn limit_cycle<G: Graph<N, E>, const E: usize>(&self) -> Option<(Vec<[f64; N]>, f64)> {
        let config = RobustConfig::<N, E, f64> {
            natural_period: NATURAL,
            nonlinearity: self.eps,
            coupling: [self.kap; E],
            phases: self.leads.map(|lead| Phase((lead.rem_euclid(1.0) * 4_294_967_296.0) as u64 as u32)),
            amplitudes: [Radians(1.0); N],
            offsets: [Radians(0.0); N],
        };
        let mut net: Robust<G, N, E, f64, Rk4> = config.build(Period::from_micros((STEP_S * 1e6) as u32)?).ok()?;
        for _ in 0..SETTLE {
            net.step();
        }
        let mut now = net.state();
        let mut states = vec![];
        let mut marks = vec![];
        for _ in 0..800 {
            net.step();
            let next = net.state();
            if now.displacement[0] < 0.0 && next.displacement[0] >= 0.0 {
                marks.push(states.len() as f64 + crossing(&now, &next));
            }
            states.push(now);
            now = next;
        }
        let (first, second) = (*marks.first()?, *marks.get(1)?);
        let samples = second - first;
        let at = |time: f64| -> [f64; N] {
            let k = time as usize;
            std::array::from_fn(|i| hermite(&states[k], &states[k + 1], i, time - k as f64))
        };
        let points = (0..POINTS).map(|k| at(first + samples * k as f64 / POINTS as f64)).collect();
        Some((points, samples * STEP_S / NATURAL))
    }

    /// The limit cycle with the amplitudes and offsets of the smallest error.
    fn fitted<G: Graph<N, E>, const E: usize>(&self, target: &Curves<N>) -> Option<Fitted<N>> {
        let (points, stretch) = self.limit_cycle::<G, E>()?;
        // The record begins a quarter of a cycle before the largest flexion of the first joint.
        let shift = (self.begin + 0.25).rem_euclid(1.0) * POINTS as f64;
        let (mut amplitude, mut offset) = ([0.0; N], [0.0; N]);
        let mut cycle = [[0.0; POINTS]; N];
        for joint in 0..N {
            let wave: Vec<f64> = (0..POINTS).map(|k| periodic(&points, joint, k as f64 + shift)).collect();
            let mean = |of: &dyn Fn(usize) -> f64| (0..POINTS).map(of).sum::<f64>() / POINTS as f64;
            let (wave_mean, target_mean) = (mean(&|k| wave[k]), mean(&|k| target[joint][k]));
            let covariance = mean(&|k| (wave[k] - wave_mean) * (target[joint][k] - target_mean));
            let variance = mean(&|k| (wave[k] - wave_mean).powi(2));
            amplitude[joint] = (covariance / variance).clamp(0.0, 180.0);
            offset[joint] = target_mean - amplitude[joint] * wave_mean;
            for (point, wave) in cycle[joint].iter_mut().zip(&wave) {
                *point = offset[joint] + amplitude[joint] * wave;
            }
        }
        Some(Fitted { amplitude, offset, cycle, stretch })
    }
}

impl<const N: usize> Fitted<N> {
    /// Every joint at rest at its mean.
    fn mean(target: &Curves<N>) -> Self {
        let offset = target.map(|points| points.iter().sum::<f64>() / POINTS as f64);
        Self { amplitude: [0.0; N], offset, cycle: offset.map(|mean| [mean; POINTS]), stretch: 1.0 }
    }

    fn residuals(&self, target: &Curves<N>) -> Vec<f64> {
        let joints = self.cycle.iter().zip(target);
        joints.flat_map(|(own, target)| own.iter().zip(target).map(|(a, b)| a - b)).collect()
    }
}

/// Fraction of a step at which the first joint crosses zero.
fn crossing<const N: usize>(a: &cpg_core::OscillatorState<N, f64>, b: &cpg_core::OscillatorState<N, f64>) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if hermite(a, b, 0, middle) < 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Displacement between two states by cubic Hermite interpolation; u' = w v.
fn hermite<const N: usize>(
    a: &cpg_core::OscillatorState<N, f64>,
    b: &cpg_core::OscillatorState<N, f64>,
    joint: usize,
    t: f64,
) -> f64 {
    let per_step = TAU / NATURAL * STEP_S;
    let (xa, xb) = (a.displacement[joint], b.displacement[joint]);
    let (va, vb) = (a.velocity[joint] * per_step, b.velocity[joint] * per_step);
    xa + t * (va + t * (3.0 * (xb - xa) - 2.0 * va - vb + t * (2.0 * (xa - xb) + va + vb)))
}

/// Catmull-Rom interpolation between the points of a closed cycle.
fn periodic<const N: usize>(points: &[[f64; N]], joint: usize, at: f64) -> f64 {
    let (k, t) = (at as usize, at.fract());
    let x = |offset: usize| points[(k + POINTS + offset - 1) % POINTS][joint];
    let (before, a, b, after) = (x(0), x(1), x(2), x(3));
    let (va, vb) = (0.5 * (b - before), 0.5 * (after - a));
    a + t * (va + t * (3.0 * (b - a) - 2.0 * va - vb + t * (2.0 * (a - b) + va + vb)))
}
