//! Tests that need private fields: counters that start just before they wrap.

use crate::{LoopConfig, Sample, SupervisorState};
use cpg_core::gait::default_walk::default_walk;
use cpg_core::{Generator, Unguided};
use joint_units::Period;

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
