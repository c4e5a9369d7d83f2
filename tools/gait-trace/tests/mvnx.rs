//! MVNX of Xsens MVN: a file in the layout of its manual gives its angles to the last digit, poses are skipped, and damage is refused.

mod support;

#[path = "support/damage.rs"]
mod damage;

use damage::{check, damage, held};
use gait_trace::format::angle_unit::AngleUnit;
use gait_trace::format::open;
use gait_trace::{RawJoints, ReadOptions};
use joint_units::Joint;
use proptest::prelude::*;
use std::fmt::Write as _;
use support::{joint, walk};

const GOOD: &str = include_str!("corpus/mvnx/walk.mvnx");
const LABELS: [&str; 5] = ["jL5S1", "jRightHip", "jRightKnee", "jLeftHip", "jLeftKnee"];

fn read(text: &str, how: &ReadOptions<'_>) -> Result<RawJoints, String> {
    open::of_bytes("walk.mvnx", text.as_bytes(), how).map_err(|error| error.to_string())
}

/// A file of five joints: each frame is the attributes and the content of an element.
fn file(frames: impl IntoIterator<Item = (String, String)>) -> String {
    let mut text = "<mvnx version=\"3\">\n<subject frameRate=\"100\">\n<joints>\n".to_owned();
    LABELS.iter().for_each(|label| text += &format!("<joint label=\"{label}\"/>\n"));
    text += "</joints>\n<frames>\n";
    for (attributes, content) in frames {
        let _ = writeln!(text, "<frame {attributes}>{content}</frame>");
    }
    text + "</frames>\n</subject>\n</mvnx>\n"
}

fn angle(n: usize, joint: usize) -> f64 {
    joint as f64 * 10.0 + (n % 400) as f64 / 8.0
}

fn angles(n: usize) -> String {
    let joint = |k: usize| format!("-1 {} {}", 200 - k, angle(n, k));
    format!("<jointAngle>{}</jointAngle>", (0..5).map(joint).collect::<Vec<_>>().join(" "))
}

fn frames(count: usize) -> impl Iterator<Item = (String, String)> {
    (0..count).map(|n| (format!("type='normal' index='{n}' time='{}'", n * 10), angles(n)))
}

#[test]
fn the_layout_of_the_manual_gives_the_walk() {
    let walk = walk();
    let raw = read(GOOD, &ReadOptions::default()).unwrap();
    assert_eq!(raw.format, "MVNX, version 4, 240 Hz, 22 joints");
    assert_eq!(raw.time_s.len(), 24);
    // In the file the times are in whole milliseconds.
    assert!(raw.time_s.iter().enumerate().all(|(n, time)| (time - n as f64 / 240.0).abs() < 1e-12));
    for which in Joint::ALL {
        let found = raw.joints[which as usize].as_ref().unwrap();
        assert_eq!(found.angle_deg, joint(&walk, which)[..24], "{which:?}");
    }
    assert_eq!(raw.joints[Joint::LeftKnee as usize].as_ref().unwrap().column, "jLeftKnee z");
    assert_eq!(
        raw.notes,
        [
            "Frames of poses are skipped: 1 of type `identity`, 1 of type `tpose`, 1 of type `tpose-isb`.",
            "The times are the numbers of the frames at 240 Hz; `time` agrees with them within 0.8 ms.",
        ]
    );
}

/// Without a type, without angles, with missing values, with a map, and with another unit.
#[test]
fn what_is_missing_stays_missing() {
    let mut all: Vec<(String, String)> = frames(40).collect();
    all[3].1 = "<orientation>1 0 0 0</orientation>".into();
    all[4].1 = all[4].1.replace(&angle(4, 4).to_string(), "NaN");
    all[5].0 = all[5].0.replace("type='normal' ", "");
    let raw = read(&file(all), &ReadOptions::default()).unwrap();
    let knee = &raw.joints[Joint::LeftKnee as usize].as_ref().unwrap().angle_deg;
    assert!((0..40).all(|n| if n == 3 || n == 4 { knee[n].is_nan() } else { knee[n] == angle(n, 4) }));
    assert!(
        raw.notes.contains(&"1 of 40 frames have no joint angles; they are missing values.".to_owned()),
        "{:?}",
        raw.notes
    );
    assert!(
        raw.notes.contains(&"1 frames name no type; they are read as normal frames.".to_owned()),
        "{:?}",
        raw.notes
    );

    let mut how = ReadOptions { unit: Some(AngleUnit::Degrees), ..ReadOptions::default() };
    how.add_map("left_hip=jL5S1").unwrap();
    let raw = read(&file(frames(40)), &how).unwrap();
    let hip = raw.joints[Joint::LeftHip as usize].as_ref().unwrap();
    assert_eq!((hip.column.as_str(), hip.angle_deg[8]), ("jL5S1 z", 1.0));
    let rate = ReadOptions { rate_hz: Some(60.0), ..ReadOptions::default() };
    let error = read(GOOD, &rate).unwrap_err();
    assert!(error.contains("the file has its own time in `time` and `frameRate`"), "{error}");
}

/// Blanks separate the numbers, so decimal commas are unambiguous, unless some numbers have points.
#[test]
fn decimal_commas_are_read() {
    let points = file(frames(40));
    let (wanted, plain) = (read(&points, &ReadOptions::default()).unwrap(), ReadOptions::default());
    let found = read(&points.replace('.', ","), &plain).unwrap();
    assert_eq!((&found.time_s, &found.joints), (&wanted.time_s, &wanted.joints));
    assert!(found.notes.contains(&"Numbers have decimal commas.".to_owned()), "{:?}", found.notes);
    let mixed = points.replacen("10.25", "10,25", 1);
    let error = read(&mixed, &plain).unwrap_err();
    assert!(error.contains("numbers with decimal commas here, and with decimal points elsewhere"), "{error}");
}

#[test]
fn damaged_files() {
    let small = file(frames(30));
    let with = |from: &str, to: &str| {
        assert!(small.contains(from), "{from}");
        small.replacen(from, to, 1)
    };
    let entities = format!("<!DOCTYPE mvnx [<!ENTITY a \"1 2 3\"><!ENTITY b \"&a;&a;\">]>\n{small}");
    let two = with("</subject>", "</subject><subject frameRate='100'></subject>");
    let deep = with("</joints>", &format!("</joints>{}", "<a>".repeat(100_000)));
    let types = file((0..40).map(|n| (format!("type='t{n}'"), String::new())));
    check(
        vec![
            damage(
                "cut within a frame",
                "a.mvnx",
                &small[..small.len() / 2],
                &["a.mvnx:", "the file ends within an element (cut off?)"],
            ),
            damage("cut within a tag", "a.mvnx", &small[..30], &["a.mvnx:2: the XML cannot be read"]),
            damage("cut behind the frames", "a.mvnx", &small[..small.len() - 8], &["the file ends within an element"]),
            damage(
                "tags crossed",
                "a.mvnx",
                with("</joints>", "</frames>"),
                &["a.mvnx:9: the XML cannot be read: ill-formed document"],
            ),
            damage(
                "entities",
                "a.mvnx",
                entities,
                &["a.mvnx:1: the XML cannot be read: the document type has definitions of its own"],
            ),
            damage(
                "a reference",
                "a.mvnx",
                with("-1 200", "&a; 200"),
                &["a.mvnx:11: ", "`<jointAngle>` has something else than numbers"],
            ),
            damage("two subjects", "a.mvnx", two, &["`the number of subjects` is 2 or more; allowed is 1"]),
            damage("deep", "a.mvnx", deep, &["elements are nested more than 64 deep"]),
            damage(
                "forty types",
                "a.mvnx",
                types,
                &["`the number of types of frames` is too large; allowed is up to 16"],
            ),
            damage(
                "no joints",
                "a.mvnx",
                with("<joints>", "<joins>").replacen("</joints>", "</joins>", 1),
                &["a.mvnx:11: `<joints>` is missing"],
            ),
            damage(
                "other joints",
                "a.mvnx",
                small.replace("Hip", "Ankle").replace("Knee", "Toe"),
                &["no column is recognised as a joint; there are `jL5S1`, `jRightAnkle`"],
            ),
            damage(
                "one joint twice",
                "a.mvnx",
                with("jL5S1", "jLeftKnee"),
                &["`jLeftKnee` and `jLeftKnee` are both recognised as `left_knee`"],
            ),
            damage(
                "a joint too few",
                "a.mvnx",
                with("<joint label=\"jL5S1\"/>", ""),
                &["a.mvnx:11: `<jointAngle>` is a list of 15 numbers; allowed is 12, 3 of each of the 4 joints"],
            ),
            damage(
                "a word",
                "a.mvnx",
                with("40</jointAngle>", "ten</jointAngle>"),
                &["a.mvnx:11: `ten` is not a number"],
            ),
            damage(
                "infinite",
                "a.mvnx",
                with("40</jointAngle>", "inf</jointAngle>"),
                &["a.mvnx:11: `inf` is not finite"],
            ),
            damage(
                "angles twice",
                "a.mvnx",
                with("</jointAngle>", "</jointAngle><jointAngle>1</jointAngle>"),
                &["`<jointAngle>` is there twice in a frame"],
            ),
            damage(
                "no angles",
                "a.mvnx",
                small.replace("jointAngle", "jointAngleXZY"),
                &["`<jointAngle>` is missing in all 30 frames"],
            ),
            damage(
                "no times",
                "a.mvnx",
                small.replace(" time=", " tc=").replace("index=", "number="),
                &["`the time of the frames` is missing"],
            ),
            damage(
                "a time that is a word",
                "a.mvnx",
                with("time='10'", "time='now'"),
                &["a.mvnx:12: `time` is `now`; allowed is a number"],
            ),
            damage(
                "a rate of 0",
                "a.mvnx",
                with("frameRate=\"100\"", "frameRate=\"0\""),
                &["a.mvnx:2: `frameRate` is 0; allowed is above 0"],
            ),
            damage("one frame", "a.mvnx", file(frames(1)), &["1 rows of numbers; allowed are 2 or more"]),
            damage(
                "another root",
                "a.mvnx",
                "<a><mvnx></mvnx></a>",
                &["`the first element` is `<a>`; allowed is `<mvnx>`"],
            ),
            damage("nothing in it", "a.mvnx", "<mvnx/>", &["`<subject>` is missing"]),
        ],
        &ReadOptions::default(),
    );
}

/// Memory is for the four joints, not for the elements.
#[test]
fn a_long_file_takes_little_memory() {
    let text = file(frames(20_000));
    let (raw, held) = held(|| read(&text, &ReadOptions::default()).unwrap());
    assert_eq!(raw.time_s.len(), 20_000);
    assert!(held < 3 * text.len() as isize, "{held} bytes held for {}", text.len());
}

/// The CSV that MVN writes of the sheet of joint angles.
#[test]
fn csv_of_joint_angles_is_read_with_a_rate() {
    let walk = walk();
    let parts = ["Right Hip", "Right Knee", "Right Ankle", "Left Hip", "Left Knee"];
    for (delimiter, comma) in [(',', false), (';', true)] {
        let mut text = "Frame".to_owned();
        for part in parts {
            for plane in ["Abduction/Adduction", "Internal/External Rotation", "Flexion/Extension"] {
                text += &format!("{delimiter}{part} {plane}");
            }
        }
        for row in 0..walk.time_s().len() {
            let of = |which| joint(&walk, which)[row];
            let flexion = [of(Joint::RightHip), of(Joint::RightKnee), 5.0, of(Joint::LeftHip), of(Joint::LeftKnee)];
            let fields: String =
                flexion.iter().map(|angle| format!("{delimiter}1.5{delimiter}-2.5{delimiter}{angle}")).collect();
            text += &format!("\n{row}{}", if comma { fields.replace('.', ",") } else { fields });
        }
        text.push('\n');
        let error = read(&text, &ReadOptions::default()).unwrap_err();
        assert!(error.contains("column 1 `Frame`: the column counts frames; allowed is with the rate"), "{error}");
        let raw = read(&text, &ReadOptions { rate_hz: Some(150.0), ..ReadOptions::default() }).unwrap();
        for which in Joint::ALL {
            let found = raw.joints[which as usize].as_ref().unwrap();
            assert_eq!(found.angle_deg, joint(&walk, which));
            assert!(found.column.ends_with("Flexion/Extension"), "{}", found.column);
        }
    }
}

proptest! {
    #[test]
    fn nothing_panics(at in 0_usize..40_000, with in "[<>/&'\"= !\\[\\]a-z0-9.-]{0,12}", cut in 0_usize..60_000) {
        let at = at % GOOD.len();
        let end = (at + with.len()).min(GOOD.len());
        let text = [&GOOD.as_bytes()[..at], with.as_bytes(), &GOOD.as_bytes()[end..]].concat();
        let _ = open::of_bytes("a.mvnx", &text[..text.len().saturating_sub(cut % 30_000)], &ReadOptions::default());
    }
}
