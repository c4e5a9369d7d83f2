//! The thesis network against the oracle of DOP853 at rtol 1e-13, and what its equations do: inflation, slip, runaway.

mod common;

use common::{Crossings, Random, apart, micros, rk4, run};
use cpg_core::network::thesis::{TABLE_1, Thesis, ThesisConfig, harmonic_balance_p};
use cpg_core::oscillator::rayleigh::RayleighConfig;
use cpg_core::{BuildError, Field, Generator, OscillatorState, StateFault};
use joint_units::{Period, Phase};

/// a = (25, -15, 45, 15), z = (0, 0, 100, -100), in both sets about the offsets 5, 5, 30, 30.
const START: OscillatorState<4, f64> =
    OscillatorState { displacement: [20.0, -20.0, 15.0, -15.0], velocity: [0.0, 0.0, 100.0, -100.0] };

/// t, angles in deg, velocities in deg/s.
type Oracle = (u64, [f64; 4], [f64; 4]);

#[rustfmt::skip]
const SET_S: [Oracle; 4] = [
    (1, [21.82992943, -11.85925676, 33.54044639, 26.47416213], [58.9042312, -63.1325473, 143.8963842, -143.8955467]),
    (5, [-14.55038153, 23.93777372, 5.82090636, 54.28533973], [32.9124628, -29.8871814, -93.3813624, 96.4481142]),
    (10, [21.82367528, -12.20934447, 58.29320097, 1.97495313], [-57.6583496, 64.0146133, 58.4931421, -57.5182728]),
    (60, [-15.07451379, 24.37252529, 10.48830253, 49.60750735], [18.9446074, -19.4968234, -126.0894025, 128.9866155]),
];

// The seventh decimal of a3 at 60 s is the one that the textbook integrator below finds too.
#[rustfmt::skip]
const SET_D: [Oracle; 4] = [
    (1, [21.91594648, -11.76584769, 28.46292312, 32.14194813], [59.1414853, -62.6891498, 240.8686267, -229.9781319]),
    (5, [-14.21350745, 24.23911089, 59.28887116, 2.06312782], [34.5003618, -28.6900132, -21.1024046, -0.9747476]),
    (10, [22.08644611, -11.87492421, 54.71303876, 5.13703554], [-60.1466746, 62.1819133, -206.2503438, 178.3022176]),
    (60, [-14.70078395, 24.62915018, 60.49385686, 0.94747051], [23.5694475, -17.7197493, 28.4545859, -48.3405419]),
];

const OFFSETS: [f64; 4] = [5.0, 5.0, 30.0, 30.0];

/// Largest error of an angle in deg and of a velocity in deg/s.
fn worst(state: &OscillatorState<4, f64>, (_, angles, velocities): &Oracle) -> [f64; 2] {
    let error = |a: &[f64; 4], b: &[f64; 4]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let angle: [f64; 4] = core::array::from_fn(|i| state.displacement[i] + OFFSETS[i]);
    [error(&angle, angles), error(&state.velocity, velocities)]
}

#[test]
fn table_1_is_that_of_the_thesis() {
    let ThesisConfig { joints, difference, product, .. } = ThesisConfig::<f64>::set_s();
    assert_eq!(difference, [[0.2010, 0.2010], [0.3012, 0.3012]]);
    assert_eq!(product, [[0.0125, 0.0125], [0.0129, 0.0129]]);
    assert_eq!(joints.map(|joint| joint.alpha), [0.0014, 0.0020, 0.0108, 0.0108]);
    let p = [0.0294382668, 0.02063743642, 0.002578102924, 0.002578102924];
    for (joint, want) in joints.iter().zip(p) {
        assert!((joint.p / want - 1.0).abs() < 1e-9, "{}", joint.p);
        assert!((joint.mu - 5.711987).abs() < 1e-6);
    }
    let knee = ThesisConfig::<f64>::set_d().joints[2];
    assert!((knee.mu - 11.42397).abs() < 1e-5 && (knee.p / 0.000644525731 - 1.0).abs() < 1e-9);
    assert_eq!(ThesisConfig::<f32>::set_s().difference[0][0], 0.2010);
}

#[test]
fn oracle_states_in_f64() {
    for (name, config, oracles) in [("S", ThesisConfig::set_s(), SET_S), ("D", ThesisConfig::set_d(), SET_D)] {
        for oracle in oracles {
            let mut net: Thesis<f64> = config.build(micros(100)).unwrap();
            net.set_state(&START).unwrap();
            run(&mut net, oracle.0 * 10_000);
            let [angle, velocity] = worst(&net.state(), &oracle);
            assert!(angle < 1e-8 && velocity < 1e-7, "set {name} at {} s: {angle:e} deg, {velocity:e} deg/s", oracle.0);
        }
    }
}

#[test]
fn oracle_states_in_f32_at_one_millisecond() {
    for (name, config, oracles) in [("S", ThesisConfig::set_s(), SET_S), ("D", ThesisConfig::set_d(), SET_D)] {
        for oracle in oracles {
            let mut net: Thesis = config.build(Period::MILLISECOND).unwrap();
            net.set_state(&common::single(&START)).unwrap();
            run(&mut net, oracle.0 * 1000);
            let OscillatorState { displacement, velocity } = net.state();
            let state =
                OscillatorState { displacement: displacement.map(f64::from), velocity: velocity.map(f64::from) };
            let [angle, velocity] = worst(&state, &oracle);
            assert!(angle < 2e-4 && velocity < 4e-3, "set {name} at {} s: {angle:e} deg, {velocity:e} deg/s", oracle.0);
        }
    }
}

/// Eqs 13-16 as the thesis writes them, one line each, on a and z.
fn thesis_equations(config: &ThesisConfig<f64>) -> impl Fn(&[f64; 8]) -> [f64; 8] + use<> {
    let ThesisConfig { joints, difference: [[k12, k21], [k34, k43]], product: [[k13, k31], [k24, k42]], .. } = *config;
    let own = move |i: usize, a: f64, z: f64| {
        let RayleighConfig { alpha, p, mu, offset } = joints[i];
        alpha * (1.0 - p * z * z) * z - mu * mu * (a - offset)
    };
    let [a10, a20, a30, a40] = joints.map(|joint| joint.offset);
    move |&[a1, a2, a3, a4, z1, z2, z3, z4]| {
        [
            z1,
            z2,
            z3,
            z4,
            own(0, a1, z1) + k13 * z3 * (a3 - a30) + k12 * (z1 - z2),
            own(1, a2, z2) + k24 * z4 * (a4 - a40) + k21 * (z2 - z1),
            own(2, a3, z3) + k31 * z1 * (a1 - a10) + k34 * (z3 - z4),
            own(3, a4, z4) + k42 * z2 * (a2 - a20) + k43 * (z4 - z3),
        ]
    }
}

#[test]
fn every_gain_stands_where_the_thesis_has_it() {
    // Eight different gains, four different alphas, mus and offsets: a gain on the wrong joint cannot hide.
    let mut config = ThesisConfig::<f64>::set_d();
    config.difference = [[0.11, 0.23], [0.31, 0.47]];
    config.product = [[0.013, 0.017], [0.019, 0.029]];
    for (i, joint) in config.joints.iter_mut().enumerate() {
        joint.mu *= 1.0 + 0.03 * i as f64;
        joint.offset += i as f64;
    }
    let equations = thesis_equations(&config);
    let mut net: Thesis<f64> = config.build(micros(100)).unwrap();
    net.set_state(&START).unwrap();
    let offsets = config.joints.map(|joint| joint.offset);
    let mut y: [f64; 8] =
        core::array::from_fn(|i| if i < 4 { START.displacement[i] + offsets[i] } else { START.velocity[i - 4] });
    for _ in 0..100_000 {
        y = rk4(&equations, &y, 1e-4);
    }
    run(&mut net, 100_000);
    let OscillatorState { displacement, velocity } = net.state();
    for i in 0..4 {
        let angle = displacement[i] + offsets[i];
        assert!((angle - y[i]).abs() < 1e-8 && (velocity[i] - y[i + 4]).abs() < 1e-7, "joint {i}: {angle} {}", y[i]);
        assert!((f64::from(net.angles()[i].degrees()) - y[i]).abs() < 1e-4);
        assert!((f64::from(net.rates()[i].0).to_degrees() - y[i + 4]).abs() < 1e-3);
    }
}

#[test]
fn the_corrected_digit_is_that_of_a_second_integrator() {
    let equations = thesis_equations(&ThesisConfig::set_d());
    let mut y = [25.0, -15.0, 45.0, 15.0, 0.0, 0.0, 100.0, -100.0];
    for _ in 0..600_000 {
        y = rk4(&equations, &y, 1e-4);
    }
    assert!((y[2] - 60.493_856_86).abs() < 1e-8, "{}", y[2]);
}

/// Largest displacement of each joint over the next `steps`.
fn amplitudes(net: &mut Thesis<f64>, steps: u64) -> [f64; 4] {
    let mut most = [0.0_f64; 4];
    for _ in 0..steps {
        net.step();
        most = core::array::from_fn(|i| most[i].max(net.state().displacement[i].abs()));
    }
    most
}

#[test]
fn antiphase_inflates_the_amplitude_of_isolated_oscillators() {
    // p for 1 degree each without the links; the product links off, which are of second order.
    let mut config = ThesisConfig::<f64>::set_s();
    config.product = [[0.0; 2]; 2];
    for joint in &mut config.joints {
        joint.p = harmonic_balance_p(joint.alpha, 0.0, joint.mu, 1.0);
    }
    // The hips differ, and each gives its own factor only beside a neighbour as large: make them twins, both ways.
    for (hip, factor) in [(0, 17.0), (1, 14.2)] {
        let mut twins = config;
        (twins.joints[0], twins.joints[1]) = (config.joints[hip], config.joints[hip]);
        let mut net: Thesis<f64> = twins.build(micros(5000)).unwrap();
        net.set_state(&OscillatorState { displacement: [1.0, -1.0, 1.0, -1.0], velocity: [0.0; 4] }).unwrap();
        run(&mut net, 20_000);
        let largest = amplitudes(&mut net, 220);
        let closed_form = (1.0 + 2.0 * config.difference[0][0] / config.joints[hip].alpha).sqrt();
        assert!((closed_form - factor).abs() < 0.05);
        assert!((largest[0] / closed_form - 1.0).abs() < 0.002 && (largest[1] / closed_form - 1.0).abs() < 0.002);
        assert!((largest[2] - 7.5).abs() < 0.05 && (largest[3] - 7.5).abs() < 0.05, "{largest:?}");
    }
    assert_eq!(TABLE_1.alpha[2], TABLE_1.alpha[3]);
}

#[test]
fn it_starts_on_its_cycle_and_reads_out_an_amplitude_of_one() {
    for (name, config) in [("S", ThesisConfig::<f64>::set_s()), ("D", ThesisConfig::set_d())] {
        let mut net: Thesis<f64> = config.build(Period::MILLISECOND).unwrap();
        for second in 0..60 {
            assert!((net.amplitude() - 1.0).abs() < 0.05, "set {name} at {second} s: {}", net.amplitude());
            run(&mut net, 1000);
        }
        let mut net: Thesis<f64> = config.build(Period::MILLISECOND).unwrap();
        let largest = amplitudes(&mut net, 1100);
        for (joint, want) in [20.0, 20.0, 30.0, 30.0].into_iter().enumerate() {
            assert!((largest[joint] / want - 1.0).abs() < 0.05, "set {name} joint {joint}: {}", largest[joint]);
        }
    }
}

#[test]
fn longest_period_leaves_a_margin_for_the_links() {
    // On the most damped joint, with one link that damps: 2.5 over 35 alpha + 2 |k|.
    let mut config = ThesisConfig::<f64>::set_s();
    config.product = [[0.0; 2]; 2];
    for (k, want) in [(0.0, 2.5 / 350.0), (-10.0, 2.5 / 370.0)] {
        config.difference = [[k; 2]; 2];
        config.joints[0].alpha = 10.0;
        let built: Result<Thesis<f64>, _> = config.build(micros(Period::MAX_MICROS));
        let Err(BuildError::PeriodTooLong { max_micros, .. }) = built else { panic!("{built:?}") };
        assert!((f64::from(max_micros) * 1e-6 / want - 1.0).abs() < 1e-3, "k {k}: {max_micros} us");
    }
}

#[test]
fn equal_p_makes_unequal_hips() {
    let mut config = ThesisConfig::<f64>::set_s();
    config.product = [[0.0; 2]; 2];
    let mean = (config.joints[0].alpha + config.joints[1].alpha) / 2.0;
    let p = harmonic_balance_p(mean, config.difference[0][0], config.joints[0].mu, 20.0);
    (config.joints[0].p, config.joints[1].p) = (p, p);
    let mut net: Thesis<f64> = config.build(micros(5000)).unwrap();
    run(&mut net, 20_000);
    let [left, right, ..] = amplitudes(&mut net, 220);
    assert!((left / right - 21.2 / 18.8).abs() < 0.01, "{left} {right}");
}

#[test]
fn a_five_second_plot_shows_its_start_and_not_the_cycle() {
    let envelope = |net: &Thesis<f64>| {
        let OscillatorState { displacement, velocity } = net.state();
        core::array::from_fn::<f64, 4, _>(|i| displacement[i].hypot(velocity[i] / common::W))
    };
    let starts = [
        ("1 deg antiphase", [1.0, -1.0, 1.0, -1.0], 2.7, 4.5),
        ("1 deg in phase", [1.0; 4], 1.0, 1.03),
        ("10/15 deg antiphase", [10.0, -10.0, 15.0, -15.0], 16.9, 28.1),
        ("20/30 deg in phase", [20.0, 20.0, 30.0, 30.0], 11.6, 15.2),
    ];
    for (name, displacement, hips, knees) in starts {
        let mut net: Thesis<f64> = ThesisConfig::set_s().build(Period::MILLISECOND).unwrap();
        net.set_state(&OscillatorState { displacement, velocity: [0.0; 4] }).unwrap();
        run(&mut net, 5000);
        for (joint, want) in [hips, hips, knees, knees].into_iter().enumerate() {
            let now = envelope(&net)[joint];
            assert!((now / want - 1.0).abs() < 0.02, "{name}, joint {joint}: {now} deg");
        }
    }
}

/// Upward crossings of each joint in the next 15 s, at 5 ms a step.
fn quarter_minute(net: &mut Thesis<f64>) -> [Crossings; 4] {
    let mut crossings: [Crossings; 4] = core::array::from_fn(|_| Crossings::new(5e-3));
    for _ in 0..3000 {
        let OscillatorState { displacement, velocity } = net.state();
        for (joint, crossings) in crossings.iter_mut().enumerate() {
            crossings.sample(displacement[joint], velocity[joint]);
        }
        net.step();
    }
    crossings
}

/// By how many degrees each joint is ahead of the left hip, from the mean time of the last eight crossings.
fn leads(crossings: &[Crossings; 4]) -> [f64; 4] {
    let mean = |crossings: &Crossings| crossings.times[crossings.times.len() - 8..].iter().sum::<f64>() / 8.0;
    let period = crossings[0].period(7);
    core::array::from_fn(|i| apart((mean(&crossings[0]) - mean(&crossings[i])) / period * 360.0, 0.0))
}

#[test]
fn left_and_right_lock_but_hip_and_knee_slip() {
    for (start, mismatch, slip, error) in [
        (0.0, 0.0, -0.15, 0.08),
        (90.0, 0.0, -0.15, 0.08),
        (180.0, 0.0, -0.15, 0.08),
        (0.0, 0.01, 3.1, 0.2),
        (0.0, 0.02, 6.4, 0.2),
        (0.0, 0.05, 16.3, 0.2),
    ] {
        let mut config = ThesisConfig::<f64>::set_s();
        for knee in &mut config.joints[2..] {
            knee.mu *= 1.0 + mismatch;
        }
        for (knee, side) in config.phases[2..].iter_mut().zip([0.0, 180.0]) {
            *knee = Phase::from_cycles((start + side) / 360.0);
        }
        let mut net: Thesis<f64> = config.build(micros(5000)).unwrap();
        run(&mut net, 20_000);
        let frequency = quarter_minute(&mut net).map(|crossings| 360.0 / crossings.period(12));
        let [left_hip, right_hip, left_knee, right_knee] = frequency;
        assert!((left_hip - right_hip).abs() < 0.02 && (left_knee - right_knee).abs() < 0.02, "{frequency:?}");
        let measured = left_knee - left_hip;
        assert!((measured - slip).abs() < error, "mismatch {mismatch}: {measured} deg/s");
    }
}

#[test]
fn random_starts_end_at_any_angle_between_hip_and_knee() {
    let mut random = Random(3);
    let mut sum = [0.0; 2];
    for start in 0..24 {
        let mut net: Thesis<f64> = ThesisConfig::set_s().build(micros(5000)).unwrap();
        let limit = net.limit();
        let mut state = random.state(1.0 / 6.0);
        for i in 0..4 {
            state.displacement[i] *= limit.displacement[i];
            state.velocity[i] *= limit.velocity[i];
        }
        net.set_state(&state).unwrap();
        run(&mut net, 40_000);
        let lead = leads(&quarter_minute(&mut net));
        assert!(apart(lead[1], 180.0).abs() < 2.0 && apart(lead[2] - lead[3], 180.0).abs() < 2.0, "{start}: {lead:?}");
        let (sin, cos) = lead[2].to_radians().sin_cos();
        sum = [sum[0] + cos / 24.0, sum[1] + sin / 24.0];
    }
    // The resultant would be 1 if hip and knee locked; of 24 uniform angles it is below 0.5 in all but 0.2 percent of draws.
    let resultant = sum[0].hypot(sum[1]);
    assert!(resultant < 0.5, "{resultant}");
}

#[test]
fn hips_lock_up_to_three_and_a_half_percent() {
    let lead = |mismatch: f64| {
        let mut config = ThesisConfig::<f64>::set_s();
        config.product = [[0.0; 2]; 2];
        config.joints[0].mu *= 1.0 + mismatch / 2.0;
        config.joints[1].mu *= 1.0 - mismatch / 2.0;
        let mut net: Thesis<f64> = config.build(micros(5000)).unwrap();
        run(&mut net, 60_000);
        let first = apart(leads(&quarter_minute(&mut net))[1], 180.0);
        (first, apart(leads(&quarter_minute(&mut net))[1] - first, 180.0).abs())
    };
    for (mismatch, want) in [(0.01, 16.5), (0.02, 35.0), (0.03, 58.0)] {
        let (error, drift) = lead(mismatch);
        assert!((error.abs() - want).abs() < 1.0 && drift < 0.1, "{mismatch}: {error} deg, moving by {drift}");
    }
    // Past the range the angle between the hips is never the same again.
    assert!(lead(0.04).1 > 5.0);
}

#[test]
fn the_equations_run_away_where_the_network_does_not_go() {
    // p as for isolated oscillators of 20 and 30 degrees: the links make the cycle so fast that runaway is near.
    let mut config = ThesisConfig::<f64>::set_s();
    for (joint, degrees) in config.joints.iter_mut().zip([20.0, 20.0, 30.0, 30.0]) {
        joint.p = harmonic_balance_p(joint.alpha, 0.0, joint.mu, degrees);
    }
    let equations = thesis_equations(&config);
    let mut y = [305.0, 305.0, 330.0, 330.0, 5000.0, 5000.0, 5000.0, 5000.0];
    for _ in 0..250_000 {
        y = rk4(&equations, &y, 2e-5);
    }
    assert!(y[0] > 9e4, "{y:?}");

    // A product link turns the spring negative above mu^2/k: 2610 deg/s on the left, 2529 on the right.
    let mut net: Thesis<f64> = config.build(Period::MILLISECOND).unwrap();
    let limit = net.limit();
    for (velocity, want) in limit.velocity.into_iter().zip([2610.1, 2529.2, 2610.1, 2529.2]) {
        assert!((velocity - want).abs() < 0.1, "{velocity}");
    }
    let fast = OscillatorState { displacement: [300.0; 4], velocity: [5000.0; 4] };
    assert_eq!(net.set_state(&fast), Err(StateFault::OutOfBounds { state: Field::at("velocity", 0) }));
    let mut random = Random(11);
    for start in 0..200 {
        let mut state = random.state(1.0);
        for i in 0..4 {
            state.displacement[i] *= limit.displacement[i];
            state.velocity[i] *= limit.velocity[i];
        }
        net.set_state(&state).unwrap();
        run(&mut net, 10_000);
        assert_eq!(net.check(), Ok(()), "start {start}");
    }
}

#[test]
fn a_set_whose_cycle_reaches_runaway_is_refused() {
    let mut config = ThesisConfig::<f32>::set_s();
    for joint in &mut config.joints {
        joint.p = 1e-5;
    }
    let refused: Result<Thesis, _> = config.build(Period::MILLISECOND);
    let Err(BuildError::OutOfRange { field, max, .. }) = refused else { panic!("{refused:?}") };
    assert_eq!(field, Field::at("product", 0));
    assert!(max < 0.0125 && max > 0.0, "{max}");
}
