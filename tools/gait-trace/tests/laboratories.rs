//! Text exports of gait laboratories: Vicon Nexus, Visual3D and GCD. The values of the corpus equal those of an independent reader, and
//! those of the recording that it was written from.
//!
//! The sums are those of pandas 2 in Python: `read_csv` of the section with its five header lines as column names (Nexus: `decimal=","`
//! for semicolons; Visual3D: `na_values=["NODATA"]`), and of GCD the first number of each line of a block; `math.fsum` of the values.

mod support;

use gait_trace::format::angle_unit::AngleUnit;
use gait_trace::format::open;
use gait_trace::stride::strides::segment;
use gait_trace::{Axis, Doubt, FindingKind, RawJoints, ReadOptions, Rules, condition};
use joint_units::Joint;
use std::path::Path;
use support::{joint, walk};

/// Rows of the recording in the files of Nexus and Visual3D.
const ROWS: usize = 24;

fn corpus(name: &str) -> Vec<u8> {
    std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus").join(name)).expect("a file of the corpus")
}

fn text(name: &str) -> String {
    String::from_utf8(corpus(name)).expect("text")
}

fn read(name: &str, bytes: &[u8], how: &ReadOptions<'_>) -> Result<RawJoints, String> {
    open::of_bytes(name, bytes, how).map_err(|error| error.to_string())
}

fn good(name: &str) -> RawJoints {
    read(name, &corpus(name), &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn mapped(map: &str) -> ReadOptions<'static> {
    let mut how = ReadOptions::default();
    how.add_map(map).expect("a map");
    how
}

fn at_rate(rate_hz: f64) -> ReadOptions<'static> {
    ReadOptions { rate_hz: Some(rate_hz), ..ReadOptions::default() }
}

fn values(raw: &RawJoints, which: Joint) -> &[f64] {
    &raw.joints[which as usize].as_ref().unwrap_or_else(|| panic!("no {which:?} in {raw:?}")).angle_deg
}

fn has_note(raw: &RawJoints, part: &str) -> bool {
    raw.notes.iter().any(|note| note.contains(part))
}

/// File, rows, last time, and of each joint: sign in the file, sum of its values, rows without one.
type Case = (&'static str, ReadOptions<'static>, [f64; 2], [(f64, f64, &'static [usize]); 4]);

#[test]
fn values_are_those_of_an_independent_reader() {
    const NONE: &[usize] = &[];
    let cases: [Case; 4] = [
        (
            "vicon/sections_bom_crlf.csv",
            ReadOptions::default(),
            [0.666_666_666_666_666_6, 0.82],
            [(1.0, 491.252, NONE), (1.0, -224.082, &[20]), (1.0, 255.998, &[5, 6]), (1.0, 664.281, NONE)],
        ),
        (
            "vicon/semicolons_decimal_commas.csv",
            ReadOptions::default(),
            [0.0, 0.153_333_333_333_333_32],
            [(1.0, 491.252, NONE), (1.0, -228.573, NONE), (1.0, 271.032, NONE), (1.0, 664.281, NONE)],
        ),
        (
            "vicon/tabs_one_subject.txt",
            ReadOptions::default(),
            [0.0, 0.153_333_333_333_333_32],
            [(1.0, 470.868, &[0]), (1.0, -228.573, NONE), (1.0, 271.032, NONE), (1.0, 664.281, NONE)],
        ),
        (
            "visual3d/time_and_markers.txt",
            ReadOptions::default(),
            [0.0, 0.15333],
            [(1.0, 491.252, NONE), (1.0, -203.353, &[7, 8]), (-1.0, -271.032, NONE), (-1.0, -613.656, &[23])],
        ),
    ];
    let walk = walk();
    for (name, how, times, joints) in cases {
        let raw = read(name, &corpus(name), &how).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!([raw.time_s[0], raw.time_s[ROWS - 1]], times, "{name}");
        for (which, (sign, sum, missing)) in Joint::ALL.into_iter().zip(joints) {
            let found = values(&raw, which);
            assert_eq!(found.len(), ROWS, "{name}");
            let known: f64 = found.iter().filter(|value| value.is_finite()).sum();
            assert!((known - sum).abs() < 1e-9, "{name} {which:?}: {known}");
            for (row, (value, recorded)) in found.iter().zip(joint(&walk, which)).enumerate() {
                assert_eq!(value.is_nan(), missing.contains(&row), "{name} {which:?} row {row}");
                assert!(value.is_nan() || *value == sign * recorded, "{name} {which:?} row {row}: {value}");
            }
        }
    }
    let raw = read("a.txt", &corpus("visual3d/frames.txt"), &at_rate(100.0)).unwrap();
    assert!(raw.time_s == (0..ROWS).map(|n| n as f64 / 100.0).collect::<Vec<_>>() && raw.joints[0].is_none());
    assert!((values(&raw, Joint::RightKnee).iter().sum::<f64>() + 664.281).abs() < 1e-9);
    assert!((values(&raw, Joint::RightHip).iter().sum::<f64>() + 228.573).abs() < 1e-9);
}

#[test]
fn what_vicon_leaves_open_is_said() {
    let raw = good("vicon/sections_bom_crlf.csv");
    assert_eq!(raw.format, "Vicon Nexus ASCII, commas, 150 Hz, 4 joints of 9 outputs");
    assert_eq!(
        raw.notes,
        [
            "The file also has the sections `Devices`, `Joints`, `Trajectories`; only `Model Outputs` is read.",
            "Flexion is read from component x of the angles, as Plug-in Gait defines it; `--axis` takes another.",
        ]
    );
    assert_eq!(raw.joints[0].as_ref().unwrap().column, "Anna:LHipAngles");
    // The unit is the file's, or the values'.
    let tabs = text("vicon/tabs_one_subject.txt");
    let radians = tabs.replace("deg", "rad");
    assert!(read("a.txt", radians.as_bytes(), &ReadOptions::default()).unwrap_err().contains("wrong unit?"));
    let raw = read("a.txt", tabs.replace("deg", "").as_bytes(), &ReadOptions::default()).unwrap();
    assert!(has_note(&raw, "names no unit of its angles; they are read as degrees"), "{:?}", raw.notes);
    let how = ReadOptions { unit: Some(AngleUnit::Degrees), ..ReadOptions::default() };
    assert!(has_note(
        &read("a.txt", radians.as_bytes(), &how).unwrap(),
        "as requested, although the file names radians"
    ));
    // Another axis is the caller's.
    let how = ReadOptions { axis: Some(Axis::Y), ..ReadOptions::default() };
    let raw = read("a.txt", tabs.as_bytes(), &how).unwrap();
    assert_eq!(values(&raw, Joint::RightKnee)[0], 73.75);
}

#[test]
fn sub_frames_are_between_frames() {
    let rows = "5,0,1,2,3\n5,1,2,2,3\n6,0,3,2,3\n6,1,4,2,3\n";
    let text = format!("Model Outputs\n200\n,,LKneeAngles,,\nFrame,Sub Frame,X,Y,Z\n,,deg,deg,deg\n{rows}");
    let raw = read("a.csv", text.as_bytes(), &ReadOptions::default()).unwrap();
    assert_eq!(raw.time_s, [0.04, 0.045, 0.05, 0.055]);
    assert!(
        has_note(&raw, "A frame has 2 sub frames; the rate of 200 Hz is that of the sub frames."),
        "{:?}",
        raw.notes
    );
}

/// Blank lines, spreadsheets that make all rows equally wide, sections with fields of other kinds, no row of units, decimal rates.
#[test]
fn sections_of_vicon_are_found_wherever_they_are() {
    let table = "Model Outputs,,,,,,\n119.88,,,,,,\n,,A:LKneeAngles,,,,\nFrame,Sub Frame,X,Y,Z,,\n,,deg,deg,deg,,\n1,0,5,1,1,,\n2,0,6,1,1,,\n";
    let events = "Events,,,,,,\n100,,,,,,\nSubject,Context,Name,Time (s),Description,,\nA,Left,Foot Strike,1.5,\"heel, left\",,\n,,,,,,\n";
    for (text, others) in [
        (table.to_owned(), false),
        (format!("\n\r\n,,,,,,\n{table}"), false),
        (format!("{events}{table},,,,,,\n,,,,,,\n{events}"), true),
        (format!("{table}Trajectories\n100\n,,A:LASI\n"), true),
        (format!("\u{feff}{table}"), false),
        (table.replace(",,deg,deg,deg,,\n", ""), false),
    ] {
        let how = ReadOptions { unit: Some(AngleUnit::Degrees), ..ReadOptions::default() };
        let raw = read("a.csv", text.as_bytes(), &how).unwrap_or_else(|error| panic!("{error}: {text}"));
        assert_eq!(raw.time_s, [0.0, 1.0 / 119.88]);
        assert_eq!(values(&raw, Joint::LeftKnee), [5.0, 6.0]);
        assert_eq!(has_note(&raw, "The file also has the sections"), others, "{:?}", raw.notes);
    }
}

#[test]
fn subjects_of_vicon_are_chosen_by_the_map() {
    let one = text("vicon/sections_bom_crlf.csv");
    // The left leg is Bert's.
    let two = one.replace("Anna:LHip", "Bert:LHip").replace("Anna:LKne", "Bert:LKne");
    let error = read("a.csv", two.as_bytes(), &ReadOptions::default()).unwrap_err();
    assert!(error.contains("the file has joint angles of several subjects: `Anna`, `Bert`; allowed is one"), "{error}");
    assert!(error.contains("`--map left_hip=Bert:LHipAngles`"), "{error}");
    let raw = read("a.csv", two.as_bytes(), &mapped("left_hip=Bert:LHipAngles")).unwrap();
    assert_eq!(raw.joints.each_ref().map(Option::is_some), [true, false, true, false]);
    let raw = read("a.csv", two.as_bytes(), &mapped("right_knee=Anna:RKneeAngles")).unwrap();
    assert_eq!(raw.joints.each_ref().map(Option::is_some), [false, true, false, true]);
}

#[test]
fn what_visual3d_leaves_open_is_said() {
    let raw = good("visual3d/time_and_markers.txt");
    assert_eq!(raw.format, "Visual3D text, 4 joints of 6 signals");
    assert_eq!(raw.doubts, [Doubt::Component(Axis::X)]);
    assert!(has_note(&raw, "names no unit of its angles; they are read as degrees"), "{:?}", raw.notes);
    let error = read("a.txt", &corpus("visual3d/frames.txt"), &ReadOptions::default()).unwrap_err();
    assert!(
        error.contains("a.txt:2: column 1 `ITEM`: the column counts frames") && error.contains("--rate HZ"),
        "{error}"
    );
    let error = read("a.txt", &corpus("visual3d/time_and_markers.txt"), &at_rate(100.0)).unwrap_err();
    assert!(error.contains("a rate is given (`--rate 100`), but the times of `TIME` differ from it"), "{error}");
    let raw = read("a.txt", &corpus("visual3d/time_and_markers.txt"), &at_rate(150.0)).unwrap();
    assert!(has_note(&raw, "`TIME` agrees with them within 0.0 ms"), "{:?}", raw.notes);
}

/// Tabs separate the fields, so decimal commas are unambiguous.
#[test]
fn decimal_commas_of_visual3d_are_read() {
    let (points, mut how) = (text("visual3d/time_and_markers.txt"), ReadOptions::default());
    let commas: String = points
        .split_inclusive('\n')
        .enumerate()
        .map(|(n, row)| if n < 5 { row.into() } else { row.replace('.', ",") })
        .collect();
    how.unit = Some(AngleUnit::Degrees);
    let (wanted, found) =
        (read("a.txt", points.as_bytes(), &how).unwrap(), read("a.txt", commas.as_bytes(), &how).unwrap());
    assert!(found.time_s == wanted.time_s && has_note(&found, "Numbers have decimal commas."), "{:?}", found.notes);
    for which in Joint::ALL {
        let same =
            values(&found, which).iter().zip(values(&wanted, which)).all(|(a, b)| a == b || (a.is_nan() && b.is_nan()));
        assert!(same, "{which:?}");
    }
}

/// A signal of Visual3D: recording, name, folder, value in row 0, number of rows.
type Signal<'a> = (&'a str, &'a str, &'a str, f64, usize);

/// A file of signals, each of three components that are `n + sign * 10`, `0` and `0` in row `n`; missing behind `rows`.
fn visual3d(signals: &[Signal<'_>]) -> String {
    let line = |first: &str, of: &dyn Fn(&Signal<'_>) -> [String; 3]| {
        let fields: Vec<String> = signals.iter().flat_map(of).collect();
        format!("{first}\t{}\n", fields.join("\t"))
    };
    let same = |text: &str| [text.to_owned(), text.to_owned(), text.to_owned()];
    let mut text = line("", &|signal| same(signal.0)) + &line("", &|signal| same(signal.1));
    text += &line("", &|_| same("LINK_MODEL_BASED"));
    text += &(line("", &|signal| same(signal.2)) + &line("ITEM", &|_| ["X", "Y", "Z"].map(str::to_owned)));
    for n in 0..30 {
        text += &line(&(n + 1).to_string(), &|&(_, _, _, base, rows)| match n < rows {
            true => [(n as f64 + base).to_string(), "0".into(), "0".into()],
            false => same(""),
        });
    }
    text
}

#[test]
fn recordings_ranges_and_folders_of_visual3d_are_chosen_by_the_map() {
    let two = visual3d(&[
        ("C:\\a\\one.c3d", "Left Hip Angle", "ORIGINAL", 10.0, 30),
        ("C:\\a\\one.c3d", "Left Knee Angle", "ORIGINAL", 20.0, 30),
        ("C:\\a\\two.c3d", "Left Hip Angle", "ORIGINAL", 30.0, 25),
        ("C:\\a\\two.c3d", "Left Knee Angle", "ORIGINAL", 40.0, 25),
    ]);
    let rate_and_map = |map: &str| ReadOptions { rate_hz: Some(100.0), ..mapped(map) };
    let error = read("a.txt", two.as_bytes(), &at_rate(100.0)).unwrap_err();
    assert!(error.contains("several recordings, ranges or folders: `one.c3d`, `two.c3d`; allowed is one"), "{error}");
    assert!(error.contains("`--map left_hip=one.c3d:Left Hip Angle`"), "{error}");
    let raw = read("a.txt", two.as_bytes(), &rate_and_map("left_knee=two.c3d:Left Knee Angle")).unwrap();
    assert_eq!(
        (raw.time_s.len(), values(&raw, Joint::LeftHip)[24], values(&raw, Joint::LeftKnee)[0]),
        (25, 54.0, 40.0)
    );
    assert!(
        has_note(&raw, "The recording ends before line 31; the last 5 rows have no value of it."),
        "{:?}",
        raw.notes
    );
    // Two ranges of one recording have the same names.
    let ranges = two.replace("two.c3d", "one.c3d");
    let error = read("a.txt", ranges.as_bytes(), &at_rate(100.0)).unwrap_err();
    assert!(error.contains("`one.c3d#1`, `one.c3d#2`"), "{error}");
    let raw = read("a.txt", ranges.as_bytes(), &rate_and_map("left_hip=one.c3d#2:left hip angle")).unwrap();
    assert_eq!((values(&raw, Joint::LeftHip)[0], values(&raw, Joint::LeftKnee)[0]), (30.0, 40.0));
    // Filtered and unfiltered signals are in two folders.
    let folders = visual3d(&[
        ("one.c3d", "Left Hip Angle", "ORIGINAL", 10.0, 30),
        ("one.c3d", "Left Hip Angle", "PROCESSED", 20.0, 30),
    ]);
    let error = read("a.txt", folders.as_bytes(), &at_rate(100.0)).unwrap_err();
    assert!(error.contains("`ORIGINAL`, `PROCESSED`"), "{error}");
    let raw = read("a.txt", folders.as_bytes(), &rate_and_map("left_hip=PROCESSED:Left Hip Angle")).unwrap();
    assert_eq!(values(&raw, Joint::LeftHip)[0], 20.0);
}

/// A signal of 101 points over the cycle: the rate of 100 makes it run from 0 to 1.
#[test]
fn a_normalised_signal_of_visual3d_is_a_cycle() {
    let mut text = String::from("\tone.c3d\n\tLeft Knee Angle\n\tLINK_MODEL_BASED\n\tPROCESSED\nITEM\tX\n");
    let angle = |n: usize| 30.0 - 28.0 * (n as f64 / 100.0 * std::f64::consts::TAU).cos();
    (0..=100).for_each(|n| text += &format!("{}\t{}\n", n + 1, angle(n)));
    let raw = read("a.txt", text.as_bytes(), &at_rate(100.0)).unwrap();
    assert_eq!((raw.time_s[0], raw.time_s[100]), (0.0, 1.0));
    let done = condition(&raw, &Rules { stride_s: Some(1.2), ..Rules::default() }).unwrap();
    assert!(done.normalised_cycle && (done.recording.duration_s() - 1.2).abs() < 1e-9);
}

/// The rows of the recording that are the points of the stride in the GCD files.
fn stride(which: Joint, start: usize) -> Vec<f64> {
    let walk = walk();
    let values = joint(&walk, which);
    (0..51).map(|n| values[start + (f64::from(n) * 164.0 / 50.0).round() as usize]).collect()
}

#[test]
fn a_cycle_of_gcd_is_on_the_time_of_the_left_leg() {
    let raw = good("gcd/both_legs.gcd");
    assert_eq!(raw.format, "GCD, one normalised gait cycle of 51 points, 4 joints of 10 blocks");
    assert_eq!(raw.time_s, (0..51).map(|n| f64::from(n) / 50.0).collect::<Vec<_>>());
    for (which, sum) in [(Joint::LeftHip, 391.983), (Joint::LeftKnee, 1183.222)] {
        let found = values(&raw, which);
        assert!((found.iter().sum::<f64>() - sum).abs() < 1e-9 && found == stride(which, 0), "{which:?}");
    }
    // 49.39 % of 50 steps are 25 steps; the last point of the file is the first again.
    for (which, sum, last) in [(Joint::RightHip, 488.074, 22.711), (Joint::RightKnee, 1287.532, 3.35)] {
        let (found, own) = (values(&raw, which), stride(which, 81));
        assert_eq!(own[50], last);
        assert!((0..51).all(|n| found[n] == own[(n + 25) % 50]), "{which:?}");
        assert!((found[..50].iter().sum::<f64>() + last - sum).abs() < 1e-9);
    }
    for part in [
        "one gait cycle of 51 points, from initial contact to initial contact; the time runs from 0 to 1",
        "`LeftStrideTime` of the file is 1.093: `--stride-time 1.093` gives the cycle that duration",
        "begins at 49.4 % of that of the left leg (by `LeftOppositeFootContact`); it is moved there, by 25 of 50 points",
        "names no unit of its angles; they are read as degrees",
    ] {
        assert!(has_note(&raw, part), "no `{part}` in {:?}", raw.notes);
    }
    // Named as a cycle, as those of OpenSim are; with its duration it is one stride, of legs that are opposed.
    let done = condition(&raw, &Rules::default()).unwrap();
    assert!(done.normalised_cycle);
    let found = |kind: FindingKind| done.findings.iter().any(|finding| finding.what == kind);
    assert!(found(FindingKind::NormalisedCycle), "{:?}", done.findings);
    assert!(!done.findings.iter().any(|finding| matches!(finding.what, FindingKind::NotOpposed { .. })));
    let walk = segment(&condition(&raw, &Rules { stride_s: Some(1.093), ..Rules::default() }).unwrap()).unwrap();
    assert!((walk.period_s - 1.093).abs() < 1e-9 && walk.spans.len() == 1, "{}", walk.period_s);
}

#[test]
fn the_right_cycle_of_gcd_is_moved_by_what_the_file_has() {
    let both = text("gcd/both_legs.gcd");
    for (from, to, moved) in [
        (
            "!LeftOppositeFootContact",
            "!RightOppositeFootContact",
            "begins at 50.6 % of that of the left leg (by `Right",
        ),
        ("!LeftOppositeFootContact", "!LeftOther", "begins at 50.0 % of that of the left leg (assumed, because"),
        ("49.390", "40.0", "by 20 of 50 points"),
    ] {
        let raw = read("a.gcd", both.replace(from, to).as_bytes(), &ReadOptions::default()).unwrap();
        assert!(has_note(&raw, moved), "{:?}", raw.notes);
    }
    // The right foot's contact, the first point of its cycle, is at that part of the left cycle.
    let raw = read("a.gcd", both.replace("49.390", "40.0").as_bytes(), &ReadOptions::default()).unwrap();
    let (found, own) = (values(&raw, Joint::RightHip), stride(Joint::RightHip, 81));
    assert!(found[20] == own[0] && found[21] == own[1] && found[0] == own[30] && found[50] == own[30]);
    // One leg stays as it is.
    let right = both.replace("!LeftHip", "!Hip_").replace("!LeftKneeFlexExt 1", "!Knee_ 1");
    let raw = read("a.gcd", right.as_bytes(), &ReadOptions::default()).unwrap();
    assert!(values(&raw, Joint::RightHip) == stride(Joint::RightHip, 81) && !has_note(&raw, "is moved"));
}

#[test]
fn a_mean_cycle_of_gcd_is_that_of_one_leg() {
    let raw = good("gcd/mean_and_deviation.gcd");
    for (which, sum) in [(Joint::LeftHip, 391.983), (Joint::LeftKnee, 1183.222)] {
        assert!((values(&raw, which).iter().sum::<f64>() - sum).abs() < 1e-9);
    }
    assert!(has_note(&raw, "`HipFlexExt`, `KneeFlexExt` name no side; they are read as those of the left leg."));
    assert!(has_note(&raw, "such as a deviation; only the first is read") && has_note(&raw, "`--stride-time 1.11`"));
    let how = ReadOptions { sideless: Some(Joint::RightKnee), ..ReadOptions::default() };
    let raw = read("a.gcd", &corpus("gcd/mean_and_deviation.gcd"), &how).unwrap();
    assert!(raw.joints[0].is_none() && raw.joints[1].is_some() && raw.joints[3].is_some());
    // The content decides, and the extension where the content does not.
    assert!(read("a.csv", &corpus("gcd/both_legs.gcd"), &ReadOptions::default()).is_ok());
    let bare = text("gcd/both_legs.gcd").replacen("#!DST-0.1 GCD Oxford Metrics\r\n", "", 1);
    assert!(read("a.gcd", bare.as_bytes(), &ReadOptions::default()).is_ok());
}
