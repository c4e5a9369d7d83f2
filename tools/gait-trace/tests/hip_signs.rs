//! The sign of a hip: known by the format, by positions or by the caller it is not changed by the shape of the strides; else it is.

mod support;
mod synthetic;

use gait_trace::format::converted::{self, Conversion, Format};
use gait_trace::format::open;
use gait_trace::{
    Channel, Conditioned, Done, Finding, FindingKind, HipSignReason, Level, PositiveDirection, Quantity, RawJoints,
    ReadOptions, Recording, Rules, SignBasis, SignSource, TakenHipSign, condition,
};
use joint_units::Joint;
use std::f64::consts::TAU;
use std::path::Path;
use support::{Stand, centre_points, trc};
use synthetic::{angle, column, raw, times, walk};

const HIPS: [Joint; 2] = [Joint::LeftHip, Joint::RightHip];
const BY_FORMAT: SignSource = SignSource::Format("by definition of a test");

fn with_sign(mut raw: RawJoints, sign: SignSource) -> RawJoints {
    raw.joints.iter_mut().flatten().for_each(|joint| joint.sign = sign);
    raw
}

fn mirrored(mut raw: RawJoints) -> RawJoints {
    HIPS.into_iter().for_each(|hip| column(&mut raw, hip).iter_mut().for_each(|x| *x = -*x));
    raw
}

/// A walk that is played backwards in time. Its hips have the double bump of persons at the end of the usual range, where the shape of the
/// backward walk shows the other sign.
fn backwards() -> RawJoints {
    raw(times(4.0, 100.0), |joint, t| {
        let phase = 0.1 - t / 1.1;
        let p = TAU * (phase + if joint == Joint::RightHip { 0.5 } else { 0.0 });
        if HIPS.contains(&joint) {
            8.0 + 21.0 * p.cos() + 4.6 * (2.0 * p + 0.27 * TAU).cos()
        } else {
            angle(joint, phase)
        }
    })
}

fn asked(raw: &RawJoints, hip_sign: Option<PositiveDirection>) -> Conditioned {
    condition(raw, &Rules { hip_sign, ..Rules::default() }).unwrap_or_else(|error| panic!("{error}"))
}

fn hips(done: &Conditioned) -> [&[f64]; 2] {
    HIPS.map(|hip| done.joint(hip).expect("the hip is there"))
}

fn hips_of(raw: &RawJoints) -> [&[f64]; 2] {
    [0, 1].map(|hip| raw.joints[hip].as_ref().expect("the hip is there").angle_deg.as_slice())
}

fn taken(done: &Conditioned) -> Vec<(TakenHipSign, Done, Level)> {
    let of = |finding: &Finding| match finding.what {
        FindingKind::HipSign(taken) => Some((taken, finding.done, finding.level())),
        _ => None,
    };
    done.findings.iter().filter_map(of).collect()
}

fn said(done: &Conditioned) -> Vec<String> {
    done.findings.iter().map(Finding::to_string).collect()
}

#[test]
fn a_hip_of_unknown_sign_is_turned_by_its_shape_and_the_option_is_named() {
    let raw = mirrored(walk(4.0, 100.0, 1.1, 0.1));
    let done = asked(&raw, None);
    assert_eq!(done.recording, asked(&walk(4.0, 100.0, 1.1, 0.1), None).recording);
    assert_eq!(
        said(&done)[0],
        "left hip: extension is positive in the file (by the shape of the strides, with a mean of -8 deg); the sign was changed; `--hip-sign extension` confirms that, `--hip-sign flexion` keeps it, for example where the person walks backwards"
    );
    // A guess that changes the data: `--strict` refuses it, as it refuses exchanged columns.
    assert!(taken(&done).iter().all(|(.., level)| *level == Level::Warning) && taken(&done).len() == 2);
    assert_eq!(done.signs[..2], [Some(SignBasis::Turned); 2]);
}

#[test]
fn a_hip_of_known_sign_is_not_turned_and_the_doubt_is_a_warning() {
    for (source, why) in [(BY_FORMAT, "by definition of a test"), (SignSource::Computed, "computed from positions")] {
        let raw = with_sign(mirrored(walk(4.0, 100.0, 1.1, 0.1)), source);
        let done = asked(&raw, None);
        assert_eq!(hips(&done), hips_of(&raw));
        let line = |side: &str| {
            format!(
                "{side} hip: flexion is positive in the file ({why}), but its strides have the shape of the other sign; those of a person who walks backwards may have it too; not changed; `--hip-sign extension` changes it"
            )
        };
        assert_eq!(said(&done), [line("left"), line("right")]);
        assert!(taken(&done).iter().all(|(.., level)| *level == Level::Warning));
        // Nothing is said where the shape agrees.
        assert_eq!(said(&asked(&with_sign(walk(4.0, 100.0, 1.1, 0.1), source), None)), [""; 0]);
    }
}

#[test]
fn the_callers_sign_is_taken_and_what_contradicts_it_is_a_note() {
    use PositiveDirection::{Extension, Flexion};
    for source in [SignSource::Unknown, BY_FORMAT, SignSource::Computed] {
        for is_mirrored in [false, true] {
            let raw = walk(4.0, 100.0, 1.1, 0.1);
            let raw = with_sign(if is_mirrored { mirrored(raw) } else { raw }, source);
            for sign in PositiveDirection::ALL {
                let done = asked(&raw, Some(sign));
                let wanted = hips_of(&raw)
                    .map(|hip| -> Vec<f64> { hip.iter().map(|x| if sign == Extension { -x } else { *x }).collect() });
                assert_eq!(hips(&done), wanted.each_ref().map(Vec::as_slice), "{source:?}, {sign:?}");
                let taken = taken(&done);
                assert_eq!(taken.len(), 2, "{:?}", done.findings);
                for (taken, done, level) in taken {
                    assert_eq!((taken.sign, taken.why, level), (sign, HipSignReason::Asked, Level::Note));
                    assert_eq!(taken.doubt.is_some(), is_mirrored == (sign == Flexion));
                    assert_eq!(done, if sign == Extension { Done::Flipped } else { Done::Reported });
                }
            }
        }
    }
    let done = asked(&mirrored(walk(4.0, 100.0, 1.1, 0.1)), Some(Extension));
    assert_eq!(said(&done)[0], "left hip: extension is positive in the file (as requested); the sign was changed");
}

#[test]
fn of_walking_backwards_the_sign_is_kept_where_it_is_known() {
    let unknown = backwards();
    let done = asked(&unknown, None);
    assert!(hips(&done) != hips_of(&unknown), "the shape alone misreads it: {:?}", said(&done));
    let lines = said(&done);
    assert!(
        lines[0].ends_with("`--hip-sign flexion` keeps it, for example where the person walks backwards"),
        "{lines:?}"
    );

    let kept = asked(&unknown, Some(PositiveDirection::Flexion));
    assert_eq!(hips(&kept), hips_of(&unknown));
    let known = with_sign(backwards(), BY_FORMAT);
    let kept = asked(&known, None);
    assert_eq!(hips(&kept), hips_of(&known));
    let lines = said(&kept);
    assert!(lines.iter().all(|line| line.contains("walks backwards")) && lines.len() == 2, "{lines:?}");
    // Of the usual double bump the knees look like those of the other leg: nothing is changed.
    let other = raw(times(4.0, 100.0), |joint, t| angle(joint, 0.1 - t / 1.1));
    let done = asked(&other, None);
    assert_eq!(hips(&done), hips_of(&other));
    assert_eq!(
        said(&done),
        [
            "each knee moves in the phase of the other leg's hip: left and right knee may be exchanged, the person may walk backwards, or extension of both hips may be positive; flexion is assumed, `--hip-sign flexion|extension` names the sign; not changed"
        ]
    );
}

#[test]
fn one_indicator_against_a_known_sign_is_said_without_doubt_of_the_sign() {
    // A patient's hip without double bump whose knee leads by half a cycle more.
    let unclear = |sign| {
        let raw = raw(times(4.0, 100.0), |joint, t| {
            let p = TAU * (t / 1.1 + if joint == Joint::RightHip { 0.5 } else { 0.0 });
            if HIPS.contains(&joint) { 8.0 - 21.0 * p.cos() } else { angle(joint, t / 1.1) }
        });
        with_sign(raw, sign)
    };
    let lines = said(&asked(&unclear(SignSource::Unknown), None));
    assert_eq!(
        lines[0],
        "left hip: it is unclear whether flexion is positive, as the strides are not those of walking forwards; `--hip-sign flexion|extension` names the sign; not changed"
    );
    let lines = said(&asked(&unclear(BY_FORMAT), None));
    assert_eq!(
        lines[0],
        "left hip: flexion is positive in the file (by definition of a test), but its strides do not have the shape of walking forwards; not changed"
    );
}

/// A walk as markers, with the hips times a sign, forwards or backwards in time and space.
fn markers(hip: f64, backwards: bool) -> Vec<(String, Vec<Option<[f32; 3]>>)> {
    let times = times(4.0, 100.0);
    let phase = |t: f64| if backwards { 0.1 - t / 1.1 } else { 0.1 + t / 1.1 };
    let channels = Joint::ALL.map(|joint| {
        let sign = if HIPS.contains(&joint) { hip } else { 1.0 };
        Channel::new(joint.name(), Quantity::Angle, times.iter().map(|&t| sign * angle(joint, phase(t))).collect())
    });
    let recording = Recording::build(times, channels.into()).unwrap();
    let step_mm = if backwards { -12.0 } else { 12.0 };
    let stand = Stand { up: [0.0, 0.0, 1.0], forward: [1.0, 0.0, 0.0], step_mm, turn_deg: 0.0 };
    centre_points(&recording, stand)
}

fn read(name: &str, bytes: &[u8]) -> RawJoints {
    open::of_bytes(name, bytes, &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn of_markers(points: &[(String, Vec<Option<[f32; 3]>>)]) -> RawJoints {
    read("walk.trc", trc(points, 100.0).as_bytes())
}

#[test]
fn hips_of_markers_are_not_turned() {
    for points in [markers(-1.0, false), markers(-1.0, true), markers(1.0, true)] {
        let raw = of_markers(&points);
        let done = asked(&raw, None);
        assert_eq!(hips(&done), hips_of(&raw), "{:?}", said(&done));
    }
    let done = asked(&of_markers(&markers(-1.0, false)), None);
    let doubts = taken(&done);
    assert!(doubts.len() == 2 && doubts.iter().all(|(taken, ..)| taken.doubt.is_some()), "{:?}", said(&done));
}

/// With the labels of left and right exchanged forward is the other way for hips and knees; so it is of one leg that walks backwards.
#[test]
fn hips_of_markers_follow_the_knees_where_forward_was_wrong() {
    let exchanged: Vec<_> = markers(1.0, false)
        .into_iter()
        .map(|(name, track)| (name.replace('L', "?").replace('R', "L").replace('?', "R"), track))
        .collect();
    let one_leg: Vec<_> = markers(1.0, true).into_iter().filter(|(name, _)| name.starts_with('L')).collect();
    for (points, legs) in [(exchanged, 2), (one_leg, 1)] {
        let raw = of_markers(&points);
        let done = asked(&raw, None);
        let taken = taken(&done);
        assert_eq!(taken.len(), legs, "{:?}", said(&done));
        for (taken, done, level) in taken {
            assert_eq!((taken.sign, taken.why), (PositiveDirection::Extension, HipSignReason::Knees));
            assert_eq!((done, level), (Done::Flipped, Level::Warning));
        }
        // Flexion of the hips is again positive: their mean was 8 degrees.
        let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
        let hip = done.joint(Joint::LeftHip).unwrap();
        assert!((mean(hip) - 8.0).abs() < 2.0, "{}", mean(hip));
        let line = &said(&done).into_iter().find(|line| line.starts_with("left hip")).unwrap();
        assert!(line.contains("left and right may be exchanged"), "{line}");
    }
}

/// A hip that moves like a knee is no exchanged column where hip and knee are computed from markers.
#[test]
fn hips_and_knees_of_markers_are_not_exchanged() {
    let mut raw = walk(4.0, 100.0, 1.1, 0.1);
    raw.joints.swap(0, 2);
    raw.joints.swap(1, 3);
    assert!(asked(&raw, None).findings.iter().any(|finding| finding.done == Done::Exchanged));
    let raw = with_sign(raw, SignSource::Computed);
    let rules = Rules { knee_sign: Some(PositiveDirection::Flexion), ..Rules::default() };
    let done = condition(&raw, &rules).unwrap();
    assert_eq!(done.joint(Joint::LeftKnee), raw.joints[2].as_ref().map(|knee| knee.angle_deg.as_slice()));
    assert!(
        done.findings.iter().any(|finding| (finding.what, finding.done) == (FindingKind::HipIsKnee, Done::Reported)),
        "{:?}",
        said(&done)
    );
}

fn corpus(name: &str, options: &ReadOptions<'_>) -> RawJoints {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus").join(name);
    open::read(&path, options).unwrap_or_else(|error| panic!("{error}"))
}

fn sources(raw: &RawJoints) -> Vec<SignSource> {
    raw.joints[..2].iter().flatten().map(|hip| hip.sign).collect()
}

#[test]
fn each_reader_knows_what_its_format_defines() {
    use gait_trace::Axis;
    use gait_trace::format::angle_unit::AngleUnit;
    let plain = ReadOptions::default();
    let is_defined = |source: &SignSource| matches!(source, SignSource::Format(_));
    #[cfg(feature = "interchange")]
    assert_eq!(sources(&corpus("mvnx/walk.mvnx", &plain)), [SignSource::Format("by definition of MVNX"); 2]);
    for name in [
        "opensim/version1_tabs_degrees.mot",
        "opensim/version3_blanks_radians.mot",
        "opensim/states.sto",
        "c3d/angles_intel_floats.c3d",
        "vicon/semicolons_decimal_commas.csv",
        "gcd/both_legs.gcd",
    ] {
        let found = sources(&corpus(name, &plain));
        assert!(found.len() == 2 && found.iter().all(is_defined), "{name}: {found:?}");
    }
    for name in ["c3d/joint_centres.c3d", "c3d/plug_in_gait_markers.c3d", "trc/y_up.trc"] {
        assert_eq!(sources(&corpus(name, &plain)), [SignSource::Computed; 2], "{name}");
    }
    // The model defines the sign of Visual3D; nothing does in a table.
    for name in ["visual3d/time_and_markers.txt", "csv/own_header.csv"] {
        assert_eq!(sources(&corpus(name, &plain)), [SignSource::Unknown; 2], "{name}");
    }
    // Another component than the first, and a column that only the map calls a hip.
    let y = ReadOptions { axis: Some(Axis::Y), unit: Some(AngleUnit::Degrees), ..ReadOptions::default() };
    for name in ["c3d/angles_intel_floats.c3d", "vicon/semicolons_decimal_commas.csv"] {
        assert_eq!(sources(&corpus(name, &y)), [SignSource::Model; 2], "{name}");
    }
    let mut mapped = ReadOptions::default();
    mapped.add_map("left_hip=pelvis_tx").unwrap();
    let text = "walk\nversion=1\nnRows=2\nnColumns=3\ninDegrees=yes\nendheader\ntime\tpelvis_tx\thip_flexion_r\n0\t0.5\t1\n0.01\t1.0\t1\n";
    let raw = open::of_bytes("walk.mot", text.as_bytes(), &mapped).unwrap();
    assert!(sources(&raw)[0] == SignSource::Model && is_defined(&sources(&raw)[1]));
}

/// What `footfall convert` wrote is flexion positive: a person who walks backwards stays as converted.
#[test]
fn a_converted_file_is_not_turned_when_it_is_read_again() {
    let first = asked(&with_sign(backwards(), BY_FORMAT), None);
    for (name, format) in [("walk.csv", Format::Csv), ("walk.mot", Format::Mot)] {
        let mut text = Vec::new();
        converted::write_to(&mut text, format, &first, &Conversion::default()).unwrap();
        let again = asked(&read(name, &text), None);
        assert_eq!(again.recording.channels(), first.recording.channels(), "{name}: {:?}", said(&again));
    }
}
