//! What is known of a sign, and what is only assumed, is the same in a conversion as in its source.

mod synthetic;

use gait_trace::format::converted::{self, Conversion, Format};
use gait_trace::format::open;
use gait_trace::{
    ConditionError, Conditioned, Done, Finding, FindingKind, Level, PositiveDirection, RawJoints, ReadOptions, Rules,
    SignBasis, SignSource, condition,
};
use joint_units::Joint;
use synthetic::{angle, column, raw, times, walk};

const FORMATS: [(&str, Format); 2] = [("walk.csv", Format::Csv), ("walk.mot", Format::Mot)];

fn done(raw: &RawJoints, rules: &Rules) -> Conditioned {
    condition(raw, rules).unwrap_or_else(|error| panic!("{error}"))
}

fn plain(raw: &RawJoints) -> Conditioned {
    done(raw, &Rules::default())
}

fn written(joints: &Conditioned, format: Format) -> Vec<u8> {
    let mut text = Vec::new();
    converted::write_to(&mut text, format, joints, &Conversion::default()).unwrap();
    text
}

fn read(name: &str, bytes: &[u8]) -> RawJoints {
    open::of_bytes(name, bytes, &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn warnings(joints: &Conditioned) -> Vec<String> {
    joints.findings.iter().filter(|finding| finding.level() == Level::Warning).map(Finding::to_string).collect()
}

fn negated(mut raw: RawJoints, joints: &[Joint]) -> RawJoints {
    joints.iter().for_each(|joint| column(&mut raw, *joint).iter_mut().for_each(|x| *x = -*x));
    raw
}

const HIPS: [Joint; 2] = [Joint::LeftHip, Joint::RightHip];
const KNEES: [Joint; 2] = [Joint::LeftKnee, Joint::RightKnee];

/// A walk whose knees bend by up to 6 degrees: their shape shows a sign, their range does not.
fn stiff_knees() -> RawJoints {
    raw(times(4.0, 100.0), |joint, t| {
        let x = angle(joint, 0.1 + t / 1.1);
        if KNEES.contains(&joint) { 0.12 * (x - 24.0) } else { x }
    })
}

#[test]
fn a_sign_that_nothing_shows_is_a_warning_also_of_the_conversion() {
    let short = walk(0.5, 100.0, 1.1, 0.1);
    for raw in [short.clone(), negated(short, &HIPS)] {
        let first = plain(&raw);
        let wanted = ["left", "right"].map(|side| {
            format!(
                "{side} hip: neither the file nor the strides show whether flexion is positive, and it is assumed; `--hip-sign flexion|extension` names the sign; not changed"
            )
        });
        assert_eq!(warnings(&first), wanted);
        assert_eq!(first.signs[..2], [Some(SignBasis::Assumed); 2]);
        for (name, format) in FORMATS {
            let again = read(name, &written(&first, format));
            assert!(HIPS.iter().all(|hip| again.joints[*hip as usize].as_ref().unwrap().sign == SignSource::Unknown));
            let again = plain(&again);
            assert_eq!(warnings(&again), wanted, "{name}");
            assert_eq!(again.recording.channels(), first.recording.channels());
        }
        // Once it is named, it is known in the conversion too, and the angles stay.
        let named = done(&raw, &Rules { hip_sign: Some(PositiveDirection::Extension), ..Rules::default() });
        for (name, format) in FORMATS {
            let again = plain(&read(name, &written(&named, format)));
            assert_eq!((warnings(&again), again.signs), (vec![], named.signs), "{name}");
            assert_eq!(again.recording.channels(), named.recording.channels());
        }
    }
}

#[test]
fn a_conversion_without_the_line_of_the_signs_says_none() {
    let named =
        done(&walk(0.5, 100.0, 1.1, 0.1), &Rules { hip_sign: Some(PositiveDirection::Flexion), ..Rules::default() });
    for (name, format) in FORMATS {
        let text = String::from_utf8(written(&named, format)).unwrap();
        let without: Vec<&str> = text.lines().filter(|line| !line.contains("signs")).collect();
        let again = plain(&read(name, (without.join("\n") + "\n").as_bytes()));
        assert_eq!(warnings(&again).len(), 2, "{name}: {:?}", again.findings);
    }
}

#[test]
fn a_joint_that_hardly_moves_shows_no_sign() {
    let mut still = stiff_knees();
    for joint in [Joint::LeftHip, Joint::RightKnee] {
        column(&mut still, joint).iter_mut().for_each(|x| *x = 12.0 + 0.05 * *x);
    }
    let out = plain(&still);
    let unknown = |out: &Conditioned| -> Vec<Option<Joint>> {
        out.findings.iter().filter(|f| f.what == FindingKind::SignNotKnown).map(|f| f.joint).collect()
    };
    // The knee has the sign of the other one, which moves.
    assert_eq!(unknown(&out), [Some(Joint::LeftHip)]);
    let mut both = still.clone();
    column(&mut both, Joint::LeftKnee).iter_mut().for_each(|x| *x = 12.0 + 0.05 * *x);
    let out = plain(&both);
    assert_eq!(unknown(&out), [Some(Joint::LeftKnee), Some(Joint::RightKnee), Some(Joint::LeftHip)]);
    assert!(warnings(&out).iter().any(|line| line.contains("`--knee-sign flexion|extension` names the sign")));
    // The named sign holds for them too.
    let sign = Some(PositiveDirection::Extension);
    let named = done(&still, &Rules { hip_sign: sign, knee_sign: sign, ..Rules::default() });
    assert_eq!(named.signs, [Some(SignBasis::Named); 4]);
    assert!(named.joint(Joint::RightKnee).unwrap()[0] < 0.0 && named.joint(Joint::LeftHip).unwrap()[0] < 0.0);
}

#[test]
fn the_named_sign_of_small_knees_is_kept_in_a_conversion() {
    for sign in PositiveDirection::ALL {
        let first = done(&stiff_knees(), &Rules { knee_sign: Some(sign), ..Rules::default() });
        for (name, format) in FORMATS {
            let again = plain(&read(name, &written(&first, format)));
            assert_eq!(again.recording.channels(), first.recording.channels(), "{sign:?}, {name}");
            assert_eq!(again.signs[2..], [Some(SignBasis::Named); 2]);
            // A conversion of the conversion keeps it too, and the caller may still name another one.
            let third = plain(&read(name, &written(&again, format)));
            assert_eq!(third.recording.channels(), first.recording.channels(), "{sign:?}, {name}");
            let other = Rules { knee_sign: Some(PositiveDirection::Extension), ..Rules::default() };
            let other = done(&read(name, &written(&first, format)), &other);
            assert_eq!(other.joint(Joint::LeftKnee).unwrap()[7], -first.joint(Joint::LeftKnee).unwrap()[7]);
        }
    }
}

/// The option that was right for the file is given for its conversion once more, and turns the angles back.
#[test]
fn an_option_against_the_sign_of_a_conversion_is_a_warning() {
    let option = |sign| Rules { hip_sign: Some(sign), knee_sign: Some(sign), ..Rules::default() };
    let (flexion, extension) = (option(PositiveDirection::Flexion), option(PositiveDirection::Extension));
    for (first, sure) in
        [(done(&negated(negated(stiff_knees(), &HIPS), &KNEES), &extension), true), (plain(&stiff_knees()), false)]
    {
        // Of knees whose shape alone shows the sign it is a guess.
        assert_eq!(warnings(&first).len(), if sure { 0 } else { 2 });
        for (name, format) in FORMATS {
            let converted = read(name, &written(&first, format));
            let again = done(&converted, &extension);
            let knee = |out: &Conditioned| out.joint(Joint::LeftKnee).unwrap()[7];
            assert_eq!(knee(&again), -knee(&first), "{name}");
            let said = warnings(&again);
            let words = "as requested, but the file is a conversion, in which flexion is positive (`named`)";
            assert_eq!(said.iter().filter(|line| line.contains(words)).count(), if sure { 4 } else { 0 }, "{said:?}");
            assert_eq!(warnings(&done(&converted, &flexion)), [""; 0], "{name}");
        }
    }
}

#[test]
fn a_sign_that_was_changed_by_the_shape_is_a_warning_also_of_the_conversion() {
    for (raw, joints) in [(negated(walk(4.0, 100.0, 1.1, 0.1), &HIPS), HIPS), (negated(stiff_knees(), &KNEES), KNEES)] {
        let first = plain(&raw);
        assert!(
            joints.iter().all(|joint| first.signs[*joint as usize] == Some(SignBasis::Turned)),
            "{:?}",
            first.signs
        );
        assert_eq!(warnings(&first).len(), 2, "{:?}", first.findings);
        let option = if joints == HIPS { "--hip-sign" } else { "--knee-sign" };
        assert!(
            warnings(&first)
                .iter()
                .all(|line| line.contains(&format!("; the sign was changed; `{option} extension` confirms that")))
        );
        for (name, format) in FORMATS {
            let text = written(&first, format);
            let again = plain(&read(name, &text));
            assert_eq!(again.recording.channels(), first.recording.channels(), "{name}");
            let said = warnings(&again);
            let is_right = |line: &String| {
                line.contains("as `footfall convert` changed it, which was a guess); not changed")
                    && line.ends_with(&format!("`{option} flexion` confirms it, `{option} extension` changes it"))
            };
            assert!(said.len() == 2 && said.iter().all(is_right), "{name}: {said:?}");
            let sign = Some(PositiveDirection::Flexion);
            let confirmed = done(&read(name, &text), &Rules { hip_sign: sign, knee_sign: sign, ..Rules::default() });
            assert_eq!((warnings(&confirmed), confirmed.signs), (vec![], [Some(SignBasis::Named); 4]));
        }
    }
}

#[test]
fn a_spreadsheet_does_not_hide_the_record() {
    let named = done(&stiff_knees(), &Rules { knee_sign: Some(PositiveDirection::Extension), ..Rules::default() });
    let record =
        Conversion { version: "9".into(), source: "walk.c3d".into(), low_pass_hz: Some(6.0), ..Default::default() };
    for (name, format) in FORMATS {
        let mut text = Vec::new();
        converted::write_to(&mut text, format, &named, &record).unwrap();
        let text = String::from_utf8(text).unwrap();
        let filled = text.lines().map(|line| if line.starts_with('#') { format!("{line},,,,") } else { line.into() });
        let filled: Vec<String> = filled.collect();
        for saved in ["\u{feff}".to_owned() + &text, "\u{feff}".to_owned() + &filled.join("\r\n") + "\r\n"] {
            let found = Conversion::of_bytes(saved.as_bytes()).unwrap().expect("it is a conversion");
            assert_eq!(
                (found.version.as_str(), found.source.as_str(), found.low_pass_hz),
                ("9", "walk.c3d", Some(6.0))
            );
            let again = plain(&read(name, saved.as_bytes()));
            assert_eq!(again.recording.channels(), named.recording.channels(), "{name}");
            assert_eq!(again.signs, named.signs);
        }
    }
}

#[test]
fn what_is_found_in_an_exchanged_column_has_the_name_of_the_joint() {
    let mut raw = walk(4.0, 100.0, 1.1, 0.1);
    column(&mut raw, Joint::LeftKnee)[100..104].fill(f64::NAN);
    raw.joints.swap(0, 2);
    raw.joints.swap(1, 3);
    let names = |raw: &mut RawJoints, joint: Joint, name: &str| {
        raw.joints[joint as usize].as_mut().unwrap().column = name.into()
    };
    names(&mut raw, Joint::LeftHip, "hip");
    names(&mut raw, Joint::LeftKnee, "knee");
    let out = plain(&raw);
    assert!(out.findings.iter().any(|finding| finding.done == Done::Exchanged), "{:?}", out.findings);
    let gap = out.findings.iter().find(|finding| finding.what == FindingKind::Gap).unwrap();
    assert_eq!(gap.joint, Some(Joint::LeftKnee), "{gap}");
    assert_eq!(out.missing[Joint::LeftKnee as usize], [(100, 104)]);
    assert_eq!(Joint::ALL.map(|joint| out.column_of(joint)), [2, 3, 0, 1].map(|n: usize| Joint::ALL[n]));
    // What the file said of a hip does not hold of the knee that its column is.
    for sign in [SignSource::Format("by definition of a test"), SignSource::Converted(SignBasis::Named)] {
        raw.joints[0].as_mut().unwrap().sign = sign;
        let out = plain(&raw);
        assert!(
            !out.signs[..3].contains(&Some(SignBasis::Named)) && out.signs[0] != Some(SignBasis::Known),
            "{:?}",
            out.signs
        );
    }
}

#[test]
fn an_option_for_a_joint_that_is_not_there_is_a_note() {
    let sign = Some(PositiveDirection::Flexion);
    let rules = Rules { hip_sign: sign, knee_sign: sign, ..Rules::default() };
    for (kept, wanted) in [
        (&HIPS, "`--knee-sign` has no effect: the recording has no knee"),
        (&KNEES, "`--hip-sign` has no effect: the recording has no hip"),
    ] {
        let mut raw = walk(4.0, 100.0, 1.1, 0.1);
        for joint in Joint::ALL.into_iter().filter(|joint| !kept.contains(joint)) {
            raw.joints[joint as usize] = None;
        }
        let out = done(&raw, &rules);
        let said = out.findings.iter().find(|finding| finding.to_string() == wanted);
        assert_eq!(said.map(Finding::level), Some(Level::Note), "{:?}", out.findings);
    }
    assert!(done(&walk(4.0, 100.0, 1.1, 0.1), &rules).findings.iter().all(|finding| finding.joint.is_some()));
}

#[test]
fn the_option_of_a_sign_that_no_person_has_is_named() {
    let rules = Rules { knee_sign: Some(PositiveDirection::Extension), ..Rules::default() };
    let error = condition(&walk(4.0, 100.0, 1.1, 0.1), &rules).unwrap_err();
    assert!(matches!(error, ConditionError::Impossible { .. }), "{error}");
    assert!(error.to_string().contains("is the sign another one than `--knee-sign extension`"), "{error}");
}
