//! Tests of the motion: ramps from the park pose to the generator's angles and back, without a limit of the gate.

mod support;

use cpg_core::gait::default_walk::default_walk;
use cpg_core::{Follow, Generator, Unguided};
use joint_loop::{Cause, GateStatus, JointLoop, LoopConfig, SupervisorState};
use joint_units::{Period, PulseMicros, Radians};
use support::{Puppet, default_loop, good, hold, idle, puppet, reach};

const PARK: [Radians; 4] = [Radians(0.0), Radians(0.0), Radians::from_degrees(5.0), Radians::from_degrees(5.0)];
const PARK_PULSES: [PulseMicros; 4] = [PulseMicros(1500), PulseMicros(1500), PulseMicros(1056), PulseMicros(1944)];

/// Measures rate and acceleration of the setpoints tick by tick, independently of the gate.
struct Course {
    last: [f64; 4],
    step: [f64; 4],
    /// Largest rate so far, degrees per second, and largest acceleration, degrees per second squared.
    rate: f64,
    acceleration: f64,
}

impl Course {
    fn at_rest(pose: [Radians; 4]) -> Self {
        Self { last: pose.map(|a| f64::from(a.0)), step: [0.0; 4], rate: 0.0, acceleration: 0.0 }
    }

    fn follow<G: Generator<4> + Follow, const S: usize>(&mut self, joints: &JointLoop<G, S>) {
        let now = joints.frame().setpoints.map(|a| f64::from(a.0));
        for ((now, last), before) in now.into_iter().zip(self.last).zip(&mut self.step) {
            let step = now - last;
            self.rate = self.rate.max(step.abs().to_degrees() * 1e3);
            self.acceleration = self.acceleration.max((step - *before).abs().to_degrees() * 1e6);
            *before = step;
        }
        self.last = now;
    }

    /// Checks the default limits, with the f32 rounding of angles up to 2.1 rad: 3 half-steps of 2^-22 each.
    fn assert_bounded(&self) {
        assert!(self.rate <= 500.0 + 0.03, "{} deg/s", self.rate);
        assert!(self.acceleration <= 20_000.0 + 30.0, "{} deg/s^2", self.acceleration);
    }
}

#[test]
fn the_first_pulses_are_the_park_pose_and_come_with_the_release() {
    let mut joints = reach(&default_loop(), SupervisorState::Disarmed);
    for tick in 0..419 {
        let command = joints.tick(&joint_loop::Sample { button: tick < 400, ..good(tick) });
        assert_eq!(command.pulses, None, "not before the button is stable");
    }
    let command = joints.tick(&good(419));
    assert_eq!(command.pulses, Some(PARK_PULSES));
    assert_eq!((joints.state(), joints.frame().setpoints), (SupervisorState::Arming, PARK));
}

/// The default walk, armed at 55 phases of the stride: no limit acts in the ramp or in ten strides, and in the state walking
/// the setpoints are the generator's angles, bit for bit.
#[test]
fn the_default_walk_passes_the_gate_unchanged() {
    let mut widest = [(f32::MAX, f32::MIN); 4];
    for start in (0..1_100).step_by(20) {
        let mut joints = default_loop();
        idle(&mut joints, 20 + start);
        hold(&mut joints);
        let mut course = Course::at_rest(PARK);
        course.follow(&joints);
        for tick in 0..13_000 {
            joints.tick(&good(tick));
            course.follow(&joints);
            let frame = joints.frame();
            assert_eq!(frame.limited, GateStatus::NONE, "start {start} tick {tick}");
            if frame.state == SupervisorState::Walking {
                let wanted = joints.generator().angles();
                assert_eq!(frame.setpoints.map(|a| a.0.to_bits()), wanted.map(|a| a.0.to_bits()), "tick {tick}");
                for (range, angle) in widest.iter_mut().zip(frame.setpoints) {
                    *range = (range.0.min(angle.degrees()), range.1.max(angle.degrees()));
                }
            } else {
                assert_eq!(frame.state, SupervisorState::Arming);
            }
        }
        course.assert_bounded();
        assert_eq!(joints.frame().limited_ticks, 0);
        assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::Walking, Cause::None));
    }
    // Offsets 5 and 30, amplitudes 20 and 30 degrees, 3.9 percent of overshoot.
    for (joint, (least, most)) in widest.into_iter().enumerate() {
        let (middle, amplitude) = if joint < 2 { (5.0, 20.0 * 1.0388) } else { (30.0, 30.0 * 1.0388) };
        assert!((least - (middle - amplitude)).abs() < 0.1 && (most - (middle + amplitude)).abs() < 0.1, "{widest:?}");
    }
}

/// A stop at every tick of the ramp, and at every seventh tick of two strides: no limit acts, and within 1.003 s the outputs are
/// off, with the joints at rest in exactly the park pose.
#[test]
fn a_stop_is_smooth_from_every_tick() {
    let mut joints = reach(&default_loop(), SupervisorState::Disarmed);
    hold(&mut joints);
    let mut course = Course::at_rest(PARK);
    for tick in 0..4_000 {
        joints.tick(&good(tick));
        course.follow(&joints);
        if tick > 2_100 && tick % 7 != 0 {
            continue;
        }
        let (mut stopping, mut stop) = (joints.clone(), Course { ..course });
        for held in 0..20 {
            stopping.tick(&joint_loop::Sample { button: true, ..good(held) });
            stop.follow(&stopping);
        }
        assert_eq!((stopping.state(), stopping.frame().cause), (SupervisorState::Stopping, Cause::Button));
        let mut last_pulses = None;
        let ticks = (0..2_000)
            .take_while(|tick| {
                let command = stopping.tick(&good(*tick));
                stop.follow(&stopping);
                assert_eq!(stopping.frame().limited, GateStatus::NONE, "stop at {tick}");
                last_pulses = command.pulses.or(last_pulses);
                command.pulses.is_some()
            })
            .count();
        assert!((1_000..=1_003).contains(&ticks), "{ticks}");
        assert_eq!((stopping.state(), stopping.frame().setpoints), (SupervisorState::Disarmed, PARK));
        assert_eq!(last_pulses, Some(PARK_PULSES));
        stop.assert_bounded();
    }
}

/// The same for the stop by a lost sensor: 0.3 s after the tolerance of 50 ms.
#[test]
fn a_hurried_stop_is_smooth_from_every_tick() {
    let mut joints = reach(&default_loop(), SupervisorState::Disarmed);
    hold(&mut joints);
    let mut course = Course::at_rest(PARK);
    let (mut rate, mut acceleration) = (0.0_f64, 0.0_f64);
    for tick in 0..3_600 {
        joints.tick(&good(tick));
        course.follow(&joints);
        if tick > 2_100 && tick % 7 != 0 {
            continue;
        }
        let (mut stopping, mut stop) = (joints.clone(), Course { ..course });
        let mut moved = 0;
        while stopping.state().moving() {
            stopping.tick(&joint_loop::Sample { codes: [support::OPEN], ..good(tick) });
            stop.follow(&stopping);
            assert_eq!(stopping.frame().limited, GateStatus::NONE);
            moved += 1;
        }
        assert!((350..=354).contains(&moved), "{moved}");
        assert_eq!((stopping.state(), stopping.frame().cause), (SupervisorState::Disarmed, Cause::SensorOpen));
        assert_eq!(stopping.frame().setpoints, PARK);
        stop.assert_bounded();
        (rate, acceleration) = (rate.max(stop.rate), acceleration.max(stop.acceleration));
    }
    println!("hurried stop: at most {rate:.0} deg/s, {acceleration:.0} deg/s^2");
    assert!(rate > 300.0 && acceleration > 3_000.0, "the samples contain a large motion");
}

/// Jumps and targets beyond all limits are bounded, with the outputs on.
#[test]
fn a_jumping_generator_is_bounded() {
    let mut config = LoopConfig::default_biped();
    config.monitor.pose_tolerance_s = 1.0;
    let poses = [[60.0, -30.0, 120.0, 0.0], [-30.0, 60.0, 0.0, 120.0], [400.0, -400.0, 400.0, 400.0], [0.0; 4]];
    for period_of_jumps in [1, 7, 50, 130, 400] {
        let mut joints = config
            .build(
                Period::MILLISECOND,
                Unguided(Jumper { poses, every: period_of_jumps, steps: 0 }),
                [Some(support::sensor())],
            )
            .expect("valid");
        idle(&mut joints, 40);
        hold(&mut joints);
        let mut course = Course::at_rest(PARK);
        course.follow(&joints);
        for tick in 0..10_000 {
            joints.tick(&good(tick));
            course.follow(&joints);
            for (angle, range) in joints.frame().setpoints.iter().zip(config.gate.range) {
                assert!(*angle >= range.least && *angle <= range.most);
            }
            for limit in config.gate.pose.iter().flatten() {
                // Rounding of two angles to f32.
                assert!(limit.of(&joints.frame().setpoints).0 <= limit.most.0 + 2.4e-7);
            }
        }
        course.assert_bounded();
        assert!(joints.frame().limited_ticks > 1_000);
    }
}

#[derive(Debug, Clone)]
struct Jumper {
    poses: [[f32; 4]; 4],
    every: u32,
    steps: u32,
}

impl Generator<4> for Jumper {
    fn step(&mut self) {
        self.steps += 1;
    }
    fn angles(&self) -> [Radians; 4] {
        self.poses[(self.steps / self.every % 4) as usize].map(Radians::from_degrees)
    }
    fn rates(&self) -> [joint_units::RadPerSec; 4] {
        [joint_units::RadPerSec(0.0); 4]
    }
    fn phase(&self) -> joint_units::Phase {
        joint_units::Phase(0)
    }
    fn amplitude(&self) -> f32 {
        1.0
    }
    fn check(&self) -> Result<(), cpg_core::StateFault> {
        Ok(())
    }
    fn reset(&mut self) {
        self.steps = 0;
    }
}

/// The generator is stepped once per call. Missed steps are not made up.
#[test]
fn the_generator_is_stepped_once_per_call() {
    let mut joints = reach(&puppet(Puppet::at([0.0; 4])), SupervisorState::Walking);
    let (steps, seq) = (joints.generator().steps, joints.frame().seq);
    assert_eq!(steps, seq);
    joints.tick(&joint_loop::Sample { elapsed: 5, ..good(0) });
    assert_eq!((joints.generator().steps, joints.frame().seq), (steps + 1, seq + 1));
    assert_eq!((joints.frame().missed, joints.frame().tick), (4, seq + 5));
}

/// Other control periods give the same motion.
#[test]
fn the_motion_does_not_depend_on_the_period() {
    let mut config = LoopConfig::default_biped();
    config.monitor.sensor_required = false;
    let mut poses = Vec::new();
    for micros in [500, 1_000, 2_000] {
        let period = Period::from_micros(micros).expect("valid");
        let walk = Unguided(default_walk(period).expect("valid"));
        let mut joints = config.build(period, walk, []).expect("valid");
        let ticks = |ms: u32| ms * 1_000 / micros;
        let mut run = |ms: u32, button: bool| {
            for _ in 0..ticks(ms) {
                joints.tick(&joint_loop::Sample { button, ..joint_loop::Sample::default() });
            }
        };
        run(40, false);
        run(400, true);
        run(1_420, false);
        assert_eq!((joints.state(), joints.frame().limited_ticks), (SupervisorState::Arming, 0));
        poses.push(joints.frame().setpoints.map(Radians::degrees));
    }
    for joint in 0..4 {
        // The release is accepted up to one tick earlier or later: 0.2 degrees per millisecond at 200 deg/s.
        assert!((poses[0][joint] - poses[1][joint]).abs() < 0.3, "{poses:?}");
        assert!((poses[2][joint] - poses[1][joint]).abs() < 0.6, "{poses:?}");
    }
}
