//! The cell networks: exact amplitudes and periods of the primary gaits from random starts, the symmetry relations of the secondary ones.

use cpg_core::math::first_order::{Flow, rk4};
use cpg_core::network::symmetric_cells::{LegGait, LegNetwork, NeuronLegNetwork, QuadrupedGait, QuadrupedNetwork};
use cpg_core::oscillator::fitzhugh_nagumo::FitzHughNagumo;

/// Splitmix64 in -1..1, so that every run sees the same starts.
fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *seed;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

fn settle<const D: usize>(flow: &impl Flow<f64, D>, seed: &mut u64, time: f64, dt: f64) -> [f64; D] {
    let mut state = std::array::from_fn(|_| random(seed));
    for _ in 0..(time / dt) as u32 {
        rk4(flow, &mut state, dt);
    }
    state
}

fn phases<const D: usize, const N: usize>(s: &[f64; D]) -> [f64; N] {
    let angle = |k: usize| s[2 * k + 1].atan2(s[2 * k]) / std::f64::consts::TAU;
    std::array::from_fn(|k| angle(k) - angle(0))
}

fn apart(a: f64, b: f64) -> f64 {
    ((a - b + 0.5).rem_euclid(1.0) - 0.5).abs()
}

fn radius<const D: usize>(s: &[f64; D], k: usize) -> f64 {
    s[2 * k].hypot(s[2 * k + 1])
}

#[test]
fn the_four_primary_gaits_attract_every_start() {
    let mut seed = 1;
    for gait in [LegGait::SlowHop, LegGait::Run, LegGait::FastHop, LegGait::Walk] {
        for _ in 0..20 {
            let mut state = settle(&LegNetwork::of(gait), &mut seed, 60.0, 1e-2);
            for (k, (got, want)) in phases::<8, 4>(&state).into_iter().zip(gait.phases()).enumerate() {
                assert!(apart(got, f64::from(want)) < 1e-6, "{gait:?} cell {k}: {got}");
                assert!((radius(&state, k) - 1.378405).abs() < 1e-5, "{gait:?}: {}", radius(&state, k));
            }
            let angle = state[1].atan2(state[0]);
            for _ in 0..100 {
                rk4(&LegNetwork::of(gait), &mut state, 1e-2);
            }
            assert!(
                apart(state[1].atan2(state[0]) / std::f64::consts::TAU, angle / std::f64::consts::TAU) < 1e-5,
                "one period is one unit of time"
            );
        }
    }
}

/// The secondary gaits by their symmetry: which cells agree now, and which half a period later; both senses of lead arise.
#[test]
fn gallops_and_skip_have_their_symmetry_and_break_the_rest() {
    let mut seed = 7;
    for gait in [LegGait::GallopWalk, LegGait::GallopRun, LegGait::Skip] {
        let (mut leads, mut lags) = (0, 0);
        for _ in 0..40 {
            let state = settle(&LegNetwork::of(gait), &mut seed, 200.0, 1e-2);
            let [_, two, three, four] = phases::<8, 4>(&state);
            let broken = match gait {
                LegGait::GallopWalk => {
                    assert!(apart(three, 0.0) < 1e-6 && apart(two, four) < 1e-6);
                    two
                }
                LegGait::GallopRun => {
                    assert!(apart(three, 0.5) < 1e-6 && apart(four - two, 0.5) < 1e-6);
                    two
                }
                _ => {
                    assert!(apart(two, 0.5) < 1e-6 && apart(four - three, 0.5) < 1e-6);
                    three
                }
            };
            // Neither in phase nor in antiphase: a sixth of a cycle to either side.
            assert!(apart(broken, 1.0 / 6.0) < 1e-5 || apart(broken, -1.0 / 6.0) < 1e-5, "{gait:?}: {broken}");
            if apart(broken, 1.0 / 6.0) < 1e-5 { leads += 1 } else { lags += 1 }
        }
        assert!(leads > 0 && lags > 0, "{gait:?}: the start decides who leads, {leads} to {lags}");
    }
}

#[test]
fn neurons_as_cells_keep_the_phases_and_the_periods() {
    let mut seed = 3;
    let e = 0.02;
    for (gait, couplings, period) in [
        (LegGait::SlowHop, [e, e, e], 39.4744),
        (LegGait::Run, [-e, -e, e], 39.1257),
        (LegGait::FastHop, [e, -e, -e], 39.1257),
        (LegGait::Walk, [-e, e, -e], 39.1257),
    ] {
        let flow = NeuronLegNetwork { neuron: FitzHughNagumo::standard(0.5), couplings };
        for _ in 0..12 {
            let mut state = settle(&flow, &mut seed, 6000.0, 0.05);
            let mut onsets = [vec![], vec![], vec![], vec![]];
            for step in 0..20_000 {
                let before = state;
                rk4(&flow, &mut state, 0.02);
                for (k, onsets) in onsets.iter_mut().enumerate() {
                    if before[2 * k] < 0.0 && state[2 * k] >= 0.0 {
                        onsets.push((f64::from(step) - before[2 * k] / (state[2 * k] - before[2 * k])) * 0.02);
                    }
                }
            }
            let cycles = onsets[0].len() - 1;
            let measured = (onsets[0][cycles] - onsets[0][0]) / cycles as f64;
            assert!((measured - period).abs() < 2e-4, "{gait:?}: {measured}");
            for (k, want) in gait.phases().into_iter().enumerate() {
                let lag = (onsets[k][1] - onsets[0][1]) / measured;
                assert!(apart(lag, f64::from(want)) < 1e-3, "{gait:?} cell {k}: {lag}");
            }
        }
    }
}

#[test]
fn the_seven_gaits_of_eight_cells_attract_every_start() {
    let table = [
        (QuadrupedGait::Pronk, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        (QuadrupedGait::Pace, [0.0, 0.5, 0.0, 0.5, 0.0, 0.5, 0.0, 0.5]),
        (QuadrupedGait::Bound, [0.0, 0.0, 0.5, 0.5, 0.0, 0.0, 0.5, 0.5]),
        (QuadrupedGait::Trot, [0.0, 0.5, 0.5, 0.0, 0.0, 0.5, 0.5, 0.0]),
        (QuadrupedGait::Jump, [0.0, 0.0, 0.25, 0.25, 0.5, 0.5, 0.75, 0.75]),
        (QuadrupedGait::Walk, [0.0, 0.5, 0.25, 0.75, 0.5, 0.0, 0.75, 0.25]),
        (QuadrupedGait::ReverseWalk, [0.0, 0.5, 0.75, 0.25, 0.5, 0.0, 0.25, 0.75]),
    ];
    let mut seed = 5;
    for (gait, want) in table {
        assert_eq!(gait.phases(), want.map(|p| p as f32), "{gait:?}");
        for _ in 0..10 {
            let state = settle(&QuadrupedNetwork::of(gait), &mut seed, 100.0, 1e-2);
            for (k, got) in phases::<16, 8>(&state).into_iter().enumerate() {
                assert!(apart(got, want[k]) < 1e-6, "{gait:?} cell {k}: {got}");
                assert!((radius(&state, k) - 1.341641).abs() < 1e-5);
            }
        }
    }
}
