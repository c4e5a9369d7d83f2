//! The single oscillators and neuron networks against reference periods and extremes (computed with an adaptive eighth-order method).

use cpg_core::math::first_order::{Flow, rk4};
use cpg_core::oscillator::fitzhugh_nagumo::FitzHughNagumo;
use cpg_core::oscillator::hopf::{AdaptiveHopf, Hopf};
use cpg_core::oscillator::matsuoka::Matsuoka;
use cpg_core::oscillator::morris_lecar::MorrisLecar;
use cpg_core::oscillator::terman_wang::TermanWang;
use cpg_core::oscillator::van_der_pol::VanDerPol;

/// What a settled orbit does.
#[derive(Debug)]
struct Orbit<const D: usize> {
    period: f64,
    low: [f64; D],
    high: [f64; D],
    /// Times of the upward crossings of each coordinate through `level`, in the last period.
    onsets: [f64; D],
}

/// Settles for `transient`, then follows ten cycles, marked by upward crossings of coordinate 0 through `level`.
fn orbit<const D: usize>(flow: &impl Flow<f64, D>, start: [f64; D], dt: f64, transient: f64, level: f64) -> Orbit<D> {
    let mut state = start;
    for _ in 0..(transient / dt) as u64 {
        rk4(flow, &mut state, dt);
    }
    let mut orbit = Orbit { period: f64::NAN, low: state, high: state, onsets: [f64::NAN; D] };
    let mut marks = vec![];
    let mut step = 0u64;
    while marks.len() < 11 {
        let before = state;
        rk4(flow, &mut state, dt);
        let slopes = (flow.derivative(&before), flow.derivative(&state));
        for i in 0..D {
            orbit.low[i] = orbit.low[i].min(state[i]);
            orbit.high[i] = orbit.high[i].max(state[i]);
            if before[i] < level && state[i] >= level {
                let at = (step as f64 + crossing(before[i], state[i], slopes.0[i] * dt, slopes.1[i] * dt, level)) * dt;
                orbit.onsets[i] = at;
                if i == 0 {
                    marks.push(at);
                }
            }
        }
        step += 1;
        assert!((step as f64) * dt < 1e5, "no oscillation");
    }
    orbit.period = (marks[10] - marks[0]) / 10.0;
    orbit
}

/// Where in a step the cubic through both ends and slopes crosses the level.
fn crossing(a: f64, b: f64, slope_a: f64, slope_b: f64, level: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let s = 0.5 * (low + high);
        let (s2, s3) = (s * s, s * s * s);
        let value = a * (1.0 - 3.0 * s2 + 2.0 * s3)
            + b * (3.0 * s2 - 2.0 * s3)
            + slope_a * (s - 2.0 * s2 + s3)
            + slope_b * (s3 - s2);
        if value < level { low = s } else { high = s }
    }
    0.5 * (low + high)
}

fn close(got: f64, want: f64, tolerance: f64) {
    assert!((got - want).abs() <= tolerance, "{got} is not {want} within {tolerance}");
}

#[test]
fn van_der_pol_periods_and_amplitudes() {
    for (mu, period, highest) in [
        (0.1, 6.2871113, 2.000104),
        (0.2, 6.2988767, 2.000414),
        (0.5, 6.3806758, 2.002488),
        (1.0, 6.6632869, 2.008620),
        (2.0, 7.6298745, 2.019891),
        (5.0, 11.6122307, 2.021508),
    ] {
        let orbit = orbit(&VanDerPol { mu }, [2.0, 0.0], 1e-3, 300.0, 0.0);
        close(orbit.period, period, 1e-7);
        close(orbit.high[0], highest, 1e-6);
    }
}

#[test]
fn hopf_is_the_circle_and_returns_by_the_closed_form() {
    let flow = Hopf { gain: 8.0, square_radius: 1.0, frequency: std::f64::consts::TAU };
    let settled = orbit(&flow, [1.0, 0.0], 1e-4, 3.0, 0.0);
    close(settled.period, 1.0, 1e-9);
    close(settled.high[0], 1.0, 1e-6);
    let mut state = [0.1, 0.0];
    for _ in 0..1000 {
        rk4(&flow, &mut state, 1e-4);
    }
    let radius = (state[0] * state[0] + state[1] * state[1]).sqrt();
    close(radius, 1.0 / (1.0 + 99.0 * (-1.6f64).exp()).sqrt(), 1e-9);
    close(radius, 0.21828154, 1e-8);
}

#[test]
fn adaptive_hopf_learns_the_frequency_of_its_input() {
    for (start, settled_by) in [(5.0, 22.0), (7.5, 25.4), (10.0, 82.5)] {
        let mut flow = AdaptiveHopf { gain: 8.0, square_radius: 1.0, learning: 0.9, input: 0.0 };
        let mut state = [1.0, 0.0, start];
        let dt = 1e-3;
        let (mut last_outside, mut low, mut high, mut sum, mut count) = (0.0, f64::MAX, f64::MIN, 0.0, 0.0);
        for step in 0..300_000u32 {
            let t = f64::from(step) * dt;
            // Mid-step value of the held input: second order in dt.
            flow.input = (6.0 * (t + 0.5 * dt)).sin();
            rk4(&flow, &mut state, dt);
            if (state[2] - 6.0).abs() > 0.06 {
                last_outside = t;
            }
            if t > 200.0 {
                low = low.min(state[2]);
                high = high.max(state[2]);
                sum += state[2];
                count += 1.0;
            }
        }
        close(sum / count, 5.99728, 2e-4);
        close(high - low, 0.0752, 2e-3);
        close(last_outside, settled_by, 1.0);
    }
}

#[test]
fn fitzhugh_nagumo_periods_and_extremes() {
    for (current, period) in [(0.35, 45.6105010), (0.5, 39.4744150), (1.0, 36.6987944)] {
        let orbit = orbit(&FitzHughNagumo::standard(current), [-1.0, 0.0], 5e-3, 2000.0, 0.0);
        close(orbit.period, period, 1e-6);
        if current == 0.5 {
            close(orbit.low[0], -1.970407, 1e-5);
            close(orbit.high[0], 1.852117, 1e-5);
            close(orbit.low[1], -0.245742, 1e-5);
            close(orbit.high[1], 1.393773, 1e-5);
        }
    }
}

#[test]
fn morris_lecar_periods_and_extremes() {
    for (current, period) in [(95.0, 91.1779613), (100.0, 85.2906410), (150.0, 66.1617527)] {
        let orbit = orbit(&MorrisLecar { current }, [30.0, 0.1], 5e-3, 4000.0, 0.0);
        close(orbit.period, period, 2e-5);
        if current == 100.0 {
            close(orbit.low[0], -50.336069, 1e-4);
            close(orbit.high[0], 33.325804, 1e-4);
        }
    }
}

#[test]
fn terman_wang_periods_and_extremes() {
    for (current, period) in [(0.2, 190.9436219), (0.8, 125.3133274)] {
        let orbit = orbit(&TermanWang::standard(current), [1.0, 1.0], 2e-3, 1000.0, 0.0);
        close(orbit.period, period, 1e-4);
        if current == 0.8 {
            close(orbit.low[0], -2.031248, 1e-5);
            close(orbit.high[0], 1.983731, 1e-5);
            close(orbit.low[1], 0.706208, 1e-5);
            close(orbit.high[1], 5.197160, 1e-5);
        }
    }
}

/// Settles a network, checks period, largest firing rate and the onset of each neuron as a fraction of the period after neuron 1's.
fn network<const N: usize, const D: usize>(flow: Matsuoka<N, f64>, period: f64, onsets: [f64; N], highest: f64)
where
    Matsuoka<N, f64>: Flow<f64, D>,
{
    // Begins near the wanted order, with unequal potentials so that no symmetric unstable state is kept.
    let mut start = [0.0; D];
    for (i, s) in start.iter_mut().take(N).enumerate() {
        *s = 0.3 * (std::f64::consts::TAU * onsets[i]).cos() + 0.01 * (1.0 + i as f64).sin();
    }
    let transient = 60.0 * period;
    let orbit = orbit(&flow, start, period / 8000.0, transient, 1e-9);
    close(orbit.period, period, 2e-5);
    close(orbit.high[0], highest, 3e-5);
    let mut lags: [f64; N] =
        std::array::from_fn(|i| ((orbit.onsets[i] - orbit.onsets[0]) / orbit.period + 1e-3).rem_euclid(1.0) - 1e-3);
    let mut onsets = onsets;
    if flow
        .inhibition
        .iter()
        .enumerate()
        .all(|(i, row)| row.iter().enumerate().all(|(j, &a)| i == j || a == flow.inhibition[0][1]))
    {
        // All to all: the neurons are interchangeable, so the order is the start's; the spacing is the network's.
        lags.sort_by(f64::total_cmp);
        onsets.sort_by(f64::total_cmp);
    }
    for (i, (lag, want)) in lags.into_iter().zip(onsets).enumerate() {
        let off = (lag - want + 0.5).rem_euclid(1.0) - 0.5;
        assert!(off.abs() < 2e-3, "neuron {i} begins at {lag} instead of {want}");
    }
}

fn all_to_all<const N: usize>(weight: f64) -> [[f64; N]; N] {
    std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 0.0 } else { weight }))
}

#[test]
fn matsuoka_pairs() {
    network(Matsuoka::standard(all_to_all::<2>(2.5)), 29.58181, [0.0, 0.5], 0.61269);
    network(Matsuoka::standard(all_to_all::<2>(1.5)), 17.57652, [0.0, 0.5], 0.51340);
    let fast = Matsuoka { rise: 0.05, adaptation: 0.6, ..Matsuoka::standard(all_to_all::<2>(2.5)) };
    network(fast, 1.47909, [0.0, 0.5], 0.61268);
    let hu = Matsuoka { rise: 0.25, adaptation: 0.5, ..Matsuoka::standard(all_to_all::<2>(2.0)) };
    network(hu, 1.89038, [0.0, 0.5], 0.46039);
    // Twice the input: twice the amplitude, the same period.
    let strong = Matsuoka { tonic: 2.0, ..Matsuoka::standard(all_to_all::<2>(2.5)) };
    network(strong, 29.58181, [0.0, 0.5], 2.0 * 0.61269);
}

#[test]
fn matsuoka_threes() {
    let thirds = [0.0, 2.0 / 3.0, 1.0 / 3.0];
    network(Matsuoka::standard(all_to_all::<3>(2.5)), 32.62563, thirds, 0.67462);
    let cyclic = |forward: f64, reverse: f64| {
        let mut a = [[0.0; 3]; 3];
        for i in 0..3 {
            a[(i + 1) % 3][i] = forward;
            a[i][(i + 1) % 3] = reverse;
        }
        a
    };
    network(Matsuoka { fatigue: 0.0, ..Matsuoka::standard(cyclic(2.5, 0.0)) }, 3.65765, thirds, 0.72110);
    network(Matsuoka::standard(cyclic(2.5, 0.0)), 3.45735, thirds, 0.41078);
    network(Matsuoka::standard(cyclic(2.5, 1.5)), 19.90607, thirds, 0.60405);
    let chain = [[0.0, 2.5, 0.0], [1.25, 0.0, 1.25], [0.0, 2.5, 0.0]];
    network(Matsuoka::standard(chain), 29.58181, [0.0, 0.5, 0.0], 0.61268);
}

#[test]
fn matsuoka_fours_and_sixes() {
    let between = |n: usize, weight: f64, group: fn(usize) -> usize| {
        move |i: usize, j: usize| if group(i) != group(j) && n > 0 { weight } else { 0.0 }
    };
    let trot = between(4, 1.25, |i| i / 2);
    let trot = std::array::from_fn(|i| std::array::from_fn(|j| trot(i, j)));
    network::<4, 8>(Matsuoka::standard(trot), 29.58181, [0.0, 0.0, 0.5, 0.5], 0.61268);
    let ring = [[0.0, 1.25, 0.0, 1.25], [1.25, 0.0, 1.25, 0.0], [0.0, 1.25, 0.0, 1.25], [1.25, 0.0, 1.25, 0.0]];
    network::<4, 8>(Matsuoka::standard(ring), 29.58181, [0.0, 0.5, 0.0, 0.5], 0.61269);
    network::<4, 8>(Matsuoka::standard(all_to_all::<4>(2.0)), 32.81097, [0.0, 0.5, 0.75, 0.25], 0.68767);
    let tripod = between(6, 2.5 / 3.0, |i| i % 2);
    let tripod: [[f64; 6]; 6] = std::array::from_fn(|i| std::array::from_fn(|j| tripod(i, j)));
    network::<6, 12>(Matsuoka::standard(tripod), 29.58181, [0.0, 0.5, 0.0, 0.5, 0.0, 0.5], 0.61268);
    let mut cyclic = tripod;
    for i in 0..6 {
        cyclic[(i + 2) % 6][i] = 2.5;
    }
    let onsets = [0.0, 1.0 / 2.0, 2.0 / 3.0, 1.0 / 6.0, 1.0 / 3.0, 5.0 / 6.0];
    network::<6, 12>(Matsuoka::standard(cyclic), 3.52142, onsets, 0.28588);
}

/// An even ring that inhibits one way, without adaptation, freezes with every other neuron on.
#[test]
fn an_even_one_way_ring_freezes() {
    let mut ring = [[0.0; 4]; 4];
    for (i, row) in ring.iter_mut().enumerate() {
        row[(i + 1) % 4] = 2.5;
    }
    let flow = Matsuoka { fatigue: 0.0, ..Matsuoka::standard(ring) };
    let mut state = [0.3, 0.1, 0.25, 0.05, 0.0, 0.0, 0.0, 0.0];
    for _ in 0..100_000 {
        rk4(&flow, &mut state, 1e-2);
    }
    let rates = flow.rates(&state);
    for (rate, want) in rates.into_iter().zip([1.0, 0.0, 1.0, 0.0]) {
        close(rate, want, 1e-9);
    }
}

/// The two conditions for a pair to oscillate, on both sides of each.
#[test]
fn a_pair_oscillates_only_between_its_bounds() {
    let swings = |weight: f64, fatigue: f64| {
        let flow = Matsuoka { fatigue, ..Matsuoka::standard(all_to_all::<2>(weight)) };
        let mut state = [0.4, 0.1, 0.0, 0.0];
        let mut span = (f64::MAX, f64::MIN);
        for step in 0..400_000 {
            rk4(&flow, &mut state, 1e-2);
            if step > 300_000 {
                span = (span.0.min(state[0]), span.1.max(state[0]));
            }
        }
        span.1 - span.0 > 1e-3
    };
    // a > 1 + Tr/Ta = 1.0833 and a < 1 + b.
    assert!(!swings(1.05, 2.5) && swings(1.15, 2.5));
    assert!(swings(2.4, 1.5) && !swings(2.6, 1.5));
}

/// The board's number type on the board's step follows the same cycles.
#[test]
fn f32_at_the_control_period_keeps_the_period() {
    fn cycles<const D: usize>(flow: impl Flow<f32, D>, start: [f32; D], dt: f32, steps: u32) -> f64 {
        let mut state = start;
        let mut marks = vec![];
        for step in 0..steps {
            let before = state[0];
            rk4(&flow, &mut state, dt);
            if before < 0.1 && state[0] >= 0.1 {
                marks.push(f64::from(step) + f64::from((0.1 - before) / (state[0] - before)));
            }
        }
        let last = marks.len() - 1;
        (marks[last] - marks[2]) / (last - 2) as f64 * f64::from(dt)
    }
    close(cycles(VanDerPol { mu: 1.0 }, [2.0, 0.0], 6e-3, 200_000), 6.6632869, 1e-4);
    close(cycles(FitzHughNagumo::standard(0.5), [-1.0, 0.0], 0.036, 200_000), 39.4744150, 1e-3);
    close(cycles(MorrisLecar { current: 100.0 }, [30.0, 0.1], 0.08, 200_000), 85.2906410, 3e-3);
    close(cycles(TermanWang::standard(0.8), [1.0, 1.0], 0.05, 200_000), 125.3133274, 2e-2);
    let pair = Matsuoka::<2, f32>::standard([[0.0, 2.5], [2.5, 0.0]]);
    close(cycles(pair, [0.4, 0.1, 0.0, 0.0], 0.027, 200_000), 29.58181, 1e-3);
}
