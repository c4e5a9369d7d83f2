//! R1 against the oracle of DOP853 at rtol 1e-12, and what it promises: period, no inflation, every phase locked, from any start.

mod common;

use common::{Crossings, R1, Random, W, apart, micros, r1, r1_config, r1_single, run, single};
use cpg_core::network::graph::Biped;
use cpg_core::network::phase_coupled::Robust;
use cpg_core::{Generator, OscillatorState, Rk4};
use joint_units::Period;

const START: OscillatorState<4, f64> =
    OscillatorState { displacement: [0.1, 0.0, 0.0, 0.0], velocity: [0.0, 0.1, -0.1, 0.05] };

/// eps, kap, t, u, v.
type Oracle = (f64, f64, u64, [f64; 4], [f64; 4]);

const ORACLES: [Oracle; 6] = [
    (
        0.5,
        0.5,
        1,
        [-0.021345540, 0.006852020, 0.049124140, -0.070365180],
        [-0.05159006, 0.07761378, -0.03043861, 0.01898088],
    ),
    (
        0.5,
        0.5,
        5,
        [1.02965253, -1.02965649, -0.20817673, 0.20817804],
        [0.11254146, -0.11253970, 0.99586000, -0.99586269],
    ),
    (
        0.5,
        0.5,
        10,
        [-1.01430594, 1.01430594, 0.31882885, -0.31882885],
        [-0.22084499, 0.22084499, -0.98802839, 0.98802839],
    ),
    (
        0.5,
        0.5,
        60,
        [-0.32072130, 0.32072130, 1.03437464, -1.03437464],
        [-0.91153333, 0.91153333, -0.09766377, 0.09766377],
    ),
    (
        0.2,
        0.2,
        5,
        [0.28424581, -0.28525830, -0.17446553, 0.17852445],
        [0.16107635, -0.16469629, 0.24392411, -0.24474410],
    ),
    (
        0.2,
        0.2,
        60,
        [0.42670006, -0.42670006, -0.97729567, 0.97729567],
        [0.88422162, -0.88422162, 0.24625336, -0.24625336],
    ),
];

fn worst(state: &OscillatorState<4, f64>, u: &[f64; 4], v: &[f64; 4]) -> f64 {
    let pairs = state.displacement.iter().zip(u).chain(state.velocity.iter().zip(v));
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn oracle_states_in_f64() {
    for (eps, kap, t, u, v) in ORACLES {
        let mut net: R1<Rk4> = r1(eps, kap, micros(200));
        net.set_state(&START).unwrap();
        run(&mut net, t * 5000);
        let error = worst(&net.state(), &u, &v);
        assert!(error < 2e-8, "eps {eps} kap {kap} at {t} s: {error:e}");
    }
}

#[test]
fn oracle_states_in_f32_at_one_millisecond() {
    for (eps, kap, t, u, v) in ORACLES {
        let mut net: Robust<Biped, 4, 4> = r1_single(eps as f32, kap as f32).build(Period::MILLISECOND).unwrap();
        net.set_state(&single(&START)).unwrap();
        run(&mut net, t * 1000);
        let OscillatorState { displacement, velocity } = net.state();
        let state = OscillatorState { displacement: displacement.map(f64::from), velocity: velocity.map(f64::from) };
        let error = worst(&state, &u, &v);
        assert!(error < 5e-5, "eps {eps} kap {kap} at {t} s: {error:e}");
    }
}

/// What the limit cycle is like at one eps and kap: period at w = 2 pi / 1.1 s, largest u of the hips, third harmonic over
/// first, and the size of the leading multiplier per cycle.
struct Cycle {
    eps: f64,
    kap: f64,
    period: f64,
    hip: f64,
    harmonic: f64,
    multiplier: f64,
}

#[rustfmt::skip]
const CYCLES: [Cycle; 6] = [
    Cycle { eps: 0.1, kap: 0.1, period: 1.10068457, hip: 1.001718, harmonic: 0.00416, multiplier: 0.534 },
    Cycle { eps: 0.2, kap: 0.1, period: 1.10273228, hip: 1.005191, harmonic: 0.00830, multiplier: 0.531 },
    Cycle { eps: 0.2, kap: 0.2, period: 1.10270334, hip: 1.006787, harmonic: 0.00826, multiplier: 0.288 },
    Cycle { eps: 0.5, kap: 0.2, period: 1.11663880, hip: 1.029699, harmonic: 0.02030, multiplier: 0.268 },
    Cycle { eps: 0.5, kap: 0.5, period: 1.11543642, hip: 1.038821, harmonic: 0.01957, multiplier: 0.054 },
    Cycle { eps: 1.0, kap: 0.5, period: 1.15757724, hip: 1.110441, harmonic: 0.03655, multiplier: 0.024 },
];

/// A network on its limit cycle whose period is very nearly `CYCLE` steps of 200 us.
const CYCLE: usize = 5500;

fn on_cycle(cycle: &Cycle) -> R1<Rk4> {
    let mut config = r1_config(cycle.eps, cycle.kap);
    config.natural_period = 1.1 * 1.1 / cycle.period;
    let mut net: R1<Rk4> = config.build(micros(200)).unwrap();
    run(&mut net, 40 * CYCLE as u64);
    net
}

#[test]
fn period_is_that_of_the_table() {
    for Cycle { eps, kap, period, .. } in CYCLES {
        let mut net: R1<Rk4> = r1(eps, kap, micros(500));
        run(&mut net, 80_000);
        let mut crossings = Crossings::new(0.0005);
        for _ in 0..12_000 {
            let state = net.state();
            crossings.sample(state.displacement[0], state.velocity[0] * W);
            net.step();
        }
        let measured = crossings.period(4);
        assert!((measured - period).abs() < 2e-8, "eps {eps} kap {kap}: {measured} s");
    }
}

#[test]
fn amplitude_and_harmonics_are_those_of_the_table() {
    for cycle in &CYCLES {
        let mut net = on_cycle(cycle);
        let (mut largest, mut first, mut third) = ([0.0_f64; 4], [0.0; 2], [0.0; 2]);
        for step in 0..CYCLE {
            let u = net.state().displacement;
            let angle = step as f64 / CYCLE as f64 * core::f64::consts::TAU;
            for (sums, order) in [(&mut first, 1.0), (&mut third, 3.0)] {
                sums[0] += u[0] * (order * angle).cos();
                sums[1] += u[0] * (order * angle).sin();
            }
            largest = core::array::from_fn(|i| largest[i].max(u[i]));
            net.step();
        }
        let ratio = third[0].hypot(third[1]) / first[0].hypot(first[1]);
        let Cycle { eps, kap, hip, harmonic, .. } = cycle;
        assert!((ratio - harmonic).abs() < 1e-5, "eps {eps} kap {kap}: {ratio}");
        assert!((largest[0] - hip).abs() < 2e-6 && (largest[1] - hip).abs() < 2e-6, "eps {eps} kap {kap}: {largest:?}");
        if (*eps, *kap) == (0.5, 0.5) {
            assert!((largest[2] - 1.038707).abs() < 2e-6 && (largest[3] - 1.038707).abs() < 2e-6, "{largest:?}");
        }
    }
}

#[test]
fn fundamentals_hold_the_wanted_phases() {
    let mut net = on_cycle(&CYCLES[4]);
    let mut sums = [[0.0; 2]; 4];
    for step in 0..CYCLE {
        let (sin, cos) = (step as f64 / CYCLE as f64 * core::f64::consts::TAU).sin_cos();
        for (sum, u) in sums.iter_mut().zip(net.state().displacement) {
            *sum = [sum[0] + u * cos, sum[1] - u * sin];
        }
        net.step();
    }
    let phase = sums.map(|[cos, sin]| sin.atan2(cos).to_degrees());
    for (joint, want) in [(1, 180.0), (2, -99.858), (3, 80.142)] {
        let lead = apart(phase[joint] - phase[0], 0.0);
        assert!(apart(lead, want).abs() < 1e-3, "joint {joint}: {lead}");
    }
}

type Matrix = [[f64; 8]; 8];

fn flat(state: &OscillatorState<4, f64>) -> [f64; 8] {
    core::array::from_fn(|i| if i < 4 { state.displacement[i] } else { state.velocity[i - 4] })
}

fn times(a: &Matrix, b: &Matrix) -> Matrix {
    core::array::from_fn(|i| core::array::from_fn(|j| (0..8).map(|k| a[i][k] * b[k][j]).sum()))
}

fn largest(matrix: &Matrix) -> f64 {
    matrix.iter().flatten().fold(0.0, |most: f64, m| most.max(m.abs()))
}

/// Derivative of the state after one cycle by the state before it, by central differences.
fn monodromy(net: &R1<Rk4>) -> Matrix {
    let after = |i: usize, delta: f64| {
        let (mut moved, mut state) = (*net, net.state());
        if i < 4 {
            state.displacement[i] += delta
        } else {
            state.velocity[i - 4] += delta
        }
        moved.set_state(&state).unwrap();
        run(&mut moved, CYCLE as u64);
        flat(&moved.state())
    };
    let columns: Matrix = core::array::from_fn(|i| {
        let (up, down) = (after(i, 1e-4), after(i, -1e-4));
        core::array::from_fn(|row| (up[row] - down[row]) / 2e-4)
    });
    core::array::from_fn(|row| core::array::from_fn(|column| columns[column][row]))
}

#[test]
fn leading_multiplier_is_that_of_the_table() {
    for cycle in &CYCLES {
        let matrix = monodromy(&on_cycle(cycle));
        // Powers of the matrix tend to the projector on the multiplier 1, motion along the cycle; take that out of it.
        let projector = (0..10).fold(matrix, |power, _| times(&power, &power));
        let mut rest: Matrix = core::array::from_fn(|i| core::array::from_fn(|j| matrix[i][j] - projector[i][j]));
        // The logarithm of |rest^(2^n)| grows by 2^n times that of the largest multiplier that is left.
        let mut sizes = vec![0.0];
        for _ in 0..12 {
            let size = largest(&rest);
            sizes.push(2.0 * sizes[sizes.len() - 1] + size.ln());
            let unit = rest.map(|row| row.map(|m| m / size));
            rest = times(&unit, &unit);
        }
        let multiplier = ((sizes[12] - sizes[11]) / 1024.0).exp();
        let Cycle { eps, kap, multiplier: want, .. } = cycle;
        assert!((multiplier - want).abs() < 1e-3, "eps {eps} kap {kap}: {multiplier}");
    }
}

/// Root mean square distance from the nearest point of the limit cycle.
fn distance(cycle: &[OscillatorState<4, f64>], state: &OscillatorState<4, f64>) -> f64 {
    let point = flat(state);
    let square = |on: &OscillatorState<4, f64>| flat(on).iter().zip(point).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
    (cycle.iter().map(square).fold(f64::MAX, f64::min) / 4.0).sqrt()
}

#[test]
fn locks_from_every_start() {
    for (eps, kap, bound) in [(0.2, 0.2, 16.0), (0.5, 0.2, 7.0), (0.5, 0.5, 5.0), (1.0, 0.5, 4.0)] {
        let mut net: R1<Rk4> = r1(eps, kap, micros(4000));
        run(&mut net, 20_000);
        let cycle: Vec<_> = (0..300)
            .map(|_| {
                net.step();
                net.state()
            })
            .collect();
        let mut random = Random(7);
        let mut locked: Vec<f64> = (0..400)
            .map(|start| {
                // Half of the starts are close to rest, which is the hardest place: every direction leads away from it.
                net.set_state(&random.state(if start % 2 == 0 { 0.08 } else { 2.0 })).unwrap();
                let mut last = 0.0;
                for twentieth in 0..600 {
                    // 0.1 is 5 degrees of phase and 5 percent of amplitude.
                    if distance(&cycle, &net.state()) > 0.1 {
                        last = f64::from(twentieth) * 0.04;
                    }
                    run(&mut net, 10);
                }
                last
            })
            .collect();
        locked.sort_by(f64::total_cmp);
        let slowest = locked[399];
        assert!(slowest < bound, "eps {eps} kap {kap}: {slowest} s");
    }
}
