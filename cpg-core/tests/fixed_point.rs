//! Fixed point against f64: R1 after a minute, the phase and shape generator over its cycle, sines and angles.

mod common;

use common::{Random, apart, micros, r1_single, run};
use cpg_core::gait::default_walk::default_config;
use cpg_core::math::fixed_trig;
use cpg_core::network::graph::Biped;
use cpg_core::network::phase_coupled::{Robust, RobustConfig};
use cpg_core::network::phase_coupled_fixed::FixedRobust;
use cpg_core::waveform::fixed::FixedPhaseShapeConfig;
use cpg_core::waveform::shape::{Adjustment, FourierShape, PhaseShapeConfig, Shape};
use cpg_core::{Field, Generator, OscillatorState, Rk4, StateFault};
use fixed::types::I16F16;
use joint_units::{Period, Phase, Radians};
use proptest::prelude::*;

type Fixed = FixedRobust<Biped, 4, 4>;
type Reference = Robust<Biped, 4, 4, f64, Rk4>;

const STRIDE_MS: f64 = 1100.0;

/// The same numbers as the f32 configuration, in f64.
fn reference(config: &RobustConfig<4, 4>, period: Period) -> Reference {
    let RobustConfig { phases, amplitudes, offsets, .. } = *config;
    RobustConfig {
        natural_period: f64::from(config.natural_period),
        nonlinearity: f64::from(config.nonlinearity),
        coupling: config.coupling.map(f64::from),
        phases,
        amplitudes,
        offsets,
    }
    .build(period)
    .unwrap()
}

fn float(state: &OscillatorState<4, I16F16>) -> OscillatorState<4, f64> {
    OscillatorState {
        displacement: state.displacement.map(I16F16::to_num),
        velocity: state.velocity.map(I16F16::to_num),
    }
}

fn fixed(state: &OscillatorState<4, f64>) -> OscillatorState<4, I16F16> {
    OscillatorState {
        displacement: state.displacement.map(I16F16::from_num),
        velocity: state.velocity.map(I16F16::from_num),
    }
}

/// Largest phase difference of a joint, in ms of the stride.
fn late_ms(a: &OscillatorState<4, f64>, b: &OscillatorState<4, f64>) -> f64 {
    let (a, b) = (common::phases(a), common::phases(b));
    a.iter().zip(&b).map(|(a, b)| apart(*a, *b).abs()).fold(0.0, f64::max) * STRIDE_MS / 360.0
}

/// Largest displacement of each joint over one and a half strides.
fn peaks<G: Generator<4>>(generator: &mut G, steps: u32, state: impl Fn(&G) -> OscillatorState<4, f64>) -> [f64; 4] {
    let mut peaks = [0.0f64; 4];
    for _ in 0..steps {
        generator.step();
        let now = state(generator).displacement;
        peaks = core::array::from_fn(|i| peaks[i].max(now[i].abs()));
    }
    peaks
}

/// Runs both for 60 s, the reference in finer steps: ms late, and the relative error of the amplitude.
fn after_a_minute(period_us: u32, finer: u32) -> (f64, f64) {
    let config = default_config();
    let mut ours: Fixed = config.build_fixed(micros(period_us)).unwrap();
    let mut exact = reference(&config, micros(period_us / finer));
    exact.set_state(&float(&ours.state())).unwrap();
    let steps = 60_000_000 / period_us;
    run(&mut ours, steps.into());
    run(&mut exact, (steps * finer).into());
    let late = late_ms(&float(&ours.state()), &exact.state());
    let stride = 1_650_000 / period_us;
    let a = peaks(&mut ours, stride, |net| float(&net.state()));
    let b = peaks(&mut exact, stride * finer, |net| net.state());
    let amplitude = a.iter().zip(&b).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
    (late, amplitude)
}

/// 0.2 ms of a stride of 1100 ms is asked for; a step constant of 2^-16 would give 53 ms.
#[test]
fn a_minute_at_one_kilohertz() {
    let (late, amplitude) = after_a_minute(1000, 4);
    println!("{late:.4} ms, amplitude {amplitude:.1e}");
    assert!(late < 0.03, "{late} ms");
    assert!(amplitude < 2e-5, "{amplitude}");
}

/// The amplitude is that of samples: at 10 ms the highest of them lies up to 4e-4 below the peak.
#[test]
fn other_periods() {
    for period_us in [250, 500, 2000, 5000, 10_000] {
        let (late, amplitude) = after_a_minute(period_us, 10);
        println!("{period_us} us: {late:.4} ms, amplitude {amplitude:.1e}");
        assert!(late < 0.03 && amplitude < 3e-4, "{period_us}: {late} ms, {amplitude}");
    }
}

/// Many starts, all over the state space, end on the same gait as in f64: within 1 ms after 30 s.
#[test]
fn random_starts_lock_like_the_reference() {
    let config = r1_single(0.5, 0.5);
    let mut random = Random(4);
    for _ in 0..50 {
        let start = fixed(&random.state(2.0));
        let mut ours: Fixed = config.build_fixed(Period::MILLISECOND).unwrap();
        let mut exact = reference(&config, Period::MILLISECOND);
        ours.set_state(&start).unwrap();
        exact.set_state(&float(&start)).unwrap();
        run(&mut ours, 30_000);
        run(&mut exact, 30_000);
        let late = late_ms(&float(&ours.state()), &exact.state());
        assert!(late < 1.0, "{late} ms from {start:?}");
    }
}

/// The state at 5 s from the oracle of DOP853 at rtol 1e-12, within 1e-4: seven places, from the rounding of the start to those of the stages.
#[test]
fn oracle_state() {
    let mut ours: Fixed = r1_single(0.5, 0.5).build_fixed(Period::MILLISECOND).unwrap();
    let start = OscillatorState { displacement: [0.1, 0.0, 0.0, 0.0], velocity: [0.0, 0.1, -0.1, 0.05] };
    ours.set_state(&fixed(&start)).unwrap();
    run(&mut ours, 5000);
    let now = float(&ours.state());
    let u = [1.029_652_53, -1.029_656_49, -0.208_176_73, 0.208_178_04];
    let v = [0.112_541_46, -0.112_539_70, 0.995_860_00, -0.995_862_69];
    for i in 0..4 {
        assert!((now.displacement[i] - u[i]).abs() < 1e-4, "{now:?}");
        assert!((now.velocity[i] - v[i]).abs() < 1e-4, "{now:?}");
    }
}

/// Integer read-outs, their f32 copies and the f32 network on the same state agree.
#[test]
fn read_outs() {
    let config = default_config();
    let mut ours: Fixed = config.build_fixed(Period::MILLISECOND).unwrap();
    let mut single = config.build::<Biped, Rk4>(Period::MILLISECOND).unwrap();
    for _ in 0..2000 {
        ours.step();
        single.set_state(&common::single(&float(&ours.state()))).unwrap();
        for (a, b) in ours.angles().iter().zip(single.angles()) {
            assert!((a.0 - b.0).abs() < 2.0 / 65_536.0, "{a:?} {b:?}");
        }
        for (a, b) in ours.rates().iter().zip(single.rates()) {
            assert!((a.0 - b.0).abs() < 3.0 / 65_536.0, "{a:?} {b:?}");
        }
        let turn = ours.phase().0.wrapping_sub(single.phase().0) as i32;
        assert!(turn.unsigned_abs() < 2000, "{turn}");
        assert!((ours.amplitude() - single.amplitude()).abs() < 1e-5);
        assert_eq!(ours.fixed_angles().map(|a| a.to_num::<f32>()), ours.angles().map(|a| a.0));
        assert_eq!(ours.check(), Ok(()));
    }
}

/// What the extremes do: any state inside the bound, any configuration that builds, steps without overflow (this is a debug build)
/// and stays inside.
fn any_config() -> impl Strategy<Value = RobustConfig<4, 4>> {
    (0.1f32..100.0, 0.01f32..2.0, prop::array::uniform4(0.0f32..2.0), prop::array::uniform4(any::<u32>())).prop_map(
        |(natural_period, nonlinearity, coupling, phases)| RobustConfig {
            natural_period,
            nonlinearity,
            coupling,
            phases: phases.map(Phase),
            amplitudes: [Radians(core::f32::consts::PI); 4],
            offsets: [Radians(-core::f32::consts::PI); 4],
        },
    )
}

proptest! {
    #[test]
    fn every_state_stays_inside_its_bound(
        config in any_config(), micros_ in 1u32..100_000, bits in prop::array::uniform8(-196_607i32..=196_607),
    ) {
        let built = config.build_fixed::<Biped>(micros(micros_));
        prop_assume!(built.is_ok());
        let mut ours = built.unwrap();
        let [u, v] = [0, 4].map(|at| core::array::from_fn(|i| I16F16::from_bits(bits[at + i])));
        ours.set_state(&OscillatorState { displacement: u, velocity: v }).unwrap();
        for _ in 0..200 {
            ours.step();
            let state = ours.state();
            prop_assert!(state.displacement.iter().chain(&state.velocity).all(|x| x.unsigned_abs() <= 3));
        }
        let _ = (ours.angles(), ours.rates(), ours.phase(), ours.amplitude());
    }

    /// The angle of any point outside of a small circle, against f64.
    #[test]
    fn angle_of_a_point(x in -300_000i32..300_000, y in -300_000i32..300_000) {
        prop_assume!(x.abs().max(y.abs()) >= 4096);
        let phase = fixed_trig::angle(I16F16::from_bits(y), I16F16::from_bits(x));
        let exact = f64::from(y).atan2(f64::from(x)) / core::f64::consts::TAU;
        let error = (f64::from(phase.0) / 4_294_967_296.0 - exact + 0.5).rem_euclid(1.0) - 0.5;
        prop_assert!(error.abs() < 2e-8, "{error:e}");
    }
}

#[test]
fn sines() {
    let mut worst = 0.0f64;
    for i in 0..200_000u32 {
        let phase = Phase(i.wrapping_mul(21_475).wrapping_add(i << 18));
        let (sin, cos) = fixed_trig::sin_cos(phase);
        let turn = f64::from(phase.0) * (core::f64::consts::TAU / 4_294_967_296.0);
        worst = worst.max((sin.to_num::<f64>() - turn.sin()).abs()).max((cos.to_num::<f64>() - turn.cos()).abs());
    }
    println!("{worst:e}");
    assert!(worst < 2e-9, "{worst:e}");
    assert_eq!(fixed_trig::angle(I16F16::ZERO, I16F16::ZERO), Phase(0));
    assert!(fixed_trig::angle(I16F16::ZERO, -I16F16::ONE).0.abs_diff(1 << 31) < 1000);
}

#[test]
fn faults_and_reset() {
    let mut ours: Fixed = default_config().build_fixed(Period::MILLISECOND).unwrap();
    let start = ours;
    let mut state = ours.state();
    state.velocity[2] = I16F16::from_num(-3);
    assert_eq!(ours.set_state(&state), Err(StateFault::OutOfBounds { state: Field::at("velocity", 2) }));
    state.velocity[2] = I16F16::MIN;
    assert_eq!(ours.set_state(&state), Err(StateFault::OutOfBounds { state: Field::at("velocity", 2) }));
    assert_eq!(ours, start);
    run(&mut ours, 1234);
    assert_ne!(ours, start);
    ours.reset();
    assert_eq!(ours, start);
    let refused = RobustConfig { nonlinearity: f32::NAN, ..default_config() }.build_fixed::<Biped>(Period::MILLISECOND);
    assert!(refused.unwrap_err().to_string().contains("nonlinearity"));
    assert!(default_config().build_fixed::<Biped>(micros(50_000)).unwrap_err().to_string().contains("period"));
}

fn shapes() -> [FourierShape<6>; 2] {
    let cos = [0.35, -0.06, 0.02, 0.01, -0.004, 0.002];
    let sin = [-0.1, 0.2, -0.05, 0.03, 0.006, -0.001];
    let hip = FourierShape::new(Radians(0.2), cos, sin).unwrap();
    [hip, FourierShape::new(Radians(1.0), sin, cos).unwrap()]
}

fn series(shape: &FourierShape<6>, turn: f64) -> (f64, f64) {
    let (mean, cos, sin) = shape.coefficients();
    let (mut angle, mut slope) = (f64::from(mean), 0.0);
    for (i, (&a, &b)) in cos.iter().zip(sin).enumerate() {
        let (k, a, b) = ((i + 1) as f64, f64::from(a), f64::from(b));
        angle += a * (k * turn).cos() + b * (k * turn).sin();
        slope += k * (b * (k * turn).cos() - a * (k * turn).sin());
    }
    (angle, slope)
}

/// Over the cycle, angle and rate against the series in f64: 0.51 units of 2^-16 rad, where 0.5 is the rounding to that unit; and
/// 0.53 of 2^-16 rad/s.
#[test]
fn shape_error_is_one_place() {
    let lead = Phase(1 << 30);
    let mut ours = FixedPhaseShapeConfig { shapes: shapes(), leads: [Phase(0), lead], stride_s: 1.1 }
        .build(Period::MILLISECOND)
        .unwrap();
    let (mut worst, mut worst_rate) = (0.0f64, 0.0f64);
    for i in 0..20_000u32 {
        let phase = Phase(i.wrapping_mul(214_783));
        ours.set_phase(phase);
        let (angles, rates) = (ours.fixed_angles(), ours.fixed_rates());
        for (joint, shape) in shapes().iter().enumerate() {
            let at = phase.0.wrapping_add([0, lead.0][joint]);
            let (angle, slope) = series(shape, f64::from(at) * (core::f64::consts::TAU / 4_294_967_296.0));
            let rate = slope * core::f64::consts::TAU / 1.1;
            worst = worst.max((angles[joint].to_num::<f64>() - angle).abs() * 65_536.0);
            worst_rate = worst_rate.max((rates[joint].to_num::<f64>() - rate).abs() * 65_536.0);
        }
    }
    println!("{worst:.4} {worst_rate:.4}");
    assert!(worst < 0.51 && worst_rate < 0.53, "{worst} {worst_rate}");
}

proptest! {
    /// Any gain, offset and lead on a joint, at any stride: angle and rate are those of the f32 generator, and the joints beside it stay.
    #[test]
    fn adjusted_like_the_f32_generator(
        gain in 0.0f32..=2.0,
        offset in -6.3f32..=6.3,
        lead in any::<u32>(),
        stride in 0.2f32..20.0,
        joint in 0usize..2,
        phase in any::<u32>(),
    ) {
        let mut ours = FixedPhaseShapeConfig { shapes: shapes(), leads: [Phase(0); 2], stride_s: 1.1 }.build(Period::MILLISECOND).unwrap();
        let mut single = PhaseShapeConfig { shapes: shapes(), stride_s: 1.1 }.build(Period::MILLISECOND).unwrap();
        let adjustment = Adjustment { gain, offset: Radians(offset), lead: Phase(lead) };
        ours.adjust(joint, adjustment).unwrap();
        single.adjust(joint, adjustment).unwrap();
        ours.set_stride(stride).unwrap();
        single.set_stride(stride).unwrap();
        ours.set_phase(Phase(phase));
        single.set_phase(Phase(phase));
        for _ in 0..50 {
            prop_assert_eq!(ours.phase(), single.phase());
            for (a, b) in ours.angles().iter().zip(single.angles()) {
                // One place of 2^-16, and what f32 has at 8 rad.
                prop_assert!((a.0 - b.0).abs() < 1.7e-5, "{} {}", a.0, b.0);
            }
            for (a, b) in ours.rates().iter().zip(single.rates()) {
                prop_assert!((a.0 - b.0).abs() < 2e-5 + 4e-7 * b.0.abs().max(20.0 / stride), "{} {}", a.0, b.0);
            }
            ours.step();
            single.step();
        }
    }
}

#[test]
fn a_bad_adjustment_is_refused_and_changes_nothing() {
    let mut ours = FixedPhaseShapeConfig { shapes: shapes(), leads: [Phase(5); 2], stride_s: 1.1 }
        .build(Period::MILLISECOND)
        .unwrap();
    let before = ours;
    let bad = |gain, offset| Adjustment { gain, offset: Radians(offset), lead: Phase(0) };
    assert!(ours.adjust(0, bad(2.1, 0.0)).unwrap_err().to_string().contains("gain"));
    assert!(ours.adjust(0, bad(1.0, f32::NAN)).unwrap_err().to_string().contains("offset"));
    assert!(ours.set_stride(0.1).unwrap_err().to_string().contains("stride_s"));
    assert_eq!(ours.adjust(2, bad(0.5, 0.0)), Ok(()));
    assert_eq!(ours, before);
}

/// The phase is that of the f32 generator to the last bit, tick by tick, and the step that of the exact quotient: 72 h at 1 kHz are
/// 72 * 3600 / 1.1 strides within 1e-9 of a cycle.
#[test]
fn the_period_is_exact() {
    let mut ours = FixedPhaseShapeConfig { shapes: shapes(), leads: [Phase(0); 2], stride_s: 1.1 }
        .build(Period::MILLISECOND)
        .unwrap();
    let mut single = PhaseShapeConfig { shapes: shapes(), stride_s: 1.1 }.build(Period::MILLISECOND).unwrap();
    for _ in 0..10_000 {
        ours.step();
        single.step();
        assert_eq!(ours.phase(), single.phase());
        for (a, b) in ours.angles().iter().zip(single.angles()) {
            assert!((a.0 - b.0).abs() < 2e-5);
        }
    }
    // In 2^-64 cycles; 1.1 s are 1100 ticks, so 1100 steps fall short of a cycle by less than 1100.
    let cycle = u128::from(ours.phase_step()) * 1100;
    assert!((1u128 << 64) - cycle < 1100);
    let short = ((1u128 << 64) - cycle) as f64 / 2f64.powi(64) * (72.0 * 3600.0 / 1.1);
    assert!(short < 1e-9, "{short}");
    ours.reset();
    assert_eq!(ours.phase(), Phase(0));
    let refused =
        FixedPhaseShapeConfig { shapes: shapes(), leads: [Phase(0); 2], stride_s: 0.0 }.build(Period::MILLISECOND);
    assert!(refused.unwrap_err().to_string().contains("stride_s"));
    assert!(shapes()[0].mean() > 0.1 && ours.check().is_ok());
}
