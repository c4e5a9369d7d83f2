//! Changes while the loop runs: when they take effect, that they stay inside the limits and are smooth, what is refused, and that nothing arms.

mod support;

use cpg_core::Generator;
use hgod_adc::Validity;
use joint_loop::setup::default_loop::{BoardLoop, Parameters, board_loop};
use joint_loop::tuning::{Action, Answer, LONGEST_WAIT_S, Outcome, Parameter, RAMP_S, Request};
use joint_loop::{
    BoardFaults, Cause, Debugger, FollowConfig, GateConfig, GeneratorConfig, RobotConfig, SENSORS, Sample,
    SeriesConfig, ShapeConfig, SupervisorState, WatchdogHz,
};
use joint_units::{AdcCode, Joint, PulseMicros, Radians, Volts};
use proptest::prelude::*;

const IDLE: Sample<SENSORS> = Sample {
    elapsed: 1,
    codes: [AdcCode(2048); SENSORS],
    vrefint: AdcCode(1651),
    button: false,
    foot: false,
    late: false,
    faults: BoardFaults::NONE,
    watchdog_clock: Some(WatchdogHz(32_000)),
    debugger: Debugger::Absent,
    program_unproven: false,
    request: None,
};

/// Before its first tick.
fn fresh(generator: Option<GeneratorConfig>) -> BoardLoop {
    let default = Parameters::with_defaults(generator, None, RobotConfig::default_biped()).expect("valid");
    board_loop(&default, AdcCode(1501), Volts(2.7), false).expect("valid")
}

/// After the test of the emergency stop.
fn board(generator: Option<GeneratorConfig>) -> BoardLoop {
    let mut joints = fresh(generator);
    for tick in 0..60 {
        let faults = if (20..40).contains(&tick) { BoardFaults::BREAK_INPUT } else { BoardFaults::NONE };
        joints.tick(&Sample { faults, ..IDLE });
    }
    joints
}

/// A follower of the left knee that moves by one harmonic.
fn follower() -> GeneratorConfig {
    let series = |mean: f32, cos: f32| {
        let mut all = SeriesConfig { mean: Radians(mean), cos: [0.0; 8], sin: [0.0; 8] };
        all.cos[0] = cos;
        all
    };
    let joints = [series(0.2, 0.3), series(0.2, -0.3), series(0.5, 0.4), series(0.5, -0.4)];
    let shape = ShapeConfig { stride_s: 1.1, joints };
    GeneratorConfig::Follow(FollowConfig {
        sensor: Joint::LeftKnee,
        events: cpg_core::entrainment::EventSource::ALL[0],
        shape,
        corrections: cpg_core::entrainment::Corrections::NONE,
    })
}

fn run(joints: &mut BoardLoop, ticks: u32, button: bool) {
    for _ in 0..ticks {
        joints.tick(&Sample { button, ..IDLE });
    }
}

/// Armed and walking, `more` ticks later.
fn walking(more: u32) -> BoardLoop {
    let mut joints = board(None);
    run(&mut joints, 100, false);
    run(&mut joints, 400, true);
    run(&mut joints, 2_120 + more, false);
    assert_eq!(joints.state(), SupervisorState::Walking);
    joints
}

fn ask(joints: &mut BoardLoop, number: u16, action: Action) -> Vec<Answer> {
    joints.tick(&Sample { request: Some(Request { number, action }), ..IDLE });
    joints.answers().collect()
}

fn set(name: &str, thousandths: i32) -> Action {
    Action::Set { parameter: Parameter::from_name(name).expect("it is in the table"), thousandths }
}

/// Runs until settings take effect; their answer.
fn effect(joints: &mut BoardLoop) -> Option<Answer> {
    for _ in 0..10_000 {
        if let Some(answer) = joints.answers().find(|answer| answer.outcome == Outcome::InEffect) {
            return Some(answer);
        }
        joints.tick(&IDLE);
    }
    None
}

/// Limits of a tick, from those of the default robot and not from the gate: range, and rate with the step of the gate's integers.
fn assert_inside(before: &BoardLoop, after: &BoardLoop) {
    let limits = GateConfig::default_biped().joint_limits();
    let angles = before.frame().setpoints.into_iter().zip(after.frame().setpoints);
    for ((was, now), limits) in angles.zip(limits) {
        assert!((limits.least.0 - 1e-6..=limits.most.0 + 1e-6).contains(&now.0), "{now:?}");
        assert!((now.0 - was.0).abs() <= limits.rate.0 * 1.001e-3, "{was:?} {now:?}");
    }
}

#[test]
fn a_change_is_staged_and_takes_effect_at_the_phase_boundary() {
    let mut joints = walking(0);
    let tick = joints.frame().tick + 1;
    assert_eq!(ask(&mut joints, 9, set("speed", 1_300)), [Answer { tick, number: 9, outcome: Outcome::Staged }]);
    assert_eq!(joints.settings().value(Parameter::Speed), 1.0);
    let mut phase = joints.generator().phase();
    let answer = loop {
        joints.tick(&IDLE);
        if let Some(answer) = joints.answers().next() {
            break answer;
        }
        phase = joints.generator().phase();
    };
    // The boundary was in the tick before.
    assert!(phase.cycles() < 0.002, "{phase:?}");
    assert_eq!(answer, Answer { tick: joints.frame().tick, number: 9, outcome: Outcome::InEffect });
    assert_eq!(joints.settings().value(Parameter::Speed), 1.3);
}

/// Ticks of the last of four strides of the generator.
fn stride(joints: &mut BoardLoop) -> u32 {
    let mut wraps = Vec::new();
    while wraps.len() < 4 {
        let before = joints.generator().phase();
        joints.tick(&IDLE);
        if joints.generator().phase().0 < before.0 {
            wraps.push(joints.frame().tick);
        }
    }
    wraps[3] - wraps[2]
}

#[test]
fn the_speed_divides_the_stride_time() {
    let mut joints = walking(0);
    let normal = stride(&mut joints);
    for thousandths in [1_500, 1_250, 500, 1_000] {
        ask(&mut joints, 1, set("speed", thousandths));
        effect(&mut joints).expect("a boundary comes");
        run(&mut joints, 1_000, false);
        let want = f64::from(normal) * 1000.0 / f64::from(thousandths);
        assert!((f64::from(stride(&mut joints)) - want).abs() <= 2.0, "{thousandths}: {want}");
    }
}

/// Least and greatest setpoint of a joint over two strides, degrees.
fn swing(joints: &mut BoardLoop, joint: Joint) -> (f32, f32) {
    let angles = (0..2_200).map(|_| {
        joints.tick(&IDLE);
        joints.frame().setpoints[joint as usize].degrees()
    });
    angles.fold((f32::MAX, f32::MIN), |(least, most), angle| (least.min(angle), most.max(angle)))
}

#[test]
fn amplitude_and_offset_change_their_joint_alone() {
    let mut joints = walking(0);
    let (least, most) = swing(&mut joints, Joint::LeftKnee);
    let other = swing(&mut joints, Joint::RightKnee);
    ask(&mut joints, 1, set("amplitude_left_knee", 500));
    ask(&mut joints, 2, set("offset_left_knee", 10_000));
    assert_eq!(effect(&mut joints).map(|answer| answer.number), Some(2), "both take effect together");
    run(&mut joints, 1_001, false);
    let park = joint_loop::DEFAULT_PARK[Joint::LeftKnee as usize].degrees();
    let want = |angle: f32| park + 0.5 * (angle - park) + 10.0;
    let (now_least, now_most) = swing(&mut joints, Joint::LeftKnee);
    assert!((now_least - want(least)).abs() < 0.05 && (now_most - want(most)).abs() < 0.05, "{now_least} {now_most}");
    let (other_least, other_most) = swing(&mut joints, Joint::RightKnee);
    assert!((other_least - other.0).abs() < 0.05 && (other_most - other.1).abs() < 0.05);
}

#[test]
fn undo_discards_what_is_staged_or_goes_back_one_change() {
    let mut joints = walking(0);
    let outcome = |answers: Vec<Answer>| answers.into_iter().map(|answer| answer.outcome).collect::<Vec<_>>();
    assert_eq!(outcome(ask(&mut joints, 1, Action::Undo)), [Outcome::NothingToUndo]);
    ask(&mut joints, 2, set("speed", 1_200));
    assert_eq!(outcome(ask(&mut joints, 3, Action::Undo)), [Outcome::InEffect]);
    run(&mut joints, 1, false);
    assert_eq!(effect(&mut joints), None);
    ask(&mut joints, 4, set("speed", 1_200));
    effect(&mut joints).expect("a boundary comes");
    assert_eq!(outcome(ask(&mut joints, 5, Action::Undo)), [Outcome::Staged]);
    assert_eq!(effect(&mut joints).map(|answer| answer.number), Some(5));
    assert_eq!(joints.settings().value(Parameter::Speed), 1.0);
    ask(&mut joints, 6, Action::Undo);
    effect(&mut joints).expect("a boundary comes");
    assert_eq!(joints.settings().value(Parameter::Speed), 1.2, "undoing an undo");
}

#[test]
fn what_is_not_allowed_is_refused_and_changes_nothing() {
    for (generator, action, outcome) in [
        (None, set("speed", 1_501), Outcome::OutOfRange),
        (None, set("speed", i32::MIN), Outcome::OutOfRange),
        (None, set("gait", 1_500), Outcome::OutOfRange),
        (None, set("gait", 5_000), Outcome::OutOfRange),
        (None, set("offset_left_hip", -15_001), Outcome::OutOfRange),
        (None, set("record_rate", 0), Outcome::OutOfRange),
        (None, set("follow", 0), Outcome::NotAFollower),
        (Some(follower()), set("follow", 500), Outcome::OutOfRange),
        (Some(follower()), set("speed", 1_100), Outcome::FollowsAPerson),
        (None, Action::Undo, Outcome::NothingToUndo),
    ] {
        let mut joints = board(generator);
        run(&mut joints, 50, false);
        let (before, tick) = (*joints.settings(), joints.frame().tick + 1);
        let answers = ask(&mut joints, 77, action);
        assert_eq!(answers, [Answer { tick, number: 77, outcome }], "{action:?}");
        assert!(outcome.is_refused());
        run(&mut joints, 5_000, false);
        assert_eq!(*joints.settings(), before);
    }
}

#[test]
fn a_follower_without_its_sensor_stands_and_a_gait_by_name_takes_a_speed() {
    let mut joints = board(Some(follower()));
    run(&mut joints, 50, false);
    let outcomes = |answers: Vec<Answer>| answers.into_iter().map(|answer| answer.outcome).collect::<Vec<_>>();
    assert_eq!(outcomes(ask(&mut joints, 1, set("follow", 0))), [Outcome::Staged, Outcome::InEffect]);
    assert!(!joints.settings().follow());
    assert_eq!(outcomes(ask(&mut joints, 2, set("gait", 2_000))), [Outcome::Staged, Outcome::InEffect]);
    assert_eq!(outcomes(ask(&mut joints, 3, set("speed", 1_100))), [Outcome::Staged, Outcome::InEffect]);
}

#[test]
fn a_change_without_a_phase_boundary_does_not_wait_for_ever() {
    // A follower that sees nobody move stands.
    let mut joints = board(Some(follower()));
    run(&mut joints, 100, false);
    run(&mut joints, 400, true);
    run(&mut joints, 3_020, false);
    assert_eq!(joints.state(), SupervisorState::Walking);
    let asked = joints.frame().tick + 1;
    ask(&mut joints, 1, set("offset_left_hip", 5_000));
    let answer = effect(&mut joints).expect("it takes effect");
    let waited = f64::from(answer.tick - asked) / 1000.0;
    assert!((waited - f64::from(LONGEST_WAIT_S)).abs() <= 0.002, "{waited}");
}

#[test]
fn a_stop_is_immediate_and_is_the_short_ramp() {
    let mut joints = walking(300);
    let tick = joints.frame().tick + 1;
    assert_eq!(ask(&mut joints, 5, Action::Stop), [Answer { tick, number: 5, outcome: Outcome::InEffect }]);
    let frame = joints.frame();
    assert_eq!((frame.tick, frame.state, frame.cause), (tick, SupervisorState::Stopping, Cause::Request));
    run(&mut joints, 820, false);
    assert_eq!(joints.state(), SupervisorState::Disarmed);
    assert_eq!(joints.tick(&IDLE).pulses, None);
}

#[test]
fn the_ramp_is_the_minimum_jerk_profile() {
    // An offset on a joint that stands: the follower without a person.
    let mut joints = board(Some(follower()));
    run(&mut joints, 100, false);
    run(&mut joints, 400, true);
    run(&mut joints, 3_020, false);
    let at = |joints: &BoardLoop| joints.frame().setpoints[Joint::LeftHip as usize].degrees();
    let first = at(&joints);
    ask(&mut joints, 1, set("offset_left_hip", 10_000));
    effect(&mut joints).expect("it takes effect");
    let ticks = (RAMP_S * 1000.0) as u32;
    for tick in 1..=ticks {
        joints.tick(&IDLE);
        let x = f64::from(tick) / f64::from(ticks);
        let want = f64::from(first) + 10.0 * x.powi(3) * (10.0 + x * (6.0 * x - 15.0));
        assert!((f64::from(at(&joints)) - want).abs() < 2e-3, "{tick}: {} {want}", at(&joints));
    }
}

#[test]
fn without_a_request_the_angles_are_those_of_the_generator() {
    // The default walk alone, with the ramps over: bit for bit.
    let mut joints = walking(0);
    for _ in 0..5_000 {
        joints.tick(&IDLE);
        let setpoints = joints.frame().setpoints.map(|angle| angle.0.to_bits());
        assert_eq!(setpoints, joints.generator().angles().map(|angle| angle.0.to_bits()));
    }
}

fn any_action() -> impl Strategy<Value = Action> {
    let near = (0..Parameter::COUNT, 0.0..1.0_f64).prop_map(|(place, share)| {
        let parameter = Parameter::ALL[place];
        let [least, most, _] = parameter.range();
        let value = least + (f64::from(most - least) * share) as i32;
        let thousandths = if parameter.is_whole() { value / 1000 * 1000 } else { value };
        Action::Set { parameter, thousandths }
    });
    let any = (0..Parameter::COUNT, any::<i32>())
        .prop_map(|(place, thousandths)| Action::Set { parameter: Parameter::ALL[place], thousandths });
    let trim = (0..Joint::COUNT, prop::bool::ANY, 0..3_000_u16).prop_map(|(place, jog, pulse)| match jog {
        true => Action::Jog { pulse: PulseMicros(pulse) },
        false => Action::Trim { joint: Joint::ALL[place] },
    });
    prop_oneof![8 => near, 1 => any, 1 => Just(Action::Undo), 1 => trim]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Two changes at random phases of the stride: the setpoints stay inside range and rates, the change takes effect at the tick that is
    /// acknowledged, and a replay gives the same bits.
    #[test]
    fn any_change_at_any_phase_stays_inside_and_replays(
        phase in 0_u32..1_100,
        first in any_action(),
        second in any_action(),
        between in 0_u32..2_500,
        stop in any::<bool>(),
    ) {
        let start = walking(phase);
        let (mut joints, mut inputs, mut frames) = (start.clone(), Vec::new(), Vec::new());
        for tick in 0..6_000_u32 {
            let action = match tick {
                0 => Some(first),
                tick if tick == 1 + between => Some(second),
                5_200 if stop => Some(Action::Stop),
                _ => None,
            };
            let request = action.map(|action| Request { number: tick as u16, action });
            let sample = Sample { request, ..IDLE };
            let (before, settings) = (joints.clone(), *joints.settings());
            let command = joints.tick(&sample);
            assert_inside(&before, &joints);
            // Settings change in a tick that is answered so, and in no other.
            let in_effect = joints.answers().any(|answer| {
                answer.outcome == Outcome::InEffect && answer.tick == joints.frame().tick && action != Some(Action::Stop)
            });
            prop_assert!(in_effect || settings == *joints.settings());
            prop_assert_eq!(command.pulses.is_some(), joints.state().moving());
            inputs.push(sample);
            frames.push(joints.frame());
        }
        let mut again = start;
        for (sample, frame) in inputs.iter().zip(&frames) {
            again.tick(sample);
            prop_assert_eq!(again.frame(), *frame);
        }
        // The pose envelope may have stopped a motion that was led too far; nothing else may.
        prop_assert!(frames.iter().all(|frame| [Cause::None, Cause::Pose, Cause::Request].contains(&frame.cause)));
    }

    /// From every state without a press: no request leads to a moving state, and in a moving one none prolongs it.
    #[test]
    fn no_request_arms(actions in prop::collection::vec(any_action(), 1..40), state in 0..3_usize, stop in any::<bool>()) {
        let state = [SupervisorState::Boot, SupervisorState::Disarmed, SupervisorState::Fault][state];
        let mut joints = if state == SupervisorState::Boot { fresh(None) } else { board(None) };
        if state != SupervisorState::Boot {
            run(&mut joints, 50, false);
        }
        if state == SupervisorState::Fault {
            joints.tick(&Sample { faults: BoardFaults::CLOCK, ..IDLE });
        }
        prop_assert_eq!(joints.state(), state);
        for (number, action) in (0..).zip(actions.into_iter().chain(stop.then_some(Action::Stop))) {
            ask(&mut joints, number, action);
            prop_assert!(!joints.state().moving());
            run(&mut joints, 30, false);
            prop_assert!(!joints.state().moving());
        }
    }
}

#[test]
fn a_stop_in_the_tick_of_a_release_refuses_to_arm() {
    let mut joints = board(None);
    run(&mut joints, 50, false);
    run(&mut joints, 400, true);
    run(&mut joints, 19, false);
    joints.tick(&Sample { request: Some(Request { number: 1, action: Action::Stop }), ..IDLE });
    assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::Disarmed, Cause::Request));
    assert_eq!(joints.frame().validity[0], Some(Validity::Good));
}

/// Every gait of the table runs from every other one, inside the limits.
#[test]
fn every_gait_leads_to_every_other() {
    let mut joints = walking(0);
    for number in [1, 2, 3, 4, 2, 4, 1, 3, 1, 0, 3, 0, 2, 0, 4, 3, 2, 1, 4, 0] {
        ask(&mut joints, number, set("gait", i32::from(number) * 1000));
        for _ in 0..2_600 {
            let before = joints.clone();
            joints.tick(&IDLE);
            assert_inside(&before, &joints);
        }
        assert_eq!(joints.settings().thousandths(Parameter::Gait), i32::from(number) * 1000);
        assert_eq!(joints.state(), SupervisorState::Walking);
    }
}
