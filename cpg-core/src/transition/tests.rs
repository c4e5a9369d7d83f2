//! Tests of the module.

use super::*;
use crate::waveform::shape::{Adjustment, FourierShape, PhaseShape, PhaseShapeConfig};

const CONFIG: TransitionConfig = TransitionConfig { acceleration: RadPerSec2(30.0), settling_s: 0.25 };

const WIDE: [JointLimits; 1] = [JointLimits::WIDEST];

fn gait(mean: f32, cos: [f32; 2], stride: f32) -> PhaseShape<FourierShape<2>, 1> {
    let shape = FourierShape::new(Radians(mean), cos, [0.05, 0.1]).unwrap();
    PhaseShapeConfig { shapes: [shape], stride_s: stride }.build(Period::MILLISECOND).unwrap()
}

/// Largest acceleration of a gait by itself.
fn own_acceleration(mut gait: PhaseShape<FourierShape<2>, 1>) -> f32 {
    let mut worst = 0.0f32;
    for _ in 0..2000 {
        let before = gait.rates()[0].0;
        gait.step();
        worst = worst.max((gait.rates()[0].0 - before).abs() / 1e-3);
    }
    worst
}

/// Changes and stops at random ticks, also during changes: the rate is always the derivative of the angle, and the acceleration is at most
/// that of the gaits plus the configured one.
#[test]
fn every_change_is_smooth() {
    let gaits = [gait(0.1, [0.4, 0.1], 1.1), gait(0.5, [-0.3, 0.2], 0.7), gait(-0.2, [0.1, 0.0], 2.0)];
    let own = gaits.map(own_acceleration).into_iter().fold(0.0, f32::max);
    let mut seed = 1u32;
    let mut random = move |n: u32| {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (seed >> 8) % n
    };
    let mut smooth = CONFIG.build(gaits[0], WIDE, Period::MILLISECOND).unwrap();
    let mut next_change = 500;
    let (mut changes, mut worst) = (0, 0.0f32);
    for tick in 0..400_000 {
        if tick == next_change {
            match random(5) {
                0 => smooth.stop([Radians(0.3)]).unwrap(),
                1 => smooth.resume(),
                2 => smooth.change(|g| g.set_stride(0.7 + 0.1 * random(8) as f32)).unwrap(),
                3 => {
                    let adjustment = Adjustment { gain: 0.25 * random(5) as f32, ..Adjustment::default() };
                    smooth.change(|g| g.adjust(0, adjustment)).unwrap();
                }
                _ => smooth.change(|g| *g = gaits[random(3) as usize]),
            }
            next_change += 1 + random(600);
            changes += 1;
        }
        let (angle, rate) = (smooth.angles()[0].0, smooth.rates()[0].0);
        smooth.step();
        let (angle1, rate1) = (smooth.angles()[0].0, smooth.rates()[0].0);
        let acceleration = (rate1 - rate).abs() / 1e-3;
        worst = worst.max(acceleration);
        // Rounding of f32 over 1 ms is worth about 0.1 rad/s^2 and 1e-4 rad/s.
        assert!(acceleration <= own + CONFIG.acceleration.0 + 0.5, "tick {tick}: {acceleration} rad/s^2, own {own}");
        // Angles of a few radians round to 5e-7, which over 1 ms is 5e-4 rad/s an operand.
        let from_angles = (angle1 - angle) / 1e-3;
        assert!((from_angles - 0.5 * (rate + rate1)).abs() < 3e-3, "tick {tick}: {from_angles}, {rate}, {rate1}");
    }
    assert!(changes > 1000 && worst > own, "{changes} changes, {worst} against {own}");
}

#[test]
fn a_change_of_nothing_changes_nothing() {
    let mut smooth = CONFIG.build(gait(0.1, [0.4, 0.1], 1.1), WIDE, Period::MILLISECOND).unwrap();
    let mut bare = gait(0.1, [0.4, 0.1], 1.1);
    for tick in 0..3000 {
        if tick % 100 == 0 {
            smooth.change(|_| ());
        }
        smooth.step();
        bare.step();
        assert_eq!(smooth.angles(), bare.angles());
        assert!(!smooth.is_changing());
    }
}

#[test]
fn a_stop_ends_in_the_pose_and_a_change_in_the_new_gait() {
    let mut smooth = CONFIG.build(gait(0.1, [0.4, 0.1], 1.1), WIDE, Period::MILLISECOND).unwrap();
    for _ in 0..777 {
        smooth.step();
    }
    smooth.stop([Radians(0.25)]).unwrap();
    for _ in 0..1500 {
        smooth.step();
    }
    assert_eq!((smooth.angles()[0], smooth.rates()[0]), (Radians(0.25), RadPerSec(0.0)));
    smooth.resume();
    smooth.change(|g| *g = gait(0.5, [-0.3, 0.2], 0.7));
    let mut bare = gait(0.5, [-0.3, 0.2], 0.7);
    for _ in 0..1500 {
        smooth.step();
        bare.step();
    }
    assert_eq!(smooth.angles(), bare.angles());
}

/// The speed changes in every tick for seconds, as with a slider: the offsets do not grow, and the gait is followed.
#[test]
fn changes_on_every_tick_do_not_pile_up() {
    let mut smooth = CONFIG.build(gait(0.1, [0.4, 0.1], 1.1), WIDE, Period::MILLISECOND).unwrap();
    for tick in 0..20_000 {
        let stride = 1.1 + 0.3 * (tick as f32 * 1e-3).sin();
        smooth.change(|g| g.set_stride(stride)).unwrap();
        smooth.step();
        let off = smooth.angles()[0].0 - smooth.generator().angles()[0].0;
        assert!(off.abs() < 0.02, "tick {tick}: {off} off the gait");
    }
    // The worst case: another of two gaits in every tick. The output stays near them.
    let mut gaits = [gait(0.1, [0.4, 0.1], 1.1), gait(0.3, [0.3, 0.1], 1.0)];
    for tick in 0..20_000 {
        smooth.change(|g| *g = gaits[tick % 2]);
        smooth.step();
        gaits.iter_mut().for_each(Generator::step);
        let nearest = gaits.iter().map(|g| (smooth.angles()[0].0 - g.angles()[0].0).abs()).fold(f32::MAX, f32::min);
        assert!(tick < 1000 || nearest < 0.6, "tick {tick}: {nearest} from either gait");
    }
}

/// A wrapped follower receives the measurements and computes the same bits as without the wrapper.
#[test]
fn a_smooth_follower_locks_on() {
    use crate::entrainment::phase_lock::Template;
    use crate::entrainment::{FollowerConfig, Lock};
    use crate::waveform::shape::Shape;
    use joint_units::Joint;
    let hip = Template::new(Radians(0.1), [0.35, -0.05, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0; 8]).unwrap();
    let mut bare = FollowerConfig::default().build([hip; 4], Joint::LeftHip, Period::MILLISECOND).unwrap();
    let mut smooth = TransitionConfig::default().build(bare, [JointLimits::WIDEST; 4], Period::MILLISECOND).unwrap();
    for tick in 0..6000 {
        let angle = Some(Radians(hip.at(Phase::from_cycles(0.3 + tick as f32 * 1e-3 / 1.2)).angle));
        for follower in [&mut bare as &mut dyn Follow, &mut smooth] {
            follower.observe(angle);
            if tick % 1200 == 0 {
                follower.heel_strike();
            }
        }
        bare.step();
        smooth.step();
        assert_eq!((smooth.angles(), smooth.follow_status()), (bare.angles(), bare.follow_status()), "tick {tick}");
    }
    assert_eq!(smooth.follow_status().map(|status| status.state), Some(Lock::Locked));
}

#[test]
fn bad_fields_are_named() {
    let build = |acceleration, settling_s| {
        let config = TransitionConfig { acceleration: RadPerSec2(acceleration), settling_s };
        config.build(gait(0.1, [0.4, 0.1], 1.1), WIDE, Period::MILLISECOND).unwrap_err().to_string()
    };
    assert!(build(0.0, 0.1).contains("acceleration"));
    assert!(build(f32::NAN, 0.1).contains("acceleration"));
    assert!(build(1.0, -0.1).contains("settling_s"));
}
