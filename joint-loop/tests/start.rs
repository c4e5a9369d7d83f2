//! Where an arming starts: at the last pulses if they are known, else at the park pose.

mod support;

use joint_loop::motion::start::KNOWN_S;
use joint_loop::{BoardFaults, Gate, JointLoop, LoopConfig, Sample, SupervisorState};
use joint_units::{Joint, Period, PulseMicros, Radians};
use support::*;

/// Ticks for which the last pulses are held.
const WAIT: usize = 500;

/// So many ticks with a hold of the button that arms, after a tenth of a second in which it is seen released: the pulses of each tick from the arming on, and the state after it.
fn armed(joints: &mut JointLoop<Walk, 1>, ticks: u32) -> Vec<([PulseMicros; 4], [Radians; 4], SupervisorState)> {
    let mut all = Vec::new();
    for tick in 0..ticks {
        let command = joints.tick(&Sample { button: (100..500).contains(&tick), ..good(tick) });
        if let Some(pulses) = command.pulses {
            let frame = joints.frame();
            all.push((pulses, frame.setpoints, frame.state));
        }
    }
    all
}

fn parked() -> [PulseMicros; 4] {
    let config = LoopConfig::default_biped();
    let pulse = |joint: Joint| {
        let at = joint as usize;
        config.servos[at].build(joint).expect("valid").pulse(config.blend.park[at]).expect("finite")
    };
    Joint::ALL.map(pulse)
}

/// Starts at `start`, stands there until each servo follows its pulses, is at the park pose half a second later, and walks two seconds after that.
fn assert_goes_to_park_first(run: &[([PulseMicros; 4], [Radians; 4], SupervisorState)], start: [PulseMicros; 4]) {
    for (pulses, ..) in &run[..WAIT] {
        assert!(pulses.iter().zip(start).all(|(is, was)| is.0.abs_diff(was.0) <= 1), "{pulses:?}, ended at {start:?}");
    }
    for two in run.windows(2) {
        for joint in 0..4 {
            let moved = (two[1].1[joint].degrees() - two[0].1[joint].degrees()).abs();
            assert!(moved <= 0.500_1, "{moved} degrees in a tick");
        }
    }
    let at_park = run.iter().position(|(pulses, ..)| *pulses == parked()).expect("it comes to the park pose");
    assert!((WAIT..1_000).contains(&at_park), "{at_park} ms");
    let walks = run.iter().position(|(.., state)| *state == SupervisorState::Walking).expect("it walks");
    assert!(
        (at_park + 1_990..at_park + 2_100).contains(&walks),
        "at the park pose after {at_park}, walks after {walks} ms"
    );
}

/// A fault ends the pulses anywhere in the walk: the next arming starts there.
#[test]
fn after_a_fault_an_arming_starts_at_the_last_pulses() {
    for ticks in [2_700, 3_100, 3_333, 4_000, 4_700] {
        let mut joints = default_loop();
        let last = armed(&mut joints, ticks).last().expect("it walked").0;
        assert_ne!(last, parked());
        joints.tick(&Sample { faults: BoardFaults::CLOCK, ..good(0) });
        assert_eq!(joints.state(), SupervisorState::Fault);
        // One hold acknowledges the fault, the next one arms.
        assert!(armed(&mut joints, 1_000).is_empty());
        assert!(joints.knows_last_pulses());
        // A third press within 5 s does not arm.
        idle(&mut joints, 5_000);
        assert_goes_to_park_first(&armed(&mut joints, 5_000), last);
    }
}

/// The last pulses of the run before a reset, handed to a loop that has just been built.
#[test]
fn after_a_reset_an_arming_starts_at_the_pulses_that_were_kept() {
    for ticks in [2_700, 3_100, 3_333, 4_000, 4_700] {
        let last = armed(&mut default_loop(), ticks).last().expect("it walked").0;
        let mut joints = default_loop();
        assert!(joints.start_from(last));
        assert_goes_to_park_first(&armed(&mut joints, 5_000), last);
        // A minute later it starts at the park pose, as without them.
        let (mut late, mut fresh) = (default_loop(), default_loop());
        assert!(late.start_from(last));
        for tick in 0..(KNOWN_S * 1_000.0) as u32 + 1 {
            late.tick(&good(tick));
            fresh.tick(&good(tick));
        }
        assert!(!late.knows_last_pulses());
        assert_eq!(armed(&mut late, 3_000), armed(&mut fresh, 3_000));
    }
}

/// Pulses that no servo has.
#[test]
fn pulses_of_no_servo_are_not_known() {
    for wrong in [[0; 4], [499; 4], [2_501; 4], [u16::MAX; 4]] {
        let (mut joints, mut fresh) = (default_loop(), default_loop());
        assert!(!joints.start_from(wrong.map(PulseMicros)), "{wrong:?}");
        assert!(!joints.knows_last_pulses());
        assert_eq!(armed(&mut joints, 3_000), armed(&mut fresh, 3_000));
    }
}

/// Pulses that a trim has left, or another robot: outside of the joints' ranges, or in them and outside of the pose envelope. Each is held, and left by a
/// microsecond in ten ticks, up to the first pose that the gate allows.
#[test]
fn pulses_that_the_gate_does_not_allow_are_left_slowly() {
    for wrong in [[500; 4], [2_500, 1_500, 1_056, 1_944], [1_500, 700, 1_056, 1_944], [2_166, 834, 2_333, 667]] {
        let mut joints = default_loop();
        assert!(joints.start_from(wrong.map(PulseMicros)), "{wrong:?}");
        let run = armed(&mut joints, 30_000);
        assert!(run[..WAIT].iter().all(|(pulses, ..)| *pulses == wrong.map(PulseMicros)), "{wrong:?} is held");
        let config = LoopConfig::default_biped();
        let gate = Gate::build(&config.gate, Period::MILLISECOND).expect("valid");
        let is_allowed = |pulses: &[PulseMicros; 4]| {
            let pose = Joint::ALL
                .map(|joint| config.servos[joint as usize].build(joint).expect("valid").angle(pulses[joint as usize]));
            gate.rest(pose).is_some()
        };
        let allowed = run.iter().position(|(pulses, ..)| is_allowed(pulses)).expect("it comes to an allowed pose");
        let mut moved = 0;
        for (n, two) in run[..allowed].windows(2).enumerate() {
            if two[0].0 != two[1].0 {
                let most = two[0].0.iter().zip(two[1].0).map(|(was, is)| was.0.abs_diff(is.0)).max();
                assert!(most == Some(1) && n - moved >= 10, "{two:?} at {n}");
                moved = n;
            }
        }
        assert_eq!(run.last().expect("it moves").2, SupervisorState::Walking, "{wrong:?}");
    }
}

/// After a stop the joints are at the park pose: the next arming is as the first one, to the bit.
#[test]
fn after_a_stop_an_arming_is_as_the_first_one() {
    let mut joints = default_loop();
    let first = armed(&mut joints, 1_000);
    press(&mut joints);
    // A third press within 5 s does not arm.
    idle(&mut joints, 6_000);
    assert_eq!(joints.state(), SupervisorState::Disarmed);
    let second = armed(&mut joints, 1_000);
    // The generator has gone on, so its angles differ; the first tick is the park pose, and the ramp begins with the next.
    assert_eq!((first[0], first[0].1), (second[0], LoopConfig::default_biped().blend.park));
    assert!(second[30].1 != second[0].1, "it does not wait");
}

/// A stop on the way to the park pose goes on to it, and the outputs go off there.
#[test]
fn a_stop_on_the_way_ends_at_the_park_pose() {
    for at in [10, 60, 510, 600] {
        let last = armed(&mut default_loop(), 4_000).last().expect("it walked").0;
        let mut joints = default_loop();
        assert!(joints.start_from(last));
        let before = armed(&mut joints, 520 + at);
        assert!(!before.is_empty());
        let mut ended = last;
        for tick in 0..3_000 {
            let press = (0..50).contains(&tick);
            if let Some(pulses) = joints.tick(&Sample { button: press, ..good(tick) }).pulses {
                ended = pulses;
            }
        }
        assert_eq!((joints.state(), ended), (SupervisorState::Disarmed, parked()), "stopped after {at} ms");
    }
}
