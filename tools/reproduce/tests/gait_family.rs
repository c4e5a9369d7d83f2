//! The gaits of persons of `cpg-core`, against the recordings that they come from.

use cpg_core::gait::family::{Member, START, STOP};
use cpg_core::waveform::shape::MAX_COEFFICIENT;
use gait_fit::series::Series;
use reproduce::gait_family::errors::over_all;
use reproduce::gait_family::leg::Leg;
use reproduce::gait_family::page::tables;
use reproduce::gait_family::study::{Study, study};
use std::process::ExitCode;
use std::sync::LazyLock;
use test_suite::{report, tests, traces_folder};

fn main() -> ExitCode {
    test_suite::run(tests![
        the_numbers_of_the_core_are_those_of_the_recordings(Traces),
        the_family_is_nearer_than_the_mean(Traces),
        the_run_is_that_of_runners(),
    ])
}

static STUDY: LazyLock<Study> = LazyLock::new(|| study(&traces_folder()).unwrap_or_else(|error| panic!("{error}")));

/// What a member has at a cadence, as the left leg's coefficients in degrees.
fn in_the_core(member: Member, cadence: f64) -> Leg {
    let shapes = member.at_cadence(cadence as f32).expect("a cadence of its range").shapes;
    let joint = |index: usize| {
        let (mean, cos, sin) = shapes[index].coefficients();
        let degrees = |radians: f32| f64::from(radians).to_degrees();
        Series { mean: degrees(mean), terms: cos.iter().zip(sin).map(|(a, b)| (degrees(*a), degrees(*b))).collect() }
    };
    Leg { hip: joint(0), knee: joint(2) }
}

fn the_numbers_of_the_core_are_those_of_the_recordings() {
    let inside = STUDY.inside.each_ref().map(|inside| inside.leg.clone());
    for (member, cadences, legs) in [
        (Member::Walk, STUDY.walk.cadences, &STUDY.walk.ends),
        (Member::Run, STUDY.run.cadences, &inside),
        (Member::RunUnscaled, STUDY.run.cadences, &STUDY.run.ends),
    ] {
        let (least, most) = member.cadences();
        assert!((f64::from(least) - cadences[0]).abs() < 1e-4 && (f64::from(most) - cadences[1]).abs() < 1e-4);
        for (cadence, leg) in cadences.iter().zip(legs) {
            let apart = in_the_core(member, *cadence)
                .coefficients()
                .iter()
                .zip(leg.coefficients())
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            assert!(apart < 1e-3, "{} at {cadence}: {apart}", member.name());
        }
    }
    for (in_use, change) in [START, STOP].iter().zip(&STUDY.changes) {
        assert!((f64::from(in_use.cycles()) - change.phase).abs() < 1e-6, "{change:?}");
    }
}

/// Columns: family, mean of the others; the same without the person. Shapes are compared without the mean of each joint.
fn the_family_is_nearer_than_the_mean() {
    report!("{}", tables(&STUDY));
    let pooled = |errors: [f64; 4], joints: [usize; 2]| {
        (joints.map(|joint| errors[joint].powi(2)).iter().sum::<f64>() / 2.0).sqrt()
    };
    let (hips, knees) = ([0, 1], [2, 3]);
    let run = over_all(&STUDY.run.recordings, &STUDY.run.without_means);
    for joints in [hips, knees] {
        assert!(pooled(run[0], joints) < pooled(run[1], joints) && pooled(run[2], joints) < pooled(run[3], joints));
    }
    let walk = over_all(&STUDY.walk.recordings, &STUDY.walk.without_means);
    assert!(pooled(walk[0], hips) < pooled(walk[1], hips) && pooled(walk[2], hips) < pooled(walk[3], hips));
    // The knees of walks do not depend on the cadence: there the mean is as good.
    assert!(pooled(walk[0], knees) > pooled(walk[1], knees) && pooled(walk[2], knees) < 1.05 * pooled(walk[3], knees));
    // Both are predictions: a walk within 4 degrees of shape, a run within 10, at any joint.
    assert!(walk[2].iter().all(|error| *error < 4.0) && run[2].iter().all(|error| *error < 10.0), "{walk:?} {run:?}");
}

/// Of the recorded runners whose knees reach 98 to 113 degrees; the knee leads the hip by 70 to 92 degrees of the stride.
fn the_run_is_that_of_runners() {
    let member = Member::RunUnscaled;
    let leg = in_the_core(member, f64::from(member.middle()));
    let peak = leg.cycle().0[2].iter().copied().fold(f64::MIN, f64::max);
    assert!((98.0..113.0).contains(&peak), "{peak}");
    assert!((77.0..92.5).contains(&leg.knee_lead_deg()), "{}", leg.knee_lead_deg());
    for member in Member::ALL {
        let (least, most) = member.cadences();
        for cadence in [least, most] {
            let config = member.at_cadence(cadence).expect("in range");
            assert!((config.stride_s - 120.0 / cadence).abs() < 1e-6);
            let leg = in_the_core(member, f64::from(cadence));
            assert!(leg.coefficients().iter().all(|c| c.to_radians().abs() < f64::from(MAX_COEFFICIENT)));
        }
    }
}
