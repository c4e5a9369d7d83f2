//! Measures the speed of the thesis' genetic algorithm: 100,000 evaluations of 5 s of the four-joint network, Runge-Kutta at 1 ms and at
//! 5 ms, in f32 lanes on one core and on two, compared with a plain f64 loop, with the peak of the processor, and with
//! GNU Octave (`ode45` and `octave-ga`) if `octave-cli` is on the path.
//!
//! Long runs are timed by their processor time, so that other work on the machine does not count, and by the clock.
//!
//! `cargo run --profile host -p reproduce --example search_speed`

use std::path::Path;
use std::process::Command;
use std::time::Instant;

use gait_fit::search::{Evaluator, Network, Random};
use pulp::{Arch, Simd, WithSimd};
use reproduce::thesis_ga::ThesisGa;
use reproduce::{Genes, Grid, Objective, Target, errors, processor, set_s};

const SECONDS: f64 = 5.0;
/// Floating-point instructions of one step of one vector, multiply-adds counted once.
const STEP_INSTRUCTIONS: f64 = 164.0;
const REPEATS: usize = 5;

fn main() {
    let truth = set_s();
    let target = Target::of_network(&truth, SECONDS, 5);
    let genes = Genes::thesis(truth);

    println!("Median (best) of {REPEATS} or more runs.\n");
    println!("| what | ns per network step | 100,000 evaluations | by the clock |\n|---|---|---|---|");
    // The best of many short runs: other work on the machine can only slow it down.
    let floor = (0..60).map(|_| Arch::new().dispatch(Peak)).fold(f64::MAX, f64::min);
    println!("| floor: {STEP_INSTRUCTIONS} instructions a step at this processor's peak, one core | {floor:.2} | | |");
    for (name, grid) in [("1 ms", Grid::FINE), ("5 ms", Grid::SEARCH)] {
        let steps = target.angles.len() * grid.steps_per_sample;
        for threads in [1, 2] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            let batch = population(&genes);
            let once = || pool.install(|| time(|| errors(&batch, &target, grid, false)[7].square));
            let kernel = Times::of((0..REPEATS * 4).map(|_| once())).per((batch.len() * steps) as f64);
            println!(
                "| f32 lanes, {name}, {threads} core(s), population of {} | {} | | |",
                batch.len(),
                kernel.show(1e9, 2)
            );
            let (mut cpu, mut clock, mut evaluations) = (vec![], vec![], 0);
            for seed in 0..REPEATS {
                let before = processor::seconds();
                let (seconds, count) = pool.install(|| genetic(&genes, &target, grid, seed as u64));
                cpu.push(before.zip(processor::seconds()).map_or(seconds, |(before, after)| after - before));
                clock.push(seconds);
                evaluations = count;
            }
            let (one, clock) = (Times::of(cpu).per(evaluations as f64), Times::of(clock).per(evaluations as f64));
            let step = one.per(steps as f64);
            assert!(threads == 2 || step.best * 1e9 > floor, "faster than the processor: work was left out");
            println!(
                "| thesis' GA, {name}, {threads} core(s), {evaluations} evaluations | {} | {} s of processor | {} s |",
                step.show(1e9, 2),
                one.show(1e5, 2),
                clock.show(1e5, 2)
            );
        }
    }
    for (name, step_ms) in [("1 ms", 1), ("5 ms", 5)] {
        let steps = (SECONDS * 1e3) as usize / step_ms;
        let one = Times::of((0..50).map(|_| time(|| naive(&truth, step_ms as f64 * 1e-3, steps))));
        let step = one.per(steps as f64);
        println!("| naive f64, {name}, one core | {} | | {} s |", step.show(1e9, 1), one.show(1e5, 1));
    }
    octave();
}

/// Prints the results of the Octave script, or why there are none.
fn octave() {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../benches/octave/thesis_ga.m");
    let run = Command::new("octave-cli").args(["--no-gui", "--quiet"]).arg(script).output();
    let Ok(output) = run else {
        println!("\nGNU Octave was left out: no `octave-cli` on the path.");
        return;
    };
    let text = String::from_utf8_lossy(&output.stdout);
    let numbers = text.lines().filter_map(|line| line.split_once(' ')).filter_map(|(n, v)| Some((n, v.parse().ok()?)));
    let numbers: Vec<(&str, f64)> = numbers.collect();
    for (name, one) in &numbers {
        println!(
            "| GNU Octave, {name}, {:.1} ms an evaluation; extrapolated | | | {:.0} min |",
            one * 1e3,
            one * 1e5 / 60.0
        );
    }
    if numbers.len() < 3 {
        println!("\nGNU Octave stopped early: {}", String::from_utf8_lossy(&output.stderr).trim());
    }
}

/// Times of several runs, seconds.
struct Times {
    median: f64,
    best: f64,
}

impl Times {
    fn of(runs: impl IntoIterator<Item = f64>) -> Self {
        let mut runs: Vec<f64> = runs.into_iter().collect();
        runs.sort_by(f64::total_cmp);
        Self { median: runs[runs.len() / 2], best: runs[0] }
    }

    fn per(&self, parts: f64) -> Self {
        Self { median: self.median / parts, best: self.best / parts }
    }

    fn show(&self, unit: f64, digits: usize) -> String {
        format!("{:.digits$} ({:.digits$})", self.median * unit, self.best * unit)
    }
}

fn time<R>(work: impl FnOnce() -> R) -> f64 {
    let start = Instant::now();
    std::hint::black_box(work());
    start.elapsed().as_secs_f64()
}

/// Enough individuals to fill all lanes of all threads.
fn population(genes: &Genes) -> Vec<Network> {
    let mut random = Random::new(1);
    let near = |random: &mut Random| -> Vec<f64> { (0..12).map(|_| 0.2 + 0.1 * random.unit()).collect() };
    (0..1280).map(|_| genes.decode(&near(&mut random))).collect()
}

/// Seconds and evaluations of the thesis' algorithm without its pattern search.
fn genetic(genes: &Genes, target: &Target, grid: Grid, seed: u64) -> (f64, usize) {
    let mut costs = |points: &[Vec<f64>]| -> Vec<f64> {
        let networks: Vec<Network> = points.iter().map(|point| genes.decode(point)).collect();
        errors(&networks, target, grid, false).iter().map(|e| Objective::ANGLE.cost(e)).collect()
    };
    let mut quiet = |_| ();
    let mut evaluator = Evaluator::new(genes.count(), &mut costs, &mut quiet);
    let ga = ThesisGa { hybrid: false, ..ThesisGa::default() };
    let seconds = time(|| ga.run(&mut evaluator, &mut Random::new(seed)));
    (seconds, evaluator.evaluations())
}

/// Nanoseconds that the instructions of one network step take at the processor's peak, without dependencies and without memory
/// access. Of 164, 132 are multiplications and multiply-adds and 32 additions, which some processors do beside them; so four to one.
struct Peak;

impl WithSimd for Peak {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, s: S) -> f64 {
        const CHAINS: usize = 16;
        const SUMS: usize = 4;
        const ROUNDS: usize = 1_000_000;
        let (a, b) = (s.splat_f32s(std::hint::black_box(0.999)), s.splat_f32s(std::hint::black_box(1e-3)));
        let mut chains = [s.splat_f32s(1.0); CHAINS];
        let mut sums = [s.splat_f32s(1.0); SUMS];
        let start = Instant::now();
        for _ in 0..ROUNDS {
            for chain in &mut chains {
                *chain = s.mul_add_f32s(*chain, a, b);
            }
            for sum in &mut sums {
                *sum = s.add_f32s(*sum, b);
            }
        }
        let seconds = start.elapsed().as_secs_f64();
        let all = chains.into_iter().chain(sums).fold(s.splat_f32s(0.0), |all, chain| s.add_f32s(all, chain));
        std::hint::black_box(s.reduce_sum_f32s(all));
        seconds / ((CHAINS + SUMS) * ROUNDS) as f64 * STEP_INSTRUCTIONS / S::F32_LANES as f64 * 1e9
    }
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
