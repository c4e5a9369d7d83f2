//! Every reader gives back the angles that were put into its file: a real walk, written in each format and dialect.

mod support;

use gait_trace::ReadOptions;
use gait_trace::format::angle_unit::AngleUnit;
use gait_trace::format::open;
use gait_trace::format::{csv_file, opensim};
use gait_trace::{Axis, RawJoints, Recording};
use joint_units::Joint;
use std::fmt::Write as _;
use support::c3d_writer::{C3d, Format};
use support::{Stand, angle_points, c3d_of_angles, calibration, centre_points, joint, mot, rate_hz, trc, volts, walk};

fn read(name: &str, bytes: &[u8]) -> RawJoints {
    open::of_bytes(name, bytes, &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// The largest difference of any joint, degrees; every joint is there and complete.
fn worst(raw: &RawJoints, walk: &Recording) -> f64 {
    assert_eq!(raw.time_s.len(), walk.time_s().len());
    let joints = Joint::ALL.into_iter().map(|which| {
        let found = raw.joints[which as usize].as_ref().unwrap_or_else(|| panic!("no {which:?} in {raw:?}"));
        assert_eq!(found.angle_deg.len(), walk.time_s().len());
        let off = found.angle_deg.iter().zip(joint(walk, which)).map(|(a, b)| (a - b).abs());
        off.fold(0.0, |worst, off| if off.is_nan() { f64::NAN } else { worst.max(off) })
    });
    joints.fold(0.0, |worst, off| if off.is_nan() { f64::NAN } else { worst.max(off) })
}

fn has_note(raw: &RawJoints, part: &str) -> bool {
    raw.notes.iter().any(|note| note.contains(part))
}

#[test]
fn our_own_files_are_read_to_the_bit() {
    let walk = walk();
    let mut bytes = Vec::new();
    csv_file::write_to(&mut bytes, &walk).unwrap();
    let raw = read("walk.csv", &bytes);
    assert_eq!(raw.time_s, walk.time_s());
    assert_eq!(worst(&raw, &walk), 0.0);
    assert!(raw.notes.is_empty(), "{:?}", raw.notes);
}

/// Cut after any byte of the last three rows, as by a program that is killed while it writes: the whole rows, and a note.
#[test]
fn a_last_row_that_is_cut_short_is_left_out() {
    let walk = walk();
    let mut bytes = Vec::new();
    csv_file::write_to(&mut bytes, &walk).unwrap();
    let ends: Vec<usize> = (0..bytes.len()).filter(|&at| bytes[at] == b'\n').collect();
    let mut left_out = 0;
    for at in ends[ends.len() - 4]..bytes.len() {
        let raw = read("walk.csv", &bytes[..at]);
        // Rows whose end, apart from the line end, is there. The first line is the header.
        let whole = ends.iter().filter(|&&end| end <= at).count() - 1;
        let rows = raw.time_s.len();
        let line = whole + 2;
        if raw.notes.contains(&format!("The last row is cut short (line {line}): it is left out.")) {
            left_out += 1;
            assert_eq!((rows, raw.notes.len()), (whole, 1), "{at}: {:?}", raw.notes);
        } else {
            let is_between = bytes[at - 1] == b'\n';
            // The last number of a row may be cut and still be one; a row without its line end may be whole.
            assert!(rows == whole && (is_between || bytes[at] == b'\n') || rows == whole + 1, "{at}: {:?}", raw.notes);
            assert_eq!(has_note(&raw, "its last number may be wrong"), !is_between, "{at}");
        }
        assert_eq!(raw.time_s[..whole], walk.time_s()[..whole]);
        for which in Joint::ALL {
            let found = &raw.joints[which as usize].as_ref().unwrap().angle_deg;
            assert_eq!(found[..whole], joint(&walk, which)[..whole]);
        }
    }
    assert!(left_out > 60, "{left_out}");
}

/// With quotes and decimal commas, in a column that is read and in one that is not.
#[test]
fn cuts_are_recognised_in_other_dialects() {
    let head = "t (s);note;knee (deg)\n0;a;1,5\n0,01;\"b;c\";2\n";
    for (row, rows) in [("0,02;\"d", 2), ("0,02;d", 2), ("0", 2), ("0,02;d;-", 2), ("0,02;d;1,5e", 2), ("0,02;d;1,", 3)]
    {
        let raw = read("a.csv", format!("{head}{row}").as_bytes());
        assert_eq!(raw.time_s.len(), rows, "{row}");
        assert_eq!(has_note(&raw, "The last row is cut short (line 4)"), rows == 2, "{row}: {:?}", raw.notes);
    }
    for whole in ["# a comment", "  ", ""] {
        let raw = read("a.csv", format!("{head}{whole}").as_bytes());
        assert!(!has_note(&raw, "cut short"), "{whole}: {:?}", raw.notes);
    }
}

#[test]
fn csv_of_anybody_has_any_names_delimiters_and_units() {
    let walk = walk();
    let write = |header: &str, delimiter: char, comma: bool, scale: f64, end: &str| {
        let mut text = header.to_owned();
        text.push_str(end);
        for (row, time) in walk.time_s().iter().enumerate() {
            let mut fields = vec![time.to_string(), "who knows".to_owned()];
            fields.extend(Joint::ALL.iter().map(|&which| (joint(&walk, which)[row] * scale).to_string()));
            let row = fields.join(&delimiter.to_string());
            text += &if comma { row.replace('.', ",") } else { row };
            text += end;
        }
        text
    };
    let radians = std::f64::consts::PI / 180.0;
    for (header, delimiter, comma, scale) in [
        ("Time (s),x,Left Hip [deg],Right Hip [deg],Left Knee [deg],Right Knee [deg]", ',', false, 1.0),
        ("t;note;LHipAngles (rad);RHipAngles (rad);LKneeAngles (rad);RKneeAngles (rad)", ';', true, radians),
        ("time_s\tz\tleft_hip_rad\tright_hip_rad\tleft_knee_rad\tright_knee_rad", '\t', false, radians),
        ("\u{feff}# a comment\n\n\"time\",\"a,b\",\"hip_l_deg\",hip_r_deg,knee_l_deg,knee_r_deg", ',', false, 1.0),
        ("time,note,hip_l,hip_r,knee_l,knee_r\ns,-,rad,rad,rad,rad", ',', false, radians),
    ] {
        for end in ["\n", "\r\n"] {
            let raw = read("walk.txt", write(header, delimiter, comma, scale, end).as_bytes());
            let off = worst(&raw, &walk);
            assert!(off < 1e-9, "{header}: {off}");
            assert!(!has_note(&raw, "unit of its angles"), "{:?}", raw.notes);
        }
    }
    // Nothing says the unit: the numbers do, and a note says so.
    for (scale, word) in [(1.0, "read as degrees"), (radians, "read as radians")] {
        let raw = read("walk.csv", write("time_s,x,lhip,rhip,lknee,rknee", ',', false, scale, "\n").as_bytes());
        assert!(worst(&raw, &walk) < 1e-9 && has_note(&raw, word), "{:?}", raw.notes);
    }
    // No header at all: everything by number.
    let mut how = ReadOptions::default();
    how.add_map("time=1,left_hip=3,right_hip=4,left_knee=5,right_knee=6").unwrap();
    how.unit = Some(AngleUnit::Degrees);
    let text = write("# by hand", ',', false, 1.0, "\n").replace("who knows", "7");
    let raw = open::of_bytes("walk.csv", text.as_bytes(), &how).unwrap();
    assert_eq!(worst(&raw, &walk), 0.0);
}

#[test]
fn a_csv_map_goes_before_names_and_gaps_are_missing_values() {
    let text = "time_ms,left_hip_deg,goni,right_knee_deg\n0,1,30,5\n10,,31,NaN\n20,3,nan,7\n";
    let mut how = ReadOptions::default();
    how.add_map("left_knee=goni,left_hip=4").unwrap();
    how.unit = Some(AngleUnit::Degrees);
    let raw = open::of_bytes("a.csv", text.as_bytes(), &how).unwrap();
    assert_eq!(raw.time_s, [0.0, 0.01, 0.02]);
    let column = |joint: Joint| raw.joints[joint as usize].as_ref().map(|found| found.column.as_str());
    assert_eq!(column(Joint::LeftHip), Some("right_knee_deg"));
    assert_eq!(column(Joint::LeftKnee), Some("goni"));
    assert_eq!(column(Joint::RightKnee), None, "a column that the map gave away is not taken again");
    let gaps = |joint: Joint| {
        raw.joints[joint as usize].as_ref().unwrap().angle_deg.iter().map(|v| v.is_nan()).collect::<Vec<_>>()
    };
    assert_eq!(gaps(Joint::LeftHip), [false, true, false]);
    assert_eq!(gaps(Joint::LeftKnee), [false, false, true]);
}

#[test]
fn lines_may_end_in_any_way() {
    let walk = walk();
    let mut csv = Vec::new();
    csv_file::write_to(&mut csv, &walk).unwrap();
    for text in [String::from_utf8(csv).unwrap(), mot(&walk, 2, "\t", false)] {
        for end in ["\r\n", "\r"] {
            let raw = read("walk", text.replace('\n', end).as_bytes());
            assert!(worst(&raw, &walk) < 1e-9, "{end:?}");
        }
    }
}

#[test]
fn opensim_of_all_versions_separators_and_units() {
    let walk = walk();
    for version in 1..=3 {
        for (separator, words) in [("\t", "tabs"), ("  ", "blanks")] {
            for in_degrees in [true, false] {
                let unit = if in_degrees { "degrees" } else { "radians" };
                for name in ["walk.mot", "walk.sto", "walk.dat"] {
                    let raw = read(name, mot(&walk, version, separator, in_degrees).as_bytes());
                    assert!(worst(&raw, &walk) < 1e-9);
                    assert_eq!(raw.format, format!("OpenSim motion, version {version}, {words}, {unit}"));
                }
            }
        }
    }
    // SIMM's own header, which says its counts in other words and its unit to people.
    let text = mot(&walk, 1, "\t", true);
    let (_, rows) = text.split_once("endheader\n").unwrap();
    let simm = format!(
        "name walk\ndatacolumns 6\ndatarows {}\nrange 0 2\nAngles are in degrees.\nendheader\n{rows}",
        walk.time_s().len()
    );
    let raw = read("walk.mot", simm.as_bytes());
    assert!(raw.format.contains("SIMM header") && has_note(&raw, "no `inDegrees`"), "{raw:?}");
    assert_eq!(worst(&raw, &walk), 0.0);
    // The sign is the file's.
    let flipped =
        mot(&walk, 1, "\t", true).replace("inDegrees", "x").replace("Units are", "Angles are in radians. Units are");
    let error = open::of_bytes("walk.mot", flipped.as_bytes(), &ReadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("wrong unit?"), "{error}");
}

/// The values of coordinates are read, their speeds of the same names are not.
#[test]
fn opensim_states_have_values_and_speeds() {
    let walk = walk();
    let mut text = String::from("states\nversion=1\nnRows=374\nnColumns=9\ninDegrees=no\nendheader\ntime");
    for path in
        ["hip_l/hip_flexion_l", "hip_r/hip_flexion_r", "walker_knee_l/knee_angle_l", "walker_knee_r/knee_angle_r"]
    {
        let _ = write!(text, "\t/jointset/{path}/value\t/jointset/{path}/speed");
    }
    for (row, time) in walk.time_s().iter().enumerate() {
        let _ = write!(text, "\n{time}");
        for which in Joint::ALL {
            let _ = write!(text, "\t{}\t-3.5", joint(&walk, which)[row].to_radians());
        }
    }
    text.push('\n');
    let raw = read("walk_states.sto", text.as_bytes());
    assert!(worst(&raw, &walk) < 1e-9 && raw.notes.is_empty(), "{:?}", raw.notes);
}

#[test]
fn what_is_written_as_mot_is_read_back_to_the_bit() {
    let walk = walk();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("walk.mot");
    opensim::write(&path, &walk).unwrap();
    let raw = open::read(&path, &ReadOptions::default()).unwrap();
    assert_eq!(raw.time_s, walk.time_s());
    assert_eq!(worst(&raw, &walk), 0.0);
    assert!(raw.notes.is_empty(), "{:?}", raw.notes);
    let volts = gait_trace::Channel::new("PA1", gait_trace::Quantity::PinVolts, vec![1.0, 1.1]);
    let volts = Recording::build(vec![0.0, 1.0], vec![volts]).unwrap();
    assert!(opensim::write(&path, &volts).unwrap_err().to_string().contains("`PA1` holds volts; allowed are angles"));
    assert!(opensim::write_to(&mut Vec::new(), "endheader", &walk).is_err());
    assert_eq!(worst(&open::read(&path, &ReadOptions::default()).unwrap(), &walk), 0.0, "the old file is still there");
}

#[test]
fn c3d_angles_of_all_processors_as_floats_and_integers() {
    let walk = walk();
    for (format, words) in [(Format::Intel, "Intel"), (Format::Dec, "DEC"), (Format::Mips, "MIPS")] {
        for (scale, numbers, bound) in [(None, "floats", 1e-5), (Some(0.01_f32), "integers", 0.0051)] {
            for analogs in [0, 7] {
                let mut file = c3d_of_angles(format, scale);
                file.analogs = analogs;
                let raw = read("walk.c3d", &file.bytes());
                assert_eq!(raw.format, format!("C3D, {words}, {numbers}, 150 Hz, joint angles"));
                let off = worst(&raw, &walk);
                assert!(off < bound, "{format:?} {scale:?}: {off}");
                assert!((raw.time_s[150] - 1.0).abs() < 1e-9);
            }
        }
    }
}

const AXES: [([f64; 3], [f64; 3]); 6] = [
    ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]),
    ([0.0, 0.0, 1.0], [0.0, -1.0, 0.0]),
    ([0.0, 1.0, 0.0], [1.0, 0.0, 0.0]),
    ([0.0, 1.0, 0.0], [0.0, 0.0, -1.0]),
    ([0.0, -1.0, 0.0], [0.0, 0.0, 1.0]),
    ([1.0, 0.0, 0.0], [0.0, 0.6, 0.8]),
];

#[test]
fn c3d_joint_centres_give_their_angles_for_every_up_axis() {
    let walk = walk();
    for (up, forward) in AXES {
        for step_mm in [0.0, 6.0] {
            for (format, scale) in [(Format::Intel, None), (Format::Dec, None), (Format::Mips, Some(0.1_f32))] {
                let stand = Stand { up, forward, step_mm, turn_deg: 0.0 };
                let file = C3d::new(format, scale, rate_hz(&walk), centre_points(&walk, stand));
                let raw = read("walk.c3d", &file.bytes());
                let off = worst(&raw, &walk);
                let bound = if scale.is_some() { 0.05 } else { 0.001 };
                assert!(off < bound, "{stand:?}: {off} degrees");
                let moves = if step_mm > 0.0 { "and the hips move that way" } else { "as on a treadmill" };
                assert!(has_note(&raw, moves) && has_note(&raw, "Up is"), "{:?}", raw.notes);
            }
        }
    }
}

#[test]
fn c3d_forward_turns_with_the_person() {
    let walk = walk();
    let stand = Stand { up: [0.0, 0.0, 1.0], forward: [1.0, 0.0, 0.0], step_mm: 8.0, turn_deg: 90.0 };
    let file = C3d::new(Format::Intel, None, rate_hz(&walk), centre_points(&walk, stand));
    let raw = read("walk.c3d", &file.bytes());
    assert!(has_note(&raw, "The person turns by up to 3"), "{:?}", raw.notes);
    // Where the window is whole, the mean over it is the direction in its middle; at the ends it lags by up to a quarter.
    let middle = 100..270;
    for which in Joint::ALL {
        let found = &raw.joints[which as usize].as_ref().unwrap().angle_deg;
        for frame in middle.clone() {
            let off = (found[frame] - joint(&walk, which)[frame]).abs();
            assert!(off < 0.1, "{which:?} frame {frame}: {off}");
        }
    }
}

#[test]
fn c3d_says_what_does_not_agree() {
    let walk = walk();
    let stand = Stand { up: [0.0, 0.0, 1.0], forward: [1.0, 0.0, 0.0], step_mm: 8.0, turn_deg: 0.0 };
    let mut file = C3d::new(Format::Intel, None, rate_hz(&walk), centre_points(&walk, stand));
    file.texts.push(("POINT", "Y_SCREEN", "+Y"));
    let raw = read("walk.c3d", &file.bytes());
    assert!(has_note(&raw, "POINT:Y_SCREEN names +Y and is ignored"), "{:?}", raw.notes);
    file.texts[0].2 = "+Z";
    assert!(has_note(&read("walk.c3d", &file.bytes()), "POINT:Y_SCREEN agrees"));
    // Left and right swapped: forward from the hips is then backward.
    for (name, _) in &mut file.points {
        *name = if name.starts_with('L') { name.replacen('L', "R", 1) } else { name.replacen('R', "L", 1) };
    }
    assert!(has_note(&read("walk.c3d", &file.bytes()), "left and right exchanged"));
}

#[test]
fn c3d_of_one_leg_needs_a_person_who_walks() {
    let walk = walk();
    let one_leg = |step_mm| {
        let stand = Stand { up: [0.0, 0.0, 1.0], forward: [0.0, 1.0, 0.0], step_mm, turn_deg: 0.0 };
        C3d::new(Format::Intel, None, 150.0, centre_points(&walk, stand).split_off(3)).bytes()
    };
    let raw = read("walk.c3d", &one_leg(8.0));
    assert!(raw.joints[0].is_none() && raw.joints[2].is_none());
    let knee = &raw.joints[3].as_ref().unwrap().angle_deg;
    assert!(knee.iter().zip(joint(&walk, Joint::RightKnee)).all(|(a, b)| (a - b).abs() < 0.001));
    let error = open::of_bytes("walk.c3d", &one_leg(0.0), &ReadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("the direction of walking does not follow from the trajectories"), "{error}");
}

#[test]
fn c3d_unseen_points_are_missing_and_markers_are_averaged() {
    let walk = walk();
    let mut file = c3d_of_angles(Format::Mips, Some(0.01));
    file.points[3].1[17] = None;
    let raw = read("walk.c3d", &file.bytes());
    let missing: Vec<usize> =
        (0..raw.time_s.len()).filter(|&n| raw.joints[2].as_ref().unwrap().angle_deg[n].is_nan()).collect();
    assert_eq!(missing, [17]);

    let stand = Stand { up: [0.0, 0.0, 1.0], forward: [1.0, 0.0, 0.0], step_mm: 0.0, turn_deg: 0.0 };
    let mut points = centre_points(&walk, stand);
    let knee = points.remove(1).1;
    for (name, y) in [("Anna:LKNE", 50.0), ("Anna:LMKNE", -50.0)] {
        points.push((name.into(), knee.iter().map(|place| place.map(|[x, old, z]| [x, old + y, z])).collect()));
    }
    points[1].1[40] = None;
    let raw = read("walk.c3d", &C3d::new(Format::Intel, None, 150.0, points).bytes());
    assert!(
        raw.joints[0].as_ref().unwrap().column.contains("LHJC, Anna:LKNE, Anna:LMKNE, LAJC")
            || has_note(&raw, "LKNE, LMKNE"),
        "{raw:?}"
    );
    let knee = &raw.joints[2].as_ref().unwrap().angle_deg;
    assert!(knee[40].is_nan() && (knee[41] - joint(&walk, Joint::LeftKnee)[41]).abs() < 0.001);
}

/// Flexion is the component that moves like a knee, whichever it is, of outputs without a name of Plug-in Gait; the caller's axis goes before it.
#[test]
fn c3d_angles_may_have_flexion_on_any_axis() {
    let walk = walk();
    for axis in Axis::ALL {
        let mut file = c3d_of_angles(Format::Intel, None);
        for (name, track) in file.points.iter_mut().skip(1) {
            *name = name.replace("Angles", "Angle");
            track.iter_mut().flatten().for_each(|point| point.swap(0, axis as usize));
        }
        let bytes = file.bytes();
        let raw = read("walk.c3d", &bytes);
        assert!(worst(&raw, &walk) < 1e-5);
        assert_eq!(raw.doubts, [gait_trace::Doubt::Component(axis)]);
        let asked = |axis: Axis| {
            let how = ReadOptions { axis: Some(axis), ..ReadOptions::default() };
            open::of_bytes("walk.c3d", &bytes, &how)
        };
        assert!(worst(&asked(axis).unwrap(), &walk) < 1e-5);
        // The other two components of these points are 3 and -4.
        let other = asked(Axis::ALL[(axis as usize + 1) % 3]);
        assert!(other.is_err() || worst(&other.unwrap(), &walk) > 20.0);
    }
    let how = ReadOptions { axis: Some(Axis::Y), ..ReadOptions::default() };
    let stand = Stand { up: [0.0, 0.0, 1.0], forward: [1.0, 0.0, 0.0], step_mm: 0.0, turn_deg: 0.0 };
    let centres = C3d::new(Format::Intel, None, 150.0, centre_points(&walk, stand)).bytes();
    for (name, bytes) in [("walk.c3d", centres), ("walk.mot", mot(&walk, 1, "\t", true).into_bytes())] {
        let error = open::of_bytes(name, &bytes, &how).unwrap_err().to_string();
        assert!(
            error.contains("an axis is given (`--axis`), but ") && error.contains("allowed is `--axis` for C3D"),
            "{error}"
        );
    }
}

#[test]
fn c3d_long_files_have_counts_and_names_in_parameters() {
    let frames = 70_000;
    let angle = |n: usize| (n as f32 * 0.01).sin() * 60.0 + 1.0;
    let points = vec![("LKneeAngles".to_owned(), (0..frames).map(|n| Some([angle(n), 0.0, 1.0])).collect())];
    let raw = read("long.c3d", &C3d::new(Format::Intel, None, 1000.0, points).bytes());
    assert_eq!(raw.time_s.len(), frames);
    assert!((raw.joints[2].as_ref().unwrap().angle_deg[69_999] - f64::from(angle(69_999))).abs() < 1e-6);

    let mut points: Vec<(String, Vec<Option<[f32; 3]>>)> =
        (0..300).map(|n| (format!("M{n}"), vec![Some([1.0, 2.0, 3.0]); 40])).collect();
    points.push(("RHipAngles".into(), vec![Some([25.0, 0.0, 0.0]); 40]));
    let raw = read("many.c3d", &C3d::new(Format::Intel, None, 100.0, points).bytes());
    assert_eq!(raw.joints[1].as_ref().unwrap().angle_deg, vec![25.0; 40]);
}

#[test]
fn c3d_sections_with_wrong_block_counts_are_read() {
    for blocks in [0, 1] {
        let mut points = angle_points(&walk());
        points
            .extend((0..60).map(|n| (format!("marker with a long name {n}"), points[0].1.clone())).collect::<Vec<_>>());
        // The names of joints last, so that what counts is behind the first block.
        points.rotate_left(5);
        let mut bytes = C3d::new(Format::Intel, None, 150.0, points).bytes();
        assert!(bytes[514] > 1);
        bytes[514] = blocks;
        assert!(worst(&read("walk.c3d", &bytes), &walk()) < 1e-5);
    }
}

#[test]
fn c3d_angles_go_before_joint_centres_and_the_map_before_both() {
    let walk = walk();
    let stand = Stand { up: [0.0, 0.0, 1.0], forward: [1.0, 0.0, 0.0], step_mm: 0.0, turn_deg: 0.0 };
    let mut points = angle_points(&walk);
    points.extend(centre_points(&walk, stand));
    points.push(("mine".into(), vec![Some([33.0, 0.0, 0.0]); walk.time_s().len()]));
    let bytes = C3d::new(Format::Intel, None, 150.0, points).bytes();
    let raw = read("walk.c3d", &bytes);
    assert!(raw.format.ends_with("joint angles") && worst(&raw, &walk) < 1e-5);
    let mut how = ReadOptions::default();
    how.add_map("left_hip=mine").unwrap();
    let raw = open::of_bytes("walk.c3d", &bytes, &how).unwrap();
    assert!(raw.joints[0].as_ref().unwrap().angle_deg.iter().all(|&angle| angle == 33.0));
    assert_eq!(raw.joints.iter().flatten().count(), 4, "the other joints are those of the only subject");
}

/// Two persons in one file: the map chooses angles of one, and markers have to be exported apart.
#[test]
fn c3d_of_several_subjects_is_refused_with_their_names() {
    let walk = walk();
    let mut points = angle_points(&walk);
    let other = angle_points(&walk).into_iter().map(|(name, places)| {
        let places = places.into_iter().map(|place| place.map(|[x, y, z]| [0.5 * x, y, z])).collect();
        (name.replace("Anna", "Bert"), places)
    });
    points.extend(other.skip(1));
    let bytes = C3d::new(Format::Intel, None, 150.0, points).bytes();
    let read_mapped = |map: &str| {
        let mut how = ReadOptions::default();
        if !map.is_empty() {
            how.add_map(map).unwrap();
        }
        open::of_bytes("walk.c3d", &bytes, &how).map_err(|error| error.to_string())
    };
    let error = read_mapped("").unwrap_err();
    assert!(
        error.contains("several subjects: `Anna`, `Bert`") && error.contains("`--map left_hip=Anna:LHipAngles`"),
        "{error}"
    );
    for (map, scale) in [("left_hip=Anna:LHipAngles", 1.0), ("right_knee=Bert:RKneeAngles", 0.5)] {
        let raw = read_mapped(map).unwrap();
        for which in Joint::ALL {
            let found = &raw.joints[which as usize].as_ref().unwrap().angle_deg;
            assert!(
                found.iter().zip(joint(&walk, which)).all(|(a, b)| (a - scale * b).abs() < 1e-4),
                "{map} {which:?}"
            );
        }
    }

    let stand = Stand { up: [0.0, 0.0, 1.0], forward: [1.0, 0.0, 0.0], step_mm: 8.0, turn_deg: 0.0 };
    let of = |subject: &str| {
        centre_points(&walk, stand)
            .into_iter()
            .map(|(name, places)| (format!("{subject}:{name}"), places))
            .collect::<Vec<_>>()
    };
    let both = C3d::new(Format::Intel, None, 150.0, [of("Anna"), of("Bert")].concat()).bytes();
    let error = open::of_bytes("walk.c3d", &both, &ReadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("markers of several subjects: `Anna`, `Bert`; allowed is one: export each"), "{error}");
    assert!(worst(&read("walk.c3d", &C3d::new(Format::Intel, None, 150.0, of("Anna")).bytes()), &walk) < 0.001);
}

/// Markers by forward kinematics from known angles, along every axis: the angles come back.
#[test]
fn trc_markers_give_the_angles_of_the_leg_that_they_are_from() {
    let walk = walk();
    for (up, forward) in AXES {
        for step_mm in [0.0, 6.0] {
            let stand = Stand { up, forward, step_mm, turn_deg: 0.0 };
            let mut points = centre_points(&walk, stand);
            points.push(("SACR".into(), points[0].1.clone()));
            let raw = read("walk.trc", trc(&points, 150.0).as_bytes());
            let off = worst(&raw, &walk);
            assert!(off < 0.001, "{stand:?}: {off} degrees");
            assert_eq!(raw.format, "TRC, 7 markers");
            assert!((raw.time_s[150] - 1.0).abs() < 1e-12 && has_note(&raw, "Up is"), "{:?}", raw.notes);
        }
    }
}

#[test]
fn trc_of_other_programs_names_markers_in_other_words() {
    let walk = walk();
    let stand = Stand { up: [0.0, 1.0, 0.0], forward: [1.0, 0.0, 0.0], step_mm: 6.0, turn_deg: 0.0 };
    for names in [
        ["LHip", "LKnee", "LAnkle", "RHip", "RKnee", "RAnkle"],
        ["LHJC_study", "L_knee_study", "L_ankle_study", "RHJC_study", "r_knee_study", "r_ankle_study"],
    ] {
        let mut points = centre_points(&walk, stand);
        points.iter_mut().zip(names).for_each(|(point, name)| point.0 = name.into());
        points[1].1[17] = None;
        points[5].1[20] = Some([0.0; 3]);
        let raw = read("walk.trc", trc(&points, 150.0).as_bytes());
        let missing = |joint: usize| -> Vec<usize> {
            (0..374).filter(|&n| raw.joints[joint].as_ref().unwrap().angle_deg[n].is_nan()).collect()
        };
        assert_eq!([0, 1, 2, 3].map(missing), [vec![17], vec![], vec![17], vec![20]], "{names:?}");
        let knee = &raw.joints[2].as_ref().unwrap().angle_deg;
        assert!((knee[100] - joint(&walk, Joint::LeftKnee)[100]).abs() < 0.001);
    }
    let text = trc(&centre_points(&walk, stand), 150.0).replace("\t374\t6\t", "\t400\t9\t");
    let raw = read("walk.trc", text.as_bytes());
    assert!(has_note(&raw, "`NumFrames` announces 400 frames, but the file has 374"), "{:?}", raw.notes);
    assert!(has_note(&raw, "`NumMarkers` announces 9 markers, but the file has 6"), "{:?}", raw.notes);
}

#[test]
fn oscilloscopes_of_all_dialects() {
    let walk = walk();
    let [left, right] = [Joint::LeftKnee, Joint::RightKnee].map(|which| joint(&walk, which));
    let times = walk.time_s();
    let rows = left.len();
    let step = times[1];
    let table = |time: bool, lead: &str, tail: &str| {
        let mut text = String::new();
        for n in 0..rows {
            let first = if time { format!("{:+.6E}", times[n]) } else { n.to_string() };
            let _ = writeln!(text, "{lead}{first},{:.6E},{:.6}{tail}", volts(left[n]), volts(right[n]));
        }
        text
    };
    let without_time: String = (0..rows).map(|n| format!("{},{}\n", volts(left[n]), volts(right[n]))).collect();
    let beside = |key: usize, n: usize| {
        let keys =
            ["Record Length,", "Sample Interval,6.67e-3", "Source,CH1", "Vertical Units,V", "Horizontal Units,s"];
        let key = if n == 0 {
            format!("Record Length,{rows}.0e+00")
        } else {
            keys.get(key).map_or(",".into(), |key| (*key).into())
        };
        format!("{key},,{:.9},{:.6},\n", times[n], volts(left[n]))
    };
    let tds: String = (0..rows).map(|n| beside(n, n)).collect();
    let files = [
        (
            "Rigol, start",
            format!("X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,0.0E+00,{step:E},\n{}", table(false, "", ",,")),
        ),
        ("Rigol, time", format!("X,CH1,CH2,\nSecond,Volt,Volt,\n{}", table(true, "", ","))),
        ("Rigol, t0", format!("Time(s),CH1(V),CH2(V),t0 = 0, tInc = {step},\n{}", table(true, "", ",,"))),
        ("Rigol, t0", format!("CH1V,CH2V,t0 =0.0, tInc = {step:e},\n{without_time}")),
        (
            "Siglent",
            format!(
                "Record Length,Analog:{rows},Digital:0\nSample Interval,Analog:{step},\nVertical Units,CH1:V,CH2:V\nHorizontal Units,s\nSource,CH1,CH2\nSecond,Value,Value\n{}",
                table(true, "", "")
            ),
        ),
        ("Siglent", format!("Source,CH1,CH2\nSecond,Volt,Volt\n{}", table(true, "", ""))),
        ("Tektronix, header", tds),
        (
            "Tektronix",
            format!(
                "Model,MDO3024\nFirmware Version,1.26\n\nWaveform Type,ANALOG,,\nHorizontal Units,s\nSample Interval,{step}\nRecord Length,{rows}\nVertical Units,V,V\n,,\nLabel,,\nTIME,CH1,CH2\n{}",
                table(true, "", "")
            ),
        ),
        ("Keysight", format!("x-axis,1,2\nsecond,Volt,Volt\n{}", table(true, "", ""))),
    ];
    let calibration = calibration();
    for (dialect, text) in files {
        let both = !dialect.ends_with("header");
        let mut how = ReadOptions { calibration: Some(&calibration), ..ReadOptions::default() };
        // A number is that of the column, with that of the time.
        let second = if text.starts_with("CH1V") { 2 } else { 3 };
        let map = if both { format!("left_knee=CH1,right_knee={second}") } else { "left_knee=5".to_owned() };
        how.add_map(&map).unwrap();
        for text in [text.clone(), text.replace('\n', "\r\n")] {
            let raw =
                open::of_bytes("scope.csv", text.as_bytes(), &how).unwrap_or_else(|error| panic!("{dialect}: {error}"));
            assert!(raw.format.starts_with(&format!("oscilloscope CSV ({dialect}")), "{}", raw.format);
            assert!(raw.time_s.iter().zip(times).all(|(a, b)| (a - b).abs() < 1e-3), "{dialect}");
            for (which, want) in [(2, left), (3, right)].into_iter().take(if both { 2 } else { 1 }) {
                let found = &raw.joints[which].as_ref().unwrap().angle_deg;
                let off = found.iter().zip(want).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(off < 1e-3 && found.len() == rows, "{dialect}: {off}");
            }
        }
        // Without the map, and without the table, there is nothing to be said.
        how.map.clear();
        let error = open::of_bytes("scope.csv", text.as_bytes(), &how).unwrap_err().to_string();
        assert!(error.contains("no channel is assigned to a joint; the file has `CH1`"), "{error}");
        how.add_map("left_knee=CH1").unwrap();
        how.calibration = None;
        let error = open::of_bytes("scope.csv", text.as_bytes(), &how).unwrap_err().to_string();
        assert!(error.contains("`CH1` is in volts; allowed is with a calibration that converts"), "{error}");
    }
}

#[test]
fn volts_in_a_csv_of_our_own_go_through_the_calibration() {
    let calibration = calibration();
    let mut how = ReadOptions { calibration: Some(&calibration), ..ReadOptions::default() };
    let text = format!("time_s,PA1\n0,{}\n0.01,{}\n0.02,3.0\n", volts(10.0), volts(20.0));
    let error = open::of_bytes("volts.csv", text.as_bytes(), &how).unwrap_err().to_string();
    assert!(error.contains("no channel is assigned to a joint; the file has `PA1`"), "{error}");
    how.add_map("left_knee=PA1").unwrap();
    let raw = open::of_bytes("volts.csv", text.as_bytes(), &how).unwrap();
    let knee = &raw.joints[2].as_ref().unwrap().angle_deg;
    assert!((knee[0] - 10.0).abs() < 1e-3 && (knee[1] - 20.0).abs() < 1e-3 && knee[2].is_nan());
    assert!(has_note(&raw, "1 of 3 values are outside of the calibration table (0.500 to 2.500 V)"), "{:?}", raw.notes);
}

#[test]
fn the_content_goes_before_the_extension() {
    let walk = walk();
    let text = mot(&walk, 1, "\t", true);
    assert!(read("walk.csv", text.as_bytes()).format.starts_with("OpenSim"));
    assert!(read("walk.c3d", text.as_bytes()).format.starts_with("OpenSim"));
    assert!(read("walk.csv", &c3d_of_angles(Format::Intel, None).bytes()).format.starts_with("C3D"));
    let mut csv = Vec::new();
    csv_file::write_to(&mut csv, &walk).unwrap();
    assert!(read("walk", &csv).format.starts_with("CSV"));
}
