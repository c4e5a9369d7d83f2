//! The isolated Rayleigh oscillator against its oracle and its exact scaling laws.

mod common;

use common::{Crossings, micros, rk4, run};
use cpg_core::oscillator::rayleigh::{Rayleigh, RayleighConfig};
use cpg_core::{Generator, Integrator, OscillatorState, Rk4, Scalar, SemiImplicitEuler};
use proptest::prelude::*;

/// alpha, p, mu; period, amplitude of a, amplitude of a'.
type Oracle = ((f64, f64, f64), f64, f64, f64);

const ORACLES: [Oracle; 7] = [
    ((1.0, 5.0, 0.5), 15.25974896, 1.35036606, 0.52153371),
    ((1.0, 50.0, 0.5), 15.25974896, 0.42702324, 0.16492344),
    ((1.0, 5.0, 1.0), 6.66328686, 0.56099226, 0.51862342),
    ((1.0, 1.0, 0.2), 58.06115334, 12.63020036, 1.16711822),
    ((0.2, 5.0, 1.0), 6.29887671, 0.51822548, 0.51650459),
    ((0.01, 5.0, 1.0), 6.28322458, 0.51640235, 0.51639805),
    ((1.0, 1.0, 1.0), 6.66328686, 1.25441684, 1.15967722),
];

fn config<T: Scalar>((alpha, p, mu): (f64, f64, f64), number: impl Fn(f64) -> T) -> RayleighConfig<T> {
    RayleighConfig { alpha: number(alpha), p: number(p), mu: number(mu), offset: number(0.0) }
}

/// Period and the largest displacement and velocity on the limit cycle.
fn measure<T: Scalar, I: Integrator>(
    config: &RayleighConfig<T>,
    step: u32,
    settle: f64,
    number: impl Fn(T) -> f64,
) -> [f64; 3] {
    let h = f64::from(step) * 1e-6;
    let mut oscillator: Rayleigh<T, I> = config.build(micros(step)).unwrap();
    run(&mut oscillator, (settle / h) as u64);
    let mut crossings = Crossings::new(h);
    let (mut displacement, mut velocity) = (0.0_f64, 0.0_f64);
    while crossings.times.len() < 5 {
        let OscillatorState { displacement: [x], velocity: [v] } = oscillator.state();
        let (x, v) = (number(x), number(v));
        crossings.sample(x, v);
        (displacement, velocity) = (displacement.max(x), velocity.max(v));
        oscillator.step();
    }
    [crossings.period(4), displacement, velocity]
}

#[test]
fn period_and_amplitudes_in_f64() {
    for (parameters, period, a, rate) in ORACLES {
        // Weak damping settles at a rate of alpha.
        let settle = 100.0 + 20.0 / parameters.0;
        let measured = measure::<f64, Rk4>(&config(parameters, |x| x), 1000, settle, |x| x);
        for (measured, want, tolerance) in
            [(measured[0], period, 2e-8), (measured[1], a, 1e-6), (measured[2], rate, 1e-6)]
        {
            assert!((measured - want).abs() < tolerance, "{parameters:?}: {measured} for {want}");
        }
    }
}

#[test]
fn period_and_amplitudes_in_f32_at_one_millisecond() {
    for (parameters, period, a, rate) in ORACLES {
        let settle = 100.0 + 20.0 / parameters.0;
        let measured = measure::<f32, Rk4>(&config(parameters, |x| x as f32), 1000, settle, f64::from);
        for (measured, want) in measured.into_iter().zip([period, a, rate]) {
            let error = (measured / want - 1.0).abs();
            // Rounding pumps the amplitude at a rate that alpha has to balance: the error grows as the damping weakens.
            assert!(error < 3e-5 + 7e-6 / parameters.0, "{parameters:?}: {measured} for {want}");
        }
        let error = (measured[0] / period - 1.0).abs();
        assert!(error < 1.5e-5, "{parameters:?}: {} s for {period}", measured[0]);
    }
}

#[test]
fn semi_implicit_euler_errs_in_first_order() {
    let parameters = (1.0, 5.0, 1.0);
    let error =
        |step| measure::<f64, SemiImplicitEuler>(&config(parameters, |x| x), step, 100.0, |x| x)[0] - 6.66328686;
    let (coarse, fine) = (error(10_000), error(5_000));
    assert!(coarse > 1e-3 && (coarse / fine - 2.0).abs() < 0.05, "{coarse} {fine}");
}

#[test]
fn weak_damping_tends_to_the_closed_forms() {
    for (alpha, mu, p) in [(0.01, 1.0, 5.0), (0.05, 5.0, 0.3), (0.1, 4.0, 2.0)] {
        let eps: f64 = alpha / mu;
        let [period, a, rate] = measure::<f64, Rk4>(&config((alpha, p, mu), |x| x), 500, 20.0 / alpha, |x| x);
        let velocity = 2.0 / (3.0 * p).sqrt();
        let closed = core::f64::consts::TAU / mu * (1.0 + eps * eps / 16.0);
        assert!((period / closed - 1.0).abs() < 1e-8, "{period} {closed}");
        assert!((a * mu / velocity - 1.0).abs() < 0.2 * eps * eps && (rate / velocity - 1.0).abs() < 0.2 * eps * eps);
    }
}

#[test]
fn read_outs_are_those_of_the_weak_cycle() {
    let config = config((0.05, 3.0, 2.0), |x| x);
    let (mut fine, mut single): (Rayleigh<f64>, Rayleigh) = (
        config.build(micros(1000)).unwrap(),
        self::config((0.05, 3.0, 2.0), |x| x as f32).build(micros(1000)).unwrap(),
    );
    for tick in 0..20_000 {
        assert!((fine.amplitude() - 1.0).abs() < 0.01, "tick {tick}: {}", fine.amplitude());
        assert!((single.amplitude() - fine.amplitude()).abs() < 1e-3, "tick {tick}");
        // Phase 0 at the start, once around in 2 pi/mu.
        let even = f64::from(tick) * 1e-3 * 2.0 / core::f64::consts::TAU * 360.0;
        for phase in [fine.phase(), single.phase()] {
            let lead = common::apart(f64::from(phase.cycles()) * 360.0, even);
            assert!(lead.abs() < 2.0, "tick {tick}: {lead} deg");
        }
        fine.step();
        single.step();
    }
}

#[test]
fn sqrt_3_velocity_is_a_van_der_pol_oscillator() {
    // alpha = 2, p = 1, mu = 1: eps = 2.
    let mut oscillator: Rayleigh<f64> = config((2.0, 1.0, 1.0), |x| x).build(micros(500)).unwrap();
    let vdp = |&[y, z]: &[f64; 2]| [z, 2.0 * (1.0 - y * y) * z - y];
    // y = sqrt 3 X', y' = sqrt 3 X'' from the Rayleigh equation.
    let image = |oscillator: &Rayleigh<f64>| {
        let OscillatorState { displacement: [x], velocity: [v] } = oscillator.state();
        [v, 2.0 * (1.0 - v * v) * v - x].map(|y| 3.0_f64.sqrt() * y)
    };
    let mut y = image(&oscillator);
    for _ in 0..40_000 {
        oscillator.step();
        y = rk4(&vdp, &y, 5e-4);
    }
    let [position, rate] = image(&oscillator);
    assert!((position - y[0]).abs() < 1e-8 && (rate - y[1]).abs() < 1e-8, "{position} {}", y[0]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// With eps = alpha/mu fixed: x(t; alpha s, p q, mu s) = x(s t; alpha, p, mu) / (s sqrt q), and the offset only shifts.
    #[test]
    fn parameters_scale_the_motion_exactly(
        alpha in 0.05..2.0_f64,
        p in 0.1..20.0_f64,
        mu in 0.3..3.0_f64,
        q in 0.01..100.0_f64,
        offset in -90.0..90.0_f64,
        faster in prop::sample::select(vec![1_u32, 2, 4, 5, 8, 10]),
        start in -2.0..2.0_f64,
    ) {
        let s = f64::from(faster);
        let slow = RayleighConfig { alpha, p, mu, offset: 0.0 };
        let fast = RayleighConfig { alpha: alpha * s, p: p * q, mu: mu * s, offset };
        let mut a: Rayleigh<f64> = slow.build(micros(4000)).unwrap();
        let mut b: Rayleigh<f64> = fast.build(micros(4000 / faster)).unwrap();
        let unit = slow.build::<Rk4>(micros(1000)).unwrap().state().displacement[0];
        a.set_state(&OscillatorState { displacement: [start * unit], velocity: [0.0] }).unwrap();
        b.set_state(&OscillatorState { displacement: [start * unit / (s * q.sqrt())], velocity: [0.0] }).unwrap();
        for _ in 0..2000 {
            a.step();
            b.step();
        }
        let (a_state, b_state) = (a.state(), b.state());
        let (x, scaled) = (a_state.displacement[0] / unit, b_state.displacement[0] * s * q.sqrt() / unit);
        prop_assert!((x - scaled).abs() < 1e-9, "{} {}", x, scaled);
        let (v, scaled) = (a_state.velocity[0] / (unit * mu), b_state.velocity[0] * q.sqrt() / (unit * mu));
        prop_assert!((v - scaled).abs() < 1e-9, "{} {}", v, scaled);
        let shift = f64::from(b.angles()[0].degrees()) - b_state.displacement[0];
        prop_assert!((shift - offset).abs() < 1e-4 * (1.0 + offset.abs() + b_state.displacement[0].abs()), "{}", shift);
    }
}
