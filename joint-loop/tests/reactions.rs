//! Tests of the loop's reactions to faults, with their times in ticks.

mod support;

use cpg_core::entrainment::Lock;
use cpg_core::{Field, StateFault};
use hgod_adc::{ReferenceConfig, Validity};
use joint_loop::tuning::{Action, Parameter, Request};
use joint_loop::{BoardFaults, Cause, Command, LoopConfig, PARK_MS, Response, Sample, SupervisorState, fault_response};
use joint_units::{AdcCode, Period, Radians};
use support::{OPEN, Puppet, default_loop, default_loop_with, fault, good, hold, idle, puppet, reach, run, sensor};

type Change = fn(&mut LoopConfig);

const MOVING: [SupervisorState; 3] = [SupervisorState::Arming, SupervisorState::Walking, SupervisorState::Stopping];
const FATAL: [(BoardFaults, Cause); 5] = [
    (BoardFaults::BREAK_INPUT, Cause::BreakInput),
    (BoardFaults::CLOCK, Cause::Clock),
    (BoardFaults::WATCHDOG, Cause::Watchdog),
    (BoardFaults::OUTPUTS, Cause::Outputs),
    (BoardFaults::from_bits(1 << 5), Cause::Board),
];

#[test]
fn a_board_fault_switches_off_in_its_tick_and_is_latched() {
    for (bit, cause) in FATAL {
        for state in
            [SupervisorState::Disarmed, SupervisorState::Arming, SupervisorState::Walking, SupervisorState::Stopping]
        {
            let mut joints = reach(&default_loop(), state);
            let setpoints = joints.frame().setpoints;
            assert_eq!(fault(&mut joints, bit), Command::OFF);
            let frame = joints.frame();
            assert_eq!(
                (frame.state, frame.cause, frame.setpoints),
                (SupervisorState::Fault, cause, setpoints),
                "{state:?}"
            );

            // Latched after the fault has ended; a hold while it lasts has no effect, nor has a short press.
            assert_eq!(idle(&mut joints, 10_000), Command::OFF);
            for (held, last) in [(400, true), (40, false)] {
                for (ticks, button) in [(held, true), (40, false)] {
                    let faults = if last { bit } else { BoardFaults::NONE };
                    let command = run(&mut joints, ticks, |s| Sample { button, faults, ..s });
                    assert_eq!((command, joints.state()), (Command::OFF, SupervisorState::Fault));
                }
            }
            idle(&mut joints, 10_000);

            // One hold acknowledges, the next one arms.
            assert_eq!(hold(&mut joints), Command::OFF);
            assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::Disarmed, cause));
            assert_eq!(idle(&mut joints, 10_000), Command::OFF);
            assert!(hold(&mut joints).pulses.is_some());
            assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::Arming, Cause::None));
        }
    }
}

#[test]
fn boot_ends_in_disarmed_for_all_inputs() {
    for faults in 0..=BoardFaults::CARRIED {
        let mut joints = default_loop();
        assert_eq!((joints.frame().state, joints.frame().pulses.map(|pulse| pulse.0)), (SupervisorState::Boot, [0; 4]));
        let sample = Sample { button: true, faults: BoardFaults::from_bits(faults), elapsed: 1_000, ..good(0) };
        assert_eq!(joints.tick(&sample), Command::OFF);
        assert_eq!(joints.state(), SupervisorState::Disarmed);
    }
    // A button held from boot on is no press.
    let mut joints = default_loop();
    assert_eq!(run(&mut joints, 60_000, |s| Sample { button: true, ..s }), Command::OFF);
    assert_eq!(joints.state(), SupervisorState::Disarmed);
}

#[test]
fn a_sensor_may_be_bad_for_50_ms_at_most() {
    for state in [SupervisorState::Arming, SupervisorState::Walking] {
        let joints = reach(&default_loop(), state);
        // 48 bad ticks have no effect. The 49th starts a hurried stop.
        for (bad, after, cause) in [(48, state, Cause::None), (49, SupervisorState::Stopping, Cause::SensorOpen)] {
            let mut joints = joints.clone();
            run(&mut joints, bad, |s| Sample { codes: [support::OPEN], ..s });
            assert_eq!((joints.state(), joints.frame().cause), (after, cause), "{bad} ticks");
        }
        let mut joints = joints.clone();
        let command = run(&mut joints, 48 + 303, |s| Sample { codes: [support::OPEN], ..s });
        assert_eq!((joints.state(), command), (SupervisorState::Disarmed, Command::OFF));
        // It does not move again by itself, nor by a hold while the wire is open. The frame has the cause.
        for (ticks, button) in [(400, true), (40, false)] {
            run(&mut joints, ticks, |s| Sample { codes: [support::OPEN], button, ..s });
        }
        assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::Disarmed, Cause::SensorOpen));
        idle(&mut joints, 5_000);
        assert_eq!(joints.state(), SupervisorState::Disarmed);
        hold(&mut joints);
        assert_eq!(joints.state(), SupervisorState::Arming);
    }
}

/// The sample of a good tick. For jumps the knee is at 116 degrees, so that a large jump is possible.
fn correct(validity: Validity, tick: u32) -> Sample<1> {
    match validity {
        Validity::Spike | Validity::Rate => Sample { codes: [AdcCode(700 + (tick & 1) as u16)], ..good(tick) },
        _ => good(tick),
    }
}

/// A loop in this state with the leg at the angle of [`correct`].
fn correct_in(state: SupervisorState, validity: Validity) -> joint_loop::JointLoop<support::Walk, 1> {
    let mut joints = reach(&default_loop(), state);
    let [from, to] = [good(0), correct(validity, 0)].map(|sample| u32::from(sample.codes[0].0));
    for tick in 0..400 {
        let code = from - (from - to) * tick / 399 + (tick & 1);
        joints.tick(&Sample { codes: [AdcCode(code as u16)], ..good(0) });
        assert_eq!(joints.frame().validity, [Some(Validity::Good)], "{tick}");
    }
    joints
}

/// The sample of the `n`th tick of a fault; the first is 1.
fn wrong(validity: Validity, n: u32) -> Sample<1> {
    let correct = correct(validity, n);
    let code = |code| Sample { codes: [AdcCode(code)], ..correct };
    match validity {
        Validity::Good => correct,
        Validity::Open => code(3),
        Validity::Short => code(4_090),
        // Alternates between the ends, so that it is neither open nor short.
        Validity::Saturated => code(if n % 20 < 10 { 3 } else { 4_090 }),
        // The last good code was 1801.
        Validity::Stuck => code(1_801),
        // To 5 degrees: a knee needs 72 ms for this.
        Validity::Spike | Validity::Rate => code(3_000),
        Validity::OutOfTable => code(3_500),
        Validity::SupplyLow => Sample { vrefint: AdcCode(0), ..correct },
        other => panic!("no sample for {other}"),
    }
}

/// Checks the table of [`joint_loop::fault_response`]: the validity appears in its ms, the stop begins in its ms with its cause,
/// and the outputs are off in time.
#[test]
fn every_validity_has_the_reaction_of_the_table() {
    for validity in Validity::ALL {
        let Some(is) = fault_response(validity) else { continue };
        let mut joints = correct_in(SupervisorState::Walking, validity);
        let (mut classified, mut stops, mut off) = (None, None, None);
        // The jump is a rate for 72 ms and is then accepted.
        for n in 1..=if is.classified_ms < 1_000 { 400 } else { 1_400 } {
            let command = joints.tick(&wrong(validity, n));
            let frame = joints.frame();
            if frame.validity == [Some(validity)] && classified.is_none() {
                classified = Some(n);
            }
            if frame.state != SupervisorState::Walking && stops.is_none() {
                stops = Some(n);
                let state =
                    if is.independent == Response::Off { SupervisorState::Fault } else { SupervisorState::Stopping };
                assert_eq!(frame.state, state);
                // A spike that lasts becomes a rate.
                let cause = if validity == Validity::Spike { Cause::SensorRate } else { is.cause };
                assert_eq!(frame.cause, cause, "{validity}");
            }
            if command.pulses.is_none() && off.is_none() {
                off = Some(n);
            }
        }
        assert_eq!(classified, Some(u32::from(is.classified_ms)), "{validity}");
        assert_eq!(stops, Some(u32::from(is.stops_ms())), "{validity}");
        if is.independent == Response::Off {
            assert_eq!((off, joints.state()), (stops, SupervisorState::Fault), "{validity}");
            continue;
        }
        let last = u32::from(is.stops_ms() + PARK_MS);
        assert!(off.is_some_and(|off| (last - 4..=last).contains(&off)), "{validity}: {off:?}, {last} in the table");
        assert_eq!(joints.state(), SupervisorState::Disarmed);
    }
}

/// Faults that end within the tolerance do not change the motion: a spike before it becomes a rate, a saturated code before it
/// becomes an open wire, and a wire that is open for 29 ms, whose samples are rejected for 19 ms more.
#[test]
fn a_fault_within_the_tolerance_does_not_change_the_motion() {
    for (validity, ticks) in
        [(Validity::Spike, 4), (Validity::Saturated, 19), (Validity::Rate, 48), (Validity::Open, 29)]
    {
        let mut joints = correct_in(SupervisorState::Walking, validity);
        let mut other = joints.clone();
        let mut last = Validity::Good;
        for n in 1..=ticks {
            let held = joints.frame().measured;
            joints.tick(&if validity == Validity::Saturated { wrong(Validity::Open, n) } else { wrong(validity, n) });
            other.tick(&correct(validity, n));
            last = joints.frame().validity[0].expect("a sensor");
            assert_eq!(joints.frame().measured, held, "the last good angle is kept");
        }
        assert_eq!(last, validity);
        for n in 0..1_000 {
            joints.tick(&correct(validity, n));
            other.tick(&correct(validity, n));
            assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::Walking, Cause::None), "{validity}");
        }
        assert_eq!(joints.frame().setpoint_hash, other.frame().setpoint_hash, "the setpoints are the same");
    }
}

/// At rest there is no tolerance, and the frame has the cause.
#[test]
fn a_hold_does_not_arm_unless_the_sensor_is_good() {
    for validity in Validity::ALL {
        let Some(is) = fault_response(validity) else { continue };
        let mut joints = correct_in(SupervisorState::Disarmed, validity);
        let classified = u32::from(is.classified_ms);
        // The release takes 20 ms. The fault begins so that it is classified in the last tick of it.
        for tick in 0..1_200 {
            let button = (780..1_180).contains(&tick);
            let begins = 1_200 - classified;
            let sample = if tick >= begins { wrong(validity, tick + 1 - begins) } else { correct(validity, tick) };
            joints.tick(&Sample { button, ..sample });
        }
        assert_eq!(joints.frame().validity, [Some(validity)]);
        assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::Disarmed, is.cause), "{validity}");
    }
}

#[test]
fn an_intermittent_wire_exceeds_the_tolerance() {
    // 3 bad and 2 good ticks use one tick of tolerance every 5, with at most 3 bad codes in a row. The sensor rejects more
    // samples by its own rules.
    let mut joints = reach(&default_loop(), SupervisorState::Walking);
    let mut ticks = 0;
    while joints.state() == SupervisorState::Walking {
        let code = if ticks % 5 < 3 { support::OPEN } else { good(ticks).codes[0] };
        joints.tick(&Sample { codes: [code], ..good(ticks) });
        ticks += 1;
        assert!(ticks < 260, "{ticks}");
    }
    assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::Stopping, Cause::SensorOpen));
}

#[test]
fn without_a_required_sensor_the_motion_continues() {
    let mut config = LoopConfig::default_biped();
    config.monitor.sensor_required = false;
    let mut joints = default_loop_with(&config);
    let open = |s| Sample { codes: [support::OPEN], vrefint: joint_units::AdcCode(0), ..s };
    run(&mut joints, 100, open);
    run(&mut joints, 400, |s| Sample { button: true, ..open(s) });
    run(&mut joints, 60_000, open);
    assert_eq!(joints.state(), SupervisorState::Walking);
    // The validity is still reported.
    assert_eq!(joints.frame().validity, [Some(hgod_adc::Validity::SupplyLow)]);
    assert_eq!(joints.frame().limited_ticks, 0);
}

#[test]
fn two_overruns_a_second_are_tolerated_and_a_third_stops() {
    let overrun = |s| Sample { faults: BoardFaults::ADC_OVERRUN, ..s };
    let mut joints = reach(&default_loop(), SupervisorState::Walking);
    for second in 0..10 {
        for _ in 0..2 {
            run(&mut joints, 1, overrun);
            idle(&mut joints, 299);
        }
        idle(&mut joints, 400);
        assert_eq!(joints.state(), SupervisorState::Walking, "second {second}");
    }
    assert_eq!(joints.frame().overruns, 20);
    run(&mut joints, 1, overrun);
    idle(&mut joints, 450);
    run(&mut joints, 1, overrun);
    idle(&mut joints, 450);
    run(&mut joints, 1, overrun);
    assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::Stopping, Cause::AdcOverrun));
    // One second later a hold arms again.
    idle(&mut joints, 1_000);
    assert_eq!(joints.state(), SupervisorState::Disarmed);
    hold(&mut joints);
    assert_eq!(joints.state(), SupervisorState::Arming);
}

#[test]
fn short_gaps_are_counted_longer_ones_stop_or_are_faults() {
    for state in MOVING {
        for gap in 0..=400 {
            let mut joints = reach(&default_loop(), state);
            let before = joints.frame();
            let command = joints.tick(&Sample { elapsed: gap, ..good(0) });
            let frame = joints.frame();
            let (after, cause) = match gap {
                0..=5 => (state, before.cause),
                6..=10 => (SupervisorState::Stopping, Cause::Gap),
                _ => (SupervisorState::Fault, Cause::Gap),
            };
            assert_eq!((frame.state, frame.cause), (after, cause), "gap of {gap}");
            assert_eq!(command.pulses.is_some(), after != SupervisorState::Fault);
            // The value is clamped to 1 to 255.
            let taken = gap.clamp(1, 255);
            assert_eq!((frame.tick, frame.missed), (before.tick + taken, before.missed + taken - 1));
        }
    }
}

#[test]
fn a_few_late_ticks_are_counted_and_many_stop() {
    let mut joints = reach(&default_loop(), SupervisorState::Walking);
    let mut other = joints.clone();
    // One in twenty is five in a hundred.
    for _ in 0..25 {
        run(&mut joints, 1, |s| Sample { late: true, ..s });
        idle(&mut joints, 19);
    }
    idle(&mut other, 500);
    assert_eq!((joints.frame().late, other.frame().late), (25, 0));
    assert_eq!((joints.state(), joints.frame().setpoints), (SupervisorState::Walking, other.frame().setpoints));
    idle(&mut joints, 100);
    run(&mut joints, 5, |s| Sample { late: true, ..s });
    assert_eq!(joints.state(), SupervisorState::Walking);
    run(&mut joints, 1, |s| Sample { late: true, ..s });
    assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::Stopping, Cause::Late));
    // While all are late a press does not arm.
    run(&mut joints, 1_000, |s| Sample { late: true, ..s });
    run(&mut joints, 20, |s| Sample { button: true, late: true, ..s });
    assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::Disarmed, Cause::Late));
}

#[test]
fn ten_missed_periods_in_a_second_are_a_fault() {
    let mut joints = reach(&default_loop(), SupervisorState::Walking);
    for _ in 0..9 {
        run(&mut joints, 1, |s| Sample { elapsed: 2, ..s });
        idle(&mut joints, 50);
    }
    assert_eq!((joints.state(), joints.frame().missed), (SupervisorState::Walking, 9));
    let command = run(&mut joints, 1, |s| Sample { elapsed: 2, ..s });
    assert_eq!((command, joints.state(), joints.frame().cause), (Command::OFF, SupervisorState::Fault, Cause::Gap));
}

/// With a generator that needs no sensor, on a board without one, and for a loop that tolerates any sensor fault, as that of a follower does.
#[test]
fn a_low_supply_is_a_fault_in_every_build() {
    type Change = fn(&mut LoopConfig);
    let builds: [Change; 3] = [|_| (), |c| c.monitor.sensor_required = false, |c| c.monitor.sensor_tolerance_s = 5.0];
    let supply = Some(ReferenceConfig::stm32f4(support::VREFINT).build().expect("valid"));
    for change in builds {
        let mut config = LoopConfig { supply, ..LoopConfig::default_biped() };
        change(&mut config);
        // Codes of the reference at 2.0 and 0.3 V, and none.
        for vrefint in [2_477, 4_095, 0].map(AdcCode) {
            let mut joints = reach(&default_loop_with(&config), SupervisorState::Walking);
            let last = run(&mut joints, 40, |s| Sample { vrefint, ..s });
            assert!(last.pulses.is_some(), "tolerated");
            let command = run(&mut joints, 1, |s| Sample { vrefint, ..s });
            assert_eq!((command, joints.state()), (Command::OFF, SupervisorState::Fault));
            assert_eq!(joints.frame().cause, Cause::Supply);
            // One hold acknowledges; while the supply is low the next does not arm, and nothing is latched.
            idle(&mut joints, 200);
            hold(&mut joints);
            idle(&mut joints, 6_000);
            run(&mut joints, 100, |s| Sample { vrefint, ..s });
            run(&mut joints, 400, |s| Sample { button: true, vrefint, ..s });
            run(&mut joints, 40, |s| Sample { vrefint, ..s });
            assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::Disarmed, Cause::Supply));
        }
        // 50 Hz from 2.6 to 3.4 V.
        let mut joints = reach(&default_loop_with(&config), SupervisorState::Walking);
        let mut stopped = None;
        for tick in 0..1_100 {
            let volts = 3.0 + 0.4 * (tick as f32 * 0.1 * std::f32::consts::PI).sin();
            joints.tick(&Sample { vrefint: AdcCode((3.3 * 1501.0 / volts) as u16), ..good(tick) });
            if stopped.is_none() && joints.frame().cause == Cause::Supply {
                stopped = Some((tick, joints.state()));
            }
        }
        // A sensor that is required is not good in the dips either, but it is good more often.
        let (tick, state) = stopped.expect("it stops");
        assert!((1_000..1_050).contains(&tick) && state == SupervisorState::Stopping, "{tick}, {state:?}");
    }
}

/// A generator that fails while the joints move: a hurried stop from the last checked angles, and a reset at rest.
#[test]
fn angles_of_a_failed_generator_are_not_used() {
    for health in [
        StateFault::NotFinite { state: Field::at("velocity", 2) },
        StateFault::OutOfBounds { state: Field::of("phase") },
    ] {
        let failing = Puppet { health: Err(health), from_step: 3_500, ..Puppet::at([10.0, -10.0, 40.0, 20.0]) };
        let mut joints = reach(&puppet(failing), SupervisorState::Walking);
        let mut ticks = 0;
        while joints.generator().steps < 3_500 {
            joints.tick(&good(ticks));
            ticks += 1;
        }
        assert_eq!(joints.state(), SupervisorState::Walking);
        idle(&mut joints, 1);
        assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::Stopping, Cause::Generator));
        // It is reset at rest, not while the joints move.
        idle(&mut joints, 200);
        assert_eq!((joints.state(), joints.generator().resets), (SupervisorState::Stopping, 0));
        let left = (0..1_000).take_while(|tick| joints.tick(&good(*tick)).pulses.is_some()).count();
        assert!((99..=102).contains(&left), "{left}");
        assert_eq!((joints.state(), joints.generator().resets), (SupervisorState::Disarmed, 1));
        idle(&mut joints, 40);
        hold(&mut joints);
        assert_eq!(joints.state(), SupervisorState::Arming);
    }
}

/// At rest such angles have no effect; the gate refuses them in the tick that arms.
#[test]
fn angles_that_are_not_finite_cannot_be_armed() {
    let broken = Puppet { unchecked: Some((0, 3, f32::NAN)), ..Puppet::at([0.0; 4]) };
    let mut joints = reach(&puppet(broken), SupervisorState::Disarmed);
    assert_eq!(hold(&mut joints), Command::OFF);
    assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::Fault, Cause::NonFinite));
}

/// Angles that are not finite although the generator passes its check: outputs off in the same tick; the frame keeps the last
/// setpoints.
#[test]
fn an_angle_that_is_not_finite_is_a_fault_in_the_same_tick() {
    for bad in [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for joint in 0..4 {
            for state in MOVING {
                let finite = Puppet::at([10.0, -10.0, 40.0, 20.0]);
                // The angle is bad from the first step after the state is reached.
                let steps = reach(&puppet(finite.clone()), state).generator().steps;
                let mut joints = reach(&puppet(Puppet { unchecked: Some((steps + 1, joint, bad)), ..finite }), state);
                let before = joints.frame().setpoints;
                assert_eq!(idle(&mut joints, 1), Command::OFF);
                let frame = joints.frame();
                assert_eq!((frame.state, frame.cause), (SupervisorState::Fault, Cause::NonFinite), "{state:?}");
                assert_eq!((frame.setpoints, frame.pulses.map(|pulse| pulse.0)), (before, [0; 4]));
            }
        }
    }
}

/// A follower observes good samples, and none while following is off.
#[test]
fn a_follower_observes_good_samples_only() {
    let follower = Puppet { follows: Some(Lock::Locked), ..Puppet::at([0.0, 0.0, 20.0, 20.0]) };
    let mut joints = reach(&puppet(follower), SupervisorState::Disarmed);
    let measured = joints.frame().measured[0];
    assert_eq!(joints.generator().observed, Some(measured));
    run(&mut joints, 100, |sample| Sample { codes: [OPEN], ..sample });
    assert_eq!(joints.generator().observed, None);
    idle(&mut joints, 1_000);
    assert!(joints.generator().observed.is_some());
    let action = Action::Set { parameter: Parameter::Follow, thousandths: 0 };
    run(&mut joints, 1, |sample| Sample { request: Some(Request { number: 1, action }), ..sample });
    idle(&mut joints, 1_000);
    assert_eq!(joints.generator().observed, None);
    // Bad samples are not observed either.
    run(&mut joints, 100, |sample| Sample { codes: [OPEN], ..sample });
    assert_eq!(joints.generator().observed, None);
}

/// The contact of the foot switch closes twice, for 50 and for 80 ms.
#[test]
fn a_heel_strike_is_the_closing_of_the_foot_switch() {
    let mut joints = puppet(Puppet::at([0.0; 4]));
    for (ticks, foot) in [(30, false), (50, true), (200, false), (80, true), (30, false)] {
        run(&mut joints, ticks, |sample| Sample { foot, ..sample });
    }
    assert_eq!(joints.generator().strikes, 2);
}

/// A follower parks ten seconds after the last stride of its person, whether the person stands or does something else, and not while the person walks.
#[test]
fn a_person_who_stands_ends_the_motion() {
    for (lock, end) in [
        (Lock::Stopped, (SupervisorState::Disarmed, Cause::PersonStands)),
        (Lock::Seeking, (SupervisorState::Disarmed, Cause::PersonStands)),
        (Lock::Holding, (SupervisorState::Walking, Cause::None)),
        (Lock::Locked, (SupervisorState::Walking, Cause::None)),
    ] {
        let follower = Puppet { follows: Some(lock), ..Puppet::at([0.0, 0.0, 20.0, 20.0]) };
        let mut joints = reach(&puppet(follower), SupervisorState::Walking);
        // Arming and walking took 2.7 s of the ten.
        idle(&mut joints, 7_000);
        assert_eq!(joints.state(), SupervisorState::Walking, "{lock:?}");
        idle(&mut joints, 2_000);
        assert_eq!((joints.state(), joints.frame().cause), end, "{lock:?}");
    }
}

#[test]
fn a_pose_limited_by_the_envelope_stops_after_50_ms() {
    // Both knees at 80 degrees: the sum is 160, allowed is 150.
    let mut joints = puppet(Puppet::at([0.0, 0.0, 80.0, 80.0]));
    idle(&mut joints, 40);
    hold(&mut joints);
    let held =
        |joints: &joint_loop::JointLoop<Puppet, 1>| joints.frame().limited.contains(joint_loop::GateStatus::POSE);
    let mut ticks = 0;
    while !held(&joints) {
        joints.tick(&good(ticks));
        ticks += 1;
        assert!(ticks < 2_000 && joints.state() == SupervisorState::Arming);
    }
    idle(&mut joints, 50);
    assert_eq!(joints.state(), SupervisorState::Arming);
    idle(&mut joints, 1);
    assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::Stopping, Cause::Pose));
    let sum = joints.frame().setpoints[2].degrees() + joints.frame().setpoints[3].degrees();
    assert!((149.0..=150.0).contains(&sum), "{sum}");
    idle(&mut joints, 310);
    assert_eq!(joints.state(), SupervisorState::Disarmed);
}

#[test]
fn a_normal_stop_becomes_a_hurried_stop() {
    let mut joints = reach(&default_loop(), SupervisorState::Stopping);
    assert_eq!(joints.frame().cause, Cause::Button);
    idle(&mut joints, 40);
    joints.tick(&Sample { elapsed: 6, ..good(0) });
    assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::Stopping, Cause::Gap));
    let left = (0..1_000).take_while(|tick| joints.tick(&good(*tick)).pulses.is_some()).count();
    assert!((299..=302).contains(&left), "{left}");
    assert_eq!(joints.frame().limited_ticks, 0);
}

#[test]
fn a_configuration_error_names_the_field() {
    let refused = |change: Change| {
        let mut config = LoopConfig::default_biped();
        change(&mut config);
        config
            .build(Period::MILLISECOND, Puppet::at([0.0; 4]), [Some(sensor())])
            .map(|_| ())
            .expect_err("broken")
            .to_string()
    };
    let cases: [(&str, Change); 17] = [
        ("gate.rate[left_hip] is", |c| c.gate.rate[0].0 = -1.0),
        ("servos.neutral[right_knee] is 2600 us; allowed are 500 to 2500 us", |c| c.servos[3].neutral.0 = 2_600),
        ("gate.range[left_knee] needs a pulse of 2583", |c| c.servos[2].neutral.0 = 1_750),
        ("blend.park[left_knee] is -3 deg; allowed are -2 to 120 deg", |c| {
            c.blend.park[2] = Radians::from_degrees(-3.0);
        }),
        ("blend.park[right_hip] is not a finite number", |c| c.blend.park[1] = Radians(f32::NAN)),
        ("blend.park must be strictly inside gate.pose[0]", |c| {
            c.blend.park = [0.0, 0.0, 75.0, 75.0].map(Radians::from_degrees);
        }),
        ("blend.ramp_s is 0.4 s; allowed are 0.5 to 30 s", |c| c.blend.ramp_s = 0.4),
        ("blend.stop_s is 31 s", |c| c.blend.stop_s = 31.0),
        ("blend.hurry_s is 0.31 s; allowed are 0.1 to 0.3 s", |c| c.blend.hurry_s = 0.31),
        ("monitor.sensor_tolerance_s is 61 s", |c| c.monitor.sensor_tolerance_s = 61.0),
        ("monitor.stand_s is 0.5 s; allowed are 1 to 60 s", |c| c.monitor.stand_s = 0.5),
        ("monitor.pose_tolerance_s is not", |c| c.monitor.pose_tolerance_s = f32::INFINITY),
        ("monitor.stop_gap_s is 0.03 s; allowed are 0 to 0.01 s", |c| c.monitor.stop_gap_s = 0.03),
        ("monitor.fault_gap_s is 0.3 s; allowed are 0.001 to 0.1 s", |c| c.monitor.fault_gap_s = 0.3),
        ("monitor.overruns_per_s is 101", |c| c.monitor.overruns_per_s = 101),
        ("button.debounce_s is 0 s; allowed are 0.005 to 0.2 s", |c| c.button.debounce_s = 0.0),
        ("gate.pose[2] must name two different joints", |c| {
            c.gate.pose[2] = c.gate.pose[2].map(|p| joint_loop::PoseLimit { first: p.second, ..p });
        }),
    ];
    for (words, change) in cases {
        let error = refused(change);
        assert!(error.starts_with(words), "{error}");
    }

    let broken = Puppet { health: Err(StateFault::NotFinite { state: Field::of("phase") }), ..Puppet::at([0.0; 4]) };
    let config = LoopConfig::default_biped();
    let error = config.build(Period::MILLISECOND, broken, [Some(sensor())]).map(|_| ()).expect_err("broken");
    assert_eq!(error, joint_loop::LoopError::Generator);
    let error = config.build(Period::MILLISECOND, Puppet::at([0.0; 4]), []).map(|_| ()).expect_err("broken");
    assert_eq!(error, joint_loop::LoopError::NoSensor);
}
