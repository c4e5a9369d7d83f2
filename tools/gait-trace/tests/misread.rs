//! Tables and exports that look like a recording and were read as another one: each is read as it is, or refused with the reason.

mod support;
mod synthetic;

use gait_trace::format::open;
use gait_trace::{RawJoints, ReadOptions, Rules, condition};
use joint_units::Joint;
use std::fmt::Write as _;
use synthetic::angle;

const JOINTS: &str = "left_hip_deg,right_hip_deg,left_knee_deg,right_knee_deg";

/// A table of a heading, the fields of each row in front, and angles that `of` puts in.
fn table(head: &str, rows: usize, of: impl Fn(usize, [f64; 4]) -> String) -> String {
    let mut text = format!("{head}\n");
    for n in 0..rows {
        let _ = writeln!(text, "{}", of(n, Joint::ALL.map(|joint| angle(joint, n as f64 * 0.01 / 1.1))));
    }
    text
}

fn fields(values: [f64; 4]) -> String {
    values.map(|value| format!("{value:.6}")).join(",")
}

fn read(name: &str, text: &str) -> Result<RawJoints, String> {
    open::of_bytes(name, text.as_bytes(), &ReadOptions::default()).map_err(|error| error.to_string())
}

#[test]
fn values_between_0_and_1_are_normalised() {
    let limits = Joint::ALL.map(|joint| {
        let all = (0..400).map(|n| angle(joint, f64::from(n) * 0.01 / 1.1));
        all.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), x| (x.min(least), x.max(most)))
    });
    let text = table("time_s,left_hip,right_hip,left_knee,right_knee", 400, |n, values| {
        let values = std::array::from_fn(|j| (values[j] - limits[j].0) / (limits[j].1 - limits[j].0));
        format!("{:.2},{}", n as f64 * 0.01, fields(values))
    });
    let error = read("a.csv", &text).unwrap_err();
    assert!(
        error.contains("normalised by their smallest and largest value") && error.contains("--unit radians"),
        "{error}"
    );
    let stated = text.replacen("left_hip,", "left_hip_rad,", 1);
    assert!(read("a.csv", &stated).is_ok());
}

#[test]
fn a_label_of_any_name_that_changes_in_long_blocks_marks_recordings() {
    let of = |label: &'static dyn Fn(usize) -> &'static str, heading: &str| {
        let head = format!("time_s,{JOINTS},{heading}");
        table(&head, 800, |n, values| format!("{:.2},{},{}", n as f64 * 0.01, fields(values), label(n)))
    };
    let text = of(&|n| if n < 400 { "Anna" } else { "Bert" }, "who");
    let error = read("a.csv", &text).unwrap_err();
    assert!(error.contains("column 6 `who`") && error.contains("`Anna` (400 rows), `Bert` (400 rows)"), "{error}");
    assert!(error.contains("`--where who=Anna`"), "{error}");
    for (only, rows) in [("who=Bert", 400), ("who=*", 800)] {
        let mut how = ReadOptions::default();
        how.only.push(only.parse().unwrap());
        assert_eq!(open::of_bytes("a.csv", text.as_bytes(), &how).unwrap().time_s.len(), rows);
    }
    assert!(read("a.csv", &of(&|n| if n % 110 < 66 { "stance" } else { "swing" }, "phase")).is_ok());
    for heading in ["name", "pid", "MRN", "Probandennummer", "walk_no", "track_id", "set"] {
        assert!(read("a.csv", &of(&|n| if n < 400 { "1" } else { "2" }, heading)).is_err(), "{heading}");
    }
}

#[test]
fn several_cycles_in_a_second_are_no_normalised_cycle() {
    for (cycles, rows) in [(1, 200), (2, 200), (3, 100)] {
        let mut text = format!("time_s,{JOINTS}\n");
        for n in 0..=rows {
            let t = f64::from(n) / f64::from(rows);
            let _ = writeln!(text, "{t},{}", fields(Joint::ALL.map(|joint| angle(joint, t * f64::from(cycles)))));
        }
        let walk = condition(&read("a.csv", &text).unwrap(), &Rules::default()).unwrap();
        assert_eq!(walk.normalised_cycle, cycles == 1, "{cycles}");
    }
}

#[test]
fn stamps_of_a_clock_are_times() {
    for (heading, scale, start) in
        [("timestamp_ms", 1e3, 1.69e12), ("elapsed", 1.0, 0.0), ("Timestamp [us]", 1e6, 0.0), ("elapsed_ms", 1e3, 7.0)]
    {
        let head = format!("{heading},{JOINTS}");
        let text = table(&head, 200, |n, values| format!("{},{}", start + n as f64 * 0.01 * scale, fields(values)));
        let raw = read("a.csv", &text).unwrap();
        assert!((raw.time_s[100] - raw.time_s[0] - 1.0).abs() < 1e-3, "{heading}: {}", raw.time_s[100]);
    }
    // A time goes before a stamp.
    let head = format!("timestamp,time_s,{JOINTS}");
    let text = table(&head, 200, |n, values| format!("17:05,{},{}", n as f64 * 0.01, fields(values)));
    assert!((read("a.csv", &text).unwrap().time_s[100] - 1.0).abs() < 1e-9);
}

#[test]
fn units_of_other_languages_are_degrees_and_percent_is_none() {
    let of = |unit: &str| {
        let head = format!("time_s,left_hip [{unit}],right_hip [{unit}],left_knee [{unit}],right_knee [{unit}]");
        read("a.csv", &table(&head, 200, |n, values| format!("{},{}", n as f64 * 0.01, fields(values))))
    };
    for unit in ["Grad", "grados", "degrés", "º", "deg"] {
        assert!(of(unit).unwrap().joints[0].as_ref().unwrap().unit.to_string().contains("degrees, stated"), "{unit}");
    }
    for unit in ["%", "-", "grad"] {
        assert!(of(unit).is_err(), "{unit}");
    }
    assert!(of("%").unwrap_err().contains("states the unit `%`, which is no angle"));
}

#[test]
fn codes_for_missing_values_are_named() {
    let head = format!("time_s,{JOINTS}");
    for code in ["-999", "9999", "-999999"] {
        let text = table(&head, 400, |n, values| {
            let values = if n % 40 < 4 { [code; 4].join(",") } else { fields(values) };
            format!("{},{values}", n as f64 * 0.01)
        });
        let error = read("a.csv", &text).unwrap_err();
        assert!(error.contains(&format!("`{code}` in 40 of 400 rows")) && error.contains("empty field"), "{error}");
    }
}

#[test]
fn decreasing_times_may_be_of_several_recordings() {
    let head = format!("time_s,{JOINTS}");
    let error = |time: &dyn Fn(usize) -> f64| {
        let text = table(&head, 400, |n, values| format!("{},{}", time(n), fields(values)));
        condition(&read("a.csv", &text).unwrap(), &Rules::default()).unwrap_err().to_string()
    };
    let again = error(&|n| (n % 200) as f64 * 0.01);
    assert!(again.contains("the rows may be of several recordings, one below the other"), "{again}");
    let down = error(&|n| 10.0 - n as f64 * 0.01);
    assert!(down.contains("put the rows in order") && !down.contains("one below the other"), "{down}");
}

#[test]
fn a_fraction_is_no_percent_of_the_cycle() {
    let block = |name: &str| {
        let rows: String = (0..51).map(|n| format!("{}\n", 20 + n % 50)).collect();
        format!("!{name}\n{rows}")
    };
    let of = |contact: &str| {
        let blocks = ["LeftKneeFlexExt", "RightKneeFlexExt"].map(block).concat();
        read("a.gcd", &format!("#!DST-0.1 GCD\n!LeftOppositeFootContact\n{contact}\n{blocks}"))
    };
    assert!(of("50.5").is_ok());
    let error = of("0.50").unwrap_err();
    assert!(error.contains("`LeftOppositeFootContact` is 0.5") && error.contains("a fraction such as"), "{error}");
}

#[test]
fn markers_of_one_subject_are_read_without_its_name_and_of_two_are_refused() {
    let walk = support::walk();
    let stand = support::Stand { up: [0.0, 0.0, 1.0], forward: [1.0, 0.0, 0.0], step_mm: 0.0, turn_deg: 0.0 };
    let points = support::centre_points(&walk, stand);
    let called = |name: &str| points.iter().map(|(label, track)| (format!("{name}:{label}"), track.clone())).collect();
    let anna: Vec<_> = called("Anna");
    let of = |points: &[_]| read("a.trc", &support::trc(points, 150.0));
    let raw = of(&anna).unwrap();
    let bare = of(&points).unwrap();
    assert!(raw.joints.iter().zip(&bare.joints).all(|(a, b)| {
        let [a, b] = [a, b].map(|joint| joint.as_ref().unwrap());
        a.angle_deg.iter().zip(&b.angle_deg).all(|(a, b)| a == b || a.is_nan() && b.is_nan())
    }));
    let bert: Vec<_> = called("Bert");
    let both: Vec<_> = anna.into_iter().chain(bert).collect();
    let error = of(&both).unwrap_err();
    assert!(error.contains("markers of several subjects: `Anna`, `Bert`"), "{error}");
}
