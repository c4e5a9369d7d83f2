//! Tests that need private fields: counters that start just before they wrap, a state whose bits change.

use crate::tuning::{Action, Request};
use crate::{BoardFaults, Cause, LoopConfig, Sample, SupervisorState};
use cpg_core::gait::default_walk::default_walk;
use cpg_core::{Generator, Unguided};
use joint_units::{Joint, Period};

/// One or two changed bits of the kept state, in every state of a walk and a trim: the outputs are off in that tick, and the fault says why.
#[test]
fn a_changed_bit_of_the_state_switches_off() {
    let mut config = LoopConfig::default_biped();
    config.monitor.sensor_required = false;
    let walk = Unguided(default_walk(Period::MILLISECOND).expect("valid"));
    let mut joints = config.build(Period::MILLISECOND, walk, []).expect("valid");
    let mut seen = Vec::new();
    for call in 0_u32..14_000 {
        // Armed by the first hold, stopped by a press; a fault, acknowledged by the second hold; a trim, begun by the third.
        let is_pressed = [100..500, 3_000..3_050, 5_600..6_000, 11_200..11_600].iter().any(|held| held.contains(&call));
        let request = (call == 11_000).then_some(Request { number: 1, action: Action::Trim { joint: Joint::LeftHip } });
        let faults = if call == 5_000 { BoardFaults::CLOCK } else { BoardFaults::NONE };
        joints.tick(&Sample { button: is_pressed, request, faults, ..Sample::default() });
        if seen.contains(&joints.state()) {
            continue;
        }
        seen.push(joints.state());
        for bit in 0..32 {
            for other in [0, 1 << ((bit + 7) % 32)] {
                let mut changed = joints.clone();
                changed.status = changed.status.with_flipped(1 << bit | other);
                let command = changed.tick(&Sample::default());
                assert_eq!((command.pulses, changed.state()), (None, SupervisorState::Fault), "{:?}", joints.state());
                assert_eq!(changed.cause(), Cause::Memory);
                // It stays, until a hold acknowledges it.
                assert!((0..1_000).all(|_| changed.tick(&Sample::default()).pulses.is_none()));
                assert_eq!(changed.state(), SupervisorState::Fault);
            }
        }
    }
    assert_eq!(seen.len(), SupervisorState::ALL.len() - 1, "{seen:?}");
}

/// The counters wrap after 50 days. A loop that starts 10 s before the wrap differs from one that starts at 0 only in its counters.
#[test]
fn the_counters_wrap_while_walking() {
    let mut config = LoopConfig::default_biped();
    config.monitor.sensor_required = false;
    let walk = Unguided(default_walk(Period::MILLISECOND).expect("valid"));
    let mut plain = config.build(Period::MILLISECOND, walk, []).expect("valid");
    let mut old = plain.clone();
    let start = u32::MAX - 10_000;
    (old.frame.seq, old.frame.tick, old.frame.missed) = (start, start, start);
    (old.frame.late, old.frame.overruns, old.frame.limited_ticks) = (u32::MAX, u32::MAX, u32::MAX);

    for call in 0_u32..20_000 {
        let elapsed = if call % 1_000 == 999 { 5 } else { 1 };
        let sample = Sample { button: (100..500).contains(&call), elapsed, late: call == 3, ..Sample::default() };
        assert_eq!(plain.tick(&sample), old.tick(&sample));
        let (a, b) = (plain.frame(), old.frame());
        assert_eq!((b.seq, b.tick), (a.seq.wrapping_add(start), a.tick.wrapping_add(start)));
        assert_eq!((b.missed, b.late), (a.missed.wrapping_add(start), a.late.wrapping_sub(1)));
        assert_eq!((a.setpoints, a.state, a.cause), (b.setpoints, b.state, b.cause));
    }
    assert!(old.frame.tick < start && old.frame.seq < old.frame.tick);
    assert_eq!((old.state(), old.frame.limited_ticks), (SupervisorState::Walking, u32::MAX));
    assert_eq!(plain.generator.angles(), old.generator.angles());
}
