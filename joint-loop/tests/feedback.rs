//! Feedback of a joint's angle in the loop: what it adds while the joints walk, nothing at the park pose, nothing without a good sample, and which
//! robots are refused.

mod support;

use cpg_core::gait::default_walk::default_walk;
use cpg_core::{Follow, Generator, Unguided};
use joint_loop::motion::feedback::{FeedbackConfig, MOST_ADDED};
use joint_loop::setup::default_loop::{BoardLoopError, Parameters, board_loop};
use joint_loop::{
    FollowConfig, GateStatus, GeneratorConfig, JointLoop, JointSensor, JointSensors, LoopConfig, LoopError,
    RobotConfig, SERIES_HARMONICS, Sample, SeriesConfig, ShapeConfig, SupervisorState,
};
use joint_units::{AdcCode, Joint, Period, Radians, Volts};
use support::{OPEN, Puppet, good, hold, idle, press, run, sensor};

const KNEE: usize = Joint::LeftKnee as usize;
/// Codes of 2.0 V at 3.3 V: the sensor of these tests is at 30 degrees.
const AT_30_DEG: [AdcCode; 2] = [AdcCode(2_482), AdcCode(2_483)];

/// The default configuration with a share at the left knee, whose sensor has the only channel.
fn config(share: f32) -> LoopConfig {
    let mut config = LoopConfig::default_biped();
    (config.feedback.share[KNEE], config.feedback.channel[KNEE]) = (share, Some(0));
    config.monitor.sensor_required = false;
    config
}

fn built<G: Generator<4> + Follow>(config: &LoopConfig, generator: G) -> JointLoop<G, 1> {
    config.build(Period::MILLISECOND, generator, [Some(sensor())]).expect("allowed")
}

fn at_30_deg(sample: Sample<1>) -> Sample<1> {
    let [odd, even] = AT_30_DEG;
    Sample { codes: [if sample.codes == good(1).codes { odd } else { even }], ..sample }
}

/// A loop that has walked for 3 s after its ramp, with hips at 0, the left knee at 20 and the right one at 5 degrees.
fn walking(share: f32) -> JointLoop<Puppet, 1> {
    let mut joints = built(&config(share), Puppet::at([0.0, 0.0, 20.0, 5.0]));
    idle(&mut joints, 100);
    hold(&mut joints);
    run(&mut joints, 5_000, at_30_deg);
    assert_eq!(joints.state(), SupervisorState::Walking);
    joints
}

/// The joint stands at 30 degrees and the generator asks for 20: s = 20 + share (s - 30).
#[test]
fn a_joint_that_is_held_is_pressed_by_the_share() {
    for share in [0.3_f32, 0.6, -0.3, -0.8] {
        let setpoints = walking(share).frame().setpoints.map(Radians::degrees);
        let want = (20.0 - share * 30.0) / (1.0 - share);
        let bounded = want.clamp(20.0 - MOST_ADDED.degrees(), 20.0 + MOST_ADDED.degrees());
        assert!((setpoints[KNEE] - bounded).abs() < 0.05, "{share}: {} deg, not {bounded}", setpoints[KNEE]);
        // Stiffer presses away from where the joint is, softer gives way to it.
        assert_eq!(setpoints[KNEE] < 20.0, share > 0.0);
        assert_eq!((setpoints[0], setpoints[1]), (0.0, 0.0));
        assert!((setpoints[3] - 5.0).abs() < 1e-5);
    }
}

#[test]
fn without_a_good_sample_the_setpoint_is_the_generators() {
    let mut joints = walking(0.5);
    assert!(joints.frame().setpoints[KNEE].degrees() < 11.0);
    run(&mut joints, 200, |sample| Sample { codes: [OPEN], ..sample });
    assert_eq!(
        (joints.state(), joints.frame().setpoints[KNEE]),
        (SupervisorState::Walking, Radians::from_degrees(20.0))
    );
    // And again when it is good.
    run(&mut joints, 1_000, at_30_deg);
    assert!(joints.frame().setpoints[KNEE].degrees() < 11.0);
}

/// The strongest feedback of a joint that is far away: the motion begins and ends at the park pose, the gate keeps its limits, and no more than the bound
/// is added.
#[test]
fn the_ramps_begin_and_end_at_the_park_pose() {
    for share in [0.8, -0.8] {
        let walk = || Unguided(default_walk(Period::MILLISECOND).expect("valid"));
        let (mut joints, mut plain) = (built(&config(share), walk()), built(&config(0.0), walk()));
        let park = LoopConfig::default_biped().blend.park;
        let mut both = |sample: Sample<1>| {
            let sample = at_30_deg(sample);
            plain.tick(&sample);
            (joints.tick(&sample), joints.frame(), plain.frame())
        };
        let (mut last, mut speed, mut added) = (park, [0.0_f32; 4], 0.0_f32);
        let mut begun = false;
        for tick in 0..9_000 {
            let button = (100..500).contains(&tick) || (6_000..6_200).contains(&tick);
            let (command, frame, plain) = both(Sample { button, ..good(tick) });
            assert_eq!(frame.state, plain.state, "tick {tick}");
            if command.pulses.is_some() {
                if !begun {
                    assert_eq!(frame.setpoints, park, "the first pulses");
                }
                for joint in 0..4 {
                    let step = frame.setpoints[joint].0 - last[joint].0;
                    assert!(
                        step.abs() <= 0.0088 && (step - speed[joint]).abs() <= 0.000_36,
                        "tick {tick} joint {joint}"
                    );
                    speed[joint] = step;
                }
                added = added.max((frame.setpoints[KNEE].0 - plain.setpoints[KNEE].0).abs());
                (last, begun) = (frame.setpoints, true);
            } else if begun {
                assert_eq!(last, park, "the last pulses");
                assert_eq!(frame.setpoints, park);
            }
        }
        assert!(begun && joints.state() == SupervisorState::Disarmed);
        // The gate may be some way behind a step of the target.
        assert!(added > 0.9 * MOST_ADDED.0 && added < 1.5 * MOST_ADDED.0, "{} deg", added.to_degrees());
    }
}

/// A wrong sensor within its range: whatever its angle is, the target moves by no more than the bound.
#[test]
fn a_wrong_sensor_moves_a_setpoint_by_no_more_than_the_bound() {
    for share in [0.8, -0.8] {
        let mut joints = built(&config(share), Puppet::at([0.0, 0.0, 20.0, 5.0]));
        idle(&mut joints, 100);
        hold(&mut joints);
        run(&mut joints, 2_500, at_30_deg);
        let mut most = 0.0_f32;
        for tick in 0..6_000_u32 {
            // From one end of the table, codes 621 to 3103, to the other and back.
            let at = tick % 3_000;
            let code = 640 + (if at < 1_500 { at } else { 3_000 - at }) * 8 / 5;
            joints.tick(&Sample { codes: [AdcCode(code as u16)], ..good(tick) });
            most = most.max((joints.frame().setpoints[KNEE].degrees() - 20.0).abs());
        }
        assert_eq!(joints.state(), SupervisorState::Walking);
        assert!(most > 9.0 && most <= MOST_ADDED.degrees() + 0.01, "{most} deg");
    }
}

/// Without a share the bits are those of a loop that does not know feedback; with one they differ, and two loops of one kind have the same.
#[test]
fn no_share_changes_no_bit() {
    let hash = |config: LoopConfig| {
        let mut joints = built(&config, Unguided(default_walk(Period::MILLISECOND).expect("valid")));
        idle(&mut joints, 100);
        hold(&mut joints);
        idle(&mut joints, 6_000);
        press(&mut joints);
        idle(&mut joints, 2_000);
        (joints.frame().setpoint_hash, joints.frame().limited_ticks)
    };
    let none = LoopConfig { feedback: FeedbackConfig::NONE, ..config(0.0) };
    assert_eq!(hash(none), hash(config(0.0)));
    assert_eq!(hash(config(0.0)).1, 0);
    assert_eq!(hash(config(0.3)), hash(config(0.3)));
    assert_ne!(hash(config(0.3)).0, hash(none).0);
    assert_ne!(hash(config(0.3)).0, hash(config(-0.3)).0);
}

#[test]
fn the_gate_may_limit_what_feedback_asks_for() {
    let mut joints = walking(0.3);
    let before = joints.frame().limited_ticks;
    // The sensor jumps back: the next servo frame asks for another target at once.
    idle(&mut joints, 100);
    assert!(joints.frame().limited_ticks > before + 5);
    assert_eq!(joints.frame().limited, GateStatus::NONE);
}

fn follower_of(joint: Joint) -> GeneratorConfig {
    let series = |mean: f32| SeriesConfig {
        mean: Radians(mean),
        cos: core::array::from_fn::<f32, SERIES_HARMONICS, _>(|at| if at == 0 { 0.2 } else { 0.0 }),
        sin: [0.0; SERIES_HARMONICS],
    };
    let shape = ShapeConfig { stride_s: 1.2, joints: [0.1, 0.1, 0.4, 0.4].map(series) };
    GeneratorConfig::Follow(FollowConfig {
        sensor: joint,
        events: cpg_core::entrainment::EventSource::None,
        shape,
        corrections: cpg_core::entrainment::Corrections::NONE,
    })
}

/// The loop of a board with sensors at these joints and feedback at both knees.
fn refusal(generator: GeneratorConfig, sensors: &[Joint], share: f32) -> Result<(), BoardLoopError> {
    let sensors = sensors.iter().map(|joint| JointSensor::uncalibrated(*joint).expect("monotone"));
    let sensors = JointSensors::build(sensors).expect("joints");
    let robot = RobotConfig { feedback: [0.0, 0.0, share, share], ..RobotConfig::default_biped() };
    let parameters = Parameters { generator, sensors, robot };
    board_loop(&parameters, AdcCode(1501), Volts(2.7), true).map(|_| ())
}

#[test]
fn a_share_needs_a_sensor_on_the_robot() {
    use Joint::{LeftHip, LeftKnee, RightKnee};
    let walk = GeneratorConfig::default_walk;
    for sensors in [&[LeftKnee, RightKnee][..], &[LeftHip, RightKnee, LeftKnee]] {
        for share in [0.8, 0.3, -0.8] {
            assert_eq!(refusal(walk(), sensors, share), Ok(()));
        }
    }
    let error = refusal(walk(), &[RightKnee, LeftHip], 0.3).expect_err("no sensor on the left knee");
    assert_eq!(error, BoardLoopError::Loop(LoopError::FeedbackWithoutSensor { joint: LeftKnee, share: 0.3 }));
    assert_eq!(
        error.to_string(),
        "loop: robot.feedback[left_knee] is 0.3, but left_knee has no sensor; allowed without one is 0: connect and pack a sensor of left_knee, \
         or leave `feedback` of left_knee out of the robot file"
    );
    assert_eq!(refusal(walk(), &[LeftHip], 0.0), Ok(()));
    let error = refusal(walk(), &[LeftKnee, RightKnee], 0.9).expect_err("too much").to_string();
    assert_eq!(error, "loop: robot.feedback[left_knee] is 0.9; allowed are -0.8 to 0.8");
}

#[test]
fn the_sensor_of_a_person_has_no_share() {
    use Joint::{LeftHip, LeftKnee, RightKnee};
    let all = [LeftHip, LeftKnee, RightKnee];
    assert_eq!(refusal(follower_of(LeftHip), &all, 0.3), Ok(()));
    let error = refusal(follower_of(RightKnee), &all, 0.3).expect_err("it follows the right knee of a person");
    assert_eq!(error, BoardLoopError::Loop(LoopError::FeedbackOfPerson { joint: RightKnee, share: 0.3 }));
    assert!(
        error
            .to_string()
            .contains("the generator follows the sensor of right_knee, which is on a person; allowed is 0")
    );
    assert_eq!(refusal(follower_of(RightKnee), &all, 0.0), Ok(()));
}
