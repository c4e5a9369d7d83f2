//! Analyses against boundaries that are known in closed form, or computed here by other means.

use std::f64::consts::TAU;

use dynamics::basin::{self, Axis};
use dynamics::bifurcation::{Sweep, sweep};
use dynamics::cycle::Cycle;
use dynamics::phase_response::{lock_range, response};
use dynamics::settle::Motion;
use dynamics::system::System;
use dynamics::tongue::{Input, Verdict, cell, unit_force};

fn system(name: &str, parameters: &[(&str, f64)]) -> System {
    let system = System::read(name).expect(name);
    parameters.iter().fold(system, |system, (parameter, value)| system.with(parameter, *value).expect(parameter))
}

fn even(from: f64, to: f64, count: usize) -> Vec<f64> {
    (0..count).map(|k| from + (to - from) * k as f64 / (count - 1) as f64).collect()
}

/// The isochrons of the Hopf oscillator are rays, so a kick by d at the angle a shifts the phase to atan2(sin a, cos a + d), whatever d.
#[test]
fn the_hopf_oscillator_has_its_closed_form_response() {
    let cycle = Cycle::of(&system("oscillator:hopf", &[("gain", 0.7)])).unwrap();
    for size in [0.1, -0.4, 0.8, 1.5] {
        for point in response(&cycle, 0, size, 24) {
            let angle = TAU * point.phase;
            let shifted = angle.sin().atan2(angle.cos() + size);
            let expected = (shifted - angle) / TAU;
            let off = point.shift.expect("it comes back") - expected;
            assert!((off - off.round()).abs() < 2e-4, "{size} at {}: {off}", point.phase);
        }
    }
}

/// Below the onset of firing the Morris-Lecar neuron has a cycle beside its rest: some kicks end at rest, and have no shift.
#[test]
fn a_kick_that_leaves_the_basin_has_no_shift() {
    let cycle = Cycle::of(&system("oscillator:morris-lecar", &[("current", 90.0)])).unwrap();
    let points = response(&cycle, 0, 20.0, 48);
    let lost = points.iter().filter(|point| point.shift.is_none()).count();
    assert!((1..24).contains(&lost), "{lost} of 48");
    assert!(points.iter().filter(|point| point.shift.is_none()).all(|point| point.distance > 0.05));
    assert_eq!(lock_range(&points, 20.0, 1), None);
}

/// First and last ratio that lock 1:1, by bisection from the middle of the predicted range.
fn measured(cycle: &Cycle, variable: usize, strength: f64, predicted: [f64; 2], pair: (u32, u32)) -> [f64; 2] {
    let locks = |ratio: f64| {
        cell(cycle, cycle.at_start(), Input { variable, ratio, strength }, &[pair]).verdict == Verdict::Locked(0)
    };
    let middle = 0.5 * (predicted[0] + predicted[1]);
    assert!(locks(middle), "the middle of {predicted:?}");
    predicted.map(|edge| {
        let (mut inside, mut outside) = (middle, middle + 2.0 * (edge - middle));
        assert!(!locks(outside), "{outside}");
        for _ in 0..9 {
            let between = 0.5 * (inside + outside);
            if locks(between) { inside = between } else { outside = between }
        }
        0.5 * (inside + outside)
    })
}

/// For a weak input the width of the lock range is that of the averaged response.
#[test]
fn the_phase_response_predicts_the_lock_range() {
    for (name, strength, kick, m) in [
        ("oscillator:van-der-pol", 0.05, 0.02, 1),
        ("oscillator:fitzhugh-nagumo", 0.02, 0.01, 1),
        ("oscillator:morris-lecar", 0.02, 0.01, 1),
        ("oscillator:matsuoka", 0.05, 0.02, 1),
        ("phase-coupled", 0.1, 0.02, 1),
        ("oscillator:fitzhugh-nagumo", 0.04, 0.01, 2),
    ] {
        let cycle = Cycle::of(&system(name, &[])).unwrap();
        // A network of joints is pushed at a velocity.
        let variable = if name == "phase-coupled" { 4 } else { 0 };
        let size = kick * cycle.orbit.amplitude[variable];
        let range = lock_range(&response(&cycle, variable, size, 60), size, m).expect("every kick comes back");
        let force = strength * unit_force(&cycle, variable);
        let predicted = range.map(|range| f64::from(m) + force * cycle.period() * range);
        let found = measured(&cycle, variable, strength, predicted, (1, m));
        let (width, known) = (found[1] - found[0], predicted[1] - predicted[0]);
        assert!((width / known - 1.0).abs() < 0.05, "{name} 1:{m}: {found:?}, predicted {predicted:?}");
    }
}

/// Where the trace of the Jacobian at the equilibrium of two states passes through zero, by bisection; the equilibrium by Newton's method.
fn hopf_onset(field: impl Fn(f64, [f64; 2]) -> [f64; 2], guess: [f64; 2], mut range: [f64; 2]) -> f64 {
    let jacobian = |p: f64, s: [f64; 2]| {
        let h = 1e-5;
        let of = |i: usize| {
            let (mut up, mut down) = (s, s);
            (up[i], down[i]) = (s[i] + h, s[i] - h);
            let (up, down) = (field(p, up), field(p, down));
            [0, 1].map(|k| (up[k] - down[k]) / (2.0 * h))
        };
        [of(0), of(1)]
    };
    let trace = |p: f64| {
        let mut s = guess;
        for _ in 0..60 {
            let ([a, c], [b, d]) = jacobian(p, s).into();
            let f = field(p, s);
            let determinant = a * d - b * c;
            s = [s[0] - (d * f[0] - b * f[1]) / determinant, s[1] - (a * f[1] - c * f[0]) / determinant];
        }
        let [[a, c], [b, d]] = jacobian(p, s);
        assert!(a * d - b * c > 0.0, "a saddle");
        a + d
    };
    let sign = trace(range[0]).signum();
    assert!(sign * trace(range[1]) < 0.0);
    for _ in 0..50 {
        let middle = 0.5 * (range[0] + range[1]);
        if trace(middle).signum() == sign { range[0] = middle } else { range[1] = middle }
    }
    range[0]
}

fn begins(sweep: &Sweep) -> f64 {
    let begins: Vec<f64> = sweep.onsets.iter().filter(|onset| onset.begins).map(|onset| onset.value).collect();
    assert_eq!(begins.len(), 1, "{:?}", sweep.onsets);
    begins[0]
}

fn ends(sweep: &Sweep) -> f64 {
    let ends: Vec<f64> = sweep.onsets.iter().filter(|onset| !onset.begins).map(|onset| onset.value).collect();
    assert_eq!(ends.len(), 1, "{:?}", sweep.onsets);
    ends[0]
}

fn near(found: f64, known: f64, part: f64) {
    assert!((found / known - 1.0).abs() < part, "{found}, known {known}");
}

/// v^2 = 1 - eps b at the Hopf bifurcations, and the current that has this equilibrium.
#[test]
fn fitzhugh_nagumo_begins_where_its_equilibrium_loses_stability() {
    let of = |v: f64| (v + 0.7) / 0.8 - v + v * v * v / 3.0;
    let v = (1.0_f64 - 0.08 * 0.8).sqrt();
    let neuron = system("oscillator:fitzhugh-nagumo", &[]);
    let [up, down] = sweep(&neuron, "current", &even(0.2, 0.5, 13), &|| ()).unwrap();
    near(begins(&up), of(-v), 0.01);
    // The bifurcation is subcritical: on the way back the cycle lives on a little below it.
    assert!(ends(&down) < of(-v) && ends(&down) > 0.95 * of(-v), "{}", ends(&down));
    let [up, down] = sweep(&neuron, "current", &even(1.2, 1.6, 13), &|| ()).unwrap();
    near(begins(&down), of(v), 0.01);
    assert!(ends(&up) > of(v));
    // The closed form agrees with the eigenvalues.
    let field = |p: f64, [v, w]: [f64; 2]| [v - v.powi(3) / 3.0 - w + p, 0.08 * (v + 0.7 - 0.8 * w)];
    near(hopf_onset(field, [-1.0, -0.4], [0.2, 0.5]), of(-v), 1e-6);
}

/// The current at which the cycle of the FitzHugh-Nagumo neuron ends: the map of returns to the line v = v of the equilibrium has a fixed point where
/// its largest rise is 0 or more. Its own integration, and no stability, kick or time is involved.
fn fold_of_fitzhugh_nagumo() -> f64 {
    let slope = |p: f64, [v, w]: [f64; 2]| [v - v.powi(3) / 3.0 - w + p, 0.08 * (v + 0.7 - 0.8 * w)];
    let step = |p: f64, s: [f64; 2], h: f64| {
        let along = |d: [f64; 2], by: f64| [s[0] + by * d[0], s[1] + by * d[1]];
        let a = slope(p, s);
        let b = slope(p, along(a, 0.5 * h));
        let c = slope(p, along(b, 0.5 * h));
        let d = slope(p, along(c, h));
        [0, 1].map(|i| s[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]))
    };
    let rise = |p: f64, at: [f64; 2], r: f64| {
        let mut s = [at[0], at[1] - r];
        let mut is_left = false;
        loop {
            let next = step(p, s, 0.02);
            is_left |= next[0] < at[0];
            if is_left && next[0] >= at[0] {
                let (mut low, mut high) = (0.0, 0.02);
                for _ in 0..40 {
                    let middle = 0.5 * (low + high);
                    if step(p, s, middle)[0] < at[0] { low = middle } else { high = middle }
                }
                return at[1] - step(p, s, low)[1] - r;
            }
            s = next;
        }
    };
    let has_cycle = |p: f64| {
        let (mut low, mut high) = (-1.2, -0.8);
        for _ in 0..60 {
            let v: f64 = 0.5 * (low + high);
            if (v + 0.7) / 0.8 - v + v.powi(3) / 3.0 < p { low = v } else { high = v }
        }
        let at = [low, (low + 0.7) / 0.8];
        let all: Vec<f64> = (1..200).map(|k| 0.004 * f64::from(k)).collect();
        let best = (0..all.len()).max_by(|&a, &b| rise(p, at, all[a]).total_cmp(&rise(p, at, all[b]))).unwrap();
        let (mut low, mut high) = (all[best.saturating_sub(1)], all[(best + 1).min(all.len() - 1)]);
        for _ in 0..60 {
            let third = (high - low) / 3.0;
            if rise(p, at, low + third) < rise(p, at, high - third) { low += third } else { high -= third }
        }
        rise(p, at, 0.5 * (low + high)) >= 0.0
    };
    let (mut without, mut with) = (0.320, 0.330);
    assert!(!has_cycle(without) && has_cycle(with));
    for _ in 0..24 {
        let middle = 0.5 * (without + with);
        if has_cycle(middle) { with = middle } else { without = middle }
    }
    with
}

/// Every onset is within what is said of it, whatever the sweep: the fold of cycles, the Hopf bifurcations of two neurons, the root of the normal form,
/// the bounds of Matsuoka's pair.
#[test]
fn an_onset_is_as_near_as_it_says() {
    let fold = fold_of_fitzhugh_nagumo();
    assert!((fold - 0.324_178_5).abs() < 2e-7, "{fold}");
    let of = |v: f64| (v + 0.7) / 0.8 - v + v * v * v / 3.0;
    let v = (1.0_f64 - 0.08 * 0.8).sqrt();
    let neuron = || system("oscillator:fitzhugh-nagumo", &[]);
    let pair = || system("oscillator:matsuoka", &[]);
    // The system, the sweep, and where it begins (on the way that begins at the first value) and ends on the way back.
    let cases = [
        (neuron(), "current", [0.3, 0.36], 41, of(-v), fold),
        (neuron(), "current", [0.2, 0.5], 13, of(-v), fold),
        (neuron(), "current", [0.31, 0.34], 100, of(-v), fold),
        (neuron(), "current", [0.32, 0.335], 6, of(-v), fold),
        (system("oscillator:hopf", &[]), "square_radius", [-0.5, 1.0], 17, 0.0, 0.0),
        (pair(), "weight", [1.01, 2.0], 9, 1.0 + 1.0 / 12.0, 1.0 + 1.0 / 12.0),
    ];
    for (system, parameter, [from, to], count, begin, end) in cases {
        let sweeps = sweep(&system, parameter, &even(from, to, count), &|| ()).unwrap();
        for (sweep, known) in sweeps.iter().zip([begin, end]) {
            let [onset] = sweep.onsets[..] else { panic!("{parameter} {from} to {to}: {:?}", sweep.onsets) };
            println!(
                "{parameter} {from} to {to}, {count}: {:.7} within {:.1e}, known {known:.7}",
                onset.value, onset.within
            );
            assert!(
                (onset.value - known).abs() <= onset.within,
                "{parameter} {from} to {to}: {onset:?}, known {known}"
            );
            assert!(onset.within < 0.02 * (to - from), "{onset:?}");
        }
    }
}

/// The equations again, with other names, and their eigenvalues.
#[test]
fn morris_lecar_begins_where_its_equilibrium_loses_stability() {
    let field = |i: f64, [v, n]: [f64; 2]| {
        let m = 0.5 * (1.0 + ((v + 1.2) / 18.0).tanh());
        let steady = 0.5 * (1.0 + ((v - 2.0) / 30.0).tanh());
        let current = i - 4.4 * m * (v - 120.0) - 8.0 * n * (v + 84.0) - 2.0 * (v + 60.0);
        [current / 20.0, 0.04 * (steady - n) * ((v - 2.0) / 60.0).cosh()]
    };
    let neuron = system("oscillator:morris-lecar", &[]);
    let [up, down] = sweep(&neuron, "current", &even(80.0, 110.0, 13), &|| ()).unwrap();
    near(begins(&up), hopf_onset(field, [-26.0, 0.13], [80.0, 110.0]), 0.01);
    // The cycle ends in a fold of cycles: Rinzel and Ermentrout 1989.
    near(ends(&down), 88.3, 0.01);
    let [_, down] = sweep(&neuron, "current", &even(190.0, 240.0, 13), &|| ()).unwrap();
    near(begins(&down), hopf_onset(field, [8.0, 0.5], [190.0, 240.0]), 0.01);
}

/// Matsuoka 1985: two neurons oscillate for a weight between 1 + Tr/Ta and 1 + b.
#[test]
fn matsuoka_oscillates_between_his_bounds() {
    for (rise, fatigue) in [(1.0, 2.5), (3.0, 2.0)] {
        let pair = system("oscillator:matsuoka", &[("rise", rise), ("fatigue", fatigue)]);
        let [up, down] = sweep(&pair, "weight", &even(0.9, 1.0 + fatigue + 0.5, 14), &|| ()).unwrap();
        near(begins(&up), 1.0 + rise / 12.0, 0.01);
        near(ends(&up), 1.0 + fatigue, 0.01);
        near(ends(&down), 1.0 + rise / 12.0, 0.01);
    }
}

/// The supercritical Hopf bifurcation: from 0 on, with the radius sqrt(m) and no hysteresis.
#[test]
fn the_normal_form_has_the_radius_of_its_root() {
    let hopf = system("oscillator:hopf", &[]);
    let [up, down] = sweep(&hopf, "square_radius", &even(-0.5, 1.0, 17), &|| ()).unwrap();
    assert!(begins(&up).abs() < 0.01 && ends(&down).abs() < 0.01);
    for point in up.points.iter().chain(&down.points) {
        let root = point.value.max(0.0).sqrt();
        let [least, most] = point.extrema(0).expect("it neither leaves nor wavers");
        assert!((most - root).abs() < 0.01 && (least + root).abs() < 0.01, "{} at {}", most, point.value);
        assert!(point.value < 0.05 || (point.period().expect("a cycle") - 1.0).abs() < 1e-3);
    }
}

/// Above 1 + b one neuron wins. The pair is symmetric, so that the one with the larger start does.
#[test]
fn the_border_between_two_winners_is_the_diagonal() {
    let pair = system("oscillator:matsuoka", &[("weight", 4.0)]);
    let values = even(-0.95, 1.0, 14);
    let axes = [Axis { variable: 0, values: values.clone() }, Axis { variable: 1, values: even(-1.0, 0.95, 14) }];
    let map = basin::map(&pair, &axes, &[0.0; 4], &|| ()).unwrap();
    assert_eq!(map.attractors.len(), 2);
    let first_wins: Vec<bool> = map
        .attractors
        .iter()
        .map(|attractor| {
            let Motion::Rest { at } = attractor else { panic!("{attractor:?}") };
            // y = s / (1 + b) of the winner.
            assert!((at[0].max(at[1]) - 1.0 / 3.5).abs() < 1e-3, "{at:?}");
            at[0] > at[1]
        })
        .collect();
    for (index, cell) in map.cells.iter().enumerate() {
        let (x1, x2) = (axes[0].values[index % 14], axes[1].values[index / 14]);
        assert!((x1 - x2).abs() < 1e-9 || first_wins[*cell] == (x1 > x2), "{x1}, {x2}");
    }
}

/// Between rest and cycle of the Morris-Lecar neuron at 90 is a cycle that repels. In reverse time it attracts: its own integration here finds
/// it, and it is the border of the map.
#[test]
fn the_border_between_rest_and_cycle_is_the_cycle_that_repels() {
    let field = |[v, n]: [f64; 2]| {
        let m = 0.5 * (1.0 + ((v + 1.2) / 18.0).tanh());
        let steady = 0.5 * (1.0 + ((v - 2.0) / 30.0).tanh());
        let current = 90.0 - 4.4 * m * (v - 120.0) - 8.0 * n * (v + 84.0) - 2.0 * (v + 60.0);
        [-current / 20.0, -0.04 * (steady - n) * ((v - 2.0) / 60.0).cosh()]
    };
    let (mut state, mut border) = ([-26.0, 0.14], vec![]);
    for step in 0..60_000 {
        // The midpoint rule with a step of 0.02 ms.
        let half = field(state);
        let middle = field([state[0] + 0.01 * half[0], state[1] + 0.01 * half[1]]);
        state = [state[0] + 0.02 * middle[0], state[1] + 0.02 * middle[1]];
        if step > 50_000 {
            border.push(state);
        }
    }
    // One turn of it.
    let turn: Vec<usize> = (1..border.len()).filter(|&k| border[k - 1][0] < -25.0 && border[k][0] >= -25.0).collect();
    let mut border = border[turn[0]..turn[1]].to_vec();
    border.push(border[0]);
    let inside = |v: f64, n: f64| {
        let crossings = border.windows(2).filter(|pair| {
            let ([v1, n1], [v2, n2]) = (pair[0], pair[1]);
            (n1 > n) != (n2 > n) && v < v1 + (n - n1) / (n2 - n1) * (v2 - v1)
        });
        crossings.count() % 2 == 1
    };
    let neuron = system("oscillator:morris-lecar", &[("current", 90.0)]);
    let axes = [Axis { variable: 0, values: even(-45.0, 0.0, 24) }, Axis { variable: 1, values: even(0.02, 0.3, 24) }];
    let map = basin::map(&neuron, &axes, &[0.0; 2], &|| ()).unwrap();
    let mut wrong = 0;
    let (mut rests, mut cycles) = (0, 0);
    for (index, cell) in map.cells.iter().enumerate() {
        let (v, n) = (axes[0].values[index % 24], axes[1].values[index / 24]);
        let rest = matches!(map.attractors[*cell], Motion::Rest { .. });
        assert!(rest || matches!(map.attractors[*cell], Motion::Cycle(_)), "{:?}", map.attractors[*cell]);
        (rests, cycles) = (rests + u32::from(rest), cycles + u32::from(!rest));
        wrong += u32::from(inside(v, n) != rest);
    }
    assert!(rests > 10 && cycles > 100, "{rests} starts rest, {cycles} oscillate");
    assert!(wrong <= 3, "{wrong} of 576 starts on the wrong side");
}
