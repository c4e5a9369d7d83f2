//! What is no gait is refused, and what is gait is not: movements from the kinematics of legs, and walks with columns in wrong places.

mod synthetic;

use gait_trace::stride::strides;
use gait_trace::{Conditioned, FindingKind, Level, RawJoints, Rules, StrideError, Strides, condition};
use joint_units::Joint;
use proptest::prelude::*;
use std::f64::consts::TAU;
use synthetic::{angle, column, raw, times, walk};

fn done(raw: &RawJoints) -> Conditioned {
    condition(raw, &Rules::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn segment(raw: &RawJoints) -> Result<Strides, StrideError> {
    strides::segment(&done(raw))
}

/// Hip and knee while the trunk is lowered: feet flat, thigh and shank of equal length, the trunk leaning so that its weight stays above
/// the feet. `depth` is 0 upright, 1 with thighs level.
fn lowered(depth: f64) -> (f64, f64) {
    let (shank, thigh, trunk) = (32.0 * depth, 88.0 * depth, 38.0 * depth);
    (thigh + trunk, shank + thigh)
}

/// Both legs follow the same depth; the right one is a little later and bends a little less, as people are.
fn both_legs(seconds: f64, depth: impl Fn(f64) -> f64, knee_sign: f64) -> RawJoints {
    raw(times(seconds, 100.0), |joint, t| {
        let (late_s, size) =
            if matches!(joint, Joint::RightHip | Joint::RightKnee) { (0.02, 0.95) } else { (0.0, 1.0) };
        let (hip, knee) = lowered(size * depth(t - late_s));
        let tremor = 0.3 * (17.0 * t + f64::from(joint as u8)).sin();
        tremor + if matches!(joint, Joint::LeftHip | Joint::RightHip) { 5.0 + hip } else { knee_sign * (4.0 + knee) }
    })
}

/// A bump from 0 to 1 and back between two times.
fn bump(t: f64, from: f64, to: f64) -> f64 {
    if (from..to).contains(&t) { (std::f64::consts::PI * (t - from) / (to - from)).sin().powi(2) } else { 0.0 }
}

fn assert_no_gait(raw: &RawJoints, what: &str) {
    match segment(raw) {
        Err(StrideError::NoGait(together)) => {
            assert!(together.hips > 0.7 && together.knees > 0.7, "{what}: {together:?}");
        }
        other => panic!("{what}: {other:?}"),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn squats_are_no_gait(period in 1.2_f64..2.4, depth in 0.4_f64..1.1, extension in any::<bool>()) {
        let squats = both_legs(12.0, |t| depth * 0.5 * (1.0 - (TAU * t / period).cos()), if extension { -1.0 } else { 1.0 });
        assert_no_gait(&squats, "squats");
    }

    /// Hops on both legs: legs almost straight in flight, bent while the foot is on the ground.
    #[test]
    fn hops_are_no_gait(period in 0.45_f64..0.9, depth in 0.2_f64..0.5) {
        let hops = both_legs(8.0, |t| { let p = t.rem_euclid(period); depth * bump(p, 0.0, 0.6 * period) }, 1.0);
        assert_no_gait(&hops, "hops");
    }

    /// Walking and running of any phase, with tremor, stays gait.
    #[test]
    fn gait_is_gait(period in 0.6_f64..1.6, phase in 0.0_f64..1.0, size in 0.4_f64..1.3) {
        let gait = raw(times(5.0, 100.0), |joint, t| size * angle(joint, t / period + phase));
        prop_assert!(segment(&gait).is_ok());
    }
}

/// Jumps from a stand: crouch, take off, land deep, come up; two bends a jump.
#[test]
fn jumps_and_drop_jumps_are_no_gait() {
    let jump = |t: f64| 0.6 * bump(t, 0.2, 0.9) + 0.1 * bump(t, 0.9, 1.3) + 0.8 * bump(t, 1.2, 1.9);
    assert_no_gait(&both_legs(12.0, |t| jump(t.rem_euclid(2.2)), 1.0), "jumps");
    // From a box: the landing after the drop is short and deep, the one after the jump is softer.
    let drop_jump = |t: f64| 0.9 * bump(t, 0.1, 0.5) + 0.5 * bump(t, 0.9, 1.6);
    assert_no_gait(&both_legs(12.0, |t| drop_jump(t.rem_euclid(2.0)), 1.0), "drop jumps");
    // A single one, with standing around it, has no strides either, whatever the reason.
    let once = both_legs(4.0, |t| drop_jump(t - 1.0), 1.0);
    assert!(segment(&once).is_err(), "{:?}", segment(&once).map(|strides| strides.spans));
}

/// Each leg recorded from its own heel strike: the person walks, but the file is half a stride wrong. That is a warning.
#[test]
fn a_leg_half_a_stride_off_is_a_warning() {
    let off = raw(times(6.0, 100.0), |joint, t| {
        let is_right = matches!(joint, Joint::RightHip | Joint::RightKnee);
        let size = if is_right { 1.02 } else { 1.0 };
        size * angle(joint, t / 1.1 + if is_right { 0.5 } else { 0.0 })
    });
    let out = done(&off);
    let warned: Vec<Option<Joint>> = out
        .findings
        .iter()
        .filter(|finding| matches!(finding.what, FindingKind::NotOpposed { .. }) && finding.level() == Level::Warning)
        .map(|finding| finding.joint)
        .collect();
    assert_eq!(warned, [Some(Joint::LeftHip), Some(Joint::LeftKnee)], "{:?}", out.findings);
    assert!(strides::segment(&out).is_ok());
}

/// Both knees in each other's columns: the person walks. Exchanged hips are the same but for the names of the legs.
#[test]
fn knees_of_the_other_leg_are_a_warning() {
    for swapped in [[2, 3], [0, 1]] {
        let mut walk = walk(6.0, 100.0, 1.1, 0.2);
        walk.joints.swap(swapped[0], swapped[1]);
        let out = done(&walk);
        let warning = out.findings.iter().find(|finding| finding.level() == Level::Warning);
        assert!(
            warning.is_some_and(|finding| matches!(finding.what, FindingKind::KneesCrossed { hips_known: false })),
            "{:?}",
            out.findings
        );
        assert!(strides::segment(&out).is_ok());
    }
}

/// Steps on the spot: the knee rises with the hip, but one leg after the other.
#[test]
fn steps_on_the_spot_are_not_refused() {
    let march = raw(times(8.0, 100.0), |joint, t| {
        let is_right = matches!(joint, Joint::RightHip | Joint::RightKnee);
        let lift = bump((t / 1.2 + if is_right { 0.5 } else { 0.0 }).rem_euclid(1.0), 0.0, 0.55);
        if matches!(joint, Joint::LeftHip | Joint::RightHip) { 3.0 + 60.0 * lift } else { 5.0 + 80.0 * lift }
    });
    assert!(!matches!(segment(&march), Err(StrideError::NoGait(_))));
}

/// Joints that are there for one block of a recording only: the strides of the block are used.
#[test]
fn a_block_between_gaps_is_used() {
    for (from, to, joints) in
        [(155, 321, &Joint::ALL[..]), (0, 170, &Joint::ALL[..]), (300, 501, &[Joint::LeftHip][..])]
    {
        let mut gaps = walk(5.0, 100.0, 0.976, 0.3);
        for joint in joints {
            let x = column(&mut gaps, *joint);
            x[..from].fill(f64::NAN);
            x[to..].fill(f64::NAN);
        }
        let out = segment(&gaps).unwrap_or_else(|error| panic!("{from} to {to}: {error}"));
        assert!((out.period_s - 0.976).abs() < 0.02, "{from} to {to}: {:?}", out.spans);
        for span in &out.spans {
            let (start, end) = (0.01 * from as f64, 0.01 * (to - 1) as f64);
            assert!(span.start_s >= start - 1e-9 && span.end_s <= end + 1e-9, "{span:?} in {start} to {end}");
        }
        let truth: Vec<f64> =
            Joint::ALL.map(|joint| (0..200).map(|k| angle(joint, f64::from(k) / 200.0)).sum::<f64>() / 200.0).into();
        let mean = out.mean();
        for (joint, truth) in mean.0.iter().zip(truth) {
            let found = joint.iter().sum::<f64>() / joint.len() as f64;
            assert!((found - truth).abs() < 1.0, "{found}, not {truth}");
        }
    }
}

/// A block of three strides and a few samples gives three, wherever in the stride it begins.
#[test]
fn all_strides_of_a_block_are_used() {
    for phase in 0..10 {
        let mut gaps = walk(5.775, 120.0, 1.037, 0.1 * f64::from(phase));
        for joint in Joint::ALL {
            let x = column(&mut gaps, joint);
            x[..254].fill(f64::NAN);
            x[634..].fill(f64::NAN);
        }
        let out = segment(&gaps).unwrap();
        assert_eq!(out.spans.len(), 3, "{phase}: {:?}", out.spans);
    }
}

/// A block without a whole stride is refused with the length of the block, not of the file.
#[test]
fn a_block_shorter_than_a_stride_is_refused() {
    let mut gaps = walk(5.0, 100.0, 1.1, 0.0);
    for joint in Joint::ALL {
        let x = column(&mut gaps, joint);
        x[..100].fill(f64::NAN);
        x[180..].fill(f64::NAN);
    }
    let error = segment(&gaps).unwrap_err().to_string();
    assert!(error.contains("within 0.7") || error.contains("no complete usable stride"), "{error}");
    // In a cycle nothing may be missing: there is no other stride to take.
    let mut cycle = raw((0..=100).map(|n| f64::from(n) / 100.0).collect(), angle);
    column(&mut cycle, Joint::LeftKnee)[20..60].fill(f64::NAN);
    assert!(matches!(segment(&cycle), Err(StrideError::NoStride { .. })));
}
