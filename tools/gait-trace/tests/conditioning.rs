//! Conditioning against known truth: what was put in is found there, what was taken out comes back, a sound recording is left
//! alone.

mod synthetic;

use gait_trace::LowPass;
use gait_trace::condition;
use gait_trace::{ConditionError, Conditioned, Done, Finding, FindingKind, Level, PositiveDirection, RawJoints, Rules};
use joint_units::Joint;
use proptest::prelude::*;
use synthetic::{angle, column, raw, times, walk};

fn done(raw: &RawJoints) -> Conditioned {
    condition(raw, &Rules::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn any_joint() -> impl Strategy<Value = Joint> {
    prop::sample::select(Joint::ALL.to_vec())
}

/// Largest distance of a joint from the truth.
fn off(done: &Conditioned, joint: Joint, truth: impl Fn(f64) -> f64) -> f64 {
    let values = done.joint(joint).expect("the joint is there").iter();
    done.recording.time_s().iter().zip(values).map(|(&t, x)| (x - truth(t)).abs()).fold(0.0, f64::max)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Sound walking and running, with a tenth of a degree of noise: nothing is found and nothing is changed.
    #[test]
    fn a_sound_recording_is_left_as_it_is(
        rate in 50.0_f64..1000.0, period in 0.6_f64..1.6, phase in 0.0_f64..1.0, strides in 2.0_f64..7.0, seed in 1_u64..1000,
    ) {
        let noise = |joint: Joint, t: f64| ((t * 7919.0 + joint as usize as f64 + seed as f64).sin() * 43758.5).fract() * 0.1;
        let raw = raw(times(strides * period, rate), |joint, t| angle(joint, t / period + phase) + noise(joint, t));
        let out = done(&raw);
        prop_assert!(out.findings.is_empty(), "{:?}", out.findings);
        prop_assert!(out.unusable.is_empty() && !out.normalised_cycle);
        prop_assert!((out.rate_hz / rate - 1.0).abs() < 1e-9);
        for joint in Joint::ALL {
            prop_assert_eq!(out.joint(joint), raw.joints[joint as usize].as_ref().map(|raw| raw.angle_deg.as_slice()));
        }
    }

    /// A gap of at most 0.1 s, as missing rows or as missing numbers, comes back within a degree.
    #[test]
    fn a_short_gap_is_bridged(
        rate in 60.0_f64..300.0, period in 0.95_f64..1.5, at in 0.5_f64..2.5, length in 0.0_f64..0.07, rows in any::<bool>(),
        joint in any_joint(),
    ) {
        let mut raw = walk(3.5, rate, period, 0.0);
        let (from, to) = ((at * rate) as usize, ((at + length) * rate) as usize + 1);
        prop_assume!((to - from + 1) as f64 / rate <= 0.1);
        if rows {
            raw.time_s.drain(from..to);
            Joint::ALL.into_iter().for_each(|joint| drop(column(&mut raw, joint).drain(from..to)));
        } else {
            column(&mut raw, joint)[from..to].fill(f64::NAN);
        }
        let out = done(&raw);
        prop_assert_eq!(out.findings.len(), 1, "{:?}", &out.findings);
        let Finding { from_s, to_s, joint: said, what, done: did } = out.findings[0];
        prop_assert_eq!((what, did, said), (FindingKind::Gap, Done::Bridged, (!rows).then_some(joint)));
        prop_assert!((from_s - (from - 1) as f64 / rate).abs() < 1e-6 && (to_s - to as f64 / rate).abs() < 1e-6);
        prop_assert!(out.unusable.is_empty());
        for joint in Joint::ALL {
            let off = off(&out, joint, |t| angle(joint, t / period));
            prop_assert!(off < 1.0, "{off} deg over {} s", to_s - from_s);
        }
    }

    /// A longer gap is not invented: its span is unusable.
    #[test]
    fn a_long_gap_is_unusable(rate in 60.0_f64..300.0, at in 0.5_f64..2.0, length in 0.12_f64..0.8, rows in any::<bool>()) {
        let mut raw = walk(3.5, rate, 1.1, 0.3);
        let (from, to) = ((at * rate) as usize, ((at + length) * rate) as usize);
        if rows {
            raw.time_s.drain(from..to);
            Joint::ALL.into_iter().for_each(|joint| drop(column(&mut raw, joint).drain(from..to)));
        } else {
            Joint::ALL.into_iter().for_each(|joint| column(&mut raw, joint)[from..to].fill(f64::NAN));
        }
        let out = done(&raw);
        let wanted = ((from - 1) as f64 / rate, to as f64 / rate);
        prop_assert_eq!(out.unusable.len(), 1);
        prop_assert!((out.unusable[0].0 - wanted.0).abs() < 1e-6 && (out.unusable[0].1 - wanted.1).abs() < 1e-6);
        prop_assert_eq!(out.findings.len(), 1, "{:?}", &out.findings);
        prop_assert_eq!((out.findings[0].what, out.findings[0].done), (FindingKind::Gap, Done::LeftOut));
        prop_assert!((out.recording.duration_s() - raw.time_s[raw.time_s.len() - 1]).abs() < 0.6 / rate);
    }

    /// A spike of at most 16 ms is found where it is, in that joint alone, and goes.
    #[test]
    fn a_spike_is_found_and_bridged(
        rate in 120.0_f64..300.0, period in 0.95_f64..1.4, at in 0.4_f64..2.4, height in 16.0_f64..90.0, down in any::<bool>(),
        length in 0.001_f64..0.016, joint in any_joint(),
    ) {
        let mut raw = walk(3.0, rate, period, 0.2);
        let (from, to) = ((at * rate) as usize, ((at + length) * rate) as usize + 1);
        column(&mut raw, joint)[from..to].iter_mut().for_each(|x| *x += if down { -height } else { height });
        let out = done(&raw);
        prop_assert_eq!(out.findings.len(), 1, "{:?}", &out.findings);
        let Finding { from_s, to_s, joint: said, what, done: did } = out.findings[0];
        prop_assert_eq!((said, did), (Some(joint), Done::Bridged));
        let FindingKind::Jump { deg } = what else { panic!("{what:?}") };
        prop_assert!((deg - height).abs() < 2.0, "{deg} for {height}");
        prop_assert!(from_s <= from as f64 / rate && to_s >= (to - 1) as f64 / rate && to_s - from_s <= 0.12 + 1e-9);
        for joint in Joint::ALL {
            let off = off(&out, joint, |t| angle(joint, t / period + 0.2));
            prop_assert!(off < 1.5, "{off} deg");
        }
    }

    /// There and back again after a while: everything in between is unusable, nothing else is.
    #[test]
    fn a_displaced_stretch_is_unusable(at in 0.5_f64..1.5, length in 0.15_f64..1.2, by in 15.0_f64..40.0, joint in any_joint()) {
        let mut raw = walk(4.0, 200.0, 1.1, 0.7);
        let (from, to) = ((at * 200.0) as usize, ((at + length) * 200.0) as usize);
        column(&mut raw, joint)[from..to].iter_mut().for_each(|x| *x += by);
        let out = done(&raw);
        prop_assert_eq!(out.unusable.len(), 1, "{:?}", &out.findings);
        let (start, end) = out.unusable[0];
        prop_assert!((start - from as f64 / 200.0).abs() < 0.05 && (end - to as f64 / 200.0).abs() < 0.05, "{start} {end}");
        prop_assert!(matches!(out.findings[0].what, FindingKind::Jump { .. }), "{:?}", &out.findings);
        prop_assert_eq!(out.findings[0].joint, Some(joint));
    }

    /// Uneven stamps are said and the joints are what they were at the even times.
    #[test]
    fn uneven_stamps_are_resampled(jitter in prop::collection::vec(-0.2_f64..0.2, 400), period in 0.9_f64..1.5) {
        let time_s: Vec<f64> = jitter.iter().enumerate().map(|(n, j)| 0.01 * (n as f64 + if n == 0 { 0.0 } else { *j })).collect();
        let raw = raw(time_s, |joint, t| angle(joint, t / period));
        let out = done(&raw);
        prop_assert_eq!(out.findings.len(), 1, "{:?}", &out.findings);
        prop_assert_eq!(out.findings[0].done, Done::Resampled);
        let FindingKind::UnevenTimes { share } = out.findings[0].what else { panic!("{:?}", out.findings) };
        prop_assert!((0.1..0.5).contains(&share), "{share}");
        prop_assert!((out.rate_hz - 100.0).abs() < 0.2);
        for joint in Joint::ALL {
            let off = off(&out, joint, |t| angle(joint, t / period));
            prop_assert!(off < 0.15, "{off} deg");
        }
    }

    /// Whatever a reader hands on, there is an answer and no panic, and strides of it neither.
    #[test]
    fn nothing_makes_it_panic(
        time_s in prop::collection::vec(prop_oneof![8 => 0.0_f64..5.0, 1 => any::<f64>()], 0..80),
        values in prop::collection::vec(prop_oneof![6 => -90.0_f64..90.0, 1 => any::<f64>(), 1 => Just(f64::NAN)], 80),
        sorted in any::<bool>(), there in any::<[bool; 4]>(),
        low_pass in prop_oneof![Just(LowPass::Off), Just(LowPass::Customary), (-1.0_f64..50.0).prop_map(LowPass::At)],
    ) {
        let mut time_s = time_s;
        if sorted {
            time_s.sort_by(f64::total_cmp);
        }
        let mut raw = raw(time_s, |_, _| 0.0);
        for joint in Joint::ALL {
            let n = raw.time_s.len();
            let shifted = (0..n).map(|i| values[(i + joint as usize) % 80]);
            *column(&mut raw, joint) = shifted.collect();
            if !there[joint as usize] {
                raw.joints[joint as usize] = None;
            }
        }
        if let Ok(out) = condition(&raw, &Rules { low_pass, ..Rules::default() }) {
            let _ = gait_trace::stride::strides::segment(&out);
            let _ = gait_trace::stride::cut::cut(&out);
        }
    }
}

/// All ways to turn signs and to exchange hip and knee are undone, and each is said.
#[test]
fn signs_and_exchanged_columns_are_set_right_and_said() {
    let clean = done(&walk(4.0, 100.0, 1.1, 0.1));
    for turned in 0..16_usize {
        for exchanged in 0..4_usize {
            let mut raw = walk(4.0, 100.0, 1.1, 0.1);
            for joint in Joint::ALL.into_iter().filter(|&joint| turned >> (joint as usize) & 1 == 1) {
                column(&mut raw, joint).iter_mut().for_each(|x| *x = -*x);
            }
            for side in (0..2).filter(|side| exchanged >> side & 1 == 1) {
                raw.joints.swap(side, side + 2);
            }
            let out = done(&raw);
            let which = format!("turned {turned:04b}, exchanged {exchanged:02b}: {:?}", out.findings);
            assert_eq!(out.recording, clean.recording, "{which}");
            let count = |done: Done| out.findings.iter().filter(|finding| finding.done == done).count();
            assert_eq!(count(Done::Flipped), turned.count_ones() as usize, "{which}");
            assert_eq!(count(Done::Exchanged), exchanged.count_ones() as usize, "{which}");
            assert_eq!(out.findings.len(), count(Done::Flipped) + count(Done::Exchanged), "{which}");
        }
    }
}

#[test]
fn what_cannot_be_known_is_said_and_left() {
    let mut crossed = walk(4.0, 100.0, 1.1, 0.1);
    crossed.joints.swap(2, 3);
    let out = done(&crossed);
    let said: Vec<FindingKind> = out.findings.iter().map(|finding| finding.what).collect();
    assert_eq!(said, [FindingKind::KneesCrossed { hips_known: false }]);
    assert_eq!(out.joint(Joint::LeftKnee), crossed.joints[2].as_ref().map(|raw| raw.angle_deg.as_slice()));

    let mut doubled = walk(4.0, 100.0, 1.1, 0.1);
    doubled.joints[1] = doubled.joints[0].clone();
    doubled.joints[3] = doubled.joints[2].clone();
    // Equal but for a change that no export of one leg has.
    for joint in [Joint::RightHip, Joint::RightKnee] {
        column(&mut doubled, joint).iter_mut().for_each(|x| *x *= 1.02);
    }
    let out = done(&doubled);
    let lines: Vec<String> = out.findings.iter().map(Finding::to_string).collect();
    let line = |part: &str| {
        format!(
            "left and right {part} are 0.00 strides apart, not 0.5: columns may be exchanged, one leg may be in both, or each leg may count from its own step; not changed"
        )
    };
    assert_eq!(lines, [line("hips"), line("knees")]);

    // A knee whose sensor was strapped on 40 degrees off and that bends as it should: the mean says no, the shape yes.
    let mut off = walk(4.0, 100.0, 1.1, 0.1);
    column(&mut off, Joint::LeftKnee).iter_mut().for_each(|x| *x -= 40.0);
    let out = done(&off);
    assert!(out.findings.iter().all(|finding| finding.done == Done::Reported), "{:?}", out.findings);
    assert_eq!(out.joint(Joint::LeftKnee), off.joints[2].as_ref().map(|raw| raw.angle_deg.as_slice()));
}

#[test]
fn knees_that_show_no_sign_need_the_callers() {
    // Half a swing of each knee on both sides of straight.
    let mut raw = walk(4.0, 100.0, 1.1, 0.1);
    for joint in [Joint::LeftKnee, Joint::RightKnee] {
        let times = raw.time_s.clone();
        let size = if joint == Joint::LeftKnee { 20.0 } else { 19.5 };
        let values = times.iter().map(|t| size * (t * std::f64::consts::TAU / 1.1).sin());
        *column(&mut raw, joint) = values.collect();
    }
    let error = condition(&raw, &Rules::default()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "walk.csv: it is unclear whether flexion or extension of the knees is positive (-20.0 to 20.0 deg); allowed is `--knee-sign flexion` or `--knee-sign extension`"
    );
    let with = |sign| condition(&raw, &Rules { knee_sign: Some(sign), ..Rules::default() }).unwrap();
    let (flexion, extension) = (with(PositiveDirection::Flexion), with(PositiveDirection::Extension));
    let knee = raw.joints[2].as_ref().unwrap().angle_deg.as_slice();
    assert_eq!(flexion.joint(Joint::LeftKnee), Some(knee));
    let turned: Vec<f64> = knee.iter().map(|x| -x).collect();
    assert_eq!(extension.joint(Joint::LeftKnee), Some(turned.as_slice()));
    let said: Vec<String> = extension.findings.iter().map(Finding::to_string).collect();
    assert!(
        said.contains(
            &"left knee: extension is positive in the file (-20.0 to 20.0 deg: as requested); the sign was changed"
                .into()
        ),
        "{said:?}"
    );
}

#[test]
fn a_step_that_does_not_come_back_is_left_out_where_it_is() {
    let mut raw = walk(6.0, 100.0, 1.1, 0.0);
    column(&mut raw, Joint::LeftHip)[305..].iter_mut().for_each(|x| *x += 20.0);
    let out = done(&raw);
    let [Finding { what: FindingKind::Step { deg }, done: Done::LeftOut, joint: Some(Joint::LeftHip), .. }] =
        out.findings[..]
    else {
        panic!("{:?}", out.findings)
    };
    assert!((deg - 20.0).abs() < 3.0, "{deg}");
    assert_eq!(out.unusable.len(), 1);
    assert!(out.unusable[0].0 < 3.05 && out.unusable[0].1 > 3.05 && out.unusable[0].1 - out.unusable[0].0 < 0.12);
}

#[test]
fn times_are_understood_or_refused_with_the_row() {
    let times = |change: &dyn Fn(&mut Vec<f64>)| {
        let mut raw = walk(3.0, 100.0, 1.1, 0.0);
        change(&mut raw.time_s);
        condition(&raw, &Rules::default())
    };
    let error = times(&|t| t[100] = t[98]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "walk.csv: row 101: time 0.98 s after 0.99 s; allowed are times that increase: put the rows in order, or split the file if it has several recordings"
    );
    let error = times(&|t| t[7] = f64::NAN).unwrap_err();
    assert!(matches!(error, ConditionError::TimeNotFinite { row: 8, .. }), "{error}");
    let error = times(&|t| t[300] = 1e12).unwrap_err();
    assert!(matches!(error, ConditionError::TimeGap { row: 301, .. }), "{error}");
    // Many gaps, none of them long.
    let mut gaps = walk(8.0, 1000.0, 1.1, 0.0);
    gaps.time_s.iter_mut().enumerate().for_each(|(n, t)| *t += 50.0 * (n / 3) as f64);
    assert!(matches!(condition(&gaps, &Rules::default()), Err(ConditionError::TooLong { .. })));
    // Nine of twelve seconds are missing; the rest is good all the same.
    let out = times(&|t| t.iter_mut().skip(150).for_each(|t| *t += 9.0)).unwrap();
    assert!(
        out.unusable.len() == 1 && (out.unusable[0].1 - out.unusable[0].0 - 9.01).abs() < 1e-6,
        "{:?}",
        out.unusable
    );

    // A clock that starts elsewhere is no fault; a row twice is dropped.
    let out = times(&|t| t.iter_mut().for_each(|t| *t += 1_000.0)).unwrap();
    assert_eq!((out.start_s, out.recording.time_s()[0], out.findings.len()), (1_000.0, 0.0, 0));
    let out = times(&|t| t[120] = t[119]).unwrap();
    let said: Vec<String> = out.findings.iter().map(Finding::to_string).collect();
    assert_eq!(said[0], "rows with the same time as the row before: 1 of 301, the first at 1.190 s; dropped");
    assert_eq!(out.findings[0].level(), Level::Note);
    assert!(off(&out, Joint::LeftKnee, |t| angle(Joint::LeftKnee, t / 1.1)) < 0.5);
    // Time stamps with two decimals at 200 Hz: every other row is lost.
    let mut coarse = walk(3.0, 200.0, 1.1, 0.0);
    coarse.time_s.iter_mut().for_each(|t| *t = (*t * 100.0).floor() / 100.0);
    let out = done(&coarse);
    assert_eq!((out.findings[0].level(), out.rate_hz.round()), (Level::Warning, 100.0), "{:?}", out.findings);
}

/// A converter whose input ends at 40 degrees of the knee, in every stride; and one whose steps are a degree, which turns around all the same.
#[test]
fn a_clipped_joint_is_a_warning() {
    let mut clipped = walk(6.0, 100.0, 1.1, 0.0);
    column(&mut clipped, Joint::LeftKnee).iter_mut().for_each(|x| *x = x.min(40.0));
    let out = done(&clipped);
    // The corners at the end of the range bend faster than a leg too, and are no jumps.
    let [Finding { what: FindingKind::Clipped { deg, share }, joint, .. }] = &out.findings[..] else {
        panic!("{:?}", out.findings)
    };
    let truth = times(6.0, 100.0).iter().filter(|&&t| angle(Joint::LeftKnee, t / 1.1) >= 40.0).count() as f64 / 600.0;
    assert!(*deg == 40.0 && (share - truth).abs() < 0.01 && *joint == Some(Joint::LeftKnee), "{:?}", out.findings);
    // A jump elsewhere is still one.
    column(&mut clipped, Joint::LeftKnee)[131] -= 20.0;
    let out = done(&clipped);
    assert!(out.findings.iter().any(|finding| matches!(finding.what, FindingKind::Jump { .. })), "{:?}", out.findings);
    let mut coarse = walk(6.0, 100.0, 1.1, 0.0);
    for (n, x) in column(&mut coarse, Joint::LeftKnee).iter_mut().enumerate() {
        *x = (*x + 3.0 * (n as f64 * 0.004).sin()).round();
    }
    assert!(done(&coarse).findings.is_empty(), "{:?}", done(&coarse).findings);
}

/// Two hundred dropped samples are one sentence.
#[test]
fn many_gaps_are_said_together() {
    let mut raw = walk(10.0, 100.0, 1.1, 0.0);
    column(&mut raw, Joint::RightHip).iter_mut().skip(3).step_by(5).for_each(|x| *x = f64::NAN);
    let out = done(&raw);
    let said: Vec<String> = out.findings.iter().map(Finding::to_string).collect();
    assert_eq!(said.len(), 1, "{said:?}");
    assert!(
        said[0].starts_with("right hip, 0.020 s to 9.9")
            && said[0].contains(": 200 gaps of missing values, the longest 0.020 s"),
        "{said:?}"
    );
    assert_eq!(out.missing[Joint::RightHip as usize].len(), 200);
}

#[test]
fn what_is_no_recording_of_degrees_is_refused() {
    let radians = raw(times(3.0, 100.0), |joint, t| angle(joint, t / 1.1).to_radians());
    let error = condition(&radians, &Rules::default()).unwrap_err();
    assert!(matches!(error, ConditionError::Radians { .. }) && error.to_string().contains("radians"), "{error}");

    let refused = |raw: &RawJoints| condition(raw, &Rules::default()).unwrap_err();
    let mut none = walk(3.0, 100.0, 1.1, 0.0);
    none.joints = [None, None, None, None];
    assert!(matches!(refused(&none), ConditionError::NoJoints { .. }));
    assert!(matches!(refused(&walk(0.1, 100.0, 1.1, 0.0)), ConditionError::TooFewRows { rows: 11, .. }));
    let mut short = walk(3.0, 100.0, 1.1, 0.0);
    column(&mut short, Joint::RightHip).pop();
    assert!(matches!(refused(&short), ConditionError::Length { joint: Joint::RightHip, found: 300, wanted: 301, .. }));
    let mut missing = walk(3.0, 100.0, 1.1, 0.0);
    column(&mut missing, Joint::RightKnee)[..286].fill(f64::NAN);
    let error = refused(&missing).to_string();
    assert_eq!(error, "walk.csv: right_knee has 15 usable values between gaps and jumps; allowed are 16 or more");
    let mut far = walk(3.0, 100.0, 1.1, 0.0);
    column(&mut far, Joint::LeftHip).iter_mut().for_each(|x| *x *= 10.0);
    assert!(matches!(refused(&far), ConditionError::Impossible { .. }));
}

#[test]
fn a_cycle_fraction_differs_from_seconds() {
    for length in [1.0, 100.0] {
        let time_s: Vec<f64> = (0..=100).map(|n| f64::from(n) * length / 100.0).collect();
        let cycle = raw(time_s, |joint, t| angle(joint, t / length));
        let out = done(&cycle);
        assert!(out.normalised_cycle);
        assert!((out.recording.duration_s() - 1.0).abs() < 1e-9);
        assert_eq!(out.findings.len(), 1, "{:?}", out.findings);
        assert_eq!(out.findings[0].what, FindingKind::NormalisedCycle);
    }
    // A second of walking that does not end where it began is a second of walking; that is said.
    let second = walk(1.0, 100.0, 0.7, 0.0);
    let out = done(&second);
    assert!(!out.normalised_cycle);
    let [Finding { what: FindingKind::CycleOrSeconds { length, apart_deg }, done: Done::Reported, .. }] =
        out.findings[..]
    else {
        panic!("{:?}", out.findings)
    };
    assert!(length == 1.0 && apart_deg > 3.0 && out.findings[0].to_string().contains("--stride-time"), "{apart_deg}");
    // A caller who knows better is obeyed; one who is wrong is refused.
    let known = Rules { stride_s: Some(1.2), ..Rules::default() };
    let out = condition(&second, &known).unwrap();
    assert!(out.normalised_cycle && (out.recording.duration_s() - 1.2).abs() < 1e-9);
    assert_eq!(out.findings[0].what, FindingKind::CycleOf { stride_s: 1.2 });
    let error = condition(&walk(3.0, 100.0, 1.1, 0.0), &known).unwrap_err();
    assert!(error.to_string().contains("(`--stride-time`), but the time runs from 0 to 3"), "{error}");
    // So are 100 s at a recorder's rate.
    assert!(!done(&walk(100.0, 50.0, 1.0, 0.0)).normalised_cycle);
}

#[test]
fn a_low_pass_is_applied_when_asked_for_and_said() {
    let noisy = raw(times(4.0, 200.0), |joint, t| angle(joint, t / 1.1) + 0.5 * (t * 300.0).sin());
    let out = condition(&noisy, &Rules { low_pass: LowPass::At(12.0), ..Rules::default() }).unwrap();
    assert_eq!(out.findings.len(), 1);
    assert!(out.findings[0].to_string().ends_with("low-pass at 12 Hz"), "{}", out.findings[0]);
    let values = out.joint(Joint::LeftHip).unwrap();
    let off = (100..700).map(|n| (values[n] - angle(Joint::LeftHip, n as f64 / 220.0)).abs()).fold(0.0, f64::max);
    assert!(off < 0.1, "{off}");
    for (period, hz) in [(1.1, 6.0), (0.7, 12.0)] {
        let raw = raw(times(5.0, 200.0), |joint, t| angle(joint, t / period));
        let out = condition(&raw, &Rules { low_pass: LowPass::Customary, ..Rules::default() }).unwrap();
        assert_eq!(out.findings[0].done, Done::Smoothed { hz });
    }
    let error = condition(&noisy, &Rules { low_pass: LowPass::At(90.0), ..Rules::default() }).unwrap_err();
    assert!(matches!(error, ConditionError::LowPass { .. }), "{error}");
}
