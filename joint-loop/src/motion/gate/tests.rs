//! Tests of the gate against independent calculations: braking is simulated step by step, and limits are checked on the
//! integers and on the returned angles.

use super::*;
use crate::setup::robot::{JointRange, PoseLimit, PoseSense, anatomy};
use core::num::NonZeroU32;
use joint_units::{RadPerSec, RadPerSec2};
use proptest::prelude::*;

type Change = fn(&mut GateConfig);

const SPECIALS: [f32; 12] = [
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::MAX,
    f32::MIN,
    f32::MIN_POSITIVE,
    -1.0e-45,
    1.0e-45,
    0.0,
    -0.0,
    1.0e30,
    f32::EPSILON,
];

/// Pseudo-random numbers (splitmix64), for long tests that need no shrinking.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: u64) -> u64 {
        self.bits() % n
    }

    fn between(&mut self, least: f32, most: f32) -> f32 {
        least + (most - least) * (self.bits() >> 40) as f32 / (1 << 24) as f32
    }
}

fn config() -> GateConfig {
    GateConfig::default_biped()
}

fn default() -> Gate {
    Gate::build(&config(), Period::MILLISECOND).expect("valid")
}

fn park(gate: &Gate) -> GateState {
    gate.rest([0.0, 0.0, 0.0873, 0.0873].map(Radians)).expect("inside")
}

fn degrees(pose: [f32; 4]) -> [Radians; 4] {
    pose.map(Radians::from_degrees)
}

/// Checks the limits after a tick on the integers, exactly.
fn assert_kept(gate: &Gate, before: &GateState, after: &GateState) {
    for joint in 0..4 {
        let (p, limits) = (after.position[joint], &gate.joints[joint]);
        let a = i64::from(limits.acceleration.get());
        assert!((limits.least..=limits.most).contains(&p), "range of joint {joint}: {p} {limits:?}");
        assert_eq!(after.step[joint], p - before.position[joint]);
        let step = i64::from(after.step[joint]);
        assert!(step.abs() <= i64::from(limits.rate), "rate of joint {joint}: {step}");
        assert!((step - i64::from(before.step[joint])).abs() <= a, "acceleration of joint {joint}");
    }
    for edge in gate.edges() {
        assert!(edge.sum(&after.position) <= edge.most, "{edge:?} {after:?}");
    }
}

/// Brakes all joints at the largest deceleration until they rest, and checks the limits at each step.
fn assert_brakes(gate: &Gate, state: &GateState) {
    let mut now = *state;
    while now.step != [0; 4] {
        let before = now;
        for joint in 0..4 {
            let a = gate.joints[joint].acceleration.get() as i32;
            now.step[joint] = (now.step[joint].abs() - a).max(0) * now.step[joint].signum();
            now.position[joint] += now.step[joint];
        }
        assert_kept(gate, &before, &now);
    }
}

/// A random target: inside, at corners, far outside, special.
fn target(random: &mut Random, kind: u64, last: [Radians; 4]) -> [Radians; 4] {
    let mut pose = last;
    for (joint, angle) in pose.iter_mut().enumerate() {
        angle.0 = match kind {
            0 => random.between(-1.0, 2.5),
            1 => [-10.0, 10.0][random.below(2) as usize],
            2 => angle.0 + random.between(-0.02, 0.02),
            3 => SPECIALS[random.below(12) as usize],
            4 => f32::from_bits(random.bits() as u32),
            // The largest loads on the pose envelope: opposite hips, bent knees.
            5 => [[2.0, -2.0, 2.4, 2.4], [-2.0, 2.0, 2.4, 2.4]][(random.0 >> 7) as usize & 1][joint],
            _ => angle.0,
        };
    }
    pose
}

fn random_config(random: &mut Random) -> (GateConfig, Period) {
    let mut config = config();
    let micros = [100, 500, 1_000, 2_000, 10_000][random.below(5) as usize];
    for (rate, acceleration) in config.rate.iter_mut().zip(&mut config.acceleration) {
        *rate = RadPerSec(random.between(0.5, 17.0));
        // At least 8 steps per tick squared are allowed.
        let (braking, dt) = (rate.0 * rate.0, micros as f32 * 1e-6);
        let resolution = 9.0 / STEPS / (dt * dt);
        *acceleration = RadPerSec2(random.between(braking / 3.0, 1_000.0).max(braking).max(resolution));
    }
    for (range, joint) in config.range.iter_mut().zip(Joint::ALL) {
        let whole = anatomy::range(joint);
        *range = JointRange {
            least: Radians(random.between(whole.least.0, -0.01)),
            most: Radians(random.between(0.2, whole.most.0)),
        };
    }
    for limit in &mut config.pose {
        let first = Joint::ALL[random.below(4) as usize];
        let second = Joint::ALL[(first as usize + 1 + random.below(3) as usize) % 4];
        let sense = if random.below(2) == 0 { PoseSense::Sum } else { PoseSense::Difference };
        let most = Radians(random.between(0.2, 2.5));
        *limit = (random.below(4) > 0).then_some(PoseLimit { first, second, sense, most });
    }
    (config, Period::from_micros(micros).expect("valid"))
}

/// Random configurations and inputs: sequences of 20 to 80 ticks, more than 10 million in all, each equal to the gate without shortcuts.
#[test]
fn bounds_hold_for_any_input_sequence() {
    let random = &mut Random(1);
    let mut worst = GateStatus::NONE;
    let mut compared = 0;
    for case in 0..225_000 {
        let (config, period) = if case % 2 == 0 { (config(), Period::MILLISECOND) } else { random_config(random) };
        let gate = Gate::build(&config, period).expect("valid");
        let mut state = park(&gate);
        let mut wanted = degrees([0.0, 0.0, 5.0, 5.0]);
        let hold = 1 + random.below(60);
        // In a third of the sequences the targets move slowly and without jumps.
        let drift: [f32; 4] = core::array::from_fn(|_| random.between(-1e-3, 1e-3));
        for tick in 0..20 + random.below(60) {
            if case % 3 == 0 && tick > 0 {
                for (angle, drift) in wanted.iter_mut().zip(drift) {
                    angle.0 += drift * (tick.min(20) as f32 / 20.0);
                }
            } else if tick % hold == 0 {
                let kind = if case % 3 == 0 { 2 } else { random.below(7) };
                wanted = target(random, kind, wanted);
            }
            let before = state;
            match gate.limit(&mut state, wanted) {
                Ok((setpoints, status)) => {
                    assert_kept(&gate, &before, &state);
                    let mut slow = before;
                    let slowly = gate.limit_slowly(&mut slow, wanted);
                    assert_eq!(
                        (setpoints.map(|a| a.0.to_bits()), status, state),
                        (slowly.0.map(|a| a.0.to_bits()), slowly.1, slow),
                        "{before:?}"
                    );
                    assert!(wanted.iter().all(|angle| angle.0.is_finite()));
                    worst = worst.with(status);
                    compared += 1;
                    for (angle, range) in setpoints.iter().zip(&config.range) {
                        assert!(*angle >= range.least && *angle <= range.most, "{angle:?} {range:?}");
                    }
                }
                Err(NonFinite { joint }) => {
                    assert!(!wanted[joint as usize].0.is_finite());
                    assert_eq!(state, before);
                    wanted = degrees([0.0, 0.0, 5.0, 5.0]);
                }
            }
            if tick % 16 == 0 {
                assert_brakes(&gate, &state);
            }
        }
        assert_brakes(&gate, &state);
    }
    assert_eq!(worst.bits(), 0b1111, "every limit has acted");
    assert!(compared > 10_000_000, "{compared} ticks");
}

/// Margins up to one step, up to many, and of whole ranges.
fn margins() -> impl Strategy<Value = i64> {
    prop_oneof![0_i64..1_000_000, 0_i64..50_000_000, 0_i64..2_600_000_000]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// The same as a property test, so that a failure shrinks; special values at every input.
    #[test]
    fn bounds_hold_and_shrink(
        seed: u64,
        targets in prop::collection::vec(
            prop::array::uniform4(prop_oneof![
                4 => -1.2_f32..2.6,
                2 => prop::sample::select(SPECIALS.to_vec()),
                1 => prop::num::f32::ANY,
            ]),
            1..80,
        ),
    ) {
        let (config, period) = random_config(&mut Random(seed));
        let gate = Gate::build(&config, period).expect("valid");
        let mut state = park(&gate);
        for target in targets {
            let before = state;
            let passed = gate.limit(&mut state, target.map(Radians));
            let bad = target.iter().position(|angle| !angle.is_finite());
            prop_assert_eq!(passed.err(), bad.map(|joint| NonFinite { joint: Joint::ALL[joint] }));
            if bad.is_some() {
                prop_assert_eq!(state, before);
            } else {
                assert_kept(&gate, &before, &state);
                assert_brakes(&gate, &state);
            }
        }
    }

    /// brake and reach against simulated braking.
    #[test]
    fn the_braking_distance_is_exact(v in 1_i64..2_400_000, a in 8_u32..1_000_000, margin in margins()) {
        let limits = Limits { acceleration: NonZeroU32::new(a).expect("positive"), ..default().joints[0] };
        let stepped = |v: i64| (1..).map(|k| v - k * i64::from(a)).take_while(|v| *v > 0).sum::<i64>();
        prop_assume!(v / i64::from(a) < 10_000);
        prop_assert_eq!(limits.brake(v), stepped(v));
        let reach = limits.reach(margin);
        prop_assume!(reach / i64::from(a) < 10_000);
        prop_assert!(reach == 0 || reach + stepped(reach) <= margin);
        prop_assert!(reach + 1 + stepped(reach + 1) > margin);
        prop_assert_eq!(limits.reach(-margin), -margin);
    }

    /// From rest to any target inside: without overshoot, in the time of the slowest trapezoidal profile, and then equal to the
    /// target bit for bit.
    #[test]
    fn a_reachable_target_is_reached_without_overshoot(
        from in prop::array::uniform4(0.0_f32..1.0), to in prop::array::uniform4(0.0_f32..1.0),
    ) {
        // Knees to 70 degrees and hips within 70 of each other: no edge of the envelope acts.
        let pose = |share: [f32; 4]| degrees([share[0] * 70.0 - 30.0, share[1] * 70.0 - 30.0, share[2] * 72.0 - 2.0, share[3] * 72.0 - 2.0]);
        let (gate, from, to) = (default(), pose(from), pose(to));
        let mut state = gate.rest(from).expect("inside");
        let (rate, a) = (gate.joints[0].rate as f64, f64::from(gate.joints[0].acceleration.get()));
        let furthest = state.position.iter().zip(to).map(|(p, t)| (f64::from(t.0 * STEPS) - f64::from(*p)).abs()).fold(0.0, f64::max);
        // Up, along, down: d / V + V / A; without reaching V: 2 sqrt(d / A). One tick late for the goal to be known, and some
        // for whole ticks.
        let ticks = if furthest > rate * rate / a { furthest / rate + rate / a } else { 2.0 * (furthest / a).sqrt() } + 4.0;
        let start = state.position;
        for _ in 0..ticks as u32 {
            gate.limit(&mut state, to).expect("finite");
            for joint in 0..4 {
                let (p, s, t) = (state.position[joint], start[joint], (to[joint].0 * STEPS) as i32);
                prop_assert!(s.min(t) <= p && p <= s.max(t), "overshoot of joint {}", joint);
            }
        }
        let (setpoints, status) = gate.limit(&mut state, to).expect("finite");
        prop_assert_eq!(setpoints.map(|a| a.0.to_bits()), to.map(|a| a.0.to_bits()));
        prop_assert_eq!(status, GateStatus::NONE);
    }

    /// From the state after any inputs, the gate settles on any target inside the envelope.
    #[test]
    fn every_inside_target_is_reached_from_everywhere(seed: u64, to in prop::array::uniform4(0.0_f32..1.0)) {
        let (gate, random) = (default(), &mut Random(seed));
        let mut state = park(&gate);
        let mut wanted = degrees([0.0; 4]);
        for tick in 0..400 {
            if tick % 40 == 0 {
                wanted = target(random, [0, 1, 5][(seed % 3) as usize], wanted);
            }
            gate.limit(&mut state, wanted).expect("finite");
        }
        let to = degrees([to[0] * 90.0 - 30.0, to[1] * 90.0 - 30.0, to[2] * 122.0 - 2.0, to[3] * 122.0 - 2.0]);
        prop_assume!(gate.rest(to).is_some());
        for _ in 0..2_000 {
            gate.limit(&mut state, to).expect("finite");
        }
        prop_assert_eq!(state, gate.rest(to).expect("inside"));
    }

    /// A target within all limits passes bit for bit.
    #[test]
    fn what_is_inside_passes_exactly(
        amplitude in prop::array::uniform4(0.0_f32..0.45), hertz in prop::array::uniform4(0.1_f32..2.0), phase in 0.0_f32..6.2,
    ) {
        let gate = default();
        let pose = |tick: u32| {
            let mut pose = [0.1, 0.1, 0.6, 0.6].map(Radians);
            for joint in 0..4 {
                let turns = core::f32::consts::TAU * hertz[joint] * tick as f32 * 1e-3;
                // The amplitude grows smoothly from 0 within a second.
                let x = (tick as f32 * 1e-3).min(1.0);
                let grown = x * x * x * (10.0 - 15.0 * x + 6.0 * x * x);
                pose[joint].0 += amplitude[joint] * grown * ((turns + phase).sin());
            }
            pose
        };
        let mut state = gate.rest(pose(0)).expect("inside");
        for tick in 1..3_000 {
            let (setpoints, status) = gate.limit(&mut state, pose(tick)).expect("finite");
            prop_assert_eq!((setpoints, status), (pose(tick), GateStatus::NONE), "tick {}", tick);
        }
    }
}

/// Every pose of a 10 degree grid beyond all ranges, in sequence, for 8 ticks and for 200 ticks each.
#[test]
fn no_pose_of_the_grid_leads_out_of_the_envelope() {
    let gate = default();
    let hips: Vec<f32> = (-5..=8).map(|n| n as f32 * 10.0).collect();
    let knees: Vec<f32> = (-2..=14).map(|n| n as f32 * 10.0).collect();
    for dwell in [8, 200] {
        let (mut state, mut poses) = (park(&gate), 0);
        for (index, left_hip) in hips.iter().enumerate() {
            for right_hip in &hips {
                for left_knee in &knees {
                    for right_knee in knees.iter().skip(if dwell == 200 { index % 5 } else { 0 }).step_by(dwell / 8) {
                        let pose = degrees([*left_hip, *right_hip, *left_knee, *right_knee]);
                        for _ in 0..dwell {
                            let before = state;
                            gate.limit(&mut state, pose).expect("finite");
                            assert_kept(&gate, &before, &state);
                        }
                        poses += 1;
                    }
                }
            }
        }
        assert_eq!(poses, if dwell == 8 { 14 * 14 * 17 * 17 } else { 14 * 14 * 17 });
    }
}

#[test]
fn each_limit_has_its_bit() {
    let gate = default();
    let run = |target: [f32; 4], ticks: u32| {
        let mut state = park(&gate);
        (0..ticks).map(|_| gate.limit(&mut state, degrees(target)).expect("finite").1).last().expect("some")
    };
    // Half a radian away: first acceleration, then rate, then braking, then no limit.
    assert_eq!(run([50.0, 0.0, 5.0, 5.0], 1), GateStatus::ACCELERATION);
    assert_eq!(run([50.0, 0.0, 5.0, 5.0], 60), GateStatus::RATE);
    assert_eq!(run([50.0, 0.0, 5.0, 5.0], 120), GateStatus::ACCELERATION);
    assert_eq!(run([50.0, 0.0, 5.0, 5.0], 200).bits(), 0);
    // Beyond the range: as long as the target is there.
    assert_eq!(run([70.0, 0.0, 5.0, 5.0], 500), GateStatus::RANGE);
    assert_eq!(run([0.0, -30.1, 5.0, 5.0], 500), GateStatus::RANGE);
    // Beyond the envelope: likewise, and each joint takes half of the excess.
    assert_eq!(run([0.0, 0.0, 80.0, 90.0], 500), GateStatus::POSE);
    let mut state = park(&gate);
    let held = (0..500).map(|_| gate.limit(&mut state, degrees([0.0, 0.0, 80.0, 90.0])).expect("finite").0).last();
    let held = held.expect("some").map(Radians::degrees);
    assert!((held[2] - 70.0).abs() < 1e-4 && (held[3] - 80.0).abs() < 1e-4, "{held:?}");
}

/// One joint moves from one end of its range to the other while the second is held by the edge of the envelope: in both joint
/// orders, and for both kinds of edge.
#[test]
fn a_joint_that_follows_an_edge_stays_on_its_side() {
    use Joint::{LeftHip, RightHip};
    for (first, second) in [(LeftHip, RightHip), (RightHip, LeftHip)] {
        for (sense, from, to, presses) in [
            // first + second <= 20: the second falls from 50 to its end, the first wants 60.
            (PoseSense::Sum, [-30.0, 50.0], [60.0, -30.0], 50.0),
            // first - second <= 20: the second rises from -20 to its end, the first wants 60.
            (PoseSense::Difference, [0.0, -20.0], [60.0, 40.0], 60.0),
        ] {
            let mut config = config();
            config.pose = [None; POSE_LIMITS];
            config.pose[0] = Some(PoseLimit { first, second, sense, most: Radians::from_degrees(20.0) });
            let gate = Gate::build(&config, Period::MILLISECOND).expect("valid");
            let pose = |[of_first, of_second]: [f32; 2]| {
                let mut pose = degrees([0.0, 0.0, 5.0, 5.0]);
                pose[first as usize] = Radians::from_degrees(of_first);
                pose[second as usize] = Radians::from_degrees(of_second);
                pose
            };
            for head_start in (0..400).step_by(7) {
                let mut state = gate.rest(pose(from)).expect("inside");
                let mut follow = |target: [Radians; 4], ticks| {
                    for _ in 0..ticks {
                        let before = state;
                        gate.limit(&mut state, target).expect("finite");
                        assert_kept(&gate, &before, &state);
                        assert_brakes(&gate, &state);
                    }
                };
                // The first moves to the edge and is held there; then the second moves.
                follow(pose([to[0], from[1]]), head_start);
                follow(pose(to), 600);
                let reached = Radians(state.position[first as usize] as f32 / STEPS).degrees();
                assert!((reached - presses).abs() < 0.01, "{first:?} {sense:?}: {reached}");
            }
        }
    }
}

/// A target is limited to its range before the envelope, so a target beyond its range does not move another joint.
#[test]
fn range_comes_before_the_envelope() {
    let gate = default();
    for (target, kept) in [
        ([0.0, 0.0, 1000.0, 5.0], [0.0, 0.0, 120.0, 5.0]),
        ([-1000.0, 20.0, 5.0, 5.0], [-30.0, 20.0, 5.0, 5.0]),
        ([20.0, 1000.0, 5.0, 5.0], [20.0, 60.0, 5.0, 5.0]),
    ] {
        let mut state = park(&gate);
        let settled = (0..500).map(|_| gate.limit(&mut state, degrees(target)).expect("finite")).last();
        assert_eq!(settled, Some((degrees(kept), GateStatus::RANGE)), "{target:?}");
    }
}

/// Nothing of the motion before is left: the next ticks are those of a gate that was built at rest there.
#[test]
fn a_state_at_rest_forgets_its_goal() {
    let gate = default();
    let limit = |state: &mut GateState, target| gate.limit(state, target).expect("finite");
    for ticks in [1, 20, 150] {
        let mut moving = park(&gate);
        for _ in 0..ticks {
            limit(&mut moving, degrees([20.0, -10.0, 50.0, 40.0]));
        }
        let mut rested = moving.at_rest();
        let mut built = GateState { position: moving.position, step: [0; 4], goal: moving.position };
        for tick in 0..300 {
            // Slower than the rate, so that what is left of a goal is not bounded away.
            let target = degrees([0.02, -0.01, 0.05, 0.04].map(|rate| 10.0 + rate * tick as f32));
            assert_eq!(limit(&mut rested, target), limit(&mut built, target), "tick {tick} after {ticks} ticks");
        }
    }
}

/// On the edge to the step: nothing is limited, and nothing is reported. Single precision has every 32nd step there.
#[test]
fn a_target_on_the_edge_of_the_envelope_is_inside() {
    let gate = default();
    assert!(!gate.edges().is_empty());
    for edge in gate.edges() {
        let [first, second] = edge.joints.map(|joint| joint as usize);
        let mut position = park(&gate).position;
        // Half of the sum each, as far as the range of the second joint allows.
        position[second] = gate.joints[second].hold(i64::from(edge.most / 2 * edge.sign));
        position[first] = edge.most - edge.sign * position[second];
        for (beyond, status) in [(0, GateStatus::NONE), (32, GateStatus::POSE)] {
            position[first] += beyond;
            let target = position.map(|position| Radians(position as f32 / STEPS));
            let allowed = gate.allowed(target);
            assert_eq!(allowed.aimed, position, "exact in single precision");
            assert_eq!((allowed.status, allowed.goal == position), (status, beyond == 0), "{edge:?}");
        }
    }
}

#[test]
fn rest_is_refused_outside() {
    let gate = default();
    for pose in [[-31.0, 0.0, 5.0, 5.0], [0.0, 0.0, 5.0, 121.0], [0.0, 0.0, 80.0, 80.0], [40.0, -36.0, 5.0, 5.0]] {
        assert_eq!(gate.rest(degrees(pose)), None, "{pose:?}");
    }
    assert_eq!(gate.rest([f32::NAN, 0.0, 0.1, 0.1].map(Radians)), None);
}

#[test]
fn every_field_is_checked_by_name() {
    let broken = |change: Change| {
        let mut config = config();
        change(&mut config);
        Gate::build(&config, Period::MILLISECOND).expect_err("broken").to_string()
    };
    let cases: [(&str, Change); 12] = [
        ("gate.range.least[left_hip] is not", |c| c.range[0].least = Radians(f32::NAN)),
        ("gate.range.least[right_hip] is -31 deg; allowed are -30 to 120 deg", |c| {
            c.range[1].least = Radians::from_degrees(-31.0);
        }),
        ("gate.range.most[left_knee] is 141 deg", |c| c.range[2].most = Radians::from_degrees(141.0)),
        ("gate.range[right_knee]: the least must be below the most", |c| c.range[3].least = c.range[3].most),
        ("gate.rate[left_hip] is 1001 deg/s; allowed are 1 to 1000", |c| c.rate[0] = RadPerSec(rad_per_s(1001.0))),
        ("gate.rate[right_hip] is 0 deg/s", |c| c.rate[1] = RadPerSec(0.0)),
        ("gate.rate[left_knee] is not", |c| c.rate[2] = RadPerSec(f32::INFINITY)),
        ("gate.acceleration[right_knee] is 1000 deg/s^2; allowed are 1388.", |c| {
            c.acceleration[3] = RadPerSec2(rad_per_s(1000.0));
        }),
        ("gate.acceleration[left_hip] is 61000", |c| c.acceleration[0] = RadPerSec2(rad_per_s(61_000.0))),
        ("gate.acceleration[left_knee] is not", |c| c.acceleration[2] = RadPerSec2(f32::NAN)),
        ("gate.pose[1] must name two different joints", |c| {
            c.pose[1] = c.pose[1].map(|p| PoseLimit { second: p.first, ..p })
        }),
        ("gate.pose.most is 5 rad", |c| c.pose[0] = c.pose[0].map(|p| PoseLimit { most: Radians(5.0), ..p })),
    ];
    for (words, change) in cases {
        let error = broken(change);
        assert!(error.starts_with(words), "{error}");
    }
}

/// 20000 deg/s^2 are 9.4 steps a tick squared at 10 us, and 2.3 at 5 us, where 8 take 68000 deg/s^2.
#[test]
fn a_period_too_short_for_the_resolution_is_refused() {
    let build = |micros| Gate::build(&config(), Period::from_micros(micros).expect("valid"));
    assert_eq!(build(10).map(|gate| gate.joints[0].acceleration.get()), Ok(9));
    let error = build(5).expect_err("too short").to_string();
    assert!(error.starts_with("gate.acceleration[left_hip] is 20000 deg/s^2; allowed are 68301."), "{error}");

    let slow = GateConfig { rate: [RadPerSec(rad_per_s(1.5)); 4], ..config() };
    let error = Gate::build(&slow, Period::from_micros(1).expect("valid")).expect_err("too short").to_string();
    assert!(error.starts_with("gate.rate[left_hip] is 1.5 deg/s; allowed are 1.708 to 1000 deg/s"), "{error}");
}

fn rad_per_s(degrees: f32) -> f32 {
    Radians::from_degrees(degrees).0
}

/// Values of a robot file at the printed bounds: degrees become radians and back, both rounded.
#[test]
fn the_bounds_that_an_error_names_are_allowed() {
    for (rate, acceleration, is_allowed) in [
        (1.0, 1.0e4, true),
        (0.999, 1.0e4, false),
        (1000.0, 6.0e4, true),
        (1001.0, 6.0e4, false),
        (500.0, 6.01e4, false),
        (30.0, 5.0, true),
        (30.0, 4.99, false),
    ] {
        let mut config = GateConfig::default_biped();
        config.rate = [RadPerSec(Radians::from_degrees(rate).0); Joint::COUNT];
        config.acceleration = [RadPerSec2(Radians::from_degrees(acceleration).0); Joint::COUNT];
        let built = Gate::build(&config, Period::MILLISECOND);
        assert_eq!(built.is_ok(), is_allowed, "{rate} deg/s, {acceleration} deg/s^2: {:?}", built.err());
    }
}

/// Both ends of any range are poses of rest, although a range is rounded inward to whole steps.
#[test]
fn the_ends_of_a_range_are_poses_of_rest() {
    for hundredth in 1..400 {
        let mut config = GateConfig::default_biped();
        config.pose = [None; POSE_LIMITS];
        let least = Radians::from_degrees(hundredth as f32 * 0.01);
        config.range =
            [JointRange { least, most: Radians::from_degrees(50.0 + hundredth as f32 * 0.01) }; Joint::COUNT];
        let gate = Gate::build(&config, Period::MILLISECOND).expect("a range");
        for pose in config
            .range
            .map(|range| [range.least; Joint::COUNT])
            .into_iter()
            .chain([config.range.map(|range| range.most)])
        {
            let rest = gate.rest(pose).unwrap_or_else(|| panic!("{hundredth}: {pose:?}"));
            let angles = gate.pose(&rest);
            assert!(angles.iter().zip(pose).all(|(is, asked)| (is.0 - asked.0).abs() < 1e-6), "{angles:?} {pose:?}");
        }
        assert_eq!(gate.rest([Radians(least.0 - 1e-5); Joint::COUNT]), None);
    }
}
