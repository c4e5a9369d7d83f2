//! Matsuoka's networks of neurons that inhibit each other (Biol. Cybern. 52, 1985, and 56, 1987), on which both papers build: ten networks,
//! and what changes the period and the size of a pair's motion.
//!
//! The numbers 1 to 10 are ours, in the order in which the thesis describes the networks.

use cpg_core::math::first_order::{Flow, rk4};
use cpg_core::oscillator::matsuoka::Matsuoka;
use picture::{Curve, Panel};

use super::figure::Figure;
use super::study::Table;

/// Integration step in units of Tr.
const STEP: f64 = 1e-2;
/// Units of Tr until a network has settled.
const SETTLING: f64 = 1500.0;
/// Units of Tr after which a network without an onset counts as one that does not oscillate.
const LONGEST: f64 = 400.0;
/// Cycles over which a period is measured.
const CYCLES: usize = 8;
/// Firing rate above which a neuron counts as on.
const ON: f64 = 1e-9;

/// A settled motion.
#[derive(Debug, Clone)]
struct Oscillation {
    /// Units of Tr; `None` if the network does not oscillate.
    period: Option<f64>,
    /// Begin of each neuron's activity after that of the first, in cycles.
    onsets: Vec<f64>,
    /// Largest firing rate of the first neuron.
    peak: f64,
    /// Time in cycles (or in tens of Tr without an oscillation) and the firing rates of all neurons over two cycles.
    course: Vec<(f64, Vec<f64>)>,
}

/// A network with its number, topology and weights in words.
struct Network {
    number: &'static str,
    topology: &'static str,
    weights: &'static str,
    motion: Oscillation,
}

/// Settles a network that begins near the given order of its neurons, and measures its motion.
fn settled<const N: usize, const D: usize>(network: &Matsuoka<N, f64>, order: [f64; N]) -> Oscillation
where
    Matsuoka<N, f64>: Flow<f64, D>,
{
    let mut state = [0.0; D];
    for (i, (potential, turn)) in state.iter_mut().zip(order).enumerate() {
        // Unequal, so that no symmetric state that repels is kept.
        *potential = 0.3 * (std::f64::consts::TAU * turn).cos() + 0.01 * (1.0 + i as f64).sin();
    }
    // Faster networks take smaller steps and settle sooner.
    let step = STEP * network.rise;
    for _ in 0..(SETTLING / STEP) as usize {
        rk4(network, &mut state, step);
    }
    let (mut marks, mut onsets, mut peak, mut at) = (vec![], [0.0; N], 0.0_f64, 0_usize);
    let settled = state;
    while marks.len() <= CYCLES && (marks.len() as f64 + 1.0) * LONGEST / STEP > at as f64 {
        let before = state;
        rk4(network, &mut state, step);
        for i in 0..N {
            if before[i] < ON && state[i] >= ON {
                let time = (at as f64 + (ON - before[i]) / (state[i] - before[i])) * step;
                onsets[i] = time;
                marks.extend((i == 0).then_some(time));
            }
        }
        peak = peak.max(state[0]);
        at += 1;
    }
    let period = marks.first().zip(marks.get(CYCLES)).map(|(first, last)| (last - first) / CYCLES as f64);
    let lag = |onset: f64| period.map(|period| ((onset - onsets[0]) / period + 1e-3).rem_euclid(1.0) - 1e-3);
    let onsets = onsets.iter().filter_map(|onset| lag(*onset)).collect();
    let (length, unit) = period.map_or((20.0 * network.rise, 10.0 * network.rise), |period| (2.0 * period, period));
    let (mut state, mut course) = (settled, vec![]);
    let every = (length / step / 300.0).max(1.0) as usize;
    for k in 0..=(length / step) as usize {
        if k % every == 0 {
            course.push((k as f64 * step / unit, network.rates(&state).to_vec()));
        }
        rk4(network, &mut state, step);
    }
    Oscillation { period, onsets, peak, course }
}

fn all_to_all<const N: usize>(weight: f64) -> [[f64; N]; N] {
    std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 0.0 } else { weight }))
}

/// Neurons of different groups inhibit each other.
fn between<const N: usize>(weight: f64, group: fn(usize) -> usize) -> [[f64; N]; N] {
    std::array::from_fn(|i| std::array::from_fn(|j| if group(i) == group(j) { 0.0 } else { weight }))
}

/// Each neuron inhibits the next and, with the second weight, the one before.
fn ring<const N: usize>(forward: f64, reverse: f64) -> [[f64; N]; N] {
    let mut weights = [[0.0; N]; N];
    for i in 0..N {
        weights[(i + 1) % N][i] += forward;
        weights[i][(i + 1) % N] += reverse;
    }
    weights
}

/// The networks 1 to 10, and the tenth with a cycle in each of its triplets.
fn networks() -> Vec<Network> {
    let thirds = [0.0, 2.0 / 3.0, 1.0 / 3.0];
    let tripod = || between::<6>(2.5 / 3.0, |i| i % 2);
    let mut cyclic = tripod();
    for i in 0..6 {
        cyclic[(i + 2) % 6][i] = 2.5;
    }
    let chain = [[0.0, 2.5, 0.0], [1.25, 0.0, 1.25], [0.0, 2.5, 0.0]];
    let standard = Matsuoka::standard;
    let of = |number, topology, weights, motion| Network { number, topology, weights, motion };
    let halves = [0.0, 0.5, 0.0, 0.5, 0.0, 0.5];
    vec![
        of("1", "two neurons, reciprocal", "2.5", settled::<2, 4>(&standard(all_to_all(2.5)), [0.0, 0.5])),
        of("2", "three, all to all", "2.5", settled::<3, 6>(&Matsuoka::standard(all_to_all(2.5)), thirds)),
        of("3", "three in a cycle", "2.5", settled::<3, 6>(&Matsuoka::standard(ring(2.5, 0.0)), thirds)),
        of(
            "4",
            "three in a cycle and back",
            "2.5, back 1.5",
            settled::<3, 6>(&Matsuoka::standard(ring(2.5, 1.5)), thirds),
        ),
        of(
            "5",
            "three in a chain",
            "1.25 inwards, 2.5 outwards",
            settled::<3, 6>(&Matsuoka::standard(chain), [0.0, 0.5, 0.0]),
        ),
        of(
            "6",
            "four: two pairs, reciprocal between the pairs (trot)",
            "1.25",
            settled::<4, 8>(&Matsuoka::standard(between(1.25, |i| i / 2)), [0.0, 0.0, 0.5, 0.5]),
        ),
        of("7", "four, all to all", "2", settled::<4, 8>(&Matsuoka::standard(all_to_all(2.0)), [0.0, 0.5, 0.75, 0.25])),
        of(
            "8",
            "four in a cycle, without adaptation",
            "2.5, b = 0",
            settled::<4, 8>(&Matsuoka { fatigue: 0.0, ..Matsuoka::standard(ring(2.5, 0.0)) }, [0.0, 0.5, 0.0, 0.5]),
        ),
        of(
            "9",
            "four in a ring, both neighbours",
            "1.25",
            settled::<4, 8>(&Matsuoka::standard(ring(1.25, 1.25)), [0.0, 0.5, 0.0, 0.5]),
        ),
        of(
            "10",
            "six: two triplets, reciprocal (tripod)",
            "2.5/3",
            settled::<6, 12>(&Matsuoka::standard(tripod()), halves),
        ),
        of(
            "10 with cycles",
            "the same with a cycle in each triplet",
            "2.5/3, cycles 2.5",
            settled::<6, 12>(&Matsuoka::standard(cyclic), [0.0, 0.5, 2.0 / 3.0, 1.0 / 6.0, 1.0 / 3.0, 5.0 / 6.0]),
        ),
    ]
}

/// The figures, and the table of the networks.
pub(super) fn run() -> (Vec<Figure>, Table) {
    let networks = networks();
    let panel = |network: &Network| {
        let course = &network.motion.course;
        let neuron = |i: usize| {
            Curve::new(&format!("neuron {}", i + 1), course.iter().map(|(time, rates)| (*time, rates[i])).collect())
        };
        let curves = (0..course[0].1.len()).map(neuron).collect();
        let (title, time) = match network.motion.period {
            Some(period) => (format!("{}: T = {period:.3} Tr", network.number), "time, cycles"),
            None => (format!("{}: no oscillation", network.number), "time, 10 Tr"),
        };
        Panel::curves(&title, time, "firing rate", curves)
    };
    let equations = "Tr x' = -x - b v - sum a y + s, Ta v' = -v + y, y = max(0, x); Tr = 1, Ta = 12, b = 2.5, s = 1";
    let mut figure = Figure::new(
        "matsuoka-networks",
        "Matsuoka's networks",
        "Firing rates over two cycles, after settling. Network 8, an even cycle without adaptation, stops with every other neuron on.",
        &format!("{equations}; weights a as in the table; Runge-Kutta, order 4, 0.01 Tr, f64"),
        networks.iter().map(panel).collect(),
    );
    figure.columns = 2;
    let row = |Network { number, topology, weights, motion }: &Network| {
        let onsets: Vec<String> = motion.onsets.iter().map(|onset| format!("{:.3}", onset + 0.0)).collect();
        vec![
            (*number).to_owned(),
            (*topology).to_owned(),
            (*weights).to_owned(),
            motion.period.map_or("none".into(), |period| format!("{period:.4}")),
            if onsets.is_empty() { "-".into() } else { onsets.join(" ") },
            format!("{:.4}", motion.peak),
        ]
    };
    let head = ["network", "topology", "weights", "period, Tr", "onsets, cycles", "largest rate of neuron 1"];
    let table = Table {
        name: "matsuoka",
        title: "Matsuoka's networks".into(),
        note: format!(
            "{equations}. The numbers are ours, in the order in which the thesis describes the networks; they are not checked against Matsuoka's papers."
        ),
        head: head.map(String::from).to_vec(),
        rows: networks.iter().map(row).collect(),
    };
    (vec![figure, control()], table)
}

/// A pair of neurons with one parameter changed at a time.
fn control() -> Figure {
    let pair = || Matsuoka::<2, f64>::standard(all_to_all(2.5));
    let base = settled::<2, 4>(&pair(), [0.0, 0.5]);
    let unit = base.period.unwrap_or(1.0);
    let panel = |title: &str, x: &str, values: &[f64], of: &dyn Fn(f64) -> Matsuoka<2, f64>| {
        let found: Vec<(f64, Oscillation)> =
            values.iter().map(|&value| (value, settled::<2, 4>(&of(value), [0.0, 0.5]))).collect();
        let period = found.iter().filter_map(|(value, motion)| Some((*value, motion.period? / unit)));
        let moving = found.iter().filter(|(_, motion)| motion.period.is_some());
        let peak = moving.map(|(value, motion)| (*value, motion.peak / base.peak));
        let curves = vec![Curve::new("period", period.collect()), Curve::new("largest rate", peak.collect())];
        Panel::curves(title, x, "relative to the standard pair", curves)
    };
    let steps =
        |from: f64, to: f64| -> Vec<f64> { (0..=10).map(|k| from + (to - from) * f64::from(k) / 10.0).collect() };
    let panels =
        vec![
            panel("tonic input: the size alone", "s", &steps(0.5, 3.0), &|tonic| Matsuoka { tonic, ..pair() }),
            panel("both time constants: the period alone", "factor on Tr and Ta", &steps(0.5, 2.0), &|factor| {
                Matsuoka { rise: factor, adaptation: 12.0 * factor, ..pair() }
            }),
            panel("weight of the inhibition: both", "a", &steps(1.2, 3.4), &|weight| {
                Matsuoka::standard(all_to_all(weight))
            }),
            panel("strength of the adaptation: both", "b", &steps(1.6, 5.0), &|fatigue| Matsuoka { fatigue, ..pair() }),
        ];
    let mut figure = Figure::new(
        "matsuoka-control",
        "Matsuoka's pair: what changes the oscillation",
        "The tonic input changes the size and leaves the period, the time constants together change the period and leave the size; weight and adaptation \
         change both.",
        "network 1; one parameter at a time, the others as in the networks above: Tr = 1, Ta = 12, b = 2.5, a = 2.5, s = 1",
        panels,
    );
    figure.columns = 2;
    figure
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against an eighth-order method elsewhere.
    #[test]
    fn periods_onsets_and_rates_are_those_of_the_oracle() {
        let wanted: [(Option<f64>, &[f64], f64); 11] = [
            (Some(29.58181), &[0.0, 0.5], 0.61269),
            (Some(32.62563), &[0.0, 0.3333, 0.6667], 0.67462),
            (Some(3.45735), &[0.0, 0.3333, 0.6667], 0.41078),
            (Some(19.90607), &[0.0, 0.3333, 0.6667], 0.60405),
            (Some(29.58181), &[0.0, 0.0, 0.5], 0.61268),
            (Some(29.58181), &[0.0, 0.0, 0.5, 0.5], 0.61268),
            (Some(32.81097), &[0.0, 0.25, 0.5, 0.75], 0.68767),
            (None, &[], 1.0),
            (Some(29.58181), &[0.0, 0.0, 0.5, 0.5], 0.61269),
            (Some(29.58181), &[0.0, 0.0, 0.0, 0.5, 0.5, 0.5], 0.61268),
            (Some(3.52142), &[0.0, 0.1667, 0.3333, 0.5, 0.6667, 0.8333], 0.28588),
        ];
        for (network, (period, onsets, peak)) in networks().iter().zip(wanted) {
            let Network { number, motion, .. } = network;
            assert_eq!(motion.period.is_some(), period.is_some(), "{number}");
            if let (Some(found), Some(wanted)) = (motion.period, period) {
                assert!((found - wanted).abs() < 1e-4, "{number}: {found}");
            }
            let mut found = motion.onsets.clone();
            found.sort_by(f64::total_cmp);
            assert_eq!(found.len(), onsets.len(), "{number}");
            assert!(found.iter().zip(onsets).all(|(a, b)| (a - b).abs() < 3e-3), "{number}: {found:?}");
            assert!((motion.peak - peak).abs() < 1e-4, "{number}: {}", motion.peak);
        }
    }

    /// Twice the input: twice the size, the same period. Half the time constants: half the period, the same size.
    #[test]
    fn input_and_time_constants_act_on_one_thing_each() {
        let pair = Matsuoka::<2, f64>::standard(all_to_all(2.5));
        let of = |pair: &Matsuoka<2, f64>| {
            let found = settled::<2, 4>(pair, [0.0, 0.5]);
            (found.period.unwrap(), found.peak)
        };
        let (period, peak) = of(&pair);
        let (same, twice) = of(&Matsuoka { tonic: 2.0, ..pair });
        assert!((same - period).abs() < 1e-5 && (twice - 2.0 * peak).abs() < 1e-5);
        let (half, size) = of(&Matsuoka { rise: 0.5, adaptation: 6.0, ..pair });
        assert!((half - 0.5 * period).abs() < 1e-5 && (size - peak).abs() < 1e-6);
    }
}
