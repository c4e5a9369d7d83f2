//! Trim: one servo moves, slowly and within its pulses, the others stay parked; a hold of the button begins it, a press ends it; and it never leads
//! to a walk.

mod support;

use joint_loop::control::trim::{SILENCE_S, STEP_S};
use joint_loop::tuning::{Action, Outcome, Request};
use joint_loop::{BoardFaults, Cause, JointLoop, RobotConfig, Sample, SupervisorState};
use joint_units::{AdcCode, Joint, PulseMicros};
use proptest::prelude::*;
use support::{OPEN, Walk, default_loop, good};

type Board = JointLoop<Walk, 1>;

/// The wire of the one sensor, which a walk requires, is open.
fn idle() -> Sample<1> {
    Sample { codes: [OPEN], ..good(0) }
}

/// At rest, for longer than an open wire is tolerated.
fn board() -> Board {
    let mut joints = default_loop();
    run(&mut joints, 100);
    joints
}

fn tick(joints: &mut Board, sample: &Sample<1>) {
    joints.tick(sample);
}

fn run(joints: &mut Board, ticks: u32) {
    for _ in 0..ticks {
        joints.tick(&idle());
    }
}

fn pressed(joints: &mut Board, ticks: u32) {
    for _ in 0..ticks {
        joints.tick(&Sample { button: true, ..idle() });
    }
    run(joints, 20);
}

/// The press that ends a trim; its release does nothing, although it comes after a hold.
fn press(joints: &mut Board) {
    pressed(joints, 400);
}

/// The hold that begins a trim, so long after the last press that it is not one of too many.
fn hold(joints: &mut Board) {
    run(joints, 5_000);
    pressed(joints, 400);
}

fn ask(joints: &mut Board, action: Action) -> Outcome {
    joints.tick(&Sample { request: Some(Request { number: 7, action }), ..idle() });
    joints.answers().next().expect("an answer").outcome
}

fn jog(joints: &mut Board, pulse: u16) -> Outcome {
    ask(joints, Action::Jog { pulse: PulseMicros(pulse) })
}

/// In the trim of this joint.
fn trimming(joint: Joint) -> Board {
    let mut joints = board();
    assert_eq!(ask(&mut joints, Action::Trim { joint }), Outcome::Staged);
    hold(&mut joints);
    assert_eq!(joints.state(), SupervisorState::Trimming);
    joints
}

/// Pulses of the park pose, by the definition of the servo map.
fn parked() -> [u16; 4] {
    let RobotConfig { servos, park, .. } = RobotConfig::default_biped();
    Joint::ALL.map(|joint| {
        let servo = servos[joint as usize];
        servo.build(joint).expect("valid").pulse(park[joint as usize]).expect("finite").0
    })
}

fn pulses(joints: &Board) -> [u16; 4] {
    joints.frame().pulses.map(|pulse| pulse.0)
}

#[test]
fn one_servo_moves_by_a_microsecond_a_step_and_the_others_stay() {
    for joint in Joint::ALL {
        let (mut joints, place) = (trimming(joint), joint as usize);
        assert_eq!(pulses(&joints), parked());
        let from = parked()[place];
        for goal in [from + 40, from - 25] {
            let (begins, way) = (pulses(&joints)[place], i32::from(goal) - i32::from(pulses(&joints)[place]));
            let mut moved_at = vec![];
            for tick in 0..700_u32 {
                let before = pulses(&joints);
                if tick == 0 {
                    assert_eq!(jog(&mut joints, goal), Outcome::InEffect);
                } else {
                    joints.tick(&idle());
                }
                for (other, (was, is)) in before.iter().zip(pulses(&joints)).enumerate() {
                    let step = i32::from(is) - i32::from(*was);
                    assert!(other == place && step == way.signum() || step == 0, "{joint:?} {other} {step}");
                    if step != 0 {
                        moved_at.push(tick);
                    }
                }
            }
            assert_eq!(pulses(&joints)[place], goal, "{joint:?} from {begins}");
            let step = (STEP_S * 1000.0) as u32;
            assert!(moved_at.windows(2).all(|pair| pair[1] - pair[0] == step), "{moved_at:?}");
            assert_eq!(moved_at.len() as u32, way.unsigned_abs());
        }
        // The frame has the angle of the pulse by the present map.
        let map = RobotConfig::default_biped().servos[place].build(joint).expect("valid");
        assert_eq!(joints.frame().setpoints[place], map.angle(PulseMicros(from - 25)));
    }
}

#[test]
fn a_press_a_stop_request_silence_and_a_demand_end_it_where_the_servo_is() {
    type End = fn(&mut Board);
    let ends: [(End, Cause, SupervisorState); 5] = [
        (press, Cause::Button, SupervisorState::TrimReady),
        (|joints| assert_eq!(ask(joints, Action::Stop), Outcome::InEffect), Cause::Request, SupervisorState::TrimReady),
        (|joints| run(joints, (SILENCE_S * 1000.0) as u32), Cause::HostSilent, SupervisorState::TrimReady),
        (|joints| tick(joints, &Sample { elapsed: 10, ..idle() }), Cause::Gap, SupervisorState::TrimReady),
        (
            |joints| tick(joints, &Sample { faults: BoardFaults::BREAK_INPUT, ..idle() }),
            Cause::BreakInput,
            SupervisorState::Fault,
        ),
    ];
    for (end, cause, state) in ends {
        let mut joints = trimming(Joint::LeftKnee);
        assert_eq!(jog(&mut joints, 1_200), Outcome::InEffect);
        run(&mut joints, 500);
        assert!(joints.state() == SupervisorState::Trimming && pulses(&joints)[2] != 0, "{cause:?}");
        end(&mut joints);
        assert_eq!((joints.state(), joints.frame().cause, pulses(&joints)), (state, cause, [0; 4]));
        // A jog moves nothing any more.
        assert_eq!(jog(&mut joints, 1_300), Outcome::NotTrimming);
        run(&mut joints, 100);
        assert_eq!(pulses(&joints), [0; 4]);
    }
}

#[test]
fn a_host_that_repeats_its_jog_keeps_the_trim_going() {
    let mut joints = trimming(Joint::LeftHip);
    for _ in 0..30 {
        assert_eq!(jog(&mut joints, 1_500), Outcome::InEffect);
        run(&mut joints, (SILENCE_S * 1000.0) as u32 - 10);
    }
    assert_eq!(joints.state(), SupervisorState::Trimming);
}

/// Also while the loop would not let anything move: no hold of the button is meant for a trim any more.
#[test]
fn a_stop_request_leads_out_of_trim_ready_whatever_else_demands_a_stop() {
    let mut joints = board();
    assert_eq!(ask(&mut joints, Action::Trim { joint: Joint::LeftHip }), Outcome::Staged);
    let request = Some(Request { number: 8, action: Action::Stop });
    tick(&mut joints, &Sample { elapsed: 8, request, ..idle() });
    assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::Disarmed, Cause::Request));
}

/// A hold that was meant for a trim does not start a walk, whatever ended the trim before; a stop request leads back.
#[test]
fn after_a_trim_a_hold_trims_again_from_where_it_ended() {
    let mut joints = trimming(Joint::RightHip);
    for _ in 0..3 {
        jog(&mut joints, 1_600);
        run(&mut joints, 300);
        let ended = pulses(&joints);
        assert!((30..=31).contains(&(ended[1] - parked()[1])), "{ended:?}");
        press(&mut joints);
        assert_eq!(joints.state(), SupervisorState::TrimReady);
        hold(&mut joints);
        assert_eq!(joints.state(), SupervisorState::Trimming);
        // It went on to its goal until the press counted, and has begun the way back.
        assert!(pulses(&joints)[1].abs_diff(ended[1]) <= 3, "{:?} after {ended:?}", pulses(&joints));
        run(&mut joints, 250);
        assert!(pulses(&joints)[1] > parked()[1], "slowly");
        run(&mut joints, 100);
        assert_eq!(pulses(&joints), parked());
    }
    press(&mut joints);
    assert_eq!(ask(&mut joints, Action::Trim { joint: Joint::LeftKnee }), Outcome::Staged);
    assert_eq!(ask(&mut joints, Action::Stop), Outcome::InEffect);
    assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::Disarmed, Cause::Request));
    // The sensors are open: the walk refuses.
    hold(&mut joints);
    assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::Disarmed, Cause::SensorOpen));
}

/// A servo whose trim ended far outside of its joint's range, beside the trim of another one: it goes to the park pose as slowly as a trim, and only
/// then can the other one be moved.
#[test]
fn another_trim_begins_by_the_way_to_the_park_pose() {
    let mut joints = trimming(Joint::LeftHip);
    let far = trimmed_to(&mut joints, 0, 2_500);
    press(&mut joints);
    assert_eq!(ask(&mut joints, Action::Trim { joint: Joint::RightKnee }), Outcome::Staged);
    hold(&mut joints);
    let begun = pulses(&joints);
    assert!(begun[0].abs_diff(far) <= 2 && begun[1..] == parked()[1..], "{begun:?}");
    assert_eq!(jog(&mut joints, parked()[3] - 100), Outcome::InEffect);
    let mut ticks = 0;
    while pulses(&joints)[0] != parked()[0] {
        let was = pulses(&joints);
        // A host repeats its jog.
        jog(&mut joints, parked()[3] - 100);
        ticks += 1;
        let is = pulses(&joints);
        assert!(was[0] - is[0] <= 1 && is[1..] == parked()[1..], "{was:?} {is:?}");
    }
    assert_eq!(u32::div_ceil(ticks, 10), u32::from(begun[0] - parked()[0]));
    run(&mut joints, 1_000);
    assert_eq!(pulses(&joints)[3], parked()[3] - 100);
}

/// A walk after such a trim: it starts at the last pulse, holds it, leaves it as slowly as a trim up to the range of the joint, and goes on at the rate of
/// the joint. A stop on the way ends where the servo is, and the next hold starts there.
#[test]
fn a_walk_after_a_trim_starts_where_the_trim_ended_and_leaves_it_slowly() {
    const MOST: u16 = 2_167; // 60 degrees, the end of the hip's range
    let mut joints = trimming(Joint::LeftHip);
    trimmed_to(&mut joints, 0, 2_500);
    press(&mut joints);
    // The first stop request is taken in trim_ready.
    assert_eq!(ask(&mut joints, Action::Stop), Outcome::InEffect);
    assert_eq!(joints.state(), SupervisorState::Disarmed);
    let good_hold = |joints: &mut Board| {
        (0..5_400).for_each(|n| tick(joints, &Sample { button: n >= 5_000, ..good(n) }));
        (0..20).for_each(|n| tick(joints, &good(n)));
        assert_eq!(joints.state(), SupervisorState::Arming);
    };
    let mut last = 2_500;
    for round in 0..2 {
        good_hold(&mut joints);
        let begun = pulses(&joints);
        assert!(begun[0].abs_diff(last) <= 2 && begun[1..] == parked()[1..], "{begun:?} after {last}");
        for n in 0..400 {
            tick(&mut joints, &good(n));
            assert_eq!(pulses(&joints), begun, "held");
        }
        let mut moved = 0;
        // In the second round as far as the range of the joint.
        for n in 0..if round == 0 { 1_500_u32 } else { 400 } {
            let was = pulses(&joints)[0];
            tick(&mut joints, &good(n));
            if pulses(&joints)[0] != was {
                assert!(pulses(&joints)[0] + 1 == was && (moved == 0 || n - moved >= 10), "{was} {n}");
                moved = n;
            }
        }
        last = pulses(&joints)[0];
        assert!(last < begun[0] - 20 && last > MOST, "{last}");
        if round == 0 {
            (0..20).for_each(|n| tick(&mut joints, &Sample { button: true, ..good(n) }));
            assert_eq!(joints.state(), SupervisorState::Stopping);
            let mut ticks = 0;
            while joints.state() == SupervisorState::Stopping {
                last = pulses(&joints)[0];
                tick(&mut joints, &good(ticks));
                ticks += 1;
            }
            assert_eq!((joints.state(), ticks), (SupervisorState::Disarmed, 1_501));
        }
    }
    let mut walked = 0;
    for n in 0..10_000_u32 {
        let was = pulses(&joints)[0];
        tick(&mut joints, &good(n));
        let step = pulses(&joints)[0].abs_diff(was);
        assert!(step <= if was > MOST { 1 } else { 7 }, "{was} {step}");
        walked += u32::from(joints.state() == SupervisorState::Walking);
    }
    assert!(walked > 2_000, "{walked}");
}

/// Trims a joint to a pulse, with a host that repeats its jog; the pulse.
fn trimmed_to(joints: &mut Board, place: usize, pulse: u16) -> u16 {
    while pulses(joints)[place] != pulse {
        assert_eq!(jog(joints, pulse), Outcome::InEffect);
    }
    pulse
}

#[test]
fn the_supply_counts_in_a_trim() {
    let low = Sample { vrefint: AdcCode(2_400), ..idle() };
    let mut joints = trimming(Joint::LeftHip);
    for _ in 0..60 {
        joints.tick(&low);
    }
    assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::TrimReady, Cause::SensorSupplyLow));
    for tick in 0..450 {
        joints.tick(&Sample { button: tick < 400, ..low });
    }
    assert_eq!((joints.state(), pulses(&joints)), (SupervisorState::TrimReady, [0; 4]));
}

#[test]
fn what_is_not_allowed_is_refused_and_moves_nothing() {
    let mut joints = trimming(Joint::LeftHip);
    let before = pulses(&joints);
    for pulse in [0, 499, 2_501, u16::MAX] {
        assert_eq!(jog(&mut joints, pulse), Outcome::OutOfRange, "{pulse}");
    }
    assert_eq!(ask(&mut joints, Action::Trim { joint: Joint::RightHip }), Outcome::NotAtRest);
    run(&mut joints, 500);
    assert_eq!((joints.state(), pulses(&joints)), (SupervisorState::Trimming, before));
    // Walking: a trim is chosen at rest only.
    let mut joints = board();
    assert_eq!(jog(&mut joints, 1_500), Outcome::NotTrimming);
    joints.tick(&Sample { faults: BoardFaults::CLOCK, ..idle() });
    assert_eq!(ask(&mut joints, Action::Trim { joint: Joint::LeftHip }), Outcome::NotAtRest);
    assert_eq!(joints.state(), SupervisorState::Fault);
}

fn step() -> impl Strategy<Value = Sample<1>> {
    let action = prop_oneof![
        4 => (0..2_700_u16).prop_map(|pulse| Action::Jog { pulse: PulseMicros(pulse) }),
        1 => (0..4_usize).prop_map(|place| Action::Trim { joint: Joint::ALL[place] }),
        1 => Just(Action::Stop),
        1 => Just(Action::Undo),
    ];
    (prop::option::weighted(0.3, action), any::<bool>(), prop::bool::weighted(0.02)).prop_map(
        |(action, button, fault)| Sample {
            request: action.map(|action| Request { number: 1, action }),
            button,
            faults: if fault { BoardFaults::BREAK_INPUT } else { BoardFaults::NONE },
            ..idle()
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    /// Any requests and presses: outputs come on by the release after a hold only, at the last pulses or after a minute at the park pose; in a trim at
    /// most one servo moves away from its park pulse, only while the others are at theirs; each moves by at most a microsecond in ten ticks, and stays
    /// within its pulses.
    #[test]
    fn a_trim_is_slow_and_moves_one_servo(steps in prop::collection::vec((step(), 1_u32..700), 1..60)) {
        let mut joints = board();
        let (mut moved, mut tick, mut held) = (0_u32, 0_u32, 0_u32);
        let mut last: Option<([u16; 4], u32)> = None;
        for (sample, ticks) in steps {
            for n in 0..ticks {
                let (before, was) = (joints.state(), pulses(&joints));
                joints.tick(&Sample { request: sample.request.filter(|_| n == 0), ..sample });
                tick += 1;
                let (state, is) = (joints.state(), pulses(&joints));
                prop_assert!(before.moving() || !state.moving() || (!sample.button && held >= 300));
                held = if sample.button { held + 1 } else if n < 19 { held } else { 0 };
                // The sensors are open: nothing but a trim moves.
                prop_assert!(!state.moving() || state == SupervisorState::Trimming, "{:?}", state);
                prop_assert_eq!(is == [0; 4], state != SupervisorState::Trimming);
                if state == SupervisorState::Trimming {
                    prop_assert!(is.iter().all(|pulse| (500..=2_500).contains(pulse)));
                    if before != state {
                        let known = last.filter(|(_, ended)| tick - ended < 59_990).map(|(ended, _)| ended);
                        let starts = [known, Some(parked()).filter(|_| last.is_none_or(|(_, ended)| tick - ended > 59_990))];
                        let is_near = |there: &[u16; 4]| is.iter().zip(there).all(|(is, there)| is.abs_diff(*there) <= 1);
                        prop_assert!(starts.iter().flatten().any(is_near), "{:?} after {:?} at {}", is, last, tick);
                    } else {
                        let far = |of: &[u16; 4]| [0, 1, 2, 3].map(|joint| of[joint].abs_diff(parked()[joint]));
                        let (far_was, far_is) = (far(&was), far(&is));
                        let leaves = (0..4).find(|joint| far_is[*joint] > far_was[*joint]);
                        let others = |chosen| (0..4).filter(move |joint| *joint != chosen);
                        prop_assert!(leaves.is_none_or(|chosen| others(chosen).all(|joint| far_is[joint] == 0)));
                    }
                    last = Some((is, tick));
                    if before == state && was != is {
                        prop_assert!(was.iter().zip(&is).all(|(was, is)| was.abs_diff(*is) <= 1) && tick - moved >= 10);
                        moved = tick;
                    }
                }
            }
        }
    }
}
