//! The gate with every combination of extreme numbers: NaN, infinities, subnormal and huge numbers, both zeros, and the edges of its own integers,
//! at every target, every configured limit, the pose at rest, and every time. Millions of cases in some seconds.
//!
//! What must hold: a number that is not finite is refused, by the joint or the field, and changes nothing; every other setpoint is inside range,
//! rate, acceleration and pose envelope.

mod support;

use joint_loop::{Gate, GateConfig, LoopConfig, NonFinite, RobotConfig};
use joint_units::{Joint, Period, Radians};
use support::motion_limits::MotionLimits;
use support::{Puppet, sensor};

/// Signalling NaN, with its sign.
const SIGNALLING: u32 = 0xFF80_0001;
/// The largest subnormal number.
const SUBNORMAL: u32 = 0x007F_FFFF;

/// The gate's steps are 2^-28 rad: 8 rad is the first that its integers of 32 bits do not hold.
const EXTREMES: [f32; 32] = [
    f32::NAN,
    -f32::NAN,
    f32::from_bits(SIGNALLING),
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::MAX,
    f32::MIN,
    1e30,
    -1e30,
    1e10,
    -1e10,
    8.0,
    -8.0,
    7.999_999_5,
    -8.000_001,
    2.1,
    -2.1,
    1.0,
    -0.5,
    -0.034_906_59,
    core::f32::consts::FRAC_PI_3,
    -core::f32::consts::FRAC_PI_6,
    0.087,
    0.1,
    f32::EPSILON,
    f32::MIN_POSITIVE,
    -f32::MIN_POSITIVE,
    f32::from_bits(SUBNORMAL),
    f32::from_bits(1),
    -1e-45,
    0.0,
    -0.0,
];

/// The n-th combination of four of them. Multiplied by an odd number, so that successive ones have little in common and each of
/// the 2^20 comes once: the low bits of the product are a permutation of those of n.
fn combination(n: u32) -> [f32; Joint::COUNT] {
    let shuffled = n.wrapping_mul(0x9E37_79B1);
    std::array::from_fn(|joint| EXTREMES[(shuffled >> (5 * joint)) as usize % EXTREMES.len()])
}

const COMBINATION_BITS: u32 = 20;

/// Runs the gate over combinations, and returns how many were refused.
fn run(config: &GateConfig, period: Period, park: [Radians; 4], combinations: std::ops::Range<u32>) -> u32 {
    let gate = Gate::build(config, period).expect("allowed");
    let mut state = gate.rest(park).expect("inside");
    let mut limits = MotionLimits::new(*config, period);
    limits.check(&park);
    let mut refused = 0;
    for n in combinations {
        let target = combination(n).map(Radians);
        let before = state;
        match gate.limit(&mut state, target) {
            Ok((setpoints, _)) => {
                assert!(target.iter().all(|angle| angle.0.is_finite()), "{target:?} was accepted");
                limits.check(&setpoints);
            }
            Err(NonFinite { joint }) => {
                let first = Joint::ALL.into_iter().find(|joint| !target[*joint as usize].0.is_finite());
                assert_eq!((first, state), (Some(joint), before), "{target:?}");
                refused += 1;
            }
        }
    }
    refused
}

#[test]
fn every_combination_of_extreme_targets_is_limited_or_refused() {
    let robot = RobotConfig::default_biped();
    let all = 1 << COMBINATION_BITS;
    let refused = run(&robot.gate, Period::MILLISECOND, robot.park, 0..all);
    // 5 of the 32 numbers are not finite.
    assert_eq!(refused, all - 27_u32.pow(4));
}

/// Other limits and periods: rates that the joints reach within few ticks, and another pose limit.
#[test]
fn robots_with_other_limits_and_periods_too() {
    let robot = RobotConfig::default_biped();
    for (place, micros) in [100_u32, 500, 1_000, 2_000, 5_000, 10_000].into_iter().enumerate() {
        let mut config = robot.gate;
        for joint in 0..Joint::COUNT {
            config.rate[joint].0 = 2.0 + (place + joint) as f32;
            config.acceleration[joint].0 = 300.0 + 100.0 * place as f32;
        }
        config.pose[5] = config.pose[0].map(|limit| joint_loop::PoseLimit { most: Radians(1.1), ..limit });
        let period = Period::from_micros(micros).expect("allowed");
        run(&config, period, robot.park, 0..1 << 17);
    }
}

/// A pose at rest is accepted if it is finite and inside; at the edges themselves either answer is right, because the gate rounds inward.
#[test]
fn every_combination_of_extreme_poses_at_rest_is_inside_or_refused() {
    const EDGE: f64 = 1e-6;
    let robot = RobotConfig::default_biped();
    let gate = Gate::build(&robot.gate, Period::MILLISECOND).expect("allowed");
    let mut accepted = 0;
    for n in 0..1 << COMBINATION_BITS {
        let pose = combination(n).map(Radians);
        let inside_by = |margin: f64| {
            let angles = pose.map(|angle| f64::from(angle.0));
            let in_range = angles.iter().zip(&robot.gate.range).all(|(angle, range)| {
                *angle >= f64::from(range.least.0) + margin && *angle <= f64::from(range.most.0) - margin
            });
            let mut limits = robot.gate.pose.iter().flatten();
            in_range && limits.all(|limit| f64::from(limit.of(&pose).0) <= f64::from(limit.most.0) - margin)
        };
        let rest = gate.rest(pose).is_some();
        if inside_by(EDGE) {
            assert!(rest, "{pose:?} is inside");
        } else if !inside_by(-EDGE) {
            assert!(!rest, "{pose:?} is outside");
        }
        accepted += u32::from(rest);
    }
    assert!(accepted > 10_000, "{accepted}");
}

type Field = fn(&mut LoopConfig) -> &mut f32;

/// Every number of a loop's configuration but those of the servos, each with the word by which an error names it.
fn fields() -> Vec<(&'static str, Field)> {
    let mut all: Vec<(&'static str, Field)> = vec![
        ("blend.ramp_s", |c| &mut c.blend.ramp_s),
        ("blend.stop_s", |c| &mut c.blend.stop_s),
        ("blend.hurry_s", |c| &mut c.blend.hurry_s),
        ("monitor.sensor_tolerance_s", |c| &mut c.monitor.sensor_tolerance_s),
        ("monitor.stand_s", |c| &mut c.monitor.stand_s),
        ("monitor.pose_tolerance_s", |c| &mut c.monitor.pose_tolerance_s),
        ("monitor.stop_gap_s", |c| &mut c.monitor.stop_gap_s),
        ("monitor.fault_gap_s", |c| &mut c.monitor.fault_gap_s),
        ("button.debounce_s", |c| &mut c.button.debounce_s),
        ("button.hold_least_s", |c| &mut c.button.hold_least_s),
        ("button.hold_most_s", |c| &mut c.button.hold_most_s),
        ("button.within_s", |c| &mut c.button.within_s),
        ("button.refused_s", |c| &mut c.button.refused_s),
        ("gate.pose", |c| &mut c.gate.pose[0].as_mut().expect("a limit").most.0),
        ("gate.pose", |c| &mut c.gate.pose[4].as_mut().expect("a limit").most.0),
    ];
    macro_rules! of_each_joint {
        ($($joint:literal),+) => {$(
            all.push(("gate.range", |c| &mut c.gate.range[$joint].least.0));
            all.push(("gate.range", |c| &mut c.gate.range[$joint].most.0));
            all.push(("gate.rate", |c| &mut c.gate.rate[$joint].0));
            all.push(("gate.acceleration", |c| &mut c.gate.acceleration[$joint].0));
            all.push(("blend.park", |c| &mut c.blend.park[$joint].0));
            all.push(("servos.angle_at_neutral", |c| &mut c.servos[$joint].angle_at_neutral.0));
            all.push(("servos.micros_per_radian", |c| &mut c.servos[$joint].micros_per_radian));
        )+};
    }
    of_each_joint!(0, 1, 2, 3);
    all
}

/// One number of the configuration is extreme: it is refused, or the loop that is built keeps its limits. What is not finite is always refused,
/// by its name.
#[test]
fn every_extreme_limit_and_time_is_refused_or_kept() {
    let (mut refused, mut built) = (0, 0);
    for (name, field) in fields() {
        for extreme in EXTREMES {
            for micros in [1, 100, 1_000, 10_000] {
                let mut config = LoopConfig::default_biped();
                *field(&mut config) = extreme;
                let period = Period::from_micros(micros).expect("allowed");
                match config.build(period, Puppet::at([30.0, -20.0, 80.0, 60.0]), [Some(sensor())]) {
                    Ok(_) => {
                        assert!(extreme.is_finite(), "{name} = {extreme} was accepted");
                        run(&config.gate, period, config.blend.park, 0..500);
                        built += 1;
                    }
                    Err(error) => {
                        // Another field may be refused first at this period, or because it no longer fits to this one.
                        let words = error.to_string();
                        assert!(
                            extreme.is_finite() || micros != 1_000 || words.starts_with(name),
                            "{name} = {extreme}: {words}"
                        );
                        refused += 1;
                    }
                }
            }
        }
    }
    assert!(refused > 3_000 && built > 100, "{refused} refused, {built} built");
}

/// A million angles through every servo map: a pulse inside the servo's own limits, or none for what is not finite.
#[test]
fn no_angle_gives_a_pulse_beyond_the_servo() {
    let robot = RobotConfig::default_biped();
    for (joint, servo) in Joint::ALL.into_iter().zip(&robot.servos) {
        let map = servo.build(joint).expect("allowed");
        for n in 0..1_u32 << COMBINATION_BITS {
            // A prime step meets every exponent, both signs and all kinds of fractions.
            let angle = f32::from_bits(n.wrapping_mul(4_099));
            match map.pulse(Radians(angle)) {
                Some(pulse) => assert!(pulse >= servo.shortest && pulse <= servo.longest, "{angle}: {pulse:?}"),
                None => assert!(angle.is_nan() || angle.abs() >= 1e30, "{angle} has no pulse"),
            }
            assert!(angle.is_finite() || map.pulse(Radians(angle)).is_none(), "{angle}");
        }
    }
}
