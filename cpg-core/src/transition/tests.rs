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

/// A knee: -2 to 70 degrees, 500 degrees/s, 349 rad/s^2.
const KNEE: JointLimits = JointLimits {
    least: Radians::from_degrees(-2.0),
    most: Radians::from_degrees(70.0),
    rate: RadPerSec(8.73),
    acceleration: RadPerSec2(349.0),
};

/// A motion between two angles at a stride time.
fn swing(least: f32, most: f32, stride: f32) -> PhaseShape<FourierShape<1>, 1> {
    let [mean, amplitude] = [(most + least) / 2.0, (most - least) / 2.0].map(f32::to_radians);
    let shape = FourierShape::new(Radians(mean), [amplitude], [0.0]).unwrap();
    PhaseShapeConfig { shapes: [shape], stride_s: stride }.build(Period::MILLISECOND).unwrap()
}

/// Largest rate and acceleration of the output, from differences of its angles.
fn largest(angles: &[f32]) -> (f32, f32) {
    let rate = angles.windows(2).map(|w| (w[1] - w[0]).abs() * 1e3).fold(0.0, f32::max);
    let acceleration = angles.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).abs() * 1e6).fold(0.0, f32::max);
    (rate, acceleration)
}

/// A motion that leaves the range by 10 degrees at both ends is held inside without a jump; where it is inside for long enough, it is
/// followed exactly.
#[test]
fn a_motion_beyond_the_range_is_limited_smoothly() {
    for (stride, is_reached) in [(0.7, false), (6.0, true)] {
        let motion = swing(-12.0, 80.0, stride);
        let mut smooth = TransitionConfig::default().build(motion, [KNEE], Period::MILLISECOND).unwrap();
        let (mut angles, mut reached, mut at_end) = (vec![], 0, 0);
        for _ in 0..14_000 {
            smooth.step();
            let angle = smooth.angles()[0];
            assert!((KNEE.least.0..=KNEE.most.0).contains(&angle.0), "{} degrees", angle.degrees());
            reached += u32::from(angle == smooth.generator().angles()[0]);
            at_end += u32::from((angle.0 - KNEE.least.0).abs() < 1e-4 || (KNEE.most.0 - angle.0).abs() < 1e-4);
            angles.push(angle.0);
        }
        let (rate, acceleration) = largest(&angles);
        assert!(rate < 8.8 && acceleration < KNEE.acceleration.0 + 2.0, "{rate} rad/s, {acceleration} rad/s^2");
        assert!(at_end > 1000, "{at_end} ticks at an end");
        assert_eq!(reached > 1000, is_reached, "{reached} ticks on the motion");
    }
}

/// A motion that begins outside its range begins at rest at the end of it.
#[test]
fn a_motion_that_begins_outside_begins_at_the_end_of_the_range() {
    let outside = swing(-12.0, -5.0, 0.7);
    let smooth = TransitionConfig::default().build(outside, [KNEE], Period::MILLISECOND).unwrap();
    assert_eq!((smooth.angles()[0], smooth.rates()[0]), (KNEE.least, RadPerSec(0.0)));
    assert!(smooth.is_changing());
}

/// A motion that comes within a thousandth of a degree of both ends of its range, at an acceleration above A, is not disturbed, and is
/// reached exactly after a change.
#[test]
fn a_motion_up_to_the_ends_of_the_range_is_reached_exactly() {
    let motion = swing(-1.999, 69.999, 0.34);
    let mut smooth = TransitionConfig::default().build(motion, [KNEE], Period::MILLISECOND).unwrap();
    let mut bare = motion;
    for _ in 0..3000 {
        smooth.step();
        bare.step();
        assert_eq!(smooth.angles(), bare.angles());
    }
    for after in [1, 77, 160, 300] {
        smooth.stop([KNEE.least]).unwrap();
        for _ in 0..after {
            smooth.step();
            bare.step();
        }
        smooth.resume();
        let mut angles = vec![];
        for _ in 0..3000 {
            smooth.step();
            bare.step();
            angles.push(smooth.angles()[0].0);
        }
        assert_eq!(smooth.angles(), bare.angles(), "after {after} ms");
        // 36 degrees at 2.94 Hz: 665 degrees/s and 215 rad/s^2.
        let (rate, acceleration) = largest(&angles);
        assert!(rate < 11.7 && acceleration < 215.0 + 150.0 + 2.0, "{rate} rad/s, {acceleration} rad/s^2");
    }
}

/// From every state that can stop, a rate is allowed that keeps it so, at three control periods: the proof in numbers, in f64.
#[test]
fn what_can_stop_can_stop_a_period_later() {
    for period in [1e-4f64, 1e-3, 1e-2] {
        for acceleration in [1.0f64, 150.0, 3000.0] {
            let law = Braking { stiffness: 12.0, acceleration: acceleration as f32, period_s: period as f32 };
            for n in 0..2000 {
                let rate = 1e-4 * 1.01f64.powi(n % 1000) * acceleration * period;
                let left = rate * rate / (2.0 * acceleration) * if n < 1000 { 1.0 } else { 1.1 };
                let next = f64::from(law.stopping_rate((left - 0.5 * period * rate) as f32, acceleration as f32));
                let after = left - 0.5 * period * (rate + next);
                let rounding = 1e-6 * (left + period * rate);
                assert!(after >= -rounding, "{rate} to {next}: {after} left");
                let needed = next.max(0.0).powi(2) / (2.0 * acceleration);
                assert!(needed <= after + rounding, "{rate} to {next}: {needed} needed, {after} left");
                assert!(rate - next <= acceleration * period * 1.001 + 1e-5 * rate, "{rate} to {next}");
            }
        }
    }
}

#[test]
fn a_pose_outside_the_range_is_refused_and_nothing_changes() {
    let mut smooth = TransitionConfig::default().build(swing(0.0, 60.0, 0.7), [KNEE], Period::MILLISECOND).unwrap();
    let before = smooth.clone();
    for angle in [-0.1, 1.3, f32::NAN] {
        assert!(smooth.stop([Radians(angle)]).unwrap_err().to_string().starts_with("pose[0] = "), "{angle}");
        assert_eq!(smooth, before);
    }
}

#[test]
fn bad_limits_are_named() {
    let build = |limits: JointLimits| {
        let built = TransitionConfig::default().build(swing(0.0, 60.0, 0.7), [limits], Period::MILLISECOND);
        built.map(|_| ()).unwrap_err().to_string()
    };
    assert!(build(JointLimits { least: Radians(f32::NAN), ..KNEE }).starts_with("limits.least[0] = nan"));
    assert!(build(JointLimits { most: KNEE.least, ..KNEE }).starts_with("limits.most[0] = -0.03"));
    assert!(build(JointLimits { rate: RadPerSec(0.0), ..KNEE }).starts_with("limits.rate[0] = 0: must be from 0.01"));
    assert!(
        build(JointLimits { acceleration: RadPerSec2(1e6), ..KNEE }).starts_with("limits.acceleration[0] = 1000000")
    );
    // A change may not add more than the joint can do.
    assert!(
        build(JointLimits { acceleration: RadPerSec2(100.0), ..KNEE })
            .starts_with("acceleration = 150: must be from 0.1 to 100")
    );
    assert_eq!(TransitionConfig::default().build(swing(0.0, 60.0, 0.7), WIDE, Period::MILLISECOND).map(|_| ()), Ok(()));
}

/// While one joint changes, another that is on its motion stays on it bit for bit, also where the motion brakes with more than A to within a
/// few roundings of an end of its range: there it is the governor's second case, to be short of the motion, that allows its rate.
#[test]
fn a_change_of_one_joint_leaves_the_other_on_its_motion() {
    for (micros, stride, most, beyond) in [
        (1000, 0.34, 70.0, 2e-5),
        (1000, 0.34, 70.0, 3e-7),
        (1000, 0.5, 120.0, 1e-6),
        (4000, 0.34, 70.0, 3e-7),
        (100, 0.34, 120.0, 3e-7),
    ] {
        let period = Period::from_micros(micros).unwrap();
        let shapes = [swing(-2.0, most, stride), swing(0.0, 60.0, stride)].map(|motion| motion.shapes()[0]);
        let mut bare = PhaseShapeConfig { shapes, stride_s: stride }.build(period).unwrap();
        let [mean, amplitude] = [(most - 2.0) / 2.0, (most + 2.0) / 2.0].map(f32::to_radians);
        let (least, most) = (Radians(mean - amplitude - beyond), Radians(mean + amplitude + beyond));
        let strong = JointLimits { least, most, rate: RadPerSec(20.0), acceleration: RadPerSec2(900.0) };
        let limits = [strong, JointLimits { rate: RadPerSec(20.0), ..KNEE }];
        let mut smooth = TransitionConfig::default().build(bare, limits, period).unwrap();
        let (mut changing, interval) = (0, 250_000 / micros);
        for tick in 0..5_000_000 / micros {
            if tick % interval == interval / 3 {
                let gain = if tick / interval % 2 == 0 { 0.5 } else { 1.0 };
                let adjustment = Adjustment { gain, ..Adjustment::default() };
                smooth.change(|motion| motion.adjust(1, adjustment)).unwrap();
                bare.adjust(1, adjustment).unwrap();
            }
            smooth.step();
            bare.step();
            assert_eq!(smooth.angles()[0], bare.angles()[0], "{micros} us, {stride} s, {beyond} rad, tick {tick}");
            changing += u32::from(smooth.is_changing());
        }
        assert!(changing > 3_000_000 / micros, "{changing} ticks");
    }
}
