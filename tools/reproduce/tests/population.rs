//! The population simulator against the core's network, published states and itself.

use cpg_core::network::graph::{HipKnee, LeftRight};
use cpg_core::network::thesis::{Thesis, ThesisConfig};
use cpg_core::{Generator as _, OscillatorState, Scalar};
use gait_fit::search::{Network, NetworkState, Random};
use joint_units::Period;
use proptest::prelude::*;
use reproduce::{
    Errors, Genes, Grid, Objective, Parameter, Target, angles, errors, from_config, reference_errors, set_s,
};

/// Sets S and D from (25, -15, 45, 15) deg, (0, 0, 100, -100) deg/s: states of an integration at a relative tolerance of 1e-13.
#[test]
fn the_reference_reproduces_known_states() {
    let oracle: [(_, usize, [f64; 4], [f64; 4]); 6] = [
        (
            "S",
            1,
            [21.82992943, -11.85925676, 33.54044639, 26.47416213],
            [58.9042312, -63.1325473, 143.8963842, -143.8955467],
        ),
        (
            "S",
            5,
            [-14.55038153, 23.93777372, 5.82090636, 54.28533973],
            [32.9124628, -29.8871814, -93.3813624, 96.4481142],
        ),
        (
            "S",
            60,
            [-15.07451379, 24.37252529, 10.48830253, 49.60750735],
            [18.9446074, -19.4968234, -126.0894025, 128.9866155],
        ),
        (
            "D",
            1,
            [21.91594648, -11.76584769, 28.46292312, 32.14194813],
            [59.1414853, -62.6891498, 240.8686267, -229.9781319],
        ),
        (
            "D",
            5,
            [-14.21350745, 24.23911089, 59.28887116, 2.06312782],
            [34.5003618, -28.6900132, -21.1024046, -0.9747476],
        ),
        (
            "D",
            60,
            [-14.70078395, 24.62915018, 60.49385656, 0.94747051],
            [23.5694475, -17.7197493, 28.4545859, -48.3405419],
        ),
    ];
    for (set, seconds, a, z) in oracle {
        let start = set_s().start;
        let network = match set {
            "S" => set_s(),
            _ => Network { start, ..from_config(&ThesisConfig::set_d()) },
        };
        let got = network.run(1e-3, 1000 * seconds);
        for i in 0..4 {
            let angle = got.displacement[i] + network.joints[i].offset;
            // Local errors of the fourth order, over a minute of a knee at twice the stride frequency.
            assert!((angle - a[i]).abs() < 2e-6, "set {set} at {seconds} s, joint {i}: {angle} for {}", a[i]);
            assert!((got.velocity[i] - z[i]).abs() < 1e-4, "set {set} at {seconds} s: {:?}", got.velocity);
        }
    }
}

/// The core's network from the same state, away from its bounds: the same equations, so the same to rounding.
#[test]
fn core_and_search_have_the_same_equations() {
    fn core_run<T: Scalar>(config: &ThesisConfig<T>, steps: usize, of: impl Fn(f64) -> T) -> OscillatorState<4, T> {
        let mut net: Thesis<T> = config.build::<LeftRight, HipKnee, _>(Period::MILLISECOND).expect("set S");
        let start = set_s().start;
        let state = OscillatorState { displacement: start.displacement.map(&of), velocity: start.velocity.map(&of) };
        net.set_state(&state).expect("inside of the bounds");
        for _ in 0..steps {
            net.step();
        }
        net.state()
    }
    // Gains that are all different, so that no two links can be mistaken for one another.
    fn config<T: Scalar>() -> ThesisConfig<T> {
        let mut config = ThesisConfig::<T>::set_s();
        config.difference = [[2010, 1500], [3012, 2500]].map(|pair| pair.map(|k| T::ratio(k, 10_000)));
        config.product = [[125, 90], [129, 60]].map(|pair| pair.map(|k| T::ratio(k, 10_000)));
        config
    }
    let (double, single) = (config::<f64>(), config::<f32>());
    let network = Network { start: set_s().start, ..from_config(&double) };
    let ours = network.run(1e-3, 5000);
    let in_double = core_run(&double, 5000, |x| x);
    let in_single = core_run(&single, 5000, |x| x as f32);
    for i in 0..4 {
        assert!((ours.displacement[i] - in_double.displacement[i]).abs() < 1e-9, "{ours:?} {in_double:?}");
        assert!((ours.velocity[i] - in_double.velocity[i]).abs() < 1e-8);
        assert!((ours.displacement[i] - f64::from(in_single.displacement[i])).abs() < 2e-3, "{in_single:?}");
    }
}

fn individuals(seed: u64, count: usize) -> (Vec<Network>, Target) {
    let (mut random, base) = (Random::new(seed), set_s());
    let genes = Genes::thesis(base);
    let networks = (0..count).map(|_| genes.decode(&random.point(12))).collect();
    (networks, Target::of_network(&base, 5.0, 5))
}

/// f32 lanes at 1 ms against f64 at 1 ms, for every cost in the box that is not beyond a thousand degrees.
#[test]
fn the_lanes_agree_with_the_reference() {
    let (networks, target) = individuals(11, 200);
    let mut compared = 0;
    for (network, got) in networks.iter().zip(errors(&networks, &target, Grid::FINE, true)) {
        let want = reference_errors(network, &target, Grid::FINE);
        if want.rmse_deg() < 1000.0 {
            compared += 1;
            let terms =
                |e: &Errors| [e.square, e.rate_square, e.integral_square, e.signed, e.rate_signed, e.integral_signed];
            let size = terms(&want).map(f64::abs);
            for (i, (a, b)) in terms(&got).into_iter().zip(terms(&want)).enumerate() {
                // A signed mean may be near 0 where its square is not.
                let scale = size[i].max(size[i % 3].sqrt() * f64::from(u8::from(i > 2)));
                assert!((a - b).abs() < 1e-3 * scale.max(1e-3), "term {i}: {a} for {b} of {network:?}");
            }
        }
    }
    assert!(compared > 50, "{compared}");
}

/// An individual's score does not depend on the others in its batch or on the number of threads.
#[test]
fn scores_do_not_depend_on_batch_or_threads() {
    let (networks, target) = individuals(5, 77);
    let bits = |all: &[Errors]| -> Vec<u64> { all.iter().map(|e| e.square.to_bits()).collect() };
    let together = bits(&errors(&networks, &target, Grid::SEARCH, false));
    let alone: Vec<u64> =
        networks.iter().flat_map(|n| bits(&errors(std::slice::from_ref(n), &target, Grid::SEARCH, false))).collect();
    assert_eq!(together, alone);
    assert_eq!(together, bits(&errors(&networks, &target, Grid::SEARCH, true)));
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        assert_eq!(together, pool.install(|| bits(&errors(&networks, &target, Grid::SEARCH, false))));
    }
}

/// Errors as their definition has them, from angles that one network after the other has in f32.
fn plain_squares(network: &Network, target: &Target, grid: Grid) -> u64 {
    let step_s = target.sample_s / grid.steps_per_sample as f64;
    let c = 0.5 * step_s;
    let fold = |of: &dyn Fn(&gait_fit::search::Oscillator) -> f64| network.joints.map(|joint| of(&joint) as f32);
    let (damping, cubic) = (fold(&|j| c * (j.alpha + j.difference)), fold(&|j| j.alpha * j.p / c));
    let (spring, offset) = (fold(&|j| (c * j.mu) * (c * j.mu)), fold(&|j| j.offset));
    let (difference, product) = (fold(&|j| c * j.difference), fold(&|j| c * j.product));
    let acceleration = |x: &[f32; 4], v: &[f32; 4]| -> [f32; 4] {
        std::array::from_fn(|i| {
            let (side, leg) = ([1, 0, 3, 2][i], [2, 3, 0, 1][i]);
            let damped = (-(v[i] * v[i])).mul_add(cubic[i], damping[i]);
            let sum = (-x[i]).mul_add(spring[i], damped * v[i]);
            (v[leg] * x[leg]).mul_add(product[i], (-v[side]).mul_add(difference[i], sum))
        })
    };
    let each = |of: &dyn Fn(usize) -> f32| -> [f32; 4] { std::array::from_fn(of) };
    let mut x = network.start.displacement.map(|x| x as f32);
    let mut v = network.start.velocity.map(|v| (0.5 * step_s * v) as f32);
    let mut sum = 0.0f32;
    for angles in &target.angles {
        for _ in 0..grid.steps_per_sample {
            let k1 = acceleration(&x, &v);
            let x2 = each(&|i| x[i] + v[i]);
            let k2 = acceleration(&x2, &each(&|i| v[i] + k1[i]));
            let v3 = each(&|i| v[i] + k2[i]);
            let k3 = acceleration(&each(&|i| x2[i] + k1[i]), &v3);
            let k4 = acceleration(&each(&|i| 2f32.mul_add(v3[i], x[i])), &each(&|i| 2f32.mul_add(k3[i], v[i])));
            let middle = each(&|i| k2[i] + k3[i]);
            let first = each(&|i| k1[i] + middle[i]);
            x = each(&|i| first[i].mul_add(2.0 / 3.0, 2f32.mul_add(v[i], x[i])));
            v = each(&|i| ((first[i] + middle[i]) + k4[i]).mul_add(1.0 / 3.0, v[i]));
        }
        for i in 0..4 {
            let e = (angles[i] as f32 - offset[i]) - x[i];
            sum = e.mul_add(e, sum);
        }
    }
    (f64::from(sum) / (4.0 * target.angles.len() as f64)).to_bits()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// Every score of a population of any size, on any number of threads, has the bits of the plain computation of its network.
    #[test]
    fn scores_are_those_of_the_plain_computation(
        seed in 0u64..10_000, count in 1usize..120, threads in 1usize..4, is_fine in any::<bool>(),
    ) {
        let (networks, mut target) = individuals(seed, count);
        target.angles.truncate(40);
        target.rates.truncate(40);
        let grid = if is_fine { Grid::FINE } else { Grid::SEARCH };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        for all in [false, true] {
            let got = pool.install(|| errors(&networks, &target, grid, all));
            prop_assert_eq!(got.len(), count);
            for (index, (got, network)) in got.iter().zip(&networks).enumerate() {
                if got.square.is_finite() {
                    prop_assert_eq!(got.square.to_bits(), plain_squares(network, &target, grid), "{} of {}", index, count);
                }
            }
        }
    }
}

/// With the largest product gains some individuals diverge: their cost is +infinity, and the others are not affected.
#[test]
fn a_diverged_individual_costs_infinity() {
    let base = set_s();
    let target = Target::of_network(&base, 5.0, 5);
    let mut wild = base;
    for joint in &mut wild.joints {
        (joint.product, joint.p) = (1.0, 1e-6);
    }
    let all = errors(&[wild, base, wild], &target, Grid::SEARCH, true);
    for objective in [Objective::ANGLE, Objective::Squared([1.0, 0.1, 1.0]), Objective::Signed([1.0, 0.1, 1.0])] {
        let costs: Vec<f64> = all.iter().map(|e| objective.cost(e)).collect();
        assert_eq!((costs[0], costs[2]), (f64::INFINITY, f64::INFINITY), "{objective:?}");
        assert!(costs[1].abs() < 1e-3, "{objective:?}: {costs:?}");
    }
    assert_eq!(all[0].rmse_deg(), f64::INFINITY);
    assert!(angles(&[wild, base], &target, Grid::SEARCH)[0].is_empty());
}

/// Rates and integrals in closed form: a target that is the network's own motion, moved by one degree.
#[test]
fn the_three_terms_are_those_of_the_formula() {
    let base = set_s();
    let mut target = Target::of_network(&base, 5.0, 5);
    for (angles, rates) in target.angles.iter_mut().zip(&mut target.rates) {
        for i in 0..4 {
            angles[i] += 1.0;
            rates[i] += 2.0;
        }
    }
    let got = errors(&[base], &target, Grid::SEARCH, true)[0];
    // e = 1: its integral is t, the mean of t^2 over 1000 samples up to 5 s is 25/3 (1 + 3/2000 + ...).
    let (t, t2) = (2.5025, 25.0 / 3.0 * 1.001 * 2.001 / 2.0);
    for (got, want) in [(got.square, 1.0), (got.rate_square, 4.0), (got.integral_square, t2)] {
        assert!((got / want - 1.0).abs() < 1e-3, "{got} for {want}");
    }
    for (got, want) in [(got.signed, 1.0), (got.rate_signed, 2.0), (got.integral_signed, t)] {
        assert!((got - want).abs() < 1e-3 * want, "{got} for {want}");
    }
    assert!((Objective::Squared([1.0, 0.5, 2.0]).cost(&got) - (1.0 + 2.0 + 2.0 * t2)).abs() < 0.02);
}

/// The thesis' signed fitness prefers a network far above the target to the true one.
#[test]
fn the_signed_form_rewards_a_wrong_network() {
    let base = set_s();
    let target = Target::of_network(&base, 5.0, 5);
    let mut above = base;
    for joint in &mut above.joints {
        joint.offset += 40.0;
    }
    let all = errors(&[base, above], &target, Grid::SEARCH, true);
    let signed = Objective::Signed([1.0, 0.0, 1.0]);
    assert!(signed.cost(&all[1]) < signed.cost(&all[0]) - 30.0);
    let squared = Objective::Squared([1.0, 0.0, 1.0]);
    assert!(squared.cost(&all[1]) > squared.cost(&all[0]) + 1000.0);
}

/// At 5 ms some individuals of a wide box have a lower error than at 1 ms: the reason for the second score.
#[test]
fn a_champion_needs_a_second_score_at_a_finer_step() {
    let base = set_s();
    let genes = Genes::all(base);
    let target = Target::of_network(&base, 5.0, 5);
    let mut random = Random::new(2);
    let networks: Vec<Network> = (0..3000).map(|_| genes.decode(&random.point(32))).collect();
    let (coarse, fine) =
        (errors(&networks, &target, Grid::SEARCH, false), errors(&networks, &target, Grid::FINE, false));
    let both = coarse.iter().zip(&fine).filter(|(a, b)| a.rmse_deg() < 1e4 && b.rmse_deg() < 1e4);
    let (mut all, mut wrong, mut flattered) = (0, 0, 0);
    for (coarse, fine) in both {
        all += 1;
        wrong += usize::from((coarse.square / fine.square - 1.0).abs() > 0.01);
        flattered += usize::from(coarse.square < 0.99 * fine.square);
    }
    assert!(all > 1000 && flattered > 0 && wrong < all / 3, "{flattered} of {wrong} of {all}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Time stretched by r, hips scaled by s and knees by s': the same motion, stretched and scaled. The fit to recorded gait depends on it.
    #[test]
    fn the_equations_are_invariant_under_scaling(
        r in 0.5..2.0f64, hips in 0.5..2.0f64, knees in 0.5..2.0f64, seed in 0u64..1000,
    ) {
        let mut random = Random::new(seed);
        let base = Genes::thesis(set_s()).and(&[Parameter::Mu]);
        let point: Vec<f64> = (0..16).map(|i| if i < 8 { 0.5 * random.unit() } else { random.unit() }).collect();
        let network = base.decode(&point);
        let s = [hips, hips, knees, knees];
        let mut other = network;
        for (i, joint) in other.joints.iter_mut().enumerate() {
            let leg = s[(i + 2) % 4];
            joint.alpha *= r;
            joint.mu *= r;
            joint.difference *= r;
            joint.p /= s[i] * s[i] * r * r;
            joint.product *= r * s[i] / (leg * leg);
            other.start.displacement[i] *= s[i];
            other.start.velocity[i] *= s[i] * r;
        }
        let steps = 400;
        let want: NetworkState = network.run(1e-3, steps);
        let got = other.run(1e-3 / r, steps);
        for (i, s) in s.into_iter().enumerate() {
            prop_assume!(want.displacement[i].abs() < 1e3);
            prop_assert!((got.displacement[i] / s - want.displacement[i]).abs() < 1e-7, "{got:?} {want:?}");
            prop_assert!((got.velocity[i] / (s * r) - want.velocity[i]).abs() < 1e-6);
        }
    }
}
