//! Tests of the loop as a function of its inputs: every code in every state, random inputs, replay.

mod support;

use hgod_adc::{SensorState, Validity};
use joint_loop::{BoardFaults, Cause, Command, Frame, JointLoop, LoopConfig, Sample, SupervisorState};
use joint_units::{AdcCode, Joint};
use proptest::prelude::*;
use support::{VREFINT, Walk, default_loop, good, idle, press, reach, script, sensor};

/// Every code of the converter, for the sensor and for the reference, in every state, for one tick and 60 more. The measured
/// angle equals that of a separate sensor bit for bit, setpoints are bounded, and no motion starts.
#[test]
fn every_code_in_every_state() {
    let fresh = default_loop();
    for state in SupervisorState::ALL {
        let start = reach(&fresh, state);
        // A separate sensor with the same history of good codes.
        let (alone, mut sensor_state) = (sensor(), SensorState::default());
        for sample in script(state) {
            alone.sample(&mut sensor_state, sample.codes[0], sample.vrefint);
        }
        for code in 0..=AdcCode::MAX.0 {
            for sample in [
                Sample { codes: [AdcCode(code)], ..good(0) },
                Sample { vrefint: AdcCode(code), ..good(0) },
                Sample { codes: [AdcCode(code)], vrefint: AdcCode(code), ..good(0) },
            ] {
                let mut joints = start.clone();
                let command = joints.tick(&sample);
                let frame = joints.frame();
                let after = if state == SupervisorState::Boot { SupervisorState::Disarmed } else { state };
                assert_eq!((frame.state, command.pulses.is_some()), (after, after.moving()), "{code} {state:?}");
                assert!(frame.measured[0].0.is_finite() && (0.0..=120.1).contains(&frame.measured[0].degrees()));
                let reading = alone.sample(&mut sensor_state.clone(), sample.codes[0], sample.vrefint);
                assert_eq!(frame.validity, [Some(reading.validity)], "{code} {state:?}");
                assert_eq!(frame.measured[0].0.to_bits(), reading.angle.0.to_bits(), "{code} {state:?}");
                for tick in 0..if code % 64 == 0 { 60 } else { 1 } {
                    let before = joints.frame();
                    joints.tick(&Sample { codes: [AdcCode(code)], ..good(tick) });
                    assert_allowed(&before, &joints.frame());
                }
            }
        }
    }
}

/// Checks two consecutive frames.
fn assert_allowed(before: &Frame<1>, after: &Frame<1>) {
    let config = LoopConfig::default_biped();
    let legal = match before.state {
        SupervisorState::Boot => [SupervisorState::Disarmed].as_slice(),
        SupervisorState::Disarmed => &[SupervisorState::Disarmed, SupervisorState::Arming, SupervisorState::Fault],
        SupervisorState::Arming => {
            &[SupervisorState::Arming, SupervisorState::Walking, SupervisorState::Stopping, SupervisorState::Fault]
        }
        SupervisorState::Walking => &[SupervisorState::Walking, SupervisorState::Stopping, SupervisorState::Fault],
        SupervisorState::Stopping => &[SupervisorState::Stopping, SupervisorState::Disarmed, SupervisorState::Fault],
        SupervisorState::Fault => &[SupervisorState::Fault, SupervisorState::Disarmed],
        SupervisorState::TrimReady => &[SupervisorState::TrimReady, SupervisorState::Trimming, SupervisorState::Fault],
        SupervisorState::Trimming => &[SupervisorState::Trimming, SupervisorState::TrimReady, SupervisorState::Fault],
    };
    assert!(legal.contains(&after.state), "{before:?} {after:?}");
    assert_eq!(after.seq, before.seq.wrapping_add(1));
    for joint in Joint::ALL {
        let at = joint as usize;
        let (setpoint, range, pulse) = (after.setpoints[at], config.gate.range[at], after.pulses[at]);
        assert!(setpoint >= range.least && setpoint <= range.most);
        let map = config.servos[at].build(joint).expect("valid");
        let wanted = if after.state.moving() { map.pulse(setpoint).map(|pulse| pulse.0) } else { Some(0) };
        assert_eq!(Some(pulse.0), wanted, "no pulse unless armed, and then that of the setpoint");
        if after.state.moving() && before.state.moving() {
            // 500 deg/s.
            assert!((setpoint.degrees() - before.setpoints[at].degrees()).abs() <= 0.500_1);
        }
    }
}

/// Any sample of a board, and for how many ticks it lasts.
fn anything() -> impl Strategy<Value = (Sample<1>, u16)> {
    let elapsed = prop_oneof![60 => Just(1_u32), 3 => 2_u32..8, 1 => 0_u32..400];
    let faults = prop_oneof![60 => Just(0_u8), 4 => Just(1_u8), 1 => 0_u8..64];
    let codes = prop_oneof![20 => 1_600_u16..2_000, 1 => 0_u16..4_096, 1 => any::<u16>()];
    let vrefint = prop_oneof![30 => Just(VREFINT.0), 1 => any::<u16>()];
    let held = prop_oneof![3 => 1_u16..30, 1 => 100_u16..2_500];
    (elapsed, faults, codes, vrefint, any::<bool>(), any::<bool>(), held).prop_map(
        |(elapsed, faults, code, vrefint, button, late, held)| {
            let faults = BoardFaults::from_bits(faults);
            let sample = Sample {
                elapsed,
                codes: [AdcCode(code)],
                vrefint: AdcCode(vrefint),
                button,
                foot: false,
                late,
                faults,
                ..Sample::default()
            };
            (sample, held)
        },
    )
}

/// The later samples of an interval: as the first, without faults and gaps.
fn continued(sample: Sample<1>, tick: u16) -> Sample<1> {
    let code = AdcCode(sample.codes[0].0 ^ (tick & 1));
    Sample { elapsed: 1, codes: [code], faults: BoardFaults::NONE, ..sample }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(120))]

    /// Random inputs: every frame is an allowed successor of the one before, and the same inputs give the same frames.
    #[test]
    fn any_inputs_are_bounded_and_replay(intervals in prop::collection::vec(anything(), 1..60)) {
        let (mut joints, mut again) = (default_loop(), default_loop());
        let mut recorded = Vec::new();
        // Ticks of the last press, and since its release.
        let (mut held_for, mut released_for) = (0, 0);
        // Where the last motion ended, and when; before the first one nothing is known.
        let mut ended = (LoopConfig::default_biped().blend.park, None::<u32>);
        for (first, held) in intervals {
            for tick in 0..held {
                let sample = if tick == 0 { first } else { continued(first, tick) };
                let before = joints.frame();
                let command = joints.tick(&sample);
                let after = joints.frame();
                if sample.button {
                    (held_for, released_for) = (if released_for < 20 { held_for + 1 } else { 1 }, 0);
                } else {
                    released_for += 1;
                }
                assert_allowed(&before, &after);
                prop_assert_eq!(command.pulses.is_some(), after.state.moving());
                if !before.state.moving() && after.state.moving() {
                    prop_assert!(before.state == SupervisorState::Disarmed && held_for >= 300 && released_for >= 20);
                    prop_assert!(after.validity == [Some(Validity::Good)] && sample.faults.is_empty());
                    let is_known = ended.1.is_some_and(|tick| before.tick - tick <= 60_000);
                    let start = if is_known { ended.0 } else { LoopConfig::default_biped().blend.park };
                    for (setpoint, start) in after.setpoints.iter().zip(start) {
                        prop_assert!((setpoint.0 - start.0).abs() <= 1e-6, "motion begins where the last one ended");
                    }
                }
                if after.state.moving() {
                    ended = (after.setpoints, Some(after.tick));
                }
                recorded.push((sample, after));
            }
        }
        for (sample, frame) in &recorded {
            again.tick(sample);
            prop_assert_eq!(bits(&again.frame()), bits(frame));
        }
    }
}

/// A frame with its floats as bits too, for an exact comparison.
fn bits(frame: &Frame<1>) -> (Frame<1>, [u32; 5]) {
    let [a, b, c, d] = frame.setpoints.map(|angle| angle.0.to_bits());
    (*frame, [a, b, c, d, frame.measured[0].0.to_bits()])
}

/// The inputs of a run: arm, walk, stop.
fn inputs() -> Vec<Sample<1>> {
    (0..6_000)
        .map(|tick| {
            let button = matches!(tick, 100..500 | 4_000..4_100);
            let elapsed = if tick % 997 == 996 { 3 } else { 1 };
            Sample { button, elapsed, codes: [AdcCode(1_700 + (tick % 300) as u16)], ..good(tick) }
        })
        .collect()
}

fn replay(inputs: &[Sample<1>]) -> JointLoop<Walk, 1> {
    let mut joints = default_loop();
    for sample in inputs {
        joints.tick(sample);
    }
    joints
}

#[test]
fn different_runs_have_different_hashes() {
    let inputs = inputs();
    let whole = replay(&inputs).frame();
    assert_eq!((whole.state, whole.cause), (SupervisorState::Disarmed, Cause::Button));
    assert_eq!(replay(&inputs).frame(), whole);
    assert_ne!(replay(&inputs[..5_999]).frame().setpoint_hash, whole.setpoint_hash);

    let with = |at: usize, change: fn(&mut Sample<1>)| {
        let mut inputs = inputs.clone();
        change(&mut inputs[at]);
        replay(&inputs).frame()
    };
    // A changed input that affects the setpoints or the state changes the hash.
    for at in [0, 50, 519, 1_000, 2_500, 4_019, 4_500, 5_999] {
        for change in [
            |s: &mut Sample<1>| s.elapsed ^= 2,
            |s: &mut Sample<1>| s.faults = BoardFaults::CLOCK,
            |s: &mut Sample<1>| s.faults = BoardFaults::BREAK_INPUT,
        ] {
            // Boot goes to disarmed even with a fault, so a fault in the first tick has no effect.
            let changed = with(at, change);
            let nothing = at == 0 && changed.tick == whole.tick;
            assert_eq!(changed.setpoint_hash == whole.setpoint_hash, nothing, "tick {at}");
        }
    }
    assert_ne!(with(310, |s| s.button = false).setpoint_hash, whole.setpoint_hash);
    // A changed bit of a code does not change the setpoints but the measured angle.
    let other = with(5_990, |s| s.codes[0].0 ^= 4);
    assert_eq!(other.setpoint_hash, whole.setpoint_hash);
    assert_ne!(other.measured[0].0.to_bits(), whole.measured[0].0.to_bits());
}

/// The hash is that of the words of every frame: tick, state and setpoints. Here by arithmetic of 128 bits.
#[test]
fn the_hash_can_be_computed_from_the_frames() {
    let mut joints = default_loop();
    let mut hash: u64 = 0xcbf2_9ce4_8422_2325;
    for sample in inputs() {
        joints.tick(&sample);
        let frame = joints.frame();
        let state = SupervisorState::ALL.iter().position(|state| *state == frame.state).expect("listed");
        let words = [u64::from(frame.tick), state as u64];
        for word in words.into_iter().chain(frame.setpoints.map(|angle| u64::from(angle.0.to_bits()))) {
            hash = (u128::from(hash ^ word) * 0x100_0000_01b3 % (1 << 64)) as u64;
        }
        assert_eq!(frame.setpoint_hash, hash);
    }
}

/// A copy behaves as the original: the loop has no state outside itself.
#[test]
fn a_copy_behaves_as_the_original() {
    let mut joints = reach(&default_loop(), SupervisorState::Arming);
    let mut copy = joints.clone();
    for tick in 0..5_000 {
        assert_eq!(joints.tick(&good(tick)), copy.tick(&good(tick)));
        assert_eq!(bits(&joints.frame()), bits(&copy.frame()));
    }
}

#[test]
fn disarmed_means_off_and_parked() {
    let mut joints = reach(&default_loop(), SupervisorState::Walking);
    idle(&mut joints, 40);
    press(&mut joints);
    idle(&mut joints, 1_100);
    for tick in 0..5_000 {
        assert_eq!(joints.tick(&good(tick)), Command::OFF);
        assert_eq!(joints.frame().setpoints, LoopConfig::default_biped().blend.park);
    }
}
