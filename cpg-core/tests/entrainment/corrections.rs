//! Corrections of a follower: what they change, and what they do not.

use core::f32::consts::TAU;

use cpg_core::entrainment::correction::{INPUTS, LARGEST, TERMS, terms};
use cpg_core::entrainment::{Corrections, Lock};
use cpg_core::waveform::shape::Shape;
use cpg_core::{BuildError, Follow, Generator};
use joint_units::{Joint, Phase, Radians};

use crate::person::{legs, templates};

/// Gains of the constant and the slow innovation that put the left knee at what its template and the hip's innovation of a while ago add up to.
fn knee_of_the_innovation() -> Corrections {
    let mut corrections = Corrections { usual_innovation: Radians(0.03), ..Corrections::NONE };
    corrections.gains[Joint::LeftKnee as usize][3][0] = 1.0;
    corrections
}

/// The follower of a person whose hip is off by `off(t)` radians: angles of each tick.
fn walked(corrections: Corrections, off: impl Fn(f32) -> f32) -> Vec<([Radians; 4], Lock, Phase)> {
    let mut legs = legs(Joint::LeftHip).with_corrections(&corrections).unwrap();
    let hip = templates()[Joint::LeftHip as usize];
    (0..20_000u32)
        .map(|tick| {
            let time = tick as f32 * 1e-3;
            legs.observe(Some(Radians(hip.at(Phase::from_cycles(time / 1.1)).angle + off(time))));
            legs.step();
            (legs.angles(), legs.status().state, legs.phase_lock().phase())
        })
        .collect()
}

/// A correction moves its own joint by its gain times the low-passed innovation, and neither the lock nor another joint.
#[test]
fn a_correction_moves_its_joint_and_nothing_else() {
    let wave = |time: f32| 0.03 * (TAU * 0.31 * time).sin();
    let (with, without) = (walked(knee_of_the_innovation(), wave), walked(Corrections::NONE, wave));
    let mut squares = 0.0;
    for (tick, (with, without)) in with.iter().zip(&without).enumerate() {
        assert_eq!((with.1, with.2), (without.1, without.2), "tick {tick}: the lock");
        for joint in [Joint::LeftHip, Joint::RightHip, Joint::RightKnee] {
            assert_eq!(with.0[joint as usize], without.0[joint as usize], "tick {tick}");
        }
        let moved = with.0[2].0 - without.0[2].0;
        assert!(moved.abs() < 0.06, "tick {tick}: {moved}");
        squares += moved * moved;
    }
    let moved = (squares / with.len() as f32).sqrt();
    assert!((0.005..0.03).contains(&moved), "{moved} rad rms");
}

/// Only a gait like the recorded one is corrected: with ten times the usual innovation nothing is.
#[test]
fn another_gait_is_not_corrected() {
    let strange = Corrections { usual_innovation: Radians(0.0015), ..knee_of_the_innovation() };
    let wave = |time: f32| 0.03 * (TAU * 0.31 * time).sin();
    let (with, without) = (walked(strange, wave), walked(Corrections::NONE, wave));
    let off = |range: core::ops::Range<usize>| {
        range.map(|tick| (with[tick].0[2].0 - without[tick].0[2].0).abs()).fold(0.0, f32::max)
    };
    assert!(off(10_000..20_000) < 0.005, "{}", off(10_000..20_000));
}

/// The largest gains there are: the correction stays within its limit.
#[test]
fn a_correction_has_a_limit() {
    let mut corrections = Corrections { usual_innovation: Radians(1.0), ..Corrections::NONE };
    corrections.gains[Joint::RightHip as usize][0][0] = 50.0;
    let (with, without) = (walked(corrections, |_| 0.0), walked(Corrections::NONE, |_| 0.0));
    let moved: Vec<f32> = with.iter().zip(&without).map(|(with, without)| with.0[1].0 - without.0[1].0).collect();
    assert!(moved.iter().all(|moved| (-1e-4..LARGEST + 1e-4).contains(moved)));
    assert!((moved[19_999] - LARGEST).abs() < 1e-3, "{}", moved[19_999]);
}

/// What was corrected returns to the template when the sensor fails, without a jump.
#[test]
fn a_correction_ends_with_the_sensor() {
    let mut corrections = Corrections { usual_innovation: Radians(1.0), ..Corrections::NONE };
    corrections.gains[Joint::RightHip as usize][0][0] = 0.1;
    let run = |corrections| {
        let mut legs = legs(Joint::LeftHip).with_corrections(&corrections).unwrap();
        let hip = templates()[Joint::LeftHip as usize];
        (0..11_000u32)
            .map(|tick| {
                let angle = Radians(hip.at(Phase::from_cycles(tick as f32 * 1e-3 / 1.1)).angle);
                legs.observe((tick < 10_000).then_some(angle));
                legs.step();
                legs.angles()[1].0
            })
            .collect::<Vec<_>>()
    };
    let moved: Vec<f32> =
        run(corrections).iter().zip(run(Corrections::NONE)).map(|(with, without)| with - without).collect();
    assert!((moved[9_999] - 0.1).abs() < 1e-3 && moved[10_500].abs() < 1e-4, "{} {}", moved[9_999], moved[10_500]);
    assert!(moved.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 0.01));
}

/// A gain that was learned at one cadence has the same effect at another one: what differs is the innovation only.
#[test]
fn the_cadence_is_no_input() {
    let mut corrections = Corrections { usual_innovation: Radians(1.0), ..Corrections::NONE };
    for gains in corrections.gains[Joint::RightKnee as usize].iter_mut().skip(1) {
        *gains = [0.5; TERMS];
    }
    let moved = [1.1, 0.9, 1.3].map(|stride_s| {
        let hip = templates()[Joint::LeftHip as usize];
        let run = |corrections: &Corrections| {
            let mut legs = legs(Joint::LeftHip).with_corrections(corrections).unwrap();
            (0..20_000u32)
                .map(|tick| {
                    legs.observe(Some(Radians(hip.at(Phase::from_cycles(tick as f32 * 1e-3 / stride_s)).angle)));
                    legs.step();
                    legs.angles()[3].0
                })
                .collect::<Vec<_>>()
        };
        let (with, without) = (run(&corrections), run(&Corrections::NONE));
        with.iter().zip(&without).skip(15_000).map(|(with, without)| (with - without).abs()).fold(0.0, f32::max)
    });
    // The hip is its template at every cadence: the innovation is nearly 0.
    assert!(moved.iter().all(|moved| *moved < 0.03), "{moved:?} rad");
}

#[test]
fn the_terms_are_those_of_a_fourier_series() {
    for n in 0..64 {
        let cycles = f64::from(n) / 64.0;
        let got = terms(Phase::from_cycles(cycles as f32));
        for (place, term) in got.into_iter().enumerate() {
            let angle = std::f64::consts::TAU * cycles * (place as f64 / 2.0).ceil();
            let expected = if place % 2 == 1 || place == 0 { angle.cos() } else { angle.sin() };
            assert!((f64::from(term) - expected).abs() < 2e-6, "{place}: {term} {expected}");
        }
    }
}

#[test]
fn a_gain_that_is_not_allowed_is_named() {
    let mut broken = knee_of_the_innovation();
    broken.gains[3][INPUTS - 1][TERMS - 1] = 51.0;
    let refused = |corrections: Corrections| legs(Joint::LeftHip).with_corrections(&corrections).unwrap_err();
    assert!(
        refused(broken).to_string().starts_with("right_knee.correction.innovation[5][10] = 51"),
        "{}",
        refused(broken)
    );
    let mut broken = knee_of_the_innovation();
    broken.gains[0][0][2] = f32::NAN;
    assert!(
        matches!(refused(broken), BuildError::NotFinite { field, .. } if field.to_string() == "left_hip.correction.constant[2]")
    );
    let broken = Corrections { usual_innovation: Radians(0.0), ..knee_of_the_innovation() };
    assert!(refused(broken).to_string().starts_with("usual_innovation = 0"), "{}", refused(broken));
}
