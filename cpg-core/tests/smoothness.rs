//! The smoothness contract: over all pairs of named gaits, change times at random, also changes within changes and stops, no setpoint
//! steps, every joint stays in its range, and neither rate nor acceleration exceeds the stated bound.

use cpg_core::Generator;
use cpg_core::gait::family::Member;
use cpg_core::gait::named::{DefaultGait, Gait};
use cpg_core::transition::{JointLimits, TransitionConfig};
use joint_units::{Period, Phase, RadPerSec, RadPerSec2, Radians};

const CHANGES_A_PAIR: u32 = 2000;

/// The gait at a speed, or at the nearest that it allows.
fn build(gait: Gait, speed: f32) -> DefaultGait {
    let (slowest, fastest) = gait.speeds();
    gait.build(speed.clamp(slowest, fastest), Period::MILLISECOND).expect("a named gait")
}

/// Largest rate and acceleration of a gait by itself at any of the speeds that the test uses, rad/s and rad/s^2.
fn own(gait: Gait) -> (f32, f32) {
    let (mut rate, mut acceleration) = (0.0f32, 0.0f32);
    for speed in [0.8, 1.0, 1.2] {
        let mut generator = build(gait, speed);
        for _ in 0..5000 {
            let before = generator.rates();
            generator.step();
            for (a, b) in before.iter().zip(generator.rates()) {
                rate = rate.max(b.0.abs());
                acceleration = acceleration.max((b.0 - a.0).abs() * 1e3);
            }
        }
    }
    (rate, acceleration)
}

/// Least and largest angle of each joint in a gait, rad; the pose that stops lead to is inside.
fn reach(gait: Gait) -> [(f32, f32); 4] {
    let mut generator = build(gait, 1.0);
    let mut reach = STAND.map(|angle| (angle.0, angle.0));
    for _ in 0..5000 {
        generator.step();
        for (reach, angle) in reach.iter_mut().zip(generator.angles()) {
            *reach = (reach.0.min(angle.0), reach.1.max(angle.0));
        }
    }
    reach
}

/// Limits of a robot with these ranges of hips and knees, degrees, and this rate, degrees per second.
const fn limits(hip: (f32, f32), knee: (f32, f32), rate: f32) -> [JointLimits; 4] {
    const fn range((least, most): (f32, f32), rate: f32) -> JointLimits {
        JointLimits {
            least: Radians::from_degrees(least),
            most: Radians::from_degrees(most),
            rate: RadPerSec(Radians::from_degrees(rate).0),
            acceleration: RadPerSec2(349.0),
        }
    }
    [range(hip, rate), range(hip, rate), range(knee, rate), range(knee, rate)]
}

/// Limits that leave little beyond the gaits at speeds up to 1.2: hips -16 to 27 degrees, knees -2 to 70, 557 degrees/s.
const LIMITS: [JointLimits; 4] = limits((-16.0, 27.0), (-2.0, 70.0), 560.0);
/// Limits that contain the gaits of persons too.
const WIDER_LIMITS: [JointLimits; 4] = limits((-25.0, 55.0), (-3.0, 115.0), 560.0);

const STAND: [Radians; 4] = [Radians(0.0), Radians(0.0), Radians(0.1), Radians(0.1)];

/// How far a change may lead a joint beyond what either gait does by itself, degrees.
const ASTRAY_DEG: f32 = 10.0;
/// The same from or to the run as recorded, whose knees reach 720 degrees per second.
const UNSCALED_ASTRAY_DEG: f32 = 15.0;

/// A gait running at one speed, at 64 phases of its cycle.
fn around(gait: Gait, speed: f32) -> Vec<DefaultGait> {
    (0..64u32).map(|k| build(gait, speed).aligned(Phase(k << 26), Period::MILLISECOND)).collect()
}

/// The one that goes on at the phase of `now`.
fn taking_over(from: &DefaultGait, to: &[DefaultGait]) -> DefaultGait {
    to[(from.phase().0 >> 26) as usize]
}

struct Random(u32);

impl Random {
    fn below(&mut self, n: u32) -> u32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        ((u64::from(self.0) * u64::from(n)) >> 32) as u32
    }
}

#[test]
fn no_change_between_any_two_gaits_steps_a_setpoint() {
    let config = TransitionConfig::default();
    let (alone, reaches) = (Gait::ALL.map(own), Gait::ALL.map(reach));
    // The second is of the pairs with the run that the default robot cannot do.
    let mut astray = [0.0f32; 2];
    let running = Gait::ALL.map(|gait| [0.8, 1.0, 1.2].map(|speed| around(gait, speed)));
    let mut random = Random(20);
    let (mut largest_step, mut largest_acceleration, mut closest) = (0.0f32, 0.0f32, 0.0f32);
    for (i, from) in Gait::ALL.into_iter().enumerate() {
        for (j, to) in Gait::ALL.into_iter().enumerate() {
            let unscaled = usize::from([from, to].contains(&Gait::Human(Member::RunUnscaled)));
            let of_persons = [from, to].iter().any(|gait| matches!(gait, Gait::Human(_)));
            let limits = if of_persons { WIDER_LIMITS } else { LIMITS };
            let bound = alone[i].1.max(alone[j].1) + config.acceleration.0;
            let mut smooth = config.build(build(from, 1.0), limits, Period::MILLISECOND).expect("the default");
            for _ in 0..random.below(2000) {
                smooth.step();
            }
            for change in 0..CHANGES_A_PAIR {
                match random.below(8) {
                    0 => smooth.stop(STAND).expect("a pose in range"),
                    1 => smooth.resume(),
                    2 => {
                        let faster_or_slower = &running[j][random.below(3) as usize];
                        smooth.change(|gait| *gait = taking_over(gait, faster_or_slower));
                    }
                    _ => {
                        let next = if change % 2 == 0 { j } else { i };
                        smooth.change(|gait| *gait = taking_over(gait, &running[next][1]));
                    }
                }
                // Half of the changes come while an earlier one still runs.
                let longest = if random.below(2) == 0 { 20 } else { 200 };
                for _ in 0..=random.below(longest) {
                    let (angles, rates) = (smooth.angles(), smooth.rates());
                    smooth.step();
                    let (angles1, rates1) = (smooth.angles(), smooth.rates());
                    for joint in 0..4 {
                        let step = angles1[joint].0 - angles[joint].0;
                        let acceleration = (rates1[joint].0 - rates[joint].0).abs() * 1e3;
                        largest_step = largest_step.max(step.abs());
                        largest_acceleration = largest_acceleration.max(acceleration);
                        closest = closest.max(acceleration / bound);
                        let (a, b) = (reaches[i][joint], reaches[j][joint]);
                        let angle = angles1[joint].0;
                        let limits = &limits[joint];
                        // The rates of the unscaled run are its own.
                        let fast = unscaled == 1 || step.abs() * 1e3 <= limits.rate.0 + 1e-3;
                        assert!(
                            (limits.least.0..=limits.most.0).contains(&angle) && fast,
                            "{} to {}: joint {joint} at {angle} rad, {} rad/s",
                            from.name(),
                            to.name(),
                            step * 1e3
                        );
                        let beyond = (a.0.min(b.0) - angle).max(angle - a.1.max(b.1));
                        astray[unscaled] = astray[unscaled].max(beyond);
                        // 0.5 rad/s^2 and 3e-3 rad/s are roundings of f32 over one tick.
                        assert!(
                            acceleration <= bound + 0.5,
                            "{} to {}: {acceleration} over {bound}",
                            from.name(),
                            to.name()
                        );
                        let mean_rate = 0.5 * (rates[joint].0 + rates1[joint].0);
                        assert!(
                            (step * 1e3 - mean_rate).abs() < 5e-3,
                            "{} to {}: a step of {step}",
                            from.name(),
                            to.name()
                        );
                    }
                }
            }
        }
    }
    println!(
        "{} pairs, {CHANGES_A_PAIR} changes each: largest step {:.3} deg/ms, largest acceleration {largest_acceleration:.1} rad/s^2, \
         {:.0} % of its bound, 0 violations; at most {:.1} deg beyond what either gait reaches, {:.1} with human-run-unscaled",
        Gait::ALL.len() * Gait::ALL.len(),
        largest_step.to_degrees(),
        closest * 100.0,
        astray[0].to_degrees(),
        astray[1].to_degrees()
    );
    assert!(astray[0].to_degrees() < ASTRAY_DEG && astray[1].to_degrees() < UNSCALED_ASTRAY_DEG, "{astray:?} rad");
    assert!(closest > 0.5, "the bound says something");
    assert!(largest_step.to_degrees() < 2.0, "far from the 60 degrees of an uncoupled sine");
}

/// What an uncoupled sine of the clock does when its period is changed, which is what hobby libraries do: it steps.
#[test]
fn an_uncoupled_sine_steps_where_ours_does_not() {
    let angle =
        |t_ms: u32, period_ms: u32| 30.0 * (std::f32::consts::TAU * (t_ms % period_ms) as f32 / period_ms as f32).sin();
    let worst = (1000..9000).map(|t| (angle(t + 1, 700) - angle(t, 1000)).abs()).fold(0.0, f32::max);
    println!("uncoupled sine, period 1000 to 700 ms: up to {worst:.1} deg in 1 ms");
    assert!(worst > 55.0);
}

#[test]
fn every_gait_walks_within_the_gate_and_keeps_its_stride() {
    for gait in Gait::ALL {
        assert_eq!(Gait::from_name(gait.name()), Some(gait));
        let (slowest, fastest) = gait.speeds();
        for speed in [slowest, 1.0, fastest] {
            let mut generator = build(gait, speed);
            let stride = gait.stride_s() / speed;
            let ticks = (20.0 * stride * 1e3) as u32;
            let mut cycles = 0.0;
            for _ in 0..ticks {
                let before = generator.phase().cycles();
                generator.step();
                cycles += (generator.phase().cycles() - before + 0.5).rem_euclid(1.0) - 0.5;
            }
            assert!((cycles - 20.0).abs() < 0.2, "{} at {speed}: {cycles} cycles in 20 strides", gait.name());
            assert!(generator.check().is_ok() && (generator.amplitude() - 1.0).abs() < 0.2);
        }
        assert!(gait.build(0.4, Period::MILLISECOND).unwrap_err().to_string().contains("speed"));
    }
    assert_eq!(Gait::from_name("canter"), None);
}
