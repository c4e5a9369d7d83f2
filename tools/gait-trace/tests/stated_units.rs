//! Units: what a file states holds against a map, where each unit is from is known, and an unstated unit that gives no gait is refused.

mod support;
mod synthetic;

use gait_trace::format::angle_unit::AngleUnit;
use gait_trace::format::open;
use gait_trace::{ConditionError, RawJoints, ReadOptions, Rules, UnitSource, condition};
use joint_units::Joint;
use std::fmt::Write as _;
use support::{mot, walk};
use synthetic::angle;

fn read(name: &str, text: &str, how: &ReadOptions<'_>) -> Result<RawJoints, String> {
    open::of_bytes(name, text.as_bytes(), how).map_err(|error| error.to_string())
}

fn mapped(map: &str) -> ReadOptions<'static> {
    let mut how = ReadOptions::default();
    how.add_map(map).unwrap();
    how
}

/// A walk of ten seconds with such endings of the headings, each angle `offset + scale * angle`.
fn table(ending: &str, offset: f64, scale: f64) -> String {
    let names = Joint::ALL.map(|joint| format!("{}{ending}", joint.name()));
    let mut text = format!("time_s,{}\n", names.join(","));
    for n in 0..1000 {
        let t = f64::from(n) * 0.01;
        let fields = Joint::ALL.map(|joint| format!("{:.6}", offset + scale * angle(joint, t / 1.1)));
        let _ = writeln!(text, "{t:.3},{}", fields.join(","));
    }
    text
}

const ALL: &str = "left_hip=2,right_hip=3,left_knee=4,right_knee=5";

#[test]
fn a_map_does_not_override_what_a_heading_states() {
    for (ending, states) in [
        (" (mA)", "the unit `mA`"),
        ("_mA", "the unit `mA`"),
        (" [Nm]", "the unit `Nm`"),
        (" (rad/s)", "an angle per time"),
        (" (deg/s)", "an angle per time"),
        ("_velocity", "the quantity `velocity`"),
        (" [%]", "the unit `%`"),
        (" (cm)", "the unit `cm`"),
        ("_torque_nm", "the quantity `torque`"),
    ] {
        let text = table(ending, 0.0, 1.0);
        for unit in [None, Some(AngleUnit::Degrees)] {
            let error = read("a.csv", &text, &ReadOptions { unit, ..mapped(ALL) }).unwrap_err();
            let column = format!("a.csv:1: column 2 `left_hip{ending}`: `left_hip{ending}` states {states}");
            assert!(error.starts_with(&column), "{error}");
            assert!(error.contains("angles in degrees or radians, and volts with `--calibration FILE`"), "{error}");
        }
    }
    // Volts are asked for their calibration, angles are read.
    assert!(read("a.csv", &table(" [V]", 1.0, 0.01), &mapped(ALL)).unwrap_err().contains("--calibration FILE"));
    assert!(read("a.csv", &table(" [deg]", 0.0, 1.0), &mapped(ALL)).is_ok());
    assert!(read("a.csv", &table("", 0.0, 1.0), &mapped(ALL)).is_ok());
}

#[test]
fn a_map_of_other_formats_does_not_either() {
    let head = "\ta.c3d\ta.c3d\n\tLeft Knee Angle\tLeft Knee Moment\n\tLINK_MODEL_BASED\tLINK_MODEL_BASED\n\tORIGINAL\tORIGINAL\nITEM\tX\tX\n";
    let rows: String = (0..30).map(|n| format!("{}\t{n}.5\t{n}.5\n", n + 1)).collect();
    let moment = ReadOptions { rate_hz: Some(100.0), ..mapped("left_knee=Left Knee Moment") };
    let error = read("a.txt", &format!("{head}{rows}"), &moment).unwrap_err();
    assert!(error.contains("`Left Knee Moment` states the quantity `moment`, which is no angle"), "{error}");
    // The type of a signal is stated too.
    let analog = head.replace("Left Knee Moment", "Gonio").replacen("LINK_MODEL_BASED\n", "ANALOG\n", 1);
    let gonio = ReadOptions { rate_hz: Some(100.0), ..mapped("left_knee=Gonio") };
    let error = read("a.txt", &format!("{analog}{rows}"), &gonio).unwrap_err();
    assert!(error.contains("`Gonio` states the type `ANALOG`"), "{error}");

    let text = mot(&walk(), 1, "\t", true).replace("hip_flexion_l", "hip_flexion_l/speed");
    let error = read("a.mot", &text, &mapped("left_hip=hip_flexion_l/speed")).unwrap_err();
    assert!(error.contains("states the quantity `speed`"), "{error}");
}

#[test]
fn a_row_of_units_that_contradicts_the_heading_is_an_error() {
    let with = |units: &str| table("_deg", 0.0, 1.0).replacen('\n', &format!("\n{units}\n"), 1);
    assert!(read("a.csv", &with("s,deg,deg,deg,deg"), &ReadOptions::default()).is_ok());
    for (units, column) in
        [("ms,deg,deg,deg,deg", "column 1 `time_s`"), ("s,deg,rad,deg,deg", "column 3 `right_hip_deg`")]
    {
        let error = read("a.csv", &with(units), &ReadOptions::default()).unwrap_err();
        assert!(error.starts_with(&format!("a.csv:2: {column}: `the unit below the heading` is")), "{error}");
    }
}

/// Volts around 0, turns, milliamperes and other small numbers under the names of joints.
#[test]
fn an_unstated_unit_that_gives_no_gait_is_refused() {
    for (what, offset, scale) in [
        ("volts around 0, -0.2 to 0.3", -0.2, 0.0083),
        ("turns", 0.0, 1.0 / 360.0),
        ("a tenth of radians", 0.0, 0.1_f64.to_radians()),
        ("milliamperes", 12.0, 0.13),
    ] {
        let raw = read("a.csv", &table("", offset, scale), &ReadOptions::default()).unwrap();
        let error = condition(&raw, &Rules::default()).unwrap_err();
        assert!(matches!(error, ConditionError::UnitNotStated { .. }), "{what}: {error}");
        let error = error.to_string();
        assert!(error.contains("is not stated") && error.contains("`--unit degrees|radians`"), "{what}: {error}");
        // Whoever confirms the unit has it.
        let how = ReadOptions { unit: Some(AngleUnit::Degrees), ..ReadOptions::default() };
        let asked = condition(&read("a.csv", &table("", offset, scale), &how).unwrap(), &Rules::default());
        assert!(!matches!(asked, Err(ConditionError::UnitNotStated { .. })), "{what}");
    }
    for scale in [1.0, 1_f64.to_radians()] {
        let raw = read("a.csv", &table("", 0.0, scale), &ReadOptions::default()).unwrap();
        assert!(condition(&raw, &Rules::default()).is_ok());
    }
}

#[test]
fn where_the_unit_is_from_is_known() {
    let of = |name: &str, text: &str, how: &ReadOptions<'_>| {
        let raw = read(name, text, how).unwrap_or_else(|error| panic!("{error}"));
        raw.joints.iter().flatten().next().unwrap().unit
    };
    let plain = ReadOptions::default();
    assert_eq!(of("a.csv", &table("_deg", 0.0, 1.0), &plain).to_string(), "degrees, stated in the file");
    assert_eq!(of("a.csv", &table("", 0.0, 1.0), &plain), UnitSource::Inferred(AngleUnit::Degrees));
    let asked = ReadOptions { unit: Some(AngleUnit::Degrees), ..ReadOptions::default() };
    assert_eq!(of("a.csv", &table("", 0.0, 1.0), &asked), UnitSource::Requested(AngleUnit::Degrees));
    assert_eq!(of("a.mot", &mot(&walk(), 1, "\t", false), &plain), UnitSource::Stated(AngleUnit::Radians));
    let vicon = "Model Outputs\n100\n,,LKneeAngles,,\nFrame,Sub Frame,X,Y,Z\n,,deg,deg,deg\n1,0,5,1,1\n2,0,6,1,1\n";
    assert_eq!(of("a.csv", vicon, &plain), UnitSource::Stated(AngleUnit::Degrees));
}
