//! Columns that are components: of quaternions and positions, which are no angles, and of angles, of which one is flexion.

mod synthetic;

use gait_trace::format::open;
use gait_trace::options::Axis;
use gait_trace::{Doubt, RawJoints, ReadOptions};
use joint_units::Joint;
use std::fmt::Write as _;
use synthetic::angle;

const AXES: [&str; 3] = ["x", "y", "z"];

/// Rows of a time and of components of each joint, of which `flexion` is the angle and the others move by less.
fn table(names: [&str; 4], heading: impl Fn(&str, &str) -> String, flexion: usize, others: f64) -> String {
    let headings = names.iter().flat_map(|name| AXES.map(|axis| heading(name, axis)));
    let mut text = format!("time_s,{}\n", headings.collect::<Vec<_>>().join(","));
    for n in 0..400 {
        let t = f64::from(n) * 0.01;
        let _ = write!(text, "{t:.2}");
        for joint in Joint::ALL {
            for axis in 0..3 {
                let by = if axis == flexion { 1.0 } else { others };
                let _ = write!(text, ",{:.4}", by * angle(joint, t / 1.1 + 0.1 * (axis as f64 - flexion as f64)));
            }
        }
        text.push('\n');
    }
    text
}

fn read(text: &str, map: &str, axis: Option<Axis>) -> Result<RawJoints, String> {
    let mut how = ReadOptions { axis, ..ReadOptions::default() };
    if !map.is_empty() {
        how.add_map(map).unwrap();
    }
    open::of_bytes("a.csv", text.as_bytes(), &how).map_err(|error| error.to_string())
}

fn is_flexion(raw: &RawJoints) -> bool {
    Joint::ALL.into_iter().all(|joint| {
        let values = &raw.joints[joint as usize].as_ref().unwrap().angle_deg;
        values.iter().enumerate().all(|(n, value)| (value - angle(joint, n as f64 * 0.01 / 1.1)).abs() < 1e-3)
    })
}

const LABS: [&str; 4] = ["LHipAngles", "RHipAngles", "LKneeAngles", "RKneeAngles"];
const PLAIN: [&str; 4] = ["left_hip", "right_hip", "left_knee", "right_knee"];

#[test]
fn the_component_that_moves_like_flexion_is_read_for_all_joints() {
    for (flexion, axis) in AXES.into_iter().enumerate() {
        let tables = [
            table(PLAIN, |name, axis| format!("{name}_{axis}_deg"), flexion, 0.2),
            table(PLAIN, |name, axis| format!("{name}_angle.{axis}"), flexion, 0.2),
            table(PLAIN, |name, axis| format!("{name}{} [deg]", axis.to_uppercase()), flexion, 0.2),
        ];
        for text in tables {
            let raw = read(&text, "", None).unwrap();
            assert!(is_flexion(&raw), "{axis}: {}", text.lines().next().unwrap());
            assert_eq!(raw.doubts, [Doubt::Component(Axis::ALL[flexion])]);
        }
        // Plug-in Gait defines the first one; the names with another one are those of another model.
        for text in [
            table(LABS, |name, axis| format!("{name}_{} (deg)", axis.to_uppercase()), flexion, 0.2),
            table(LABS, |name, axis| format!("{name}{} [deg]", axis.to_uppercase()), flexion, 0.2),
        ] {
            match read(&text, "", None) {
                Ok(raw) => assert!(flexion == 0 && is_flexion(&raw) && raw.doubts.is_empty(), "{axis}"),
                Err(error) => assert!(
                    flexion > 0 && error.contains("Plug-in Gait") && error.contains("`--axis x|y|z`"),
                    "{error}"
                ),
            }
        }
    }
}

#[test]
fn an_unclear_component_needs_the_axis_or_a_whole_map() {
    let text = table(PLAIN, |name, axis| format!("{name}_{axis} (deg)"), 2, 0.9);
    let error = read(&text, "", None).unwrap_err();
    assert!(error.contains("`left_hip_x (deg)`, `left_hip_y (deg)`, `left_hip_z (deg)` are components"), "{error}");
    assert!(error.contains("`--axis x|y|z`") && !error.contains("--knee-sign"), "{error}");
    let raw = read(&text, "", Some(Axis::Z)).unwrap();
    assert!(is_flexion(&raw) && raw.joints[0].as_ref().unwrap().column == "left_hip_z (deg)");
    // Each joint of the map on its third column.
    assert!(is_flexion(&read(&text, "left_hip=4,right_hip=7,left_knee=10,right_knee=13", None).unwrap()));
    // The hips follow the knees of the map.
    let raw = read(&text, "left_knee=10,right_knee=13", None).unwrap();
    assert!(is_flexion(&raw) && raw.notes.iter().any(|note| note.contains("component z of the angles, as the map")));
    assert!(read(&text, "left_knee=10,right_knee=12", None).unwrap_err().contains("the map takes several components"));
}

#[test]
fn positions_are_no_angles() {
    let text = table(PLAIN, |name, axis| format!("{name}_{axis}"), 0, 0.2);
    let error = read(&text, "", None).unwrap_err();
    assert!(error.contains("`left_hip_x`, `left_hip_y`, `left_hip_z` are components without"), "{error}");
    assert!(error.contains("positions of markers") && !error.contains("--unit"), "{error}");
    assert!(read(&text, "left_knee=8,right_knee=11", None).is_err());
    assert!(read(&text, "", Some(Axis::X)).is_ok());
    let kinect = text.replacen("left_hip_x", "HipLeft_X", 1);
    assert!(read(&kinect, "", None).unwrap_err().contains("`HipLeft_X`, `left_hip_y`, `left_hip_z`"));
    // A column of the angle itself goes before them, and a row of units says what they are.
    let beside = text.replacen("left_hip_y", "left_hip_deg", 1).replace("right_hip_y", "right_hip_deg");
    let beside = beside.replace("left_knee_y", "left_knee_deg").replace("right_knee_y", "right_knee_deg");
    assert_eq!(read(&beside, "", None).unwrap().joints[0].as_ref().unwrap().column, "left_hip_deg");
    let units = text.replacen('\n', &format!("\ns{}\n", ",deg".repeat(12)), 1);
    assert!(is_flexion(&read(&units, "", None).unwrap()));
}

#[test]
fn quaternions_are_no_angles() {
    let with_w = |text: &str, w: &dyn Fn(&str) -> String| {
        let (head, rows) = text.split_once('\n').unwrap();
        let rows: String = rows.lines().map(|row| format!("{row},0.9,0.9,0.9,0.9\n")).collect();
        format!("{head},{}\n{rows}", PLAIN.map(w).join(","))
    };
    for sign in ["_", ".", " "] {
        let text = table(PLAIN, |name, axis| format!("{name}{sign}{axis}"), 0, 0.2);
        let text = with_w(&text, &|name| format!("{name}{sign}W"));
        for map in ["", "left_hip=2"] {
            let error = read(&text, map, None).unwrap_err();
            assert!(error.contains("column 2 ") && error.contains("components of a quaternion, not angles"), "{error}");
            assert!(
                error.contains(&format!("`left_hip{sign}W`")) && error.contains("--map left_hip=COLUMN"),
                "{error}"
            );
        }
    }
}

#[test]
fn an_axis_is_for_components_only() {
    let text = "time_s,left_knee_deg\n0,1\n0.01,2\n";
    assert!(read(text, "", Some(Axis::X)).unwrap_err().contains("no angles of three components"));
}
