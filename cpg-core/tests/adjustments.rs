//! Speed, amplitude, offset and lead of the phase-and-shape generator as inputs that may change on any tick: behind `Smooth` angle and rate
//! never jump, and the acceleration stays within that of the motion asked for plus the stated bound.
use cpg_core::Generator;
use cpg_core::gait::catalogue;
use cpg_core::transition::{JointLimits, TransitionConfig};
use cpg_core::waveform::shape::{Adjustment, FourierShape, PhaseShape};
use joint_units::{Period, Phase, RadPerSec2, Radians};
use proptest::prelude::*;

type Walk = PhaseShape<FourierShape<6>, 4>;

/// One change: after how many ticks, of which joint, to what.
#[derive(Debug, Clone)]
struct Change {
    after: u32,
    stride_s: f32,
    joint: usize,
    adjustment: Adjustment,
}

fn change() -> impl Strategy<Value = Change> {
    (0u32..400, 0.5f32..3.0, 0usize..4, 0.0f32..=2.0, -0.6f32..0.6, any::<u32>()).prop_map(
        |(after, stride_s, joint, gain, offset, lead)| Change {
            after,
            stride_s,
            joint,
            adjustment: Adjustment { gain, offset: Radians(offset), lead: Phase(lead) },
        },
    )
}

fn apply(walk: &mut Walk, change: &Change) {
    walk.set_stride(change.stride_s).unwrap();
    walk.adjust(change.joint, change.adjustment).unwrap();
}

/// The largest angle and rate by which a change without `Smooth` would have jumped.
fn jump(before: &Walk, after: &Walk) -> (f32, f32) {
    let angle = before.angles().iter().zip(after.angles()).map(|(a, b)| (a.0 - b.0).abs()).fold(0.0, f32::max);
    let rate = before.rates().iter().zip(after.rates()).map(|(a, b)| (a.0 - b.0).abs()).fold(0.0, f32::max);
    (angle, rate)
}

const DT: f32 = 1e-3;

/// What the changes did: the largest jump of angle and rate on a tick of change, and by how much the acceleration exceeded that of the
/// generator below, as a part of the bound.
#[derive(Debug, Default)]
struct Worst {
    angle: f32,
    rate: f32,
    acceleration: f32,
    bare: (f32, f32),
}

fn walk_through(changes: &[Change], config: TransitionConfig) -> Worst {
    let bare = catalogue::fourier(Period::MILLISECOND).unwrap();
    let mut smooth = config.build(bare, [JointLimits::WIDEST; 4], Period::MILLISECOND).unwrap();
    let mut worst = Worst::default();
    let last = Change { after: 3000, ..changes[0].clone() };
    for change in changes.iter().chain([&last]) {
        for _ in 0..change.after {
            let (angles, rates, own) = (smooth.angles(), smooth.rates(), smooth.generator().rates());
            smooth.step();
            for joint in 0..4 {
                let rise = smooth.rates()[joint].0 - rates[joint].0;
                let own = smooth.generator().rates()[joint].0 - own[joint].0;
                // What rounding leaves of a difference of two rates of up to some 50 rad/s.
                let added = ((rise - own).abs() - 2e-5) / DT / config.acceleration.0;
                worst.acceleration = worst.acceleration.max(added);
                // The rate is that of the angle: its mean over the tick, up to the third derivative.
                let slope = (smooth.angles()[joint].0 - angles[joint].0) / DT;
                let mean = 0.5 * (rates[joint].0 + smooth.rates()[joint].0);
                assert!((slope - mean).abs() < 0.05, "joint {joint}: {slope} against {mean}");
            }
        }
        let (angles, rates, below) = (smooth.angles(), smooth.rates(), *smooth.generator());
        smooth.change(|walk| apply(walk, change));
        let bare = jump(&below, smooth.generator());
        worst.bare = (worst.bare.0.max(bare.0), worst.bare.1.max(bare.1));
        for joint in 0..4 {
            worst.angle = worst.angle.max((smooth.angles()[joint].0 - angles[joint].0).abs());
            worst.rate = worst.rate.max((smooth.rates()[joint].0 - rates[joint].0).abs());
        }
    }
    worst
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    /// Ten changes, most of them within the one before.
    #[test]
    fn any_change_on_any_tick_keeps_the_bound(
        changes in prop::collection::vec(change(), 10),
        acceleration in 5.0f32..100.0,
        settling_s in 0.1f32..1.0,
    ) {
        let config = TransitionConfig { acceleration: RadPerSec2(acceleration), settling_s };
        let worst = walk_through(&changes, config);
        prop_assert!(worst.angle < 2e-6 && worst.rate < 2e-5, "{worst:?}");
        prop_assert!(worst.acceleration < 1.001, "{worst:?}");
    }
}

/// The same changes with nothing between them and the joints: what the test above would find.
#[test]
fn without_smoothing_the_setpoint_leaps() {
    let turned = Adjustment { gain: 1.5, offset: Radians(0.2), lead: Phase(1 << 30) };
    let changes = [Change { after: 137, stride_s: 0.7, joint: 2, adjustment: turned }];
    let worst = walk_through(&changes, TransitionConfig::default());
    assert!(worst.bare.0 > 0.2 && worst.bare.1 > 1.0, "{worst:?}");
    assert!(worst.angle < 2e-6 && worst.rate < 2e-5, "{worst:?}");
}

/// A change on every tick for five seconds, as from a slider: gain, offset and lead go to and fro.
#[test]
fn a_change_on_every_tick_is_smooth() {
    let changes: Vec<_> = (0..5000u32)
        .map(|tick| {
            let way = (tick as f32 * 0.004).sin();
            let lead = Phase::from_cycles(0.1 * way);
            let adjustment = Adjustment { gain: 1.0 + 0.5 * way, offset: Radians(0.2 * way), lead };
            Change { after: 1, stride_s: 1.1 + 0.2 * way, joint: (tick % 4) as usize, adjustment }
        })
        .collect();
    let worst = walk_through(&changes, TransitionConfig::default());
    assert!(worst.angle < 2e-6 && worst.rate < 2e-5 && worst.acceleration < 1.001, "{worst:?}");
}
