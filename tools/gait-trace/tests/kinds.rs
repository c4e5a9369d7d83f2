//! Kinds of files that were read wrong, or refused without need: for each kind many files, made from a walk.

mod support;
mod synthetic;

use gait_trace::format::open;
use gait_trace::stride::strides::segment;
use gait_trace::{
    Conditioned, Doubt, Finding, FindingKind, Level, PositiveDirection, RawJoints, ReadOptions, Rules, SignBasis,
    condition,
};
use joint_units::Joint;
use proptest::prelude::*;
use std::fmt::Write as _;
use support::c3d_writer::{C3d, Format};
use synthetic::angle;

const RATE_HZ: f64 = 100.0;
const PERIOD_S: f64 = 1.1;
const LABS: [&str; 4] = ["LHipAngles", "RHipAngles", "LKneeAngles", "RKneeAngles"];

fn read_as(name: &str, bytes: &[u8], how: &ReadOptions<'_>) -> Result<RawJoints, String> {
    open::of_bytes(name, bytes, how).map_err(|error| error.to_string())
}

fn read(name: &str, bytes: &[u8]) -> Result<RawJoints, String> {
    read_as(name, bytes, &ReadOptions::default())
}

fn in_degrees() -> ReadOptions<'static> {
    ReadOptions { unit: Some("degrees".parse().unwrap()), ..ReadOptions::default() }
}

fn plain(raw: &RawJoints) -> Conditioned {
    condition(raw, &Rules::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn warnings(done: &Conditioned) -> Vec<String> {
    done.findings.iter().filter(|finding| finding.level() >= Level::Warning).map(Finding::to_string).collect()
}

/// The angle of a joint at a row of the walk.
fn at(joint: Joint, row: usize) -> f64 {
    angle(joint, row as f64 / RATE_HZ / PERIOD_S)
}

/// An OpenSim table of the walk: title, lines of the header, and further columns of which each row has a number.
fn sto(title: &str, header: &str, more: &[(&str, &dyn Fn(usize) -> f64)], scale: f64) -> String {
    let names = ["hip_flexion_l", "hip_flexion_r", "knee_angle_l", "knee_angle_r"];
    let headings: Vec<&str> = more.iter().map(|(name, _)| *name).chain(names).collect();
    let mut text = format!(
        "{title}\nversion=1\nnRows=400\nnColumns={}\n{header}\nendheader\ntime\t{}\n",
        5 + more.len(),
        headings.join("\t")
    );
    for row in 0..400 {
        let _ = write!(text, "{}", row as f64 / RATE_HZ);
        more.iter().for_each(|(_, number)| text += &format!("\t{}", number(row)));
        Joint::ALL.iter().for_each(|joint| text += &format!("\t{}", scale * at(*joint, row)));
        text.push('\n');
    }
    text
}

const OTHERS: [&str; 36] = [
    "controls",
    "Static Optimization",
    "StaticOptimization",
    "Muscle Activations",
    "activation",
    "Excitations",
    "PositionErrors",
    "Coordinate errors",
    "IK marker errors",
    "Speeds",
    "Generalized speeds",
    "Velocities",
    "angular velocity",
    "Accelerations",
    "Coordinate accelerations",
    "udot",
    "Kinematics_dudt",
    "Inverse Dynamics Generalized Forces",
    "Inverse Dynamics",
    "Joint Reaction Loads",
    "Joint moments",
    "Net joint moments",
    "Torques",
    "joint_torques",
    "ActuatorForces",
    "Actuation_power",
    "ActuatorSpeeds",
    "Powers",
    "Joint work",
    "Residuals",
    "reserve actuators",
    "Ground reaction forces",
    "EMG",
    "Moment arms",
    "Joint stiffness",
    "Kinematics_u",
];

#[test]
fn a_table_of_another_quantity_is_no_table_of_angles() {
    let force = |row: usize| 700.0 + 50.0 * (row as f64 * 0.1).sin();
    let height = |row: usize| 0.93 + 0.02 * (row as f64 * 0.1).sin();
    let speed = |row: usize| 0.2 * (row as f64 * 0.1).sin();
    let small = 1_f64.to_radians();
    for title in OTHERS {
        for (header, scale) in [("inDegrees=no", small), ("inDegrees=no", 0.4 * small)] {
            for more in [
                &[][..],
                &[("pelvis_ty", &force as &dyn Fn(usize) -> f64)],
                &[("pelvis_ty", &speed), ("ankle_angle_r", &speed)],
            ] {
                let text = sto(title, header, more, scale);
                let error = read("a.sto", text.as_bytes()).unwrap_err();
                assert!(
                    error.starts_with("a.sto:1: ")
                        && error.contains(&format!("`{title}`"))
                        && error.contains("allowed are"),
                    "{error}"
                );
            }
        }
    }
    // Most are named so plainly that neither a height of the pelvis nor a unit in degrees makes them angles.
    let named = OTHERS.iter().filter(|title| {
        let text = sto(title, "inDegrees=yes", &[("pelvis_ty", &height)], 1.0);
        read("a.sto", text.as_bytes()).is_err() && read_as("a.sto", text.as_bytes(), &in_degrees()).is_err()
    });
    assert!(named.count() >= 32);
}

#[test]
fn what_says_angles_is_enough() {
    let height = |row: usize| 0.93 + 0.02 * (row as f64 * 0.1).sin();
    let any = |row: usize| row as f64;
    let small = 1_f64.to_radians();
    let doubts = |text: &str| read("a.mot", text.as_bytes()).unwrap_or_else(|error| panic!("{error}")).doubts;
    for title in [
        "Coordinates",
        "inverse kinematics",
        "q",
        "Generalized coordinates",
        "Joint angles",
        "ik trial",
        "IK results subject01",
    ] {
        for (header, scale) in [("inDegrees=yes", 1.0), ("inDegrees=no", small), ("Angles are in radians.", small)] {
            assert_eq!(doubts(&sto(title, header, &[], scale)), [], "{title}");
        }
    }
    let speeds: Vec<(&str, &dyn Fn(usize) -> f64)> =
        ["hip_flexion_l_u", "hip_flexion_r_u", "knee_angle_l_u", "knee_angle_r_u"].map(|name| (name, &any as _)).into();
    for title in ["subject01_walk1", "walk at controlled speed", "Control 3", "states", "Results", "first trial"] {
        assert_eq!(doubts(&sto(title, "inDegrees=no", &[("pelvis_ty", &height)], small)), [], "{title}");
        assert_eq!(doubts(&sto(title, "inDegrees=no", &speeds, small)), [], "{title}");
        let paths = sto(title, "inDegrees=no", &[], small);
        let paths = ["hip_flexion_l", "hip_flexion_r", "knee_angle_l", "knee_angle_r"]
            .iter()
            .fold(paths, |text, name| text.replacen(&format!("\t{name}"), &format!("\t/jointset/a/{name}/value"), 1));
        assert_eq!(doubts(&paths), [], "{title}");
    }
    // A trial of which only the unit is known is a guess in degrees, and asked for in radians.
    let named = sto("subject01_walk1", "inDegrees=yes", &[], 1.0);
    assert_eq!(doubts(&named), [Doubt::Quantity]);
    let raw = read("a.mot", named.as_bytes()).unwrap();
    assert!(warnings(&plain(&raw)).iter().any(|line| line.contains("`--unit degrees` confirms it")));
    assert_eq!(read_as("a.mot", named.as_bytes(), &in_degrees()).unwrap().doubts, []);
    let radians = sto("subject01_walk1", "inDegrees=no", &[], small);
    assert!(read("a.mot", radians.as_bytes()).unwrap_err().contains("`--unit degrees|radians`"));
    let how = ReadOptions { unit: Some("radians".parse().unwrap()), ..ReadOptions::default() };
    assert!(read_as("a.mot", radians.as_bytes(), &how).is_ok());
}

/// The walk as a table of commas; the knees and hips may have any headings.
fn csv(above: &str, headings: &str) -> String {
    let mut text = format!("{above}{headings}\n");
    for row in 0..400 {
        let _ = write!(text, "{}", row as f64 / RATE_HZ);
        Joint::ALL.iter().for_each(|joint| text += &format!(",{:.4}", at(*joint, row)));
        text.push('\n');
    }
    text
}

const HEADER: &str = "time_s,left_hip_deg,right_hip_deg,left_knee_deg,right_knee_deg";

#[test]
fn a_title_above_a_header_that_names_another_quantity_is_not_dropped() {
    for headings in [HEADER, "time,left hip,right hip,left knee,right knee"] {
        for above in [
            "Joint moments\n",
            "Net joint torques of trial 3\n\n",
            "Max,born 1970\nQuantity: joint power\n",
            "Units,Nm\n",
            "\"Muscle activations\",,,,\n",
        ] {
            let text = csv(above, headings);
            let error = read("a.csv", text.as_bytes()).unwrap_err();
            assert!(error.contains("and not joint angles") && error.contains("--unit degrees|radians"), "{error}");
            assert!(read_as("a.csv", text.as_bytes(), &in_degrees()).is_ok());
        }
        for above in ["Joint angles\n", "Max Mustermann\nSpeed: 1.2 m/s\nForce plates,2\n", "Walk 3\nRate,100\n", ""] {
            assert!(read("a.csv", csv(above, headings).as_bytes()).is_ok(), "{above}");
        }
    }
}

/// A C3D file of Plug-in Gait: the three components of each joint.
fn c3d(component: impl Fn(Joint, usize) -> [f64; 3]) -> Vec<u8> {
    let points = Joint::ALL.into_iter().zip(LABS);
    let track = |joint| (0..400).map(|row| Some(component(joint, row).map(|x| x as f32))).collect();
    let points = points.map(|(joint, name)| (name.to_owned(), track(joint))).collect();
    let mut file = C3d::new(Format::Intel, None, RATE_HZ as f32, points);
    file.texts.push(("POINT", "ANGLE_UNITS", "deg"));
    file.bytes()
}

/// The same as CSV of components.
fn components(component: impl Fn(Joint, usize) -> [f64; 3]) -> Vec<u8> {
    let headings = LABS.iter().flat_map(|name| ["X", "Y", "Z"].map(|axis| format!("{name}_{axis} (deg)")));
    let mut text = format!("time_s,{}\n", headings.collect::<Vec<_>>().join(","));
    for row in 0..400 {
        let _ = write!(text, "{}", row as f64 / RATE_HZ);
        for joint in Joint::ALL {
            component(joint, row).iter().for_each(|x| text += &format!(",{x}"));
        }
        text.push('\n');
    }
    text.into_bytes()
}

fn is_knee(joint: Joint) -> bool {
    matches!(joint, Joint::LeftKnee | Joint::RightKnee)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    /// Stiff knees that rotate, locked knees, and knees with recurvatum, one or both: x, with the file's sign.
    #[test]
    fn plug_in_gait_defines_component_and_sign(
        size in [0.0_f64..1.0, 0.0_f64..1.0], middle in [-12.0_f64..25.0, -12.0_f64..25.0], rotation in 0.0_f64..0.55, is_turned: [bool; 2],
    ) {
        let turn = is_turned.map(|turned| if turned { -1.0 } else { 1.0 });
        let knee = |joint: Joint, row: usize| {
            let side = joint as usize % 2;
            // Turned, it overextends by up to 25 degrees.
            let size = if is_turned[side] { 0.6 * size[side] } else { size[side] };
            middle[side].max(if is_turned[side] { -2.0 } else { -12.0 }) + turn[side] * size * (at(joint, row) - 24.0)
        };
        let x = |joint: Joint, row: usize| if is_knee(joint) { knee(joint, row) } else { at(joint, row) };
        let component = |joint: Joint, row: usize| [x(joint, row), 3.0, rotation * at(joint, row + 20)];
        for (name, bytes) in [("a.c3d", c3d(component)), ("a.csv", components(component))] {
            let raw = read(name, &bytes).unwrap();
            prop_assert!(raw.doubts.is_empty());
            let done = plain(&raw);
            for joint in Joint::ALL {
                let found = done.joint(joint).unwrap();
                prop_assert!((0..400).all(|row| (found[row] - x(joint, row)).abs() < 1e-3), "{name}: {joint:?} {:?}", done.findings);
                prop_assert_eq!(done.signs[joint as usize], Some(SignBasis::Known));
            }
        }
    }

    /// Of the knees of an OpenSim model one bends; the other one is locked, stiff or overextends. The model counts flexion or extension.
    #[test]
    fn one_sign_for_both_knees_of_a_model(
        size in 0.0_f64..0.5, middle in -8.0_f64..12.0, is_turned: bool, is_left: bool, counts_extension: bool,
    ) {
        let sign = if counts_extension { -1.0 } else { 1.0 };
        let other = if is_left { Joint::LeftKnee } else { Joint::RightKnee };
        let flexion = |joint: Joint, row: usize| match joint == other {
            true => middle + if is_turned { -size } else { size } * (at(joint, row) - 24.0),
            false => at(joint, row),
        };
        let mut text = String::from("Coordinates\nversion=1\nnRows=400\nnColumns=5\ninDegrees=yes\nendheader\ntime\thip_flexion_l\thip_flexion_r\tknee_angle_l\tknee_angle_r\n");
        for row in 0..400 {
            let _ = write!(text, "{}", row as f64 / RATE_HZ);
            Joint::ALL.iter().for_each(|joint| text += &format!("\t{}", if is_knee(*joint) { sign } else { 1.0 } * flexion(*joint, row)));
            text.push('\n');
        }
        let done = plain(&read("a.mot", text.as_bytes()).unwrap());
        for joint in Joint::ALL {
            let found = done.joint(joint).unwrap();
            prop_assert!((0..400).all(|row| (found[row] - flexion(joint, row)).abs() < 1e-3), "{joint:?} {:?}", done.findings);
        }
    }
}

#[test]
fn a_component_of_other_names_is_a_guess_and_another_model_is_asked_for() {
    let third = |joint: Joint, row: usize| [3.0 + 0.1 * at(joint, row), 2.0, at(joint, row)];
    let error = read("a.c3d", &c3d(third)).unwrap_err();
    assert!(
        error.contains("Plug-in Gait, whose names they have, defines it as x") && error.contains("`--axis x|y|z`"),
        "{error}"
    );
    let z = ReadOptions { axis: Some(gait_trace::options::Axis::Z), ..ReadOptions::default() };
    assert!(read_as("a.c3d", &c3d(third), &z).is_ok());
    let other = String::from_utf8(components(third)).unwrap();
    let other = LABS
        .iter()
        .zip(["l_hip_angle", "r_hip_angle", "l_knee_angle", "r_knee_angle"])
        .fold(other, |text, (a, b)| text.replace(a, b));
    let raw = read("a.csv", other.as_bytes()).unwrap();
    assert_eq!(raw.doubts, [Doubt::Component(gait_trace::options::Axis::Z)]);
    assert!(warnings(&plain(&raw)).iter().any(|line| line.contains("`--axis z` confirms it")));
}

#[test]
fn a_sign_of_knees_by_their_shape_alone_is_a_guess() {
    for sign in [1.0, -1.0] {
        let raw = synthetic::raw(synthetic::times(4.0, RATE_HZ), |joint, t| {
            let x = angle(joint, t / PERIOD_S);
            if is_knee(joint) { sign * 0.3 * x } else { x }
        });
        let said = warnings(&plain(&raw));
        assert_eq!(
            said.iter().filter(|line| line.contains("by the shape of the strides, which is a guess")).count(),
            2,
            "{said:?}"
        );
        let right = if sign > 0.0 { PositiveDirection::Flexion } else { PositiveDirection::Extension };
        let done = condition(&raw, &Rules { knee_sign: Some(right), ..Rules::default() }).unwrap();
        assert_eq!(warnings(&done), [""; 0]);
    }
}

#[test]
fn interior_angles_are_named_and_no_sign_is_offered() {
    for most in [168.0, 176.0, 150.0] {
        let raw = synthetic::raw(synthetic::times(4.0, RATE_HZ), |joint, t| {
            let x = angle(joint, t / PERIOD_S);
            if is_knee(joint) { most - 0.6 * x } else { x }
        });
        let error = condition(&raw, &Rules::default()).unwrap_err().to_string();
        assert!(error.contains("subtract the angles from 180") && !error.contains("--knee-sign"), "{error}");
    }
}

/// One cycle of the walk, of which each leg may begin with its own contact.
fn cycle(heading: &str, points: usize, own: bool, lag: f64) -> String {
    let mut text = format!("{heading},left_hip_deg,right_hip_deg,left_knee_deg,right_knee_deg\n");
    for n in 0..points {
        let part = n as f64 / (points - 1) as f64;
        let _ = write!(text, "{}", 100.0 * part);
        for joint in Joint::ALL {
            let right = matches!(joint, Joint::RightHip | Joint::RightKnee);
            let phase = if right && own { part + 0.5 + lag } else { part + 0.23 * f64::from(u8::from(!own)) };
            text += &format!(",{:.4}", angle(joint, phase));
        }
        text.push('\n');
    }
    text
}

#[test]
fn percent_columns_have_many_names() {
    for heading in [
        "pct",
        "percent",
        "gait_cycle_percent",
        "gait_cycle_%",
        "% gait cycle",
        "Gait cycle [%]",
        "stride_pct",
        "cycle",
        "GaitCyclePercent",
        "%",
    ] {
        let raw = read("a.csv", cycle(heading, 101, false, 0.0).as_bytes())
            .unwrap_or_else(|error| panic!("{heading}: {error}"));
        let done = condition(&raw, &Rules { stride_s: Some(1.1), ..Rules::default() }).unwrap();
        assert!((done.recording.duration_s() - 1.1).abs() < 1e-9, "{heading}");
    }
    // Beside a time it is only a column.
    let text = csv("", HEADER).replace("time_s,", "time_s,percent_gait_cycle,");
    let row = |(n, row): (usize, &str)| if n == 0 { row.to_owned() } else { row.replacen(',', ",7,", 1) };
    let beside: String = text.lines().enumerate().map(|line| row(line) + "\n").collect();
    assert_eq!(read("a.csv", beside.as_bytes()).unwrap().time_s.len(), 400);
}

#[test]
fn legs_that_count_from_their_own_contact_are_moved_only_when_asked() {
    let own = Rules { own_cycles: true, ..Rules::default() };
    for points in [51, 100, 101, 201] {
        for lag in [0.0, 0.04, -0.06] {
            let raw = read("a.csv", cycle("percent", points, true, lag).as_bytes()).unwrap();
            let error = condition(&raw, &Rules::default()).unwrap_err().to_string();
            assert!(error.contains("in phase") && error.contains("`--own-cycles`"), "{error}");
            let done = condition(&raw, &own).unwrap();
            let right = done.joint(Joint::RightKnee).unwrap();
            for (n, found) in right.iter().enumerate() {
                let wanted = angle(Joint::RightKnee, n as f64 / (points - 1) as f64 + lag);
                assert!((found - wanted).abs() < 1.0, "{points} {n}: {found} {wanted}");
            }
            assert!(done.findings.iter().any(|finding| finding.what == FindingKind::OwnCycles));
        }
        let raw = read("a.csv", cycle("percent", points, false, 0.0).as_bytes()).unwrap();
        assert!(condition(&raw, &Rules::default()).is_ok());
        assert!(condition(&raw, &own).unwrap_err().to_string().contains("half a cycle apart as they are"));
    }
    let error = condition(&read("a.csv", csv("", HEADER).as_bytes()).unwrap(), &own).unwrap_err();
    assert!(error.to_string().contains("the time is not that of a cycle"), "{error}");
}

#[test]
fn one_leg_is_mirrored_only_when_asked() {
    let one = |leg: usize, raw: &RawJoints| {
        let mut raw = raw.clone();
        raw.joints[1 - leg] = None;
        raw.joints[3 - leg] = None;
        raw
    };
    let rules = Rules { mirror: true, ..Rules::default() };
    let both = read("a.csv", csv("", HEADER).as_bytes()).unwrap();
    for leg in [0, 1] {
        let raw = one(leg, &both);
        let error = segment(&plain(&raw)).unwrap_err().to_string();
        assert!(error.contains("`--mirror`"), "{error}");
        let done = condition(&raw, &rules).unwrap();
        let walk = segment(&done).unwrap();
        assert!((walk.period_s - PERIOD_S).abs() < 0.01 && walk.spans.len() >= 2, "{}", walk.period_s);
        for joint in [Joint::ALL[1 - leg], Joint::ALL[3 - leg]] {
            let found = done.joint(joint).unwrap();
            assert!((0..400).all(|row| (found[row] - at(joint, row)).abs() < 1.0), "{joint:?}");
            assert!(
                done.findings.iter().any(|f| f.joint == Some(joint) && matches!(f.what, FindingKind::Mirrored { .. }))
            );
        }
        let raw = one(leg, &read("a.csv", cycle("percent", 101, false, 0.0).as_bytes()).unwrap());
        assert!(segment(&condition(&raw, &rules).unwrap()).is_ok());
    }
    assert!(condition(&both, &rules).unwrap_err().to_string().contains("joints of both legs"));
}

/// Markers of a pelvis, knees and ankles.
fn markers() -> Vec<(String, Vec<Option<[f32; 3]>>)> {
    let stand = support::Stand { up: [0.0, 0.0, 1.0], forward: [1.0, 0.0, 0.0], step_mm: 8.0, turn_deg: 0.0 };
    support::centre_points(&support::walk(), stand)
}

#[test]
fn trc_files_of_other_programs_are_read() {
    let text = support::trc(&markers(), 150.0);
    let whole = read("a.trc", text.as_bytes()).unwrap();
    let same = |text: &str| {
        let raw = read("a.trc", text.as_bytes()).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((&raw.time_s, &raw.joints), (&whole.time_s, &whole.joints));
        raw.notes
    };
    same(&text.replacen("Frame#\tTime", "Frame#\tTimes", 1));
    same(&text.replacen("Frame#\tTime", "Frame\ttime (s)", 1));
    // Two tabs between the values of the header: the numbers and the unit are found all the same.
    let lines: Vec<&str> = text.lines().collect();
    let doubled = text.replacen(lines[2], &lines[2].replace('\t', "\t\t"), 1);
    assert_eq!(same(&doubled), whole.notes);
    let frames = format!("\t{}\t", whole.time_s.len());
    let announced = |text: &str| same(&text.replacen(&frames, "\t999\t", 1));
    assert!(announced(&text).iter().any(|note| note.contains("NumFrames") && note.contains("999")), "{frames}");
    assert_eq!(announced(&doubled), announced(&text));
    // The last marker is missing in some rows, with and without its tabs.
    let without = |trimmed: bool| -> String {
        let row = |(n, row): (usize, &&str)| {
            let fields: Vec<&str> = row.split('\t').collect();
            if (60..70).contains(&n) {
                fields[..fields.len() - 3].join("\t") + if trimmed { "" } else { "\t\t\t" }
            } else {
                (*row).to_owned()
            }
        };
        lines.iter().enumerate().map(row).collect::<Vec<_>>().join("\n") + "\n"
    };
    let missing = read("a.trc", without(false).as_bytes()).unwrap();
    let trimmed = read("a.trc", without(true).as_bytes()).unwrap();
    assert_eq!(format!("{:?}", trimmed.joints), format!("{:?}", missing.joints));
    assert!(
        trimmed.notes.iter().any(|note| note.starts_with("10 rows end before their last marker, the first in line 61"))
    );
    // A row that ends within a marker is damaged, and the last one may be cut off.
    let cut = text.trim_end().rsplit_once('\t').unwrap().0;
    assert!(read("a.trc", format!("{cut}\n").as_bytes()).unwrap_err().contains("fields; allowed are"));
    assert!(read("a.trc", cut.as_bytes()).unwrap().notes.iter().any(|note| note.contains("cut short")));
}

#[test]
fn points_without_a_value_do_not_hide_those_beside_them() {
    let mut points = markers();
    let frames = points[0].1.len();
    let whole = read("a.trc", support::trc(&points, 150.0).as_bytes()).unwrap();
    // Centres of a model that was not run, and angles too.
    for (name, _) in &mut points {
        let joint = name[1..].replace("HJC", "HIP").replace("KJC", "KNEE").replace("AJC", "ANKLE");
        *name = format!("{}{joint}", &name[..1]);
    }
    let empty = ["LHJC", "RHJC", "LKJC", "RAJC"].map(|name| (name.to_owned(), vec![None; frames]));
    let points: Vec<_> = empty.into_iter().chain(points).collect();
    let raw = read("a.trc", support::trc(&points, 150.0).as_bytes()).unwrap();
    assert!(
        raw.notes.iter().any(|note| note.contains("`LHJC`") && note.contains("no value in any frame")),
        "{:?}",
        raw.notes
    );
    let angles = |raw: &RawJoints| raw.joints.clone().map(|joint| joint.unwrap().angle_deg);
    assert_eq!(angles(&raw), angles(&whole));
    let with_angles: Vec<_> =
        LABS.map(|name| (name.to_owned(), vec![None; frames])).into_iter().chain(points).collect();
    let raw = read("a.c3d", &C3d::new(Format::Intel, None, 150.0, with_angles).bytes()).unwrap();
    assert!(
        raw.notes.iter().any(|note| note.contains("`LKneeAngles`") && note.contains("no value in any frame")),
        "{:?}",
        raw.notes
    );
    assert!(raw.joints.iter().flatten().count() == 4);
}

#[test]
fn a_tilted_vertical_is_noticed() {
    let tilted = |deg: f64, sideways: bool| {
        let (sin, cos) = deg.to_radians().sin_cos();
        let turn = |[x, y, z]: [f32; 3]| {
            let (x, y, z) = (f64::from(x), f64::from(y), f64::from(z));
            let to = if sideways {
                [x, cos * y + sin * z, cos * z - sin * y]
            } else {
                [cos * x + sin * z, y, cos * z - sin * x]
            };
            to.map(|value| value as f32)
        };
        let mut points = markers();
        points.iter_mut().flat_map(|(_, track)| track.iter_mut().flatten()).for_each(|place| *place = turn(*place));
        read("a.trc", support::trc(&points, 150.0).as_bytes()).unwrap().doubts
    };
    for sideways in [false, true] {
        for deg in [-20.0, -13.0, 13.0, 20.0] {
            let doubts = tilted(deg, sideways);
            assert!(
                matches!(doubts[..], [Doubt::Vertical { lean_deg }] if (lean_deg - f64::abs(deg)).abs() < 6.0),
                "{deg}: {doubts:?}"
            );
        }
        assert_eq!(tilted(2.0, sideways), []);
    }
}

#[test]
fn frames_beyond_the_word_of_a_c3d_header_are_read_with_a_note() {
    let knee = |n: usize| Some([at(Joint::LeftKnee, n) as f32, 1.0, 2.0]);
    for frames in [65_535, 65_540, 66_000] {
        let points = vec![("LKneeAngles".to_owned(), (0..frames).map(knee).collect())];
        let bytes = C3d::new(Format::Intel, None, 100.0, points).bytes();
        // Without the numbers of frames in TRIAL, as some programs write it.
        let at_trial = bytes.windows(5).position(|part| part == b"TRIAL");
        let bytes = at_trial.map_or(bytes.clone(), |at| {
            let mut bytes = bytes;
            bytes[at..at + 5].copy_from_slice(b"OTHER");
            bytes
        });
        let raw = read("a.c3d", &bytes).unwrap();
        assert_eq!(raw.time_s.len(), frames);
        assert_eq!(
            raw.notes.iter().any(|note| note.contains("65535 frames") && note.contains(&frames.to_string())),
            frames > 65_535,
            "{:?}",
            raw.notes
        );
    }
}

#[test]
fn rows_of_separators_are_left_out() {
    let text = csv("", HEADER);
    let whole = read("a.csv", text.as_bytes()).unwrap();
    for (separator, empty) in [(',', ",,,,"), (';', ";;;;"), (',', ",,"), (',', "\"\",\"\",,,"), (',', " , , , , ")] {
        let text = text.replace(',', &separator.to_string());
        let lines: Vec<&str> = text.lines().collect();
        let behind = format!("{text}{empty}\n{empty}\n");
        let between = format!("{}\n{empty}\n{}\n", lines[..50].join("\n"), lines[50..].join("\n"));
        for (text, rows, line) in [(behind, 2, 402), (between, 1, 51)] {
            let raw = read("a.csv", text.as_bytes()).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!((&raw.time_s, &raw.joints), (&whole.time_s, &whole.joints));
            let note = format!("{rows} rows have nothing between their separators, the first in line {line}");
            assert!(raw.notes.iter().any(|found| found.starts_with(&note)), "{:?}", raw.notes);
        }
    }
}

#[test]
fn missing_values_of_other_programs_are_missing() {
    for word in ["-1.#IND", "1.#QNAN0", "-1.#IND000000", "-nan(ind)", "nan(snan)", "#DIV/0!", "#N/A", "None"] {
        let text =
            csv("", HEADER).replacen(&format!("\n0.5,{:.4}", at(Joint::LeftHip, 50)), &format!("\n0.5,{word}"), 1);
        assert!(read("a.csv", text.as_bytes()).unwrap().joints[0].as_ref().unwrap().angle_deg[50].is_nan(), "{word}");
        let mot = sto("Coordinates", "inDegrees=yes", &[], 1.0);
        let mot = mot.replacen(&format!("\n0.5\t{}", at(Joint::LeftHip, 50)), &format!("\n0.5\t{word}"), 1);
        assert!(read("a.mot", mot.as_bytes()).unwrap().joints[0].as_ref().unwrap().angle_deg[50].is_nan(), "{word}");
    }
}

#[test]
fn times_in_another_unit_are_refused_by_the_speed_of_the_legs() {
    for (heading, factor, unit) in [
        ("time_ms", 1.0, "seconds, under a heading"),
        ("time_s", 1.0 / 60.0, "minutes"),
        ("time_us", 1000.0, "seconds, under a heading"),
    ] {
        let text: String = csv("", HEADER)
            .lines()
            .enumerate()
            .map(|(n, row)| match (n, row.split_once(',')) {
                (0, _) => row.replacen("time_s", heading, 1) + "\n",
                (_, Some((time, rest))) => format!("{},{rest}\n", time.parse::<f64>().unwrap() * factor),
                _ => String::new(),
            })
            .collect();
        let raw = read("a.csv", text.as_bytes()).unwrap();
        let error = condition(&raw, &Rules::default()).unwrap_err().to_string();
        assert!(error.contains("no leg is that fast") && error.contains(unit), "{error}");
    }
    // Fast runs and fine clocks are none.
    for (rate_hz, period_s) in [(2000.0, 0.45), (100.0, 0.45), (30.0, 2.0), (1000.0, 1.1)] {
        assert!(
            condition(&synthetic::walk(4.0, rate_hz, period_s, 0.0), &Rules::default()).is_ok(),
            "{rate_hz} {period_s}"
        );
    }
}

#[test]
fn strides_of_a_turn_are_marked() {
    for (strides, start) in [(2.6, 0.1), (2.8, 0.7), (3.4, 0.0)] {
        let raw = |differ: f64| {
            synthetic::raw(synthetic::times(strides * PERIOD_S, RATE_HZ), |joint, t| {
                let phase = start + t / PERIOD_S;
                angle(joint, phase) * (1.0 + differ * (std::f64::consts::PI * phase).cos())
            })
        };
        let walk = segment(&plain(&raw(0.3))).unwrap();
        let finding = walk.differ().unwrap_or_else(|| panic!("{strides}: {:?}", walk.spans));
        assert_eq!(finding.level(), Level::Warning);
        assert!(finding.to_string().contains("strides differ by") && finding.to_s - finding.from_s > 1.5, "{finding}");
        assert_eq!(segment(&plain(&raw(0.0))).unwrap().differ(), None);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]
    /// Exactly one cycle in seconds, from any phase: its ends meet.
    #[test]
    fn a_whole_cycle_in_seconds_is_a_stride(start in 0.0_f64..1.0, period in 0.6_f64..2.0, rate in 50.0_f64..240.0) {
        let rows = (period * rate).round();
        let times: Vec<f64> = (0..=rows as usize).map(|n| 3.0 + n as f64 * period / rows).collect();
        let raw = synthetic::raw(times, |joint, t| angle(joint, start + (t - 3.0) / period));
        let walk = segment(&plain(&raw)).unwrap_or_else(|error| panic!("{error}"));
        prop_assert!((walk.period_s / period - 1.0).abs() < 0.08, "{} for {period}", walk.period_s);
    }

    /// Windows of two to three strides of a turn, in which every other stride is larger.
    #[test]
    fn a_turn_has_strides_of_one_period(start in 0.0_f64..2.0, strides in 2.1_f64..2.9, differ in 0.0_f64..0.25) {
        let raw = synthetic::raw(synthetic::times(strides * PERIOD_S, RATE_HZ), |joint, t| {
            let phase = start + t / PERIOD_S;
            angle(joint, phase) * (1.0 + differ * (std::f64::consts::PI * phase).cos())
        });
        let walk = segment(&plain(&raw)).unwrap_or_else(|error| panic!("{error}"));
        prop_assert!((walk.period_s / PERIOD_S - 1.0).abs() < 0.15, "{}", walk.period_s);
        if differ < 0.05 {
            prop_assert_eq!(walk.differ(), None);
        }
    }
}
