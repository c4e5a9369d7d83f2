//! Markers of motion capture without joint angles: in the marker sets of the laboratories, as C3D and TRC, the angles come back that the
//! markers were placed by.

mod support;

use gait_trace::format::open;
use gait_trace::{RawJoints, ReadOptions};
use joint_units::Joint;
use support::c3d_writer::{C3d, Format};
use support::{Stand, centre_points, joint, trc, walk};

type Points = Vec<(String, Vec<Option<[f32; 3]>>)>;

/// A width of the pelvis for which the published equations put the hips of [`centre_points`], 160 mm apart, where they are.
const WIDTH_MM: f64 = (80.0 - 7.3) / 0.33;
const DEPTH_MM: f64 = 140.0;
const FORWARD: [f64; 3] = [0.0, -1.0, 0.0];
const UP: [f64; 3] = [0.0, 0.0, 1.0];

/// Names of left ASIS, right ASIS, back of the pelvis (one or two), knee and ankle (one or two each), left and right.
struct Set {
    asis: [&'static str; 2],
    back: &'static [&'static str],
    knees: [&'static [&'static str]; 2],
    ankles: [&'static [&'static str]; 2],
}

const SETS: [(&str, Set); 7] = [
    (
        "Plug-in Gait",
        Set {
            asis: ["LASI", "RASI"],
            back: &["LPSI", "RPSI"],
            knees: [&["LKNE"], &["RKNE"]],
            ankles: [&["LANK"], &["RANK"]],
        },
    ),
    (
        "Plug-in Gait with sacrum",
        Set { asis: ["LASI", "RASI"], back: &["SACR"], knees: [&["LKNE"], &["RKNE"]], ankles: [&["LANK"], &["RANK"]] },
    ),
    (
        "Helen Hayes",
        Set {
            asis: ["L.ASIS", "R.ASIS"],
            back: &["V.Sacral"],
            knees: [&["L.Knee"], &["R.Knee"]],
            ankles: [&["L.Ankle"], &["R.Ankle"]],
        },
    ),
    (
        "CAST, landmarks",
        Set {
            asis: ["LIAS", "RIAS"],
            back: &["LIPS", "RIPS"],
            knees: [&["LFLE", "LFME"], &["RFLE", "RFME"]],
            ankles: [&["LFAL", "LTAM"], &["RFAL", "RTAM"]],
        },
    ),
    (
        "CAST, letters",
        Set {
            asis: ["LASIS", "RASIS"],
            back: &["LPSIS", "RPSIS"],
            knees: [&["LLE", "LME"], &["RLE", "RME"]],
            ankles: [&["LLM", "LMM"], &["RLM", "RMM"]],
        },
    ),
    (
        "OpenSim, gait2392",
        Set {
            asis: ["L.ASIS", "R.ASIS"],
            back: &["V.Sacral"],
            knees: [&["L.Knee.Lat", "L.Knee.Med"], &["R.Knee.Lat", "R.Knee.Med"]],
            ankles: [&["L.Ankle.Lat", "L.Ankle.Med"], &["R.Ankle.Lat", "R.Ankle.Med"]],
        },
    ),
    (
        "OpenSim, OpenCap",
        Set {
            asis: ["L.ASIS_study", "r.ASIS_study"],
            back: &["L.PSIS_study", "r.PSIS_study"],
            knees: [&["L_knee_study", "L_mknee_study"], &["r_knee_study", "r_mknee_study"]],
            ankles: [&["L_ankle_study", "L_mankle_study"], &["r_ankle_study", "r_mankle_study"]],
        },
    ),
];

fn moved(from: [f32; 3], by: &[([f64; 3], f64)]) -> [f32; 3] {
    std::array::from_fn(|n| (f64::from(from[n]) + by.iter().map(|(vector, mm)| vector[n] * mm).sum::<f64>()) as f32)
}

/// The markers of a set around the joint centres of the walk, in a unit of so many millimetres. The pelvis is tilted forward by
/// `tilt_deg`; knees and ankles are 50 mm wide.
fn markers(set: &Set, tilt_deg: f64, unit_mm: f32) -> Points {
    let stand = Stand { up: UP, forward: FORWARD, step_mm: 6.0, turn_deg: 0.0 };
    let centres = centre_points(&walk(), stand);
    let (sin, cos) = tilt_deg.to_radians().sin_cos();
    let x: [f64; 3] = std::array::from_fn(|n| FORWARD[n] * cos - UP[n] * sin);
    let y: [f64; 3] = std::array::from_fn(|n| UP[n] * cos + FORWARD[n] * sin);
    // Right is forward times up.
    let z = [
        FORWARD[1] * UP[2] - FORWARD[2] * UP[1],
        FORWARD[2] * UP[0] - FORWARD[0] * UP[2],
        FORWARD[0] * UP[1] - FORWARD[1] * UP[0],
    ];
    let mut points: Points = Vec::new();
    let mut put = |name: &str, from: &[Option<[f32; 3]>], by: &[([f64; 3], f64)]| {
        let track = from.iter().map(|place| place.map(|place| moved(place, by).map(|value| value / unit_mm)));
        points.push((name.to_owned(), track.collect()));
    };
    for (leg, side) in [-1.0, 1.0].into_iter().enumerate() {
        let [hip, knee, ankle] = [0, 1, 2].map(|n| &centres[3 * leg + n].1);
        // The equations, solved for the middle of the ASIS.
        let to_middle = [(x, 0.24 * DEPTH_MM + 9.9), (y, 0.30 * WIDTH_MM + 10.9), (z, -side * 80.0)];
        let [left, back] = [side * WIDTH_MM / 2.0, -DEPTH_MM];
        put(set.asis[leg], hip, &[&to_middle[..], &[(z, left)]].concat());
        match set.back {
            [one] if leg == 0 => put(one, hip, &[&to_middle[..], &[(x, back)]].concat()),
            [_] => {}
            both => put(both[leg], hip, &[&to_middle[..], &[(x, back), (z, side * 45.0)]].concat()),
        }
        for (names, centre) in [(set.knees[leg], knee), (set.ankles[leg], ankle)] {
            for (name, out) in names.iter().zip([25.0, -25.0]) {
                put(name, centre, &[(z, side * out)]);
            }
        }
    }
    points
}

fn c3d(points: &Points, unit: Option<&'static str>) -> Vec<u8> {
    let mut file = C3d::new(Format::Intel, None, 150.0, points.clone());
    file.texts.extend(unit.map(|unit| ("POINT", "UNITS", unit)));
    file.bytes()
}

fn read(name: &str, bytes: &[u8]) -> Result<RawJoints, String> {
    open::of_bytes(name, bytes, &ReadOptions::default()).map_err(|error| error.to_string())
}

/// The largest difference from the walk, degrees.
fn off(raw: &RawJoints) -> f64 {
    let walk = walk();
    let joints = Joint::ALL.into_iter().map(|which| {
        let found = &raw.joints[which as usize].as_ref().unwrap_or_else(|| panic!("no {which:?}")).angle_deg;
        assert_eq!(found.len(), walk.time_s().len());
        found
            .iter()
            .zip(joint(&walk, which))
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, |a: f64, b| if b > a || b.is_nan() { b } else { a })
    });
    joints.fold(0.0, |a: f64, b| if b > a || b.is_nan() { b } else { a })
}

#[test]
fn every_marker_set_gives_the_angles_in_c3d_and_trc() {
    for (name, set) in &SETS {
        for (unit, mm) in [("mm", 1.0), ("m", 1000.0), ("cm", 10.0)] {
            let points = markers(set, 12.0, mm);
            let text = trc(&points, 150.0).replacen("\tmm\t", &format!("\t{unit}\t"), 1);
            for raw in [read("walk.c3d", &c3d(&points, Some(unit))), read("walk.trc", text.as_bytes())] {
                let raw = raw.unwrap_or_else(|error| panic!("{name}: {error}"));
                assert!(off(&raw) < 2e-3, "{name}, {unit}: {} degrees", off(&raw));
                let note = "The hips are computed from the pelvis (Harrington and others 2007), which is 220 mm wide and 140 mm deep.";
                assert_eq!(raw.notes.iter().filter(|found| *found == note).count(), 1, "{name}: {:?}", raw.notes);
                let used = raw.notes.iter().filter(|found| found.contains("are used as joint centres;")).count();
                assert_eq!(used, if set.knees[0].len() == 1 { 2 } else { 0 }, "{name}: {:?}", raw.notes);
            }
        }
    }
}

/// The file is written by ezc3d 1.7 for Python, which computed the places of its markers from the first rows of the walk.
#[test]
fn a_file_of_an_independent_writer_gives_the_walk() {
    let walk = walk();
    let raw = read("pig.c3d", include_bytes!("corpus/c3d/plug_in_gait_markers.c3d")).unwrap();
    assert_eq!((raw.format.as_str(), raw.time_s.len()), ("C3D, Intel, floats, 150 Hz, joint centres or markers", 24));
    for which in Joint::ALL {
        let found = &raw.joints[which as usize].as_ref().unwrap().angle_deg;
        for (n, (angle, wanted)) in found.iter().zip(joint(&walk, which)).enumerate() {
            let is_missing =
                n == 9 && matches!(which, Joint::LeftHip | Joint::LeftKnee | Joint::RightHip | Joint::RightKnee);
            assert_eq!(angle.is_nan(), is_missing, "{which:?} {n}");
            assert!(is_missing || (angle - wanted).abs() < 1e-3, "{which:?} {n}: {angle} {wanted}");
        }
    }
}

#[test]
fn a_hidden_marker_of_the_pelvis_hides_both_hips() {
    let mut points = markers(&SETS[0].1, 0.0, 1.0);
    let at = points.iter().position(|(name, _)| name == "RPSI").unwrap();
    points[at].1[33] = None;
    let raw = read("walk.c3d", &c3d(&points, Some("mm"))).unwrap();
    for found in raw.joints.iter().flatten() {
        assert!((0..374).all(|n| found.angle_deg[n].is_nan() == (n == 33)));
    }
}

#[test]
fn the_unit_of_length_is_named_or_follows_from_the_pelvis() {
    let set = &SETS[0].1;
    let raw = read("walk.c3d", &c3d(&markers(set, 5.0, 1000.0), None)).unwrap();
    assert!(off(&raw) < 2e-3);
    let note = "The file names no unit of length; m is read, because the anterior iliac spines are 0.220 apart.";
    assert!(raw.notes.iter().any(|found| found == note), "{:?}", raw.notes);
    for (unit, mm, words) in [
        ("mm", 1000.0, "`POINT:UNITS` is `mm`, in which the anterior iliac spines are 0.22"),
        ("m", 1.0, "allowed is a unit in which they are 100 to 450 mm apart"),
        ("feet", 1.0, "`POINT:UNITS` is `feet`; allowed is mm, cm or m"),
    ] {
        let error = read("walk.c3d", &c3d(&markers(set, 5.0, mm), Some(unit))).unwrap_err();
        assert!(error.starts_with("walk.c3d: ") && error.contains(words), "{error}");
    }
    // A joint centre needs no unit.
    let mut points = markers(set, 5.0, 1.0);
    let stand = Stand { up: UP, forward: FORWARD, step_mm: 6.0, turn_deg: 0.0 };
    points.extend(centre_points(&walk(), stand).into_iter().filter(|(name, _)| name.ends_with("HJC")));
    assert!(off(&read("walk.c3d", &c3d(&points, Some("feet"))).unwrap()) < 2e-3);
}

#[test]
fn a_pelvis_without_a_back_gives_no_hip() {
    let mut points = markers(&SETS[0].1, 0.0, 1.0);
    points.retain(|(name, _)| name != "LPSI");
    let error = read("walk.c3d", &c3d(&points, Some("mm"))).unwrap_err();
    assert!(
        error.contains("neither joint angles nor joint centres: the points are `LASI`")
            && error.contains("`SACR` for the hips"),
        "{error}"
    );
}

/// One point of a leg has another name: the note says which, and lists those of the file.
#[test]
fn a_point_with_another_name_is_named() {
    let (_, set) = &SETS[0];
    let points = markers(set, 0.0, 1.0);
    let renamed = |from: &str, to: &str| -> Vec<String> {
        let points: Points = points
            .iter()
            .map(|(name, track)| (if name == from { to.into() } else { name.clone() }, track.clone()))
            .collect();
        read("walk.c3d", &c3d(&points, Some("mm"))).unwrap().notes
    };
    let note = "The left leg is not found: on its side the counterparts of these points are missing: `RKNE`. The points of the file are `LASI`,";
    let notes = renamed("LKNE", "LKNE2");
    assert!(notes.iter().any(|found| found.starts_with(note) && found.contains("`LKNE2`")), "{notes:?}");
    let notes = renamed("RANK", "foot");
    assert!(
        notes.iter().any(|found| found.contains("The right leg is not found") && found.contains("missing: `LANK`.")),
        "{notes:?}"
    );
    assert!(!renamed("LKNE", "LKNE").iter().any(|found| found.contains("is not found")));
}
