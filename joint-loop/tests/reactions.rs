//! What goes wrong, and what the loop does about it, in how many ticks.

mod support;

use cpg_core::{Field, StateFault};
use hgod_adc::Validity;
use joint_loop::{BoardFaults, Cause, Command, LoopConfig, PARK_MS, Sample, SupervisorState, fault_response};
use joint_units::{AdcCode, Period, Radians};
use support::{Puppet, fault, good, idle, press, puppet, reach, run, sensor, default_loop, default_loop_with};

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
fn a_fault_of_the_board_switches_off_in_its_own_tick_and_is_latched() {
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

            // Latched, however long all is well; and a press while it lasts does nothing.
            assert_eq!(idle(&mut joints, 10_000), Command::OFF);
            let held = run(&mut joints, 40, |s| Sample { button: true, faults: bit, ..s });
            assert_eq!((held, joints.state()), (Command::OFF, SupervisorState::Fault));
            idle(&mut joints, 40);

            // One press acknowledges, the next one arms.
            assert_eq!(press(&mut joints), Command::OFF);
            assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::Disarmed, cause));
            assert_eq!(idle(&mut joints, 10_000), Command::OFF);
            assert!(press(&mut joints).pulses.is_some());
            assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::Arming, Cause::None));
        }
    }
}

#[test]
fn boot_ends_in_disarmed_whatever_is_pressed_or_broken() {
    for faults in 0..=BoardFaults::CARRIED {
        let mut joints = default_loop();
        assert_eq!((joints.frame().state, joints.frame().pulses.map(|pulse| pulse.0)), (SupervisorState::Boot, [0; 4]));
        let sample = Sample { button: true, faults: BoardFaults::from_bits(faults), elapsed: 1_000, ..good(0) };
        assert_eq!(joints.tick(&sample), Command::OFF);
        assert_eq!(joints.state(), SupervisorState::Disarmed);
    }
    // Held from boot on: no press.
    let mut joints = default_loop();
    assert_eq!(run(&mut joints, 60_000, |s| Sample { button: true, ..s }), Command::OFF);
    assert_eq!(joints.state(), SupervisorState::Disarmed);
}

#[test]
fn a_sensor_may_be_bad_for_50_ms_and_no_longer() {
    for state in [SupervisorState::Arming, SupervisorState::Walking] {
        let joints = reach(&default_loop(), state);
        // 50 bad ticks: nothing. From the 51st on: a hurried stop.
        for (bad, after, cause) in [(50, state, Cause::None), (51, SupervisorState::Stopping, Cause::SensorOpen)] {
            let mut joints = joints.clone();
            run(&mut joints, bad, |s| Sample { codes: [support::OPEN], ..s });
            assert_eq!((joints.state(), joints.frame().cause), (after, cause), "{bad} ticks");
        }
        let mut joints = joints.clone();
        let command = run(&mut joints, 50 + 303, |s| Sample { codes: [support::OPEN], ..s });
        assert_eq!((joints.state(), command), (SupervisorState::Disarmed, Command::OFF));
        // It does not move again by itself, nor by a press while the wire is off; the frame says why.
        run(&mut joints, 40, |s| Sample { codes: [support::OPEN], button: true, ..s });
        assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::Disarmed, Cause::SensorOpen));
        idle(&mut joints, 1_000);
        assert_eq!(joints.state(), SupervisorState::Disarmed);
        press(&mut joints);
        assert_eq!(joints.state(), SupervisorState::Arming);
    }
}

/// What comes in a sound tick: for jumps a knee that is bent by 116 degrees, so that there is somewhere to jump to.
fn sound(verdict: Validity, tick: u32) -> Sample<1> {
    match verdict {
        Validity::Spike | Validity::Rate => Sample { codes: [AdcCode(700 + (tick & 1) as u16)], ..good(tick) },
        _ => good(tick),
    }
}

/// A loop in this state whose leg is where [`sound`] has it.
fn sound_in(state: SupervisorState, verdict: Validity) -> joint_loop::JointLoop<support::Walk, 1> {
    let mut joints = reach(&default_loop(), state);
    let [from, to] = [good(0), sound(verdict, 0)].map(|sample| u32::from(sample.codes[0].0));
    for tick in 0..400 {
        let code = from - (from - to) * tick / 399 + (tick & 1);
        joints.tick(&Sample { codes: [AdcCode(code as u16)], ..good(0) });
        assert_eq!(joints.frame().validity, [Some(Validity::Good)], "{tick}");
    }
    joints
}

/// What comes in the `n`th wrong tick of a fault, 1 the first.
fn wrong(verdict: Validity, n: u32) -> Sample<1> {
    let sound = sound(verdict, n);
    let code = |code| Sample { codes: [AdcCode(code)], ..sound };
    match verdict {
        Validity::Good => sound,
        Validity::Open => code(3),
        Validity::Short => code(4_090),
        // From one end to the other, so that neither wire is at fault.
        Validity::Saturated => code(if n % 20 < 10 { 3 } else { 4_090 }),
        // The last good code was 1801.
        Validity::Stuck => code(1_801),
        // To 5 degrees: a knee takes 72 ms for that.
        Validity::Spike | Validity::Rate => code(3_000),
        Validity::OutOfTable => code(3_500),
        Validity::SupplyLow => Sample { vrefint: AdcCode(0), ..sound },
        other => panic!("{other} has no sample here"),
    }
}

/// The table of [`joint_loop::fault_response`], walked through: the verdict has its name in its ms and not before, the walk is left in the ms
/// that is stated, with the cause that is stated, and the outputs are off in time.
#[test]
fn every_verdict_has_the_reaction_of_the_table() {
    for verdict in Validity::ALL {
        let Some(is) = fault_response(verdict) else { continue };
        let mut joints = sound_in(SupervisorState::Walking, verdict);
        let (mut said, mut stops, mut off) = (None, None, None);
        // A rate is one for 72 ms, and then believed.
        for n in 1..=if is.classified_ms < 1_000 { 400 } else { 1_400 } {
            let command = joints.tick(&wrong(verdict, n));
            let frame = joints.frame();
            if frame.validity == [Some(verdict)] && said.is_none() {
                said = Some(n);
            }
            if frame.state != SupervisorState::Walking && stops.is_none() {
                stops = Some(n);
                assert_eq!(frame.state, SupervisorState::Stopping);
                // A spike that goes on is a rate.
                let cause = if verdict == Validity::Spike { Cause::SensorRate } else { is.cause };
                assert_eq!(frame.cause, cause, "{verdict}");
            }
            if command.pulses.is_none() && off.is_none() {
                off = Some(n);
            }
        }
        assert_eq!(said, Some(u32::from(is.classified_ms)), "{verdict}");
        assert_eq!(stops, Some(u32::from(is.stops_ms())), "{verdict}");
        let last = u32::from(is.stops_ms() + PARK_MS);
        assert!(off.is_some_and(|off| (last - 4..=last).contains(&off)), "{verdict}: {off:?}, {last} stated");
        assert_eq!(joints.state(), SupervisorState::Disarmed);
    }
}

/// What ends before the tolerance does is walked through: a spike until it would be a rate, a saturated code until it would be a wire, and
/// a wire that was open for 31 ms, as it is doubted for 19 more.
#[test]
fn what_the_table_says_is_carried_through_is() {
    for (verdict, ticks) in
        [(Validity::Spike, 4), (Validity::Saturated, 19), (Validity::Rate, 50), (Validity::Open, 31)]
    {
        let mut joints = sound_in(SupervisorState::Walking, verdict);
        let mut other = joints.clone();
        let mut last = Validity::Good;
        for n in 1..=ticks {
            let held = joints.frame().measured;
            joints.tick(&if verdict == Validity::Saturated { wrong(Validity::Open, n) } else { wrong(verdict, n) });
            other.tick(&sound(verdict, n));
            last = joints.frame().validity[0].expect("worn");
            assert_eq!(joints.frame().measured, held, "the last good angle is kept");
        }
        assert_eq!(last, verdict);
        for n in 0..1_000 {
            joints.tick(&sound(verdict, n));
            other.tick(&sound(verdict, n));
            assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::Walking, Cause::None), "{verdict}");
        }
        assert_eq!(joints.frame().setpoint_hash, other.frame().setpoint_hash, "the rhythm does not notice");
    }
}

/// At rest there is no tolerance, and the frame says why a press did nothing.
#[test]
fn with_any_verdict_but_good_a_press_does_not_arm_and_the_cause_says_which() {
    for verdict in Validity::ALL {
        let Some(is) = fault_response(verdict) else { continue };
        let mut joints = sound_in(SupervisorState::Disarmed, verdict);
        let said = u32::from(is.classified_ms);
        // 20 ms of the button are a press; the sensor's trouble begins so that its name comes with the last of them.
        for tick in 0..1_200 {
            let button = (1_180..1_200).contains(&tick);
            let begins = 1_200 - said;
            let sample = if tick >= begins { wrong(verdict, tick + 1 - begins) } else { sound(verdict, tick) };
            joints.tick(&Sample { button, ..sample });
        }
        assert_eq!(joints.frame().validity, [Some(verdict)]);
        assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::Disarmed, is.cause), "{verdict}");
    }
}

#[test]
fn a_flickering_wire_uses_the_tolerance_up() {
    // 3 ticks bad, 2 ticks good: one tick of tolerance every 5. Never 4 bad ones in a row. (Every fifth code would be of
    // no use to anyone; the verdicts in between follow from the sensor's own rules and only make it worse.)
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
fn without_a_required_sensor_the_rhythm_goes_on() {
    let mut config = LoopConfig::default_biped();
    config.monitor.sensor_required = false;
    let mut joints = default_loop_with(&config);
    let open = |s| Sample { codes: [support::OPEN], vrefint: joint_units::AdcCode(0), ..s };
    run(&mut joints, 100, open);
    run(&mut joints, 20, |s| Sample { button: true, ..open(s) });
    run(&mut joints, 60_000, open);
    assert_eq!(joints.state(), SupervisorState::Walking);
    // And still every verdict is reported.
    assert_eq!(joints.frame().validity, [Some(hgod_adc::Validity::SupplyLow)]);
    assert_eq!(joints.frame().limited_ticks, 0);
}

#[test]
fn overruns_are_counted_twice_a_second_and_then_stop() {
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
    // A second later it may be armed again.
    idle(&mut joints, 1_000);
    assert_eq!(joints.state(), SupervisorState::Disarmed);
    press(&mut joints);
    assert_eq!(joints.state(), SupervisorState::Arming);
}

#[test]
fn gaps_are_counted_then_stop_then_fault() {
    for state in MOVING {
        for gap in 0..=400 {
            let mut joints = reach(&default_loop(), state);
            let before = joints.frame();
            let command = joints.tick(&Sample { elapsed: gap, ..good(0) });
            let frame = joints.frame();
            let (after, cause) = match gap {
                0..=5 => (state, before.cause),
                6..=20 => (SupervisorState::Stopping, Cause::Gap),
                _ => (SupervisorState::Fault, Cause::Gap),
            };
            assert_eq!((frame.state, frame.cause), (after, cause), "gap of {gap}");
            assert_eq!(command.pulses.is_some(), after != SupervisorState::Fault);
            // The wire format has a byte for it: what is beyond is taken as 255, and 0 as 1.
            let taken = gap.clamp(1, 255);
            assert_eq!((frame.tick, frame.missed), (before.tick + taken, before.missed + taken - 1));
        }
    }
}

#[test]
fn late_ticks_are_counted_and_nothing_else() {
    let mut joints = reach(&default_loop(), SupervisorState::Walking);
    let mut other = joints.clone();
    run(&mut joints, 500, |s| Sample { late: true, ..s });
    idle(&mut other, 500);
    assert_eq!((joints.frame().late, other.frame().late), (500, 0));
    assert_eq!(joints.frame().setpoint_hash, other.frame().setpoint_hash);
}

/// A generator that fails while it moves the joints: not one of its angles is used any more, a hurried stop from the last
/// good ones, and at rest it starts afresh.
#[test]
fn a_failed_generator_is_not_listened_to() {
    for health in [
        StateFault::NotFinite { state: Field::at("velocity", 2) },
        StateFault::OutOfBounds { state: Field::of("phase") },
    ] {
        let failing = Puppet { health: Err(health), from_step: 3_000, ..Puppet::at([10.0, -10.0, 40.0, 20.0]) };
        let mut joints = reach(&puppet(failing), SupervisorState::Walking);
        let mut ticks = 0;
        while joints.generator().steps < 3_000 {
            joints.tick(&good(ticks));
            ticks += 1;
        }
        assert_eq!(joints.state(), SupervisorState::Walking);
        idle(&mut joints, 1);
        assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::Stopping, Cause::Generator));
        let left = (0..1_000).take_while(|tick| joints.tick(&good(*tick)).pulses.is_some()).count();
        assert!((299..=302).contains(&left), "{left}");
        assert_eq!((joints.state(), joints.generator().resets), (SupervisorState::Disarmed, 1));
        idle(&mut joints, 40);
        press(&mut joints);
        assert_eq!(joints.state(), SupervisorState::Arming);
    }
}

/// The same at rest: there such angles are of no account, and they meet the gate in the tick of the press.
#[test]
fn what_is_not_finite_at_rest_cannot_be_armed() {
    let liar = Puppet { unchecked: Some((0, 3, f32::NAN)), ..Puppet::at([0.0; 4]) };
    let mut joints = reach(&puppet(liar), SupervisorState::Disarmed);
    assert_eq!(press(&mut joints), Command::OFF);
    assert_eq!((joints.state(), joints.frame().cause), (SupervisorState::Fault, Cause::NonFinite));
}

/// Angles that are not finite although the generator says that all is well: off in the very tick, with the last setpoints kept
/// for the record.
#[test]
fn what_is_not_finite_is_a_fault_in_the_same_tick() {
    for bad in [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for joint in 0..4 {
            for state in MOVING {
                let honest = Puppet::at([10.0, -10.0, 40.0, 20.0]);
                // It turns bad with the step after those that lead to the state.
                let steps = reach(&puppet(honest.clone()), state).generator().steps;
                let mut joints = reach(&puppet(Puppet { unchecked: Some((steps + 1, joint, bad)), ..honest }), state);
                let before = joints.frame().setpoints;
                assert_eq!(idle(&mut joints, 1), Command::OFF);
                let frame = joints.frame();
                assert_eq!((frame.state, frame.cause), (SupervisorState::Fault, Cause::NonFinite), "{state:?}");
                assert_eq!((frame.setpoints, frame.pulses.map(|pulse| pulse.0)), (before, [0; 4]));
            }
        }
    }
}

#[test]
fn a_pose_that_the_envelope_holds_back_stops_after_50_ms() {
    // Both knees at 80 degrees: 160 together, where 150 is allowed.
    let mut joints = puppet(Puppet::at([0.0, 0.0, 80.0, 80.0]));
    idle(&mut joints, 40);
    press(&mut joints);
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
fn a_slow_stop_becomes_a_hurried_one() {
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
fn a_configuration_that_cannot_work_is_refused_by_name() {
    let refused = |change: Change| {
        let mut config = LoopConfig::default_biped();
        change(&mut config);
        config
            .build(Period::MILLISECOND, Puppet::at([0.0; 4]), [Some(sensor())])
            .map(|_| ())
            .expect_err("broken")
            .to_string()
    };
    let cases: [(&str, Change); 16] = [
        ("gate.rate is", |c| c.gate.rate.0 = -1.0),
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
        ("monitor.sensor_tolerance_s is 1.5 s", |c| c.monitor.sensor_tolerance_s = 1.5),
        ("monitor.pose_tolerance_s is not", |c| c.monitor.pose_tolerance_s = f32::INFINITY),
        ("monitor.stop_gap_s is 0.03 s; allowed are 0 to 0.02 s", |c| c.monitor.stop_gap_s = 0.03),
        ("monitor.fault_gap_s is 0.3 s; allowed are 0.001 to 0.1 s", |c| c.monitor.fault_gap_s = 0.3),
        ("monitor.overruns_per_s is 101", |c| c.monitor.overruns_per_s = 101),
        ("monitor.debounce_s is 0 s; allowed are 0.005 to 0.2 s", |c| c.monitor.debounce_s = 0.0),
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
