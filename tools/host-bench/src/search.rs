//! The thesis' genetic algorithm: 98,002 evaluations of 5 s of the four-joint network, Runge-Kutta at 1 ms and at 5 ms. Most of its individuals
//! equal a parent and are not simulated, so the same is measured with individuals of which each is simulated, a generation at a time.
//!
//! The floor is what the instructions of one network step take at the processor's peak: a loop of the same number of independent
//! multiply-adds and additions, whose results are used. Twice a number can be a part of a multiply-add, or a sum more: the faster of both
//! mixes counts. Floor and kernel take turns of a few milliseconds; the ratio is the median of the ratios of neighbours.

use crate::extent::Extent;
use crate::times::{median, rounded, time};
use gait_fit::search::{Evaluator, Network, Random};
use pulp::{Arch, Simd, WithSimd};
use reproduce::thesis_ga::ThesisGa;
use reproduce::{Genes, Grid, Objective, Target, errors, processor, set_s};
use serde_json::{Value, json};
use std::time::Instant;

/// Simulated time of an evaluation, seconds.
const SECONDS: f64 = 5.0;
/// Floating-point instructions of a step of as many individuals as a vector has lanes, multiply-adds counted once: 132 that multiply and 32
/// additions, or 120 and 56, where the double of a number is a sum.
const STEP_INSTRUCTIONS: [f64; 2] = [132.0 + 32.0, 120.0 + 56.0];
/// Individuals to which the time of simulating each is scaled.
const EVALUATIONS: f64 = 1e5;
/// New individuals of a generation.
const GENERATION: usize = 98;
/// Turns of kernel and floor in a run.
const TURNS: usize = 10;

/// All numbers of the search.
pub(crate) fn measure(extent: Extent) -> Value {
    let truth = set_s();
    let target = Target::of_network(&truth, SECONDS, 5);
    let genes = Genes::thesis(truth);
    let grids = [(1, Grid::FINE), (5, Grid::SEARCH)];
    let threads: Vec<usize> = [1, 2].into_iter().filter(|&n| n <= crate::search::cores()).collect();
    let batch = population(&genes);
    let (mut kernels, mut everyone, mut searches, mut floors) = (vec![], vec![], vec![], vec![]);
    for (step_ms, grid) in grids {
        let steps = target.angles.len() * grid.steps_per_sample;
        let one = pool(1);
        let turns: Vec<(f64, f64)> = (0..extent.runs * TURNS)
            .map(|_| {
                let kernel = one.install(|| time(|| errors(&batch, &target, grid, false)[7].square));
                (kernel * 1e9 / (batch.len() * steps) as f64, Arch::new().dispatch(Peak))
            })
            .collect();
        floors.extend(turns.iter().map(|turn| turn.1));
        kernels.push(json!({
            "step_ms": step_ms,
            "ns": rounded(median(turns.iter().map(|turn| turn.0))),
            "to_floor": rounded(median(turns.iter().map(|turn| turn.0 / turn.1))),
        }));
        for &count in &threads {
            let pool = pool(count);
            let each: Vec<Times> = (0..extent.runs)
                .map(|_| pool.install(|| every_individual(&genes, &target, grid, extent.generations)))
                .collect();
            let of = |number: fn(&Times) -> f64| rounded(median(each.iter().map(number)));
            everyone.push(json!({
                "step_ms": step_ms,
                "threads": count,
                "seconds": of(|times| times.seconds),
                "processor_s": of(|times| times.processor_s),
                "cores_busy": of(|times| times.processor_s / times.seconds),
                "ns": rounded(median(each.iter().map(|times| times.seconds * 1e9 * count as f64 / (EVALUATIONS * steps as f64)))),
            }));
            let runs: Vec<Run> = (0..extent.runs)
                .map(|seed| pool.install(|| genetic(&genes, &target, grid, seed as u64, extent.generations)))
                .collect();
            let of = |number: fn(&Run) -> f64| rounded(median(runs.iter().map(number)));
            searches.push(json!({
                "step_ms": step_ms,
                "threads": count,
                "evaluations": runs[0].evaluations,
                "simulated": median(runs.iter().map(|run| run.simulated as f64)) as usize,
                "seconds": of(|run| run.seconds),
                "own_s": of(|run| run.seconds - run.in_evaluations),
            }));
        }
    }
    let steps = (SECONDS * 1e3) as usize;
    let plain = median((0..extent.runs * TURNS).map(|_| time(|| naive(&truth, 1e-3, steps)))) / steps as f64;
    json!({
        "floor_ns": rounded(median(floors)),
        "kernel": kernels,
        "each_simulated": everyone,
        "search": searches,
        "plain_f64_ns": rounded(plain * 1e9),
    })
}

/// Cores of this machine.
fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads")
}

/// Lanes of f32 in the vectors of this machine.
pub(crate) fn lanes() -> usize {
    struct Width;
    impl WithSimd for Width {
        type Output = usize;
        fn with_simd<S: Simd>(self, _: S) -> usize {
            S::F32_LANES
        }
    }
    Arch::new().dispatch(Width)
}

/// Enough individuals for a few milliseconds.
fn population(genes: &Genes) -> Vec<Network> {
    points(640).iter().map(|point| genes.decode(point)).collect()
}

/// Different individuals.
fn points(count: usize) -> Vec<Vec<f64>> {
    let mut random = Random::new(1);
    (0..count).map(|_| (0..12).map(|_| 0.2 + 0.1 * random.unit()).collect()).collect()
}

/// Time by the clock, and of all cores.
struct Times {
    seconds: f64,
    processor_s: f64,
}

/// Times of some work.
fn times<R>(work: impl FnOnce() -> R) -> Times {
    let before = processor::seconds();
    let seconds = time(work);
    let processor_s = before.zip(processor::seconds()).map_or(f64::NAN, |(before, after)| after - before);
    Times { seconds, processor_s }
}

/// The way from genes to costs.
fn costs(genes: &Genes, target: &Target, grid: Grid, points: &[Vec<f64>]) -> Vec<f64> {
    let networks: Vec<Network> = points.iter().map(|point| genes.decode(point)).collect();
    errors(&networks, target, grid, false).iter().map(|e| Objective::ANGLE.cost(e)).collect()
}

/// Times of [`EVALUATIONS`] individuals, of which each is simulated: a generation again and again.
fn every_individual(genes: &Genes, target: &Target, grid: Grid, generations: usize) -> Times {
    let points = points(GENERATION);
    let all = || (0..generations).map(|_| costs(genes, target, grid, &points)[7]).sum::<f64>();
    let Times { seconds, processor_s } = times(all);
    let scale = EVALUATIONS / (generations * GENERATION) as f64;
    Times { seconds: seconds * scale, processor_s: processor_s * scale }
}

/// Seconds of the evaluation of one individual on one core, at a step of 1 ms or 5 ms: the mean of some generations.
pub(crate) fn individual_s(step_ms: u64) -> f64 {
    const GENERATIONS: usize = 50;
    let grid = if step_ms == 1 { Grid::FINE } else { Grid::SEARCH };
    let truth = set_s();
    let target = Target::of_network(&truth, SECONDS, 5);
    let genes = Genes::thesis(truth);
    pool(1).install(|| every_individual(&genes, &target, grid, GENERATIONS)).seconds / EVALUATIONS
}

/// One run of the algorithm.
struct Run {
    seconds: f64,
    /// Seconds in the evaluation of populations.
    in_evaluations: f64,
    evaluations: usize,
    /// Individuals that were simulated, because they equal no parent.
    simulated: usize,
}

/// The thesis' algorithm without its pattern search.
fn genetic(genes: &Genes, target: &Target, grid: Grid, seed: u64, generations: usize) -> Run {
    let mut in_evaluations = 0.0;
    let mut of = |points: &[Vec<f64>]| -> Vec<f64> {
        let began = Instant::now();
        let costs = costs(genes, target, grid, points);
        in_evaluations += began.elapsed().as_secs_f64();
        costs
    };
    let mut quiet = |_| ();
    let mut evaluator = Evaluator::new(genes.count(), &mut of, &mut quiet);
    let ga = ThesisGa { hybrid: false, generations, ..ThesisGa::default() };
    let seconds = time(|| ga.run(&mut evaluator, &mut Random::new(seed)));
    let (evaluations, simulated) = (evaluator.evaluations(), evaluator.computed());
    Run { seconds, in_evaluations, evaluations, simulated }
}

/// Nanoseconds of the instructions of one network step at the processor's peak, without dependencies and without memory access: the lesser
/// of both mixes. Some processors add beside what they multiply, so the loops have both in about the ratio of the step: four to one, two to
/// one.
struct Peak;

impl WithSimd for Peak {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, s: S) -> f64 {
        let [few, many] = STEP_INSTRUCTIONS;
        // Vectors of 16 lanes have 32 registers, narrower ones 16.
        if S::F32_LANES >= 16 {
            f64::min(few * peak::<S, 16, 4>(s), many * peak::<S, 15, 7>(s))
        } else {
            f64::min(few * peak::<S, 8, 2>(s), many * peak::<S, 8, 4>(s))
        }
    }
}

/// Nanoseconds of an instruction, for one individual.
#[inline(always)]
fn peak<S: Simd, const CHAINS: usize, const SUMS: usize>(s: S) -> f64 {
    const INSTRUCTIONS: usize = 200_000;
    let rounds = INSTRUCTIONS / (CHAINS + SUMS);
    let (a, b) = (s.splat_f32s(std::hint::black_box(0.999)), s.splat_f32s(std::hint::black_box(1e-3)));
    let mut chains = [s.splat_f32s(1.0); CHAINS];
    let mut sums = [s.splat_f32s(1.0); SUMS];
    let start = Instant::now();
    for _ in 0..rounds {
        for chain in &mut chains {
            *chain = s.mul_add_f32s(*chain, a, b);
        }
        for sum in &mut sums {
            *sum = s.add_f32s(*sum, b);
        }
    }
    let seconds = start.elapsed().as_secs_f64();
    // Used, so that the compiler leaves nothing out.
    let all = chains.into_iter().chain(sums).fold(s.splat_f32s(0.0), |all, chain| s.add_f32s(all, chain));
    std::hint::black_box(s.reduce_sum_f32s(all));
    seconds / ((CHAINS + SUMS) * rounds) as f64 / S::F32_LANES as f64 * 1e9
}

/// The textbook form: y' = f(y), four stages, arrays of f64.
fn naive(network: &Network, h: f64, steps: usize) -> f64 {
    let field = |y: &[f64; 8]| -> [f64; 8] {
        let mut dy = [0.0; 8];
        for i in 0..4 {
            let (n, side, leg) = (&network.joints[i], [1, 0, 3, 2][i], [2, 3, 0, 1][i]);
            dy[i] = y[i + 4];
            dy[i + 4] = n.alpha * (1.0 - n.p * y[i + 4] * y[i + 4]) * y[i + 4] - n.mu * n.mu * y[i]
                + n.difference * (y[i + 4] - y[side + 4])
                + n.product * y[leg + 4] * y[leg];
        }
        dy
    };
    let moved = |y: &[f64; 8], k: &[f64; 8], by: f64| -> [f64; 8] { std::array::from_fn(|i| y[i] + by * k[i]) };
    let mut y: [f64; 8] =
        std::array::from_fn(|i| if i < 4 { network.start.displacement[i] } else { network.start.velocity[i - 4] });
    for _ in 0..steps {
        let k1 = field(&y);
        let k2 = field(&moved(&y, &k1, 0.5 * h));
        let k3 = field(&moved(&y, &k2, 0.5 * h));
        let k4 = field(&moved(&y, &k3, h));
        for i in 0..8 {
            y[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
        }
    }
    y[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The plain loop is the network that the search simulates.
    #[test]
    fn the_plain_loop_and_the_network_agree() {
        let network = set_s();
        let expected = network.run(1e-3, 2000).displacement[0];
        let got = naive(&network, 1e-3, 2000);
        assert!((got - expected).abs() < 1e-6, "{got} {expected}");
    }
}
