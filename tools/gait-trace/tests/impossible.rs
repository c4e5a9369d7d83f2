//! Recordings that look like gait and are none as they stand: folded angles, one leg twice, rows of a slow sensor, a wrong time stamp,
//! angles that no person has, and strides that are too slow.

mod synthetic;

use gait_trace::stride::strides::segment;
use gait_trace::{ConditionError, FindingKind, Level, Rules, StrideError, condition};
use joint_units::Joint;
use std::f64::consts::TAU;
use synthetic::{angle, column, raw, times, walk};

fn refused(raw: &gait_trace::RawJoints) -> (ConditionError, String) {
    let error = condition(raw, &Rules::default()).unwrap_err();
    let said = error.to_string();
    (error, said)
}

#[test]
fn hips_without_their_sign_are_refused_by_name() {
    let folded = raw(times(8.0, 100.0), |joint, t| angle(joint, t / 1.1).abs());
    let (error, said) = refused(&folded);
    assert!(matches!(error, ConditionError::Folded { joint: Joint::LeftHip, at_deg: 0.0, .. }), "{said}");
    assert!(
        said.contains("left_hip turns back in a corner at 0 degrees in") && said.contains("with their sign"),
        "{said}"
    );
    // The angle between thigh and shank, up to 180 degrees at a straight knee: the smaller of two angles.
    let smaller = raw(times(8.0, 200.0), |joint, t| match joint {
        Joint::LeftKnee | Joint::RightKnee => 180.0 - (angle(joint, t / 1.1) - 20.0).abs(),
        hip => angle(hip, t / 1.1),
    });
    let (error, said) = refused(&smaller);
    assert!(matches!(error, ConditionError::Folded { joint: Joint::LeftKnee, at_deg: 180.0, .. }), "{said}");
}

#[test]
fn a_small_folded_part_is_a_warning() {
    let knees = raw(times(8.0, 200.0), |joint, t| match joint {
        Joint::LeftKnee | Joint::RightKnee => {
            let p = TAU * (t / 1.1 + 0.2 + 0.5 * f64::from(joint as u8 % 2));
            (22.0 - 25.0 * p.cos() + 3.0 * (2.0 * p).sin()).abs()
        }
        hip => angle(hip, t / 1.1),
    });
    let done = condition(&knees, &Rules::default()).unwrap();
    let folded: Vec<_> = done.findings.iter().filter(|f| matches!(f.what, FindingKind::Folded { .. })).collect();
    assert_eq!(folded.iter().map(|f| f.joint).collect::<Vec<_>>(), [Some(Joint::LeftKnee), Some(Joint::RightKnee)]);
    assert!(folded.iter().all(|f| f.level() == Level::Warning && f.to_string().contains("in corners at 0 deg")));
}

#[test]
fn one_leg_in_both_columns_is_refused() {
    for offset in [0.0, 4.0] {
        let twice = raw(times(8.0, 100.0), |joint, t| match joint {
            Joint::LeftKnee | Joint::RightKnee => angle(Joint::LeftKnee, t / 1.1) + offset * f64::from(joint as u8 % 2),
            hip => angle(hip, t / 1.1),
        });
        let (error, said) = refused(&twice);
        assert!(matches!(error, ConditionError::SameLeg { left: Joint::LeftKnee, .. }), "{said}");
        assert!(said.contains("left_knee and right_knee have the same numbers"), "{said}");
    }
    let hips = raw(times(8.0, 100.0), |joint, t| match joint {
        Joint::LeftHip | Joint::RightHip => angle(Joint::LeftHip, t / 1.1),
        knee => angle(knee, t / 1.1),
    });
    let (error, said) = refused(&hips);
    assert!(matches!(error, ConditionError::SameLeg { left: Joint::LeftHip, .. }), "{said}");
    // Knees that are held still by orthoses may have the same numbers, and so may the few rows that both knees have.
    let still = raw(times(8.0, 100.0), |joint, t| match joint {
        Joint::LeftKnee | Joint::RightKnee => 10.0 + 0.05 * angle(Joint::LeftKnee, t / 1.1),
        hip => angle(hip, t / 1.1),
    });
    assert!(condition(&still, &Rules::default()).is_ok());
    let mut few = walk(8.0, 100.0, 1.1, 0.0);
    few.joints[3] = few.joints[2].clone();
    column(&mut few, Joint::RightKnee)[300..].fill(f64::NAN);
    assert!(!matches!(condition(&few, &Rules::default()), Err(ConditionError::SameLeg { .. })));
}

/// Hops, in which the legs move together: their difference has no stride in it.
#[test]
fn the_period_of_legs_in_phase_is_the_right_one() {
    let noise = |joint: Joint, t: f64| 0.6 * ((t * 7919.0 + f64::from(joint as u8) * 13.7).sin() * 43758.5).fract();
    let hops = raw(times(12.0, 100.0), |joint, t| {
        let same = Joint::ALL[joint as usize & 2];
        angle(same, t / 1.1) + noise(joint, t)
    });
    let done = condition(&hops, &Rules::default()).unwrap();
    let found = segment(&done).unwrap();
    assert!((found.period_s - 1.1).abs() < 0.02 && found.spans.len() >= 9, "{} {}", found.period_s, found.spans.len());
    let said: Vec<String> = done.findings.iter().map(ToString::to_string).collect();
    assert!(
        said.iter().any(|said| said.contains("0.00 strides apart, not 0.5") && said.contains("one leg may be in both")),
        "{said:?}"
    );
}

#[test]
fn strides_of_up_to_four_seconds_are_read_and_slower_ones_named() {
    for period in [2.4, 2.5, 2.6, 3.2, 4.0] {
        let found = segment(&condition(&walk(16.0, 100.0, period, 0.2), &Rules::default()).unwrap()).unwrap();
        assert!((found.period_s - period).abs() < 0.02, "{} for {period}", found.period_s);
    }
    let error = segment(&condition(&walk(24.0, 100.0, 5.0, 0.2), &Rules::default()).unwrap()).unwrap_err();
    assert!(matches!(error, StrideError::TooSlow { period_s } if (period_s - 5.0).abs() < 0.05), "{error}");
    assert!(error.to_string().contains("strides of 0.4 to 4 s"), "{error}");
    let error = segment(&condition(&walk(4.0, 100.0, 3.5, 0.2), &Rules::default()).unwrap()).unwrap_err();
    assert!(error.to_string().contains("two strides of up to 4 s"), "{error}");
}

#[test]
fn rows_of_a_slow_sensor_are_read_at_its_rate() {
    for block in [2, 5, 10] {
        let held = raw(times(8.0, 200.0), |joint, t| {
            let row = (t * 200.0).round() as usize / block * block;
            angle(joint, row as f64 / 200.0 / 1.1)
        });
        let done = condition(&held, &Rules::default()).unwrap();
        assert!((done.rate_hz - 200.0 / block as f64).abs() < 0.1, "{}", done.rate_hz);
        let said: Vec<&gait_trace::Finding> = done.findings.iter().filter(|f| f.level() == Level::Warning).collect();
        assert!(matches!(said[..], [f] if f.what == (FindingKind::Held { block, rate_hz: done.rate_hz })), "{said:?}");
        let words =
            format!("blocks of {block}, as a slower sensor makes them: it gave {:.1} values", 200.0 / block as f64);
        assert!(said[0].to_string().contains(&words), "{}", said[0]);
        assert!((segment(&done).unwrap().period_s - 1.1).abs() < 0.01);
        // Errors name the row of the file, not that of the different values.
        let mut back = held.clone();
        back.time_s[401] = 1.0;
        let (error, said) = refused(&back);
        assert!(matches!(error, ConditionError::TimeOrder { row: 402, .. }), "{said}");
    }
}

#[test]
fn a_time_stamp_far_away_is_named_with_its_row() {
    let mut late = walk(8.0, 100.0, 1.1, 0.0);
    let last = late.time_s.len() - 1;
    late.time_s[last] = 5000.0;
    let (error, said) = refused(&late);
    assert!(matches!(error, ConditionError::TimeGap { row, .. } if row == last + 1), "{said}");
    assert!(said.contains("row 801: time 5000 s, 4992.010 s after the row before"), "{said}");
    let mut early = walk(8.0, 100.0, 1.1, 0.0);
    early.time_s.iter_mut().skip(1).for_each(|time| *time += 1e9);
    assert!(matches!(refused(&early).0, ConditionError::TimeGap { row: 2, .. }));
    // A pause of a minute.
    let mut pause = walk(8.0, 100.0, 1.1, 0.0);
    pause.time_s.iter_mut().skip(400).for_each(|time| *time += 50.0);
    assert!(condition(&pause, &Rules::default()).is_ok());
    // A longer one in a recording that is longer still.
    let mut long = walk(160.0, 50.0, 1.1, 0.0);
    long.time_s.iter_mut().skip(4000).for_each(|time| *time += 70.0);
    assert!(condition(&long, &Rules::default()).is_ok());
}

#[test]
fn angles_that_no_person_has_are_refused_with_what_is_allowed() {
    let shifted = |hip: f64, knee: f64| {
        raw(times(8.0, 100.0), move |joint, t| {
            angle(joint, t / 1.1) + if matches!(joint, Joint::LeftHip | Joint::RightHip) { hip } else { knee }
        })
    };
    let (error, said) = refused(&shifted(150.0, 0.0));
    assert!(matches!(error, ConditionError::Impossible { .. }), "{said}");
    assert!(said.contains("left_hip reaches") && said.contains("allowed are -70 to 150"), "{said}");
    let asked = Rules { knee_sign: Some(gait_trace::PositiveDirection::Flexion), ..Rules::default() };
    let error = condition(&shifted(0.0, 100.0), &asked).unwrap_err().to_string();
    assert!(error.contains("left_knee has a mean of 123.6") && error.contains("zero of the angle"), "{error}");
    let done = condition(&shifted(90.0, 0.0), &Rules::default()).unwrap();
    assert!(
        done.findings.iter().any(|f| matches!(f.what, FindingKind::Displaced { .. }) && f.level() == Level::Warning)
    );
    let mut good = walk(8.0, 100.0, 1.1, 0.0);
    column(&mut good, Joint::LeftHip)[3] += 1.0;
    assert!(condition(&good, &Rules::default()).unwrap().findings.iter().all(|f| f.level() < Level::Warning));
}

/// The rows in which one knee has no value are not compared: before, the gap made the two differ.
#[test]
fn one_leg_in_both_columns_is_refused_with_gaps_in_one() {
    let mut twice = raw(times(8.0, 100.0), |joint, t| angle(Joint::ALL[joint as usize & 2], t / 1.1));
    column(&mut twice, Joint::RightKnee)[100..130].fill(f64::NAN);
    twice.joints[0] = walk(8.0, 100.0, 1.1, 0.0).joints[0].clone();
    twice.joints[1] = walk(8.0, 100.0, 1.1, 0.0).joints[1].clone();
    let (error, said) = refused(&twice);
    assert!(matches!(error, ConditionError::SameLeg { left: Joint::LeftKnee, .. }), "{said}");
}

/// One sensor is slower than the others: before, each of its steps was a jump, and no stride was left.
#[test]
fn a_column_of_a_slow_sensor_is_interpolated_with_a_warning() {
    for block in [2, 4, 8] {
        let mut one = walk(8.0, 200.0, 1.1, 0.0);
        let knee = column(&mut one, Joint::LeftKnee);
        *knee = (0..knee.len()).map(|n| knee[n / block * block]).collect();
        let done = condition(&one, &Rules::default()).unwrap();
        let said: Vec<&gait_trace::Finding> = done.findings.iter().filter(|f| f.level() == Level::Warning).collect();
        let [found] = said[..] else { panic!("{said:?}") };
        assert!(matches!(found.what, FindingKind::Held { block: b, .. } if b == block), "{found}");
        let words =
            format!("left knee: the rows repeat their values, or have none, in blocks of {block}, as a slower sensor");
        assert!(found.to_string().starts_with(&words) && found.to_string().ends_with("a cubic"), "{found}");
        let plain = walk(8.0, 200.0, 1.1, 0.0);
        for joint in [Joint::LeftHip, Joint::LeftKnee] {
            let (found, wanted) =
                (done.joint(joint).unwrap(), &plain.joints[joint as usize].as_ref().unwrap().angle_deg);
            let apart = found.iter().zip(wanted).take(1500).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(apart < if joint == Joint::LeftKnee { 0.6 } else { 1e-9 }, "{block}: {apart}");
        }
        assert!((segment(&done).unwrap().period_s - 1.1).abs() < 0.01);
        // What the sensor did not give is not in the file.
        let made_up = &done.missing[Joint::LeftKnee as usize];
        assert!(made_up.starts_with(&[(1, block), (block + 1, 2 * block)]), "{:?}", &made_up[..2]);
        // The same where the rows between are empty.
        let mut sparse = one.clone();
        let knee = column(&mut sparse, Joint::LeftKnee);
        (0..knee.len()).filter(|n| n % block > 0).for_each(|n| knee[n] = f64::NAN);
        assert_eq!(condition(&sparse, &Rules::default()).unwrap(), done);
    }
}

/// 101 points of one real stride, whose ends do not meet: before, they were 100 seconds.
#[test]
fn percent_of_an_open_cycle_are_no_seconds() {
    let mut stride = raw((0..=100).map(f64::from).collect(), |joint, t| angle(joint, t / 100.0));
    column(&mut stride, Joint::LeftHip).iter_mut().enumerate().for_each(|(n, x)| *x += 0.08 * n as f64);
    let (error, said) = refused(&stride);
    assert!(matches!(error, ConditionError::OpenCycle { length: 100.0, .. }), "{said}");
    assert!(said.contains("differ by 8.0 degrees") && said.contains("`--stride-time S`"), "{said}");
    let known = Rules { stride_s: Some(1.1), ..Rules::default() };
    assert!(condition(&stride, &known).is_ok_and(|done| done.normalised_cycle));
}

#[test]
fn knees_whose_zero_is_not_a_straight_leg_are_a_warning() {
    let shifted = raw(times(8.0, 100.0), |joint, t| {
        angle(joint, t / 1.1) + if matches!(joint, Joint::LeftKnee | Joint::RightKnee) { 85.0 } else { 0.0 }
    });
    let done = condition(&shifted, &Rules::default()).unwrap();
    let displaced: Vec<_> = done.findings.iter().filter(|f| matches!(f.what, FindingKind::Displaced { .. })).collect();
    assert_eq!(displaced.iter().map(|f| f.joint).collect::<Vec<_>>(), [Some(Joint::LeftKnee), Some(Joint::RightKnee)]);
    assert!(displaced.iter().all(|f| f.level() == Level::Warning), "{displaced:?}");
}
