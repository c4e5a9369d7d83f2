//! Files of other programs, as they are published: each gives what its folder's README says, which was found with independent readers.
//!
//! The files are in `wild` beside the folder of recordings; without it these tests are ignored.

use gait_trace::format::open;
use gait_trace::stride::strides::segment;
use gait_trace::{
    Conditioned, Done, Finding, FindingKind, KneeSignReason, Level, PositiveDirection, RawJoints, ReadOptions, Rules,
    condition,
};
use joint_units::Joint;
use std::process::ExitCode;
use test_suite::{tests, wild_folder};

fn main() -> ExitCode {
    test_suite::run(tests![
        both_knees_of_half_a_stride_are_turned(Wild),
        a_header_with_other_counts_is_a_note(Wild),
        controls_errors_and_speeds_are_refused_by_title(Wild),
        a_normalised_cycle_is_named(Wild),
        bent_knees_are_not_turned(Wild),
        missing_joint_centres_are_missing_values(Wild),
        markers_give_nearly_the_angles_of_the_model(Wild),
        what_was_read_wrong_is_read_right(Wild),
    ])
}

fn read(name: &str) -> Result<RawJoints, String> {
    open::read(&wild_folder().join(name), &ReadOptions::default()).map_err(|error| error.to_string())
}

fn good(name: &str) -> RawJoints {
    read(name).unwrap_or_else(|error| panic!("{error}"))
}

fn conditioned(raw: &RawJoints, rules: &Rules) -> Conditioned {
    condition(raw, rules).unwrap_or_else(|error| panic!("{error}"))
}

fn extent(values: &[f64]) -> (f64, f64) {
    let known = || values.iter().copied().filter(|value| value.is_finite());
    (known().fold(f64::INFINITY, f64::min), known().fold(f64::NEG_INFINITY, f64::max))
}

fn is_near((a, b): (f64, f64), (c, d): (f64, f64)) -> bool {
    (a - c).abs() < 0.05 && (b - d).abs() < 0.05
}

fn both_knees_of_half_a_stride_are_turned() {
    let raw = good("osim_moco_2d_reference.sto");
    let done = conditioned(&raw, &Rules::default());
    assert!(is_near(extent(done.joint(Joint::LeftKnee).unwrap()), (11.4, 44.6)), "{:?}", done.findings);
    assert!(is_near(extent(done.joint(Joint::RightKnee).unwrap()), (7.3, 14.9)), "{:?}", done.findings);
    let why = |joint: Joint| {
        done.findings.iter().find_map(|finding| match finding {
            Finding { joint: Some(found), what: FindingKind::KneeSign(taken), done: Done::Flipped, .. }
                if *found == joint =>
            {
                Some((taken.sign, taken.why))
            }
            _ => None,
        })
    };
    assert_eq!(why(Joint::LeftKnee), Some((PositiveDirection::Extension, KneeSignReason::Range)));
    assert_eq!(why(Joint::RightKnee), Some((PositiveDirection::Extension, KneeSignReason::OtherKnee)));
    // The caller's sign goes before it.
    let asked = Rules { knee_sign: Some(PositiveDirection::Flexion), ..Rules::default() };
    assert!(is_near(extent(conditioned(&raw, &asked).joint(Joint::LeftKnee).unwrap()), (-44.6, -11.4)));
}

/// The kinds of `november/README.md` of which there is a file; `kinds.rs` has others of each kind.
fn what_was_read_wrong_is_read_right() {
    let knees = |name: &str, rules: &Rules| {
        let done = conditioned(&good(&format!("november/{name}")), rules);
        let of = |joint| extent(done.joint(joint).unwrap());
        ([of(Joint::LeftKnee), of(Joint::RightKnee)], done)
    };
    let is = |(a, b): (f64, f64), least: f64, most: f64| (a - least).abs() < 1.0 && (b - most).abs() < 1.0;
    let plain = Rules::default();
    let ([left, right], done) = knees("04_pig_stiff_knees_rotation.c3d", &plain);
    assert!(left.1 - left.0 < 20.0 && right.1 - right.0 < 20.0, "{left:?} {right:?}");
    assert!(done.findings.iter().all(|finding| finding.level() < Level::Warning), "{:?}", done.findings);
    let ([left, _], _) = knees("05_pig_recurvatum_one_knee.c3d", &plain);
    assert!(is(left, -27.0, 14.0), "{left:?}");
    let ([left, right], _) = knees("07_opensim_locked_prosthetic_knee.mot", &plain);
    assert!(is(left, 0.0, 3.0) && right.1 > 60.0, "{left:?} {right:?}");
    let own = good("november/09_each_leg_own_cycle.csv");
    assert!(condition(&own, &plain).unwrap_err().to_string().contains("`--own-cycles`"));
    let (_, done) = knees("09_each_leg_own_cycle.csv", &Rules { own_cycles: true, ..plain });
    assert!(segment(&done).is_ok());
    for name in ["11_times.trc", "14_trailing_blanks_trimmed.trc", "17_excel_empty_rows.csv", "18_msvc_nan.mot"] {
        let walk = segment(&knees(name, &plain).1).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!((walk.period_s - 1.08).abs() < 0.03, "{name}: {}", walk.period_s);
    }
}

fn a_header_with_other_counts_is_a_note() {
    let raw = good("osim_moco_3d_coordinates.sto");
    assert_eq!(raw.time_s.len(), 1350);
    let note = "`nColumns` announces 40 columns, but the file has 32";
    assert!(raw.notes.iter().any(|found| found.starts_with(note)), "{:?}", raw.notes);
    let walk = segment(&conditioned(&raw, &Rules::default())).unwrap();
    assert!((walk.period_s - 1.140).abs() < 0.005, "{}", walk.period_s);
}

fn controls_errors_and_speeds_are_refused_by_title() {
    for (name, words) in [
        ("osim_hamner_rra_controls.sto", ":1: the title line `controls` names another quantity than joint angles"),
        ("osim_gait2354_cmc_perr.sto", ":1: the title line `PositionErrors` names another quantity than joint angles"),
        ("osim_gait2354_forward_u.sto", ":1: the title line `Speeds` names another quantity than joint angles"),
        (
            "november/01_static_optimization_activation.sto",
            ":1: the title line `Static Optimization` names another quantity than joint angles",
        ),
    ] {
        let error = read(name).unwrap_err();
        assert!(error.contains(words) && error.contains("allowed are"), "{error}");
    }
}

fn a_normalised_cycle_is_named() {
    let raw = good("osim_crouch1.mot");
    assert_eq!(raw.time_s.len(), 119);
    assert!(raw.notes.iter().any(|note| note.starts_with("`nRows` announces 120 rows, but the file has 119")));
    let done = conditioned(&raw, &Rules::default());
    assert!(done.normalised_cycle);
    let said: Vec<String> = done.findings.iter().map(ToString::to_string).collect();
    assert!(said[0].contains("fraction of one cycle") && said[0].contains("--stride-time"), "{said:?}");
    // With its duration it is a stride of that many seconds.
    let done = conditioned(&raw, &Rules { stride_s: Some(1.3), ..Rules::default() });
    let walk = segment(&done).unwrap();
    assert!((walk.period_s - 1.3).abs() < 1e-9 && walk.spans.len() == 1, "{}", walk.period_s);
    assert!((done.recording.duration_s() - 1.3).abs() < 1e-9 && (done.rate_hz - 118.0 / 1.3).abs() < 1e-3);
}

fn bent_knees_are_not_turned() {
    let raw = good("c3dorg_sample04_sub_labels.c3d");
    assert!(raw.notes.iter().any(|note| note.starts_with("Flexion is read from component x")), "{:?}", raw.notes);
    let knees = [Joint::LeftKnee, Joint::RightKnee].map(|joint| raw.joints[joint as usize].as_ref().unwrap());
    let (least, most) = knees.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), knee| {
        let (a, b) = extent(&knee.angle_deg);
        (least.min(a), most.max(b))
    });
    assert!((51.0..52.0).contains(&least) && (113.0..114.0).contains(&most), "{least} to {most}");
    let done = conditioned(&raw, &Rules::default());
    let turned = |finding: &Finding| matches!(finding.what, FindingKind::KneeSign(_)) && finding.done == Done::Flipped;
    assert!(!done.findings.iter().any(turned), "{:?}", done.findings);
    for joint in [Joint::LeftKnee, Joint::RightKnee] {
        assert!(extent(done.joint(joint).unwrap()).0 > 45.0);
    }
}

fn missing_joint_centres_are_missing_values() {
    let raw = good("c3dorg_sample23_vicon_analysis.c3d");
    assert_eq!(raw.time_s.len(), 694);
    let missing = (0..694).filter(|&n| raw.joints.iter().flatten().any(|joint| joint.angle_deg[n].is_nan())).count();
    assert_eq!(missing, 317);
    let raw = good("osim_walking2.c3d");
    let seen: Vec<bool> =
        (0..raw.time_s.len()).map(|n| raw.joints.iter().flatten().all(|joint| !joint.angle_deg[n].is_nan())).collect();
    let block: Vec<f64> = raw.time_s.iter().zip(&seen).filter(|(_, seen)| **seen).map(|(time, _)| *time).collect();
    assert!((block[block.len() - 1] - block[0] - 1.66).abs() < 0.02, "{} to {}", block[0], block[block.len() - 1]);
    let step = raw.time_s[1] - raw.time_s[0];
    assert!(block.windows(2).all(|pair| pair[1] - pair[0] < 1.5 * step), "the block is unbroken");
}

/// The markers of Plug-in Gait alone, against the joint centres and the angles that Vicon computed in the same file. The hips are another
/// regression and are read against the vertical, not the pelvis, which is tilted by 11 degrees; the knees are markers on the skin, which
/// displaces their angles by 4 and 8 degrees. Around these displacements the angles differ by about a degree (root mean square).
fn markers_give_nearly_the_angles_of_the_model() {
    let path = wild_folder().join("c3dorg_sample23_vicon_analysis.c3d");
    let whole = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let without = |labels: &[&str]| {
        let mut bytes = whole.clone();
        for label in labels {
            let at: Vec<usize> =
                (0..bytes.len() - label.len()).filter(|&at| bytes[at..].starts_with(label.as_bytes())).collect();
            assert!(!at.is_empty(), "{label}");
            at.into_iter().for_each(|at| bytes[at] = b'?');
        }
        open::of_bytes("walk.c3d", &bytes, &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
    };
    const ANGLES: [&str; 4] = ["LHipAngles", "RHipAngles", "LKneeAngles", "RKneeAngles"];
    const CENTRES: [&str; 6] = ["LFEP", "RFEP", "LFEO", "RFEO", "LTIO", "RTIO"];
    let model = without(&[]);
    let centres = without(&ANGLES);
    let markers = without(&[&ANGLES[..], &CENTRES].concat());
    assert!(markers.notes.iter().any(|note| note.contains("computed from the pelvis")), "{:?}", markers.notes);
    // Root mean square around the mean difference, and the mean difference, degrees.
    let apart = |a: &RawJoints, b: &RawJoints, joint: Joint| {
        let [a, b] = [a, b].map(|raw| &raw.joints[joint as usize].as_ref().unwrap().angle_deg);
        let both: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).filter(|off| off.is_finite()).collect();
        assert!(both.len() > 50, "{} frames", both.len());
        let mean = both.iter().sum::<f64>() / both.len() as f64;
        let rms = (both.iter().map(|off| (off - mean).powi(2)).sum::<f64>() / both.len() as f64).sqrt();
        println!("{joint:?}: rms {rms:.2}, mean {mean:.2}, {} frames", both.len());
        (rms, mean.abs())
    };
    for joint in Joint::ALL {
        let (rms, mean) = apart(&markers, &centres, joint);
        assert!(rms < 1.5 && mean < 9.0, "{joint:?} against joint centres: {rms} {mean}");
        let (rms, mean) = apart(&markers, &model, joint);
        assert!(rms < 2.0 && mean < 13.0, "{joint:?} against the model: {rms} {mean}");
    }
}
