//! The walking set: period, amplitudes, phases, convergence, and an hour of it without drift.

mod common;

use common::{Crossings, Random, W, apart, micros, phases, run, single};
use cpg_core::gait::default_walk::{Walk, default_walk};
use cpg_core::{BuildError, Generator, OscillatorState};
use joint_units::{Joint, Period, Phase};

const OFFSETS: [f64; 4] = [5.0, 5.0, 30.0, 30.0];
const AMPLITUDES: [f64; 4] = [20.0, 20.0, 30.0, 30.0];

fn walk() -> Walk {
    default_walk(Period::MILLISECOND).unwrap()
}

fn degrees(walk: &Walk) -> [f64; 4] {
    walk.angles().map(|angle| f64::from(angle.0).to_degrees())
}

fn double(state: OscillatorState<4>) -> OscillatorState<4, f64> {
    OscillatorState { displacement: state.displacement.map(f64::from), velocity: state.velocity.map(f64::from) }
}

#[test]
fn the_stride_is_the_configured_one_at_every_control_period() {
    for step in [500, 1000, 2000, 5000, 10_000] {
        let mut walk = default_walk(micros(step)).unwrap();
        let h = f64::from(step) * 1e-6;
        let mut crossings = Crossings::new(h);
        for _ in 0..(120.0 / h) as u64 {
            crossings.sample(degrees(&walk)[0] - OFFSETS[0], f64::from(walk.rates()[0].0).to_degrees());
            walk.step();
        }
        let period = crossings.period(100);
        assert!((period / 1.1 - 1.0).abs() < 1e-6, "{step} us: {period} s");
    }
}

#[test]
fn amplitudes_offsets_and_phases_are_those_of_the_configuration() {
    let mut walk = walk();
    run(&mut walk, 11_000);
    let (mut least, mut most) = ([f64::MAX; 4], [f64::MIN; 4]);
    for tick in 0..1100 {
        let angles = degrees(&walk);
        least = core::array::from_fn(|i| least[i].min(angles[i]));
        most = core::array::from_fn(|i| most[i].max(angles[i]));
        let [left, right, ..] = angles;
        assert!((left + right - 10.0).abs() < 0.01, "tick {tick}: hips {left} {right}");
        let phase = phases(&double(walk.state()));
        assert!(apart(phase[2] - phase[0], 80.0).abs() < 6.0, "tick {tick}: {phase:?}");
        walk.step();
    }
    for joint in Joint::ALL.map(|joint| joint as usize) {
        let amplitude = (most[joint] - least[joint]) / 2.0;
        assert!((amplitude / AMPLITUDES[joint] - 1.0).abs() < 0.05, "joint {joint}: {amplitude}");
        assert!(((most[joint] + least[joint]) / 2.0 - OFFSETS[joint]).abs() < 0.05, "joint {joint}");
    }
}

#[test]
fn it_starts_on_its_cycle_at_phase_0() {
    let mut walk = walk();
    assert_eq!(walk.phase(), Phase(0));
    let start = double(walk.state());
    run(&mut walk, 11_000);
    let mut nearest = f64::MAX;
    for _ in 0..1100 {
        let now = double(walk.state());
        let pairs = start.displacement.iter().zip(now.displacement).chain(start.velocity.iter().zip(now.velocity));
        nearest = nearest.min(pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max));
        walk.step();
    }
    assert!(nearest < 0.045, "{nearest} of the amplitude");
}

#[test]
fn phases_count_from_the_first_joint() {
    use cpg_core::network::phase_coupled::Robust;
    let config = cpg_core::gait::default_walk::default_config();
    let plain: Robust<cpg_core::network::graph::Biped, 4, 4> = config.build(Period::MILLISECOND).unwrap();
    let turned = config.phases.map(|phase| Phase(phase.0.wrapping_add(0x4321_0000)));
    let turned =
        cpg_core::network::phase_coupled::RobustConfig { phases: turned, ..config }.build(Period::MILLISECOND).unwrap();
    assert_eq!(plain, turned);
}

#[test]
fn read_outs_on_the_cycle() {
    let mut walk = walk();
    run(&mut walk, 11_000);
    // Wait for phase 0, so that an even phase starts with it.
    let mut last = walk.phase().0;
    while walk.phase().0 >= last {
        last = walk.phase().0;
        walk.step();
    }
    let (mut least, mut most, mut ripple) = (f32::MAX, f32::MIN, [0.0_f64; 2]);
    let first = f64::from(walk.phase().cycles());
    for tick in 0..1100 {
        let amplitude = walk.amplitude();
        (least, most) = (least.min(amplitude), most.max(amplitude));
        let even = first + f64::from(tick) / 1100.0;
        let lead = apart(f64::from(walk.phase().cycles()) * 360.0, even * 360.0);
        ripple = [ripple[0].min(lead), ripple[1].max(lead)];
        let before = (degrees(&walk), walk.rates().map(|rate| f64::from(rate.0).to_degrees()));
        walk.step();
        let after = (degrees(&walk), walk.rates().map(|rate| f64::from(rate.0).to_degrees()));
        for i in 0..4 {
            let difference = (after.0[i] - before.0[i]) / 1e-3;
            let rate = (before.1[i] + after.1[i]) / 2.0;
            assert!((difference - rate).abs() < 0.05, "tick {tick} joint {i}: {difference} against {rate} deg/s");
        }
    }
    assert!(least > 1.0 && most < 1.05, "amplitude {least} to {most}");
    assert!(ripple[1] - ripple[0] < 5.2, "phase against time: {ripple:?} deg");
}

#[test]
fn a_thousand_random_starts_all_converge() {
    let mut on_cycle = walk();
    run(&mut on_cycle, 11_000);
    let cycle: Vec<OscillatorState<4, f64>> = (0..220)
        .map(|_| {
            run(&mut on_cycle, 5);
            double(on_cycle.state())
        })
        .collect();
    let mut random = Random(1);
    for start in 0..1000 {
        let mut walk = walk();
        walk.set_state(&single(&random.state(if start % 2 == 0 { 2.0 } else { 0.08 }))).unwrap();
        run(&mut walk, 12_000);
        let now = double(walk.state());
        let off = |on: &OscillatorState<4, f64>| {
            let pairs = on.displacement.iter().zip(now.displacement).chain(on.velocity.iter().zip(now.velocity));
            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        let nearest = cycle.iter().map(off).fold(f64::MAX, f64::min);
        // Points of the cycle are 0.03 apart.
        assert!(nearest < 0.02, "start {start}: {nearest}");
        assert_eq!(walk.check(), Ok(()));
    }
}

#[test]
fn the_same_calls_give_the_same_bits() {
    let bits = |walk: &Walk| {
        let angles = walk.angles().map(|angle| angle.0.to_bits());
        (angles, walk.rates().map(|rate| rate.0.to_bits()), walk.phase(), walk.amplitude().to_bits())
    };
    let (mut a, mut b) = (walk(), walk());
    run(&mut a, 5000);
    // Read-outs in between change nothing.
    for _ in 0..5000 {
        b.step();
        let _ = (b.angles(), b.rates(), b.phase(), b.amplitude(), b.check());
    }
    assert_eq!(bits(&a), bits(&b));
    // Reset is the built state.
    a.reset();
    assert_eq!(bits(&a), bits(&walk()));
    run(&mut a, 5000);
    assert_eq!(bits(&a), bits(&b));
}

#[test]
fn an_hour_neither_drifts_nor_loses_phase() {
    let mut walk = walk();
    let mut crossings = Crossings::new(1e-3);
    for _ in 0..3_600_000 {
        let OscillatorState { displacement: [u, ..], velocity: [v, ..] } = walk.state();
        crossings.sample(f64::from(u), f64::from(v) * W);
        walk.step();
    }
    // The first crossing is at three quarters of a stride; an hour has 3272.73 strides.
    let times = &crossings.times;
    assert_eq!(times.len(), 3272);
    let stride = |from: usize, to: usize| (times[to] - times[from]) / (to - from) as f64;
    let (early, late) = (stride(10, 1010), stride(2271, 3271));
    assert!((early / 1.1 - 1.0).abs() < 1e-6 && (late / early - 1.0).abs() < 1e-7, "{early} s, then {late} s");
    // Against ticks: at the end of 3261 strides it is less than a tick from where they say.
    let slip = times[3271] - times[10] - 3261.0 * 1.1;
    assert!(slip.abs() < 1e-3, "{slip} s");
    assert_eq!(walk.check(), Ok(()));
}

#[test]
fn too_long_a_period_says_what_is_allowed() {
    let refused = default_walk(micros(20_000));
    let Err(BuildError::PeriodTooLong { max_micros, .. }) = refused else { panic!("{refused:?}") };
    assert!((17_000..17_500).contains(&max_micros), "{max_micros}");
    assert!(default_walk(micros(max_micros)).is_ok());
    assert!(default_walk(micros(max_micros + 1)).is_err());
}
