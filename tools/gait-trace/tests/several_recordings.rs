//! Rows of several recordings in one CSV file are never read as one person: a column tells them apart, or their times and angles do.

mod synthetic;

use gait_trace::format::open;
use gait_trace::{RawJoints, ReadOptions, Rules, condition};
use joint_units::Joint;
use std::fmt::Write as _;
use synthetic::angle;

/// Rows of each person.
const ROWS: usize = 400;

/// Person, time and joints of a row.
type Row = (usize, f64, [f64; 4]);

/// The angles of a person at a time: the second one walks out of step, with smaller steps.
fn angles(person: usize, t: f64) -> [f64; 4] {
    Joint::ALL.map(|joint| if person == 0 { angle(joint, t / 1.1) } else { 0.7 * angle(joint, t / 1.2 + 0.3) })
}

fn of_person(person: usize, start_s: f64) -> impl Iterator<Item = Row> {
    (0..ROWS).map(move |n| {
        let t = n as f64 * 0.01;
        (person, start_s + t, angles(person, t))
    })
}

fn one_below_the_other(second_start_s: f64) -> Vec<Row> {
    of_person(0, 0.0).chain(of_person(1, second_start_s)).collect()
}

fn taking_turns(second_start_s: f64) -> Vec<Row> {
    of_person(0, 0.0).zip(of_person(1, second_start_s)).flat_map(|(a, b)| [a, b]).collect()
}

/// A table; `mark` is the heading of the column that tells the persons apart, and what it has for each.
fn table(rows: &[Row], mark: Option<(&str, [&str; 2])>) -> String {
    let heading = mark.map_or(String::new(), |(heading, _)| format!("{heading},"));
    let mut text = format!("{heading}time_s,left_hip_deg,right_hip_deg,left_knee_deg,right_knee_deg\n");
    for (person, time_s, [a, b, c, d]) in rows {
        let value = mark.map_or(String::new(), |(_, values)| format!("{},", values[*person]));
        let _ = writeln!(text, "{value}{time_s:.4},{a:.4},{b:.4},{c:.4},{d:.4}");
    }
    text
}

fn read(text: &str, only: &[&str]) -> Result<RawJoints, String> {
    let mut how = ReadOptions::default();
    how.only.extend(only.iter().map(|rows| rows.parse().unwrap()));
    open::of_bytes("a.csv", text.as_bytes(), &how).map_err(|error| error.to_string())
}

#[test]
fn a_column_of_subjects_or_trials_is_an_error_that_lists_them() {
    let marks = [
        ("subject", ["Anna", "Bert"]),
        ("id", ["0", "1"]),
        ("Subject ID", ["S01", "S02"]),
        ("participant", ["7", "8"]),
        ("trial", ["1", "2"]),
        ("side", ["left", "right"]),
    ];
    for mark @ (heading, [first, second]) in marks {
        for rows in [one_below_the_other(0.0), one_below_the_other(10.0), taking_turns(0.0), taking_turns(0.005)] {
            let text = table(&rows, Some(mark));
            let error = read(&text, &[]).unwrap_err();
            assert!(error.starts_with(&format!("a.csv:1: column 1 `{heading}`: the rows of several")), "{error}");
            assert!(error.contains(&format!("`{first}` (400 rows), `{second}` (400 rows)")), "{error}");
            let example = format!("{heading}={first}");
            assert!(error.contains("`--where ") && error.contains(&example), "{error}");
            for (person, value) in [first, second].into_iter().enumerate() {
                let raw = read(&text, &[&format!("{heading}={value}")]).unwrap();
                assert_eq!(raw.time_s.len(), ROWS);
                for (row, time_s) in (0..ROWS).map(|n| (n, n as f64 * 0.01)) {
                    for (joint, angle) in Joint::ALL.into_iter().zip(angles(person, time_s)) {
                        let found = raw.joints[joint as usize].as_ref().unwrap().angle_deg[row];
                        assert!((found - angle).abs() < 1e-4, "{heading}={value} {joint:?} {row}: {found} {angle}");
                    }
                }
                let note = format!("Only rows with `{value}` in `{heading}` are read, as requested: 400 of 800.");
                assert!(raw.notes.contains(&note), "{:?}", raw.notes);
            }
        }
    }
}

#[test]
fn one_subject_is_a_note_and_a_column_that_tells_nothing_apart_can_be_passed_over() {
    let one: Vec<Row> = of_person(0, 0.0).collect();
    let raw = read(&table(&one, Some(("subject", ["Anna", ""]))), &[]).unwrap();
    assert!(raw.notes.contains(&"`subject` is `Anna` in all rows.".to_owned()), "{:?}", raw.notes);
    let text = table(&one_below_the_other(4.0), Some(("run", ["0", "1"])));
    assert!(read(&text, &[]).is_err());
    let raw = read(&text, &["run=*"]).unwrap();
    assert!(raw.time_s.len() == 2 * ROWS && raw.notes[0].contains("read as one recording, as requested"));
    // Two columns, and both have to fit.
    let text = text.replace("run,", "subject,run,").replace("\n0,", "\nAnna,0,").replace("\n1,", "\nAnna,1,");
    let error = read(&text, &[]).unwrap_err();
    assert!(error.contains("column 2 `run`"), "{error}");
    assert_eq!(read(&text, &["subject=Anna", "run=1"]).unwrap().time_s.len(), ROWS);
    assert!(
        read(&text, &["subject=Anna", "run=3"]).unwrap_err().contains("no row has `3` (`--where`); there are `0` (400")
    );
    assert!(read(&text, &["who=Anna"]).unwrap_err().contains("`--where` names the column `who`"));
}

/// The only joint of the rows is that of the leg that they name.
#[test]
fn a_column_of_sides_puts_a_joint_without_side_on_its_leg() {
    let knees = |name: &str| {
        let rows: String = (0..60).map(|n| format!("{name},{},{}\n", f64::from(n) * 0.01, 20 + n % 7)).collect();
        format!("leg,time_s,knee_deg\n{rows}")
    };
    let both = format!("{}{}", knees("left"), knees("right").replace("leg,time_s,knee_deg\n", ""));
    for (only, joint) in [("leg=left", Joint::LeftKnee), ("leg=right", Joint::RightKnee)] {
        let raw = read(&both, &[only]).unwrap();
        assert!(raw.joints[joint as usize].is_some() && raw.joints.iter().flatten().count() == 1, "{only}");
        let note = format!("it is read as {}, by the rows", joint.name());
        assert!(raw.notes.iter().any(|found| found.contains(&note)), "{:?}", raw.notes);
    }
    assert!(read(&knees("R"), &[]).unwrap().joints[Joint::RightKnee as usize].is_some());
}

#[test]
fn rows_are_chosen_in_csv_only() {
    let text = "walk\nversion=1\nnRows=2\nnColumns=2\ninDegrees=yes\nendheader\ntime\tknee_angle_l\n0\t1\n0.01\t2\n";
    let mut how = ReadOptions::default();
    how.only.push("subject=Anna".parse().unwrap());
    let error = open::of_bytes("a.mot", text.as_bytes(), &how).unwrap_err().to_string();
    assert_eq!(
        error,
        "a.mot: rows are chosen (`--where`), but this is no CSV file; allowed is `--where` for CSV files"
    );
}

/// Without such a column: times that begin again, rows of equal times, and rows that take turns.
#[test]
fn without_a_column_times_and_angles_show_it() {
    let error = |rows: Vec<Row>| {
        let raw = read(&table(&rows, None), &[]).unwrap();
        condition(&raw, &Rules::default()).unwrap_err().to_string()
    };
    let again = error(one_below_the_other(0.0));
    assert!(
        again.contains("row 401: time 0 s after 3.99 s") && again.contains("one below the other; split"),
        "{again}"
    );
    for rows in [taking_turns(0.0), taking_turns(0.005)] {
        let turns = error(rows);
        assert!(
            turns.starts_with("a.csv: the rows are of several recordings: ") && turns.contains("--where"),
            "{turns}"
        );
    }
    let one = condition(&read(&table(&of_person(0, 0.0).collect::<Vec<_>>(), None), &[]).unwrap(), &Rules::default());
    assert!(one.unwrap().findings.is_empty());
}
