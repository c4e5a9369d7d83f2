//! Whatever configuration `build` accepts stays finite and inside its bound, and whatever it refuses it names.

mod common;

use common::{Random, micros, r1_config, r1_single, run};
use cpg_core::network::graph::Biped;
use cpg_core::network::phase_coupled::{Robust, RobustConfig};
use cpg_core::network::thesis::{Thesis, ThesisConfig, harmonic_balance_p};
use cpg_core::oscillator::rayleigh::{Rayleigh, RayleighConfig};
use cpg_core::{
    BOUND_FACTOR, BuildError, Field, Generator, Integrator, NonFinite, OscillatorState, Oscillators, Rk4, SecondOrder,
    SemiImplicitEuler, StateFault,
};
use joint_units::{Period, Radians};
use proptest::prelude::*;

type R1<I> = Robust<Biped, 4, 4, f32, I>;

/// The longest period that is accepted, at most 100 ms.
fn longest<G>(build: impl Fn(Period) -> Result<G, BuildError>) -> Result<G, TestCaseError> {
    match build(micros(Period::MAX_MICROS)) {
        Ok(generator) => Ok(generator),
        Err(BuildError::PeriodTooLong { max_micros, .. }) => {
            prop_assert!(build(micros(max_micros + 1)).is_err());
            build(micros(max_micros)).map_err(|error| TestCaseError::fail(format!("its own limit: {error}")))
        }
        Err(error) => Err(TestCaseError::fail(format!("{error}"))),
    }
}

/// From corners and random places inside the bound: never out of it, never not a number, and `settled` after 4000 steps.
fn stays_inside<F, const N: usize, I>(
    mut generator: Oscillators<F, N, f32, I>,
    settled: impl Fn(&Oscillators<F, N, f32, I>) -> bool,
) -> Result<(), TestCaseError>
where
    F: SecondOrder<f32, N>,
    I: Integrator,
{
    let limit = generator.limit();
    let mut random = Random(5);
    for start in 0..12 {
        let mut part = |limit: f32| {
            let part = random.within(0.999) as f32;
            limit * if start < 6 { part.signum() * 0.999 } else { part }
        };
        let state = OscillatorState {
            displacement: limit.displacement.map(&mut part),
            velocity: limit.velocity.map(&mut part),
        };
        prop_assert_eq!(generator.set_state(&state), Ok(()));
        for step in 0..4000 {
            generator.step();
            let now = generator.state();
            for joint in 0..N {
                let (x, v) = (now.displacement[joint], now.velocity[joint]);
                // One rounding of the conversion to velocity.
                let inside = x.abs() <= limit.displacement[joint] && v.abs() <= limit.velocity[joint] * 1.000_001;
                prop_assert!(inside, "start {} step {} joint {}: {} {}", start, step, joint, x, v);
            }
        }
        prop_assert!(settled(&generator), "start {}: {} {:?}", start, generator.amplitude(), generator.check());
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn r1_stays_inside_at_its_longest_period(
        natural_period in 0.1..10.0_f32,
        nonlinearity in 0.05..2.0_f32,
        coupling in prop::array::uniform4(0.0..2.0_f32),
        euler in any::<bool>(),
    ) {
        let config = RobustConfig { natural_period, coupling, ..r1_single(nonlinearity, 0.0) };
        if euler {
            // At 62 steps a cycle a strong link damps the motion of the cruder method, down to rest at eps = 0.05.
            let net: R1<SemiImplicitEuler> = longest(|period| config.build(period))?;
            stays_inside(net, |net| net.check().is_ok())?;
        } else {
            let net: R1<Rk4> = longest(|period| config.build(period))?;
            stays_inside(net, |net| net.check().is_ok() && (0.5..2.0).contains(&net.amplitude()))?;
        }
    }

    #[test]
    fn rayleigh_stays_inside_at_its_longest_period(
        eps in 0.05..10.0_f32,
        mu in 0.5..50.0_f32,
        log_p in -6.0..3.0_f32,
        offset in -90.0..90.0_f32,
    ) {
        let config = RayleighConfig { alpha: eps * mu, p: 10_f32.powf(log_p), mu, offset };
        let oscillator: Rayleigh = longest(|period| config.build(period))?;
        stays_inside(oscillator, |one| one.check().is_ok() && (0.1..3.0 + eps).contains(&one.amplitude()))?;
    }

    #[test]
    fn thesis_network_stays_inside_at_its_longest_period(
        difference in prop::array::uniform2(prop::array::uniform2(-0.5..3.0_f32)),
        product in prop::array::uniform2(prop::array::uniform2(-0.05..0.05_f32)),
        alpha in prop::array::uniform4(0.01..1.0_f32),
    ) {
        let mut config = ThesisConfig::<f32> { difference, product, ..ThesisConfig::set_d() };
        for (i, joint) in config.joints.iter_mut().enumerate() {
            joint.alpha = alpha[i];
            joint.p = harmonic_balance_p(alpha[i], difference[i / 2][i % 2].max(0.0), joint.mu, 20.0);
        }
        // A product gain that is too large for its set is refused by name; nothing else is.
        match config.build::<cpg_core::network::graph::LeftRight, cpg_core::network::graph::HipKnee, Rk4>(Period::MILLISECOND) {
            Err(BuildError::OutOfRange { field, .. }) => prop_assert_eq!(field.name, "product"),
            _ => {
                let net: Thesis = longest(|period| config.build(period))?;
                // Gains that differ either way can hold a joint at its bound for good: it is held, which is all that is claimed.
                stays_inside(net, |_| true)?;
            }
        }
    }
}

#[test]
fn longest_period_leaves_a_margin_for_the_links() {
    // In radians of the natural cycle: 2.5 by Runge-Kutta and 1.8 by Euler, over 35 eps + 2 kap for each of a joint's two links.
    fn longest_step<I: Integrator>(nonlinearity: f32, kap: f32) -> f64 {
        let built: Result<R1<I>, _> = r1_single(nonlinearity, kap).build(micros(Period::MAX_MICROS));
        let Err(BuildError::PeriodTooLong { max_micros, .. }) = built else { panic!("accepted") };
        f64::from(max_micros) * 1e-6 * common::W
    }
    for (measured, want) in [
        (longest_step::<Rk4>(2.0, 0.0), 2.5 / 70.0),
        (longest_step::<Rk4>(2.0, 2.0), 2.5 / 78.0),
        (longest_step::<SemiImplicitEuler>(2.0, 2.0), 1.8 / 78.0),
        // Where the damping does not matter: 0.1 rad.
        (longest_step::<Rk4>(0.1, 0.1), 0.1),
    ] {
        assert!((measured - want).abs() < 1e-5, "{measured} for {want}");
    }
}

#[test]
fn longest_period_is_that_of_the_joint_with_most_links() {
    #[derive(Debug)]
    struct Star;
    impl cpg_core::Graph<3, 2> for Star {
        const EDGES: [(usize, usize); 2] = [(0, 1), (0, 2)];
    }
    let config = RobustConfig {
        natural_period: 1.1_f32,
        nonlinearity: 2.0,
        coupling: [2.0; 2],
        phases: [joint_units::Phase(0); 3],
        amplitudes: [Radians(0.3); 3],
        offsets: [Radians(0.0); 3],
    };
    let built: Result<Robust<Star, 3, 2>, _> = config.build(micros(Period::MAX_MICROS));
    let Err(BuildError::PeriodTooLong { max_micros, .. }) = built else { panic!("{built:?}") };
    assert!((f64::from(max_micros) * 1e-6 * common::W - 2.5 / 78.0).abs() < 1e-5, "{max_micros}");
}

#[test]
fn a_state_that_leaves_is_reported_and_comes_back() {
    // Weakly damped, so that a corner inside every bound turns out of one.
    let mut net: R1<Rk4> = r1_single(0.02, 0.02).build(Period::MILLISECOND).unwrap();
    net.set_state(&OscillatorState { displacement: [2.9, -2.9, 2.9, -2.9], velocity: [-2.9, 2.9, 2.9, -2.9] }).unwrap();
    assert_eq!(net.check(), Ok(()));
    let faults = (0..200).filter(|_| {
        net.step();
        matches!(net.check(), Err(StateFault::OutOfBounds { .. }))
    });
    assert!(faults.count() > 0);
    run(&mut net, 200_000);
    assert_eq!(net.check(), Ok(()));
    assert!((net.amplitude() - 1.0).abs() < 0.06);
}

#[test]
fn a_state_outside_is_refused_and_changes_nothing() {
    let mut net: R1<Rk4> = r1_single(0.5, 0.5).build(Period::MILLISECOND).unwrap();
    let built = net.state();
    let not_finite = |name| StateFault::NotFinite { state: Field::at(name, 2) };
    let out_of_bounds = |name| StateFault::OutOfBounds { state: Field::at(name, 2) };
    let faults: [(f32, &dyn Fn(&'static str) -> StateFault); 4] = [
        (f32::NAN, &not_finite),
        (f32::INFINITY, &not_finite),
        (BOUND_FACTOR, &out_of_bounds),
        (-1e30, &out_of_bounds),
    ];
    for (value, fault) in faults {
        let mut state = built;
        state.displacement[2] = value;
        assert_eq!(net.set_state(&state), Err(fault("displacement")));
        let mut state = built;
        state.velocity[2] = value * 1.001;
        assert_eq!(net.set_state(&state), Err(fault("velocity")));
        assert_eq!(net.state(), built);
    }
}

fn refusal(change: impl Fn(&mut RobustConfig<4, 4>)) -> BuildError {
    let mut config = r1_single(0.5, 0.5);
    change(&mut config);
    let built: Result<R1<Rk4>, _> = config.build(Period::MILLISECOND);
    built.expect_err("a refusal")
}

#[test]
fn r1_names_the_field_and_its_range() {
    let range = |field, value, min, max| BuildError::OutOfRange { field, value, min, max };
    let pi = core::f32::consts::PI;
    assert_eq!(refusal(|c| c.natural_period = 0.0), range(Field::of("natural_period"), 0.0, 0.1, 100.0));
    assert_eq!(
        refusal(|c| c.natural_period = f32::NAN),
        BuildError::NotFinite { field: Field::of("natural_period"), value: NonFinite::NotANumber }
    );
    assert_eq!(refusal(|c| c.nonlinearity = -0.5), range(Field::of("nonlinearity"), -0.5, 0.01, 2.0));
    assert_eq!(refusal(|c| c.coupling[3] = 2.1), range(Field::at("coupling", 3), 2.1, 0.0, 2.0));
    assert_eq!(refusal(|c| c.amplitudes[1] = Radians(-0.1)), range(Field::at("amplitudes", 1), -0.1, 0.0, pi));
    assert_eq!(
        refusal(|c| c.offsets[2] = Radians(f32::INFINITY)),
        BuildError::NotFinite { field: Field::at("offsets", 2), value: NonFinite::Infinite }
    );
    assert_eq!(
        refusal(|c| c.offsets[2] = Radians(4.0)).to_string(),
        format!("offsets[2] = 4: must be from -{pi} to {pi}")
    );
}

#[test]
fn rayleigh_and_thesis_name_the_field() {
    let good = RayleighConfig { alpha: 1.0, p: 5.0, mu: 1.0, offset: 0.0 };
    for (config, name) in [
        (RayleighConfig { alpha: 0.0, ..good }, "alpha"),
        (RayleighConfig { p: -1.0, ..good }, "p"),
        (RayleighConfig { mu: f32::INFINITY, ..good }, "mu"),
        (RayleighConfig { offset: 361.0, ..good }, "offset"),
    ] {
        let field = match config.build::<Rk4>(Period::MILLISECOND) {
            Err(BuildError::OutOfRange { field, .. } | BuildError::NotFinite { field, .. }) => field,
            other => panic!("{name}: {other:?}"),
        };
        assert_eq!(field, Field::of(name));
    }
    for (change, field) in [
        ((|c| c.joints[3].alpha = -1.0) as fn(&mut ThesisConfig), Field::at("alpha", 3)),
        (|c| c.difference[1][0] = f32::NAN, Field::at("difference", 1)),
        (|c| c.product[1][1] = 11.0, Field::at("product", 1)),
    ] {
        let mut config = ThesisConfig::<f32>::set_s();
        change(&mut config);
        let built: Result<Thesis, _> = config.build(Period::MILLISECOND);
        match built {
            Err(BuildError::OutOfRange { field: found, .. } | BuildError::NotFinite { field: found, .. }) => {
                assert_eq!(found, field);
            }
            other => panic!("{field}: {other:?}"),
        }
    }
}

#[test]
fn six_joints_are_an_instance() {
    #[derive(Debug, Clone, Copy)]
    struct SixJoints;
    impl cpg_core::Graph<6, 7> for SixJoints {
        const EDGES: [(usize, usize); 7] = [(0, 1), (2, 3), (4, 5), (0, 2), (1, 3), (2, 4), (3, 5)];
    }
    let [hip, other_hip, knee, other_knee] = r1_config(0.5, 0.5).phases;
    let config = RobustConfig {
        natural_period: 1.1_f32,
        nonlinearity: 0.5,
        coupling: [0.5; 7],
        phases: [hip, other_hip, knee, other_knee, other_hip, hip],
        amplitudes: [Radians(0.3); 6],
        offsets: [Radians(0.0); 6],
    };
    let mut net: Robust<SixJoints, 6, 7> = config.build(Period::MILLISECOND).unwrap();
    net.set_state(&OscillatorState { displacement: [0.1, 0.0, 0.2, 0.0, 0.0, -0.1], velocity: [0.0; 6] }).unwrap();
    run(&mut net, 20_000);
    let OscillatorState { displacement: u, velocity: v } = net.state();
    for i in 0..6 {
        let lead = f64::from((-v[i]).atan2(u[i]) - (-v[0]).atan2(u[0])).to_degrees();
        let want = f64::from(config.phases[i].cycles()) * 360.0;
        assert!(common::apart(lead, want).abs() < 8.0, "joint {i}: {lead} for {want}");
    }
}
